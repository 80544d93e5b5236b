"""Sine and cosine of degrees as double-doubles, exact at multiples of 30 where float64 can be.

The angle is reduced exactly: degrees modulo 360 is exact in float64, so is the rest after
subtracting the nearest quarter turn, and so is the rest after subtracting the nearest node of a
table whose step, 3/32 of a degree, is a float64 and divides 30 and 45. What is left is at most
3/64 of a degree; it is turned to radians by a double-double constant and goes into Taylor series
whose leading terms alone need double-double. The sum formulas join both. Absolute error 2^-103.
"""

from __future__ import annotations

from functools import cache
from math import factorial

import numpy as np
from numpy.typing import NDArray

from compiler.double_double import DoubleDouble, FloatArray, Part

_STEP = 3 / 32
_NODES = 480  # 45 degrees
_BITS = 192
_ONE = 1 << _BITS
"""Constants are computed as integers: numbers times this one."""
_PI = 314159265358979323846264338327950288419716939937510582097494459230 * _ONE // 10**65


def _dd(number: int) -> tuple[float, float]:
    """The double-double nearest to an integer of the above kind."""
    hi = number / _ONE
    return hi, (number - int(hi * _ONE)) / _ONE


def _constant(number: int) -> DoubleDouble:
    hi, lo = _dd(number)
    return DoubleDouble(np.float64(hi), np.float64(lo))


@cache
def _constants() -> tuple[DoubleDouble, dict[int, DoubleDouble]]:
    """Radians per degree, and 1/n! by n, as double-doubles."""
    return _constant(_PI // 180), {n: _constant(_ONE // factorial(n)) for n in range(1, 12)}


@cache
def _table() -> tuple[DoubleDouble, DoubleDouble]:
    """Sine and cosine of 0, 3/32, 6/32, …, 45 degrees, `(481,)`."""
    x = 3 * _PI // (32 * 180)
    term, series = _ONE, [0, 0]
    for n in range(24):
        series[n % 2] += term if n % 4 < 2 else -term
        term = term * x // ((n + 1) * _ONE)
    cos_step, sin_step = series
    sines, cosines = [0], [_ONE]
    for _ in range(_NODES):
        s, c = sines[-1], cosines[-1]
        sines.append((s * cos_step + c * sin_step) >> _BITS)
        cosines.append((c * cos_step - s * sin_step) >> _BITS)
    return _column(sines), _column(cosines)


def _column(numbers: list[int]) -> DoubleDouble:
    # Without the last bits, which 480 roundings spoil: sin 30° is 0.5 and nothing else.
    spoilt = 16
    rounded = [((n + (1 << spoilt - 1)) >> spoilt) << spoilt for n in numbers]
    hi, lo = np.array([_dd(n) for n in rounded]).T
    return DoubleDouble(np.ascontiguousarray(hi), np.ascontiguousarray(lo))


def sin_cos(degrees: Part) -> tuple[DoubleDouble, DoubleDouble]:
    """Sine and cosine of angles in degrees, of any size; NaN where they are not finite."""
    values: FloatArray = np.atleast_1d(np.asarray(degrees, dtype=np.float64))
    with np.errstate(invalid="ignore"):
        turned = np.fmod(values, 360.0)
    quarter = np.rint(turned / 90.0)
    rest = turned - 90.0 * quarter
    node = np.rint(rest / _STEP)
    sine, cosine = _near(rest - _STEP * node, node)
    sine, cosine = _by_quarter(np.nan_to_num(quarter).astype(np.int64) & 3, sine, cosine)
    if np.ndim(degrees) == 0:
        return sine.take(0), cosine.take(0)
    return sine, cosine


def _near(rest: FloatArray, node: FloatArray) -> tuple[DoubleDouble, DoubleDouble]:
    """Sine and cosine of `_STEP · node + rest` degrees, |rest| ≤ `_STEP` / 2."""
    per_degree, inverse = _constants()
    x = per_degree * DoubleDouble(rest)
    y = x * x
    # sin x = x + x y (-1/3! + y (1/5! - y/7! + y²/9!)),  cos x - 1 = y (-1/2! + y (1/4! - …)):
    # y < 2^-20, so float64 is enough for what follows the constants 1/5! and 1/4!.
    tail = y.hi * (y.hi * inverse[9].hi - inverse[7].hi)
    sin_x = x + x * (y * (y * _nudged(inverse[5], tail) - inverse[3]))
    tail = y.hi * (y.hi * (inverse[8].hi - y.hi * inverse[10].hi) - inverse[6].hi)
    cos_x_less_1 = y * (y * _nudged(inverse[4], tail) - inverse[2])

    sines, cosines = _table()
    index = np.abs(np.nan_to_num(node)).astype(np.int64)
    sign = np.where(node < 0, -1.0, 1.0)
    sin_node = sines.take(index)
    sin_node = DoubleDouble(sign * sin_node.hi, sign * sin_node.lo)
    cos_node = cosines.take(index)
    return (
        sin_node + (sin_node * cos_x_less_1 + cos_node * sin_x),
        cos_node + (cos_node * cos_x_less_1 - sin_node * sin_x),
    )


def _nudged(constant: DoubleDouble, small: Part) -> DoubleDouble:
    """Add a number far below the constant to it."""
    small = small + constant.lo
    hi = constant.hi + small
    return DoubleDouble(hi, small - (hi - constant.hi))


def _by_quarter(
    quarter: NDArray[np.int64], sine: DoubleDouble, cosine: DoubleDouble
) -> tuple[DoubleDouble, DoubleDouble]:
    """Turn (sine, cosine) on by whole quarter turns, exactly."""
    odd = (quarter & 1).astype(bool)
    sin_sign = np.where(quarter >= 2, -1.0, 1.0)
    cos_sign = np.where((quarter == 1) | (quarter == 2), -1.0, 1.0)
    return (
        DoubleDouble(
            sin_sign * np.where(odd, cosine.hi, sine.hi),
            sin_sign * np.where(odd, cosine.lo, sine.lo),
        ),
        DoubleDouble(
            cos_sign * np.where(odd, sine.hi, cosine.hi),
            cos_sign * np.where(odd, sine.lo, cosine.lo),
        ),
    )
