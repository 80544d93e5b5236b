"""The affine maps of the language: the same names as suffix calls and as functions.

A chain of suffixes applies its maps in reading order; a product `a * b` of transform values applies
b first, as matrices do.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from dsl.calls import Site
from dsl.faults import Fault
from dsl.kinds import ANGLE, NUMBER, TRANSFORM, VECTOR3
from dsl.lanes import stacked
from dsl.scene import Step, StepKind, Transform, Vector
from dsl.values import Builtin, Parameter, Signature


def step(kind: StepKind, *values: float) -> Transform:
    """The transform of one elementary map."""
    return Transform((Step(kind, stacked(values)),))


def _translate_by(site: Site, by: Vector) -> Transform:
    return step(StepKind.TRANSLATE, *by)


def _translate(site: Site, x: float, y: float, z: float) -> Transform:
    return step(StepKind.TRANSLATE, x, y, z)


def _scale_by(site: Site, s: float) -> Transform:
    return step(StepKind.SCALE, s, s, s)


def _scale(site: Site, x: float, y: float, z: float) -> Transform:
    return step(StepKind.SCALE, x, y, z)


def _rotate_about(x: float, y: float, z: float) -> Callable[[Site, float], Transform]:
    return lambda site, angle: step(StepKind.ROTATE, x, y, z, angle)


def _rotate(site: Site, axis: Vector, angle: float) -> Transform:
    _check_direction(site, "axis", axis)
    return step(StepKind.ROTATE, *axis, angle)


def _shear(
    site: Site, xy: float, xz: float, yx: float, yz: float, zx: float, zy: float
) -> Transform:
    return step(StepKind.SHEAR, xy, xz, yx, yz, zx, zy)


def _reflect(site: Site, axis: Vector) -> Transform:
    _check_direction(site, "axis", axis)
    return step(StepKind.REFLECT, *axis)


def _matrix(site: Site, numbers: tuple[float, ...]) -> Transform:
    if len(numbers) != 12:
        message = f"`matrix` takes 12 numbers, not {len(numbers)}"
        rows = "three rows of four numbers; the fourth of each row is the translation"
        if len(numbers) > 12:
            raise Fault("type-too-many-arguments", message, site.arguments[12].span, help=rows)
        raise site.fault("type-missing-argument", message, help=rows)
    return step(StepKind.MATRIX, *numbers)


def look_at(site: Site, origin: Vector, at: Vector, up: Vector) -> Transform:
    """The rigid map that puts an object at `origin`, its -z towards `at` and its y near `up`."""
    # Halved, the difference cannot overflow.
    view = np.multiply(at, 0.5) - np.multiply(origin, 0.5)
    if not view.any():
        raise site.fault("value-degenerate", "`at` is the same point as `from`", "at")
    _check_direction(site, "up", up)
    if not np.cross(view / np.max(np.abs(view)), np.divide(up, np.max(np.abs(up)))).any():
        raise site.fault(
            "value-degenerate",
            "`up` is parallel to the direction of view",
            "up",
            help="give an `up` that leans away from it, such as `up: (0, 0, 1)`",
        )
    return step(StepKind.LOOK_AT, *origin, *at, *up)


def _check_direction(site: Site, name: str, vector: Vector) -> None:
    if not any(vector):
        raise site.fault("value-degenerate", f"`{name}` is (0, 0, 0) and has no direction", name)


_ANGLE = (Parameter("angle", ANGLE, required=True, doc="right-handed"),)
_AXIS = Parameter("axis", VECTOR3, required=True, doc="a direction of any length")
LOOK_AT = (
    Parameter("from", VECTOR3, required=True, doc="where it is"),
    Parameter("at", VECTOR3, (0.0, 0.0, 0.0), doc="the point that its -z looks at"),
    Parameter("up", VECTOR3, (0.0, 1.0, 0.0), doc="the direction that its y is nearest to"),
)


def _map(name: str, doc: str, *signatures: Signature) -> Builtin:
    return Builtin(name, signatures, "a transform", doc)


TRANSFORMS = (
    _map(
        "translate",
        "Moves by a vector, or along the axes.",
        Signature((Parameter("by", VECTOR3, required=True),), _translate_by, lanes=True),
        Signature(tuple(Parameter(name, NUMBER, 0.0) for name in "xyz"), _translate, lanes=True),
    ),
    _map(
        "scale",
        "Scales about the origin, evenly or along the axes.",
        Signature((Parameter("s", NUMBER, required=True),), _scale_by, lanes=True),
        Signature(tuple(Parameter(name, NUMBER, 1.0) for name in "xyz"), _scale, lanes=True),
    ),
    _map(
        "rotate_x",
        "Turns about the x axis: y towards z.",
        Signature(_ANGLE, _rotate_about(1.0, 0.0, 0.0), lanes=True),
    ),
    _map(
        "rotate_y",
        "Turns about the y axis: z towards x.",
        Signature(_ANGLE, _rotate_about(0.0, 1.0, 0.0), lanes=True),
    ),
    _map(
        "rotate_z",
        "Turns about the z axis: x towards y.",
        Signature(_ANGLE, _rotate_about(0.0, 0.0, 1.0), lanes=True),
    ),
    _map(
        "rotate",
        "Turns about an axis through the origin.",
        Signature((_AXIS, *_ANGLE), _rotate),
    ),
    _map(
        "shear",
        "Slides each axis along the others: x becomes x + xy·y + xz·z, and so on.",
        Signature(
            tuple(Parameter(n, NUMBER, 0.0) for n in ("xy", "xz", "yx", "yz", "zx", "zy")),
            _shear,
            lanes=True,
        ),
    ),
    _map(
        "reflect",
        "Mirrors in the plane through the origin that is normal to the axis.",
        Signature((_AXIS,), _reflect),
    ),
    _map(
        "matrix",
        "Any affine map: 12 numbers, three rows of four, the fourth of each the translation.",
        Signature((), _matrix, rest=NUMBER, lanes=True),
    ),
    _map(
        "look_at",
        "Places an object so that its -z looks at a point, as cameras do.",
        Signature(LOOK_AT, look_at),
    ),
)

PLACE = {
    **{builtin.name: builtin for builtin in TRANSFORMS},
    "transform": _map(
        "transform",
        "Applies a transform value.",
        Signature((Parameter("t", TRANSFORM, required=True),), lambda site, t: t, lanes=True),
    ),
}
"""The suffix calls that place an object."""
