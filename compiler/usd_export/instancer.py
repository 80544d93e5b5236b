"""Many uses of one prototype as a point instancer."""

from __future__ import annotations

from typing import Any

import numpy as np
from pxr import Vt

from compiler.usd.schema import EXACT_TRANSFORMS
from compiler.usd_export.layer import apply_schema, attribute
from dsl.scene import FloatArray, IntArray

_SHEAR = 1e-6
"""Cosine between two axes above which a matrix is more than a scale and a rotation to floats."""


def is_sayable(matrices: FloatArray) -> bool:
    """Whether scale, orientation and position say the matrices `(n, 3, 4)`, to floats."""
    axes = matrices[:, :, :3]
    lengths = np.linalg.norm(axes, axis=1)
    with np.errstate(all="ignore"):
        unit = axes / lengths[:, None]
        products = np.einsum("nij,nik->njk", unit, unit)
    off = products[:, (0, 0, 1), (1, 2, 2)]
    return bool((np.abs(off) < _SHEAR).all() and np.abs(matrices).max() < 1e30)


def write_instances(prim: Any, matrices: FloatArray, ids: IntArray | None) -> None:
    """The arrays of a PointInstancer with one prototype; matrices `(n, 3, 4)` are `is_sayable`."""
    axes = matrices[:, :, :3]
    scales = np.linalg.norm(axes, axis=1)
    scales[np.linalg.det(axes) < 0.0, 0] *= -1.0
    quaternions = _quaternions(axes / scales[:, None])
    positions = np.ascontiguousarray(matrices[:, :, 3], dtype=np.float32)
    count = len(matrices)
    attribute(prim, "protoIndices", "int[]", Vt.IntArray(count, 0))
    attribute(prim, "positions", "point3f[]", Vt.Vec3fArray.FromNumpy(positions))
    floats = quaternions.astype(np.float32)
    attribute(prim, "orientations", "quath[]", Vt.QuathArray.FromNumpy(floats.astype(np.float16)))
    attribute(prim, "orientationsf", "quatf[]", Vt.QuatfArray.FromNumpy(floats))
    attribute(prim, "scales", "float3[]", Vt.Vec3fArray.FromNumpy(scales.astype(np.float32)))
    if ids is not None:
        attribute(prim, "ids", "int64[]", Vt.Int64Array.FromNumpy(np.ascontiguousarray(ids)))
    apply_schema(prim, "OvoloInstancerAPI")
    rows = np.zeros((count, 4, 4))
    rows[:, :, :3] = matrices.transpose(0, 2, 1)
    rows[:, 3, 3] = 1.0
    attribute(prim, EXACT_TRANSFORMS, "matrix4d[]", Vt.Matrix4dArray.FromNumpy(rows))


def _quaternions(rotations: FloatArray) -> FloatArray:
    """Unit quaternions `(n, 4)`, imaginary part first, of rotations `(n, 3, 3)`.

    Of the four ways to find one (Shepperd 1978), the one that divides by the largest component.
    """
    m = rotations
    squares = np.stack(
        [
            1.0 + m[:, 0, 0] - m[:, 1, 1] - m[:, 2, 2],
            1.0 - m[:, 0, 0] + m[:, 1, 1] - m[:, 2, 2],
            1.0 - m[:, 0, 0] - m[:, 1, 1] + m[:, 2, 2],
            1.0 + m[:, 0, 0] + m[:, 1, 1] + m[:, 2, 2],
        ],
        axis=1,
    )
    x, y, z, w = np.arange(4)
    products = np.zeros((len(m), 4, 4))
    for a, b, value in (
        (x, y, m[:, 0, 1] + m[:, 1, 0]),
        (x, z, m[:, 0, 2] + m[:, 2, 0]),
        (y, z, m[:, 1, 2] + m[:, 2, 1]),
        (x, w, m[:, 2, 1] - m[:, 1, 2]),
        (y, w, m[:, 0, 2] - m[:, 2, 0]),
        (z, w, m[:, 1, 0] - m[:, 0, 1]),
    ):
        products[:, a, b] = products[:, b, a] = value
    products[:, np.arange(4), np.arange(4)] = squares
    row = products[np.arange(len(m)), squares.argmax(axis=1)]
    return np.asarray(row / np.linalg.norm(row, axis=1, keepdims=True))
