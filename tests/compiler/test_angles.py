"""Sine and cosine of degrees against mpmath."""

from __future__ import annotations

import mpmath
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from compiler.angles import sin_cos
from compiler.double_double import DoubleDouble

angles = st.floats(min_value=-1e4, max_value=1e4) | st.floats(min_value=-1e300, max_value=1e300)


def _value(x: DoubleDouble) -> mpmath.mpf:
    return mpmath.mpf(float(x.hi)) + mpmath.mpf(float(x.lo))


@given(angles)
def test_error_is_below_2_to_the_minus_103(degrees: float) -> None:
    with mpmath.workdps(400):
        radians = mpmath.mpf(degrees) * mpmath.pi / 180
        for computed, exact in zip(
            sin_cos(np.float64(degrees)), (mpmath.sin(radians), mpmath.cos(radians)), strict=True
        ):
            assert abs(_value(computed) - exact) < mpmath.mpf(2) ** -103
            if abs(exact) > 1e-15:
                assert abs(mpmath.mpf(float(computed.hi)) - exact) <= 0.51 * np.spacing(
                    abs(float(computed.hi))
                )


@pytest.mark.parametrize("turns", [0, 1, -7, 10**5, 2**40])
@pytest.mark.parametrize(
    ("degrees", "sine", "cosine"),
    [
        *[(0, 0, 1), (90, 1, 0), (180, 0, -1), (270, -1, 0), (30, 0.5, None), (60, None, 0.5)],
        *[(120, None, -0.5), (150, 0.5, None), (210, -0.5, None), (300, None, 0.5)],
    ],
)
def test_special_angles_are_exact(
    turns: int, degrees: float, sine: float | None, cosine: float | None
) -> None:
    for computed, exact in zip(
        sin_cos(np.float64(degrees + 360.0 * turns)), (sine, cosine), strict=True
    ):
        if exact is not None:
            assert computed.hi == exact
            assert computed.lo == 0.0


def test_36000090_degrees_is_90_degrees() -> None:
    assert [float(x.hi) for x in sin_cos(np.float64(36000090.0))] == [1.0, 0.0]


@given(st.lists(angles, min_size=1, max_size=20))
def test_batches_give_the_same_bits(degrees: list[float]) -> None:
    sines, cosines = sin_cos(np.array(degrees))
    for lane, angle in enumerate(degrees):
        sine, cosine = sin_cos(np.float64(angle))
        assert sines.take(lane) == sine
        assert cosines.take(lane) == cosine


@pytest.mark.parametrize("degrees", [np.nan, np.inf, -np.inf])
def test_no_angle_has_no_sine(degrees: float) -> None:
    assert all(np.isnan(float(x.hi)) for x in sin_cos(np.float64(degrees)))
