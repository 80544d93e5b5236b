"""Where a ray crosses a surface that is known by its signed distance.

Let f(s) be the signed distance at the point s of a ray with a unit direction, |f| = g and g' its
derivative. No crossing is nearer than g: sphere tracing (Hart 1996). Nearer to the surface than
half the reach r of that side, g'' ≥ −2/r (Federer 1959: 1/(r − g) bounds the curvature), so that
within a quarter of r from a g below another quarter, g stays positive up to the root of
g + g' s − s²/r:

    s = 2g / (√(g'² + 4g/r) − g'),

which near the surface is Newton's step, converges as fast, and does not creep along a surface
that it grazes. For a convex solid seen from outside r is infinite: Newton's method itself, never
overshooting because f is convex.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np

from runtime.reference.number import Array, Number, dot, ratio
from runtime.reference.signed_distance import RoundedSolid

FINEST = 200
"""Inside a solid whose bevel is thinner still, steps are one part in so many of its size: a ray
that leaves it through the bevel, and at once enters it again, is not seen to do so."""

PATIENCE = 256
"""Steps after which the shortest step doubles with every eighth. Only a ray that runs in a flat
face, to within rounding errors, needs so many: its steps are as short as the root of those."""


def first_crossing(
    solid: RoundedSolid,
    size: float,
    o: Array,
    u: Array,
    start: Array,
    end: Array,
    crossings: tuple[Array, Array],
    number: Number,
) -> Array:
    """The first s in (start, end) where the ray o + s u crosses the surface, inf where none.

    `o`, `u` `(3, n)`, u of unit length, `start`, `end` `(n,)`; `size` bounds the solid and scales
    rounding errors. Chords are found that sink some rounding errors below the surface. `crossings`
    are where the ray enters and leaves a set that holds the solid, each `(k, n)`, k = 0 for none
    known: a ray outside of that set goes on where it enters it, and a ray inside the solid goes no
    further at once than where it leaves it.
    """

    def field(s: Array, rays: Array) -> tuple[Array, Array]:
        f, gradient = solid.field(o[:, rays] + s * u[:, rays])
        return f, dot(gradient, u[:, rays])

    blur = 4 * np.sqrt(number.epsilon * size)
    shortest_outside = blur * np.sqrt(solid.reach_inside)
    shortest_inside = blur * np.sqrt(min(solid.reach_outside, size))
    if FINEST * solid.reach_inside < size:
        shortest_inside = size / FINEST

    found = np.full_like(start, np.inf)
    rays = np.flatnonzero(start < end)
    s = start[rays]
    f, slope = field(s, rays)
    steps = 0
    while rays.size:
        steps += 1
        growth = 2.0 ** max(0, (steps - PATIENCE) // 8)
        outside = f > 0
        step = np.where(
            outside,
            np.maximum(safe_step(f, slope, solid.reach_outside, number), shortest_outside * growth),
            np.maximum(safe_step(-f, -slope, solid.reach_inside, number), shortest_inside * growth),
        )
        entry, leave = (
            np.where(each[:, rays] > s, each[:, rays], np.inf).min(axis=0, initial=np.inf)
            for each in crossings
        )
        following = np.where(outside, s + step, np.minimum(s + step, leave))
        following = np.where(outside & (entry < leave), entry, following)
        following = np.minimum(following, end[rays])
        f, slope = field(following, rays)
        crossed = (f > 0) != outside
        if crossed.any():
            found[rays[crossed]] = bracketed_root(
                partial(field, rays=rays[crossed]),
                s[crossed],
                following[crossed],
                outside[crossed],
                size,
                number,
            )
        going = ~crossed & (following < end[rays])
        rays, s, f, slope = rays[going], following[going], f[going], slope[going]
    return found


def safe_step(g: Array, slope: Array, reach: float, number: Number) -> Array:
    """How far the distance g, with that slope, certainly stays positive; 0 where g is not."""
    g = np.maximum(g, 0)
    root = number.sqrt(slope * slope + 4 * g / reach)
    bent = np.where(slope > 0, (root + slope) * (reach / 2), ratio(2 * g, root - slope, np.inf))
    return np.maximum(g, np.where(4 * g < reach, np.minimum(bent, reach / 4), 0))


def bracketed_root(
    field: Callable[[Array], tuple[Array, Array]],
    low: Array,
    high: Array,
    positive: Array,
    size: float,
    number: Number,
) -> Array:
    """The roots of f between low and high `(n,)`, to full precision: Newton, else bisection.

    `field` gives f and its derivative; `positive` is whether f > 0 at low; at high it is not so.
    """
    precision = 4 * number.epsilon * size
    x = (low + high) / 2
    for _ in range(400):
        f, slope = field(x)
        before = (f > 0) == positive
        low, high = np.where(before, x, low), np.where(before, high, x)
        newton = x - ratio(f, slope, np.inf)
        better = np.where((low <= newton) & (newton <= high), newton, (low + high) / 2)
        if ((np.abs(better - x) <= precision) | (high - low <= precision)).all():
            break
        x = better
    return better
