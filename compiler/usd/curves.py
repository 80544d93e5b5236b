"""Curves as chains of tubes with balls at their joints, and Points as balls.

HermiteCurves become the Bézier curves that they are, with widths linear between their points. Of
NurbsCurves the spans are segments.

A segment becomes as many tubes as keep their chords within `FINE` radii of the curve, and
within `SHARE` of the prim's size. Where a prim would get more than `MANY` tubes, chords may miss by
more, up to `TOLERANCE` radii; beyond `BUDGET` tubes they get what is left. Widths are diameters,
and 1 where none are authored.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray
from pxr import UsdGeom

from compiler.usd.clock import Clock
from compiler.usd.report import Report
from compiler.usd.round import TOLERANCE, Round, parts
from compiler.usd.schema import type_of
from dsl.scene import FloatArray, IntArray, Node

FINE = 0.002
SHARE = 5e-6
MANY = 1 << 16
PIECES = 512
BUDGET = 1 << 20
"""Tubes of one segment at most, and of one prim unless it has more segments."""

_BEZIER = {
    "linear": np.array([(3, 0), (2, 1), (1, 2), (0, 3)]) / 3.0,
    "bezier": np.eye(4),
    "bspline": np.array([(1, 4, 1, 0), (0, 4, 2, 0), (0, 2, 4, 0), (0, 1, 4, 1)]) / 6.0,
    "catmullRom": np.array([(0, 6, 0, 0), (-1, 6, 1, 0), (0, 1, 6, -1), (0, 0, 6, 0)]) / 6.0,
}
"""Bézier points of a segment (rows) from its own control points."""


@dataclass(frozen=True, slots=True)
class Form:
    """How points make curves: a basis of `_BEZIER`, and "nonperiodic", "periodic" or "pinned"."""

    basis: str
    wrap: str

    @property
    def width(self) -> int:
        """Control points of a segment."""
        return int(_BEZIER[self.basis].shape[1])

    @property
    def step(self) -> int:
        """Points from a segment's first to the next one's."""
        return 3 if self.basis == "bezier" else 1

    @property
    def closed(self) -> bool:
        """Whether curves end where they begin."""
        return self.wrap == "periodic"

    @property
    def extended(self) -> bool:
        """Whether a curve gets a point more at either end, so that it reaches its own ends."""
        return self.wrap == "pinned" and self.basis in ("bspline", "catmullRom")

    def segments(self, counts: IntArray) -> IntArray:
        """Segments of curves of so many points, 0 where these are too few."""
        if self.closed:
            return np.asarray(np.where(counts >= 3, counts // self.step, 0))
        points = np.where(counts >= 2, counts + 2, 0) if self.extended else counts
        return np.asarray(np.maximum((points - self.width) // self.step + 1, 0))


_HERMITE = Form("bezier", "nonperiodic")
"""What HermiteCurves become."""


@dataclass(frozen=True, slots=True, eq=False)
class Curves:
    """Curves of `counts` `(c,)` points each, of which those `kept` `(c,)` are drawn."""

    form: Form
    counts: IntArray
    kept: NDArray[np.bool_]

    def control(self, values: FloatArray) -> FloatArray:
        """Bézier points `(s, 4, k)` of all segments, from values `(n, k)` at the points."""
        form, counts = self.form, self.counts[self.kept]
        starts = (np.cumsum(self.counts) - self.counts)[self.kept]
        curve, number = parts(form.segments(counts))
        if form.extended:
            values, starts, counts = _extended(values, starts, counts)
        ids = number[:, None] * form.step + np.arange(form.width)
        if form.closed:
            ids %= counts[curve, None]
        return np.asarray(_BEZIER[form.basis] @ values[starts[curve, None] + ids])

    @property
    def ends(self) -> IntArray:
        """Of each curve, the ends of its segments `(c,)`."""
        segments = self.form.segments(self.counts)
        return np.asarray(np.where(segments > 0, segments + (not self.form.closed), 0))

    def tapers(self, values: FloatArray) -> FloatArray:
        """Bézier values `(s, 4, k)` that are linear between values `(e, k)` at segments' ends."""
        ends = self.ends[self.kept]
        curve, number = parts(self.form.segments(self.counts[self.kept]))
        first = (np.cumsum(self.ends) - self.ends)[self.kept][curve]
        pairs = np.stack((number, (number + 1) % ends[curve]), axis=1)
        return np.asarray(_BEZIER["linear"] @ values[first[:, None] + pairs])

    @property
    def last(self) -> NDArray[np.bool_]:
        """Which segments end an open curve `(s,)`."""
        numbers = self.form.segments(self.counts[self.kept])
        curve, number = parts(numbers)
        return np.asarray((number + 1 == numbers[curve]) & (not self.form.closed))


