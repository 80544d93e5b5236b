"""Polygons to triangles.

Faces of one size are treated together: convex ones as fans from their first corner, concave
quadrilaterals as fans from their reflex corner, all other concave ones by earcut, one at a time.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray

from dsl.scene import FloatArray, IntArray

FLAT = 1e-9
"""A corner that turns inwards by less, relative to twice the face's area, counts as straight."""

FARTHEST = 1e100
"""Coordinates that are larger count as not finite."""

MODERATE = 1e50
"""Coordinates up to this have fourth powers that are finite, and not zero from its reciprocal."""

BLOCK = 1 << 15
"""Corners worked on at once."""

_FEW = "of fewer than 3 corners"


@dataclass(frozen=True, slots=True, eq=False)
class Polygons:
    """Faces that can be used: `counts` `(f,)` corners of each, `corners` `(c,)` their points.

    `faces` `(f,)` are their places among all faces, `dropped` counts others by what is wrong.
    `places` `(c,)` are those of the corners among all that are listed, None: they are the first.
    """

    counts: IntArray
    corners: IntArray
    faces: IntArray
    dropped: Counter[str]
    places: IntArray | None = None

    def distinct(self) -> Polygons:
        """The same without corners at the point of the next one, and faces that have too few."""
        following = np.arange(1, len(self.corners) + 1)
        ends = np.cumsum(self.counts)
        following[ends - 1] = ends - self.counts
        kept = self.corners != self.corners[following]
        if kept.all():
            return self
        row = np.repeat(np.arange(len(self.counts)), self.counts)
        counts = np.bincount(row[kept], minlength=len(self.counts))
        whole = counts >= 3
        dropped = Counter({_FEW: int(np.count_nonzero(~whole))})
        left = np.flatnonzero(kept & whole[row])
        return Polygons(
            counts[whole],
            self.corners[left],
            self.faces[whole],
            self.dropped + dropped,
            left if self.places is None else self.places[left],
        )


@dataclass(frozen=True, slots=True, eq=False)
class Triangulation:
    """`corners` `(m, 3)` int64 of each triangle, `rows` `(m,)` the polygon of each.

    Corners are places in the list of the polygons' corners; triangles come in order of polygons.
    """

    corners: IntArray
    rows: IntArray


def usable_faces(points: FloatArray, counts: IntArray, indices: IntArray) -> Polygons:
    """Faces of `counts` `(f,)` corners each, listed in `indices`, without those that are faulty.

    Faces with fewer than 3 corners, with corners beyond the end of `indices`, with indices out of
    range, or with points that are not finite, are dropped.
    """
    sizes = np.maximum(counts, 0)
    ends = np.cumsum(sizes)
    if _all_usable(points, sizes, int(ends[-1]) if len(ends) else 0, indices):
        return Polygons(sizes, indices[: ends[-1]], np.arange(len(sizes)), Counter())
    known = ends <= len(indices)
    large = known & (sizes >= 3)
    inside = (indices >= 0) & (indices < len(points))
    finite = inside.copy()
    finite[inside] = np.asarray((np.abs(points) <= FARTHEST).all(axis=1))[indices[inside]]
    outside = _any(~inside, sizes, ends)
    broken = _any(~finite, sizes, ends)
    kept = large & ~broken
    dropped = Counter(
        {
            "that run beyond the list of indices": int(np.count_nonzero(~known)),
            _FEW: int(np.count_nonzero(known & (sizes < 3))),
            "with indices out of range": int(np.count_nonzero(large & outside)),
            "with points that are not finite": int(np.count_nonzero(large & broken & ~outside)),
        }
    )
    listed = np.zeros(len(indices), bool)
    total = int(ends[known][-1]) if known.any() else 0
    listed[:total] = np.repeat(kept[known], sizes[known])
    places = np.flatnonzero(listed)
    return Polygons(sizes[kept], indices[places], np.flatnonzero(kept), +dropped, places)


def _all_usable(points: FloatArray, sizes: IntArray, total: int, indices: IntArray) -> bool:
    """Whether all faces are sound, as they are in most meshes: a quick question."""
    return bool(
        0 < total <= len(indices)
        and sizes.min() >= 3
        and indices.min() >= 0
        and indices.max() < len(points)
        and (np.abs(points) <= FARTHEST).all()
    )


def _any(flags: NDArray[np.bool_], sizes: IntArray, ends: IntArray) -> NDArray[np.bool_]:
    """Whether any corner of a face has the flag; faces may run beyond the end of the flags."""
    before = np.concatenate(([0], np.cumsum(flags)))
    last = len(flags)
    return np.asarray(before[np.minimum(ends, last)] > before[np.minimum(ends - sizes, last)])


def triangulate(points: FloatArray, counts: IntArray, corners: IntArray) -> Triangulation:
    """Triangulate usable faces; they keep their winding."""
    if len(counts) and counts.max() == 3:
        return Triangulation(np.arange(len(corners)).reshape(-1, 3), np.arange(len(counts)))
    starts = np.cumsum(counts) - counts
    largest = np.abs(points).max(initial=0.0)
    moderate = 1.0 / MODERATE < largest < MODERATE or not 0.0 < largest < np.inf
    unit = points if moderate else points / largest
    triangles: list[IntArray] = [np.empty((0, 3), np.int64)]
    rows: list[IntArray] = [np.empty(0, np.int64)]
    for block in _blocks(counts):
        places = starts[block, None] + np.arange(counts[block[0]])
        own, of = _same_size(unit, corners, places)
        triangles.append(own)
        rows.append(block[of])
    row = np.concatenate(rows)
    order = np.argsort(row, kind="stable")
    return Triangulation(np.concatenate(triangles)[order], row[order])


