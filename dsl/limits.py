"""What the parameters of a shape must satisfy: the exact inequalities, as words with values.

A bevelled solid is the opening of the plain one by a ball, which exists as long as the ball fits;
`dsl/reference/bevel-limits.md` derives the conditions.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from dsl.angles import sine
from dsl.records import value
from dsl.scene import SHAPE_PARAMETERS, ShapeKind
from dsl.values import format_number as number

SIZES = (1e-100, 1e100)
"""Between these are what must be positive, and the largest length of a shape; no coordinate is
beyond. So squares, and products of three, are numbers."""


@value
class Broken:
    """An inequality that does not hold.

    `parameters` are the names, as in `SHAPE_PARAMETERS`, of those to blame.
    """

    code: str
    message: str
    parameters: tuple[str, ...]
    help: str | None = None


def broken_limit(kind: ShapeKind, parameters: Sequence[float]) -> Broken | None:
    """The first inequality that the parameters break, or None if the shape exists.

    Equality at a bevel's limit is allowed.
    """
    if len(parameters) == 1 and SIZES[0] <= parameters[0] <= SIZES[1]:
        return None  # a radius
    p = dict(zip(SHAPE_PARAMETERS[kind], parameters, strict=True))
    if not all(map(math.isfinite, parameters)):
        name, amount = next(item for item in p.items() if not math.isfinite(item[1]))
        return Broken("value-not-finite", f"{name} = {amount} is not finite", (name,))
    broken = _broken_extent(kind, p) or _broken_size(p)
    return broken or (_broken_bevel(kind, p) if p.get("bevel") else None)


def largest_bevel(kind: ShapeKind, parameters: Sequence[float]) -> float:
    """The largest bevel of a shape with otherwise valid parameters (its own bevel is not read)."""
    p = dict(zip(SHAPE_PARAMETERS[kind], parameters, strict=True))
    return min(condition.largest for condition in _conditions(kind, p))


_ROUNDING = 1.0 + 2.0**-50
"""A bevel that is beyond its limit by rounding alone means the limit: `0.3 - 0.1` is below 0.2."""


def within_rounding(kind: ShapeKind, parameters: tuple[float, ...]) -> tuple[float, ...]:
    """The parameters, a bevel that is beyond its limit by rounding alone put to the limit."""
    broken = broken_limit(kind, parameters)
    if broken is not None and broken.code == "value-bevel":
        limit = largest_bevel(kind, parameters)
        if limit < parameters[-1] <= limit * _ROUNDING:
            return (*parameters[:-1], limit)
    return parameters


@value
class _Condition:
    """`left` (in terms of the bevel b) is at most `right`; so b is at most `largest`."""

    left: str
    factor: float
    right: str
    bound: float
    where: str = ""

    @property
    def largest(self) -> float:
        return self.bound / self.factor


def _conditions(kind: ShapeKind, p: dict[str, float]) -> list[_Condition]:
    def thickness(low: str, high: str) -> _Condition:
        return _Condition("2·bevel", 2.0, f"{high} − {low}", p[high] - p[low])

    match kind:
        case ShapeKind.BOX:
            return [thickness(f"{axis}0", f"{axis}1") for axis in "xyz"]
        case ShapeKind.CYLINDER:
            return [thickness("y0", "y1"), _Condition("bevel", 1.0, "radius", p["radius"])]
        case ShapeKind.RING:
            return [thickness("y0", "y1"), thickness("r0", "r1")]
        case ShapeKind.CONE:
            # The inradius of the section: r·h / (r + √(h² + r²)), safe from overflow.
            r, h = p["radius"], p["height"]
            inradius = min(r, h) * (max(r, h) / (r + math.hypot(r, h)))
            return [_Condition("bevel", 1.0, "radius·height/(radius + slant)", inradius)]
        case ShapeKind.WEDGE:
            conditions = [thickness("y0", "y1"), thickness("r0", "r1")]
            span = p["phi1"] - p["phi0"]
            if span < 180.0:
                s = sine(span / 2.0)
                # 1 − s without cancellation: 2 sin²((90° − span/2)/2).
                t = sine((90.0 - span / 2.0) / 2.0)
                conditions.append(
                    _Condition(
                        "bevel·(1 − s)",
                        2.0 * t * t,
                        "r0·s",
                        p["r0"] * s,
                        f", where s = sin(span/2) = {s:.6g}",
                    )
                )
            return conditions
        case _:
            return []


def _broken_bevel(kind: ShapeKind, p: dict[str, float]) -> Broken | None:
    bevel = p["bevel"]
    if bevel < 0.0:
        return Broken("value-out-of-range", f"bevel = {number(bevel)} is negative", ("bevel",))
    for condition in _conditions(kind, p):
        left = condition.factor * bevel
        if left > condition.bound:
            largest = largest_bevel(kind, list(p.values()))
            left_words, bound_words = _distinct(left, condition.bound)
            return Broken(
                "value-bevel",
                f"{condition.left} = {left_words} exceeds {condition.right} = {bound_words}"
                f"{condition.where}",
                ("bevel",),
                f"the bevel can be at most {_below(largest)}",
            )
    return None


def _distinct(a: float, b: float) -> tuple[str, str]:
    """Two different numbers with six digits, or as many as show the difference."""
    digits = next(n for n in range(6, 18) if f"{a:.{n}g}" != f"{b:.{n}g}")
    return f"{a:.{digits}g}", f"{b:.{digits}g}"


def _below(value: float) -> str:
    """A number with at most six digits that is not above the value."""
    rounded = f"{value:.6g}"
    return rounded if float(rounded) <= value * (1.0 + 2.0**-50) else number(value)


def _broken_extent(kind: ShapeKind, p: dict[str, float]) -> Broken | None:
    def positive(name: str, help: str | None = None) -> Broken | None:
        if p[name] >= SIZES[0]:
            return None
        if p[name] > 0.0:
            return _broken_size({name: p[name]})
        message = f"{name.replace('_', '.')} = {number(p[name])} is not greater than 0"
        return Broken("value-out-of-range", message, (name,), help)

    def ordered(low: str, high: str) -> Broken | None:
        if p[low] < p[high]:
            return None
        unit = "°" if low == "phi0" else ""
        message = f"{low} = {number(p[low])}{unit} is not below {high} = {number(p[high])}{unit}"
        return Broken("value-order", message, (high, low))

    match kind:
        case ShapeKind.SPHERE | ShapeKind.DISC:
            return positive("radius")
        case ShapeKind.BOX:
            return ordered("x0", "x1") or ordered("y0", "y1") or ordered("z0", "z1")
        case ShapeKind.CYLINDER:
            return positive("radius") or ordered("y0", "y1")
        case ShapeKind.CONE:
            return positive("radius") or positive("height")
        case ShapeKind.TORUS:
            if broken := positive("major") or positive("minor"):
                return broken
            if p["minor"] > p["major"]:
                message = f"minor = {number(p['minor'])} exceeds major = {number(p['major'])}"
                return Broken("value-order", message, ("minor", "major"))
            return None
        case ShapeKind.RECTANGLE:
            return positive("size_x") or positive("size_z")
        case ShapeKind.PLANE:
            return None
        case ShapeKind.TRIANGLE:
            return _broken_triangle(p)
        case ShapeKind.RING:
            bore = positive("r0", "a ring without a bore is a `cylinder`")
            return bore or ordered("r0", "r1") or ordered("y0", "y1")
        case ShapeKind.WEDGE:
            bore = positive("r0", "a wedge begins off the axis: give `r` a small start")
            broken = bore or ordered("r0", "r1") or ordered("y0", "y1")
            broken = broken or ordered("phi0", "phi1")
            if broken is None and p["phi1"] - p["phi0"] >= 360.0:
                span = number(p["phi1"] - p["phi0"])
                return Broken(
                    "value-out-of-range",
                    f"phi1 − phi0 = {span}° is not below 360°",
                    ("phi0", "phi1"),
                    "the whole turn is a `ring`",
                )
            return broken


def _broken_size(p: dict[str, float]) -> Broken | None:
    lengths = {name: abs(p[name]) for name in p if name not in ("phi0", "phi1")}
    size, (low, high) = max(lengths.values(), default=1.0), SIZES
    if low <= size <= high:
        return None
    name = next(name for name, length in lengths.items() if length == size)
    shown = name.replace("_", ".") if p[name] > 0.0 else f"|{name}|"
    bound = f"is below {number(low)}" if size < low else f"exceeds {number(high)}"
    message = f"{shown} = {number(size)} {bound}"
    return Broken("value-out-of-range", message, (name,), "choose another unit of length")


def _broken_triangle(p: dict[str, float]) -> Broken | None:
    def normal(real: type[Any]) -> list[tuple[Any, Any]]:
        """The components of (b − a) × (c − a) as minuends and subtrahends."""
        a, b, c = ([real(p[f"{corner}{axis}"]) for axis in "xyz"] for corner in "abc")
        u, v = ([end - start for start, end in zip(a, corner, strict=True)] for corner in (b, c))
        return [(u[i - 2] * v[i - 1], u[i - 1] * v[i - 2]) for i in range(3)]

    from fractions import Fraction

    # What rounding may have hidden from float64 is decided by exact numbers.
    if any(abs(m - s) > 1e-12 * abs(m) + 1e-280 for m, s in normal(float)):
        return None
    if any(m != s for m, s in normal(Fraction)):
        return None
    return Broken("value-degenerate", "the three corners lie on one line", ("ax", "bx", "cx"))
