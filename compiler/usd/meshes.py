"""Meshes: one per material, shared by all instances of a prim."""

from __future__ import annotations

from collections.abc import Collection, Hashable
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pxr import Usd

from compiler.usd.appearance import Appearance, Base, Binding, Display
from compiler.usd.clock import Clock
from compiler.usd.options import StageOptions
from compiler.usd.primvars import Primvars
from compiler.usd.report import Report
from compiler.usd.skinning import Skinning
from compiler.usd.surfaces import MeshSurface, read_mesh
from dsl.scene import Material, Mesh


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
        self._primvars = Primvars(clock, report)

    def parts(
        self,
        prim: Any,
        names: Collection[str],
        binding: Binding | None,
        display: Display | None,
        base: Base,
        *,
        skinned: bool,
    ) -> list[tuple[Mesh, Material | None]]:
        """The meshes of a prim, one per material, each with its material.

        `names` are those of its authored properties.
        A material is None where it comes from above the base or from nowhere. Faces of a
        GeomSubset take the subset's binding, all others the mesh's, or else the display colour.
        """
        # Instances of one skinned mesh may be moved by different animations.
        shared = prim.GetPath() if skinned else _shared(prim, names)
        if shared not in self._surfaces:
            self._surfaces[shared] = read_mesh(
                prim,
                names,
                self._clock,
                self._report,
                self._options,
                self._coarser,
                self._skinning if skinned else None,
            )
        surface = self._surfaces[shared]
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
                labels += display.faces[0]
                message = "a displayColor with a wrong number of values is read as its first"
                self._report.add("usd-primvar", message, prim.GetPath())
        taken = np.zeros(surface.face_count, bool)
        for subset in self._appearance.subsets(prim):
            own = self._appearance.binding(subset.GetPrim())
            faces = self._clock.integers(subset.GetIndicesAttr())
            if own is None or faces is None:
                continue
            known = (faces >= 0) & (faces < surface.face_count)
            self._left_out(subset, ~known, "beyond those of its mesh")
            faces = np.unique(faces[known])
            self._left_out(subset, taken[faces], "of a subset before it")
            faces = faces[~taken[faces]]
            taken[faces] = True
            labels[faces] = len(materials)
            materials.append(base.own(own))
        bound = binding.material if binding is not None else None
        attributes = self._primvars.of_surface(prim, names, surface, [bound, *materials])
        named = tuple(attribute.name for attribute in attributes)
        if len(materials) == 1:
            used, key = [0], (shared, b"", named)
        else:
            of_triangle = labels[surface.faces]
            used = np.unique(of_triangle).tolist()
            key = (shared, of_triangle.tobytes() if len(used) > 1 else b"", named)
        if key not in self._parts:
            chosen = [None] if len(used) == 1 else [np.flatnonzero(of_triangle == u) for u in used]
            self._parts[key] = [surface.part(part, attributes) for part in chosen]
        return [
            (mesh, materials[label]) for mesh, label in zip(self._parts[key], used, strict=True)
        ]

    def _left_out(self, subset: Any, rows: NDArray[np.bool_], which: str) -> None:
        if rows.any():
            message = f"{np.count_nonzero(rows)} faces of a subset are {which}, and left out of it"
            self._report.add("usd-material", message, subset.GetPath())


def _shared(prim: Any, names: Collection[str]) -> Hashable:
    """The same for all instances of a prim, and for roots of instances that say the same."""
    path: Hashable = prim.GetPath()
    if prim.IsInstanceProxy():
        path = prim.GetPrimInPrototype().GetPath()
    if not prim.IsInstance():
        return path
    said: list[Hashable] = []
    for name in names:
        attribute = prim.GetAttribute(name)
        if attribute and not name.startswith("xformOp"):
            stack = attribute.GetPropertyStackWithLayerOffsets(Usd.TimeCode.Default())
            said += [(spec.layer, spec.path, late.offset, late.scale) for spec, late in stack[:1]]
    return (prim.GetPrototype().GetPath(), *said)
