"""The numbers to compute with: float64, longdouble, or mpmath's of any precision.

The interpreter is written once, over NumPy arrays whose elements are any of these; mpmath numbers
live in object arrays. Vectors are stacked along the first axis: n points are an array `(3, n)`.
"""

from __future__ import annotations

from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[Any]
"""Numbers of the chosen kind; comments give the shape."""

NumberName = Literal["float64", "longdouble", "mpmath"]

PI = "3.14159265358979323846264338327950288419716939937510582097494459230781640628620899862803"


class Number:
    """One kind of number: how to make arrays of it, and what NumPy cannot do for all kinds alike.

    `epsilon` is the unit roundoff. mpmath computes with `digits` decimal digits.
    """

    def __init__(self, name: NumberName, digits: int = 50) -> None:
        self._mpmath: Any = None
        if name == "mpmath":
            import mpmath

            self._mpmath = mpmath.MPContext()
            self._mpmath.dps = digits
            self._convert = np.frompyfunc(self._mpmath.mpf, 1, 1)
            self.epsilon = float(self._mpmath.eps) / 2
        elif name in ("float64", "longdouble"):
            self._dtype = np.dtype(name)
            self.epsilon = float(np.finfo(self._dtype).eps) / 2
        else:
            raise ValueError(f"number is {name!r}: take 'float64', 'longdouble' or 'mpmath'")

    def array(self, values: ArrayLike) -> Array:
        """The values, exactly, as an array of this kind."""
        if self._mpmath is None:
            return np.array(values, self._dtype)
        return np.asarray(self._convert(np.asarray(values)), object)

    def sqrt(self, x: Array) -> Array:
        """Square root; 0 where rounding made x negative."""
        x = np.maximum(x, 0)
        if self._mpmath is None:
            return np.sqrt(x)
        return np.asarray(np.frompyfunc(self._mpmath.sqrt, 1, 1)(x), object)

    def length(self, v: Array) -> Array:
        """Euclidean length `(n,)` of `(k, n)`, by way of the largest component: no overflow."""
        largest = np.abs(v).max(axis=0)
        w = ratio(v, largest, 0)
        length: Array = largest * self.sqrt(dot(w, w))
        return length

    def sine_cosine(self, degrees: float) -> tuple[Any, Any]:
        """Sine and cosine of an angle in degrees, exact at multiples of 90.

        The angle is reduced in degrees, where a quarter turn is a whole number: both remainders
        are exact.
        """
        quarter = round(np.fmod(degrees, 360.0) / 90.0)
        remainder = np.fmod(degrees, 360.0) - 90.0 * quarter
        if self._mpmath is None:
            angle = self._dtype.type(remainder) * self._dtype.type(PI) / 180
            sine, cosine = np.sin(angle), np.cos(angle)
        else:
            angle = self._mpmath.mpf(remainder) * self._mpmath.pi / 180
            sine, cosine = self._mpmath.sin(angle), self._mpmath.cos(angle)
        turned = ((sine, cosine), (cosine, -sine), (-sine, -cosine), (-cosine, sine))
        return turned[quarter % 4]


def dot(a: Array, b: Array) -> Array:
    """Scalar products `(n,)` of `(3, n)`."""
    products: Array = (a * b).sum(axis=0)
    return products


def apply(matrix: Array, vectors: Array) -> Array:
    """The matrix `(3, 3)` times each of `(3, n)`."""
    images: Array = np.matmul(matrix, vectors)
    return images


def cross(a: Array, b: Array) -> Array:
    """Vector products `(3, n)`."""
    return np.stack(
        [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
    )


def ratio(a: Array, b: Array, otherwise: Any) -> Array:
    """The quotient a / b, and `otherwise` where b is 0 (mpmath would raise)."""
    zero = b == 0
    return np.where(zero, otherwise, a / np.where(zero, 1, b))


def finite(x: Array) -> NDArray[np.bool_]:
    """Where x is neither infinite nor NaN, `x.shape`."""
    return np.asarray(np.abs(x) < np.inf, bool)
