"""What a stage shows, by usd-core and plain formulas alone: nothing of the importer is used.

Every drawn prim becomes `Piece`s with usd-core's own world matrix; rays meet them in object space
one piece at a time. Polygons are not cut into triangles: a ray meets a face's plane, and the point
is inside by the parity of edges crossed.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Hit = tuple[Array, Array]
"""Distances `(n,)`, inf where missed, and normals `(n, 3)`."""

DRAWN_PURPOSES = ("default", "render")


@dataclass(frozen=True)
class Piece:
    """One surface at one place: `world` is a matrix for row vectors, `meet` works in its space."""

    path: str
    world: Array
    meet: Callable[[Array, Array], Hit]
    corners: Array
    facets: bool = False  # whether the importer makes facets of it

    def hit(self, origins: Array, directions: Array) -> Hit:
        """Distances and unit world-space normals of the nearest hits of rays `(n, 3)`."""
        inverse = np.linalg.inv(self.world[:3, :3])
        t, normals = self.meet((origins - self.world[3, :3]) @ inverse, directions @ inverse)
        placed = normals @ inverse.T
        length = np.linalg.norm(placed, axis=1, keepdims=True)
        return t, placed / np.where(length > 0.0, length, 1.0)

    def points(self) -> Array:
        return np.asarray(self.corners @ self.world[:3, :3] + self.world[3, :3])


def pieces(path: Path, time: Any = None, purposes: tuple[str, ...] = DRAWN_PURPOSES) -> list[Piece]:
    """All that a stage shows at a time code (None: the earliest)."""
    from pxr import Usd

    stage = Usd.Stage.Open(str(path))
    code = Usd.TimeCode.EarliestTime() if time is None else Usd.TimeCode(time)
    return list(_Reader(stage, code, purposes).stage_pieces())


class _Reader:
    def __init__(self, stage: Any, code: Any, purposes: tuple[str, ...]) -> None:
        from pxr import Usd, UsdGeom

        self.stage, self.code, self.purposes = stage, code, purposes
        self.cache = UsdGeom.XformCache(code)
        self.in_place = Usd.TraverseInstanceProxies(Usd.PrimDefaultPredicate)
        self.as_prototype = Usd.TraverseInstanceProxies(Usd.PrimIsActive & Usd.PrimIsLoaded)

    def stage_pieces(self) -> Iterator[Piece]:
        from pxr import UsdGeom

        for prim in self._below(self.stage.GetPseudoRoot(), self.in_place):
            imageable = UsdGeom.Imageable(prim)
            if imageable.ComputeVisibility(self.code) == "invisible":
                continue
            purpose = imageable.ComputePurpose()
            world = np.array(self.cache.GetLocalToWorldTransform(prim))
            yield from self._prim(prim, world, purpose, "")

    def _below(self, root: Any, predicate: Any) -> Iterator[Any]:
        """Prims with a surface, and point instancers without what is below them."""
        from pxr import Usd, UsdGeom

        prims = iter(Usd.PrimRange(root, predicate))
        for prim in prims:
            if prim.IsA(UsdGeom.PointInstancer):
                prims.PruneChildren()
                yield prim
            elif prim.IsA(UsdGeom.Gprim):
                yield prim

    def _prim(self, prim: Any, world: Array, purpose: str, suffix: str) -> Iterator[Piece]:
        from pxr import UsdGeom

        if prim.IsA(UsdGeom.PointInstancer):
            yield from self._instancer(UsdGeom.PointInstancer(prim), world, purpose, suffix)
        elif purpose in self.purposes:
            facets = prim.GetTypeName() in ("Cylinder_1", "Capsule_1")
            for meet, corners in surfaces(prim, self.code):
                yield Piece(f"{prim.GetPath()}{suffix}", world, meet, corners, facets)

    def _instancer(
        self, instancer: Any, world: Array, purpose: str, suffix: str
    ) -> Iterator[Piece]:
        from pxr import UsdGeom

        mode = UsdGeom.PointInstancer
        with_root = instancer.ComputeInstanceTransformsAtTime(
            self.code, self.code, mode.IncludeProtoXform, mode.IgnoreMask
        )
        without = instancer.ComputeInstanceTransformsAtTime(
            self.code, self.code, mode.ExcludeProtoXform, mode.IgnoreMask
        )
        numbers = instancer.GetProtoIndicesAttr().Get(self.code)
        mask = instancer.ComputeMaskAtTime(self.code)
        targets = instancer.GetPrototypesRel().GetForwardedTargets()
        for row, number in enumerate(numbers):
            if len(mask) and not mask[row]:
                continue
            root = self.stage.GetPrimAtPath(targets[number])
            at = f"@{instancer.GetPath()}[{row}]{suffix}"
            for prim in self._below(root, self.as_prototype):
                shown, own_purpose = self._state(prim, root, purpose)
                if not shown:
                    continue
                local, reset = self.cache.ComputeRelativeTransform(prim, root)
                placed = np.array(without[row] if reset else with_root[row]) @ world
                yield from self._prim(prim, np.array(local) @ placed, own_purpose, at)

    def _state(self, prim: Any, root: Any, purpose: str) -> tuple[bool, str]:
        """Whether a prim of a prototype is visible in it, and its purpose."""
        from pxr import UsdGeom

        found = None
        while True:
            imageable = UsdGeom.Imageable(prim)
            if imageable:
                if imageable.GetVisibilityAttr().Get(self.code) == "invisible":
                    return False, ""
                if found is None and imageable.GetPurposeAttr().HasAuthoredValue():
                    found = imageable.GetPurposeAttr().Get()
            if prim == root:
                return True, found or purpose
            prim = prim.GetParent()


def surfaces(prim: Any, code: Any) -> Iterator[tuple[Callable[[Array, Array], Hit], Array]]:
    """How rays meet a prim in its own space, and points around it."""

    def value(name: str) -> Any:
        return prim.GetAttribute(name).Get(code)

    kind = prim.GetTypeName()
    if kind == "Mesh":
        points = np.array(value("points") or (), dtype=float)
        faces = _faces(
            points,
            list(value("faceVertexCounts") or ()),
            list(value("faceVertexIndices") or ()),
            set(value("holeIndices") or ()),
        )
        if faces:
            sign = -1.0 if value("orientation") == "leftHanded" else 1.0
            used = np.unique(np.concatenate(faces))
            yield partial(meet_polygons, points, faces, sign), points[used]
    elif kind == "Sphere":
        radius = value("radius")
        yield partial(meet_ball, np.zeros(3), radius), _box(radius, radius, radius)
    elif kind == "Cube":
        half = value("size") / 2.0
        yield partial(meet_box, half), _box(half, half, half)
    elif kind == "Plane":
        axis = value("axis")
        width, length = value("width") / 2.0, value("length") / 2.0
        halves = {"X": (0.0, length, width), "Y": (width, 0.0, length), "Z": (width, length, 0.0)}
        extent = np.array(halves[axis])
        yield partial(meet_rectangle, "XYZ".index(axis), extent), _box(*extent)
    elif kind == "BasisCurves":
        yield from _linear_curve(value)
    elif kind == "Points":
        points = np.array(value("points"), dtype=float).reshape(-1, 3)
        widths = np.broadcast_to(value("widths"), len(points))
        for point, width in zip(points, widths, strict=True):
            around = point + _box(*[width / 2.0] * 3)
            yield partial(meet_ball, point, width / 2.0), around
    elif kind:
        yield _turned(value("axis"), *_solid_of_revolution(kind, value))


def _linear_curve(value: Callable[[str], Any]) -> Iterator[Any]:
    """One open chain of straight segments of one width: tubes with balls at all points."""
    points = np.array(value("points"), dtype=float)
    radius = float(value("widths")[0]) / 2.0
    for point in points:
        yield partial(meet_ball, point, radius), point + _box(radius, radius, radius)
    for start, end in pairwise(points):
        length = float(np.linalg.norm(end - start))
        if length > 0.0:
            yield partial(_meet_tube, start, end, radius), start + _box(radius, radius, radius)


def _meet_tube(start: Array, end: Array, radius: float, origins: Array, directions: Array) -> Hit:
    """A cylinder; its ends are within the balls, and only seen from there."""
    length = float(np.linalg.norm(end - start))
    axis = (end - start) / length
    o = origins - start
    across_o = o - np.outer(o @ axis, axis)
    across_d = directions - np.outer(directions @ axis, axis)
    found = []
    for t in _roots(
        (across_d**2).sum(axis=1),
        (across_o * across_d).sum(axis=1),
        (across_o**2).sum(axis=1) - radius**2,
    ):
        with np.errstate(all="ignore"):
            along = (o + t[:, None] * directions) @ axis
            inside = (along >= 0.0) & (along <= length)
            found.append(_kept(t, inside, across_o + t[:, None] * across_d))
    for end_at, side in ((0.0, -1.0), (length, 1.0)):
        with np.errstate(all="ignore"):
            t = (end_at - o @ axis) / (directions @ axis)
            inside = ((across_o + t[:, None] * across_d) ** 2).sum(axis=1) <= radius**2
        found.append(_kept(t, inside, np.broadcast_to(side * axis, o.shape)))
    return _nearest(found)


def _box(x: float, y: float, z: float) -> Array:
    return np.array([(a, b, c) for a in (-x, x) for b in (-y, y) for c in (-z, z)])


def _solid_of_revolution(kind: str, value: Callable[[str], Any]) -> tuple[float, ...]:
    """Half height, radius at the bottom and at the top, and 1 if both ends are round."""
    height = value("height") / 2.0
    if kind in ("Cylinder_1", "Capsule_1"):
        return height, value("radiusBottom"), value("radiusTop"), float(kind == "Capsule_1")
    radius = value("radius")
    top = 0.0 if kind == "Cone" else radius
    assert kind in ("Cylinder", "Cone", "Capsule"), kind
    return height, radius, top, float(kind == "Capsule")


def _turned(
    axis: str, half: float, bottom: float, top: float, round_ends: float
) -> tuple[Callable[[Array, Array], Hit], Array]:
    order = {"X": [1, 2, 0], "Y": [2, 0, 1], "Z": [0, 1, 2]}[axis]
    back = np.argsort(order)

    def meet(origins: Array, directions: Array) -> Hit:
        t, normals = meet_frustum(
            half, bottom, top, bool(round_ends), origins[:, order], directions[:, order]
        )
        return t, normals[:, back]

    reach = max(bottom, top)
    corners = _box(reach, reach, half + round_ends * reach)
    return meet, corners[:, back]


def _nearest(candidates: list[Hit]) -> Hit:
    t = np.array([found for found, _ in candidates])
    normals = np.array([found for _, found in candidates])
    best = np.argmin(t, axis=0)
    rows = np.arange(t.shape[1])
    return t[best, rows], normals[best, rows]


def _roots(a: Array, b: Array, c: Array) -> tuple[Array, Array]:
    """Solutions of a·t² + 2·b·t + c = 0, NaN where there are none."""
    with np.errstate(all="ignore"):
        root = np.sqrt(b * b - a * c)
        q = -b - np.where(b < 0.0, -1.0, 1.0) * root
        return q / a, c / q


def _kept(t: Array, sound: NDArray[np.bool_], normals: Array) -> Hit:
    with np.errstate(invalid="ignore"):
        return np.where(sound & (t > 0.0), t, np.inf), normals


def meet_ball(center: Array, radius: float, origins: Array, directions: Array) -> Hit:
    o = origins - center
    found = []
    for t in _roots(
        np.einsum("ij,ij->i", directions, directions),
        np.einsum("ij,ij->i", o, directions),
        np.einsum("ij,ij->i", o, o) - radius**2,
    ):
        found.append(_kept(t, np.isfinite(t), o + t[:, None] * directions))
    return _nearest(found)


def meet_box(half: float, origins: Array, directions: Array) -> Hit:
    found = []
    for axis in range(3):
        for side in (-half, half):
            extent = np.full(3, half)
            extent[axis] = 0.0
            shift = np.zeros(3)
            shift[axis] = side
            t, normals = meet_rectangle(axis, extent, origins - shift, directions)
            found.append((t, normals * np.sign(side)))
    return _nearest(found)


def meet_rectangle(axis: int, extent: Array, origins: Array, directions: Array) -> Hit:
    """A rectangle through the origin across an axis, with these half sizes, facing +axis."""
    with np.errstate(all="ignore"):
        t = -origins[:, axis] / directions[:, axis]
        at = origins + t[:, None] * directions
        inside = np.delete(np.abs(at) <= extent, axis, axis=1).all(axis=1)
    normals = np.zeros_like(origins)
    normals[:, axis] = 1.0
    return _kept(t, inside & np.isfinite(t), normals)


def meet_frustum(
    half: float, bottom: float, top: float, round_ends: bool, origins: Array, directions: Array
) -> Hit:
    """About z: a wall from radius `bottom` at -half to `top` at +half, ends flat or half balls."""
    found = []
    if half > 0.0:
        slope, middle = (top - bottom) / (2.0 * half), (top + bottom) / 2.0
        reach, change = middle + slope * origins[:, 2], slope * directions[:, 2]
        for t in _roots(
            (directions[:, :2] ** 2).sum(axis=1) - change**2,
            (origins[:, :2] * directions[:, :2]).sum(axis=1) - reach * change,
            (origins[:, :2] ** 2).sum(axis=1) - reach**2,
        ):
            at = origins + t[:, None] * directions
            normals = at.copy()
            normals[:, 2] = -slope * (middle + slope * at[:, 2])
            with np.errstate(invalid="ignore"):
                found.append(_kept(t, np.abs(at[:, 2]) <= half, normals))
    for side, radius in ((-1.0, bottom), (1.0, top)):
        shift = np.array([0.0, 0.0, side * half])
        o = origins - shift
        if round_ends:
            for t in _roots(
                (directions**2).sum(axis=1),
                (o * directions).sum(axis=1),
                (o**2).sum(axis=1) - radius**2,
            ):
                at = o + t[:, None] * directions
                with np.errstate(invalid="ignore"):
                    found.append(_kept(t, side * at[:, 2] >= 0.0, at))
        else:
            with np.errstate(all="ignore"):
                t = -o[:, 2] / directions[:, 2]
                at = o + t[:, None] * directions
                inside = (at[:, :2] ** 2).sum(axis=1) <= radius**2
            normals = np.zeros_like(o)
            normals[:, 2] = side
            found.append(_kept(t, inside & np.isfinite(t), normals))
    return _nearest(found)


def _faces(
    points: Array, counts: list[int], indices: list[int], holes: set[int]
) -> list[NDArray[np.int64]]:
    """Corners of the faces that can be drawn."""
    faces, start = [], 0
    for number, count in enumerate(counts):
        face = np.array(indices[start : start + count], dtype=np.int64)
        start += max(count, 0)
        sound = len(face) == count >= 3 and ((face >= 0) & (face < len(points))).all()
        if sound and np.isfinite(points[face]).all() and number not in holes:
            faces.append(face)
    return faces


def meet_polygons(
    points: Array, faces: list[NDArray[np.int64]], sign: float, origins: Array, directions: Array
) -> Hit:
    """Plane polygons; `sign` turns their normals over."""
    found = [(np.full(len(origins), np.inf), np.zeros_like(origins))]
    for face in faces:
        corners = points[face]
        local = corners - corners[0]
        normal = np.cross(local, np.roll(local, -1, axis=0)).sum(axis=0)
        with np.errstate(all="ignore"):
            t = (corners[0] - origins) @ normal / (directions @ normal)
        at = origins + np.where(np.isfinite(t), t, 0.0)[:, None] * directions
        keep = np.delete(np.arange(3), np.argmax(np.abs(normal)))
        inside = np.zeros(len(t), bool)
        for a, b in zip(corners[:, keep], np.roll(corners, -1, axis=0)[:, keep], strict=True):
            crosses = (a[1] > at[:, keep[1]]) != (b[1] > at[:, keep[1]])
            with np.errstate(all="ignore"):
                x = a[0] + (at[:, keep[1]] - a[1]) / (b[1] - a[1]) * (b[0] - a[0])
            inside ^= crosses & (at[:, keep[0]] < x)
        found.append(
            _kept(t, inside & np.isfinite(t), np.broadcast_to(sign * normal, origins.shape))
        )
    return _nearest(found)
