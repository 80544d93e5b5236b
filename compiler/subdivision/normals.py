"""Normals of refined surfaces, at the corners of their polygons.

A normal is the mean of those of the corners around a point, each as large as the parallelogram of
its two edges. With points at the limit that is exact where a point's surroundings are symmetric,
and meets the limit's normal with the square of the size of the polygons. Corners beyond a sharp
edge have a normal of their own.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from compiler.subdivision.topology import Topology
from dsl.scene import FloatArray, IntArray


def normals(
    points: FloatArray, faces: Topology, sharp: NDArray[np.bool_]
) -> tuple[FloatArray, IntArray]:
    """Normals `(n, 3)`, unit or zero, and which of them each corner has `(c,)`.

    `points` `(v, 3)`; `sharp` `(e,)` are the edges across which no normal goes on. They are on the
    side from which corners run anticlockwise.
    """
    here = points[faces.corners]
    before, following = faces.previous, faces.following
    own = np.cross(here[following] - here, here[before] - here)
    rows = _fans(faces, following, sharp)
    count = int(rows.max(initial=-1)) + 1
    columns = [np.bincount(rows, column, count) for column in own.T]
    sums: FloatArray = np.stack(columns, axis=1, dtype=np.float64)
    largest = np.abs(sums).max(axis=1, keepdims=True)
    np.divide(sums, largest, out=sums, where=largest > 0.0)
    length = np.sqrt((sums * sums).sum(axis=1, keepdims=True))
    np.divide(sums, length, out=sums, where=length > 0.0)
    return sums, rows


def _fans(faces: Topology, following: IntArray, sharp: NDArray[np.bool_]) -> IntArray:
    """The fan of each corner: those of corners around a point that are joined by smooth edges."""
    fans = faces.corners.copy()
    cut = np.zeros(faces.point_count, bool)
    cut[faces.edges[sharp]] = True
    at_cut = cut[fans]
    if not at_cut.any():
        return fans
    # Corners at cut points begin as fans of their own, and take the lowest number of the fan.
    fans[at_cut] = faces.point_count + np.flatnonzero(at_cut)
    corners = np.arange(len(fans))
    first, last = np.empty((2, len(faces.edges)), np.int64)
    first[faces.corner_edges[::-1]] = corners[::-1]
    last[faces.corner_edges] = corners
    edges = np.flatnonzero(~sharp & cut[faces.edges].any(axis=1) & (first != last))
    one, other = first[edges], last[edges]
    same = faces.corners[one] == faces.corners[other]
    pairs = np.concatenate(
        (
            np.stack((one, np.where(same, other, following[other])), axis=1),
            np.stack((following[one], np.where(same, following[other], other)), axis=1),
        )
    )
    pairs = pairs[cut[faces.corners[pairs[:, 0]]]]
    while True:
        lowest = fans[pairs].min(axis=1)
        if (fans[pairs] == lowest[:, None]).all():
            break
        np.minimum.at(fans, pairs.ravel(), np.repeat(lowest, 2))
    return np.asarray(np.unique(fans, return_inverse=True)[1]).reshape(-1)
