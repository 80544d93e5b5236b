"""Mesh prims as triangulated surfaces."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from pxr import UsdGeom

from compiler.usd.cages import Cage, Cut, cut_polygons
from compiler.usd.clock import Clock
from compiler.usd.exact import exact_points
from compiler.usd.options import StageOptions
from compiler.usd.polygons import usable_faces
from compiler.usd.prims import Authored
from compiler.usd.refinement import SCHEMES, Refinement, refined
from compiler.usd.report import Report
from compiler.usd.schema import EXACT_POINTS
from compiler.usd.skinning import Skinning
from dsl.scene import FloatArray, IntArray, Mesh, MeshAttribute


@dataclass(frozen=True, slots=True, eq=False)
class MeshSurface:
    """A triangulated mesh that still knows its faces.

    `points` `(v, 3)` and the `cut` of the faces, whose places are those of refined corners if there
    is a `refinement`. `face_count` is the number of faces that the prim lists; triangles
    are `turned` against the prim's faces if those are left-handed. Points that are `posed` are not
    where the prim has them.
    """

    points: FloatArray
    cut: Cut
    face_count: int
    refinement: Refinement | None = None
    turned: bool = False
    posed: bool = False

    def part(
        self, chosen: IntArray | None = None, attributes: Sequence[MeshAttribute] = ()
    ) -> Mesh:
        """The mesh of the chosen triangles (all by default), with the points they use only.

        `attributes` are those of the whole surface.
        """
        triangles = self.cut.triangles
        if chosen is None and self.cut.whole:
            return Mesh(self.points, triangles, attributes=tuple(attributes))
        triangles = triangles if chosen is None else triangles[chosen]
        used = np.zeros(len(self.points), bool)
        used[triangles] = True
        whole = bool(used.all())
        own = tuple(
            MeshAttribute(
                attribute.name,
                attribute.values
                if whole or attribute.corners is not None
                else attribute.values[used],
                attribute.corners
                if chosen is None or attribute.corners is None
                else attribute.corners[chosen],
            )
            for attribute in attributes
        )
        if whole:
            return Mesh(self.points, triangles, attributes=own)
        renumbered = np.cumsum(used) - 1
        return Mesh(self.points[used], renumbered[triangles], attributes=own)


def read_mesh(
    prim: Any,
    cage: Cage,
    authored: Authored,
    clock: Clock,
    report: Report,
    options: StageOptions,
    coarser: int,
    skinning: Skinning | None,
) -> MeshSurface | None:
    """The surface of a mesh prim, or None (reported) if nothing of it can be drawn.

    What is not `authored` is not asked for.
    Subdivision meshes are refined to their limit surface if asked for, `coarser` times less than
    their faces allow (see `compiler.usd.refinement`); `skinning` poses them, if any. Normals of
    triangles point outwards by the prim's `orientation`. Faces in `holeIndices` are left
    out, but shape those around them.
    """
    if cage.points is None or cage.counts is None or cage.indices is None or not len(cage.counts):
        report.add("usd-mesh", _fault(prim, cage, clock), prim.GetPath())
        return None
    points = np.ascontiguousarray(cage.points, dtype=np.float64)
    cut, refinement = cage.cut, None
    if EXACT_POINTS in authored:
        points, cut = exact_points(prim, points, clock, report), None
    if skinning is not None:
        points, cut = skinning.posed(prim, points), None
    smooth = _is_smooth(cage.scheme, options, prim, report)
    if smooth or cut is None:
        counts, indices = (array.astype(np.int64) for array in (cage.counts, cage.indices))
        polygons = usable_faces(points, counts, indices)
        if smooth:
            points, polygons, refinement = refined(
                points, polygons, cage.scheme, prim, clock, report, options, coarser
            )
        for reason, number in polygons.dropped.items():
            report.add("usd-mesh", f"{number} faces {reason} are left out", prim.GetPath())
        cut = cut_polygons(points, polygons)
    if "holeIndices" in authored:
        cut = cut.without(clock.integers(prim.GetAttribute("holeIndices")))
    if not len(cut.triangles):
        message = "a mesh without a face that can be drawn draws nothing"
        report.add("usd-mesh", message, prim.GetPath())
        return None
    turned = (
        "orientation" in authored
        and clock.token(prim.GetAttribute("orientation")) == UsdGeom.Tokens.leftHanded
    )
    posed = skinning is not None
    return MeshSurface(
        points, cut.turned() if turned else cut, len(cage.counts), refinement, turned, posed
    )


def _fault(prim: Any, cage: Cage, clock: Clock) -> str:
    """Why a cage draws nothing."""
    for name, array in (
        ("points", cage.points),
        ("faceVertexCounts", cage.counts),
        ("faceVertexIndices", cage.indices),
    ):
        value = None if array is not None else clock.value(prim.GetAttribute(name))
        if value is not None and np.size(value):
            return f"a mesh whose `{name}` have the wrong type draws nothing"
    return "a mesh without points or faces draws nothing"


def _is_smooth(scheme: str, options: StageOptions, prim: Any, report: Report) -> bool:
    """Whether a mesh is to be refined; reported where its scheme is not used."""
    if scheme == "none":
        return False
    if scheme not in SCHEMES:
        message = f"`subdivisionScheme = {scheme!r}` is not known: the polygons are drawn"
        report.add("usd-subdivision", message, prim.GetPath())
        return False
    if options.complexity == "low":
        message = "subdivision meshes are drawn as their cages"
        help = "a higher complexity draws their limit"
        report.add("usd-subdivision", message, prim.GetPath(), help)
        return False
    return True