class Segments(Protocol):
    """Smooth parts of curves `(s,)`, curve by curve."""

    @property
    def last(self) -> NDArray[np.bool_]:
        """Where an open curve ends."""

    @property
    def bend(self) -> FloatArray:
        """Bounds of second derivatives by a parameter in 0 … 1."""

    @property
    def widest(self) -> FloatArray:
        """Bounds of radii."""

    @property
    def size(self) -> float:
        """That of all of them."""

    def at(self, rows: IntArray, t: FloatArray) -> FloatArray:
        """Positions and radii `(n, 4)` at `t` `(n,)` within 0 and 1 of the segments `rows`."""


@dataclass(frozen=True, slots=True, eq=False)
class Cubics:
    """Cubic segments: `control` `(s, 4, 4)` are Bézier points, each a position and a radius."""

    control: FloatArray
    last: NDArray[np.bool_]

    def at(self, rows: IntArray, t: FloatArray) -> FloatArray:
        """Positions and radii `(n, 4)` at `t` `(n,)` within 0 and 1 of the segments `rows`."""
        s = 1.0 - t
        weights = np.stack((s**3, 3.0 * s * s * t, 3.0 * s * t * t, t**3), axis=1)
        return np.asarray(np.einsum("ni,nik->nk", weights, self.control[rows]))

    @property
    def bend(self) -> FloatArray:
        """|P''| is at most 6 times the largest second difference of the Bézier points."""
        second = self.control[:, 2:, :3] - 2.0 * self.control[:, 1:3, :3] + self.control[:, :2, :3]
        return np.asarray(6.0 * np.linalg.norm(second, axis=2).max(axis=1))

    @property
    def widest(self) -> FloatArray:
        """The largest radius of a segment's Bézier points."""
        return np.asarray(self.control[:, :, 3].max(axis=1))

    @property
    def size(self) -> float:
        """The longest side of the Bézier points' bounds."""
        return float(np.ptp(self.control[:, :, :3].reshape(-1, 3), axis=0).max())


def _pieces(segments: Segments) -> IntArray:
    """Into how many chords each segment is cut."""
    count = _cut(segments, FINE, SHARE * segments.size)
    excess = (count.sum() / MANY) ** 2
    if excess <= 1.0:
        return count
    return _cut(segments, min(FINE * excess, TOLERANCE), SHARE * segments.size * excess)


def _cut(segments: Segments, radii: float, distance: float) -> IntArray:
    """Into how many chords, to miss the curve by that many radii, and that far, at most.

    The chord of one of k parts misses the curve by at most |P''| / 8k².
    """
    bend = segments.bend
    allowed = np.minimum(radii * segments.widest, distance)
    squared = np.divide(bend / 8.0, allowed, out=np.ones_like(bend), where=allowed > 0.0)
    count: IntArray = np.clip(np.ceil(np.sqrt(squared)), 1, PIECES).astype(np.int64)
    return count


def read_points(prim: Any, shapes: Round, clock: Clock, report: Report) -> list[Node]:
    """A Points prim as balls, in its own space."""
    path = prim.GetPath()
    points = clock.vectors(prim.GetAttribute("points"), 3)
    if points is None or not len(points):
        report.add("usd-curves", "a prim without points draws nothing", path)
        return []
    widths, interpolation = widths_of(prim, UsdGeom.Points(prim), clock)
    if interpolation == "constant":
        widths = widths[:1]
    widths = fitting(widths, len(points), path, report)
    usable = np.isfinite(points).all(axis=1) & np.isfinite(widths) & (widths > 0.0)
    left_out = np.count_nonzero(~usable)
    if left_out:
        message = f"{left_out} points without a finite place and a positive width are left out"
        report.add("usd-curves", message, path)
    return shapes.balls(points[usable], widths[usable] / 2.0)


