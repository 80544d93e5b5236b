"""Where an object stands in the world, to know whether it is out of range.

What a scene denotes has limits, so that squares, and products of three, are numbers wherever a ray
goes (`dsl/reference/chains.md`, "what is out of range").
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from dsl.scene import Mesh, Shape, ShapeKind
from runtime.reference.number import Array, Number, apply
from runtime.reference.transform import Affine

FARTHEST = 1e100
"""No coordinate is beyond it, and nothing is made so many times smaller."""


@dataclass(frozen=True, slots=True)
class Placement:
    """world = linear · object + offset; `linear` and `inverse` `(3, 3)`, `offset` `(3, 1)`."""

    linear: Array
    inverse: Array
    offset: Array

    @classmethod
    def of_the_world(cls, number: Number) -> Placement:
        """That of the world itself."""
        one = number.array(np.eye(3))
        return cls(one, one, number.array(np.zeros((3, 1))))

    def below(self, maps: Sequence[Affine]) -> Placement:
        """That of what is placed by maps here, the one nearest to the object first."""
        linear, inverse, offset = self.linear, self.inverse, self.offset
        for affine in reversed(maps):
            offset = apply(linear, affine.world_point(0 * affine.offset)) + offset
            outward, inward = affine.linear, affine.inverse
            if affine.inverted:
                outward, inward = inward, outward
            linear, inverse = apply(linear, outward), apply(inward, inverse)
        return Placement(linear, inverse, offset)

    def holds(self, leaf: Shape | Mesh) -> bool:
        """Whether a shape or a mesh is in range here."""
        stretch, offset = np.abs(self.linear).sum(axis=1).max(), np.abs(self.offset).max()
        reach = stretch * max(_size(leaf), 1.0) + offset
        return bool(reach <= FARTHEST and np.abs(self.inverse).max() <= FARTHEST)


def _size(leaf: Shape | Mesh) -> float:
    """What no coordinate exceeds; of a plane, that of its origin."""
    if isinstance(leaf, Mesh):
        return float(np.abs(leaf.points).max(initial=0.0))
    if leaf.kind is ShapeKind.TORUS:
        return sum(leaf.parameters)
    lengths = leaf.parameters
    if leaf.kind is ShapeKind.WEDGE:
        lengths = lengths[:4]  # and then angles
    return max(map(abs, lengths), default=0.0)
