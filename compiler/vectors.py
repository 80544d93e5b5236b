"""Vectors of three double-doubles."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from compiler.double_double import DoubleDouble, Part

Vector3 = tuple[DoubleDouble, DoubleDouble, DoubleDouble]


def dot(a: Sequence[DoubleDouble], b: Sequence[DoubleDouble]) -> DoubleDouble:
    """The product a · b."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a: Sequence[DoubleDouble], b: Sequence[DoubleDouble]) -> Vector3:
    """The product a × b."""
    return (
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    )


def exponent(entries: Sequence[DoubleDouble]) -> NDArray[np.int64] | np.int64:
    """The power of two that exceeds the largest entry; 0 where all are 0."""
    largest: Part = np.float64(0.0)
    for entry in entries:
        largest = np.maximum(largest, np.abs(entry.hi))
    return np.frexp(largest)[1].astype(np.int64)


def scaled(v: Sequence[DoubleDouble]) -> Vector3:
    """`v` times the power of two that brings its largest entry to [1/2, 1): its direction."""
    x, y, z = (entry.times_power_of_two(-exponent(v)) for entry in v)
    return x, y, z


def length(v: Sequence[DoubleDouble]) -> DoubleDouble:
    """The length |v|, over the whole range of float64; NaN for the zero vector."""
    v0 = scaled(v)
    return dot(v0, v0).sqrt().times_power_of_two(exponent(v))


def unit(v: Sequence[DoubleDouble]) -> Vector3:
    """The direction v / |v|; NaN for the zero vector."""
    v0 = scaled(v)
    norm = dot(v0, v0).sqrt()
    return v0[0] / norm, v0[1] / norm, v0[2] / norm
