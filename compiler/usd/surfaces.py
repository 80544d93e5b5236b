"""Mesh prims as triangulated surfaces."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from pxr import UsdGeom

from compiler.usd.clock import Clock
from compiler.usd.exact import exact_points
from compiler.usd.options import StageOptions
from compiler.usd.polygons import triangulate, usable_faces
from compiler.usd.refinement import SCHEMES, Refinement, refined
from compiler.usd.report import Report
from compiler.usd.schema import EXACT_POINTS, type_of
from compiler.usd.skinning import Skinning
from dsl.scene import FloatArray, IntArray, Mesh, MeshAttribute


@dataclass(frozen=True, slots=True, eq=False)
class MeshSurface:
    """A triangulated mesh that still knows its faces.

    `points` `(v, 3)`, `triangles` `(m, 3)`, `faces` `(m,)` the USD face of each triangle,
    `face_count` the number of faces that the prim lists. `places` `(m, 3)` say which of the prim's
    `faceVertexIndices` each corner is, or, with a `refinement`, which refined corner; triangles
    are `turned` against the prim's faces if those are left-handed. Points that are `posed` are not
    where the prim has them.
    """

    points: FloatArray
    triangles: IntArray
    faces: IntArray
    face_count: int
    places: IntArray
    refinement: Refinement | None = None
    turned: bool = False
    posed: bool = False

    def part(
        self, chosen: IntArray | None = None, attributes: Sequence[MeshAttribute] = ()
    ) -> Mesh:
        """The mesh of the chosen triangles (all by default), with the points they use only.

        `attributes` are those of the whole surface.
        """
        triangles = self.triangles if chosen is None else self.triangles[chosen]
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
    names: Collection[str],
    clock: Clock,
    report: Report,
    options: StageOptions,
    coarser: int,
    skinning: Skinning | None,
) -> MeshSurface | None:
    """The surface of a Mesh prim, or None (reported) if nothing of it can be drawn.

    `names` are those of its authored properties: what is not among them is not asked for.
    Subdivision meshes are refined to their limit surface if asked for, `coarser` times less than
    their faces allow (see `compiler.usd.refinement`); `skinning` poses them, if any. Normals of
    triangles point outwards by the prim's `orientation`. Faces in `holeIndices` are left
    out, but shape those around them.
    """
    path = prim.GetPath()
    points = clock.vectors(prim.GetAttribute("points"), 3)
    if type_of(prim) == "TetMesh":
        counts, indices = _surface_of_tetrahedra(prim, clock)
    else:
        counts = clock.integers(prim.GetAttribute("faceVertexCounts"))
        indices = clock.integers(prim.GetAttribute("faceVertexIndices"))
    for name, array in (
        ("points", points),
        ("faceVertexCounts", counts),
        ("faceVertexIndices", indices),
    ):
        value = None if array is not None else clock.value(prim.GetAttribute(name))
        if value is not None and np.size(value):
            message = f"a mesh whose `{name}` have the wrong type draws nothing"
            report.add("usd-mesh", message, path)
            return None
    if points is None or counts is None or indices is None or not len(counts):
        report.add("usd-mesh", "a mesh without points or faces draws nothing", path)
        return None
    if EXACT_POINTS in names:
        points = exact_points(prim, points, clock, report)
    if skinning is not None:
        points = skinning.posed(prim, points)
    polygons = usable_faces(points, counts, indices)
    refinement = None
    scheme = clock.token(prim.GetAttribute("subdivisionScheme")) or "none"
    if scheme not in SCHEMES and scheme != "none":
        message = f"`subdivisionScheme = {scheme!r}` is not known: the polygons are drawn"
        report.add("usd-subdivision", message, path)
    elif scheme in SCHEMES and options.complexity == "low":
        message = "subdivision meshes are drawn as their cages"
        report.add("usd-subdivision", message, path, "a higher complexity draws their limit")
    elif scheme in SCHEMES:
        points, polygons, refinement = refined(
            points, polygons, scheme, prim, clock, report, options, coarser
        )
    for reason, number in polygons.dropped.items():
        report.add("usd-mesh", f"{number} faces {reason} are left out", path)
    found = triangulate(points, polygons.counts, polygons.corners)
    triangles, faces = polygons.corners[found.corners], polygons.faces[found.rows]
    places = found.corners if polygons.places is None else polygons.places[found.corners]
    holes = None
    if "holeIndices" in names:
        holes = clock.integers(prim.GetAttribute("holeIndices"))
    if holes is not None and len(holes):
        kept = ~np.isin(faces, holes)
        triangles, faces, places = triangles[kept], faces[kept], places[kept]
    if not len(triangles):
        report.add("usd-mesh", "a mesh without a face that can be drawn draws nothing", path)
        return None
    turned = (
        "orientation" in names and clock.token(prim.GetAttribute("orientation")) == "leftHanded"
    )
    if turned:
        triangles, places = (np.ascontiguousarray(a[:, ::-1]) for a in (triangles, places))
    posed = skinning is not None
    return MeshSurface(points, triangles, faces, len(counts), places, refinement, turned, posed)


def _surface_of_tetrahedra(prim: Any, clock: Clock) -> tuple[IntArray | None, IntArray | None]:
    """Counts and indices of a TetMesh's surface: as authored, or what bounds its tetrahedra."""
    attribute = prim.GetAttribute("surfaceFaceVertexIndices")
    faces = clock.vectors(attribute, 3)
    if faces is None or not len(faces):
        time = clock.code(prim.GetAttribute("tetVertexIndices"))
        found = UsdGeom.TetMesh.ComputeSurfaceFaces(UsdGeom.TetMesh(prim), time)
        faces = np.array(found, dtype=np.float64).reshape(-1, 3)
    return np.full(len(faces), 3, np.int64), faces.astype(np.int64).ravel()
