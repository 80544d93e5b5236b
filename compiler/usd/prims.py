"""What a walk asks of every prim, at the price of three calls of usd-core, and what prims pass on.

A call costs microseconds and stages have 10⁵ prims, so types are asked once for each combination of
type name and applied schemas, and attributes only where the prim authors one of that name.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

from pxr import UsdGeom, UsdLux, UsdSkel

from compiler.usd.clock import Clock
from compiler.usd.schema import type_of


@dataclass(frozen=True, slots=True)
class PrimType:
    """What the type of a prim says of it; `kind` as `compiler.usd.schema.type_of`."""

    kind: str
    known: bool
    instancer: bool
    boundable: bool
    imageable: bool
    gprim: bool
    mesh: bool
    light: bool
    skeletal: bool


class PrimTypes:
    """The types of one stage's prims."""

    def __init__(self) -> None:
        self._types: dict[tuple[str, ...], PrimType] = {}

    def of(self, prim: Any) -> PrimType:
        """The type of a prim."""
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
                gprim=prim.IsA(UsdGeom.Gprim),
                mesh=kind in ("Mesh", "TetMesh"),
                light=prim.HasAPI(UsdLux.LightAPI),
                skeletal=prim.IsA(UsdSkel.Root),
            )
        return found


@dataclass(frozen=True, slots=True)
class Inherited:
    """What a prim passes on to those below it.

    `bound` and `colored` say whether materials, or a display colour or opacity, may be theirs.
    """

    visible: bool = True
    purpose: str = "default"
    bound: bool = False
    colored: bool = False
    collections: bool = False  # whether a material collection above may single out prims
    prototype: bool = False  # whether a point instancer above draws it
    skeletal: bool = False  # whether it is a SkelRoot, or below one

    def passed_on(self, prim: Any, type: PrimType, names: list[str], clock: Clock) -> Inherited:
        """What a prim with this above it passes on; `names` are its authored properties."""
        said: dict[str, Any] = {}
        if type.skeletal:
            said["skeletal"] = True
        for name in names:
            if name.startswith("material:binding"):
                said["bound"] = True
                if name.startswith("material:binding:collection"):
                    said["collections"] = True
            elif name.startswith(("primvars:displayColor", "primvars:displayOpacity")):
                said["colored"] = True
        if type.imageable and "visibility" in names and self.visible:
            attribute = UsdGeom.Imageable(prim).GetVisibilityAttr()
            if attribute.HasAuthoredValue():
                said["visible"] = clock.token(attribute) != UsdGeom.Tokens.invisible
        if type.imageable and "purpose" in names:
            attribute = UsdGeom.Imageable(prim).GetPurposeAttr()
            if attribute.HasAuthoredValue():
                said["purpose"] = clock.token(attribute) or self.purpose
        return replace(self, **said) if said else self
