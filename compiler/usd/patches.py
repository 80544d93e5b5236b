"""NurbsPatch prims as meshes of their surface.

A span of a parameter is cut into as many parts as keep the triangles within a share of the patch's
size of it: a triangle of steps h, k misses the surface by at most
(|P_uu| h² + 2 |P_uv| h k + |P_vv| k²) / 8, of which each parameter gets half, |P_uv| h k being at
most |P_uv| (h² + k²) / 2. The second derivatives are those of a coarse grid.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from compiler.usd.clock import Clock
from compiler.usd.nurbs import Spans, homogeneous, projected, sound, spans
from compiler.usd.polygons import FARTHEST
from compiler.usd.report import Report
from compiler.usd.round import parts
from dsl.scene import FloatArray, IntArray, Mesh, MeshAttribute

SHARES = {"low": 1e-3, "medium": 2e-4, "high": 5e-5, "veryhigh": 1e-5, "limit": 2e-6}
"""By how much of a patch's size its triangles may miss it, by complexity."""

TRIANGLES = 1 << 21
"""Triangles of a patch, unless it has more spans."""

GRID = (2, 8, 512)
"""Parts of a span in the coarse grid: least and most, and parts in all."""

NEAR = 1e-12
"""How near the ends of a closed surface are to each other, in parts of its largest coordinate."""

MARGIN = 1.1
"""By how much more the second derivatives may be between the points of the grid."""


def read_patch(prim: Any, complexity: str, clock: Clock, report: Report) -> Mesh | None:
    """The surface of a NurbsPatch, or None (reported) if nothing of it can be drawn."""
    path = prim.GetPath()
    trims = clock.integers(prim.GetAttribute("trimCurve:counts"))
    if trims is not None and trims.any():
        report.add("usd-mesh", "the trim curves of a NurbsPatch are not used", path)
    grid = _control(prim, clock)
    sides = [_side(prim, name, clock, report) for name in "uv"]
    u, v = sides
    if grid is None or u is None or v is None:
        message = "a NurbsPatch whose points, orders and knots do not fit draws nothing"
        report.add("usd-mesh", message, path)
        return None
    pieces = _pieces(grid, u, v, SHARES[complexity])
    if pieces is None:
        report.add("usd-mesh", "a NurbsPatch that is not finite draws nothing", path)
        return None
    rows = [_rows(side, count) for side, count in zip((u, v), pieces, strict=True)]
    points = _surface(grid, u, v, *rows)
    _weld(points.reshape(len(rows[1][0]), len(rows[0][0]), 3))
    quads = _quads(rows[0][2], rows[1][2])
    if clock.token(prim.GetAttribute("orientation")) == "leftHanded":
        quads = quads[:, ::-1]
    triangles = np.concatenate((quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]))
    finite = np.asarray((np.abs(points) <= FARTHEST).all(axis=1))[triangles].all(axis=1)
    if not finite.all():
        report.add("usd-mesh", "parts of a NurbsPatch that are not finite are left out", path)
        triangles = triangles[finite]
        points = np.where(np.abs(points) <= FARTHEST, points, 0.0)
    if not len(triangles):
        return None
    if u.creased or v.creased:
        return Mesh(points, triangles)
    normals = MeshAttribute("normals", _normals(points, triangles))
    return Mesh(points, triangles, attributes=(normals,))


def _control(prim: Any, clock: Clock) -> FloatArray | None:
    """Homogeneous control points `(v, u, 4)`, or None where there are not as many as it says."""
    points = clock.vectors(prim.GetAttribute("points"), 3)
    u, v = (int(clock.number(prim.GetAttribute(f"{n}VertexCount"), 0.0)) for n in "uv")
    if points is None or u < 2 or v < 2 or len(points) != u * v:
        return None
    weights = numbers_of(prim, "pointWeights", clock)
    if weights is not None and len(weights) != len(points):
        weights = None
    return homogeneous(points, weights).reshape(v, u, 4)


def numbers_of(prim: Any, name: str, clock: Clock) -> FloatArray | None:
    """An attribute that is a list of numbers `(n,)`, or None."""
    value = clock.value(prim.GetAttribute(name))
    array = np.asarray(value) if value is not None else np.empty(0)
    if array.ndim != 1 or not len(array) or array.dtype.kind not in "fiu":
        return None
    return array.astype(np.float64)


def _side(prim: Any, name: str, clock: Clock, report: Report) -> Spans | None:
    """The spans of one of the parameters."""
    count = np.array([int(clock.number(prim.GetAttribute(f"{name}VertexCount"), 0.0))])
    order = np.array([int(clock.number(prim.GetAttribute(f"{name}Order"), 0.0))])
    knots = numbers_of(prim, f"{name}Knots", clock)
    start = np.zeros(1, np.int64)
    if (
        knots is None
        or len(knots) != count[0] + order[0]
        or not sound(count, order, knots, start)[0]
    ):
        return None
    cut = clock.vector(prim.GetAttribute(f"{name}Range"), 2, report)
    ranges = None if cut is None else np.array([cut])
    found = spans(int(order[0]), count, start, knots, start, ranges)
    return found if len(found.low) else None


