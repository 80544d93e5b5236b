"""Angles: units are exact, and trigonometry agrees with fifty digits."""

from __future__ import annotations

import math
from fractions import Fraction

import mpmath
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dsl.angles import cosine, degrees_from_literal, sine, tangent

DECIMALS = st.decimals(0, 10**9, places=6, allow_nan=False).map(str)


@given(DECIMALS)
def test_turns_are_rounded_once(digits: str) -> None:
    assert degrees_from_literal(digits, "turn") == float(Fraction(digits) * 360)


@given(DECIMALS)
def test_radians_are_rounded_once(digits: str) -> None:
    with mpmath.workdps(120):
        exact = mpmath.mpf(digits) * 180 / mpmath.pi
        assert degrees_from_literal(digits, "rad") == float(exact)


@pytest.mark.parametrize(
    "digits", ["0", "1e999", "1e99999999999999999999", "1e-99999999999999999999"]
)
@pytest.mark.parametrize("unit", ["deg", "rad", "turn"])
def test_extreme_literals(digits: str, unit: str) -> None:
    value = degrees_from_literal(digits, unit)
    assert value in (0.0, math.inf)


@given(st.floats(-1e9, 1e9))
def test_sine_and_cosine_to_two_ulps(degrees: float) -> None:
    with mpmath.workdps(60):
        radians = mpmath.mpf(degrees) * mpmath.pi / 180
        for value, exact in (
            (sine(degrees), mpmath.sin(radians)),
            (cosine(degrees), mpmath.cos(radians)),
        ):
            # The judge's own error is about 1e-50.
            assert abs(value - exact) <= 2.0 * math.ulp(float(exact)) + 1e-40


@given(st.integers(-10_000, 10_000))
def test_multiples_of_a_right_angle_are_exact(quarter: int) -> None:
    assert sine(90.0 * quarter) == (0.0, 1.0, 0.0, -1.0)[quarter % 4]
    assert cosine(90.0 * quarter) == (1.0, 0.0, -1.0, 0.0)[quarter % 4]
    assert abs(tangent(45.0 + 90.0 * quarter)) == 1.0
    assert math.isinf(tangent(90.0 + 180.0 * quarter))


@given(st.floats(-1e6, 1e6))
def test_tangent_is_the_quotient(degrees: float) -> None:
    if cosine(degrees) != 0.0:
        assert tangent(degrees) == pytest.approx(sine(degrees) / cosine(degrees), rel=1e-15)
