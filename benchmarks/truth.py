"""The first hit of a ray, to 100 digits: what `benchmarks.exactness` judges by.

Nothing here is shared with the kernel or the interpreter. A solid is the opening of its plain form
by a ball of the bevel radius (design: bevel-geometry.md § 1): the points within b of its core.
Candidates are all the roots, in closed form, of the planes, cylinders, cones, spheres and tori that
its patches lie on, without any trims; a candidate is on the surface if its distance from the core,
by the definition, is b to 40 digits.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from benchmarks.exact_roots import (
    Number,
    Point,
    Polynomial,
    along,
    dot,
    double_cone,
    minus,
    mp,
    plane,
    ring_torus,
    roots,
    tube,
)
from dsl.scene import SHAPE_PARAMETERS, Shape, ShapeKind

NOISE = mp.mpf(10) ** -40
"""What counts as zero, in sizes of the shape."""


def to_segment(p: Point, a: Point, b: Point) -> Number:
    """Distance."""
    e, f = minus(b, a), minus(p, a)
    length = dot(e, e)
    s = min(max(dot(e, f) / length, mp.zero), mp.one) if length else mp.zero
    away = along(f, e, -s)
    return mp.sqrt(dot(away, away))


def to_polygon(p: Point, corners: Sequence[Point]) -> Number:
    """Signed distance to a convex polygon, counter-clockwise; of no area: distance."""
    edges = list(zip(corners, [*corners[1:], corners[0]], strict=True))
    inside = all(
        (b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0]) > 0 for a, b in edges
    )
    distance = min(to_segment(p, a, b) for a, b in edges)
    return -distance if inside and len(corners) > 2 else distance


class Solid:
    """A shape in its own space, every parameter taken as the float64 that it is."""

    def __init__(self, shape: Shape) -> None:
        self.kind = shape.kind
        names = SHAPE_PARAMETERS[shape.kind]
        values = zip(names, shape.parameters, strict=True)
        p = {name: mp.mpf(value) for name, value in values}
        self.p, self.bevel = p, p.get("bevel", mp.zero)
        self.flat = shape.kind in (
            ShapeKind.DISC,
            ShapeKind.RECTANGLE,
            ShapeKind.PLANE,
            ShapeKind.TRIANGLE,
        )
        lengths = [abs(v) for name, v in p.items() if not name.startswith("phi")]
        self.size = max(lengths, default=mp.one)
        if shape.kind is ShapeKind.WEDGE:
            self._prepare_wedge()

    def _prepare_wedge(self) -> None:
        p, b = self.p, self.bevel
        turn = mp.pi / 180
        self.start, self.span = p["phi0"] * turn, (p["phi1"] - p["phi0"]) * turn
        self.radii = (p["r0"] + b, p["r1"] - b)
        self.insets = tuple(mp.asin(b / r) for r in self.radii)
        self.alongs = tuple(mp.sqrt(max(r * r - b * b, mp.zero)) for r in self.radii)
        self.ends = tuple(
            ((mp.sin(phi), mp.cos(phi)), sign)
            for phi, sign in ((self.start, 1), (self.start + self.span, -1))
        )

    def surfaces(self, o: Point, d: Point) -> list[Polynomial]:
        """Of all patches, with what they lie on taken whole."""
        p, b = self.p, self.bevel
        y = (0, mp.one, 0)
        match self.kind:
            case ShapeKind.SPHERE:
                return [tube(o, d, (0, 0, 0), None, p["radius"])]
            case ShapeKind.BOX:
                return self._box_surfaces(o, d)
            case ShapeKind.CONE:
                r, h = p["radius"], p["height"]
                found = [plane(o, d, y, mp.zero), double_cone(o, d, h, r / h)]
                if b:
                    _, (rim, base), (_, apex) = self._cone_core()
                    found.append(tube(o, d, (0, apex, 0), None, b))
                    found.append(self._rim(o, d, base, rim))
                return found
            case ShapeKind.TORUS:
                return [ring_torus(o, d, mp.zero, p["major"], p["minor"])]
            case ShapeKind.TRIANGLE:
                normal, a = self.triangle_normal()
                return [plane(o, d, normal, dot(normal, a))]
            case ShapeKind.DISC | ShapeKind.RECTANGLE | ShapeKind.PLANE:
                return [plane(o, d, y, mp.zero)]
        # Cylinder, ring, wedge: extruded.
        walls = [p[name] for name in ("radius", "r0", "r1") if name in p]
        cores = [
            r + b if name == "r0" else r - b
            for name, r in p.items()
            if r in walls and name[0] == "r"
        ]
        found = [plane(o, d, y, p[name]) for name in ("y0", "y1")]
        found += [tube(o, d, (0, 0, 0), y, r) for r in walls]
        levels = (p["y0"] + b, p["y1"] - b)
        if b:
            found += [self._rim(o, d, level, core) for level in levels for core in cores]
        if self.kind is ShapeKind.WEDGE:
            for (sin, cos), sign in self.ends:
                found.append(plane(o, d, (cos, 0, -sin), mp.zero))
                corners = [
                    (s * sin + sign * b * cos, s * cos - sign * b * sin) for s in self.alongs
                ]
                if b:
                    found += [tube(o, d, (u, 0, w), y, b) for u, w in corners]
                    found += [tube(o, d, (u, h, w), None, b) for u, w in corners for h in levels]
                    (u, w), _ = corners
                    found += [tube(o, d, (u, h, w), (sin, 0, cos), b) for h in levels]
        return found

    def _rim(self, o: Point, d: Point, level: Number, major: Number) -> Polynomial:
        if not major:
            return tube(o, d, (0, level, 0), None, self.bevel)
        return ring_torus(o, d, level, major, self.bevel)

    def _box_surfaces(self, o: Point, d: Point) -> list[Polynomial]:
        b = self.bevel
        low, high = self._box()
        axes = [[mp.one if i == j else mp.zero for i in range(3)] for j in range(3)]
        found = [plane(o, d, axes[i], end[i]) for i in range(3) for end in (low, high)]
        if b:
            inner = [(low[i] + b, high[i] - b) for i in range(3)]
            for i in range(3):
                j, k = (i + 1) % 3, (i + 2) % 3
                for u in inner[j]:
                    for w in inner[k]:
                        center = [mp.zero] * 3
                        center[j], center[k] = u, w
                        found.append(tube(o, d, center, axes[i], b))
            found += [
                tube(o, d, (u, v, w), None, b) for u in inner[0] for v in inner[1] for w in inner[2]
            ]
        return found

    def _box(self) -> tuple[list[Number], list[Number]]:
        p = self.p
        return [p["x0"], p["y0"], p["z0"]], [p["x1"], p["y1"], p["z1"]]

    def _cone_core(self) -> list[tuple[Number, Number]]:
        r, h, b = self.p["radius"], self.p["height"], self.bevel
        side = mp.sqrt(r * r + h * h)
        rim = max(r - b * (side + r) / h, mp.zero)
        return [(-rim, b), (rim, b), (mp.zero, h - b * side / r)]

    def triangle_normal(self) -> tuple[list[Number], list[Number]]:
        """(b - a) × (c - a), not of unit length, and a."""
        a, b, c = self._triangle()
        e, f = minus(b, a), minus(c, a)
        normal = [e[i - 2] * f[i - 1] - e[i - 1] * f[i - 2] for i in range(3)]
        return normal, a

    def normal_length(self) -> Number:
        """Of the normal that a flat shape's plane is written with."""
        if self.kind is not ShapeKind.TRIANGLE:
            return mp.one
        normal, _ = self.triangle_normal()
        return mp.sqrt(dot(normal, normal))

    def _triangle(self) -> list[list[Number]]:
        values = list(self.p.values())
        return [values[i : i + 3] for i in (0, 3, 6)]

    def distance(self, point: Point) -> Number:
        """From the surface, negative inside; exact outside and in the skin. Flat: to the rim."""
        (x, y, z), p, b = point, self.p, self.bevel
        rho = mp.sqrt(x * x + z * z)
        match self.kind:
            case ShapeKind.SPHERE:
                return mp.sqrt(dot(point, point)) - p["radius"]
            case ShapeKind.BOX:
                low, high = self._box()
                w = [max(low[i] + b - point[i], point[i] - high[i] + b) for i in range(3)]
                return self._extruded(w) - b
            case ShapeKind.CONE:
                return to_polygon((rho, y), self._cone_core()) - b
            case ShapeKind.TORUS:
                return mp.sqrt((rho - p["major"]) ** 2 + y * y) - p["minor"]
            case ShapeKind.CYLINDER:
                planar = rho - (p["radius"] - b)
            case ShapeKind.RING:
                planar = max(p["r0"] + b - rho, rho - (p["r1"] - b))
            case ShapeKind.WEDGE:
                planar = self._sector_distance(x, z, rho)
            case ShapeKind.DISC:
                return rho - p["radius"]
            case ShapeKind.RECTANGLE:
                return max(abs(x) - p["size_x"] / 2, abs(z) - p["size_z"] / 2)
            case ShapeKind.TRIANGLE:
                return self._triangle_distance(point)
            case _:
                return -self.size
        return self._extruded([planar, max(p["y0"] + b - y, y - p["y1"] + b)]) - b

    @staticmethod
    def _extruded(w: Sequence[Number]) -> Number:
        outside = [max(x, mp.zero) for x in w]
        return min(max(w), mp.zero) + mp.sqrt(dot(outside, outside))

    def _sector_distance(self, x: Number, z: Number, rho: Number) -> Number:
        phi = mp.atan2(x, z) - self.start
        phi -= 2 * mp.pi * mp.floor(phi / (2 * mp.pi))
        inner, outer = self.radii
        found = [
            abs(rho - r)
            for r, inset in zip(self.radii, self.insets, strict=True)
            if inset <= phi <= self.span - inset
        ]
        s1, s2 = self.alongs
        deep = []
        for (sin, cos), sign in self.ends:
            a, q = x * sin + z * cos, sign * (x * cos - z * sin)
            found.append(to_segment((a, q), (s1, self.bevel), (s2, self.bevel)))
            deep.append((a, q))
        inside = inner < rho < outer and (
            mp.asin(min(self.bevel / rho, mp.one)) < phi
            and phi < self.span - mp.asin(min(self.bevel / rho, mp.one))
        )
        return -min(found) if inside else min(found)

    def _triangle_distance(self, point: Point) -> Number:
        normal, _ = self.triangle_normal()
        corners = self._triangle()
        signed = []
        for a, b in zip(corners, [*corners[1:], corners[0]], strict=True):
            e, f = minus(b, a), minus(point, a)
            cross = [e[i - 2] * f[i - 1] - e[i - 1] * f[i - 2] for i in range(3)]
            scale = mp.sqrt(dot(normal, normal) * dot(e, e))
            signed.append(-dot(cross, normal) / scale)
        return max(signed)

    def normal(self, point: Point) -> list[Number]:
        """Unit outward normal at a point of the surface."""
        if self.kind is ShapeKind.TRIANGLE:
            gradient, _ = self.triangle_normal()
        elif self.flat:
            gradient = [mp.zero, mp.one, mp.zero]
        else:
            step = self.size * mp.mpf(10) ** -45
            gradient = []
            for i in range(3):
                ends = []
                for sign in (1, -1):
                    moved = list(point)
                    moved[i] += sign * step
                    ends.append(self.distance(moved))
                gradient.append(ends[0] - ends[1])
        length = mp.sqrt(dot(gradient, gradient))
        return [x / length for x in gradient]


