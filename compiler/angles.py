"""Sine and cosine of degrees as double-doubles, exact at multiples of 30 where float64 can be.

The angle is reduced exactly: degrees modulo 360 is exact in float64, so is the rest after
subtracting the nearest quarter turn, and so is the rest after subtracting the nearest node of a
table whose step, 3/32 of a degree, is a float64 and divides 30 and 45. What is left is at most
3/64 of a degree; it is turned to radians by a double-double constant and goes into Taylor series
whose leading terms alone need double-double. The sum formulas join both. Absolute error 2^-103.
"""

from __future__ import annotations

from decimal import Decimal, localcontext
from functools import cache

import numpy as np
from numpy.typing import NDArray

from compiler.double_double import DoubleDouble, FloatArray, Part

_STEP = 3 / 32
_NODES = 480  # 45 degrees
_DIGITS = 50
_PI = "3.14159265358979323846264338327950288419716939937510582097494"


def _dd(numerator: Decimal) -> DoubleDouble:
    hi = float(numerator)
    return DoubleDouble(np.float64(hi), np.float64(numerator - Decimal(hi)))


@cache
def _constants() -> tuple[DoubleDouble, dict[int, DoubleDouble]]:
    """Radians per degree, and 1/n! by n, as double-doubles."""
    with localcontext(prec=_DIGITS):
        factorial, inverse = Decimal(1), {}
        for n in range(1, 12):
            factorial *= n
            inverse[n] = _dd(1 / factorial)
        return _dd(Decimal(_PI) / 180), inverse


@cache
def _table() -> tuple[DoubleDouble, DoubleDouble]:
    """Sine and cosine of 0, 3/32, 6/32, …, 45 degrees, `(481,)`."""
    with localcontext(prec=_DIGITS):
        x = Decimal(_PI) / 180 * Decimal(_STEP)
        term, sin_step, cos_step = Decimal(1), Decimal(0), Decimal(0)
        for n in range(24):
            if n % 2:
                sin_step += term if n % 4 == 1 else -term
            else:
                cos_step += term if n % 4 == 0 else -term
            term = term * x / (n + 1)
        sines, cosines = [Decimal(0)], [Decimal(1)]
        for _ in range(_NODES):
            s, c = sines[-1], cosines[-1]
            sines.append(s * cos_step + c * sin_step)
            cosines.append(c * cos_step - s * sin_step)
        # Two digits fewer than the worst of 480 roundings: sin 30° is 0.5 and nothing else.
        quantum = Decimal(1).scaleb(5 - _DIGITS)
        pairs = [[_dd(v.quantize(quantum)) for v in values] for values in (sines, cosines)]
    sine, cosine = (
        DoubleDouble(np.array([v.hi for v in values]), np.array([v.lo for v in values]))
        for values in pairs
    )
    return sine, cosine


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
