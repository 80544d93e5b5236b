"""Plain solids, as convex sets from which convex sets are cut away.

A ring is a cylinder less its bore. A ray meets a convex set in an interval, and an intersection of
slabs, half-spaces, a round wall or a cone in the intersection of their intervals; so what a ray
meets of a solid is a few intervals, and no point is ever tested for lying near an edge.

Rays are o + s u, with o and u `(3, n)` in object space, |u| = 1, and o closest to the solid's
centre.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import reduce

import numpy as np

from dsl.scene import ShapeKind
from runtime.reference.number import Array, Number, dot, finite, ratio


@dataclass(frozen=True, slots=True)
class Interval:
    """The part of each ray in a convex set, near ≤ s ≤ far; empty where near > far.

    The normals `(3, n)` point out of the set.
    """

    near: Array
    far: Array
    near_normal: Array
    far_normal: Array

    def __and__(self, other: Interval) -> Interval:
        """The part in both sets."""
        later, sooner = other.near > self.near, other.far < self.far
        return Interval(
            np.where(later, other.near, self.near),
            np.where(sooner, other.far, self.far),
            np.where(later, other.near_normal, self.near_normal),
            np.where(sooner, other.far_normal, self.far_normal),
        )


def boundary(kept: Interval, cuts: list[Interval]) -> list[tuple[Array, Array]]:
    """All crossings (s, outward normal) of the kept set less the cuts; s is inf where not one."""
    nonempty = kept.near <= kept.far
    crossings = []
    for s, normal in ((kept.near, kept.near_normal), (kept.far, kept.far_normal)):
        cut_away = [(cut.near < s) & (s < cut.far) for cut in cuts]
        crossings.append((nonempty & ~np.any([~nonempty, *cut_away], axis=0), s, normal))
    for i, cut in enumerate(cuts):
        others = [other for j, other in enumerate(cuts) if j != i]
        for s, normal in ((cut.near, cut.near_normal), (cut.far, cut.far_normal)):
            within = (cut.near < cut.far) & (kept.near <= s) & (s <= kept.far)
            cut_away = [(other.near < s) & (s < other.far) for other in others]
            crossings.append((within & ~np.any([~within, *cut_away], axis=0), s, -normal))
    return [(np.where(valid, s, np.inf), normal) for valid, s, normal in crossings]


def plain_solid(
    kind: ShapeKind, parameters: Array, o: Array, u: Array, number: Number
) -> tuple[Interval, list[Interval]]:
    """What a ray o + s u meets of the convex set that a solid is kept from, and of its cuts."""
    match kind:
        case ShapeKind.SPHERE:
            (radius,) = parameters
            return sphere(o, u, radius, number), []
        case ShapeKind.BOX:
            slabs = [slab(o, u, axis, parameters[axis], parameters[axis + 3]) for axis in range(3)]
            return reduce(Interval.__and__, slabs), []
        case ShapeKind.CYLINDER:
            radius, y0, y1, _ = parameters
            return wall(o, u, radius, number) & slab(o, u, 1, y0, y1), []
        case ShapeKind.CONE:
            radius, height, _ = parameters
            return nappe(o, u, radius, height, number) & slab(o, u, 1, 0 * height, height), []
    r0, r1, y0, y1, *rest = parameters
    kept, cuts = wall(o, u, r1, number) & slab(o, u, 1, y0, y1), [wall(o, u, r0, number)]
    if kind is ShapeKind.WEDGE:
        phi0, phi1, _ = rest
        sides = []
        for phi, turn in ((phi0, -1), (phi1, 1)):
            sine, cosine = number.sine_cosine(float(phi))
            sides.append(turn * np.stack([cosine, 0 * cosine, -sine])[:, None])
        if phi1 - phi0 <= 180:
            kept &= half_space(o, u, sides[0]) & half_space(o, u, sides[1])
        else:  # the gap is the convex part
            cuts.append(half_space(o, u, -sides[0]) & half_space(o, u, -sides[1]))
    return kept, cuts


def sphere(o: Array, u: Array, radius: Array, number: Number) -> Interval:
    """|p| ≤ radius; o is the closest point to the centre: half the chord is √(radius² − |o|²)."""
    distance = number.length(o)
    half = number.sqrt((radius - distance) * (radius + distance))
    near, far = (
        np.where(distance <= radius, -half, np.inf),
        np.where(distance <= radius, half, -np.inf),
    )
    return Interval(near, far, (o - half * u) / radius, (o + half * u) / radius)


def slab(o: Array, u: Array, axis: int, low: Array, high: Array) -> Interval:
    """Coordinate `axis` between two values."""
    normal = np.zeros_like(u)
    normal[axis] += np.where(u[axis] < 0, -1, 1)
    first, last = np.where(u[axis] < 0, high, low), np.where(u[axis] < 0, low, high)
    outside = np.where((low <= o[axis]) & (o[axis] <= high), -np.inf, np.inf)
    near = ratio(first - o[axis], u[axis], outside)
    far = ratio(last - o[axis], u[axis], -outside)
    return Interval(near, far, -normal, normal)


def half_space(o: Array, u: Array, normal: Array) -> Interval:
    """All p with p · normal ≤ 0; the normal is `(3, 1)`."""
    height, rate = dot(o, normal), dot(u, normal)
    s = ratio(-height, rate, np.where(height <= 0, np.inf, -np.inf))
    outward = np.broadcast_to(normal, o.shape)
    return Interval(
        np.where(rate < 0, s, np.where((rate == 0) & (height > 0), np.inf, -np.inf)),
        np.where(rate < 0, np.inf, s),
        outward,
        outward,
    )


def wall(o: Array, u: Array, radius: Array, number: Number) -> Interval:
    """ρ ≤ radius: a sphere, seen along the y axis.

    In that view the ray advances by `rate` per unit of s; `middle` of that way it is closest.
    """
    flat_o, flat_u = o * [[1], [0], [1]], u * [[1], [0], [1]]
    rate = number.length(flat_u)
    flat_u = ratio(flat_u, rate, 0)
    middle = -dot(flat_o, flat_u)
    closest = flat_o + middle * flat_u
    distance = number.length(closest)
    half = number.sqrt((radius - distance) * (radius + distance))
    within = distance <= radius
    return Interval(
        np.where(within, ratio(middle - half, rate, -np.inf), np.inf),
        np.where(within, ratio(middle + half, rate, np.inf), -np.inf),
        (closest - half * flat_u) / radius,
        (closest + half * flat_u) / radius,
    )


def nappe(o: Array, u: Array, radius: Array, height: Array, number: Number) -> Interval:
    """The infinite cone down from its apex (0, height, 0), as far as it is convex.

    With k = radius / height and p relative to the apex the double cone is ρ² ≤ k² y², along the ray
    a s² + 2 b s + c ≤ 0. A shallow ray (a > 0) is inside between the roots, both on one nappe, and
    the slab of the solid chooses the lower one. A steep ray (a < 0) is inside beyond the roots,
    which are one on each nappe: going down, it enters the lower nappe at the last of them. The
    roots are c / q and q / a; for a ray parallel to a generator (a = 0) the second is at infinity.
    """
    k = radius / height
    x, y, z = o[0], o[1] - height, o[2]
    level, rate = k * y, k * u[1]
    flat_o, flat_u = number.length(np.stack([x, z])), number.length(np.stack([u[0], u[2]]))
    a = (flat_u - rate) * (flat_u + rate)
    b = x * u[0] + z * u[2] - level * rate
    c = (flat_o - level) * (flat_o + level)
    q = -(b + np.where(b < 0, -1, 1) * number.sqrt(b * b - a * c))
    one, other = ratio(c, q, 0), ratio(q, a, np.where(b > 0, np.inf, -np.inf))
    first, last = np.minimum(one, other), np.maximum(one, other)
    down = u[1] < 0
    shallow, met = a > 0, b * b >= a * c
    near = np.where(shallow, first, np.where(down, last, -np.inf))
    far = np.where(shallow, last, np.where(down, np.inf, first))
    near = np.where(shallow & ~met, np.inf, near)
    far = np.where(shallow & ~met, -np.inf, far)

    def normal(s: Array) -> Array:
        s = np.where(finite(s), s, 0)
        out = np.stack([x + s * u[0], 0 * x, z + s * u[2]])
        rho = number.length(out)
        out = ratio(out, rho, 0)
        out[1] += k
        return out / number.length(out)

    return Interval(near, far, normal(near), normal(far))
