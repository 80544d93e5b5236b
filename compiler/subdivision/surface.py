"""Cages to polygons with their points on the limit surface."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from compiler.subdivision import masks
from compiler.subdivision.cage import Cage, Scheme
from compiler.subdivision.masks import Sharpness
from compiler.subdivision.normals import normals
from dsl.scene import FloatArray, IntArray

MOST_CORNERS = 1 << 19
"""Corners up to which faces are refined only to find the limit of what they keep."""


@dataclass(frozen=True, slots=True, eq=False)
class Surface:
    """Polygons of `counts` `(f,)` corners each, whose `points` `(v, 3)` are `corners` `(c,)`.

    `faces` `(f,)` are the faces of the cage that they come from; its points keep their numbers.
    `normals` `(n, 3)` are unit or zero, and `corner_normals` `(c,)` which of them each corner has;
    None unless they were asked for.
    """

    points: FloatArray
    counts: IntArray
    corners: IntArray
    faces: IntArray
    normals: FloatArray | None = None
    corner_normals: IntArray | None = None


def limit_surface(
    cage: Cage,
    points: FloatArray,
    scheme: Scheme,
    level: int,
    *,
    smooth_triangles: bool = False,
    with_normals: bool = False,
) -> Surface:
    """Refine `level` times, then move all points to their limits.

    Level 0 has the faces of the cage with their points at the limit. `points` are rows of any
    width; those of no face are ignored, and zero in the surface. Faces of a "loop" cage are
    triangles. With `smooth_triangles`, triangles of a "catmullClark" cage are refined by the
    `smooth` rule. Sharpness that is left after the last level is refined away to find the limit, up
    to `MOST_CORNERS`, and beyond counts as it stands: below 1 it moves its points part of the way
    to the crease. For `with_normals`, points are positions; edges whose sharpness is left are where
    normals break.
    """
    used = np.zeros(len(points), bool)
    used[cage.topology.corners] = True
    points = np.where(used[:, None], points, 0.0)
    faces = cage.topology
    sharpness = Sharpness(cage.edge_sharpness, cage.point_sharpness)
    origin = np.arange(len(faces.counts))
    kept = faces, sharpness, origin
    step = 0
    # The limit rules are for quadrilaterals, so even level 0 is refined, and then forgotten.
    while step < max(level, 1) or (
        scheme != "bilinear" and sharpness.fades and 4 * len(faces.corners) <= MOST_CORNERS
    ):
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
        step += 1
        if step == level:
            kept = faces, sharpness, origin
    if scheme == "loop":
        points = masks.loop_limit(points, faces, sharpness)
    elif scheme == "catmullClark":
        points = masks.catmull_clark_limit(points, faces, sharpness)
    faces, sharpness, origin = kept
    points = points[: faces.point_count]
    found, rows = normals(points, faces, sharpness.edges >= 1.0) if with_normals else (None, None)
    if not cage.hidden.any():
        return Surface(points, faces.counts, faces.corners, origin, found, rows)
    shown = ~cage.hidden[origin]
    of_shown = np.repeat(shown, faces.counts)
    return Surface(
        points,
        faces.counts[shown],
        faces.corners[of_shown],
        origin[shown],
        found,
        None if rows is None else rows[of_shown],
    )
