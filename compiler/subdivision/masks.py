"""Rules that make the points of a refinement, and those of the limit, from those of a cage.

Every rule is a sum over neighbours, taken for all points at once; rows of `points` `(v, k)` may be
positions or anything else that is linear. An edge or a point of sharpness s > 0 is sharp. At a
point with 2 sharp edges the crease's rule holds, with more, and at a sharp point, the point stays,
at all others the smooth rule holds (DeRose, Kass and Truong, appendix A).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from compiler.subdivision.topology import Topology
from dsl.scene import FloatArray, IntArray

CREASE_REFINED = 1.0 / 8.0
CREASE_LIMIT = 1.0 / 6.0
"""Weights of a point's two neighbours along a crease, a cubic B-spline."""

SMOOTH_TRIANGLE = 0.47
"""Weight of a triangle's middle at its edges, instead of 1/4, by the `smooth` rule for triangles
(Stam and Loop, "Quad/triangle subdivision", 2003, as USD has it)."""


@dataclass(frozen=True, slots=True, eq=False)
class Sharpness:
    """Sharpness of edges `(e,)` and points `(v,)`."""

    edges: FloatArray
    points: FloatArray

    @property
    def fades(self) -> bool:
        """Whether any of it will end."""
        return any(
            bool(((each > 0.0) & (each < np.inf)).any()) for each in (self.edges, self.points)
        )

    def softened(self) -> Sharpness:
        """What is left after one refinement."""
        return Sharpness(np.maximum(self.edges - 1.0, 0.0), np.maximum(self.points - 1.0, 0.0))

    def refined(self, edge_count: int, point_count: int) -> Sharpness:
        """What is left, on the halves of edges and the old points; the new ones are smooth."""
        soft = self.softened()
        edges, points = np.zeros(edge_count), np.zeros(point_count)
        edges[: 2 * len(soft.edges)] = np.repeat(soft.edges, 2)
        points[: len(soft.points)] = soft.points
        return Sharpness(edges, points)


def linear(points: FloatArray, faces: Topology) -> FloatArray:
    """The points, the middles of the edges, and the means of the faces."""
    return np.concatenate((points, _middles(points, faces), _means(points, faces)))


def catmull_clark(
    points: FloatArray, faces: Topology, sharpness: Sharpness, *, smooth_triangles: bool = False
) -> FloatArray:
    """Points of `Topology.quads`."""
    means = _means(points, faces)
    first, last = faces.edge_faces()
    middles = _middles(points, faces)
    of_faces = (means[first] + means[last]) / 2.0
    weight = np.full((len(faces.edges), 1), 0.5)
    if smooth_triangles:
        share = np.where(faces.counts == 3, SMOOTH_TRIANGLE, 0.25)
        weight = (share[first] + share[last])[:, None]
    at_edges = _blended(middles + weight * (of_faces - middles), middles, sharpness.edges)
    valence = _valence(faces)
    around = _neighbours(points, faces) + _sums(
        faces.corners, means[faces.corner_faces], len(points)
    )
    smooth = ((valence - 2.0) * points + around / valence) / valence
    at_points = _ruled(points, smooth, CREASE_REFINED, faces, sharpness)
    return np.concatenate((at_points, at_edges, means))


def catmull_clark_limit(points: FloatArray, faces: Topology, sharpness: Sharpness) -> FloatArray:
    """Where the points of quadrilaterals end (Halstead, Kass and DeRose, section 3)."""
    opposite = np.roll(faces.corners.reshape(-1, 4), 2, axis=1).ravel()
    valence = _valence(faces)
    across = _sums(faces.corners, points[opposite], len(points))
    around = (4.0 * _neighbours(points, faces) + across) / valence
    smooth = (valence * points + around) / (valence + 5.0)
    return _ruled(points, smooth, CREASE_LIMIT, faces, sharpness)


def loop(points: FloatArray, faces: Topology, sharpness: Sharpness) -> FloatArray:
    """Points of `Topology.triangles`."""
    middles = _middles(points, faces)
    opposite = _sums(faces.corner_edges, points[faces.corners[faces.previous]], len(faces.edges))
    at_edges = _blended(0.75 * middles + opposite / 8.0, middles, sharpness.edges)
    valence, weight = _valence(faces), _loop_weight(faces)
    smooth = (1.0 - valence * weight) * points + weight * _neighbours(points, faces)
    at_points = _ruled(points, smooth, CREASE_REFINED, faces, sharpness)
    return np.concatenate((at_points, at_edges))


