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
    next one. Edges of other than two faces are sharp, and so are points of one face only (unless
    `boundary` is "edgeOnly") and points where faces meet that share no edge. With "none", faces at
    a boundary are hidden.
    """
    faces = topology(point_count, counts, corners)
    edge_faces = np.bincount(faces.corner_edges, minlength=len(faces.edges))
    edges, points = _sharpness(faces, creases)
    edges[edge_faces != 2] = np.inf
    at_edges = np.bincount(faces.edges.ravel(), minlength=point_count)
    at_faces = np.bincount(faces.corners, minlength=point_count)
    # A fan of faces has one edge more than faces if it is open, and as many if it is closed.
    points[at_edges > at_faces + 1] = np.inf
    points[np.unique(faces.edges[edge_faces > 2])] = np.inf
    hidden = np.zeros(len(counts), bool)
    open_points = np.zeros(point_count, bool)
    open_points[faces.edges[edge_faces == 1]] = True
    if boundary == "edgeAndCorner":
        points[open_points & (at_faces == 1)] = np.inf
    elif boundary == "none":
        hidden[faces.corner_faces[open_points[faces.corners]]] = True
    return Cage(faces, edges, points, hidden)


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
