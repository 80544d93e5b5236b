"""Subdivision meshes as polygons of their limit surface.

At the complexity "limit" a mesh is refined as often as makes about 200 000 triangles: of up to
25 faces 6 times, of up to 100 5 times, 400 4 times, 2 000 3 times, 8 000 twice, and beyond that
once, counting a face for every four corners. Beyond 250 000 faces the points of the cage itself
are moved to the limit.
Where all meshes of a stage would get more than `STAGE_TRIANGLES`, each is refined as many times
less as it takes.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from compiler.subdivision import INFINITE, Boundary, Cage, Creases, Scheme, cage, limit_surface
from compiler.usd.clock import Clock
from compiler.usd.options import StageOptions
from compiler.usd.polygons import Polygons, triangulate
from compiler.usd.report import Report
from dsl.scene import FloatArray, IntArray

SCHEMES: dict[str, Scheme] = {
    "catmullClark": "catmullClark",
    "loop": "loop",
    "bilinear": "bilinear",
}
BOUNDARIES: dict[str, Boundary] = {
    "none": "none",
    "edgeOnly": "edgeOnly",
    "edgeAndCorner": "edgeAndCorner",
}

LEVELS = {"medium": 1, "high": 2, "veryhigh": 3}
BUDGET = ((25, 6), (100, 5), (400, 4), (2_000, 3), (8_000, 2), (250_000, 1))
"""Faces up to which a mesh is refined so many times."""

MAX_TRIANGLES = 1 << 25
"""A mesh is refined less often than asked if that made more triangles."""

STAGE_TRIANGLES = 1 << 22


@dataclass(frozen=True, slots=True, eq=False)
class Refinement:
    """How a mesh was refined, for what varies over it.

    `cage` has `point_count` points; `places` `(c,)` are those of its corners among all that the
    prim lists. `normals` `(n, 3)` are those of the limit surface, outward by the polygons, and
    `corner_normals` which of them each refined corner has; None of bilinear surfaces.
    """

    cage: Cage
    scheme: Scheme
    level: int
    smooth_triangles: bool
    places: IntArray
    normals: FloatArray | None
    corner_normals: IntArray | None

    def points(self, values: FloatArray) -> FloatArray:
        """Rows `(v, k)` by point of the cage as rows by refined point: as points are refined."""
        surface = limit_surface(
            self.cage, values, self.scheme, self.level, smooth_triangles=self.smooth_triangles
        )
        return surface.points

    def corners(self, values: FloatArray) -> FloatArray:
        """Rows `(c, k)` by corner of the cage as rows by refined corner, linear in each face."""
        counts = self.cage.topology.counts
        apart = replace(cage(len(values), counts, np.arange(len(values))), hidden=self.cage.hidden)
        # Triangles apart, their edges and corners sharp, stay flat under Loop's rules.
        scheme: Scheme = "loop" if self.scheme == "loop" else "bilinear"
        surface = limit_surface(apart, values, scheme, self.level)
        return np.asarray(surface.points[surface.corners])


def coarsening(prims: Iterable[Any], clock: Clock) -> int:
    """By how much the default levels of these meshes are too many, all of them together."""
    corners = [
        np.size(clock.value(prim.GetAttribute("faceVertexIndices")))
        for prim in prims
        if clock.token(prim.GetAttribute("subdivisionScheme")) in SCHEMES
    ]
    less = 0
    while less < BUDGET[0][1] and sum(_triangles(c, _budgeted(c, less)) for c in corners) > (
        STAGE_TRIANGLES
    ):
        less += 1
    return less


def refined(
    points: FloatArray,
    polygons: Polygons,
    scheme: str,
    prim: Any,
    clock: Clock,
    report: Report,
    options: StageOptions,
    coarser: int,
) -> tuple[FloatArray, Polygons, Refinement | None]:
    """Points and polygons of the limit surface of a mesh prim, and how they were made.

    `coarser` is what `coarsening` says. The polygons' `faces` are still those of the prim.
    """
    polygons = polygons.distinct()
    path = prim.GetPath()
    if scheme == "loop" and (polygons.counts != 3).any():
        message = "faces of a `loop` mesh that are no triangles are cut into triangles first"
        report.add("usd-subdivision", message, path)
        found = triangulate(points, polygons.counts, polygons.corners)
        own = found.corners.ravel()
        corners, faces = polygons.corners[own], polygons.faces[found.rows]
        places = own if polygons.places is None else polygons.places[own]
        polygons = Polygons(np.full(len(faces), 3), corners, faces, polygons.dropped, places)
        polygons = polygons.distinct()
    if not len(polygons.counts):
        return points, polygons, None
    boundary = clock.token(prim.GetAttribute("interpolateBoundary"))
    if boundary not in BOUNDARIES:
        message = f"`interpolateBoundary = {boundary!r}` is not known: `edgeAndCorner` is used"
        report.add("usd-subdivision", message, path)
        boundary = "edgeAndCorner"
    if scheme == "bilinear":
        boundary = "edgeOnly"
    of_prim = cage(
        len(points),
        polygons.counts,
        polygons.corners,
        boundary=BOUNDARIES[boundary],
        creases=_creases(prim, len(points), clock, report),
    )
    level = _level(len(polygons.corners), options, coarser, path, report)
    smooth = clock.token(prim.GetAttribute("triangleSubdivisionRule")) == "smooth"
    surface = limit_surface(
        of_prim,
        points,
        SCHEMES[scheme],
        level,
        smooth_triangles=smooth,
        with_normals=scheme != "bilinear",
    )
    places = np.arange(len(polygons.corners)) if polygons.places is None else polygons.places
    refinement = Refinement(
        of_prim,
        SCHEMES[scheme],
        level,
        smooth,
        places,
        surface.normals,
        surface.corner_normals,
    )
    faces = polygons.faces[surface.faces]
    refined = Polygons(surface.counts, surface.corners, faces, polygons.dropped)
    return surface.points, refined, refinement


def _level(corners: int, options: StageOptions, coarser: int, path: Any, report: Report) -> int:
    if options.complexity == "limit":
        return _budgeted(corners, coarser)
    level = asked = LEVELS[options.complexity]
    while level > 0 and _triangles(corners, level) > MAX_TRIANGLES:
        level -= 1
    if level < asked:
        message = f"a mesh is refined {level} times instead of {asked}, for its many faces"
        report.add("usd-subdivision", message, path)
    return level


def _budgeted(corners: int, coarser: int) -> int:
    level = next((level for faces, level in BUDGET if corners <= 4 * faces), 0)
    return max(level - coarser, 0)


def _triangles(corners: int, level: int) -> int:
    """About how many triangles are made of faces with so many corners."""
    return corners * int(4**level) // 2


def _creases(prim: Any, count: int, clock: Clock, report: Report) -> Creases:
    edges, edge_sharpness = _crease_edges(prim, count, clock, report)
    points = clock.integers(prim.GetAttribute("cornerIndices"))
    sharpness = _numbers(prim.GetAttribute("cornerSharpnesses"), clock)
    if points is None or not len(points):
        points, sharpness = np.empty(0, np.int64), np.empty(0)
    elif len(sharpness) != len(points):
        _ignored(report, prim, "corners whose indices and sharpnesses differ in number")
        points, sharpness = np.empty(0, np.int64), np.empty(0)
    sound = (points >= 0) & (points < count)
    if not sound.all():
        _ignored(report, prim, "corners at points that do not exist")
    return Creases(edges, edge_sharpness, points[sound], sharpness[sound])


def _crease_edges(
    prim: Any, count: int, clock: Clock, report: Report
) -> tuple[IntArray, FloatArray]:
    """Pairs of points along all creases, and their sharpness: one per crease, or per pair."""
    none = np.empty((0, 2), np.int64), np.empty(0)
    indices = clock.integers(prim.GetAttribute("creaseIndices"))
    lengths = clock.integers(prim.GetAttribute("creaseLengths"))
    sharpness = _numbers(prim.GetAttribute("creaseSharpnesses"), clock)
    if indices is None or not len(indices):
        return none
    if lengths is None or (lengths < 2).any() or lengths.sum() != len(indices):
        _ignored(report, prim, "creases whose lengths do not fit their indices")
        return none
    crease = np.repeat(np.arange(len(lengths)), lengths)
    first = np.flatnonzero(crease[:-1] == crease[1:])
    if len(sharpness) == len(lengths):
        sharpness = sharpness[crease[first]]
    elif len(sharpness) != len(first):
        _ignored(report, prim, "creases whose sharpnesses do not fit their lengths")
        return none
    pairs = np.stack((indices[first], indices[first + 1]), axis=1)
    sound = ((pairs >= 0) & (pairs < count)).all(axis=1)
    if not sound.all():
        _ignored(report, prim, "creases through points that do not exist")
    return pairs[sound], sharpness[sound]


def _numbers(attribute: Any, clock: Clock) -> FloatArray:
    """Sharpnesses `(n,)` within 0 and infinite; what is not a number is smooth."""
    value = clock.value(attribute)
    array = np.atleast_1d(np.asarray(value)) if value is not None else np.empty(0)
    if array.ndim != 1 or array.dtype.kind not in "fiu":
        return np.empty(0)
    numbers = np.nan_to_num(array.astype(np.float64), nan=0.0, posinf=INFINITE, neginf=0.0)
    return np.asarray(np.clip(numbers, 0.0, INFINITE))


def _ignored(report: Report, prim: Any, what: str) -> None:
    report.add("usd-subdivision", f"{what} are ignored", prim.GetPath())
