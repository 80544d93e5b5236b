"""Where a ray meets planes, quadrics and tori, in closed form, to 110 digits."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import mpmath

mp = mpmath.mp.__class__()
mp.dps = 110

Number = Any  # mpf: mpmath has no types
Point = Sequence[Number]
Polynomial = Sequence[Number]


def dot(a: Point, b: Point) -> Number:
    """The scalar product."""
    return mp.fdot(a, b)


def along(o: Point, d: Point, t: Number) -> list[Number]:
    """The point at t."""
    return [x + t * v for x, v in zip(o, d, strict=True)]


def minus(a: Point, b: Point) -> list[Number]:
    """The vector to a from b."""
    return [x - y for x, y in zip(a, b, strict=True)]


# The polynomial, highest power first, of a ray's t where it meets each.


def plane(o: Point, d: Point, normal: Point, level: Number) -> Polynomial:
    """normal·p = level."""
    return (dot(normal, d), dot(normal, o) - level)


def tube(o: Point, d: Point, center: Point, axis: Point | None, radius: Number) -> Polynomial:
    """A cylinder about the line through `center` along the unit `axis`; without one, a sphere."""
    f = minus(o, center)
    if axis is not None:
        f, d = along(f, axis, -dot(f, axis)), along(d, axis, -dot(d, axis))
    return (dot(d, d), 2 * dot(f, d), dot(f, f) - radius**2)


def double_cone(o: Point, d: Point, height: Number, slope: Number) -> Polynomial:
    """x² + z² = slope² (height - y)²."""
    (x, y, z), (u, v, w), k = o, d, slope**2
    down = height - y
    return (
        u * u + w * w - k * v * v,
        2 * (x * u + z * w + k * down * v),
        x * x + z * z - k * down * down,
    )


def ring_torus(o: Point, d: Point, level: Number, major: Number, minor: Number) -> Polynomial:
    """(p·p + R² - r²)² = 4 R² (x² + z²), about (0, level, 0)."""
    (x, y, z), (u, _, w) = minus(o, (0, level, 0)), d
    a, b, c = dot(d, d), 2 * dot((x, y, z), d), x * x + y * y + z * z + major**2 - minor**2
    k = 4 * major**2
    return (
        a * a,
        2 * a * b,
        b * b + 2 * a * c - k * (u * u + w * w),
        2 * b * c - 2 * k * (x * u + z * w),
        c * c - k * (x * x + z * z),
    )


def roots(polynomial: Polynomial) -> tuple[list[Number], list[Number]]:
    """Real roots, and the real parts of complex ones."""
    while len(polynomial) > 1 and not polynomial[0]:
        polynomial = polynomial[1:]
    match polynomial:
        case [a, b]:
            return [-b / a], []
        case [a, b, c]:
            return quadratic(a, b, c)
        case [_, _, _, _, _]:
            return quartic(polynomial)
    return [], []


def quadratic(a: Number, b: Number, c: Number) -> tuple[list[Number], list[Number]]:
    """Of a t² + b t + c."""
    room = b * b - 4 * a * c
    if room < 0:
        return [], [-b / (2 * a)]
    q = -(b + (mp.sqrt(room) if b >= 0 else -mp.sqrt(room))) / 2
    return ([q / a, c / q] if q else [mp.zero, mp.zero]), []


def quartic(polynomial: Polynomial) -> tuple[list[Number], list[Number]]:
    """By Ferrari's two quadratics, whose cancellation 110 digits have room for."""
    _, b, c, d, e = (x / polynomial[0] for x in polynomial)
    p = c - 3 * b * b / 8
    q = d - b * c / 2 + b**3 / 8
    r = e - b * d / 4 + b * b * c / 16 - 3 * b**4 / 256
    if abs(q) < mp.eps**0.8 * (1 + abs(p)) ** 2:
        return _biquadratic(p, r, b / 4)
    m = _resolvent(p, p * p / 4 - r, -q * q / 8)
    real, parts = [], []
    s = mp.sqrt(2 * m)
    for sign in (1, -1):
        found, complex_parts = quadratic(mp.one, sign * s, p / 2 + m - sign * q / (2 * s))
        real += [x - b / 4 for x in found]
        parts += [x - b / 4 for x in complex_parts]
    return real, parts


def _resolvent(p: Number, k: Number, last: Number) -> Number:
    """A positive root of m³ + p m² + k m + last, last < 0: Newton's method, kept in a bracket."""
    low, high = mp.zero, 1 + max(abs(p), abs(k), abs(last))
    m, before = high, high
    for _ in range(4000):
        value = ((m + p) * m + k) * m + last
        low, high = (m, high) if value < 0 else (low, m)
        slope = (3 * m + 2 * p) * m + k
        step = value / slope if slope else high
        if not low < m - step < high or abs(step) > before / 2:
            step = m - (low + high) / 2
        before = abs(step)
        m -= step
        if before <= m * mp.eps * 16:
            return m
    raise ArithmeticError("no root found")


def _biquadratic(p: Number, r: Number, shift: Number) -> tuple[list[Number], list[Number]]:
    """Of x⁴ + p x² + r, t = x - shift: rays along the axis, and in planes of symmetry."""
    squares, parts = quadratic(mp.one, p, r)
    real = [sign * mp.sqrt(x) - shift for x in squares if x >= 0 for sign in (1, -1)]
    return real, [-shift for x in squares if x < 0] + [x * 0 - shift for x in parts]
