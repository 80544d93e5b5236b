"""Affine maps in double-double, with their inverses composed beside them."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from compiler.double_double import ONE, ZERO, DoubleDouble, FloatArray, Part
from dsl.records import value

Lanes = NDArray[np.signedinteger[Any]] | slice | int
Row = tuple[DoubleDouble, DoubleDouble, DoubleDouble, DoubleDouble]


@value
class Affine:
    """A 3×4 matrix (or n of them: entries are scalars or arrays of n) over the row 0 0 0 1."""

    rows: tuple[Row, Row, Row]

    @staticmethod
    def of(linear: Sequence[Sequence[DoubleDouble]], translation: Sequence[DoubleDouble]) -> Affine:
        """From a 3×3 part and a translation."""
        (a, b, c), (x, y, z) = linear, translation
        return Affine(
            ((a[0], a[1], a[2], x), (b[0], b[1], b[2], y), (c[0], c[1], c[2], z)),
        )

    @property
    def linear(self) -> list[list[DoubleDouble]]:
        """The 3×3 part."""
        return [list(row[:3]) for row in self.rows]

    @property
    def translation(self) -> tuple[DoubleDouble, DoubleDouble, DoubleDouble]:
        """The image of the origin."""
        return self.rows[0][3], self.rows[1][3], self.rows[2][3]

    def __matmul__(self, other: Affine) -> Affine:
        def row(a: Row) -> Row:
            x, y, z, w = (
                a[0] * other.rows[0][j] + a[1] * other.rows[1][j] + a[2] * other.rows[2][j]
                for j in range(4)
            )
            return x, y, z, w + a[3]

        return Affine((row(self.rows[0]), row(self.rows[1]), row(self.rows[2])))

    def take(self, index: Lanes) -> Affine:
        """The lanes at `index`."""
        return self.mapped(lambda entry: entry.take(index))

    def mapped(self, function: Callable[[DoubleDouble], DoubleDouble]) -> Affine:
        """Every entry by a function."""
        a, b, c = ((function(x), function(y), function(z), function(w)) for x, y, z, w in self.rows)
        return Affine((a, b, c))

    def round_into(self, out: FloatArray) -> None:
        """Write the entries, rounded once, into `out` `(n, 3, 4)`; zeros are positive."""
        for i, row in enumerate(self.rows):
            for j, entry in enumerate(row):
                np.add(entry.hi, 0.0, out=out[:, i, j])

    def is_within(self, limit: float) -> NDArray[np.bool_] | np.bool_:
        """Where no entry exceeds `limit` in absolute value: an array, or one answer for all."""
        within: NDArray[np.bool_] | np.bool_ = np.bool_(True)
        for row in self.rows:
            for entry in row:
                # Most are: two numbers tell, and NaN passes no comparison.
                if not (-limit <= np.min(entry.hi) and np.max(entry.hi) <= limit):
                    within = within & (np.abs(entry.hi) <= limit)
        return within


def scatter(parts: Iterable[tuple[Affine, NDArray[np.int64]]], count: int) -> Affine:
    """One `Affine` of `count` lanes: each part goes to the lanes of its index."""
    pieces = list(parts)

    def gather(values: Sequence[Part]) -> Part:
        first = values[0]
        if all(v.ndim == 0 and v == first for v in values):
            return first
        out = np.empty(count)
        for part, (_, index) in zip(values, pieces, strict=True):
            out[index] = part
        return out

    def entry(i: int, j: int) -> DoubleDouble:
        entries = [affine.rows[i][j] for affine, _ in pieces]
        return DoubleDouble(gather([e.hi for e in entries]), gather([e.lo for e in entries]))

    a, b, c = ((entry(i, 0), entry(i, 1), entry(i, 2), entry(i, 3)) for i in range(3))
    return Affine((a, b, c))


IDENTITY = Affine(((ONE, ZERO, ZERO, ZERO), (ZERO, ONE, ZERO, ZERO), (ZERO, ZERO, ONE, ZERO)))


@value
class Placement:
    """A map and its inverse; where there is none, entries of either are not finite."""

    forward: Affine
    inverse: Affine

    def __matmul__(self, other: Placement) -> Placement:
        return Placement(self.forward @ other.forward, other.inverse @ self.inverse)

    def inverted(self) -> Placement:
        """The inverse map and its inverse."""
        return Placement(self.inverse, self.forward)

    def take(self, index: Lanes) -> Placement:
        """The lanes at `index`."""
        taken: dict[int, DoubleDouble] = {}  # a rotation and its inverse have the same entries

        def take(entry: DoubleDouble) -> DoubleDouble:
            found = taken.get(id(entry))
            if found is None:
                found = taken[id(entry)] = entry.take(index)
            return found

        return Placement(self.forward.mapped(take), self.inverse.mapped(take))


def scatter_placements(
    parts: Sequence[tuple[Placement, NDArray[np.int64]]], count: int
) -> Placement:
    """One `Placement` of `count` lanes: each part goes to the lanes of its index."""
    return Placement(
        scatter(((p.forward, index) for p, index in parts), count),
        scatter(((p.inverse, index) for p, index in parts), count),
    )


STILL = Placement(IDENTITY, IDENTITY)
