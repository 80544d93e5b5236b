"""Functions of numbers, angles and vectors."""

from __future__ import annotations

import math
import struct
from collections.abc import Callable, Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dsl.angles import cosine, sine, tangent
from dsl.calls import Site
from dsl.kinds import ANGLE, LIST, MIXABLE, NUMBER, QUANTITY, VECTOR, VECTOR3
from dsl.lanes import Sequential, varies
from dsl.scene import FloatArray
from dsl.values import (
    Angle,
    Builtin,
    Color,
    Kind,
    List,
    Parameter,
    Signature,
    Value,
    Vector,
    format_number,
    type_name,
)

_IN_LANES = ("sqrt", "abs", "min", "max", "floor", "ceil", "random")
"""Those that take arrays; others are called for every different argument."""
_Quantity = float | Angle
_Mixable = float | Angle | Vector | Color
_MASK = (1 << 64) - 1


def random(site: Site, seed: float, rest: tuple[float, ...]) -> float | FloatArray:
    """A number in [0, 1) that is a hash of the arguments' bits.

    SplitMix64 (Steele, Lea, Flood, OOPSLA 2014) with Stafford's mix 13: for each argument the
    state s becomes mix((s xor bits) + 0x9E3779B97F4A7C15), from s = 0, where -0 has the bits
    of 0; the result is the upper 53 bits of s times 2**-53.
    """
    if varies((seed, rest)):
        return _random_lanes([seed, *rest])
    state = 0
    for number in (seed, *rest):
        (bits,) = struct.unpack("<Q", struct.pack("<d", number + 0.0))
        state = ((state ^ bits) + 0x9E3779B97F4A7C15) & _MASK
        state = ((state ^ (state >> 30)) * 0xBF58476D1CE4E5B9) & _MASK
        state = ((state ^ (state >> 27)) * 0x94D049BB133111EB) & _MASK
        state ^= state >> 31
    return math.ldexp(float(state >> 11), -53)


