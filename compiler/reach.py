"""What is left out of a scene: what has no inverse, is too far away, too large or too small.

Coordinates and matrices are at most `SIZES[1]` in absolute value, as the lengths of shapes are,
and nothing is scaled to less than `SIZES[0]` times its size: squares, and products of three, are
then numbers wherever a ray goes.
"""

from __future__ import annotations

from enum import IntEnum
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from compiler.column import Integers
from compiler.provenance import Origins
from compiler.rows import Rows, Sources
from dsl.codes import diagnostic
from dsl.diagnostics import Diagnostic
from dsl.limits import SIZES
from dsl.scene import FloatArray
from dsl.spans import Place


class Reason(IntEnum):
    """Why something is left out."""

    NONE = 0
    NO_INVERSE = 1
    NOT_FINITE = 2
    TOO_LARGE = 3
    TOO_SMALL = 4


class _Words(NamedTuple):
    code: str
    why: str
    help: str


_BLOCK = 1 << 14
"""Rows looked at once."""
_UNIT = "choose another unit of length"
_WORDS = {
    Reason.NO_INVERSE: _Words(
        "scene-singular-transform",
        "the transform has no inverse",
        "a scale of 0 leaves nothing that a ray could hit",
    ),
    Reason.NOT_FINITE: _Words(
        "scene-singular-transform", "the transform is not finite", "keep numbers below 1e100"
    ),
    Reason.TOO_LARGE: _Words("scene-out-of-range", "it reaches beyond 1e100", _UNIT),
    Reason.TOO_SMALL: _Words(
        "scene-out-of-range", "it is scaled to less than 1e-100 of its size", _UNIT
    ),
}


def left_out(
    reasons: NDArray[np.uint8], segments: Integers, sources: Sources, origins: Origins
) -> list[Diagnostic]:
    """One warning for each reason and place of what is left out.

    `segments` are the innermost of its paths; `Reason.NONE` gives no warning.
    """
    origin = np.append(sources.origin, -1)[_emitted(segments, sources, origins)]
    return [
        _warning(count, reason, origins.places[number] if number >= 0 else None)
        for number in dict.fromkeys(origin.tolist())
        for reason in _WORDS
        if (count := int(((origin == number) & (reasons == reason)).sum()))
    ]


def _warning(count: int, reason: Reason, place: Place | None) -> Diagnostic:
    who = "this is" if count == 1 else f"{count} instances of this are"
    words = _WORDS[reason]
    return diagnostic(words.code, f"{who} left out: {words.why}", place, help=words.help)


def _emitted(segments: Integers, sources: Sources, origins: Origins) -> Integers:
    """The segment of each path that tells where it is emitted: the innermost with a name."""
    labelled = np.array(origins.labelled(), dtype=bool)
    named = np.append(labelled[sources.origin], True)
    parent = np.append(sources.parent, -1)
    segment = segments
    while not named[segment].all():
        segment = np.where(named[segment], segment, parent[segment])
    return np.where(segment >= 0, segment, segments)


class Extent(NamedTuple):
    """How placements `(n, 3, 4)` change coordinates: numbers of each, `(n,)`.

    One of size s reaches up to `stretch` · s + `offset`; `squeeze` is the largest number in the
    3×3 parts of the inverses. `valid` is a `Reason` if one of the two matrices is not finite.
    """

    stretch: FloatArray
    offset: FloatArray
    squeeze: FloatArray
    valid: NDArray[np.uint8]


def extent(forward: FloatArray, inverse: FloatArray) -> Extent:
    """The extent of placements and their inverses."""
    with np.errstate(all="ignore"):
        linear = np.abs(forward[:, :, :3])
        valid = np.full(len(forward), Reason.NONE, dtype=np.uint8)
        valid[~np.isfinite(inverse).all(axis=(1, 2))] = Reason.NO_INVERSE
        valid[~np.isfinite(forward).all(axis=(1, 2))] = Reason.NOT_FINITE
        return Extent(
            linear.sum(axis=2).max(axis=1),
            np.abs(forward[:, :, 3]).max(axis=1),
            np.abs(inverse[:, :, :3]).max(axis=(1, 2)),
            valid,
        )


def reasons(placed: Extent, size: FloatArray, squeeze: FloatArray) -> NDArray[np.uint8]:
    """Why each of what is placed is left out, if it is: a `Reason`.

    It has coordinates up to `size` `(n,)` and contains what is squeezed by up to `squeeze` `(n,)`.
    """
    with np.errstate(all="ignore"):
        found = placed.valid.copy()
        usable = found == Reason.NONE
        reach = placed.stretch * np.maximum(size, 1.0) + placed.offset
        found[usable & ~(placed.squeeze * squeeze <= SIZES[1])] = Reason.TOO_SMALL
        found[usable & ~(reach <= SIZES[1])] = Reason.TOO_LARGE
    return found


def left_out_rows(table: Rows, ordinary: NDArray[np.bool_], sizes: FloatArray) -> NDArray[np.uint8]:
    """Why rows are left out, if they are: a `Reason` for each.

    `sizes` are those of the prototypes; placements that are `ordinary` put none of them out of
    range, but a group that holds other groups may.
    """
    found = np.zeros(len(ordinary), dtype=np.uint8)
    rows = np.arange(len(found)) if len(table.ranges) > 1 else np.flatnonzero(~ordinary)
    if not len(rows):
        return found
    blocks = [rows[start : start + _BLOCK] for start in range(0, len(rows), _BLOCK)]
    extents = [extent(table.forward[block], table.inverse[block]) for block in blocks]
    placed = Extent(*map(np.concatenate, zip(*extents, strict=True)))
    target = table.target[rows]
    of_group = target < 0
    size = sizes[np.where(of_group, 0, target)] if len(sizes) else np.zeros(len(rows))
    squeeze = np.ones(len(rows))
    if len(table.ranges) == 1:
        found[rows] = reasons(placed, size, squeeze)
        return found
    below = ~target[of_group]
    known = np.zeros((2, len(table.ranges)))  # of the groups: sizes and how they are squeezed
    while True:
        size[of_group], squeeze[of_group] = known[0, below], np.maximum(known[1, below], 1.0)
        found = reasons(placed, size, squeeze)
        drawn = found == Reason.NONE
        reach = np.where(drawn, placed.stretch * size + placed.offset, 0.0)
        squeezed = np.where(drawn, placed.squeeze * squeeze, 0.0)
        now = np.stack([np.maximum.reduceat(v, table.ranges[:, 0]) for v in (reach, squeezed)])
        if (now == known).all():
            return found
        known = now