Rows = tuple[IntArray, FloatArray, NDArray[np.bool_]]
"""Lines of a grid: their spans, where in them, and whether faces join each to the next one."""


def _rows(side: Spans, pieces: IntArray) -> Rows:
    """The lines that cut each span into so many parts; its last one only before a jump."""
    breaks = side.breaks
    row, number = parts(pieces + breaks)
    joined = ~(breaks[row] & (number == pieces[row]))
    return row, number / pieces[row], joined


def _surface(grid: FloatArray, u: Spans, v: Spans, of_u: Rows, of_v: Rows) -> FloatArray:
    """The points where the lines of both parameters meet, those of u first."""
    along = u.at(of_u[0], of_u[1], np.ascontiguousarray(grid.swapaxes(0, 1)))  # (lines, v, 4)
    both = v.at(of_v[0], of_v[1], np.ascontiguousarray(along.swapaxes(0, 1)))
    return projected(both).reshape(-1, 3)


def _weld(points: FloatArray) -> None:
    """Close the seams of a surface whose ends meet but for rounding, in place."""
    near = NEAR * float(np.abs(points).max(initial=0.0))
    for lines in (points, points.swapaxes(0, 1)):
        if (np.abs(lines[0] - lines[-1]) <= near).all():
            lines[-1] = lines[0]


def _pieces(grid: FloatArray, u: Spans, v: Spans, share: float) -> tuple[IntArray, IntArray] | None:
    """Into how many parts the spans of both parameters are cut; None where nothing is finite."""
    least, most, total = GRID
    parts_u, parts_v = (int(np.clip(total // len(side.low), least, most)) for side in (u, v))
    lines_u, lines_v = (_even(len(s.low), n) for s, n in ((u, parts_u), (v, parts_v)))
    points = _surface(grid, u, v, lines_u, lines_v)
    shape = (len(v.low), parts_v + 1, len(u.low), parts_u + 1, 3)
    points = points.reshape(shape)
    finite = points[np.isfinite(points).all(axis=-1)]
    size = float(np.linalg.norm(np.ptp(finite, axis=0))) if len(finite) else 0.0
    if not 0.0 < size < np.inf:
        return None
    bend_v = _longest(np.diff(points, 2, axis=1)).max(axis=(1, 2, 3))
    bend_u = _longest(np.diff(points, 2, axis=3)).max(axis=(0, 1, 3))
    twist = _longest(np.diff(np.diff(points, axis=1), axis=3))
    allowed = 4.0 * share * size / MARGIN
    needed_u = parts_u * np.sqrt((bend_u + twist.max(axis=(0, 1, 3))) / allowed)
    needed_v = parts_v * np.sqrt((bend_v + twist.max(axis=(1, 2, 3))) / allowed)
    excess = np.sqrt(2.0 * max(needed_u.sum(), 1.0) * max(needed_v.sum(), 1.0) / TRIANGLES)
    counts = [
        np.clip(np.ceil(needed / max(excess, 1.0)), 1, 1 << 12).astype(np.int64)
        for needed in (needed_u, needed_v)
    ]
    return counts[0], counts[1]


def _even(count: int, pieces: int) -> Rows:
    """Lines that cut each of `count` spans into so many parts, both ends included."""
    row = np.repeat(np.arange(count), pieces + 1)
    return row, np.tile(np.arange(pieces + 1) / pieces, count), np.ones(len(row), bool)


def _longest(vectors: FloatArray) -> FloatArray:
    """Lengths, 0 of what is not finite."""
    lengths = np.linalg.norm(vectors, axis=-1)
    return np.asarray(np.where(np.isfinite(lengths), lengths, 0.0))


def _quads(along_u: NDArray[np.bool_], along_v: NDArray[np.bool_]) -> IntArray:
    """Corners `(q, 4)` of the faces between lines that are joined, counterclockwise in u and v."""
    i, j = np.flatnonzero(along_u[:-1]), np.flatnonzero(along_v[:-1])
    corner = (j[:, None] * len(along_u) + i).reshape(-1)
    return np.stack((corner, corner + 1, corner + len(along_u) + 1, corner + len(along_u)), axis=1)


def _normals(points: FloatArray, triangles: IntArray) -> NDArray[np.float32]:
    """Of each point, the mean of the triangles around it by their area."""
    local = points / max(float(np.abs(points).max()), 1e-300)
    a, b, c = (local[triangles[:, k]] for k in range(3))
    faces = np.cross(b - a, c - a)
    total = np.zeros_like(points)
    for corner in range(3):
        for axis in range(3):
            total[:, axis] += np.bincount(triangles[:, corner], faces[:, axis], len(points))
    lengths = np.linalg.norm(total, axis=1, keepdims=True)
    found = np.divide(total, lengths, out=np.zeros_like(total), where=lengths > 0.0)
    found[lengths[:, 0] == 0.0] = (0.0, 0.0, 1.0)
    return np.asarray(found, np.float32)
