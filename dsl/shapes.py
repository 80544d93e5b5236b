"""The shapes of the language."""

from __future__ import annotations

from dsl.calls import Site
from dsl.files import FileFault
from dsl.kinds import ANGLES, INTERVAL, NUMBER, STRING, VECTOR2, VECTOR3
from dsl.limits import broken_limit, largest_bevel
from dsl.scene import File, Origin, Shape, ShapeKind, Vector
from dsl.values import Builtin, Parameter, Signature, format_number

_Pair = tuple[float, float]

_ROUNDING = 1.0 + 2.0**-50
"""A bevel that is beyond its limit by rounding alone means the limit: `0.3 - 0.1` is below 0.2."""


def _shape(site: Site, kind: ShapeKind, parameters: tuple[float, ...]) -> Shape:
    """The shape, if its parameters satisfy its inequalities."""
    broken = broken_limit(kind, parameters)
    if broken is not None and broken.code == "value-bevel":
        limit = largest_bevel(kind, parameters)
        if parameters[-1] <= limit * _ROUNDING:
            parameters, broken = (*parameters[:-1], limit), None
    if broken is not None:
        arguments = (
            word for name in broken.parameters for word in (name, *_ARGUMENTS.get(name, ()))
        )
        blamed = next((word for word in arguments if word in site.expressions), None)
        raise site.fault(broken.code, broken.message, blamed, broken.help)
    return Shape(kind, parameters, Origin(site.span))


_ARGUMENTS = {
    **{f"{axis}{end}": (axis, "max") for axis in "xyz" for end in "01"},
    **{name: (name[:-1],) for name in ("r0", "r1", "phi0", "phi1")},
    **{f"{corner}x": (corner,) for corner in "abc"},
    "size_x": ("size",),
    "size_z": ("size",),
}
"""The arguments that may give a parameter, where they have other names."""


def _sphere(site: Site, radius: float) -> Shape:
    return _shape(site, ShapeKind.SPHERE, (radius,))


def _box(site: Site, size: Vector, bevel: float) -> Shape:
    for axis, length in zip("xyz", size, strict=True):
        if length <= 0.0:
            message = f"size.{axis} = {format_number(length)} is not greater than 0"
            raise site.fault("value-out-of-range", message, "size")
    x, y, z = (0.5 * length for length in size)
    return _shape(site, ShapeKind.BOX, (-x, -y, -z, x, y, z, bevel))


def _box_between(site: Site, low: Vector, high: Vector, bevel: float) -> Shape:
    return _shape(site, ShapeKind.BOX, (*low, *high, bevel))


def _cylinder(site: Site, radius: float, y: _Pair, bevel: float) -> Shape:
    return _shape(site, ShapeKind.CYLINDER, (radius, *y, bevel))


def _cone(site: Site, radius: float, height: float, bevel: float) -> Shape:
    return _shape(site, ShapeKind.CONE, (radius, height, bevel))


def _torus(site: Site, major: float, minor: float) -> Shape:
    return _shape(site, ShapeKind.TORUS, (major, minor))


def _disc(site: Site, radius: float) -> Shape:
    return _shape(site, ShapeKind.DISC, (radius,))


def _rectangle(site: Site, size: _Pair) -> Shape:
    return _shape(site, ShapeKind.RECTANGLE, size)


def _plane(site: Site) -> Shape:
    return _shape(site, ShapeKind.PLANE, ())


def _triangle(site: Site, a: Vector, b: Vector, c: Vector) -> Shape:
    return _shape(site, ShapeKind.TRIANGLE, (*a, *b, *c))


def _ring(site: Site, r: _Pair, y: _Pair, bevel: float) -> Shape:
    return _shape(site, ShapeKind.RING, (*r, *y, bevel))


def _wedge(site: Site, r: _Pair, y: _Pair, phi: _Pair, bevel: float) -> Shape:
    return _shape(site, ShapeKind.WEDGE, (*r, *y, *phi, bevel))


def _mesh(site: Site, path: str) -> File:
    _check_file(site, path)
    return File("mesh", path, None, site.folder, Origin(site.span))


def _usd(site: Site, path: str, prim: str | None) -> File:
    _check_file(site, path)
    if prim is not None and not prim.startswith("/"):
        raise site.fault(
            "value-choice", f"`{prim}` is no path of a prim", "prim", f'write `prim: "/{prim}"`'
        )
    return File("usd", path, prim, site.folder, Origin(site.span))


def _check_file(site: Site, path: str) -> None:
    try:
        site.files.resolve(path, site.folder)
    except FileFault as fault:
        raise site.fault(fault.code, fault.message, "path", fault.help) from None


_BEVEL = Parameter("bevel", NUMBER, 0.0)
_RADIUS = Parameter("radius", NUMBER, 1.0)
_R = Parameter("r", INTERVAL, required=True)
_Y = Parameter("y", INTERVAL, required=True)
_PATH = Parameter("path", STRING, required=True)


def _needed(name: str) -> Parameter:
    return Parameter(name, VECTOR3, required=True)


SHAPES = (
    Builtin("sphere", (Signature((_RADIUS,), _sphere),)),
    Builtin(
        "box",
        (
            Signature((Parameter("size", VECTOR3, (2.0, 2.0, 2.0)), _BEVEL), _box),
            Signature((_needed("min"), _needed("max"), _BEVEL), _box_between),
        ),
    ),
    Builtin(
        "cylinder",
        (Signature((_RADIUS, Parameter("y", INTERVAL, (-1.0, 1.0)), _BEVEL), _cylinder),),
    ),
    Builtin("cone", (Signature((_RADIUS, Parameter("height", NUMBER, 2.0), _BEVEL), _cone),)),
    Builtin(
        "torus",
        (Signature((Parameter("major", NUMBER, 1.0), Parameter("minor", NUMBER, 0.25)), _torus),),
    ),
    Builtin("disc", (Signature((_RADIUS,), _disc),)),
    Builtin("rectangle", (Signature((Parameter("size", VECTOR2, (2.0, 2.0)),), _rectangle),)),
    Builtin("plane", (Signature((), _plane),)),
    Builtin("triangle", (Signature((_needed("a"), _needed("b"), _needed("c")), _triangle),)),
    Builtin("ring", (Signature((_R, _Y, _BEVEL), _ring),)),
    Builtin(
        "wedge", (Signature((_R, _Y, Parameter("phi", ANGLES, required=True), _BEVEL), _wedge),)
    ),
    Builtin("mesh", (Signature((_PATH,), _mesh),)),
    Builtin("usd", (Signature((_PATH, Parameter("prim", STRING)), _usd),)),
)
