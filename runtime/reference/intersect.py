"""Where a ray meets an untransformed shape: steps 2 and 3 of the seed.

Before anything else the origin of a ray slides along it to the point closest to the centre of the
shape, and its direction becomes a unit vector: the formulas then meet numbers of the size of the
shape only, however far the ray comes from. s is the distance from there; t = (s + slide) / |d|.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from dsl.scene import Mesh, Shape, ShapeKind
from runtime.reference.march import first_crossing
from runtime.reference.number import Array, Number, cross, dot, finite, ratio
from runtime.reference.plain_solid import boundary, plain_solid
from runtime.reference.signed_distance import rounded_solid

TRIANGLES_AT_ONCE = 256


@dataclass(frozen=True, slots=True)
class Rays:
    """Rays of any space: `origin`, `direction` `(3, n)`; `t_min`, `t_max` `(n,)`, exclusive."""

    origin: Array
    direction: Array
    t_min: Array
    t_max: Array

    def at(self, t: Array) -> Array:
        """The points at the parameters t, `(3, n)`."""
        points: Array = self.origin + np.where(finite(t), t, 0) * self.direction
        return points


@dataclass(frozen=True, slots=True)
class Meeting:
    """The first meeting of each ray with a shape: t `(n,)`, inf where there is none.

    `point` and `normal`, `(3, n)`, mean nothing there.
    """

    t: Array
    point: Array
    normal: Array


def intersect(shape: Shape | Mesh, rays: Rays, number: Number) -> Meeting:
    """Meet rays `(3, n)` with a shape, all in the shape's own space."""
    with np.errstate(all="ignore"):
        if isinstance(shape, Mesh):
            corners = number.array(shape.points[shape.triangles].transpose(1, 2, 0))
            return meet_triangles(corners, rays, number)
        parameters = number.array(shape.parameters)
        match shape.kind:
            case ShapeKind.TRIANGLE:
                return meet_triangles(parameters.reshape(3, 3, 1), rays, number)
            case ShapeKind.PLANE:
                return meet_flat(rays, lambda x, z: x == x)
            case ShapeKind.DISC:
                (radius,) = parameters
                return meet_flat(rays, lambda x, z: number.length(np.stack([x, z])) <= radius)
            case ShapeKind.RECTANGLE:
                half_x, half_z = parameters / 2
                return meet_flat(rays, lambda x, z: (np.abs(x) <= half_x) & (np.abs(z) <= half_z))
        return meet_solid(shape.kind, parameters, rays, number)


def meet_flat(rays: Rays, within: Callable[[Array, Array], Array]) -> Meeting:
    """Meet a part of the plane y = 0, where the coordinates x and z `(n,)` are `within`."""
    t = ratio(-rays.origin[1], rays.direction[1], np.inf)
    point = rays.at(t)
    point[1] *= 0
    hit = (rays.t_min < t) & (t < rays.t_max) & within(point[0], point[2])
    up = np.zeros_like(point)
    up[1] += 1
    return Meeting(np.where(hit, t, np.inf), point, up)


def meet_triangles(corners: Array, rays: Rays, number: Number) -> Meeting:
    """Meet triangles, `corners` `(3, 3, m)`: corner, coordinate, triangle.

    In the space of Woop, Benthin and Wald (JCGT 2(1), 2013) the ray is the z axis: the origin is
    moved to 0, z is where the ray advances most, and x and y are sheared. The ray passes through a
    triangle a b c if it passes its three edges on the same side, u = c × b, … in x and y. Rounding
    cannot turn the sign of a difference of two products, and an edge has the same corners,
    rounded alike, in both its triangles: no ray slips through.
    """
    n, m = rays.t_min.size, corners.shape[2]
    unmet = number.array(np.full(n, np.inf))
    best = Meeting(unmet, rays.origin, rays.direction)
    if m == 0:
        return best
    low, high = corners.min(axis=(0, 2)), corners.max(axis=(0, 2))
    o, d, slide, stretch = approach(rays, (low + high)[:, None] / 2, number)
    axes = (np.argmax(np.abs(d), axis=0) + np.array([[1], [2], [0]])) % 3
    dx, dy, dz = np.take_along_axis(d, axes, 0)[:, :, None]
    for first in range(0, m, TRIANGLES_AT_ONCE):
        part = corners[:, :, None, first : first + TRIANGLES_AT_ONCE]
        x, y, z = (part - o[:, :, None])[:, axes, np.arange(n)].swapaxes(0, 1)
        (ax, bx, cx), (ay, by, cy) = x - dx / dz * z, y - dy / dz * z
        u, v, w = cx * by - cy * bx, ax * cy - ay * cx, bx * ay - by * ax
        within = ((u >= 0) & (v >= 0) & (w >= 0)) | ((u <= 0) & (v <= 0) & (w <= 0))
        total = u + v + w
        s = ratio(u * z[0] + v * z[1] + w * z[2], total * dz, np.inf)
        t = (s + slide[:, None]) / stretch[:, None]
        hit = within & (total != 0) & (rays.t_min[:, None] < t) & (t < rays.t_max[:, None])
        t = np.where(hit, t, np.inf)
        index = np.argmin(t, axis=1)
        t, s = (np.take_along_axis(each, index[:, None], 1)[:, 0] for each in (t, s))
        a, b, c = part[:, :, 0, index]
        normal = cross(b - a, c - a)
        nearer = t < best.t
        best = Meeting(
            np.where(nearer, t, best.t),
            np.where(nearer, o + np.where(finite(s), s, 0) * d, best.point),
            np.where(nearer, ratio(normal, number.length(normal), 0), best.normal),
        )
    return best


