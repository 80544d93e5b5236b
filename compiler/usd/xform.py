"""Transform stacks of prims as chains of elementary steps.

A stack's operations apply to a point from last to first (USD multiplies row vectors from the
left), so a chain in reading order is the stack reversed. Translations, scales and rotations stay
what they are, so that their inverses are exact; only `transform` operations become matrices.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from pxr import Gf, Sdf, Tf, UsdGeom, Vt

from compiler.usd.clock import Clock
from compiler.usd.report import Report
from dsl.scene import FloatArray, Step, StepKind, Transform

_INVERT = "!invert!"

_UNIT = {"X": (1.0, 0.0, 0.0), "Y": (0.0, 1.0, 0.0), "Z": (0.0, 0.0, 1.0)}
_TRANSLATE = {"translateX": 0, "translateY": 1, "translateZ": 2}
_SCALE = {"scaleX": 0, "scaleY": 1, "scaleZ": 2}
_ROTATE = {
    f"rotate{axes}": axes for axes in ("X", "Y", "Z", "XYZ", "XZY", "YXZ", "YZX", "ZXY", "ZYX")
}
"""The axes in the order in which the rotations apply to a point."""

_KINDS = {"translate", *_TRANSLATE, "scale", *_SCALE, *_ROTATE, "orient", "transform"}
"""What may follow `xformOp:` in the name of an operation."""

UNIT_SLACK = 2.0**-8
"""Quaternions whose squared length is this near to 1 count as unit: the rounding of halfs.

Those are taken by usd-core's own formulas, so that places agree with it to the last digits; for
others these formulas give no rotation at all, and they are normalised first.
"""


def rotation(axis: str, degrees: float) -> Step:
    """A rotation about the X, Y or Z axis."""
    return Step(StepKind.ROTATE, np.array([*_UNIT[axis], degrees]))


def unit_quaternions(quaternions: FloatArray) -> FloatArray:
    """Normalise what is not unit; `(n, 4)` imaginary part first, zero becomes the identity."""
    squared = np.einsum("ij,ij->i", quaternions, quaternions)
    result = quaternions.copy()
    far = np.abs(squared - 1.0) > UNIT_SLACK
    result[far] /= np.sqrt(np.where(squared[far] > 0.0, squared[far], 1.0))[:, None]
    result[squared == 0.0] = (0.0, 0.0, 0.0, 1.0)
    return result


@dataclass(frozen=True, slots=True)
class NamedOp:
    """An operation by its name in `xformOpOrder`: of a kind, and of which attribute."""

    name: str
    kind: str
    attribute: str
    inverse: bool


def local_steps(
    prim: Any, clock: Clock, report: Report, attribute: Callable[[str], Any] | None = None
) -> tuple[tuple[Step, ...], bool]:
    """Steps of an Xformable prim's own transform, and whether it resets those of its parents.

    `attribute` finds attributes of the prim that it authors, None: usd-core does.
    """
    found = _attributes(attribute or prim.GetAttribute)
    reset = False
    if found is None:
        xformable = UsdGeom.Xformable(prim)
        ops = _ordered_ops(xformable, report)
        found = [(_named(op.GetOpName()), op.GetAttr()) for op in ops]
        reset = bool(xformable.GetResetXformStack())
    steps: list[Step] = []
    for op, found_attribute in reversed(found):
        own = _op_steps(op, clock.plain(found_attribute), prim, report)
        steps += Transform(own).inverted().steps if op.inverse else own
    return tuple(steps), reset


def _attributes(attribute: Callable[[str], Any]) -> list[tuple[NamedOp, Any]] | None:
    """A prim's operations with their attributes; None where usd-core has to say what they are."""
    said = attribute("xformOpOrder")
    order = said.Get() if said else None
    if not isinstance(order, Vt.TokenArray):
        return None
    ops = _ORDERS.ops_in(order)
    if ops is None:
        return None
    found = [(op, attribute(op.attribute)) for op in ops]
    return found if all(own for _, own in found) else None


@dataclass(slots=True)
class _Orders:
    """A cache of one `xformOpOrder`: most prims say that of the prim before.

    To compare two takes one call of usd-core, to read one a call for each name.
    """

    last: Any = None
    ops: tuple[NamedOp, ...] | None = None

    def ops_in(self, order: Any) -> tuple[NamedOp, ...] | None:
        """The operations of an `xformOpOrder`, see `_named_ops`."""
        if self.last != order:
            # Iterators of usd-core's arrays cost microseconds.
            self.last, self.ops = order, _named_ops(tuple([order[n] for n in range(len(order))]))
        return self.ops


_ORDERS = _Orders()


@lru_cache(4096)
def _named_ops(order: tuple[str, ...]) -> tuple[NamedOp, ...] | None:
    """The operations of an `xformOpOrder`; None if not all names are those of one."""
    found = tuple(map(_named, order))
    names = all(
        op.kind in _KINDS and Sdf.Path.IsValidNamespacedIdentifier(op.attribute) for op in found
    )
    return found if names else None


def _named(name: str) -> NamedOp:
    """The operation of that name, of the kind "" if it is not a name of one."""
    attribute = name.removeprefix(_INVERT)
    space, kind, *_ = (*attribute.split(":"), "")
    return NamedOp(name, kind if space == "xformOp" else "", attribute, attribute != name)