def read_curves(prim: Any, shapes: Round, clock: Clock, report: Report) -> list[Node]:
    """A BasisCurves or HermiteCurves prim as tubes and balls, in its own space."""
    path = prim.GetPath()
    listed = points_of(prim, clock, report)
    if listed is None:
        return []
    points, counts = listed
    hermite = type_of(prim) == "HermiteCurves"
    if hermite:
        tangents = clock.vectors(prim.GetAttribute("tangents"), 3)
        if tangents is None or len(tangents) != len(points) or counts.sum() > len(points):
            report.add("usd-curves", "a prim without a tangent for each point draws nothing", path)
            return []
        points, counts = _bezier(points, tangents, counts)
    form = _HERMITE if hermite else _form(prim, clock, report)
    kept = _usable(points, counts, form)
    left_out = np.count_nonzero(~kept)
    if left_out:
        message = f"{left_out} curves with too few points, or points not finite, are left out"
        report.add("usd-curves", message, path)
    if not kept.any():
        return []
    curves = Curves(form, counts, kept)
    places = curves.control(points)
    radii = _radii(prim, curves, len(points), clock, report)
    segments = Cubics(np.concatenate((places, radii), axis=2), curves.last)
    return chains(segments, shapes, path, report)


def points_of(prim: Any, clock: Clock, report: Report) -> tuple[FloatArray, IntArray] | None:
    """The points `(p, 3)` of a prim's curves and how many each has; None (reported) without any."""
    points = clock.vectors(prim.GetAttribute("points"), 3)
    counts = clock.integers(prim.GetAttribute("curveVertexCounts"))
    if points is None or counts is None or not len(points) or not len(counts):
        report.add("usd-curves", "a prim without points draws nothing", prim.GetPath())
        return None
    return points, np.maximum(counts, 0)


