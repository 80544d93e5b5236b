"""Splines over knots, span by span: many of one order at once.

The basis functions of a span are those of the Cox-de Boor recursion (L. Piegl, W. Tiller, "The
NURBS Book", 2nd edition, algorithm A2.2). A span is evaluated by its own polynomials up to both of
its ends, so that knots of full multiplicity are jumps. Weights make points homogeneous: (w p, w).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from compiler.usd.round import parts
from dsl.scene import FloatArray, IntArray

LARGEST_ORDER = 32


@dataclass(frozen=True, slots=True, eq=False)
class Spans:
    """Spans `(s,)` that are not empty, of splines of one `order`, in order.

    `knots` are those of all splines; `knot` is the last one that is not above a span, `first` the
    first of the `order` control points that it needs, `low` and `high` where it begins and ends,
    `spline` whose it is.
    """

    order: int
    knots: FloatArray
    knot: IntArray
    first: IntArray
    low: FloatArray
    high: FloatArray
    spline: IntArray

    def basis(self, rows: IntArray, t: FloatArray) -> tuple[FloatArray, IntArray]:
        """Weights and numbers `(n, order)` of control points, `t` in 0 … 1 of the spans `rows`."""
        low, knot = self.low[rows], self.knot[rows]
        at = np.where(t < 1.0, low + t * (self.high[rows] - low), self.high[rows])
        weights = np.zeros((len(rows), self.order))
        weights[:, 0] = 1.0
        for degree in range(1, self.order):
            saved = np.zeros(len(rows))
            for j in range(degree):
                right = self.knots[knot + j + 1] - at
                left = at - self.knots[knot + 1 + j - degree]
                share = weights[:, j] / (right + left)
                weights[:, j] = saved + right * share
                saved = left * share
            weights[:, degree] = saved
        return weights, self.first[rows, None] + np.arange(self.order)

    def at(self, rows: IntArray, t: FloatArray, points: FloatArray) -> FloatArray:
        """What control points `(p, …)` make of parameters: `(n, …)`."""
        weights, numbers = self.basis(rows, t)
        extra = (1,) * (points.ndim - 1)
        total = np.zeros((len(rows), *points.shape[1:]))
        for j in range(self.order):
            total += weights[:, j].reshape(-1, *extra) * points[numbers[:, j]]
        return total

    @property
    def breaks(self) -> NDArray[np.bool_]:
        """Whether a span ends a spline, or before a jump `(s,)`."""
        ends = np.append(self.spline[1:] != self.spline[:-1], True)[: len(self.spline)]
        beyond = np.minimum(self.knot + self.order, len(self.knots) - 1)
        return np.asarray(ends | (self.knots[beyond] <= self.high))

    @property
    def creased(self) -> bool:
        """Whether there is a kink within a spline."""
        beyond = np.minimum(self.knot + self.order - 1, len(self.knots) - 1)
        inner = np.append(self.spline[1:] == self.spline[:-1], False)[: len(self.spline)]
        return bool((inner & (self.knots[beyond] <= self.high)).any())


def sound(
    counts: IntArray, orders: IntArray, knots: FloatArray, starts: IntArray
) -> NDArray[np.bool_]:
    """Which splines of `counts` `(c,)` points have a good order, and knots from `starts` on."""
    ends = starts + counts + orders
    enough = (orders >= 2) & (orders <= LARGEST_ORDER) & (counts >= orders) & (ends <= len(knots))
    with np.errstate(invalid="ignore"):
        rises = np.append(np.diff(knots) >= 0.0, True) & np.isfinite(knots)
    falls = np.concatenate(([0], np.cumsum(~rises)))
    last = np.maximum(ends - 1, 0)
    enough[enough] = (falls[last] == falls[starts])[enough] & np.isfinite(knots[last[enough]])
    return np.asarray(enough)


def spans(
    order: int,
    counts: IntArray,
    points: IntArray,
    knots: FloatArray,
    starts: IntArray,
    ranges: FloatArray | None,
) -> Spans:
    """The spans of sound splines of `counts` `(c,)` control points from number `points` `(c,)` on.

    `starts` `(c,)` are their first knots. `ranges` `(c, 2)` cut them; one that is empty or not
    finite does not.
    """
    spline, number = parts(counts - order + 1)
    knot = starts[spline] + order - 1 + number
    low, high = knots[knot], knots[knot + 1]
    if ranges is not None:
        domain = np.stack((knots[starts + order - 1], knots[starts + counts]), axis=1)
        cut = np.stack(
            (np.maximum(ranges[:, 0], domain[:, 0]), np.minimum(ranges[:, 1], domain[:, 1])), axis=1
        )
        domain = np.where((cut[:, :1] < cut[:, 1:]), cut, domain)
        low, high = np.maximum(low, domain[spline, 0]), np.minimum(high, domain[spline, 1])
    kept = low < high
    first = points[spline] + number
    return Spans(order, knots, knot[kept], first[kept], low[kept], high[kept], spline[kept])


def homogeneous(points: FloatArray, weights: FloatArray | None) -> FloatArray:
    """Rows `(n, k)` times their weights, which follow: `(n, k + 1)`."""
    w = np.ones((len(points), 1)) if weights is None else weights[:, None]
    return np.concatenate((points * w, w), axis=1)


def projected(rows: FloatArray) -> FloatArray:
    """Rows over their last entry."""
    with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
        return np.asarray(rows[..., :-1] / rows[..., -1:])
