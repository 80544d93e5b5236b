"""The instance table in the making: rows placed, the singular dropped, references renumbered."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from compiler.column import Integers
from compiler.compress import NO_MATERIAL, Branches
from compiler.expand import Plan, expand, joined
from compiler.ir import COUNTED
from compiler.place import Frames, matrices
from dsl.records import value

# Numbers looked at once.
_BLOCK = 1 << 16


class Sources(NamedTuple):
    """The columns of the source segments: parent, origin, number among siblings."""

    parent: Integers
    origin: Integers
    number: Integers


@value
class Rows:
    """Instances of all groups; columns as in `SceneIR`, prototypes and materials provisional."""

    ranges: Integers  # (g, 2)
    target: Integers
    forward: NDArray[np.float64]
    inverse: NDArray[np.float64]
    low: NDArray[np.float32]
    material: Integers
    source: Integers
    sources: Sources

    def kept(self, keep: NDArray[np.bool_]) -> Rows:
        """Only the rows where `keep`."""
        ends = np.concatenate([[0], np.cumsum(keep)])
        return replace(
            self,
            ranges=ends[self.ranges],
            target=self.target[keep],
            forward=self.forward[keep],
            inverse=self.inverse[keep],
            low=self.low[keep],
            material=self.material[keep],
            source=self.source[keep],
        )


def rows(branches: Branches, plan: Plan, limit: float) -> tuple[Rows, NDArray[np.bool_]]:
    """The rows of all groups, and which of them have no number beyond `limit` in their matrices."""
    tables = expand(branches, plan)
    ends = np.cumsum([len(table.leaf_target) for table in tables.values()])
    table = joined(tables.values())
    target = table.leaf_target.numbers
    if len(tables) > 1:
        number = np.zeros(len(branches.edges), dtype=np.int64)
        number[list(tables)] = np.arange(len(tables))
        target = np.where(target < 0, ~number[np.where(target < 0, ~target, 0)], target)
    forward, inverse, low, ordinary = matrices(Frames(branches.chains, table), len(target), limit)
    sources = Sources(
        table.source_parent.numbers, table.source_origin.numbers, table.source_index.numbers
    )
    ranges = np.stack([np.concatenate([[0], ends[:-1]]), ends], axis=1)
    columns = table.leaf_material.numbers, table.leaf_source.numbers
    return Rows(ranges, target, forward, inverse, low, *columns, sources), ordinary


def without(rows: Rows, dropped: Integers) -> Rows:
    """`rows` without those at `dropped`, and without what then is empty or out of reach."""
    rows = _numbered(rows, np.unique(rows.source[dropped]))
    keep = np.ones(len(rows.target), dtype=bool)
    keep[dropped] = False
    rows = rows.kept(keep)
    while True:
        empty = rows.ranges[:, 0] == rows.ranges[:, 1]
        keep = (rows.target >= 0) | ~empty[np.where(rows.target < 0, ~rows.target, 0)]
        if keep.all():
            break
        rows = rows.kept(keep)
    return _reachable(rows)


def needs_default_material(
    ranges: NDArray[np.integer], target: NDArray[np.integer], material: NDArray[np.integer]
) -> bool:
    """Whether some leaf has no material on its whole way up to the root; columns of an IR."""
    inherits = material == NO_MATERIAL
    if len(ranges) == 1:
        return bool(inherits.any())
    bare = np.zeros(len(ranges), dtype=bool)
    group = np.repeat(np.arange(len(ranges)), np.diff(ranges, axis=1).ravel())
    below = np.where(target < 0, ~target, 0)
    while True:
        found = np.zeros_like(bare)
        found[group[inherits & ((target >= 0) | bare[below])]] = True
        if (found == bare).all():
            return bool(bare[0])
        bare = found


def first_uses(numbers: Integers, count: int) -> Integers:
    """The distinct values of `numbers`, which are below `count`, in order of first appearance."""
    first = np.full(count, len(numbers))
    for end in range(len(numbers), 0, -_BLOCK):  # the last to be written is the first to appear
        start = max(end - _BLOCK, 0)
        first[numbers[start:end][::-1]] = np.arange(start, end)[::-1]
    order = np.argsort(first, kind="stable")
    return order[: int((first < len(numbers)).sum())]


def renumbered(numbers: Integers, used: Sequence[int] | Integers) -> NDArray[np.int32]:
    """Each number replaced by its place in `used`, in the same memory; negative ones stay."""
    used = np.asarray(used, dtype=np.int64)
    if (used == np.arange(len(used))).all():
        return numbers.astype(np.int32, copy=False)
    place = np.zeros(int(used.max(initial=0)) + 1, dtype=np.int32)
    place[used] = np.arange(len(used))
    numbers = numbers.astype(np.int32, copy=False)
    for start in range(0, len(numbers), _BLOCK):
        some = numbers[start : start + _BLOCK]
        np.copyto(some, place[np.maximum(some, 0)], where=some >= 0)
    return numbers


def _numbered(rows: Rows, affected: Integers) -> Rows:
    """`rows` with segments of their own where counting (`COUNTED`) will not do any more."""
    source, sources = rows.source.copy(), rows.sources
    for below in affected[affected >= 0]:
        chain = [int(below)]
        while sources.number[chain[-1]] != COUNTED and sources.parent[chain[-1]] >= 0:
            chain.append(int(sources.parent[chain[-1]]))
        if sources.number[chain[-1]] != COUNTED:
            continue
        members = np.flatnonzero(rows.source == below)
        number = np.arange(len(members))
        parents = np.full(len(members), sources.parent[chain[-1]])
        for segment in reversed(chain):
            index = (
                number if segment == chain[-1] else np.full(len(members), sources.number[segment])
            )
            origin = np.full(len(members), sources.origin[segment])
            first = len(sources.parent)
            new = (parents, origin, index)
            sources = Sources(*(np.concatenate(p) for p in zip(sources, new, strict=True)))
            parents = first + number
        source[members] = parents
    return replace(rows, source=source, sources=sources)


def _reachable(rows: Rows) -> Rows:
    """Only the groups that the root refers to, numbered in that order."""
    order = [0]
    for group in order:
        first, end = rows.ranges[group]
        target = rows.target[first:end]
        order += [
            int(g) for g in first_uses(~target[target < 0], len(rows.ranges)) if g not in order
        ]
    index = np.concatenate([np.arange(*rows.ranges[group]) for group in order])
    sizes = np.diff(rows.ranges[order], axis=1).ravel()
    ends = np.cumsum(sizes)
    place = np.zeros(len(rows.ranges), dtype=np.int64)
    place[order] = np.arange(len(order))
    target = rows.target[index]
    return replace(
        rows,
        ranges=np.stack([ends - sizes, ends], axis=1),
        target=np.where(target < 0, ~place[np.where(target < 0, ~target, 0)], target),
        forward=rows.forward[index],
        inverse=rows.inverse[index],
        low=rows.low[index],
        material=rows.material[index],
        source=rows.source[index],
    )
