"""Solids as polygons, for programs that do not know them.

Every point is on the exact surface; arcs are cut so that no chord leaves it by more than a
tolerance. Bevels are made as they are defined: the core of the solid, swept by a ball
(`dsl/reference/bevels.md`).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from dsl.scene import SHAPE_PARAMETERS, FloatArray, IntArray, ShapeKind

PLANE_REACH = 10_000.0
"""Half the side of the square that stands for an infinite plane."""

_MOST = 256
"""Chords of a full circle at most."""

_Faces = list[tuple[int, ...]]


@dataclass(frozen=True, slots=True, eq=False)
class Polygons:
    """A polygon mesh: points `(v, 3)`, the corners of each face, and all faces' corners."""

    points: FloatArray
    counts: IntArray
    corners: IntArray


def polygons(kind: ShapeKind, parameters: tuple[float, ...], tolerance: float) -> Polygons:
    """The solid in polygons whose normals point outwards.

    `tolerance` is the greatest distance of a chord from the surface, in parts of the solid's
    diameter. Raises KeyError for kinds that USD has prims for.
    """
    p = dict(zip(SHAPE_PARAMETERS[kind], parameters, strict=True))
    cut = _Cut(tolerance * _diameter(p))
    match kind:
        case ShapeKind.BOX:
            points, faces = _box(p, cut)
        case ShapeKind.WEDGE:
            points, faces = _wedge(p, cut)
        case ShapeKind.DISC:
            angles = cut.arc(0.0, 360.0, p["radius"])[:-1]
            points, faces = _turned(p["radius"], 0.0, angles), [tuple(range(len(angles)))]
        case ShapeKind.PLANE:
            reach = PLANE_REACH
            points = np.array([(-1.0, 0, -1), (-1, 0, 1), (1, 0, 1), (1, 0, -1)]) * reach
            faces = [(0, 1, 2, 3)]
        case ShapeKind.TRIANGLE:
            points, faces = np.array(parameters).reshape(3, 3), [(0, 1, 2)]
        case _:
            points, faces = _revolved(kind, p, cut)
    return _finished(points, faces)


@dataclass(frozen=True, slots=True)
class _Cut:
    """How arcs are cut into chords that stay within a distance."""

    distance: float

    def arc(self, start: float, end: float, radius: float) -> FloatArray:
        """Angles in degrees from start to end."""
        ratio = min(self.distance / radius, 1.0) if radius > 0.0 else 1.0
        chord = max(2.0 * math.degrees(math.acos(1.0 - ratio)), 360.0 / _MOST)
        return np.linspace(start, end, 1 + max(math.ceil((end - start) / min(chord, 90.0)), 1))


def _diameter(p: dict[str, float]) -> float:
    """The largest extent of a solid that has arcs: of a wedge, along its middle or across it."""
    radius = p.get("radius", p.get("r1", p.get("major", 0.0) + p.get("minor", 0.0)))
    half = math.radians(min(p.get("phi1", 360.0) - p.get("phi0", 0.0), 180.0) / 2.0)
    along, across = radius - p.get("r0", 0.0) * math.cos(half), 2.0 * radius * math.sin(half)
    sides = [p[f"{axis}1"] - p[f"{axis}0"] for axis in "xyz" if f"{axis}1" in p]
    return max(along, across, p.get("height", 0.0), *sides, 0.0)


