"""Double-double arithmetic against mpmath."""

from __future__ import annotations

from collections.abc import Iterator

import mpmath
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from compiler.double_double import ONE, ZERO, DoubleDouble, two_product, two_sum

U = mpmath.mpf(2) ** -53


@pytest.fixture(autouse=True, scope="module")
def _precision() -> Iterator[None]:
    with mpmath.workprec(1500):
        yield


def _exact(x: DoubleDouble) -> mpmath.mpf:
    return mpmath.mpf(float(x.hi)) + mpmath.mpf(float(x.lo))


reals = st.floats(min_value=1e-90, max_value=1e90) | st.floats(min_value=-1e90, max_value=-1e-90)


@st.composite
def double_doubles(draw: st.DrawFn) -> DoubleDouble:
    hi = np.float64(draw(reals))
    part = draw(st.just(0.0) | st.floats(min_value=-1.0, max_value=1.0))
    return DoubleDouble(*two_sum(hi, np.float64(hi * 2.0**-53 * part)))


@given(reals, reals)
def test_error_free_operations_are_exact(a: float, b: float) -> None:
    x, y = np.float64(a), np.float64(b)
    s, e = two_sum(x, y)
    assert mpmath.mpf(float(s)) + float(e) == mpmath.mpf(a) + b
    p, f = two_product(x, y)
    assert mpmath.mpf(float(p)) + mpmath.mpf(float(f)) == mpmath.mpf(a) * b


@given(double_doubles(), double_doubles())
def test_sum_and_difference_are_within_their_bound(x: DoubleDouble, y: DoubleDouble) -> None:
    size = abs(_exact(x)) + abs(_exact(y))
    assert abs(_exact(x + y) - (_exact(x) + _exact(y))) <= 3 * U**2 * size
    assert abs(_exact(x - y) - (_exact(x) - _exact(y))) <= 3 * U**2 * size


@given(double_doubles(), double_doubles())
def test_product_and_quotient_are_within_their_bounds(x: DoubleDouble, y: DoubleDouble) -> None:
    product = _exact(x) * _exact(y)
    assert abs(_exact(x * y) - product) <= 7 * U**2 * abs(product)
    quotient = _exact(x) / _exact(y)
    assert abs(_exact(x / y) - quotient) <= 16 * U**2 * abs(quotient)


@given(double_doubles())
def test_square_root_is_within_its_bound(x: DoubleDouble) -> None:
    square = x * x
    root = mpmath.sqrt(_exact(square))
    assert abs(_exact(square.sqrt()) - root) <= 4 * U**2 * root


@given(double_doubles(), double_doubles())
def test_high_part_is_the_rounded_number(x: DoubleDouble, y: DoubleDouble) -> None:
    for z in (x + y, x * y, x / y):
        assert z.hi + z.lo == z.hi


@given(double_doubles(), double_doubles())
def test_arrays_and_scalars_give_the_same_bits(x: DoubleDouble, y: DoubleDouble) -> None:
    def lanes(z: DoubleDouble) -> DoubleDouble:
        return DoubleDouble(np.full(3, z.hi), np.full(3, z.lo))

    for one, many in (
        (x + y, lanes(x) + lanes(y)),
        (x * y, lanes(x) * y),
        (x / y, x / lanes(y)),
        (x + ZERO, lanes(x) + lanes(ZERO)),
        (x * ONE, lanes(x) * lanes(ONE)),
        (ONE / x, lanes(ONE) / lanes(x)),
        (x / ONE, lanes(x) / lanes(ONE)),
    ):
        assert (many.hi == one.hi).all()
        assert (many.lo == one.lo).all()


@pytest.mark.parametrize("size", [1e300, -1e300])
def test_products_do_not_overflow_before_their_result_does(size: float) -> None:
    p, e = two_product(np.float64(size), np.float64(1.0 + 2.0**-52))
    assert mpmath.mpf(float(p)) + mpmath.mpf(float(e)) == mpmath.mpf(size) * (1 + U * 2)


def test_division_by_zero_is_not_finite() -> None:
    with np.errstate(all="ignore"):
        quotient = ONE / DoubleDouble(np.array([0.0, 2.0]))
    assert np.isfinite(quotient.hi + quotient.lo).tolist() == [False, True]
