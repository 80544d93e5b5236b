"""The codeless USD schema of what the language says and USD has no word for.

Typed prims (`OvoloWedge`, …) are exact solids with the parameters of the language. They derive from
Mesh: a stage that names Mesh as their fallback type (`FALLBACKS` as the layer's metadata
`fallbackPrimTypes`) and gives them points is drawn by programs that have never heard of them.
Applied schemas add a bevel radius to Cube, Cylinder and Cone, and double precision to what USD
keeps in floats.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from dsl.scene import ShapeKind

FOLDER = Path(__file__).parent
"""Holds `plugInfo.json` and `generatedSchema.usda`: what `PXR_PLUGINPATH_NAME` should name."""

BEVEL = "ovolo:bevel"
EXACT_POINTS = "ovolo:points"
EXACT_TRANSFORMS = "ovolo:transforms"


@dataclass(frozen=True, slots=True)
class Parameter:
    """One attribute of a typed prim: a number, or a tuple of them, in the language's words."""

    name: str
    default: tuple[float, ...]

    @property
    def type_name(self) -> str:
        """The type of its values in USD."""
        return "double" if len(self.default) == 1 else f"double{len(self.default)}"


def _number(name: str, default: float) -> Parameter:
    return Parameter(name, (default,))


_BEVEL = _number("bevel", 0.0)
_RADIUS = _number("radius", 1.0)

SOLIDS: dict[ShapeKind, tuple[Parameter, ...]] = {
    ShapeKind.BOX: (
        Parameter("min", (-1.0, -1.0, -1.0)),
        Parameter("max", (1.0, 1.0, 1.0)),
        _BEVEL,
    ),
    ShapeKind.CYLINDER: (_RADIUS, Parameter("y", (-1.0, 1.0)), _BEVEL),
    ShapeKind.CONE: (_RADIUS, _number("height", 2.0), _BEVEL),
    ShapeKind.TORUS: (_number("major", 1.0), _number("minor", 0.25)),
    ShapeKind.DISC: (_RADIUS,),
    ShapeKind.PLANE: (),
    ShapeKind.TRIANGLE: (
        Parameter("a", (0.0, 0.0, 0.0)),
        Parameter("b", (0.0, 0.0, 1.0)),
        Parameter("c", (1.0, 0.0, 0.0)),
    ),
    ShapeKind.RING: (Parameter("r", (0.5, 1.0)), Parameter("y", (-1.0, 1.0)), _BEVEL),
    ShapeKind.WEDGE: (
        Parameter("r", (0.5, 1.0)),
        Parameter("y", (-1.0, 1.0)),
        Parameter("phi", (0.0, 90.0)),
        _BEVEL,
    ),
}
"""Typed prims by kind; their values, joined, are `dsl.scene.SHAPE_PARAMETERS[kind]`."""


def type_of(prim: Any) -> str:
    """The type that a prim is read as: its own, or the fallback that its stage names for it."""
    own = str(prim.GetTypeName())
    return own if own in KINDS else str(prim.GetPrimTypeInfo().GetSchemaTypeName()) or own


def type_name(kind: ShapeKind) -> str:
    """The prim type of a solid, such as `OvoloWedge`."""
    return f"Ovolo{kind.value.capitalize()}"


KINDS = {type_name(kind): kind for kind in SOLIDS}
FALLBACKS = {name: ["Mesh"] for name in KINDS}


@cache
def register() -> None:
    """Make usd-core of this process know the schema; to be called before a stage is opened.

    A process that has opened stages before reads typed prims all the same, where their layer
    names their fallback type.
    """
    from pxr import Plug

    Plug.Registry().RegisterPlugins(str(FOLDER))
