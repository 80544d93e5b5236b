"""Arithmetic and comparison of values."""

from __future__ import annotations

import math
import operator
from collections.abc import Callable
from typing import Any

import numpy as np

from dsl import ast, scene
from dsl.diagnostics import Label
from dsl.faults import Fault, Poisoned, mismatch
from dsl.lanes import Sequential, varies
from dsl.values import (
    POISON,
    Angle,
    Color,
    Interval,
    List,
    Truths,
    Value,
    Vector,
    is_node,
    type_name,
)

_Arithmetic = Callable[[float, float], float]
_ARITHMETIC: dict[str, _Arithmetic] = {
    "+": operator.add,
    "-": operator.sub,
    "*": operator.mul,
    "/": operator.truediv,
    "%": operator.mod,
}
_ORDER: dict[str, Callable[[float, float], bool]] = {
    "<": operator.lt,
    "<=": operator.le,
    ">": operator.gt,
    ">=": operator.ge,
}
_EQUALITY: dict[str, Callable[[float, float], bool]] = {"==": operator.eq, "!=": operator.ne}
_COMPARABLE = (float, bool, str, Angle, Vector, Color, Interval)


class _Meaningless(Exception):
    """The operator has no meaning for these types."""


def binary(
    op: ast.Operator,
    left: Value,
    right: Value,
    left_node: ast.Expression,
    right_node: ast.Expression,
) -> Value:
    """`left op right` for the arithmetic, comparison and interval operators."""
    if left is POISON or right is POISON:
        raise Poisoned
    symbol = op.symbol
    try:
        if type(left) is float and type(right) is float and symbol in _ARITHMETIC:
            result = _ARITHMETIC[symbol](left, right)
            if not math.isfinite(result):
                raise _overflow(op)
            return result
        if symbol in _ARITHMETIC:
            return finite(_arithmetic(symbol, left, right), op)
        if symbol == "..":
            return _interval(left, right, left_node, right_node)
        return _compare(symbol, left, right)
    except ZeroDivisionError:
        raise Fault(
            "value-division-by-zero",
            "division by zero",
            op.span,
            secondary=(Label(right_node.span, "this is 0"),),
        ) from None
    except OverflowError:
        raise _overflow(op) from None
    except _Meaningless:
        raise Fault(
            "type-operator",
            _meaningless(symbol, left, right),
            op.span,
            help=_mend(symbol, left, right),
            secondary=(
                Label(left_node.span, type_name(left)),
                Label(right_node.span, type_name(right)),
            ),
        ) from None


def negate(op: ast.Operator, value: Value, node: ast.Expression) -> Value:
    """`-value`."""
    match value:
        case bool():
            pass
        case float() | np.ndarray():
            return -value
        case Angle(degrees):
            return Angle(-degrees)
        case Vector(components):
            return Vector(tuple(-c for c in components))
    if value is POISON:
        raise Poisoned
    raise Fault(
        "type-operator",
        f"{type_name(value)} cannot be negated",
        op.span,
        secondary=(Label(node.span, type_name(value)),),
    )


def truth(value: Value, node: ast.Expression, subject: str) -> bool:
    """A truth value, or the fault that `subject` is to be one."""
    if value is POISON:
        raise Poisoned
    if not isinstance(value, bool):
        raise mismatch(subject, "a truth value", value, node)
    return value


def finite(value: Value, op: ast.Operator) -> Value:
    """The value, if all its numbers are finite."""
    numbers: tuple[Any, ...] = ()
    match value:
        case Angle(degrees):
            numbers = (degrees,)
        case Vector(components) | Color(components):
            numbers = components
        case float() | np.ndarray():
            numbers = (value,)
    if not all(map(_is_finite, numbers)):
        raise _overflow(op)
    return value


def _is_finite(number: Any) -> bool:
    if isinstance(number, np.ndarray):
        return bool(np.isfinite(number).all())
    return math.isfinite(number)


