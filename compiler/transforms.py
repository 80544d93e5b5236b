"""Elementary maps with their exact inverses, and chains of them composed in double-double.

An inverse is made from the structure of its map (-t, 1/s, the transpose of a rotation, a
reflection itself, the adjugate over the determinant of a shear or matrix), so composing the
inverses costs no more accuracy than composing the maps: after k factors the entries are within
about k κ 2^-100 of exact, κ the largest condition number met, before they are rounded once to
float64. Inverting the product instead would cost κ 2^-53.

A chain is multiplied in pairs, pairs of pairs and so on; which products are made depends on the
number of steps only, so that a batch of n gives to the last bit what n single chains give.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from compiler.affine import IDENTITY, STILL, Affine, Lanes, Placement, scatter_placements
from compiler.angles import sin_cos
from compiler.double_double import ONE, ZERO, DoubleDouble
from compiler.vectors import cross, dot, leveled, leveling, unit
from dsl.records import value
from dsl.scene import Step, StepKind

Matrix3 = list[list[DoubleDouble]]

_NO_TRANSLATION = (ZERO, ZERO, ZERO)
_TWO = DoubleDouble.of(2.0)
_TWICE = np.float64(2.0)
_FOUR = np.float64(4.0)
# Lanes that are worth sorting.
_MANY = 256
_SAMPLE = 4096
# A determinant this small against the sum of its terms is rounding noise.
_NOISE = 2.0**-98


def elementary(kind: StepKind, values: NDArray[np.floating[Any]]) -> Placement:
    """The map of one step and its inverse; `values` `(k,)` or `(n, k)` as `StepKind` lists them.

    Where the map has no inverse, or cannot be made (a zero axis), entries are not finite.
    """
    with np.errstate(all="ignore"):
        return _MAKERS[kind](_columns(values))


def compose(steps: Sequence[Step]) -> Placement:
    """The chain of `steps`, the first applied to the object first; batched if any step is."""
    return prepared(steps).lanes(slice(None))


def compose_many(chains: Sequence[Sequence[Step]]) -> Placement:
    """Each of the unbatched, non-empty `chains` as `compose` would, all at once: one lane each."""
    lengths = np.array([len(chain) for chain in chains], dtype=np.int64)
    with np.errstate(all="ignore"):
        lanes = _elementary_lanes([step for chain in chains for step in chain])
        while len(lengths) and lengths.max() > 1:
            halved = (lengths + 1) // 2
            # Lane 2i of its chain is multiplied by lane 2i + 1, or kept if it is the last.
            within = np.arange(halved.sum()) - np.repeat(np.cumsum(halved) - halved, halved)
            first = np.repeat(np.cumsum(lengths) - lengths, halved) + 2 * within
            paired = 2 * within + 1 < np.repeat(lengths, halved)
            product = lanes.take(first[paired] + 1) @ lanes.take(first[paired])
            kept = lanes.take(first[~paired])
            parts = [(product, np.flatnonzero(paired)), (kept, np.flatnonzero(~paired))]
            lanes = scatter_placements(parts, len(first))
            lengths = halved
    return lanes


class Factor(Protocol):
    """A chain, or a part of one, that is composed in any of the lanes of its batch."""

    def lanes(self, index: Lanes) -> Placement:
        """The placements in some lanes; a single one if it holds for all."""


def prepared(steps: Sequence[Step]) -> Factor:
    """The chain of `steps` with all done that need not be done in every lane."""
    with np.errstate(all="ignore"):
        factors = [_factor(step) for step in steps] or [_Few(STILL)]
        while len(factors) > 1:
            pairs = [_times(b, a) for a, b in zip(factors[::2], factors[1::2], strict=False)]
            factors = pairs + factors[len(pairs) * 2 :]
        return factors[0]


@value
class _Few:
    """Lane i of the batch is lane `place[i]` of the placement; without a `place` all are alike."""

    placement: Placement
    place: NDArray[np.int64] | None = None

    def lanes(self, index: Lanes) -> Placement:
        return self.placement if self.place is None else self.placement.take(self.place[index])


@value
class _Each:
    """A step with values of its own in every lane."""

    step: Step

    def lanes(self, index: Lanes) -> Placement:
        step = self.step
        return _placement(Step(step.kind, step.values[index], step.inverse))


@value
class _Product:
    outer: Factor
    inner: Factor

    def lanes(self, index: Lanes) -> Placement:
        with np.errstate(all="ignore"):
            return self.outer.lanes(index) @ self.inner.lanes(index)


def _times(outer: Factor, inner: Factor) -> Factor:
    """The product: now if one of the two is the same in every lane, else when it is asked for."""
    if isinstance(outer, _Few) and isinstance(inner, _Few):
        if inner.place is None:
            return _Few(outer.placement @ inner.placement, outer.place)
        if outer.place is None:
            return _Few(outer.placement @ inner.placement, inner.place)
    return _Product(outer, inner)


def _factor(step: Step) -> Factor:
    """One step of a batch: loops turn by few angles many times, and sorting costs little."""
    values = step.values
    if values.ndim == 1:
        return _Few(_placement(step))
    if step.kind is StepKind.ROTATE and len(values) >= _MANY:
        axis = values[0, :3]
        if all((column == x).all() for column, x in zip(values.T, axis, strict=False)):
            angles, place = _few(values[:, 3])
            if place is not None:
                rows = np.column_stack([np.broadcast_to(axis, (len(angles), 3)), angles])
                return _Few(_placement(Step(step.kind, rows, step.inverse)), place)
    return _Each(step)


def _few(
    numbers: NDArray[np.floating[Any]],
) -> tuple[NDArray[np.floating[Any]], NDArray[np.int64] | None]:
    """The different numbers and the place of each among them, if they are few for so many.

    By their bits, for -0 is not 0; those of a sample first, for sorting all takes ten times as long
    as finding them among few.
    """
    bits = np.ascontiguousarray(numbers, np.float64).view(np.int64)
    # Asked for counts too, NumPy does not import its masked arrays, a fifth of its own import.
    known, _ = np.unique(bits[:: 1 + len(bits) // _SAMPLE], return_counts=True)
    if 4 * len(known) < 3 * min(len(bits), _SAMPLE):
        place = np.minimum(np.searchsorted(known, bits), len(known) - 1)
        missing = bits[known[place] != bits]
        if len(missing):
            known = np.union1d(known, missing)
            place = np.searchsorted(known, bits)
        if 2 * len(known) < len(bits):
            return known.view(np.float64), place
    return numbers, None


def _placement(step: Step) -> Placement:
    placement = elementary(step.kind, step.values)
    return placement.inverted() if step.inverse else placement


def _elementary_lanes(steps: Sequence[Step]) -> Placement:
    by_kind: dict[tuple[StepKind, bool], list[int]] = {}
    for lane, step in enumerate(steps):
        by_kind.setdefault((step.kind, step.inverse), []).append(lane)
    parts = []
    for (kind, inverse), lanes in by_kind.items():
        values = np.concatenate([steps[lane].values for lane in lanes]).reshape(len(lanes), -1)
        placement = elementary(kind, values)
        parts.append((placement.inverted() if inverse else placement, np.array(lanes)))
    return scatter_placements(parts, len(steps)) if parts else STILL


def _columns(values: NDArray[np.floating[Any]]) -> list[DoubleDouble]:
    """The values of a step, each a scalar where it is the same for the whole batch."""
    if values.ndim == 1:
        return [DoubleDouble(np.float64(v)) for v in values]
    number = DoubleDouble.short if values.dtype.itemsize < 8 else DoubleDouble
    columns: list[DoubleDouble] = []
    for column in values.T:
        same = len(column) > 0 and bool((column == column[0]).all())
        whole = np.float64(column[0]) if same else np.ascontiguousarray(column, np.float64)
        columns.append(number(whole))
    return columns


def _translate(values: list[DoubleDouble]) -> Placement:
    return _translation(values)


def _translation(t: Sequence[DoubleDouble]) -> Placement:
    linear = IDENTITY.linear
    return Placement(Affine.of(linear, t), Affine.of(linear, [-x for x in t]))


def _diagonal(x: DoubleDouble, y: DoubleDouble, z: DoubleDouble) -> Affine:
    return Affine.of(((x, ZERO, ZERO), (ZERO, y, ZERO), (ZERO, ZERO, z)), _NO_TRANSLATION)


def _scale(values: list[DoubleDouble]) -> Placement:
    x, y, z = values
    return Placement(_diagonal(x, y, z), _diagonal(ONE / x, ONE / y, ONE / z))


def _rotate(values: list[DoubleDouble]) -> Placement:
    """Rodrigues: R = c I + s [a]× + (1 - c) a aᵀ."""
    a = unit(values[:3])
    sine, cosine = sin_cos(values[3].hi)
    versine = ONE - cosine

    def diagonal(i: int) -> DoubleDouble:
        # c + (1 - c) is 1, but not always in double-double.
        on_axis = (a[(i + 1) % 3].hi == 0) & (a[(i + 2) % 3].hi == 0)
        return _where(on_axis, ONE, cosine + versine * (a[i] * a[i]))

    def across(i: int, j: int, k: int) -> tuple[DoubleDouble, DoubleDouble]:
        product, turn = versine * (a[i] * a[j]), sine * a[k]
        return product - turn, product + turn

    xy, yx = across(0, 1, 2)
    zx, xz = across(2, 0, 1)
    yz, zy = across(1, 2, 0)
    return _rigid([[diagonal(0), xy, xz], [yx, diagonal(1), yz], [zx, zy, diagonal(2)]])


def _orient(values: list[DoubleDouble]) -> Placement:
    """M = 1 + 2w K + 2K², K = [v]×, which is a rotation if q = (v, w) has length 1.

    On the axis M is 1; in the plane across, where K² = -v², it is the complex number
    1 - 2v² + 2w|v|i of square m = 1 + 4v²(q² - 1). Hence M⁻¹ = 1 - (2w/m) K + ((4q² - 2)/m) K².
    """
    x, y, z, w = values
    xx, yy, zz = _short(x * x), _short(y * y), _short(z * z)
    products = _short(y * z), _short(z * x), _short(x * y)
    squares = yy + zz, zz + xx, xx + yy
    across = squares[0] + xx
    square = across + _short(w * w)
    m = ONE + (across * (square - ONE)).scaled(_FOUR)
    turn, bend = w.scaled(_TWICE), (square.scaled(_FOUR) - _TWO) / m

    def linear(
        turns: Sequence[DoubleDouble], bends: Callable[[DoubleDouble], DoubleDouble]
    ) -> Matrix3:
        (a, b, c), (yz, zx, xy) = turns, map(bends, products)
        p, q, r = (ONE - bends(square) for square in squares)
        return [[p, xy - c, zx + b], [xy + c, q, yz - a], [zx - b, yz + a, r]]

    there = [_short(v * turn) for v in (x, y, z)]
    back = turn / m
    return Placement(
        Affine.of(linear(there, lambda e: e.scaled(_TWICE)), _NO_TRANSLATION),
        Affine.of(linear([-(v * back) for v in (x, y, z)], lambda e: e * bend), _NO_TRANSLATION),
    )


def _short(exact: DoubleDouble) -> DoubleDouble:
    """The same without a low part that is nothing: products of floats are doubles."""
    return exact if np.any(exact.lo) else DoubleDouble(exact.hi)


def _rigid(linear: Matrix3) -> Placement:
    transposed = [list(column) for column in zip(*linear, strict=True)]
    return Placement(Affine.of(linear, _NO_TRANSLATION), Affine.of(transposed, _NO_TRANSLATION))


def _reflect(values: list[DoubleDouble]) -> Placement:
    """Householder: I - 2 n nᵀ / n·n."""
    n = leveled(values)
    square = dot(n, n)
    identity = IDENTITY.linear
    linear = [[identity[i][j] - _TWO * (n[i] * n[j]) / square for j in range(3)] for i in range(3)]
    mirror = Affine.of(linear, _NO_TRANSLATION)
    return Placement(mirror, mirror)


def _shear(values: list[DoubleDouble]) -> Placement:
    xy, xz, yx, yz, zx, zy = values
    linear = [[ONE, xy, xz], [yx, ONE, yz], [zx, zy, ONE]]
    return Placement(
        Affine.of(linear, _NO_TRANSLATION), Affine.of(_inverse(linear), _NO_TRANSLATION)
    )


def _matrix(values: list[DoubleDouble]) -> Placement:
    return with_inverse([values[0:3], values[4:7], values[8:11]], values[3::4])


def with_inverse(linear: Matrix3, translation: Sequence[DoubleDouble]) -> Placement:
    """A general map and its inverse by adjugate and determinant.

    Rows, then columns, are first scaled by powers of two to entries near 1, A = R B C, so that
    neither 1e150 nor 1e-150 leaves the range of float64 in a product of three.
    """
    by_row = [leveling(row) for row in linear]
    rows = [[e.scaled(r) for e in row] for row, r in zip(linear, by_row, strict=True)]
    by_column = [leveling(column) for column in zip(*rows, strict=True)]
    balanced = [[e.scaled(c) for e, c in zip(row, by_column, strict=True)] for row in rows]
    inverse = [
        [e.scaled(r).scaled(c) for e, r in zip(row, by_row, strict=True)]
        for row, c in zip(_inverse(balanced), by_column, strict=True)
    ]
    back = [-dot(row, translation) for row in inverse]
    return Placement(Affine.of(linear, translation), Affine.of(inverse, back))


def _look_at(values: list[DoubleDouble]) -> Placement:
    eye, target, up = values[0:3], values[3:6], values[6:9]
    back = unit([e - t for e, t in zip(eye, target, strict=True)])
    right = unit(cross(unit(up), back))
    above = cross(back, right)
    rotation = _rigid([[right[i], above[i], back[i]] for i in range(3)])
    return _translation(eye) @ rotation


_MAKERS: dict[StepKind, Callable[[list[DoubleDouble]], Placement]] = {
    StepKind.TRANSLATE: _translate,
    StepKind.SCALE: _scale,
    StepKind.ROTATE: _rotate,
    StepKind.ORIENT: _orient,
    StepKind.SHEAR: _shear,
    StepKind.REFLECT: _reflect,
    StepKind.MATRIX: _matrix,
    StepKind.LOOK_AT: _look_at,
}


def _inverse(m: Matrix3) -> Matrix3:
    """Adjugate over determinant of a 3×3; NaN where the determinant is 0 or noise."""

    def cofactor(i: int, j: int) -> DoubleDouble:
        a, b, c, d = (i + 1) % 3, (i + 2) % 3, (j + 1) % 3, (j + 2) % 3
        return m[a][c] * m[b][d] - m[a][d] * m[b][c]

    adjugate = [[cofactor(j, i) for j in range(3)] for i in range(3)]
    terms = [m[0][j] * adjugate[j][0] for j in range(3)]
    determinant = terms[0] + terms[1] + terms[2]
    size = sum(
        (
            np.abs(m[0][j].hi * m[1][k].hi * m[2][3 - j - k].hi)
            for j in range(3)
            for k in range(3)
            if k != j
        ),
        start=np.float64(0.0),
    )
    decided = np.abs(determinant.hi) > _NOISE * size
    determinant = _where(decided, determinant, DoubleDouble.of(float("nan")))
    return [[entry / determinant for entry in row] for row in adjugate]


def _where(
    condition: NDArray[np.bool_] | np.bool_, a: DoubleDouble, b: DoubleDouble
) -> DoubleDouble:
    if condition.ndim == 0:
        return a if condition else b
    return DoubleDouble(np.where(condition, a.hi, b.hi), np.where(condition, a.lo, b.lo))