def _round(degrees: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Cosine and sine; exact at multiples of 90 degrees, so that what meets there is one point."""
    radians = np.radians(degrees)
    cosine, sine = np.cos(radians), np.sin(radians)
    cosine[np.mod(degrees, 180.0) == 90.0] = 0.0
    sine[np.mod(degrees, 180.0) == 0.0] = 0.0
    return cosine, sine


def _turned(rho: float | FloatArray, y: float | FloatArray, azimuth: FloatArray) -> FloatArray:
    """Points at an azimuth from +z towards +x."""
    cosine, sine = _round(azimuth)
    return np.stack(np.broadcast_arrays(rho * sine, y, rho * cosine), axis=-1).reshape(-1, 3)


# Solids of revolution: a profile in (distance from the axis, height), turned.


def _revolved(kind: ShapeKind, p: dict[str, float], cut: _Cut) -> tuple[FloatArray, _Faces]:
    b = p.get("bevel", 0.0)
    match kind:
        case ShapeKind.CYLINDER:
            r, low, high = p["radius"] - b, p["y0"] + b, p["y1"] - b
            arcs = [(r, low, -90.0, 0.0), (r, high, 0.0, 90.0)]
            profile = _rounded(arcs, b, cut)
            profile = np.concatenate(([(0, p["y0"])], profile, [(0, p["y1"])]))
        case ShapeKind.CONE:
            profile = _cone(p["radius"], p["height"], b, cut)
        case ShapeKind.TORUS:
            profile = _rounded([(p["major"], 0.0, 0.0, 360.0)], p["minor"], cut)[:-1]
        case ShapeKind.RING:
            near, far, low, high = p["r0"] + b, p["r1"] - b, p["y0"] + b, p["y1"] - b
            arcs = [(far, low, -90.0, 0.0), (far, high, 0.0, 90.0)]
            arcs += [(near, high, 90.0, 180.0), (near, low, 180.0, 270.0)]
            profile = _rounded(arcs, b, cut)
        case _:
            raise KeyError(kind)
    azimuths = cut.arc(0.0, 360.0, float(profile[:, 0].max()))[:-1]
    points = np.concatenate([_turned(rho, y, azimuths) for rho, y in profile])
    closed = kind in (ShapeKind.TORUS, ShapeKind.RING)
    return points, _strips(len(profile), len(azimuths), closed)


def _rounded(arcs: list[tuple[float, float, float, float]], radius: float, cut: _Cut) -> FloatArray:
    """Points of arcs, each of a centre (x, y) and two angles; `(n, 2)`."""
    points = []
    for x, y, start, end in arcs:
        cosine, sine = _round(cut.arc(start, end, radius) if radius else np.zeros(1))
        points.append(np.stack((x + radius * cosine, y + radius * sine), axis=1))
    return np.concatenate(points)


def _cone(radius: float, height: float, b: float, cut: _Cut) -> FloatArray:
    if b == 0.0:
        return np.array([(0.0, 0.0), (radius, 0.0), (0.0, height)])
    slant = math.hypot(height, radius)
    sine, cosine = radius / slant, height / slant
    lean = math.degrees(math.asin(sine))
    rim = max(radius - b * (1.0 + sine) / cosine, 0.0)
    tip = max(height - b / sine, b)
    arcs = _rounded([(rim, b, -90.0, lean), (0.0, tip, lean, 90.0)], b, cut)
    return np.concatenate(([(0.0, 0.0)], arcs))


def _strips(rows: int, columns: int, closed: bool) -> _Faces:
    """Quadrilaterals between rows of points; columns run around, closed rows too."""
    faces: _Faces = []
    for row in range(rows if closed else rows - 1):
        below, above = row * columns, (row + 1) % rows * columns
        for column in range(columns):
            after = (column + 1) % columns
            faces.append((below + column, below + after, above + after, above + column))
    return faces


# Prisms: the outline of the core in the plane y = 0, with the normals of a ball on it.


@dataclass(slots=True)
class _Outline:
    """Core points `(x, z)` with unit normals, in order around the core."""

    core: list[tuple[float, float]]
    normals: list[tuple[float, float]]

    def fan(self, point: tuple[float, float], angles: FloatArray) -> None:
        """A corner: one point with normals at azimuths."""
        for cosine, sine in zip(*_round(angles), strict=True):
            self.core.append(point)
            self.normals.append((sine, cosine))

    def arc(self, radius: float, angles: FloatArray, inner: bool) -> None:
        """Points at azimuths, with normals from the axis, or towards it."""
        sign = -1.0 if inner else 1.0
        for cosine, sine in zip(*_round(angles), strict=True):
            self.core.append((radius * sine, radius * cosine))
            self.normals.append((sign * sine, sign * cosine))


def _prism(
    outline: _Outline, low: float, high: float, b: float, caps: _Faces, cut: _Cut
) -> tuple[FloatArray, _Faces]:
    """Sweep an outline by a ball between two heights; caps are faces of outline points."""
    core, normals = np.array(outline.core), np.array(outline.normals)
    rows = _rounded([(0.0, low + b, -90.0, 0.0), (0.0, high - b, 0.0, 90.0)], b, cut)
    if b == 0.0:
        rows = np.array([(0.0, low), (0.0, high)])
    layers = [core + out * normals for out, _ in rows]
    points = np.concatenate(
        [np.insert(xz, 1, y, axis=1) for xz, (_, y) in zip(layers, rows, strict=True)]
    )
    last = (len(rows) - 1) * len(core)
    faces = _strips(len(rows), len(core), closed=False)
    faces += [tuple(reversed(cap)) for cap in caps]
    faces += [tuple(last + corner for corner in cap) for cap in caps]
    return points, faces


def _box(p: dict[str, float], cut: _Cut) -> tuple[FloatArray, _Faces]:
    b = p["bevel"]
    (x0, x1), (z0, z1) = ((p[f"{axis}0"] + b, p[f"{axis}1"] - b) for axis in "xz")
    outline, corners = _Outline([], []), []
    for x, z, start in ((x1, z1, 0.0), (x1, z0, 90.0), (x0, z0, 180.0), (x0, z1, 270.0)):
        corners.append(len(outline.core))
        outline.fan((x, z), cut.arc(start, start + 90.0, b) if b else np.array([start]))
    return _prism(outline, p["y0"], p["y1"], b, [tuple(corners)], cut)


def _wedge(p: dict[str, float], cut: _Cut) -> tuple[FloatArray, _Faces]:
    b, near, far = p["bevel"], p["r0"] + p["bevel"], p["r1"] - p["bevel"]
    start, end = p["phi0"], p["phi1"]
    # The sides of the core are parallel to those of the wedge: its azimuths depend on the radius.
    alpha, beta = (math.degrees(math.asin(min(b / r, 1.0))) for r in (near, far))
    outer = cut.arc(start + beta, end - beta, p["r1"])
    inner = np.linspace(end - alpha, start + alpha, len(outer))
    outline = _Outline([], [])
    outline.arc(far, outer, inner=False)
    if b:
        outline.fan(outline.core[-1], cut.arc(end - beta, end + 90.0, b)[1:])
    first = len(outline.core)
    inner_point = _turned(near, 0.0, inner[:1])[0]
    if b:
        outline.fan(
            (inner_point[0], inner_point[2]), cut.arc(end + 90.0, end - alpha + 180.0, b)[:-1]
        )
        first = len(outline.core)
    outline.arc(near, inner, inner=True)
    if b:
        outline.fan(outline.core[-1], cut.arc(start + alpha + 180.0, start + 270.0, b)[1:])
        outline.fan(outline.core[0], cut.arc(start + 270.0, start + beta + 360.0, b)[:-1])
    caps: _Faces = [
        (i, i + 1, first + len(inner) - 2 - i, first + len(inner) - 1 - i)
        for i in range(len(outer) - 1)
    ]
    return _prism(outline, p["y0"], p["y1"], b, caps, cut)


def _finished(points: FloatArray, faces: _Faces) -> Polygons:
    """Merge equal points, drop what has no area then, and turn closed solids outside out."""
    merged, index = np.unique(points + 0.0, axis=0, return_inverse=True)
    index = index.reshape(-1)
    kept = []
    for face in faces:
        corners = [int(index[corner]) for corner in face]
        corners = [c for k, c in enumerate(corners) if c != corners[k - 1]]
        if len(corners) >= 3 and len(set(corners)) == len(corners):
            kept.append(corners)
    if _volume(merged, kept) < 0.0:
        kept = [corners[::-1] for corners in kept]
    counts = np.array([len(corners) for corners in kept], dtype=np.int64)
    return Polygons(merged, counts, np.array([c for face in kept for c in face], dtype=np.int64))


def _volume(points: FloatArray, faces: list[list[int]]) -> float:
    """Six times the volume inside; surfaces without an inside count as right."""
    if len(faces) < 4:
        return 0.0
    fans = np.array([(f[0], a, b) for f in faces for a, b in pairwise(f[1:])])
    a, b, c = (points[fans[:, k]] - points[0] for k in range(3))
    return float(np.einsum("ij,ij->i", a, np.cross(b, c)).sum())