def _random_lanes(numbers: Iterable[float | FloatArray]) -> FloatArray:
    """`random` in every lane."""
    state: NDArray[np.uint64] = np.zeros(1, dtype=np.uint64)
    for number in numbers:
        bits = (np.atleast_1d(np.asarray(number, dtype=np.float64)) + 0.0).view(np.uint64)
        state = (state ^ bits) + np.uint64(0x9E3779B97F4A7C15)
        state = (state ^ (state >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
        state = (state ^ (state >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
        state ^= state >> np.uint64(31)
    result: FloatArray = (state >> np.uint64(11)).astype(np.float64) * 2.0**-53
    return result


def _defined(site: Site, condition: bool, message: str, parameter: str) -> None:
    if not condition:
        raise site.fault("value-domain", message, parameter)


def _finite(site: Site, compute: Callable[[], float]) -> float:
    try:
        result = compute()
    except (OverflowError, ValueError):  # fsum raises ValueError for inf - inf
        result = math.inf
    if not math.isfinite(result):
        raise site.fault("value-not-finite", f"the result of `{site.name}` is too large")
    return result


def _sqrt(site: Site, x: float | FloatArray) -> Value:
    if isinstance(x, np.ndarray):
        if not (x >= 0.0).all():
            raise Sequential
        return np.sqrt(x)
    _defined(site, x >= 0.0, f"the square root of {format_number(x)}, a negative number", "x")
    return math.sqrt(x)


def _log(site: Site, x: float) -> float:
    _defined(site, x > 0.0, f"the logarithm of {format_number(x)}, which is not positive", "x")
    return math.log(x)


def _exp(site: Site, x: float) -> float:
    return _finite(site, lambda: math.exp(x))


def _pow(site: Site, x: float, y: float) -> float:
    whole = y == math.floor(y)
    _defined(site, x >= 0.0 or whole, "a negative number to a power with a fraction", "x")
    _defined(site, x != 0.0 or y >= 0.0, "zero to a negative power", "x")
    return _finite(site, lambda: math.pow(x, y))


def _mod(site: Site, x: _Quantity, y: _Quantity) -> Value:
    a, b, wrap = _same(site, x, y, "y")
    if b == 0.0:
        raise site.fault("value-division-by-zero", "`mod` by zero", "y")
    return wrap(a % b)


def _tan(site: Site, angle: float) -> float:
    result = tangent(angle)
    _defined(site, math.isfinite(result), f"the tangent of {format_number(angle)}°", "angle")
    return result


def _arc(name: str, doc: str, function: Callable[[float], float]) -> Builtin:
    def call(site: Site, x: float) -> Angle:
        _defined(site, abs(x) <= 1.0, f"`{name}` of {format_number(x)}, beyond -1..1", "x")
        return Angle(math.degrees(function(x)))

    return Builtin(name, (Signature((_number("x"),), call),), "an angle", doc)


def _atan2(site: Site, y: float, x: float) -> Angle:
    return Angle(math.degrees(math.atan2(y, x)))


def _round(site: Site, x: float) -> float:
    # Halves go away from zero, as in C; adding 0.5 first would round 0.49999999999999994 up.
    whole = math.trunc(x)
    return float(whole + int(math.copysign(1.0, x))) if abs(x - whole) >= 0.5 else float(whole)


def _floor(site: Site, x: float | FloatArray) -> Value:
    return np.floor(x) + 0.0 if isinstance(x, np.ndarray) else float(math.floor(x))


def _ceil(site: Site, x: float | FloatArray) -> Value:
    return np.ceil(x) + 0.0 if isinstance(x, np.ndarray) else float(math.ceil(x))


def _abs(site: Site, x: _Quantity) -> Value:
    return Angle(abs(x.degrees)) if isinstance(x, Angle) else abs(x)


def _extreme(sign: float) -> Callable[..., Value]:
    """The smallest by the sign 1, the largest by -1; of equal ones the first."""

    def call(site: Site, first: _Quantity, rest: tuple[_Quantity, ...]) -> Value:
        result: _Quantity = first
        for other in rest:
            a, b, wrap = _same(site, result, other, "")
            smaller: Any = sign * b < sign * a
            nearest: Any = np.where(smaller, b, a) if varies(smaller) else b if smaller else a
            result = wrap(nearest)
        return result

    return call


def _clamp(site: Site, x: _Quantity, low: _Quantity, high: _Quantity) -> Value:
    value, lower, wrap = _same(site, x, low, "low")
    _, upper, _ = _same(site, x, high, "high")
    if lower > upper:
        raise site.fault("value-order", "`low` is above `high`", "low")
    return wrap(min(max(value, lower), upper))


def _same(
    site: Site, x: _Quantity, y: _Quantity, blamed: str
) -> tuple[float, float, Callable[[float], _Quantity]]:
    """Two numbers, or the degrees of two angles, and what turns a result into the same kind."""
    if isinstance(x, float | np.ndarray) and isinstance(y, float | np.ndarray):
        return x, y, lambda number: number
    if isinstance(x, Angle) and isinstance(y, Angle):
        return x.degrees, y.degrees, Angle
    raise _mixed(site, x, y, blamed)


def _mix(site: Site, a: _Mixable, b: _Mixable, t: float) -> Value:
    def between(x: float, y: float) -> float:
        return _finite(site, lambda: x + (y - x) * t if t != 1.0 else y)

    match a, b:
        case (float(), float()):
            return between(a, b)
        case (Angle(x), Angle(y)):
            return Angle(between(x, y))
        case (Vector(u), Vector(v)) if len(u) == len(v):
            return Vector(tuple(map(between, u, v)))
        case (Color(u), Color(v)):
            return Color((between(u[0], v[0]), between(u[1], v[1]), between(u[2], v[2])))
    raise _mixed(site, a, b, "b")


def _mixed(site: Site, x: Value, y: Value, blamed: str) -> Exception:
    return site.fault(
        "type-mismatch",
        f"`{site.name}` takes values of one kind, not {type_name(x)} and {type_name(y)}",
        blamed,
    )


_Components = tuple[float, ...]


def _dot(site: Site, a: _Components, b: _Components) -> float:
    if len(a) != len(b):
        raise _mixed(site, Vector(a), Vector(b), "b")
    return _finite(site, lambda: math.fsum(x * y for x, y in zip(a, b, strict=True)))


def _cross(site: Site, a: _Components, b: _Components) -> Vector:
    x = _finite(site, lambda: a[1] * b[2] - a[2] * b[1])
    y = _finite(site, lambda: a[2] * b[0] - a[0] * b[2])
    z = _finite(site, lambda: a[0] * b[1] - a[1] * b[0])
    return Vector((x, y, z))


def _length(site: Site, v: _Components) -> float:
    return _finite(site, lambda: math.hypot(*v))


def _normalize(site: Site, v: _Components) -> Vector:
    _defined(site, any(v), "a vector of length 0 has no direction", "v")
    largest = max(map(abs, v))
    scaled = [c / largest for c in v]
    length = math.hypot(*scaled)
    return Vector(tuple(c / length for c in scaled))


def _count(site: Site, list: List) -> float:
    return float(len(list.items))


def _number(name: str) -> Parameter:
    return Parameter(name, NUMBER, required=True)


def _builtin(
    name: str, result: str, doc: str, function: Callable[..., Value], *parameters: tuple[str, Kind]
) -> Builtin:
    listed = tuple(Parameter(word, kind, required=True) for word, kind in parameters)
    return Builtin(name, (Signature(listed, function, lanes=name in _IN_LANES),), result, doc)


def _many(
    name: str, result: str, doc: str, function: Callable[..., Value], first: str, kind: Kind
) -> Builtin:
    listed = (Parameter(first, kind, required=True),)
    return Builtin(
        name, (Signature(listed, function, rest=kind, lanes=name in _IN_LANES),), result, doc
    )


def _real(
    name: str, doc: str, function: Callable[..., Value], *parameters: tuple[str, Kind]
) -> Builtin:
    return _builtin(name, "a number", doc, function, *parameters)


_SAME = "a value of the same kind"

MATHS = (
    _real("sqrt", "The square root.", _sqrt, ("x", NUMBER)),
    _builtin("abs", _SAME, "The value without its sign.", _abs, ("x", QUANTITY)),
    _many("min", _SAME, "The smallest of the arguments.", _extreme(1.0), "x", QUANTITY),
    _many("max", _SAME, "The largest of the arguments.", _extreme(-1.0), "x", QUANTITY),
    _real(
        "floor",
        "The largest whole number not above x.",
        _floor,
        ("x", NUMBER),
    ),
    _real(
        "ceil",
        "The smallest whole number not below x.",
        _ceil,
        ("x", NUMBER),
    ),
    _real("round", "The nearest whole number; halves go away from zero.", _round, ("x", NUMBER)),
    _real("sin", "The sine.", lambda site, angle: sine(angle), ("angle", ANGLE)),
    _real("cos", "The cosine.", lambda site, angle: cosine(angle), ("angle", ANGLE)),
    _real("tan", "The tangent.", _tan, ("angle", ANGLE)),
    _arc("asin", "The angle in -90deg..90deg of that sine.", math.asin),
    _arc("acos", "The angle in 0deg..180deg of that cosine.", math.acos),
    _builtin(
        "atan2",
        "an angle",
        "The angle of the point (x, y), from the x axis towards y.",
        _atan2,
        ("y", NUMBER),
        ("x", NUMBER),
    ),
    _real("pow", "x to the power y.", _pow, ("x", NUMBER), ("y", NUMBER)),
    _real("exp", "e to the power x.", _exp, ("x", NUMBER)),
    _real("log", "The natural logarithm.", _log, ("x", NUMBER)),
    _builtin(
        "mod",
        _SAME,
        "The remainder of x / y, with the sign of y.",
        _mod,
        ("x", QUANTITY),
        ("y", QUANTITY),
    ),
    _builtin(
        "clamp",
        _SAME,
        "x, but at least `low` and at most `high`.",
        _clamp,
        ("x", QUANTITY),
        ("low", QUANTITY),
        ("high", QUANTITY),
    ),
    _builtin(
        "mix",
        _SAME,
        "From a, where t is 0, to b, where t is 1.",
        _mix,
        ("a", MIXABLE),
        ("b", MIXABLE),
        ("t", NUMBER),
    ),
    _real("dot", "The scalar product.", _dot, ("a", VECTOR), ("b", VECTOR)),
    _builtin(
        "cross",
        "a vector of 3",
        "The vector product.",
        _cross,
        ("a", VECTOR3),
        ("b", VECTOR3),
    ),
    _builtin(
        "normalize",
        "a vector",
        "The vector of length 1 with the same direction.",
        _normalize,
        ("v", VECTOR),
    ),
    _real("length", "The length of a vector.", _length, ("v", VECTOR)),
    _real("count", "How many items a list has.", _count, ("list", LIST)),
    _many(
        "random",
        "a number",
        "A number from 0 up to 1 that is a hash of the arguments: the same for the same ones.",
        random,
        "seed",
        NUMBER,
    ),
)
