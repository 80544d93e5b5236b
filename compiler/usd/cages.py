"""What mesh prims author of their faces, and the triangles of many small ones at once.

NumPy takes a microsecond for a call, however small its arrays are, and a mesh takes dozens of
calls; so the faces of small meshes are put end to end and cut into triangles together.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pxr import Sdf, UsdGeom

from compiler.usd.clock import Clock, integers, rows
from compiler.usd.polygons import MODERATE, Polygons, triangulate
from compiler.usd.visits import Visit
from dsl.scene import FloatArray, IntArray

SMALL = 1024
"""Corners and points of a mesh that is cut together with others."""

BATCH = 1 << 16
"""Corners that are cut at once, about; a prim counts as some more."""


@dataclass(frozen=True, slots=True, eq=False)
class Cut:
    """Faces as `triangles` `(m, 3)`: `faces` `(m,)` says of which each is a part.

    `places` `(m, 3)` are those of the corners among all that the prim lists. `whole` says that the
    triangles are known to have all points.
    """

    triangles: IntArray
    faces: IntArray
    places: IntArray
    whole: bool = False

    def without(self, holes: IntArray | None) -> Cut:
        """The same without some faces."""
        if holes is None or not len(holes):
            return self
        kept = ~np.isin(self.faces, holes)
        return Cut(self.triangles[kept], self.faces[kept], self.places[kept])

    def turned(self) -> Cut:
        """The same with their other side outside."""
        triangles, places = (
            np.ascontiguousarray(corners[:, ::-1]) for corners in (self.triangles, self.places)
        )
        return Cut(triangles, self.faces, places, self.whole)


def cut_polygons(points: FloatArray, polygons: Polygons) -> Cut:
    """Cut the usable faces of one mesh."""
    found = triangulate(points, polygons.counts, polygons.corners)
    return Cut(
        polygons.corners[found.corners],
        polygons.faces[found.rows],
        found.corners if polygons.places is None else polygons.places[found.corners],
    )


@dataclass(frozen=True, slots=True, eq=False)
class Cage:
    """Points `(v, 3)`, corners of each face `(f,)`, and their points, as authored.

    None of what the prim does not have, or not of its type. `cut` is of cages without any fault,
    and whose points are moderate.
    """

    points: NDArray[Any] | None
    counts: NDArray[np.integer] | None
    indices: NDArray[np.integer] | None
    scheme: str
    cut: Cut | None = None


def read_cage(visit: Visit, clock: Clock) -> Cage:
    """The cage of a Mesh or TetMesh."""

    def said(name: str) -> Any:
        attribute = visit.attribute(name)
        return None if attribute is None else clock.plain(attribute)

    points = rows(said("points"), 3)
    if visit.type.kind == "TetMesh":
        return Cage(points, *_surface_of_tetrahedra(visit.prim, clock), "none")
    counts, indices = integers(said("faceVertexCounts")), integers(said("faceVertexIndices"))
    scheme = usual = str(UsdGeom.Tokens.catmullClark)
    if (attribute := visit.attribute("subdivisionScheme")) is not None:
        named = clock.beside(attribute, usual)
        scheme = named if isinstance(named, str) else ""
    return Cage(points, counts, indices, scheme or "none")


class CagesAhead:
    """The cages of meshes that are to be drawn, in that order, read and cut some at a time."""

    def __init__(self, visits: Iterable[Visit], clock: Clock) -> None:
        self._coming = iter(visits)
        self._clock = clock
        self._read: dict[Sdf.Path, Cage] = {}

    def take(self, visit: Visit) -> Cage:
        """The cage of a mesh, at once if it is the next one."""
        while not visit.instance and visit.path not in self._read:
            coming = list(self._next())
            if not coming:
                break
            # Whatever is left was passed over, and will not be asked for.
            self._read = dict(zip((v.path for v, _ in coming), _cut_together(coming), strict=True))
        return self._read.pop(visit.path, None) or read_cage(visit, self._clock)

    def _next(self) -> Iterator[tuple[Visit, Cage]]:
        """Meshes of about `BATCH` corners together."""
        corners = 0
        for visit in self._coming:
            cage = read_cage(visit, self._clock)
            yield visit, cage
            # Until it is drawn a prim keeps its properties, a kilobyte.
            corners += 16 + (0 if cage.indices is None else len(cage.indices))
            if corners > BATCH:
                return


def _cut_together(read: list[tuple[Visit, Cage]]) -> list[Cage]:
    """The cages, those that are small and without fault with their cut."""
    cages = [cage for _, cage in read]
    small = [number for number, cage in enumerate(cages) if _is_small(cage)]
    for number, cut in zip(small, _cuts([cages[n] for n in small]), strict=True):
        cage = cages[number]
        cages[number] = Cage(cage.points, cage.counts, cage.indices, cage.scheme, cut)
    return cages


def _is_small(cage: Cage) -> bool:
    arrays = (cage.points, cage.counts, cage.indices)
    return all(array is not None and 0 < len(array) <= SMALL for array in arrays)


def _cuts(cages: list[Cage]) -> list[Cut | None]:
    """The cut of each cage, None where anything is unusual."""
    if not cages:
        return []
    points, starts = _joined([cage.points for cage in cages], np.float64)
    counts, faces = _joined([cage.counts for cage in cages], np.int64)
    indices, corners = _joined([cage.indices for cage in cages], np.int64)
    sizes = np.diff(starts, append=len(points))
    largest = np.maximum.reduceat(np.abs(points).max(axis=1), starts)
    sound = (
        (np.minimum.reduceat(counts, faces) >= 3)
        & (np.add.reduceat(counts, faces) == np.diff(corners, append=len(indices)))
        & (np.minimum.reduceat(indices, corners) >= 0)
        & (np.maximum.reduceat(indices, corners) < sizes)
        & (largest > 1.0 / MODERATE)
        & (largest < MODERATE)
    )
    if not sound.all():
        kept = [cage for cage, one in zip(cages, sound, strict=True) if one]
        found = iter(_cuts(kept))
        return [next(found) if one else None for one in sound]
    of_all = indices + np.repeat(starts, np.diff(corners, append=len(indices)))
    cut = triangulate(points, counts, of_all)
    used = np.zeros(len(points), bool)
    used[of_all[cut.corners]] = True
    whole = np.logical_and.reduceat(used, starts).tolist()
    ends = np.searchsorted(cut.rows, [*faces[1:], len(counts)])
    triangles, own = (
        indices[cut.corners],
        np.repeat(np.arange(len(cages)), np.diff(ends, prepend=0)),
    )
    of_face, places = cut.rows - faces[own], cut.corners - corners[own, None]
    return [
        Cut(triangles[a:b], of_face[a:b], places[a:b], every)
        for a, b, every in zip([0, *ends[:-1]], ends, whole, strict=True)
    ]


def _joined(arrays: list[Any], kind: type) -> tuple[NDArray[Any], IntArray]:
    """Arrays end to end, and where each begins."""
    lengths = np.array([len(array) for array in arrays])
    return np.concatenate(arrays).astype(kind), np.cumsum(lengths) - lengths


def _surface_of_tetrahedra(prim: Any, clock: Clock) -> tuple[IntArray | None, IntArray | None]:
    """Counts and indices of a TetMesh's surface: as authored, or what bounds its tetrahedra."""
    faces = clock.as_authored(prim.GetAttribute("surfaceFaceVertexIndices"), 3)
    if faces is None or not len(faces) or faces.dtype.kind not in "iu":
        time = clock.code(prim.GetAttribute("tetVertexIndices"))
        found = UsdGeom.TetMesh.ComputeSurfaceFaces(UsdGeom.TetMesh(prim), time)
        faces = np.array(found, dtype=np.int64).reshape(-1, 3)
    return np.full(len(faces), 3, np.int64), faces.astype(np.int64).ravel()
