"""Double precision beside the floats of a schema (OvoloMeshAPI, OvoloInstancerAPI).

What is exact holds as long as the floats are its rounding: a program that edits the floats and
knows nothing of the rest is right.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from compiler.usd.clock import Clock
from compiler.usd.report import Report
from compiler.usd.schema import EXACT_POINTS, EXACT_TRANSFORMS
from dsl.scene import FloatArray


def exact_points(prim: Any, points: FloatArray, clock: Clock, report: Report) -> FloatArray:
    """The points `(n, 3)` of a mesh, in double precision if it has them so."""
    exact = clock.vectors(prim.GetAttribute(EXACT_POINTS), 3)
    if exact is None:
        return points
    if _is_rounding(points, exact):
        return exact
    _report_edited(EXACT_POINTS, "points", prim, report)
    return points


def exact_transforms(
    prim: Any, positions: FloatArray, clock: Clock, report: Report
) -> FloatArray | None:
    """Matrices `(n, 12)`, 3x4 row by row, of a point instancer that has them."""
    value = clock.value(prim.GetAttribute(EXACT_TRANSFORMS))
    if value is None:
        return None
    matrices = np.asarray(value)
    if matrices.ndim == 3 and _is_rounding(positions, matrices[:, 3, :3]):
        columns = matrices.transpose(0, 2, 1)[:, :3]
        return np.ascontiguousarray(columns, dtype=np.float64).reshape(-1, 12)
    _report_edited(EXACT_TRANSFORMS, "positions", prim, report)
    return None


def _is_rounding(rounded: FloatArray, exact: FloatArray) -> bool:
    with np.errstate(over="ignore"):
        return np.array_equal(rounded.astype(np.float32), exact.astype(np.float32))


def _report_edited(name: str, floats: str, prim: Any, report: Report) -> None:
    message = f"`{name}` no longer are the `{floats}`, and are not used"
    report.add("usd-attribute", message, prim.GetPath(), f"remove `{name}`")
