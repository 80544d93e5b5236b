"""Inverses of rounded matrices."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from compiler.double_double import DoubleDouble, FloatArray
from compiler.transforms import with_inverse

_CHUNK = 8192


def derived_inverses(forward: FloatArray, low: NDArray[np.float32]) -> FloatArray:
    """The inverses of `world_from_object` `(n, 3, 4)` plus `translation_low` `(n or 0, 3)`.

    Composed inverses are more accurate: they come from the steps, these from rounded products.
    """
    inverse = np.empty_like(forward)
    for first in range(0, len(forward), _CHUNK):
        lanes = slice(first, first + _CHUNK)
        matrix = forward[lanes]
        linear = [
            [DoubleDouble(np.ascontiguousarray(matrix[:, i, j])) for j in range(3)]
            for i in range(3)
        ]
        translation = [
            DoubleDouble(np.ascontiguousarray(matrix[:, i, 3]), _low(low, lanes, i))
            for i in range(3)
        ]
        with np.errstate(all="ignore"):
            with_inverse(linear, translation).inverse.round_into(inverse[lanes])
    return inverse


def _low(low: NDArray[np.float32], lanes: slice, axis: int) -> FloatArray | np.float64:
    return low[lanes, axis].astype(np.float64) if len(low) else np.float64(0.0)
