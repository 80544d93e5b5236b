"""Cages: faces with the sharpness of their edges and points."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from compiler.subdivision.topology import Topology, edge_keys, topology
from dsl.scene import FloatArray, IntArray

Scheme = Literal["catmullClark", "loop", "bilinear"]
Boundary = Literal["none", "edgeOnly", "edgeAndCorner"]

INFINITE = 10.0
"""Sharpness from which on an edge or a point is sharp at the limit too."""


@dataclass(frozen=True, slots=True, eq=False)
class Creases:
    """What is sharp by choice.

    `edges` `(k, 2)` are pairs of points with `edge_sharpness` `(k,)`, `points` `(j,)` have
    `point_sharpness` `(j,)`. Pairs that are no edge are ignored; of several values for one edge or
    point the largest holds.
    """

    edges: IntArray
    edge_sharpness: FloatArray
    points: IntArray
    point_sharpness: FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class Cage:
    """Faces, and the sharpness of their edges `(e,)` and points `(v,)`: 0 is smooth, at most inf.

    `hidden` `(f,)` are faces that only support their neighbours.
    """

    topology: Topology
    edge_sharpness: FloatArray
    point_sharpness: FloatArray
    hidden: NDArray[np.bool_]


def cage(
    point_count: int,
    counts: IntArray,
    corners: IntArray,
    *,
    boundary: Boundary = "edgeAndCorner",
    creases: Creases | None = None,
) -> Cage:
    """The cage of polygons: `counts` `(f,)` corners of each, `corners` `(c,)` their points.

    Every face has at least 3 corners, with points in range, and no corner has the point of the
    next one. As in OpenSubdiv, edges are sharp unless two faces run along them in opposite
    directions, and so are points of one face only (unless `boundary` is "edgeOnly") and points
    around which faces are more than one fan, but for those where just two edges have the same
    number of too many faces: there a crease goes on. With "none", faces at a boundary that is not
    sharp by choice are hidden.
    """
    faces = topology(point_count, counts, corners)
    edge_faces = np.bincount(faces.corner_edges, minlength=len(faces.edges))
    edges, points = _sharpness(faces, creases)
    hidden = np.zeros(len(counts), bool)
    if boundary == "none":
        open_points = np.zeros(point_count, bool)
        open_points[faces.edges[(edge_faces == 1) & (edges < np.inf)]] = True
        hidden[faces.corner_faces[open_points[faces.corners]]] = True
    joined = faces.joined_edges()
    edges[~joined] = np.inf
    at_faces = np.bincount(faces.corners, minlength=point_count)
    at_ends = np.bincount(faces.edges[edge_faces == 1].ravel(), minlength=point_count)
    if boundary == "edgeAndCorner":
        points[(at_ends > 0) & (at_faces == 1)] = np.inf
    points[_many_fans(faces, edge_faces, joined, at_ends)] = np.inf
    return Cage(faces, edges, points, hidden)


def _many_fans(
    faces: Topology, edge_faces: IntArray, joined: NDArray[np.bool_], at_ends: IntArray
) -> NDArray[np.bool_]:
    """Points around which faces are more than one fan, unless a crease goes through `(v,)`.

    `at_ends` `(v,)` are the edges of a single face at each point: two for each open fan.
    """
    count = faces.point_count
    tangled = np.flatnonzero(~joined & (edge_faces > 1))
    ends = faces.edges[tangled]
    at_tangled = np.bincount(ends.ravel(), minlength=count)
    of_faces = np.bincount(ends.ravel(), np.repeat(edge_faces[tangled], 2), count)
    squared = np.bincount(ends.ravel(), np.repeat(edge_faces[tangled] ** 2, 2), count)
    crease = (at_tangled == 2) & (at_ends == 0) & (2 * squared == of_faces**2)
    crease &= np.bincount(faces.corners, minlength=count) > np.bincount(
        faces.edges.ravel(), minlength=count
    )
    fans = at_ends // 2 + faces.closed_fans()
    return np.asarray((at_tangled > 0) & ~crease | (fans > 1))


def _sharpness(faces: Topology, creases: Creases | None) -> tuple[FloatArray, FloatArray]:
    edges, points = np.zeros(len(faces.edges)), np.zeros(faces.point_count)
    if creases is None:
        return edges, points
    pairs = creases.edges
    known = edge_keys(faces.edges[:, 0], faces.edges[:, 1], faces.point_count)
    keys = edge_keys(pairs[:, 0], pairs[:, 1], faces.point_count)
    found = np.minimum(np.searchsorted(known, keys), max(len(known) - 1, 0))
    there = known[found] == keys
    np.maximum.at(edges, found[there], creases.edge_sharpness[there])
    np.maximum.at(points, creases.points, creases.point_sharpness)
    edges[edges >= INFINITE] = np.inf
    points[points >= INFINITE] = np.inf
    return edges, points
