"""Meshes: USD's polygons as triangle meshes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from pxr import Sdf, UsdShade

from compiler.usd.appearance import Appearance, Base, Binding, Display
from compiler.usd.clock import Clock
from compiler.usd.polygons import triangulate
from compiler.usd.report import Report
from dsl.scene import FloatArray, IntArray, Material, Mesh


@dataclass(frozen=True, slots=True, eq=False)
class MeshSurface:
    """A triangulated mesh that still knows its faces.

    `points` `(v, 3)`, `triangles` `(m, 3)`, `faces` `(m,)` the USD face of each triangle,
    `face_count` the number of faces that the prim lists.
    """

    points: FloatArray
    triangles: IntArray
    faces: IntArray
    face_count: int

    def part(self, chosen: IntArray | None = None) -> Mesh:
        """The mesh of the chosen triangles (all by default), with the points they use only."""
        triangles = self.triangles if chosen is None else self.triangles[chosen]
        used = np.zeros(len(self.points), bool)
        used[triangles] = True
        if used.all():
            return Mesh(self.points, triangles)
        renumbered = np.cumsum(used) - 1
        return Mesh(self.points[used], renumbered[triangles])


def read_mesh(prim: Any, clock: Clock, report: Report) -> MeshSurface | None:
    """The surface of a Mesh prim, or None (reported) if nothing of it can be drawn.

    Normals of triangles point outwards by the prim's `orientation`. Faces in `holeIndices` are
    left out.
    """
    path = prim.GetPath()
    points = clock.vectors(prim.GetAttribute("points"), 3)
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
    found = triangulate(points, counts, indices)
    for reason, number in found.dropped.items():
        report.add("usd-mesh", f"{number} faces {reason} are left out", path)
    triangles, faces = found.triangles, found.faces
    holes = clock.integers(prim.GetAttribute("holeIndices"))
    if holes is not None and len(holes):
        kept = ~np.isin(faces, holes)
        triangles, faces = triangles[kept], faces[kept]
    if not len(triangles):
        report.add("usd-mesh", "a mesh without a face that can be drawn draws nothing", path)
        return None
    if prim.GetAttribute("primvars:skel:jointIndices").HasAuthoredValue():
        report.add("usd-mesh", "skinned meshes are drawn in their rest pose", path)
    if clock.token(prim.GetAttribute("orientation")) == "leftHanded":
        triangles = np.ascontiguousarray(triangles[:, ::-1])
    scheme = clock.token(prim.GetAttribute("subdivisionScheme"))
    if scheme != "none":
        report.add("usd-subdivision", f"`{scheme}` meshes are drawn as their cages", path)
    return MeshSurface(points, triangles, faces, len(counts))


class Meshes:
    """Makes the meshes of a stage; prims of one prototype share theirs."""

    def __init__(self, clock: Clock, report: Report, appearance: Appearance) -> None:
        self._clock = clock
        self._report = report
        self._appearance = appearance
        self._surfaces: dict[Sdf.Path, MeshSurface | None] = {}
        self._parts: dict[tuple[Sdf.Path, bytes], list[Mesh]] = {}

    def parts(
        self, prim: Any, binding: Binding | None, display: Display | None, base: Base
    ) -> list[tuple[Mesh, Material | None]]:
        """The meshes of a prim, one per material, each with its material.

        A material is None where it comes from above the base or from nowhere. Faces of a
        GeomSubset take the subset's binding, all others the mesh's, or else the display colour.
        """
        path = _shared_path(prim)
        if path not in self._surfaces:
            self._surfaces[path] = read_mesh(prim, self._clock, self._report)
        surface = self._surfaces[path]
        if surface is None:
            return []
        labels = np.zeros(surface.face_count, np.int64)
        materials: list[Material | None] = [None]
        if binding is not None:
            materials = [base.own(binding)]
        elif display is not None and display.below:
            materials = [display.material(index) for index in range(len(display.colors))]
            if display.faces is not None and len(display.faces) == surface.face_count:
                labels = display.faces.copy()
            elif display.faces is not None:
                message = "a displayColor with a wrong number of values is read as its first"
                self._report.add("usd-primvar", message, prim.GetPath())
        taken = np.zeros(surface.face_count, bool)
        for subset in UsdShade.MaterialBindingAPI(prim).GetMaterialBindSubsets():
            own = self._appearance.binding(subset.GetPrim())
            faces = self._clock.integers(subset.GetIndicesAttr())
            if own is None or faces is None:
                continue
            faces = faces[(faces >= 0) & (faces < surface.face_count)]
            faces = faces[~taken[faces]]
            taken[faces] = True
            labels[faces] = len(materials)
            materials.append(base.own(own))
        of_triangle = labels[surface.faces]
        used = np.unique(of_triangle)
        key = (path, of_triangle.tobytes() if len(used) > 1 else b"")
        if key not in self._parts:
            chosen = [None] if len(used) == 1 else [np.flatnonzero(of_triangle == u) for u in used]
            self._parts[key] = [surface.part(part) for part in chosen]
        return [
            (mesh, materials[label])
            for mesh, label in zip(self._parts[key], used.tolist(), strict=True)
        ]


def _shared_path(prim: Any) -> Sdf.Path:
    """One path for all instances of a prim."""
    if prim.IsInstanceProxy():
        return prim.GetPrimInPrototype().GetPath()
    return prim.GetPrototype().GetPath() if prim.IsInstance() else prim.GetPath()