def loop_limit(points: FloatArray, faces: Topology, sharpness: Sharpness) -> FloatArray:
    """Where the points of triangles end."""
    valence = _valence(faces)
    weight = 1.0 / (valence + 3.0 / (8.0 * _loop_weight(faces)))
    smooth = (1.0 - valence * weight) * points + weight * _neighbours(points, faces)
    return _ruled(points, smooth, CREASE_LIMIT, faces, sharpness)


def _loop_weight(faces: Topology) -> FloatArray:
    """The weight of each neighbour in the smooth rule `(v, 1)` (Loop, section 3.2)."""
    valence = _valence(faces)
    turn = 0.375 + 0.25 * np.cos(2.0 * np.pi / valence)
    return np.asarray((0.625 - turn * turn) / valence)


def _ruled(
    points: FloatArray, smooth: FloatArray, weight: float, faces: Topology, sharpness: Sharpness
) -> FloatArray:
    """Points by their rules; where sharpness ends before 1, part of the way to the next ones."""
    sharp = _rule(points, smooth, weight, faces, sharpness)
    soft = sharpness.softened()
    edges = np.flatnonzero((sharpness.edges > 0.0) & (soft.edges == 0.0))
    ending = (sharpness.points > 0.0) & (soft.points == 0.0)
    if not len(edges) and not ending.any():
        return sharp
    ends = faces.edges[edges].ravel()
    count = np.bincount(ends, minlength=len(points)) + ending
    of_edges = np.bincount(ends, np.repeat(sharpness.edges[edges], 2), len(points))
    total = np.where(ending, sharpness.points, 0.0) + of_edges
    share = np.where(count > 0, np.minimum(total / np.maximum(count, 1), 1.0), 1.0)
    later = _rule(points, smooth, weight, faces, soft)
    return later + share[:, None] * (sharp - later)


def _rule(
    points: FloatArray, smooth: FloatArray, weight: float, faces: Topology, sharpness: Sharpness
) -> FloatArray:
    ends = faces.edges[sharpness.edges > 0.0]
    count = np.bincount(ends.ravel(), minlength=len(points))
    along = _sums(ends.ravel(), points[ends[:, ::-1].ravel()], len(points))
    crease = count == 2
    corner = (count > 2) | (sharpness.points > 0.0)
    result = smooth.copy()
    result[crease] = (1.0 - 2.0 * weight) * points[crease] + weight * along[crease]
    result[corner] = points[corner]
    return result


def _blended(smooth: FloatArray, sharp: FloatArray, sharpness: FloatArray) -> FloatArray:
    share = np.minimum(sharpness, 1.0)[:, None]
    return np.where(share >= 1.0, sharp, smooth + share * (sharp - smooth))


def _middles(points: FloatArray, faces: Topology) -> FloatArray:
    return np.asarray((points[faces.edges[:, 0]] + points[faces.edges[:, 1]]) / 2.0)


def _means(points: FloatArray, faces: Topology) -> FloatArray:
    sums = np.add.reduceat(points[faces.corners], faces.starts, axis=0)
    return np.asarray(sums / faces.counts[:, None])


def _valence(faces: Topology) -> FloatArray:
    """Edges of each point `(v, 1)`; 1 where there is none, for nothing uses such points."""
    count = np.bincount(faces.edges.ravel(), minlength=faces.point_count)
    return np.asarray(np.maximum(count, 1), dtype=np.float64)[:, None]


def _neighbours(points: FloatArray, faces: Topology) -> FloatArray:
    """The sum of the points at the other ends of each point's edges."""
    return _sums(faces.edges.ravel(), points[faces.edges[:, ::-1].ravel()], len(points))


def _sums(places: IntArray, values: FloatArray, count: int) -> FloatArray:
    """Sums of the values `(n, k)` at each of `count` places."""
    columns = [np.bincount(places, column, count) for column in values.T]
    return np.stack(columns, axis=1)