def _arithmetic(symbol: str, left: Any, right: Any) -> Any:
    # With arrays the results are arrays: the same in every lane to the last bit.
    apply: Callable[[Any, Any], Any] = _ARITHMETIC[symbol]
    match left, right:
        case (np.ndarray(), float() | np.ndarray()) | (float(), np.ndarray()):
            return apply(left, right)
        case (Angle(a), Angle(b)) if symbol in "+-":
            return Angle(apply(a, b))
        case (Angle(a), Angle(b)) if symbol == "%":
            return Angle(a % b)
        case (Angle(a), Angle(b)) if symbol == "/":
            return a / b
        case (Angle(a), float() | np.ndarray() as b) if symbol in "*/":
            return Angle(apply(a, b))
        case (float() | np.ndarray() as a, Angle(b)) if symbol == "*":
            return Angle(apply(a, b))
        case (Vector(a), Vector(b)) if symbol in "+-" and len(a) == len(b):
            return Vector(tuple(map(apply, a, b)))
        case (Vector(a), float() | np.ndarray() as b) if symbol in "*/":
            return Vector(tuple(apply(c, b) for c in a))
        case (float() | np.ndarray() as a, Vector(b)) if symbol == "*":
            return Vector(tuple(apply(a, c) for c in b))
        case (Color(a), Color(b)) if symbol in "+-*":
            return Color((apply(a[0], b[0]), apply(a[1], b[1]), apply(a[2], b[2])))
        case (Color(a), float() | np.ndarray() as b) if symbol in "*/":
            return Color((apply(a[0], b), apply(a[1], b), apply(a[2], b)))
        case (float() | np.ndarray() as a, Color(b)) if symbol == "*":
            return Color((apply(a, b[0]), apply(a, b[1]), apply(a, b[2])))
        case (List(a), List(b)) if symbol == "+":
            return List(a + b)
        case (scene.Transform(steps=a), scene.Transform(steps=b)) if symbol == "*":
            # Steps are in reading order, the first applied first; a product applies b first.
            return scene.Transform(b + a)
    raise _Meaningless


def _interval(
    left: Value, right: Value, left_node: ast.Expression, right_node: ast.Expression
) -> Interval:
    for value, node in ((left, left_node), (right, right_node)):
        if not isinstance(value, float | Angle | np.ndarray):
            raise mismatch("the end of an interval", "a number or an angle", value, node)
    if isinstance(left, Angle) is not isinstance(right, Angle):
        bare, node = (right, right_node) if isinstance(left, Angle) else (left, left_node)
        raise mismatch("the end of an interval with an angle", "an angle", bare, node)
    return Interval(left, right)  # type: ignore[arg-type]  # numbers, angles, or arrays


def _compare(symbol: str, left: Value, right: Value) -> bool | Truths:
    if varies(left) or varies(right):
        return _compare_lanes(symbol, left, right)
    if symbol in ("==", "!="):
        if type(left) is not type(right) or not isinstance(left, _COMPARABLE):
            raise _Meaningless
        return (left == right) is (symbol == "==")
    match left, right:
        case (bool(), _) | (_, bool()):
            raise _Meaningless
        case (float(a), float(b)) | (Angle(a), Angle(b)):
            return _ORDER[symbol](a, b)
    raise _Meaningless


def _compare_lanes(symbol: str, left: Any, right: Any) -> Truths:
    match left, right:
        case (Angle(a), Angle(b)):
            pass
        case (float() | np.ndarray() as a, float() | np.ndarray() as b):
            pass
        case _:
            raise Sequential
    compare: Callable[[Any, Any], Any] = {**_ORDER, **_EQUALITY}[symbol]
    return Truths(compare(a, b))


def _overflow(op: ast.Operator) -> Fault:
    return Fault("value-not-finite", "the result is too large for a number", op.span)


def _meaningless(symbol: str, left: Value, right: Value) -> str:
    a, b = type_name(left), type_name(right)
    match symbol:
        case "+":
            return f"{a} and {b} cannot be added"
        case "-":
            return f"{b} cannot be subtracted from {a}"
        case "*":
            return f"{a} and {b} cannot be multiplied"
        case "/" | "%":
            return f"{a} cannot be divided by {b}"
        case _:
            return f"{a} and {b} cannot be compared by `{symbol}`"


def _mend(symbol: str, left: Value, right: Value) -> str | None:
    kinds = {type(left), type(right)}
    if kinds == {float, Angle}:
        return "give the number a unit, such as `40deg`"
    if kinds == {Vector} and symbol == "*":
        return "write `dot(a, b)` or `cross(a, b)`"
    if kinds == {Vector, float} and symbol in "+-":
        return "write the number for every component, as in `v + (1, 1, 1)`"
    if scene.Transform in kinds and symbol == "*" and len(kinds) == 2:
        return "apply a transform to an object with `object.transform(t)`"
    if kinds <= {float, str, List, Angle, Vector} and symbol == "==" and List in kinds:
        return "compare the items"
    if kinds == {scene.Transform} and symbol == "+":
        return "transforms are combined by a product: `a * b` applies `b` first"
    if str in kinds and symbol == "+":
        return "strings are not joined, and numbers not made strings: write the whole text"
    if is_node(left) and is_node(right) and symbol == "-":
        return "shapes are not cut: those in one block stand together"
    if (is_node(left) or is_node(right)) and float in kinds and symbol in "*/":
        return "an object is scaled by `object.scale(2)`"
    if (is_node(left) or is_node(right)) and Vector in kinds and symbol in "+-":
        return "an object is moved by `object.translate(v)`"
    if is_node(left) and is_node(right):
        return "objects in one block are a group: give each a line of its own"
    return None
