"""Bevelled solids and the torus, by their signed distance.

A solid bevelled by b is its opening by a ball of radius b: every point within b of the *core*, the
set of the centres of all balls of that radius which fit into the solid. So its signed distance is
that of the core minus b, and the distance to a core of intervals, arcs and segments is elementary.
The torus is the same thing: its core is a circle, b its minor radius.

A *distance* is a pair (f, g): f `(n,)`, negative inside, and its gradient g `(k, n)`, of length 1
and on the surface the outward normal. It is exact everywhere, so that |f| is how far one may go in
any direction without meeting the surface: what `march` lives on.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from dsl.scene import ShapeKind
from runtime.reference.number import Array, Number, ratio

Distance = tuple[Array, Array]
Field = Callable[[Array], Distance]
"""Points `(k, n)` to distances: in object space k = 3, in a meridian half-plane (ρ, y) k = 2."""


@dataclass(frozen=True, slots=True)
class RoundedSolid:
    """A solid as its signed distance, and what a march along a ray may rely on.

    Closer to the surface than the *reach* of a side, the nearest point of the surface is unique.
    Inside it is the radius of the ball, which rolls along the whole surface; outside it is that of
    the bore, or half the gap of a wedge, and infinite for a convex solid.
    """

    field: Field
    reach_inside: float
    reach_outside: float

    @property
    def convex(self) -> bool:
        """Whether the solid is convex."""
        return self.reach_outside == np.inf


def rounded_solid(kind: ShapeKind, parameters: Array, number: Number) -> RoundedSolid | None:
    """The solid that a bevelled shape or a torus is; None for every other shape."""
    if kind is ShapeKind.TORUS:
        major, minor = parameters
        centre = np.array([major, 0 * major])
        field = rounded(revolved(lambda q: segment(q, centre, centre, number), number), minor)
        return RoundedSolid(field, float(minor), float(major - minor))
    if kind not in CORES or parameters[-1] == 0:
        return None
    bevel = parameters[-1]
    field = rounded(CORES[kind](parameters, number), bevel)
    return RoundedSolid(field, float(bevel), reach_outside(kind, parameters))


def reach_outside(kind: ShapeKind, parameters: Array) -> float:
    """The reach outside of a bevelled solid."""
    if kind not in (ShapeKind.RING, ShapeKind.WEDGE):
        return np.inf
    bore = float(parameters[0])
    if kind is ShapeKind.WEDGE:
        gap = 360.0 - float(parameters[5] - parameters[4])
        return bore * float(np.sin(np.radians(min(gap, 180.0) / 2)))
    return bore


# The cores: each solid inset by its bevel b.


def box_core(parameters: Array, number: Number) -> Field:
    """Three intervals."""
    low, high, b = parameters[:3], parameters[3:6], parameters[6]
    axes = list(zip(low + b, high - b, strict=True))
    return lambda p: product([interval(x, *ends) for x, ends in zip(p, axes, strict=True)], number)


def cylinder_core(parameters: Array, number: Number) -> Field:
    """ρ ≤ R times an interval of y, revolved; ρ runs to both sides of the axis."""
    r, y0, y1, b = parameters
    return revolved(
        lambda q: product([interval(q[0], b - r, r - b), interval(q[1], y0 + b, y1 - b)], number),
        number,
    )


def ring_core(parameters: Array, number: Number) -> Field:
    """An interval of ρ times an interval of y, revolved."""
    r0, r1, y0, y1, b = parameters
    return revolved(
        lambda q: product([interval(q[0], r0 + b, r1 - b), interval(q[1], y0 + b, y1 - b)], number),
        number,
    )


def cone_core(parameters: Array, number: Number) -> Field:
    """The similar cone whose base and side lie b deeper: a triangle of (ρ, y), revolved."""
    r, h, b = parameters
    slant = number.sqrt(r * r + h * h)
    centre = np.array([0 * b, b])
    rim = np.array([np.maximum(r - b * (r + slant) / h, 0), b])
    apex = np.array([0 * b, np.maximum(h - b * slant / r, b)])
    down, out = number.array([[0], [-1]]), np.array([[h], [r]]) / slant

    def profile(q: Array) -> Distance:
        base, side = b - q[1], ((q - apex[:, None]) * out).sum(axis=0)
        f, g = nearest([segment(q, centre, rim, number), segment(q, rim, apex, number)])
        inside = (base <= 0) & (side <= 0)
        return (
            np.where(inside, np.maximum(base, side), f),
            np.where(inside, np.where(base > side, down, out), g),
        )

    return revolved(profile, number)


def wedge_core(parameters: Array, number: Number) -> Field:
    """A sector of the plane times an interval of y."""
    _, _, y0, y1, _, _, b = parameters
    sector = sector_core(parameters, number)

    def field(p: Array) -> Distance:
        f, g = product([sector(p[[0, 2]]), interval(p[1], y0 + b, y1 - b)], number)
        return f, g[[0, 2, 1]]

    return field


def sector_core(parameters: Array, number: Number) -> Field:
    """The annular sector r0 ≤ ρ ≤ r1, φ0 ≤ φ ≤ φ1 of the plane (x, z), inset by b.

    It is bounded by arcs of radii r0 + b and r1 − b, and by segments parallel to the sides at the
    distance b. With u the direction of a side and v its inward normal, the segment spans from
    s1 u + b v to s2 u + b v, where s² + b² is the squared radius of either arc.
    """
    r0, r1, _, _, phi0, phi1, b = parameters
    arcs = (
        (r0 + b, number.sqrt(r0 * (r0 + 2 * b))),
        (r1 - b, number.sqrt(r1 * (r1 - 2 * b))),
    )
    sides = []
    for phi, turn in ((phi0, 1), (phi1, -1)):
        sine, cosine = number.sine_cosine(float(phi))
        sides.append((np.array([sine, cosine]), turn * np.array([cosine, -sine])))
    opening = float(phi1) - float(phi0)

    def faces(q: Array, radius: Array, s: Array) -> Array:
        """Whether q has an azimuth of the arc: between its two ends s u + b v."""
        left = opening - 2 * float(np.degrees(np.arctan2(float(b), float(s))))
        if left <= 1e-12 * opening:  # at the limit of the bevel the inner wall has no width
            return np.zeros(q.shape[1], bool)
        ahead = [((s * v - b * u)[:, None] * q).sum(axis=0) >= 0 for u, v in sides]
        between: Array = ahead[0] & ahead[1] if left <= 180 else ahead[0] | ahead[1]
        return between

    def contains(q: Array, rho: Array) -> Array:
        """Whether q is between the arcs, and b or more inward from both sides."""
        deep = [(v[:, None] * q).sum(axis=0) >= b for _, v in sides]
        behind = [(u[:, None] * q).sum(axis=0) <= 0 for u, _ in sides]
        between: Array = deep[0] & deep[1]
        if opening > 180:
            between = deep[0] | deep[1] | (behind[0] & behind[1])
        inset: Array = between & (rho >= arcs[0][0]) & (rho <= arcs[1][0])
        return inset

    def field(q: Array) -> Distance:
        rho = number.length(q)
        radial = ratio(q, rho, 0)
        boundary = [
            segment(q, arcs[0][1] * u + b * v, arcs[1][1] * u + b * v, number) for u, v in sides
        ]
        for radius, s in arcs:
            f = np.where(faces(q, radius, s), np.abs(rho - radius), np.inf)
            boundary.append((f, np.where(rho < radius, -radial, radial)))
        f, g = nearest(boundary)
        sign = np.where(contains(q, rho), -1, 1)
        return sign * f, sign * g

    return field


CORES: dict[ShapeKind, Callable[[Array, Number], Field]] = {
    ShapeKind.BOX: box_core,
    ShapeKind.CYLINDER: cylinder_core,
    ShapeKind.CONE: cone_core,
    ShapeKind.RING: ring_core,
    ShapeKind.WEDGE: wedge_core,
}


# Distances made of distances.


def interval(x: Array, low: Array, high: Array) -> Distance:
    """The distance of coordinates `(n,)` to an interval; its gradient is `(1, n)`."""
    offset = x - (low + high) / 2
    return np.abs(offset) - (high - low) / 2, np.where(offset < 0, -1, 1)[None]


def product(factors: Sequence[Distance], number: Number) -> Distance:
    """The distance to a product of sets, each in coordinates of its own."""
    inmost = np.argmax(np.stack([f for f, _ in factors]), axis=0)
    depth = np.max(np.stack([f for f, _ in factors]), axis=0)
    away = np.concatenate([np.maximum(f, 0) * g for f, g in factors])
    face = np.concatenate([(inmost == i) * g for i, (_, g) in enumerate(factors)])
    length = number.length(away)
    outside = length > 0
    return np.where(outside, length, depth), np.where(outside, ratio(away, length, 0), face)


def revolved(profile: Field, number: Number) -> Field:
    """A meridian profile in (ρ, y), turned about the y axis."""

    def field(p: Array) -> Distance:
        rho = number.length(p[[0, 2]])
        f, g = profile(np.stack([rho, p[1]]))
        x, z = ratio(p[[0, 2]], rho, 0)
        return f, np.stack([g[0] * x, g[1], g[0] * z])

    return field


def rounded(core: Field, radius: Array) -> Field:
    """All points within a radius of the core."""

    def field(p: Array) -> Distance:
        f, g = core(p)
        return f - radius, g

    return field


def segment(q: Array, a: Array, b: Array, number: Number) -> Distance:
    """The distance of points `(2, n)` to the segment from a to b."""
    along = b - a
    squared = (along * along).sum()
    offset = q - a[:, None]
    if squared > 0:
        share = (offset * along[:, None]).sum(axis=0) / squared
        offset = offset - np.clip(share, 0, 1) * along[:, None]
    f = number.length(offset)
    return f, ratio(offset, f, 0)


def nearest(distances: Sequence[Distance]) -> Distance:
    """The distance to a union."""
    f, g = distances[0]
    for other, gradient in distances[1:]:
        g = np.where(other < f, gradient, g)
        f = np.minimum(f, other)
    return f, g