def world_steps(prim: Any, clock: Clock, report: Report) -> tuple[Step, ...]:
    """Steps from a prim's own space to the stage's."""
    steps: list[Step] = []
    for each in _up(prim):
        steps += local_steps(each, clock, report)[0]
    return tuple(steps)


def world_matrix(prim: Any, clock: Clock, report: Report) -> Any:
    """Stage from a prim's own space, as usd-core's Gf.Matrix4d (row vectors)."""
    matrix = Gf.Matrix4d(1.0)
    for each in _up(prim):
        for op in reversed(_ordered_ops(UsdGeom.Xformable(each), report)):
            try:
                matrix *= op.GetOpTransform(clock.code(op.GetAttr()))
            except Tf.ErrorException:
                _leave_out(op.GetOpName(), each, report)
    return matrix


def _ordered_ops(xformable: Any, report: Report) -> list[Any]:
    """The operations in the order of `xformOpOrder`, as usd-core gives them.

    Where it raises for a name that cannot be one's, all others are found by theirs.
    """
    try:
        return list(xformable.GetOrderedXformOps())
    except Tf.ErrorException:
        message = "names that cannot be in an `xformOpOrder` are left out of it"
        report.add("usd-transform", message, xformable.GetPath())
    order = list(xformable.GetXformOpOrderAttr().Get() or ())
    if UsdGeom.XformOpTypes.resetXformStack in order:
        order = order[len(order) - order[::-1].index(UsdGeom.XformOpTypes.resetXformStack) :]
    named = (op for op in map(_named, order) if op.kind in _KINDS)
    found = ((op, xformable.GetPrim().GetAttribute(op.attribute)) for op in named)
    return [UsdGeom.XformOp(attribute, op.inverse) for op, attribute in found if attribute]


def _up(prim: Any) -> Iterator[Any]:
    """The transformable prims from this one up to the root, or to one that resets its stack."""
    while prim and not prim.IsPseudoRoot():
        xformable = UsdGeom.Xformable(prim)
        if xformable:
            yield prim
            if xformable.GetResetXformStack():
                return
        prim = prim.GetParent()


def _op_steps(op: NamedOp, value: Any, prim: Any, report: Report) -> tuple[Step, ...]:
    """Steps of one operation, never inverted; none for one without a usable value."""
    if value is None:
        return ()
    kind = op.kind
    try:
        numbers = _numbers(kind, value)
    except (TypeError, ValueError, AttributeError):
        numbers = np.array([np.nan])
    if numbers.size != _size(kind) or not _is_finite(numbers):
        _leave_out(op.name, prim, report)
        return ()
    if kind in _ROTATE:
        axes = _ROTATE[kind]
        angles = dict(zip("XYZ", numbers, strict=True)) if len(axes) == 3 else {axes: numbers[0]}
        return tuple(rotation(axis, float(angles[axis])) for axis in axes)
    if kind == "translate" or kind in _TRANSLATE:
        return (Step(StepKind.TRANSLATE, numbers),)
    if kind == "scale" or kind in _SCALE:
        return (Step(StepKind.SCALE, numbers),)
    if kind == "orient":
        return (Step(StepKind.ROTATE, _axis_angle(numbers)),)
    rows = numbers.reshape(4, 4)
    if not np.array_equal(rows[:, 3], (0.0, 0.0, 0.0, 1.0)):
        message = f"`{op.name}` is projective; only its affine part is used"
        report.add("usd-transform", message, prim.GetPath())
    return (Step(StepKind.MATRIX, np.ascontiguousarray(rows[:, :3].T).ravel()),)


def _is_finite(numbers: FloatArray) -> bool:
    """Whether all are finite; most often their sum tells, which takes less than asking NumPy."""
    return math.isfinite(sum(numbers.tolist())) or bool(np.isfinite(numbers).all())


def _leave_out(name: str, prim: Any, report: Report) -> None:
    message = f"`{name}` has no finite value of its type and is left out"
    report.add("usd-transform", message, prim.GetPath())


def _size(kind: str) -> int:
    """How many numbers `_numbers` has of a kind."""
    if kind in _ROTATE:
        return len(_ROTATE[kind])
    return {"transform": 16, "orient": 4}.get(kind, 3)


def _numbers(kind: str, value: Any) -> FloatArray:
    if kind in _TRANSLATE:
        numbers = np.zeros(3)
        numbers[_TRANSLATE[kind]] = value
    elif kind in _SCALE:
        numbers = np.ones(3)
        numbers[_SCALE[kind]] = value
    elif kind == "orient":
        numbers = np.array([*value.GetImaginary(), value.GetReal()], dtype=np.float64)
    else:
        numbers = np.array(value, dtype=np.float64, ndmin=1).ravel()
    return numbers


def _axis_angle(quaternion: FloatArray) -> FloatArray:
    x, y, z, w = unit_quaternions(quaternion[None])[0]
    length = math.hypot(x, y, z)
    if length == 0.0:
        return np.array([1.0, 0.0, 0.0, 0.0])
    degrees = math.degrees(2.0 * math.acos(min(max(w, -1.0), 1.0)))
    return np.array([x / length, y / length, z / length, degrees])