def _blocks(sizes: IntArray) -> Iterator[IntArray]:
    """The faces in blocks of one size each, small enough to stay in a cache."""
    if not len(sizes):
        return
    if sizes.min() == sizes.max() and sizes[0] * len(sizes) <= BLOCK:
        yield np.arange(len(sizes))
        return
    faces = np.argsort(sizes, kind="stable")
    _, firsts = np.unique(sizes[faces], return_index=True)
    for first, end in zip(firsts, [*firsts[1:], len(faces)], strict=True):
        block = max(1, BLOCK // int(sizes[faces[first]]))
        for start in range(first, end, block):
            yield faces[start : min(start + block, end)]


def _same_size(
    points: FloatArray, corners: IntArray, places: IntArray
) -> tuple[IntArray, IntArray]:
    """Triangles of faces, and the row of each; the largest coordinate is moderate.

    `places` `(f, k)` are where the faces' corners are in the list of them.
    """
    count, size = places.shape
    if size == 3:
        return places, np.arange(count)
    turns = _turns(points, corners[places])
    concave = np.flatnonzero((turns < -FLAT).any(axis=1))
    if size == 4 or not len(concave):
        fans = places
        if len(concave):
            fans = places.copy()
            fans[concave] = np.take_along_axis(
                places[concave],
                (np.argmin(turns[concave], axis=1)[:, None] + np.arange(4)) % 4,
                axis=1,
            )
        return _fans(fans), np.repeat(np.arange(count), size - 2)
    convex = np.setdiff1d(np.arange(count), concave, assume_unique=True)
    triangles = [_fans(places[convex])]
    rows = [np.repeat(convex, size - 2)]
    for row in concave:
        own = places[row][_ears(points[corners[places[row]]])]
        triangles.append(own)
        rows.append(np.full(len(own), row))
    return np.concatenate(triangles), np.concatenate(rows)


def _fans(corners: IntArray) -> IntArray:
    return corners[:, _fan(corners.shape[1])].reshape(-1, 3)


@cache
def _fan(size: int) -> IntArray:
    rows = (np.zeros(size - 2, np.int64), np.arange(1, size - 1), np.arange(2, size))
    return np.stack(rows, axis=1)


@cache
def _beside(size: int) -> tuple[IntArray, IntArray]:
    """The corner after each of a face, and the one before."""
    return np.roll(np.arange(size), -1), np.roll(np.arange(size), 1)


def _turns(points: FloatArray, corners: IntArray) -> FloatArray:
    """How far each corner `(f, k)` turns: positive is convex, relative to twice the area.

    Coordinates are kept apart, for NumPy is quick along long rows only.
    """
    after, before = _beside(corners.shape[1])
    local = points[corners.T] - points[corners[:, 0]]
    local = np.ascontiguousarray(local.transpose(2, 0, 1))
    following = local[:, after]
    normal = _cross(local, following).sum(axis=1)
    edges = following - local
    turns = (normal[:, None] * _cross(edges[:, before], edges)).sum(axis=0)
    squared = (normal * normal).sum(axis=0)
    found = np.divide(turns, squared, out=np.zeros_like(turns), where=squared > 0.0)
    return np.asarray(found.T)


_YZX, _ZXY = (np.array(axes) for axes in ((1, 2, 0), (2, 0, 1)))


def _cross(a: FloatArray, b: FloatArray) -> FloatArray:
    """The cross product of vectors `(3, …)` whose coordinates are kept apart."""
    product: FloatArray = a[_YZX] * b[_ZXY]
    product -= a[_ZXY] * b[_YZX]
    return product


def _ears(polygon: FloatArray) -> IntArray:
    """Triangles `(m, 3)` of one concave polygon `(k, 3)`, as indices of its corners."""
    from mapbox_earcut import triangulate_float64

    local = polygon - polygon[0]
    local /= max(np.abs(local).max(), 1e-300)
    normal = np.cross(local, np.roll(local, -1, axis=0)).sum(axis=0)
    drop = int(np.argmax(np.abs(normal)))
    plane = np.delete(local, drop, axis=1)
    found = triangulate_float64(plane, np.array([len(polygon)], np.uint32))
    triangles: IntArray = np.asarray(found).reshape(-1, 3).astype(np.int64)
    # Earcut promises no winding: turn every triangle the way of the polygon. Leaving out y
    # mirrors the plane.
    a, b, c = (plane[triangles[:, i]] for i in range(3))
    area = (b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (b[:, 1] - a[:, 1]) * (c[:, 0] - a[:, 0])
    facing = normal[drop] * (-1.0 if drop == 1 else 1.0)
    turned = area * facing < 0.0
    triangles[turned] = triangles[turned][:, ::-1]
    return triangles
