"""Double-double arithmetic on arrays: numbers of 106 bits as unevaluated sums of two float64.

A number is hi + lo with hi = RN(hi + lo), so `hi` alone is its rounding to float64. With
u = 2^-53, relative error bounds as proved by Joldes, Muller, Popescu, "Tight and rigorous error
bounds for basic building blocks of double-word arithmetic", ACM TOMS 44(2), 2017: sum 3u² for
operands of one sign (of the larger operand otherwise), product 7u², quotient 15u² + 56u³.
The bounds hold while no operand exceeds 1e300 and no product lies below 1e-290; beyond that
results lose low bits, and where float64 overflows they are not finite.

NumPy has no fma, so products are made exact by splitting (Dekker, "A floating-point technique for
extending the available precision", Numerische Mathematik 18, 1971), here on the bits of the
number, which cannot overflow.

A part is an array or a float64 scalar. A scalar holds for every lane, and scalars 0 and 1 cost
nothing: a matrix of mostly constant entries is multiplied at the price of its varying ones, and
since 0·x = 0, 1·x = x and 0 + x = x are exact, with the same result to the last bit. So it is for
numbers that were halfs or floats: they are their own upper halves.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
Part = FloatArray | np.float64

_HALF = np.int64(1 << 26)
_UPPER = np.int64(-(1 << 27))
_NOTHING = np.float64(0.0)


def two_sum(a: Part, b: Part) -> tuple[Part, Part]:
    """The rounded sum and its exact error (Knuth, TAOCP 2, 4.2.2)."""
    s = a + b
    bb = s - a
    # a - (s - bb) + (b - bb), in place where these are arrays.
    missed = s - bb
    missed -= a
    error = b - bb
    error -= missed
    return s, error


def _fast_two_sum(a: Part, b: Part) -> tuple[Part, Part]:
    """As `two_sum`, for |a| ≥ |b| or a = 0 (Dekker 1971)."""
    s = a + b
    error = a - s  # b - (s - a), in place where these are arrays
    error += b
    return s, error


def _split(a: Part) -> tuple[Part, Part]:
    """Two halves of at most 26 bits each with a = upper + lower."""
    bits = a.view(np.int64) + _HALF
    bits &= _UPPER
    upper: Part = bits.view(np.float64)
    return upper, a - upper


def two_product(a: Part, b: Part) -> tuple[Part, Part]:
    """The rounded product and its exact error (Dekker 1971)."""
    return _product(a, _split(a), b, _split(b))


def _product(
    a: Part, a_halves: tuple[Part, Part], b: Part, b_halves: tuple[Part, Part]
) -> tuple[Part, Part]:
    """`two_product` of what is split already."""
    (a1, a0), (b1, b0) = a_halves, b_halves
    p = a * b
    a_short, b_short = _is_nothing(a0), _is_nothing(b0)
    if a_short and b_short:
        return p, _NOTHING
    # In place, where these are arrays: the order is that of the sum.
    error = a1 * b1
    error -= p
    if not b_short:
        error += a1 * b0
    if not a_short:
        error += a0 * b1
    if not a_short and not b_short:
        error += a0 * b0
    return p, error


@dataclass(slots=True)
class DoubleDouble:
    """hi + lo. Parts are float64 scalars or arrays that broadcast against each other.

    Neither is changed; the halves of `hi`, which every product needs, are kept once they are made.
    """

    hi: Part
    lo: Part = _NOTHING
    _halves: tuple[Part, Part] | None = field(default=None, init=False, repr=False, compare=False)

    @property
    def halves(self) -> tuple[Part, Part]:
        """`hi` as a sum of two numbers of at most 26 bits."""
        if self._halves is None:
            self._halves = _split(self.hi)
        return self._halves

    @staticmethod
    def of(value: float) -> DoubleDouble:
        """The constant `value`."""
        return DoubleDouble(np.float64(value))

    @staticmethod
    def short(hi: Part) -> DoubleDouble:
        """Numbers of at most 26 bits, such as floats."""
        number = DoubleDouble(hi)
        number._halves = hi, _NOTHING
        return number

    @property
    def is_short(self) -> bool:
        """Whether these are known to be numbers of at most 26 bits."""
        return self._halves is not None and _is_nothing(self._halves[1]) and _is_nothing(self.lo)

    def is_constant(self, value: float) -> bool:
        """Whether this is a scalar equal to `value`."""
        return bool(self.hi.ndim == 0 and self.hi == value and _is_nothing(self.lo))

    def __neg__(self) -> DoubleDouble:
        return DoubleDouble.short(-self.hi) if self.is_short else DoubleDouble(-self.hi, -self.lo)

    def __add__(self, other: DoubleDouble) -> DoubleDouble:
        if self.is_constant(0.0):
            return other
        if other.is_constant(0.0):
            return self
        s, e = two_sum(self.hi, other.hi)
        if _is_nothing(self.lo) or _is_nothing(other.lo):
            # Algorithm 4 of Joldes et al.; what algorithm 6 gives when one lo is 0.
            return DoubleDouble(*_fast_two_sum(s, e + (self.lo + other.lo)))
        t, f = two_sum(self.lo, other.lo)
        s, e = _fast_two_sum(s, e + t)
        return DoubleDouble(*_fast_two_sum(s, e + f))

    def __sub__(self, other: DoubleDouble) -> DoubleDouble:
        return self + (-other)

    def __mul__(self, other: DoubleDouble) -> DoubleDouble:
        if self.is_constant(0.0) or other.is_constant(1.0):
            return self
        if other.is_constant(0.0) or self.is_constant(1.0):
            return other
        p, e = _product(self.hi, self.halves, other.hi, other.halves)
        if not _is_nothing(other.lo):
            cross = self.hi * other.lo
            if not _is_nothing(self.lo):
                cross += self.lo * other.hi
            e += cross
        elif not _is_nothing(self.lo):
            e += self.lo * other.hi
        return DoubleDouble(p) if _is_nothing(e) else DoubleDouble(*_fast_two_sum(p, e))

    def __truediv__(self, other: DoubleDouble) -> DoubleDouble:
        """Quotient; not finite where `other` is 0 (algorithm 17 of Joldes et al.)."""
        if other.is_constant(1.0):
            return self
        q = self.hi / other.hi
        product = other * DoubleDouble(q)
        rest = (self.hi - product.hi) + (self.lo - product.lo)
        return DoubleDouble(*_fast_two_sum(q, rest / other.hi))

    def sqrt(self) -> DoubleDouble:
        """Square root; NaN for 0 and below, whose roots nothing here divides by.

        Error 25/8 u² (Lefèvre, Louvet, Muller, Picot, Rideau, "Accurate calculation of
        Euclidean norms using double-word arithmetic", ACM TOMS 49(1), 2023).
        """
        root = np.sqrt(self.hi)
        square, error = two_product(root, root)
        rest = ((self.hi - square) - error) + self.lo
        return DoubleDouble(*_fast_two_sum(root, rest / (root + root)))

    def scaled(self, power: Part) -> DoubleDouble:
        """This times a power of two, exactly."""
        if self.is_constant(0.0):
            return self
        if self.is_short:
            return DoubleDouble.short(self.hi * power)
        return DoubleDouble(self.hi * power, self.lo if _is_nothing(self.lo) else self.lo * power)

    def take(self, index: NDArray[np.signedinteger[Any]] | slice | int) -> DoubleDouble:
        """The lanes at `index`; scalars hold for all."""
        return DoubleDouble(_take(self.hi, index), _take(self.lo, index))


ZERO = DoubleDouble.of(0.0)
ONE = DoubleDouble.of(1.0)


def _is_nothing(part: Part) -> bool:
    return bool(part.ndim == 0 and part == 0.0)


def _take(part: Part, index: NDArray[np.signedinteger[Any]] | slice | int) -> Part:
    return part if isinstance(part, np.float64) else part[index]
