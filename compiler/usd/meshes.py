"""Meshes: one per material, shared by all instances of a prim."""

from __future__ import annotations

from collections.abc import Hashable, Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pxr import Usd

from compiler.usd.appearance import Appearance, Base, Binding, Display
from compiler.usd.cages import CagesAhead
from compiler.usd.clock import Clock
from compiler.usd.options import StageOptions
from compiler.usd.primvars import Primvars
from compiler.usd.report import Report
from compiler.usd.skinning import Skinning
from compiler.usd.surfaces import MeshSurface, read_mesh
from compiler.usd.visits import Visit
from dsl.scene import IntArray, Material, Mesh


class Meshes:
    """Makes the meshes of a stage; prims of one prototype share theirs."""

    def __init__(
        self,
        clock: Clock,
        report: Report,
        appearance: Appearance,
        options: StageOptions,
        coarser: int,
        skinning: Skinning,
    ) -> None:
        self._clock = clock
        self._report = report
        self._options = options
        self._coarser = coarser
        self._skinning = skinning
        self._appearance = appearance
        self._surfaces: dict[Hashable, MeshSurface | None] = {}
        self._parts: dict[tuple[Hashable, bytes, tuple[str, ...]], list[Mesh]] = {}
        self.primvars = Primvars(clock, report)

    def ahead(self, visits: Iterable[Visit]) -> CagesAhead:
        """The cages of the meshes among prims that have not been read, but for instances."""
        meshes = (visit for visit in visits if visit.type.mesh and not visit.instance)
        return CagesAhead((v for v in meshes if _shared(v) not in self._surfaces), self._clock)

    def _surface(
        self, visit: Visit, shared: Hashable, cages: CagesAhead, skinned: bool
    ) -> MeshSurface | None:
        if shared not in self._surfaces:
            self._surfaces[shared] = read_mesh(
                visit.prim,
                cages.take(visit),
                visit.authored,
                self._clock,
                self._report,
                self._options,
                self._coarser,
                self._skinning if skinned else None,
            )
        return self._surfaces[shared]

    def parts(
        self,
        visit: Visit,
        subsets: list[Any],
        binding: Binding | None,
        display: Display | None,
        base: Base,
        cages: CagesAhead,
        *,
        skinned: bool,
        varied: bool,
    ) -> list[tuple[Mesh, Material | None]]:
        """The meshes of a prim, one per material, each with its material.

        A material is None where it comes from above the base or from nowhere. Faces of the
        `subsets` take a subset's binding, all others the mesh's, or else the display colour.
        Of a prim whose attributes are `varied`, those of each instance are its own.
        """
        prim = visit.prim
        # Instances of one skinned mesh may be moved by different animations.
        shared = visit.path if skinned else _shared(visit)
        surface = self._surface(visit, shared, cages, skinned)
        if surface is None:
            return []
        labels: IntArray | None = None
        materials: list[Material | None] = [None]
        if binding is not None:
            materials = [base.own(binding)]
        elif display is not None:
            materials = [display.material(index) for index in range(len(display.colors))]
            labels = self._by_color(visit, display, surface.face_count)
        if subsets:
            labels = self._by_subset(subsets, labels, surface.face_count, materials, base)
        bound = binding.material if binding is not None else None
        attributes = self.primvars.of_surface(prim, visit.authored, surface, [bound, *materials])
        named = tuple(attribute.name for attribute in attributes)
        whose = visit.path if varied else shared
        used, key = [0], (whose, b"", named)
        if labels is not None:
            of_triangle = labels[surface.cut.faces]
            used = np.unique(of_triangle).tolist()
            key = (whose, of_triangle.tobytes() if len(used) > 1 else b"", named)
        if key not in self._parts:
            chosen = [None] if len(used) == 1 else [np.flatnonzero(of_triangle == u) for u in used]
            self._parts[key] = [surface.part(part, attributes) for part in chosen]
        return [
            (mesh, materials[label]) for mesh, label in zip(self._parts[key], used, strict=True)
        ]

    def _by_color(self, visit: Visit, display: Display, count: int) -> IntArray | None:
        """Which of the colours each face has; None if there is one for all."""
        if display.faces is None:
            return None
        if len(display.faces) == count:
            return display.faces.copy()
        message = "a displayColor with a wrong number of values is read as its first"
        self._report.add("usd-primvar", message, visit.path)
        return np.full(count, display.faces[0])

    def _by_subset(
        self,
        subsets: list[Any],
        labels: IntArray | None,
        count: int,
        materials: list[Material | None],
        base: Base,
    ) -> IntArray:
        """The same with the subsets' materials, which are added."""
        labels = np.zeros(count, np.int64) if labels is None else labels
        taken = np.zeros(count, bool)
        for subset in subsets:
            own = self._appearance.binding(subset.GetPrim())
            faces = self._clock.integers(subset.GetIndicesAttr())
            if own is None or faces is None:
                continue
            known = (faces >= 0) & (faces < count)
            self._left_out(subset, ~known, "beyond those of its mesh")
            faces = np.unique(faces[known])
            self._left_out(subset, taken[faces], "of a subset before it")
            faces = faces[~taken[faces]]
            taken[faces] = True
            labels[faces] = len(materials)
            materials.append(base.own(own))
        return labels

    def _left_out(self, subset: Any, rows: NDArray[np.bool_], which: str) -> None:
        if rows.any():
            message = f"{np.count_nonzero(rows)} faces of a subset are {which}, and left out of it"
            self._report.add("usd-material", message, subset.GetPath())


def _shared(visit: Visit) -> Hashable:
    """The same for all instances of a prim, and for roots of instances that say the same."""
    prim = visit.prim
    path: Hashable = visit.path
    if visit.proxy:
        path = prim.GetPrimInPrototype().GetPath()
    if not visit.instance:
        return path
    said: list[Hashable] = []
    for name in visit.authored.names:
        attribute = prim.GetAttribute(name)
        if attribute and not name.startswith("xformOp"):
            stack = attribute.GetPropertyStackWithLayerOffsets(Usd.TimeCode.Default())
            said += [(spec.layer, spec.path, late.offset, late.scale) for spec, late in stack[:1]]
    return (prim.GetPrototype().GetPath(), *said)
