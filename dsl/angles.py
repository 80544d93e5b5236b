"""Angles in degrees: exact conversion of units and trigonometry exact at the special angles.

Degrees are kept because they can be reduced exactly: 360° is a number, 2π is not.
"""

from __future__ import annotations

import math

UNITS = ("deg", "rad", "turn")

_DEGREES_PER_RADIAN = (
    "57.295779513082320876798154814105170332405472466564321549160243861202847148321552632"
)
"""180/π to 80 digits: a decimal literal in radians is rounded once, from its exact value."""


def degrees_from_literal(digits: str, unit: str) -> float:
    """Degrees of a decimal literal and its unit, rounded once from the exact product."""
    number = float(digits)
    if unit == "deg" or number == 0.0 or math.isinf(number):
        return number
    from decimal import Context, Decimal

    factor = Decimal(360) if unit == "turn" else Decimal(_DEGREES_PER_RADIAN)
    context = Context(prec=len(digits) + 85, Emin=-999_999, Emax=999_999, traps=[])
    return float(context.multiply(Decimal(digits), factor))


def sine(degrees: float) -> float:
    """The sine of an angle in degrees; 0, ±1/2 and ±1 are exact."""
    # math.remainder is exact, and so are 90 - |r| and 180 - |r|: nothing is lost in reducing.
    r = math.remainder(degrees, 360.0)
    if abs(r) > 90.0:
        r = math.copysign(180.0 - abs(r), r)
    if abs(r) == 30.0:
        return math.copysign(0.5, r)
    if abs(r) <= 45.0:
        return math.sin(math.radians(r))
    return math.copysign(math.cos(math.radians(90.0 - abs(r))), r)


def cosine(degrees: float) -> float:
    """The cosine of an angle in degrees; 0, ±1/2 and ±1 are exact."""
    r = abs(math.remainder(degrees, 360.0))
    return sine(90.0 - r)


def tangent(degrees: float) -> float:
    """The tangent of an angle in degrees; 0 and ±1 are exact, infinite at odd multiples of 90."""
    r = math.remainder(degrees, 180.0)
    if abs(r) == 45.0:
        return math.copysign(1.0, r)
    if abs(r) == 90.0:
        return math.copysign(math.inf, r)
    if abs(r) < 45.0:
        return math.tan(math.radians(r))
    return math.copysign(1.0 / math.tan(math.radians(90.0 - abs(r))), r)
