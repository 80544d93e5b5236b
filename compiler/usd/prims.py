"""What a walk asks of every prim, at the price of a few calls of usd-core, and what prims pass on.

A call costs microseconds and stages have 10⁵ prims. So what a prim's type says is asked once for
each combination of type name and applied schemas, what the names of its authored properties say
once for each list of them, and attributes only where the prim authors one of that name.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

from pxr import UsdGeom, UsdLux, UsdSkel

from compiler.usd.clock import Clock
from compiler.usd.schema import type_of

_PASSED_ON = ("visibility", "purpose", "model:drawMode")
"""Attributes that hold for prims below too, beside bindings and primvars."""


@dataclass(frozen=True, eq=False)
class Authored:
    """The `names` of a prim's authored properties, in order, and what they alone say of it.

    Prims of the same names share one.
    """

    names: tuple[str, ...]

    def __contains__(self, name: str) -> bool:
        return name in self.places

    @cached_property
    def places(self) -> dict[str, int]:
        """Where each name is among them."""
        return {name: place for place, name in enumerate(self.names)}

    def _any(self, *beginnings: str) -> bool:
        return any(name.startswith(beginnings) for name in self.names)

    @cached_property
    def bound(self) -> bool:
        """Whether a material is bound to the prim, or to prims below it."""
        return self._any("material:binding")

    @cached_property
    def collections(self) -> bool:
        """Whether materials are bound to collections of prims below."""
        return self._any("material:binding:collection")

    @cached_property
    def previews(self) -> bool:
        """Whether a binding is for the purpose `preview`."""
        return self._any("material:binding:preview", "material:binding:collection:preview")

    @cached_property
    def colored(self) -> bool:
        """Whether the prim has a display colour or opacity."""
        return self._any("primvars:displayColor", "primvars:displayOpacity")

    @cached_property
    def inherited(self) -> bool:
        """Whether anything here is passed on to prims below."""
        return self.bound or self.primvars or any(name in self for name in _PASSED_ON)

    @cached_property
    def primvars(self) -> bool:
        """Whether the prim has any primvars."""
        return self._any("primvars:")


@dataclass(frozen=True, eq=False)
class PrimType:
    """What the type of a prim says of it; `kind` as `compiler.usd.schema.type_of`."""

    kind: str
    known: bool
    instancer: bool
    boundable: bool
    imageable: bool
    xformable: bool
    gprim: bool
    mesh: bool
    light: bool
    skeletal: bool


@dataclass(slots=True)
class PrimTypes:
    """The types of one stage's prims; `previews` once a binding was for that purpose."""

    previews: bool = False
    _last: tuple[Any, PrimType] | None = None
    _types: dict[tuple[str, ...], PrimType] = field(default_factory=dict)
    _authored: dict[tuple[str, ...], Authored] = field(default_factory=dict)

    def of(self, prim: Any) -> PrimType:
        """The type of a prim."""
        info = prim.GetPrimTypeInfo()
        if self._last is None or self._last[0] != info:
            self._last = info, self._of(prim)
        return self._last[1]

    def _of(self, prim: Any) -> PrimType:
        key = (prim.GetTypeName(), *prim.GetAppliedSchemas())
        found = self._types.get(key)
        if found is None:
            kind = type_of(prim)
            found = self._types[key] = PrimType(
                kind,
                known=bool(prim.GetPrimTypeInfo().GetSchemaType()),
                instancer=prim.IsA(UsdGeom.PointInstancer),
                boundable=prim.IsA(UsdGeom.Boundable),
                imageable=prim.IsA(UsdGeom.Imageable),
                xformable=prim.IsA(UsdGeom.Xformable),
                gprim=prim.IsA(UsdGeom.Gprim),
                mesh=kind in ("Mesh", "TetMesh"),
                light=prim.HasAPI(UsdLux.LightAPI),
                skeletal=prim.IsA(UsdSkel.Root),
            )
        return found

    def authored(self, prim: Any) -> Authored:
        """What a prim authors."""
        names = tuple(prim.GetAuthoredPropertyNames())
        found = self._authored.get(names)
        if found is None:
            found = self._authored[names] = Authored(names)
            self.previews = self.previews or found.previews
        return found


@dataclass(frozen=True, slots=True)
class Inherited:
    """What a prim passes on to those below it.

    `mode` is the draw mode that models below may take; `bound`, `colored` and `primvars` say
    whether materials, a display colour or opacity, or any primvars may be theirs.
    """

    visible: bool = True
    purpose: str = "default"
    mode: str = ""
    bound: bool = False
    colored: bool = False
    primvars: bool = False
    collections: bool = False  # whether a material collection above may single out prims
    prototype: bool = False  # whether a point instancer above draws it
    skeletal: bool = False  # whether it is a SkelRoot, or below one

    def passed_on(self, prim: Any, type: PrimType, authored: Authored, clock: Clock) -> Inherited:
        """What a prim with this above it passes on."""
        if not authored.inherited and not type.skeletal:
            return self
        visible, purpose = self.visible, self.purpose
        if type.imageable and visible and "visibility" in authored:
            attribute = UsdGeom.Imageable(prim).GetVisibilityAttr()
            if attribute.HasAuthoredValue():
                visible = clock.token(attribute) != UsdGeom.Tokens.invisible
        if type.imageable and "purpose" in authored:
            attribute = UsdGeom.Imageable(prim).GetPurposeAttr()
            if attribute.HasAuthoredValue():
                purpose = clock.token(attribute) or purpose
        mode = self.mode
        if "model:drawMode" in authored:
            mode = clock.token(prim.GetAttribute("model:drawMode")) or mode
        return Inherited(
            visible,
            purpose,
            mode,
            self.bound or authored.bound,
            self.colored or authored.colored,
            self.primvars or authored.primvars,
            self.collections or authored.collections,
            self.prototype,
            self.skeletal or type.skeletal,
        )
