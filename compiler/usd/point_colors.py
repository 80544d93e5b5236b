"""Display colours of a point instancer's own, one for each instance.

By UsdGeomPointInstancer, "Primvars on PointInstancer", a primvar of the instancer is one value for
all instances if it is constant or uniform, else `elementSize` elements for each, and holds at the
root of the instance: so prims of the prototypes keep materials and colours of their own.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from pxr import UsdGeom

from compiler.column import Integers
from compiler.usd.clock import Clock, numbers
from compiler.usd.report import Report
from dsl.scene import DEFAULT_MATERIAL, FloatArray, IntArray, Material

KINDS = 4096
"""Materials of one instancer; of more, colours are rounded."""

LEVELS = 15
"""Steps of a rounded colour between zero and the largest, along its square root."""

_BY_INSTANCE = ("vertex", "varying", "faceVarying")


@dataclass(frozen=True, slots=True, eq=False)
class PointColors:
    """`labels` `(n,)` say which of the `materials` each instance is drawn in."""

    materials: list[Material]
    labels: Integers


def point_colors(prim: Any, count: int, clock: Clock, report: Report) -> PointColors | None:
    """The colours of an instancer's `count` instances, or None where they have none of their own.

    None, too, for a wrong number of values.
    """
    colors = _values(prim, "displayColor", 3, clock)
    opacities = _values(prim, "displayOpacity", 1, clock)
    own = [values for values in (colors, opacities) if values is not None and values.by_instance]
    if not own or any(len(values.rows) != count for values in own):
        return None
    rows = np.empty((count, 4))
    rows[:, :3] = DEFAULT_MATERIAL.diffuse if colors is None else colors.rows
    rows[:, 3:] = 1.0 if opacities is None else np.clip(opacities.rows, 0.0, 1.0)
    kinds, labels = np.unique(rows, axis=0, return_inverse=True)
    if len(kinds) > KINDS:
        message = f"instances of {len(kinds)} colours are drawn in rounded ones"
        report.add("usd-primvar", message, prim.GetPath())
        kinds, labels = np.unique(_rounded(rows), axis=0, return_inverse=True)
    materials = [Material(diffuse=(r, g, b), opacity=a) for r, g, b, a in kinds.tolist()]
    return PointColors(materials, labels.reshape(-1).astype(np.int32))


@dataclass(frozen=True, slots=True, eq=False)
class _Values:
    """Rows `(n, width)`, one for each instance or one for all."""

    rows: FloatArray
    by_instance: bool


def _values(prim: Any, name: str, width: int, clock: Clock) -> _Values | None:
    """A primvar of the instancer, or one that it inherits; None where no finite numbers are."""
    primvar = UsdGeom.PrimvarsAPI(prim).FindPrimvarWithInheritance(name)
    if not primvar or not primvar.HasValue():
        return None
    table = numbers(clock.value(primvar.GetAttr()))
    if table is None or not table.size or not table.ndim or table.size != len(table) * width:
        return None
    rows = table.reshape(-1, width)[:: max(primvar.GetElementSize(), 1)].astype(np.float64)
    indices = clock.integers(primvar.GetIndicesAttr()) if primvar.IsIndexed() else None
    if indices is not None:
        if not len(indices) or indices.min() < 0 or indices.max() >= len(rows):
            return None
        rows = rows[indices]
    if not np.isfinite(rows).all():
        return None
    by_instance = primvar.GetInterpolation() in _BY_INSTANCE
    return _Values(rows if by_instance else rows[:1], by_instance)


def _rounded(rows: FloatArray) -> FloatArray:
    largest = np.maximum(np.abs(rows).max(axis=0), 1e-300)
    steps = np.rint(np.sqrt(np.maximum(rows, 0.0) / largest) * LEVELS)
    return np.asarray((steps / LEVELS) ** 2 * largest)


def by_label(labels: Integers) -> tuple[list[IntArray], IntArray]:
    """The places of each label that there is, and where each place is in the list of all those."""
    places = np.argsort(labels, kind="stable")
    ends = np.flatnonzero(np.diff(labels[places])) + 1
    order = np.empty_like(places)
    order[places] = np.arange(len(places))
    return np.split(places, ends), order
