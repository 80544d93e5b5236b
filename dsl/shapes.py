"""The shapes of the language."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

from dsl.batches import shapes
from dsl.calls import Site
from dsl.files import FileFault
from dsl.kinds import ANGLES, INTERVAL, NUMBER, STRING, VECTOR2, VECTOR3
from dsl.lanes import varies
from dsl.limits import broken_limit, within_rounding
from dsl.scene import File, Origin, Shape, ShapeKind, Vector
from dsl.values import Builtin, Objects, Parameter, Signature, format_number

_Pair = tuple[float, float]


def _shape(site: Site, kind: ShapeKind, parameters: tuple[float, ...]) -> Shape | Objects:
    """The shape, if its parameters satisfy its inequalities, or that of every lane."""
    if site.in_lanes and any(map(varies, parameters)):
        return shapes(kind, parameters, partial(_one, site, kind), site.span)
    return _one(site, kind, parameters)


def _one(site: Site, kind: ShapeKind, parameters: tuple[float, ...]) -> Shape:
    broken = broken_limit(kind, parameters)
    if broken is not None:
        parameters = within_rounding(kind, parameters)
        broken = broken_limit(kind, parameters)
    if broken is not None:
        arguments = (
            word for name in broken.parameters for word in (name, *_ARGUMENTS.get(name, ()))
        )
        blamed = next((word for word in arguments if word in site.expressions), None)
        raise site.fault(broken.code, broken.message, blamed, broken.help)
    return Shape(kind, parameters, Origin(site.span))


_ARGUMENTS = {
    **{
        f"{axis}{end}": (axis, corner, "size")
        for axis in "xyz"
        for end, corner in (("0", "min"), ("1", "max"))
    },
    **{name: (name[:-1],) for name in ("r0", "r1", "phi0", "phi1")},
    **{f"{corner}x": (corner,) for corner in "abc"},
    "size_x": ("size",),
    "size_z": ("size",),
}
"""The arguments that may give a parameter, where they have other names."""


def _sphere(site: Site, radius: float) -> Shape | Objects:
    return _shape(site, ShapeKind.SPHERE, (radius,))


def _box(site: Site, size: Vector, bevel: float) -> Shape | Objects:
    for axis, length in zip("xyz", size, strict=True):
        if not site.in_lanes and length <= 0.0:
            message = f"size.{axis} = {format_number(length)} is not greater than 0"
            raise site.fault("value-out-of-range", message, "size")
    x, y, z = (0.5 * length for length in size)
    return _shape(site, ShapeKind.BOX, (-x, -y, -z, x, y, z, bevel))


def _box_between(site: Site, low: Vector, high: Vector, bevel: float) -> Shape | Objects:
    return _shape(site, ShapeKind.BOX, (*low, *high, bevel))


def _cylinder(site: Site, radius: float, y: _Pair, bevel: float) -> Shape | Objects:
    return _shape(site, ShapeKind.CYLINDER, (radius, *y, bevel))


def _cone(site: Site, radius: float, height: float, bevel: float) -> Shape | Objects:
    return _shape(site, ShapeKind.CONE, (radius, height, bevel))


def _torus(site: Site, major: float, minor: float) -> Shape | Objects:
    return _shape(site, ShapeKind.TORUS, (major, minor))


def _disc(site: Site, radius: float) -> Shape | Objects:
    return _shape(site, ShapeKind.DISC, (radius,))


def _rectangle(site: Site, size: _Pair) -> Shape | Objects:
    return _shape(site, ShapeKind.RECTANGLE, size)


def _plane(site: Site) -> Shape | Objects:
    return _shape(site, ShapeKind.PLANE, ())


def _triangle(site: Site, a: Vector, b: Vector, c: Vector) -> Shape | Objects:
    return _shape(site, ShapeKind.TRIANGLE, (*a, *b, *c))


def _ring(site: Site, r: _Pair, y: _Pair, bevel: float) -> Shape | Objects:
    return _shape(site, ShapeKind.RING, (*r, *y, bevel))


def _wedge(site: Site, r: _Pair, y: _Pair, phi: _Pair, bevel: float) -> Shape | Objects:
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


_BEVEL = Parameter("bevel", NUMBER, 0.0, doc="radius of the ball that rounds the edges; 0 is sharp")
_RADIUS = Parameter("radius", NUMBER, 1.0)
_R = Parameter("r", INTERVAL, required=True, doc="inner to outer radius")
_Y = Parameter("y", INTERVAL, required=True, doc="bottom to top")
_PATH = Parameter("path", STRING, required=True, doc="relative to the folder of this file")


def _needed(name: str, doc: str) -> Parameter:
    return Parameter(name, VECTOR3, required=True, doc=doc)


def _object(name: str, doc: str, *signatures: Signature) -> Builtin:
    signatures = tuple(replace(signature, lanes=True) for signature in signatures)
    return Builtin(name, signatures, "an object", doc)


SHAPES = (
    _object("sphere", "A ball about the origin.", Signature((_RADIUS,), _sphere)),
    _object(
        "box",
        "A box about the origin by its size, or between two corners.",
        Signature((Parameter("size", VECTOR3, (2.0, 2.0, 2.0), doc="whole lengths"), _BEVEL), _box),
        Signature(
            (_needed("min", "the lower corner"), _needed("max", "the upper corner"), _BEVEL),
            _box_between,
        ),
    ),
    _object(
        "cylinder",
        "A solid cylinder about the y axis.",
        Signature(
            (_RADIUS, Parameter("y", INTERVAL, (-1.0, 1.0), doc="bottom to top"), _BEVEL), _cylinder
        ),
    ),
    _object(
        "cone",
        "A solid cone about the y axis, its base in y = 0 and its tip up.",
        Signature((_RADIUS, Parameter("height", NUMBER, 2.0), _BEVEL), _cone),
    ),
    _object(
        "torus",
        "A torus about the y axis.",
        Signature(
            (
                Parameter("major", NUMBER, 1.0, doc="from the axis to the middle of the tube"),
                Parameter("minor", NUMBER, 0.25, doc="radius of the tube"),
            ),
            _torus,
        ),
    ),
    _object("disc", "A flat disc in y = 0 that faces +y.", Signature((_RADIUS,), _disc)),
    _object(
        "rectangle",
        "A flat rectangle in y = 0 that faces +y.",
        Signature((Parameter("size", VECTOR2, (2.0, 2.0), doc="along x and z"),), _rectangle),
    ),
    _object("plane", "The whole plane y = 0, facing +y.", Signature((), _plane)),
    _object(
        "triangle",
        "A flat triangle that faces where its corners go round counter-clockwise.",
        Signature(
            (_needed("a", "corner"), _needed("b", "corner"), _needed("c", "corner")), _triangle
        ),
    ),
    _object(
        "ring",
        "A hollow cylinder about the y axis, with walls from the inner to the outer radius.",
        Signature((_R, _Y, _BEVEL), _ring),
    ),
    _object(
        "wedge",
        "A sector of a ring: the brick of domes and arches. Azimuth runs from +z towards +x.",
        Signature(
            (_R, _Y, Parameter("phi", ANGLES, required=True, doc="azimuths"), _BEVEL), _wedge
        ),
    ),
    _object("mesh", "The triangles of a mesh file.", Signature((_PATH,), _mesh)),
    _object(
        "usd",
        "A USD stage, or one prim of it with what is below.",
        Signature(
            (_PATH, Parameter("prim", STRING, doc="path of a prim, such as `/World/Chair`")), _usd
        ),
    ),
)