def chains(segments: Segments, shapes: Round, path: Any, report: Report) -> list[Node]:
    """Segments of the prim at `path` as tubes and balls."""
    pieces = _pieces(segments)
    if pieces.sum() > max(BUDGET, len(pieces)):
        message = f"curves of {pieces.sum()} tubes are drawn with fewer, about {BUDGET}"
        report.add("usd-curves", message, path)
        pieces = np.maximum(pieces * BUDGET // pieces.sum(), 1)
    row, number = parts(pieces)
    starts = segments.at(row, number / pieces[row])
    ends = segments.at(row, (number + 1) / pieces[row])
    closing = segments.last[row] & (number + 1 == pieces[row])
    joints = np.concatenate((starts, ends[closing]))
    joints = joints[joints[:, 3] > 0.0]
    radii = np.maximum(np.stack((starts[:, 3], ends[:, 3]), axis=1), 0.0)
    tubes = shapes.tubes(starts[:, :3], ends[:, :3], radii)
    return tubes + shapes.balls(joints[:, :3], joints[:, 3])


def _radii(prim: Any, curves: Curves, count: int, clock: Clock, report: Report) -> FloatArray:
    """Bézier radii `(s, 4, 1)` of all segments."""
    widths, interpolation = widths_of(prim, UsdGeom.Curves(prim), clock)
    if interpolation == "constant":
        widths = widths[:1]
    radii = np.nan_to_num(widths, nan=0.0, posinf=0.0, neginf=0.0) / 2.0
    if interpolation == "varying" or (
        interpolation == "vertex" and type_of(prim) == "HermiteCurves"
    ):
        radii = fitting(radii, int(curves.ends.sum()), prim.GetPath(), report)
        return curves.tapers(radii[:, None])
    if interpolation == "uniform" and len(radii) == len(curves.counts):
        # Points that no curve lists are not drawn, whatever their radius.
        radii = np.resize(np.repeat(radii, curves.counts), count)
    return curves.control(fitting(radii, count, prim.GetPath(), report)[:, None])


def _usable(points: FloatArray, counts: IntArray, form: Form) -> NDArray[np.bool_]:
    """Which curves have all the points they need, and all of them finite."""
    ends = np.cumsum(counts)
    kept = (ends <= len(points)) & (form.segments(counts) > 0)
    unsound = np.concatenate(([0], np.cumsum(~np.isfinite(points).all(axis=1))))
    kept[kept] = unsound[ends[kept]] == unsound[(ends - counts)[kept]]
    return np.asarray(kept)


def _bezier(
    points: FloatArray, tangents: FloatArray, counts: IntArray
) -> tuple[FloatArray, IntArray]:
    """Bézier points of Hermite curves: a third of the tangent away from either end of a segment."""
    curve, number = parts(counts)
    listed = np.arange(len(curve))
    three = np.stack((points - tangents / 3.0, points, points + tangents / 3.0), axis=1)[listed]
    kept = np.ones((len(listed), 3), bool)
    kept[:, 0] = number > 0
    kept[:, 2] = number + 1 < counts[curve]
    return three[kept], np.where(counts > 0, 3 * counts - 2, 0)


def _form(prim: Any, clock: Clock, report: Report) -> Form:
    basis = clock.token(prim.GetAttribute("basis"))
    if clock.token(prim.GetAttribute("type")) == "linear":
        basis = "linear"
    wrap = clock.token(prim.GetAttribute("wrap"))
    for name, value, known, fallback in (
        ("basis", basis, tuple(_BEZIER), "bezier"),
        ("wrap", wrap, ("nonperiodic", "periodic", "pinned"), "nonperiodic"),
    ):
        if value not in known:
            message = f"`{name} = {value!r}` is not known: `{fallback}` is used"
            report.add("usd-curves", message, prim.GetPath())
    return Form(
        basis if basis in _BEZIER else "bezier",
        wrap if wrap in ("periodic", "pinned") else "nonperiodic",
    )


def _extended(
    values: FloatArray, starts: IntArray, counts: IntArray
) -> tuple[FloatArray, IntArray, IntArray]:
    """Curves with a point more at either end, as far away as the second one, on the other side."""
    curve, number = parts(counts + 2)
    inner = starts[curve] + np.clip(number - 1, 0, counts[curve] - 1)
    result = values[inner]
    begins = np.cumsum(counts + 2) - counts - 2
    closes = begins + counts + 1
    result[begins] = 2.0 * result[begins + 1] - result[begins + 2]
    result[closes] = 2.0 * result[closes - 1] - result[closes - 2]
    return result, begins, counts + 2


def widths_of(prim: Any, schema: Any, clock: Clock) -> tuple[FloatArray, str]:
    """Widths `(n,)`, at least one, and their interpolation.

    The prim's primvar comes first; one that is inherited stands in for what the prim does not say.
    """
    primvars = UsdGeom.PrimvarsAPI(prim)
    if prim.GetAttribute("widths").HasAuthoredValue():
        primvar = primvars.GetPrimvar("widths")
    else:
        primvar = primvars.FindPrimvarWithInheritance("widths")
    authored = bool(primvar) and primvar.HasAuthoredValue()
    value = clock.value(primvar.GetAttr() if authored else prim.GetAttribute("widths"))
    array = np.atleast_1d(np.asarray(value)) if value is not None else np.empty(0)
    if array.dtype.kind not in "fiu" or array.ndim != 1 or not len(array):
        return np.ones(1), "constant"
    array = array.astype(np.float64)
    if not authored:
        return array, str(schema.GetWidthsInterpolation())
    if primvar.IsIndexed():
        indices = clock.integers(primvar.GetIndicesAttr())
        sound = indices is not None and len(indices) and indices.min() >= 0
        if indices is not None and sound and indices.max() < len(array):
            array = array[indices]
    return array, str(primvar.GetInterpolation())


def fitting(widths: FloatArray, count: int, path: Any, report: Report) -> FloatArray:
    """As many widths as are needed: one serves for all."""
    if len(widths) == count:
        return widths
    if len(widths) != 1:
        message = "a wrong number of `widths` is read as the first of them"
        report.add("usd-curves", message, path)
    return np.full(count, widths[0])