def meet_solid(kind: ShapeKind, parameters: Array, rays: Rays, number: Number) -> Meeting:
    """Meet a solid, plain or rounded: the first of its crossings in the open interval of t."""
    centre, radius = ball(kind, parameters, number)
    o, u, slide, stretch = approach(rays, centre, number)
    solid = rounded_solid(kind, parameters, number)
    if solid is None:
        crossings = boundary(*plain_solid(kind, parameters, o, u, number))
    else:
        size = float(radius)
        end = np.where(number.length(o - centre) <= radius, 1.125 * radius, -np.inf)
        if solid.convex:  # from outside both times
            unknown = np.zeros((2, 0, end.size))
            near = first_crossing(solid, size, o, u, -end, end, (*unknown,), number)
            far = -first_crossing(solid, size, o, -u, -end, end, (*unknown,), number)
            found = [near, far]
        else:
            start = np.maximum(-end, rays.t_min * stretch - slide)
            end = np.minimum(end, rays.t_max * stretch - slide)
            plain = plain_crossings(kind, parameters, o, u, number)
            if kind is not ShapeKind.TORUS:
                last = np.where(finite(plain[1]), plain[1], -np.inf).max(axis=0)
                # A ray that grazes a wall of both solids finds its crossing as much later.
                end = np.minimum(end, last + np.sqrt(number.epsilon) * size)
            found = [first_crossing(solid, size, o, u, start, end, plain, number)]
        crossings = [(s, solid.field(o + np.where(finite(s), s, 0) * u)[1]) for s in found]
    t, s, normal = rays.t_max, np.full_like(slide, np.inf), np.zeros_like(o)
    for crossing, outward in crossings:
        t_crossing = (crossing + slide) / stretch
        first = (rays.t_min < t_crossing) & (t_crossing < t)
        t = np.where(first, t_crossing, t)
        s = np.where(first, crossing, s)
        normal = np.where(first, outward, normal)
    hit = finite(s)
    return Meeting(np.where(hit, t, np.inf), o + np.where(hit, s, 0) * u, normal)


def plain_crossings(
    kind: ShapeKind, parameters: Array, o: Array, u: Array, number: Number
) -> tuple[Array, Array]:
    """Where rays enter and leave the solid without its bevel, which holds the bevelled one.

    Each s `(k, n)`, inf for none; of the torus, which is no bevelled solid, k = 0.
    """
    if kind is ShapeKind.TORUS:
        return np.zeros((0, o.shape[1])), np.zeros((0, o.shape[1]))
    crossings = boundary(*plain_solid(kind, parameters, o, u, number))
    leaves = np.stack([dot(normal, u) > 0 for _, normal in crossings])
    s = np.stack([s for s, _ in crossings])
    return np.where(leaves, np.inf, s), np.where(leaves, s, np.inf)


def approach(rays: Rays, centre: Array, number: Number) -> tuple[Array, Array, Array, Array]:
    """The point of each ray closest to a centre, its unit direction, the slide to there, and |d|.

    Twice: what the first slide leaves of the way is what its own rounding made.
    """
    stretch = number.length(rays.direction)
    u = rays.direction / stretch
    offset = rays.origin - centre
    slide = -dot(offset, u)
    offset = offset + slide * u
    rest = -dot(offset, u)
    return offset + rest * u + centre, u, slide + rest, stretch


def ball(kind: ShapeKind, parameters: Array, number: Number) -> tuple[Array, Any]:
    """Centre `(3, 1)` and radius of a ball around a solid."""
    middle: Any = 0 * parameters[0]
    extents: list[Any] = [parameters[0]]
    match kind:
        case ShapeKind.BOX:
            low, high = parameters[:3, None], parameters[3:6, None]
            return (low + high) / 2, number.length(high - low)[0] / 2
        case ShapeKind.CYLINDER:
            radius, y0, y1, _ = parameters
            middle, extents = (y0 + y1) / 2, [radius, (y1 - y0) / 2]
        case ShapeKind.CONE:
            radius, height, _ = parameters
            middle, extents = height / 2, [radius, height / 2]
        case ShapeKind.TORUS:
            extents = [parameters.sum()]
        case ShapeKind.RING | ShapeKind.WEDGE:
            _, r1, y0, y1, *_ = parameters
            middle, extents = (y0 + y1) / 2, [r1, (y1 - y0) / 2]
    centre = np.stack([0 * middle, middle, 0 * middle])[:, None]
    return centre, number.length(np.stack(extents)[:, None])[0]
