"""The elementary affine maps, each with its own inverse.

A chain of maps is never multiplied together: a ray passes through it step by step, towards the
object by the inverses, and what it hits comes back step by step.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dsl.scene import Step, StepKind, Transform
from runtime.reference.number import Array, Number, apply, cross


@dataclass(frozen=True, slots=True)
class Affine:
    """world = linear · object + offset, and object = inverse · (world − offset).

    `linear` and `inverse` are `(3, 3)`, `offset` is `(3, 1)`. An inverted step has them exchanged:
    world = inverse · (object − offset).
    """

    linear: Array
    inverse: Array
    offset: Array
    inverted: bool

    def object_point(self, world: Array) -> Array:
        """Points `(3, n)` by the inverse."""
        if self.inverted:
            return apply(self.linear, world) + self.offset
        return apply(self.inverse, world - self.offset)

    def object_direction(self, world: Array) -> Array:
        """Directions `(3, n)` by the inverse: translation leaves them alone."""
        return apply(self.linear if self.inverted else self.inverse, world)

    def world_point(self, point: Array) -> Array:
        """Points `(3, n)` by the map itself."""
        if self.inverted:
            return apply(self.inverse, point - self.offset)
        return apply(self.linear, point) + self.offset

    def world_normal(self, normal: Array) -> Array:
        """Normals `(3, n)` by the inverse transpose: tangents must stay perpendicular to them."""
        return apply((self.linear if self.inverted else self.inverse).T, normal)


def affine_maps(transform: Transform, index: int, number: Number) -> list[Affine] | None:
    """The steps of a transform, the one nearest to the object first, or None.

    `index` chooses from a batch. None: one step has no inverse (a scale by zero, say), so that
    nothing of the object is left to hit.
    """
    maps = []
    for step in transform.steps:
        values = step.values if step.values.ndim == 1 else step.values[index]
        if is_singular(step.kind, values):
            return None
        maps.append(affine_map(step, values, number))
    return maps


def affine_map(step: Step, values: NDArray[np.floating[Any]], number: Number) -> Affine:
    """One step with one set of values `(k,)`, none of which make it singular."""
    v = number.array(values)
    one, zero = number.array(np.eye(3)), number.array(np.zeros((3, 1)))
    linear, inverse, offset = one, one, zero
    match step.kind:
        case StepKind.TRANSLATE:
            offset = v.reshape(3, 1)
        case StepKind.SCALE:
            linear = one * v
            inverse = one / v
        case StepKind.ROTATE:
            linear = rotation(v[:3], *number.sine_cosine(float(values[3])), number)
            inverse = linear.T
        case StepKind.ORIENT:
            x, y, z, w = v
            across = np.array([[0 * x, -z, y], [z, 0 * x, -x], [-y, x, 0 * x]])
            linear = one + 2 * w * across + 2 * (across @ across)
            inverse = inverse_of(linear)
        case StepKind.SHEAR:
            linear = one.copy()
            linear[[0, 0, 1, 1, 2, 2], [1, 2, 0, 2, 0, 1]] = v
            inverse = inverse_of(linear)
        case StepKind.REFLECT:
            n = unit(v, number)
            linear = one - 2 * n[:, None] * n
            inverse = linear
        case StepKind.MATRIX:
            rows = v.reshape(3, 4)
            linear, offset = rows[:, :3], rows[:, 3:]
            inverse = inverse_of(linear)
        case StepKind.LOOK_AT:
            eye, target, up = v.reshape(3, 3)
            back = unit(eye - target, number)
            right = unit(cross(up, back), number)
            linear = np.stack([right, cross(back, right), back], axis=1)
            inverse, offset = linear.T, eye.reshape(3, 1)
    return Affine(linear, inverse, offset, step.inverse)


def rotation(axis: Array, sine: Array, cosine: Array, number: Number) -> Array:
    """Rodrigues' formula: u uᵀ + cos (1 − u uᵀ) + sin [u]×, right-handed about the axis u."""
    x, y, z = u = unit(axis, number)
    one, along = number.array(np.eye(3)), u[:, None] * u
    across = np.array([[0 * x, -z, y], [z, 0 * x, -x], [-y, x, 0 * x]])
    turned: Array = along + cosine * (one - along) + sine * across
    return turned


def inverse_of(m: Array) -> Array:
    """The inverse of `(3, 3)` as adjugate over determinant: its rows are products of columns."""
    size = np.abs(m).max()
    a, b, c = m.T / size
    rows = np.stack([cross(b, c), cross(c, a), cross(a, b)])
    inverse: Array = rows / (a * rows[0]).sum() / size
    return inverse


def unit(v: Array, number: Number) -> Array:
    """The vector `(3,)`, of length 1."""
    w = v / np.abs(v).max()
    direction: Array = w / number.length(w)
    return direction


def is_singular(kind: StepKind, values: NDArray[np.floating[Any]]) -> bool:
    """Whether a map has no inverse, or no meaning; decided in exact arithmetic."""
    if not np.isfinite(values).all():
        return True
    exact = [Fraction(float(x)) for x in values]
    match kind:
        case StepKind.SCALE:
            return 0 in exact
        case StepKind.ROTATE | StepKind.REFLECT:
            return not any(exact[:3])
        case StepKind.ORIENT:
            across = sum(x * x for x in exact[:3])
            return 1 + 4 * across * (across + exact[3] ** 2 - 1) == 0
        case StepKind.SHEAR:
            one, (xy, xz, yx, yz, zx, zy) = Fraction(1), exact
            return determinant([one, xy, xz], [yx, one, yz], [zx, zy, one]) == 0
        case StepKind.MATRIX:
            return determinant(exact[0:3], exact[4:7], exact[8:11]) == 0
        case StepKind.LOOK_AT:
            back = [a - b for a, b in zip(exact[0:3], exact[3:6], strict=True)]
            return not any(minors(exact[6:9], back))
    return False


def determinant(a: list[Fraction], b: list[Fraction], c: list[Fraction]) -> Fraction:
    """Of three rows."""
    return sum((x * y for x, y in zip(a, minors(b, c), strict=True)), Fraction(0))


def minors(a: list[Fraction], b: list[Fraction]) -> Iterator[Fraction]:
    """The vector product of two rows."""
    for i, j in ((1, 2), (2, 0), (0, 1)):
        yield a[i] * b[j] - a[j] * b[i]
