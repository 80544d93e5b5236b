"""Polygons to triangles.

Faces of one size are treated together: convex ones as fans from their first corner, concave
quadrilaterals as fans from their reflex corner, all other concave ones by earcut, one at a time.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from dsl.scene import FloatArray, IntArray

FLAT = 1e-9
"""A corner that turns inwards by less, relative to twice the face's area, counts as straight."""

BLOCK = 1 << 15
"""Corners worked on at once."""


@dataclass(frozen=True, slots=True, eq=False)
class Triangulation:
    """`triangles` `(m, 3)` int64 indices into the points, `faces` `(m,)` the face of each.

    Triangles come in order of faces. `dropped` counts faces by the reason they are missing.
    """

    triangles: IntArray
    faces: IntArray
    dropped: Counter[str]


def triangulate(points: FloatArray, counts: IntArray, indices: IntArray) -> Triangulation:
    """Triangulate faces of `counts` `(f,)` corners each, listed in `indices`.

    Faces keep their winding. Faces with fewer than 3 corners, with corners beyond the end of
    `indices`, with indices out of range, or with points that are not finite, are dropped.
    """
    sizes = np.maximum(counts, 0)
    ends = np.cumsum(sizes)
    starts = ends - sizes
    known = ends <= len(indices)
    drawn = known & (sizes >= 3)
    dropped = Counter(
        {
            "that run beyond the list of indices": int(np.count_nonzero(~known)),
            "of fewer than 3 corners": int(np.count_nonzero(known & (sizes < 3))),
        }
    )
    finite = np.asarray(np.isfinite(points).all(axis=1))
    triangles: list[IntArray] = [np.empty((0, 3), np.int64)]
    faces: list[IntArray] = [np.empty(0, np.int64)]
    for found in _blocks(np.flatnonzero(drawn), sizes):
        corners = indices[starts[found, None] + np.arange(sizes[found[0]])]
        inside = ((corners >= 0) & (corners < len(points))).all(axis=1)
        usable = inside.copy()
        usable[inside] = finite[corners[inside]].all(axis=1)
        dropped["with indices out of range"] += int(np.count_nonzero(~inside))
        dropped["with points that are not finite"] += int(np.count_nonzero(inside & ~usable))
        if usable.any():
            own, of = _same_size(points, corners[usable])
            triangles.append(own)
            faces.append(found[usable][of])
    face = np.concatenate(faces)
    order = np.argsort(face, kind="stable")
    return Triangulation(np.concatenate(triangles)[order], face[order], +dropped)


def _blocks(faces: IntArray, sizes: IntArray) -> Iterator[IntArray]:
    """The faces in blocks of one size each, small enough to stay in a cache."""
    faces = faces[np.argsort(sizes[faces], kind="stable")]
    _, firsts = np.unique(sizes[faces], return_index=True)
    for first, end in zip(firsts, [*firsts[1:], len(faces)], strict=True):
        block = max(1, BLOCK // int(sizes[faces[first]]))
        for start in range(first, end, block):
            yield faces[start : min(start + block, end)]


def _same_size(points: FloatArray, corners: IntArray) -> tuple[IntArray, IntArray]:
    """Triangles of faces `(f, k)`, and the row of each."""
    count, size = corners.shape
    if size == 3:
        return corners, np.arange(count)
    turns = _turns(points[corners])
    concave = np.flatnonzero((turns < -FLAT).any(axis=1))
    if size == 4:
        fans = corners.copy()
        fans[concave] = np.take_along_axis(
            corners[concave],
            (np.argmin(turns[concave], axis=1)[:, None] + np.arange(4)) % 4,
            axis=1,
        )
        return _fans(fans), np.repeat(np.arange(count), 2)
    convex = np.setdiff1d(np.arange(count), concave, assume_unique=True)
    triangles = [_fans(corners[convex])]
    rows = [np.repeat(convex, size - 2)]
    for row in concave:
        own = corners[row][_ears(points[corners[row]])]
        triangles.append(own)
        rows.append(np.full(len(own), row))
    return np.concatenate(triangles), np.concatenate(rows)


def _fans(corners: IntArray) -> IntArray:
    size = corners.shape[1]
    fan = np.stack(
        (np.zeros(size - 2, np.int64), np.arange(1, size - 1), np.arange(2, size)), axis=1
    )
    return corners[:, fan].reshape(-1, 3)


def _local(polygons: FloatArray) -> FloatArray:
    """The polygons from their first corner, in units of their largest coordinate."""
    local = polygons - polygons[:, :1]
    extent = np.abs(local).max(axis=(1, 2), keepdims=True)
    return np.asarray(np.divide(local, extent, out=np.zeros_like(local), where=extent > 0.0))


def _normals(local: FloatArray) -> FloatArray:
    """Twice the vector area of polygons `(f, k, 3)` (Newell)."""
    return np.asarray(np.cross(local, np.roll(local, -1, axis=1)).sum(axis=1))


def _turns(polygons: FloatArray) -> FloatArray:
    """How far each corner `(f, k)` turns: positive is convex, relative to twice the area."""
    local = _local(polygons)
    normals = _normals(local)
    edges = np.roll(local, -1, axis=1) - local
    crosses = np.cross(np.roll(edges, 1, axis=1), edges)
    squared = np.einsum("fi,fi->f", normals, normals)[:, None]
    turns = np.einsum("fki,fi->fk", crosses, normals)
    return np.asarray(np.divide(turns, squared, out=np.zeros_like(turns), where=squared > 0.0))


def _ears(polygon: FloatArray) -> IntArray:
    """Triangles `(m, 3)` of one concave polygon `(k, 3)`, as indices of its corners."""
    from mapbox_earcut import triangulate_float64

    local = _local(polygon[None])
    normal = _normals(local)[0]
    drop = int(np.argmax(np.abs(normal)))
    plane = np.delete(local[0], drop, axis=1)
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
