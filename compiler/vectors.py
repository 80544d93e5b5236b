"""Vectors of three double-doubles."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

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


def leveling(entries: Sequence[DoubleDouble]) -> Part:
    """The power of two that brings the largest entry to [1/2, 1), or nearest to it.

    Between 2^-1000 and 2^1000, so that its inverse is a power of two as well.
    """
    largest: Part = np.float64(0.0)
    for entry in entries:
        largest = np.maximum(largest, np.abs(entry.hi))
    exponent = np.clip(np.frexp(largest)[1], -1000, 1000)
    power: Part = np.ldexp(np.float64(1.0), -exponent)
    return power


def leveled(v: Sequence[DoubleDouble]) -> Vector3:
    """The direction of `v`, of a length whose square neither over- nor underflows."""
    power = leveling(v)
    return v[0].scaled(power), v[1].scaled(power), v[2].scaled(power)


def length(v: Sequence[DoubleDouble]) -> DoubleDouble:
    """The length |v|, over the whole range of float64; NaN for the zero vector."""
    v0 = leveled(v)
    return dot(v0, v0).sqrt().scaled(1.0 / leveling(v))


def unit(v: Sequence[DoubleDouble]) -> Vector3:
    """The direction v / |v|; NaN for the zero vector."""
    v0 = leveled(v)
    norm = dot(v0, v0).sqrt()
    return v0[0] / norm, v0[1] / norm, v0[2] / norm
