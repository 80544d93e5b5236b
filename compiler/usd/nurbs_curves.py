"""NurbsCurves as chains of tubes, span by span.

Widths are by control point, and go with the weights as the points do, or one for each curve or all.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pxr import UsdGeom

from compiler.usd.clock import Clock
from compiler.usd.curves import chains, fitting, points_of, widths_of
from compiler.usd.nurbs import Spans, homogeneous, projected, sound, spans
from compiler.usd.patches import numbers_of
from compiler.usd.report import Report
from compiler.usd.round import Round
from dsl.scene import FloatArray, IntArray, Node

SAMPLES = 16
"""Parts of a span in which its bend is looked for."""


@dataclass(frozen=True, slots=True, eq=False)
class SpanSegments:
    """The spans of curves as segments; `control` `(p, 5)` are homogeneous points and radii."""

    spans: Spans
    control: FloatArray
    last: NDArray[np.bool_]
    bend: FloatArray
    widest: FloatArray
    size: float

    def at(self, rows: IntArray, t: FloatArray) -> FloatArray:
        """Positions and radii `(n, 4)` at `t` `(n,)` within 0 and 1 of the spans `rows`."""
        return projected(self.spans.at(rows, t, self.control))


def read_nurbs_curves(prim: Any, shapes: Round, clock: Clock, report: Report) -> list[Node]:
    """A NurbsCurves prim as tubes and balls, in its own space."""
    path = prim.GetPath()
    listed = points_of(prim, clock, report)
    if listed is None:
        return []
    points, counts = listed
    orders = clock.integers(prim.GetAttribute("order"))
    orders = np.zeros(0, np.int64) if orders is None else orders
    if len(orders) == 1:
        orders = np.repeat(orders, len(counts))
    knots = numbers_of(prim, "knots", clock)
    if knots is None or len(orders) != len(counts):
        report.add("usd-curves", "NurbsCurves without an order or knots draw nothing", path)
        return []
    starts = np.cumsum(counts + np.maximum(orders, 0)) - counts - np.maximum(orders, 0)
    first = np.cumsum(counts) - counts
    control = _control(prim, points, counts, clock, report)
    unsound = np.concatenate(([0], np.cumsum(~np.isfinite(control).all(axis=1))))
    kept = sound(counts, orders, knots, starts) & (first + counts <= len(points))
    kept[kept] = unsound[(first + counts)[kept]] == unsound[first[kept]]
    left_out = np.count_nonzero(~kept)
    if left_out:
        message = f"{left_out} NurbsCurves whose points, orders and knots do not fit are left out"
        report.add("usd-curves", message, path)
    ranges = _ranges(prim, len(counts), clock)
    nodes: list[Node] = []
    for order in np.unique(orders[kept]).tolist():
        own = np.flatnonzero(kept & (orders == order))
        cut = None if ranges is None else ranges[own]
        found = spans(order, counts[own], first[own], knots, starts[own], cut)
        if len(found.low):
            nodes += chains(_segments(found, control), shapes, path, report)
    return nodes


def _control(
    prim: Any, points: FloatArray, counts: IntArray, clock: Clock, report: Report
) -> FloatArray:
    """Positions, radii and weights `(p, 5)`, the first two times the last."""
    widths, interpolation = widths_of(prim, UsdGeom.Curves(prim), clock)
    if interpolation == "constant":
        widths = widths[:1]
    if interpolation == "uniform" and len(widths) == len(counts):
        widths = np.resize(np.repeat(widths, counts), len(points))
    radii = np.nan_to_num(widths, nan=0.0, posinf=0.0, neginf=0.0) / 2.0
    radii = np.maximum(fitting(radii, len(points), prim.GetPath(), report), 0.0)
    weights = numbers_of(prim, "pointWeights", clock)
    if weights is not None and len(weights) != len(points):
        weights = None
    return homogeneous(np.concatenate((points, radii[:, None]), axis=1), weights)


def _ranges(prim: Any, count: int, clock: Clock) -> FloatArray | None:
    ranges = clock.vectors(prim.GetAttribute("ranges"), 2)
    return ranges if ranges is not None and len(ranges) == count else None


def _segments(found: Spans, control: FloatArray) -> SpanSegments:
    count = len(found.low)
    rows = np.repeat(np.arange(count), SAMPLES + 1)
    t = np.tile(np.arange(SAMPLES + 1) / SAMPLES, count)
    samples = np.nan_to_num(projected(found.at(rows, t, control)), posinf=0.0, neginf=0.0)
    samples = samples.reshape(count, SAMPLES + 1, 4)
    second = np.linalg.norm(np.diff(samples[:, :, :3], 2, axis=1), axis=2)
    return SpanSegments(
        found,
        control,
        found.breaks,
        second.max(axis=1) * SAMPLES**2,
        samples[:, :, 3].max(axis=1),
        float(np.ptp(samples[:, :, :3].reshape(-1, 3), axis=0).max()),
    )
