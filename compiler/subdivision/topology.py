"""Faces and the edges between them, and what one refinement makes of them.

Refining numbers the new points: those of the points come first (and keep their numbers), then one
for each edge, then one for each face (of Loop: none). The two halves of edge e are the edges 2e,
at its first point, and 2e + 1; edges that are new inside a face follow, one for each corner.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dsl.scene import IntArray


@dataclass(frozen=True, slots=True, eq=False)
class Topology:
    """Polygons that share points and edges.

    `counts` `(f,)` corners of each face, at least 3; `corners` `(c,)` their points, face by face;
    `edges` `(e, 2)` two different points each; `corner_edges` `(c,)` the edge from a corner to
    the next one of its face.
    """

    point_count: int
    counts: IntArray
    corners: IntArray
    edges: IntArray
    corner_edges: IntArray

    @property
    def starts(self) -> IntArray:
        """The first corner of each face `(f,)`."""
        return np.cumsum(self.counts) - self.counts

    @property
    def corner_faces(self) -> IntArray:
        """The face of each corner `(c,)`."""
        return np.repeat(np.arange(len(self.counts)), self.counts)

    @property
    def previous(self) -> IntArray:
        """The corner before each corner of its face `(c,)`."""
        before = np.arange(len(self.corners)) - 1
        starts = self.starts
        before[starts] = starts + self.counts - 1
        return before

    @property
    def following(self) -> IntArray:
        """The corner after each corner of its face `(c,)`."""
        before = self.previous
        after = np.empty_like(before)
        after[before] = np.arange(len(before))
        return after

    def joined_edges(self) -> NDArray[np.bool_]:
        """Edges of just two faces that run along them in opposite directions `(e,)`."""
        along = np.where(self.edges[self.corner_edges, 0] == self.corners, 1, -1)
        count = np.bincount(self.corner_edges, minlength=len(self.edges))
        balance = np.bincount(self.corner_edges, along, len(self.edges))
        return np.asarray((count == 2) & (balance == 0.0))

    def closed_fans(self) -> IntArray:
        """Around how many fans of faces one can walk about each point `(v,)`."""
        corners = np.arange(len(self.corners))
        first, last = np.empty((2, len(self.edges)), np.int64)
        first[self.corner_edges[::-1]] = corners[::-1]
        last[self.corner_edges] = corners
        # The corner of the next face about a point begins at the edge where this one's ends.
        entering = self.corner_edges[self.previous]
        twin = np.where(first[entering] == self.previous, last[entering], first[entering])
        lost = len(corners)
        onward = np.append(np.where(self.joined_edges()[entering], twin, lost), lost)
        lowest = np.append(corners, -1)
        # Each turn looks twice as far: after as many as double the largest fan, all around it.
        largest = int(np.bincount(self.corners, minlength=1).max(initial=1))
        for _ in range(largest.bit_length()):
            lowest = np.minimum(lowest, lowest[onward])
            onward = onward[onward]
        return np.bincount(self.corners[lowest[:-1] == corners], minlength=self.point_count)

    def edge_faces(self) -> tuple[IntArray, IntArray]:
        """The first and the last face at each edge, `(e,)` each: of most edges, all."""
        faces = self.corner_faces
        first = np.zeros(len(self.edges), np.int64)
        last = np.zeros(len(self.edges), np.int64)
        # Of values assigned to one place, the last one stays.
        first[self.corner_edges[::-1]] = faces[::-1]
        last[self.corner_edges] = faces
        return first, last

    def quads(self) -> Topology:
        """One quadrilateral for each corner: its point, an edge, the face, the edge before."""
        points, edges = self.point_count, len(self.edges)
        before = self.previous
        at_next, at_before = self.corner_edges, self.corner_edges[before]
        inside = 2 * edges + np.arange(len(self.corners))
        middle = points + edges + self.corner_faces
        quads = np.stack((self.corners, points + at_next, middle, points + at_before), axis=1)
        quad_edges = np.stack(
            (self._half(at_next), inside, inside[before], self._half(at_before)), axis=1
        )
        new = np.stack((points + at_next, middle), axis=1)
        return Topology(
            points + edges + len(self.counts),
            np.full(len(quads), 4),
            quads.ravel(),
            np.concatenate((self._halves(), new)),
            quad_edges.ravel(),
        )

    def triangles(self) -> Topology:
        """Four triangles for each triangle: one at each corner, and one of its edges."""
        points, edges = self.point_count, len(self.edges)
        before = self.previous
        at_next, at_before = self.corner_edges, self.corner_edges[before]
        inside = 2 * edges + np.arange(len(self.corners))
        outer = np.stack((self.corners, points + at_next, points + at_before), axis=1)
        outer_edges = np.stack((self._half(at_next), inside, self._half(at_before)), axis=1)
        inner = (points + at_next).reshape(-1, 1, 3)
        inner_edges = np.roll(inside.reshape(-1, 1, 3), -1, axis=2)
        corners = np.concatenate((outer.reshape(-1, 3, 3), inner), axis=1)
        corner_edges = np.concatenate((outer_edges.reshape(-1, 3, 3), inner_edges), axis=1)
        new = np.stack((points + at_before, points + at_next), axis=1)
        return Topology(
            points + edges,
            np.full(4 * len(self.counts), 3),
            corners.ravel(),
            np.concatenate((self._halves(), new)),
            corner_edges.ravel(),
        )

    def _half(self, edges: IntArray) -> IntArray:
        """The half of an edge that is at a corner's point, for each corner."""
        return np.asarray(2 * edges + (self.edges[edges, 1] == self.corners))

    def _halves(self) -> IntArray:
        middle = self.point_count + np.arange(len(self.edges))
        return np.stack((self.edges.ravel(), np.repeat(middle, 2)), axis=1)


def topology(point_count: int, counts: IntArray, corners: IntArray) -> Topology:
    """The edges of faces, each of at least 3 corners, none of which is the next one's point."""
    following = np.arange(1, len(corners) + 1)
    ends = np.cumsum(counts)
    following[ends - 1] = ends - counts
    keys = edge_keys(corners, corners[following], point_count)
    unique, corner_edges = np.unique(keys, return_inverse=True)
    edges = np.stack(np.divmod(unique, point_count), axis=1)
    return Topology(point_count, counts, corners, edges, corner_edges.reshape(-1).astype(np.int64))


def edge_keys(first: IntArray, second: IntArray, point_count: int) -> IntArray:
    """One number for each pair of points, whatever their order; they sort as `edges` do."""
    low, high = np.minimum(first, second), np.maximum(first, second)
    return np.asarray(low * point_count + high)
