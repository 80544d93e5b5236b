"""Cages to polygons with their points on the limit surface."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from compiler.subdivision import masks
from compiler.subdivision.cage import Cage, Scheme
from compiler.subdivision.masks import Sharpness
from dsl.scene import FloatArray, IntArray


@dataclass(frozen=True, slots=True, eq=False)
class Surface:
    """Polygons of `counts` `(f,)` corners each, whose `points` `(v, 3)` are `corners` `(c,)`.

    `faces` `(f,)` are the faces of the cage that they come from; its points keep their numbers.
    """

    points: FloatArray
    counts: IntArray
    corners: IntArray
    faces: IntArray


def limit_surface(
    cage: Cage, points: FloatArray, scheme: Scheme, level: int, *, smooth_triangles: bool = False
) -> Surface:
    """Refine `level` times, then move all points to their limits.

    Level 0 has the faces of the cage with their points at the limit. `points` are rows of any
    width; those of no face are ignored, and zero in the surface. Faces of a "loop" cage are
    triangles. With `smooth_triangles`, triangles of a "catmullClark" cage are refined by the
    `smooth` rule. Sharpness that is left after the last level counts as it stands: below 1 it
    moves its points part of the way to the crease.
    """
    used = np.zeros(len(points), bool)
    used[cage.topology.corners] = True
    points = np.where(used[:, None], points, 0.0)
    faces = cage.topology
    sharpness = Sharpness(cage.edge_sharpness, cage.point_sharpness)
    origin = np.arange(len(faces.counts))
    # The limit rules are for quadrilaterals, so even level 0 is refined, and then forgotten.
    for step in range(max(level, 1)):
        if scheme == "loop":
            points = masks.loop(points, faces, sharpness)
            origin = np.repeat(origin, 4)
            faces = faces.triangles()
        else:
            if scheme == "bilinear":
                points = masks.linear(points, faces)
            else:
                smooth = smooth_triangles and step == 0
                points = masks.catmull_clark(points, faces, sharpness, smooth_triangles=smooth)
            origin = np.repeat(origin, faces.counts)
            faces = faces.quads()
        sharpness = sharpness.refined(len(faces.edges), faces.point_count)
    if scheme == "loop":
        points = masks.loop_limit(points, faces, sharpness)
    elif scheme == "catmullClark":
        points = masks.catmull_clark_limit(points, faces, sharpness)
    if level == 0:
        faces = cage.topology
        points, origin = points[: faces.point_count], np.arange(len(faces.counts))
    if not cage.hidden.any():
        return Surface(points, faces.counts, faces.corners, origin)
    shown = ~cage.hidden[origin]
    corners = faces.corners[np.repeat(shown, faces.counts)]
    return Surface(points, faces.counts[shown], corners, origin[shown])