@dataclass(frozen=True, slots=True)
class Hit:
    """The first hit of a solid.

    `clearance` is how far the surface or the ray must move before another surface is hit, or none,
    and `where` is the t of that; t is None for a miss.
    """

    t: Number
    clearance: Number
    where: Number


def first_hit(solid: Solid, o: Point, d: Point) -> Hit:
    """The first t > 0, object space."""
    if solid.flat:
        return _first_hit_of_flat(solid, o, d)
    length = mp.sqrt(dot(d, d))
    # Near the shape, and in its own size, closed forms have all their digits.
    slide = -dot(o, d) / dot(d, d)
    near = along(o, d, slide)
    crossings: list[Number] = []
    events: list[Number] = []
    for polynomial in solid.surfaces(near, d):
        real, parts = roots(polynomial)
        crossings += real
        events += real + parts
    crossings = sorted(t for t in crossings if t + slide > 0)
    noise = solid.size * NOISE

    def height(t: Number) -> Number:
        return abs(solid.distance(along(near, d, t)))

    hit = next((t for t in crossings if height(t) < noise), None)
    clearance, where = mp.inf, mp.zero
    if hit is not None:
        exits = [t for t in crossings if t > hit and height(t) < noise]
        if exits:
            where = (hit + exits[0]) / 2
            clearance = height(where)
    facing = abs(dot(solid.normal(along(near, d, hit)), d)) / length if hit is not None else 1
    end = mp.inf if hit is None else hit
    for t in [*events, -slide]:
        if -slide <= t < end:
            distance = height(t)
            # The same crossing by a neighbour that is tangent there.
            if hit is not None and (hit - t) * length * facing < 4 * distance:
                continue
            if distance < clearance:
                clearance, where = distance, t
    return Hit(None if hit is None else hit + slide, clearance, where + slide)


def _first_hit_of_flat(solid: Solid, o: Point, d: Point) -> Hit:
    rate, height = solid.surfaces(o, d)[0]
    above = abs(height) / solid.normal_length()
    if not rate:
        return Hit(None, above, mp.zero)
    t = -height / rate
    beyond = solid.distance(along(o, d, t))
    if t <= 0:
        return Hit(None, max(above, beyond), mp.zero)
    return Hit(t if beyond <= 0 else None, abs(beyond), t)
