"""Branches → tables: which groups are kept, and the leaves of each group in order of emission.

Keep or flatten. A branch that is placed more than once is a candidate to be kept as a group of
the IR. While the scene has at most `FLATTEN_LEAVES` leaves in all, every candidate is flattened:
one level is the fastest to trace. Beyond that a candidate is kept unless flattening it adds at
most `FLATTEN_ROWS` rows to the tables it is placed in, so memory grows with what was written, not
with what it multiplies out to.

Tables are integers only; matrices come later (`compiler.place`). Within a group the *frames* form
a tree: each is placed in its parent (-1: the group's own space) by one lane of one chain.
"""

from __future__ import annotations

from array import array
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from compiler.compress import NO_MATERIAL, Branches, Edge, combined, overriding
from compiler.ir import COUNTED

FLATTEN_LEAVES = 1 << 22
FLATTEN_ROWS = 1 << 16

Integers = NDArray[np.signedinteger[Any]]


def _integers() -> array[int]:
    return array("i")


@dataclass(slots=True)
class Table:
    """The leaves of one group in order of emission, its frames and its source segments."""

    frame_parent: array[int] = field(default_factory=_integers)
    frame_chain: array[int] = field(default_factory=_integers)
    frame_lane: array[int] = field(default_factory=_integers)
    leaf_frame: array[int] = field(default_factory=_integers)
    leaf_target: array[int] = field(default_factory=_integers)  # a leaf, or ~branch if kept
    leaf_material: array[int] = field(default_factory=_integers)
    leaf_source: array[int] = field(default_factory=_integers)
    source_parent: array[int] = field(default_factory=_integers)
    source_origin: array[int] = field(default_factory=_integers)
    source_index: array[int] = field(default_factory=_integers)


@dataclass(frozen=True, slots=True)
class Plan:
    """For each branch: its leaves with all below expanded, its placements, whether it is kept.

    `levels` is the depth of kept groups below each branch.
    """

    leaves: list[int]
    placements: list[int]
    kept: list[bool]
    levels: list[int]

    @property
    def all_flat(self) -> bool:
        """Whether the scene is so small that every branch is flattened."""
        return self.leaves[-1] <= FLATTEN_LEAVES


def plan(branches: Branches) -> Plan:
    """Count and decide (see above)."""
    count = len(branches.edges)
    leaves, placements = [0] * count, [0] * count
    for branch, edges in enumerate(branches.edges):
        for edge in edges:
            leaves[branch] += edge.count * (leaves[~edge.target] if edge.target < 0 else 1)
            if edge.target < 0:
                placements[~edge.target] += edge.count
    kept, levels = [False] * count, [0] * count
    rows = [0] * count
    planned = Plan(leaves, placements, kept, levels)
    for branch, edges in enumerate(branches.edges):
        for edge in edges:
            below = ~edge.target
            if edge.target >= 0:
                rows[branch] += edge.count
            else:
                rows[branch] += edge.count * (1 if kept[below] else rows[below])
                levels[branch] = max(levels[branch], levels[below] + kept[below])
        if not planned.all_flat and placements[branch] > 1:
            kept[branch] = (placements[branch] - 1) * rows[branch] > FLATTEN_ROWS
    return planned


def expand(branches: Branches, plan: Plan) -> dict[int, Table]:
    """The tables of the root (the last branch) and of every kept branch, by branch.

    Groups come in the order in which the tables refer to them, the root first.
    """
    root = len(branches.edges) - 1
    tables: dict[int, Table] = {}
    for branch, placements in enumerate(plan.placements):
        if placements > 1 or branch == root:
            tables[branch] = _table(branch, branches, plan, tables)
    groups = {root: tables[root]}
    queue = [root]
    for group in queue:
        targets = np.frombuffer(tables[group].leaf_target, dtype=np.int32)
        below, first = np.unique(~targets[targets < 0], return_index=True)
        new = [int(g) for g in below[np.argsort(first)] if int(g) not in groups]
        groups.update((g, tables[g]) for g in new)
        queue += new
    return groups


def joined(tables: Iterable[Table]) -> Table:
    """One table of all `tables`, one after the other; branches stay what they were."""
    first, *others = tables
    if not others:
        return first
    maker = _Maker()
    for table in (first, *others):
        maker.copies(Edge(0), -1, NO_MATERIAL, -1, table)
    return maker.table


def _table(branch: int, branches: Branches, plan: Plan, tables: dict[int, Table]) -> Table:
    """Expand one branch; branches placed once are expanded in place, others copied if not kept."""
    maker = _Maker()
    stack = [(branch, iter(branches.edges[branch]), -1, NO_MATERIAL, -1)]
    starts: list[int] = []  # the first leaf of every edge, in ordered branches only
    while stack:
        number, edges, frame, material, source = stack[-1]
        edge = next(edges, None)
        if number in branches.orders:
            starts.append(len(maker.table.leaf_frame))
        if edge is None:
            stack.pop()
            if number in branches.orders:
                edge_count = len(branches.edges[number]) + 1
                lanes = [each.count for each in branches.edges[number]]
                maker.reorder(starts[-edge_count:], lanes, branches.orders[number])
                del starts[-edge_count:]
        elif edge.target >= 0 or plan.kept[~edge.target]:
            maker.leaves(edge, frame, material, source)
        elif plan.placements[~edge.target] == 1:
            inner = maker.below(edge, frame, material, source)
            stack.append((~edge.target, iter(branches.edges[~edge.target]), *inner))
        else:
            maker.copies(edge, frame, material, source, tables[~edge.target])
    return maker.table


class _Maker:
    def __init__(self) -> None:
        self.table = Table()

    def below(self, edge: Edge, frame: int, material: int, source: int) -> tuple[int, int, int]:
        """Frame, material and source below a single placement."""
        t = self.table
        if edge.chain >= 0:
            t.frame_parent.append(frame)
            t.frame_chain.append(edge.chain)
            t.frame_lane.append(0)
            frame = len(t.frame_parent) - 1
        for origin, index in edge.segments:
            t.source_parent.append(source)
            t.source_origin.append(origin)
            t.source_index.append(index)
            source = len(t.source_parent) - 1
        return frame, combined(material, edge.material), source

    def lane_frames(self, edge: Edge, frame: int) -> Integers:
        """One frame for each lane of a batch."""
        t = self.table
        first = len(t.frame_parent)
        _extend(t.frame_parent, np.full(edge.count, dtype=np.int32, fill_value=frame))
        _extend(t.frame_chain, np.full(edge.count, dtype=np.int32, fill_value=edge.chain))
        _extend(t.frame_lane, np.arange(edge.count, dtype=np.int32))
        return first + np.arange(edge.count, dtype=np.int32)

    def lane_sources(self, edge: Edge, source: int) -> Integers:
        """Each lane's source: segments of its own where the batch adds to the path."""
        t = self.table
        parents = np.full(edge.count if edge.batch >= 0 else 1, source)
        segments = [(origin, np.full(len(parents), index)) for origin, index in edge.segments]
        if edge.batch >= 0:
            indices = (
                np.arange(edge.count, dtype=np.int32) if edge.indices is None else edge.indices
            )
            segments.insert(0, (edge.batch, indices))
        for origin, index in segments:
            first = len(t.source_parent)
            _extend(t.source_parent, parents)
            _extend(t.source_origin, np.full(len(parents), origin))
            _extend(t.source_index, index)
            parents = first + np.arange(len(parents))
        return np.broadcast_to(parents, edge.count)

    def leaves(self, edge: Edge, frame: int, material: int, source: int) -> None:
        """A leaf, or a batch of them."""
        t = self.table
        material = combined(material, edge.material)
        if edge.target >= 0 and material < NO_MATERIAL:
            material = overriding(material)  # nothing is below a leaf that could be overridden
        if edge.count == 1:
            frame, _, source = self.below(edge, frame, material, source)
            t.leaf_frame.append(frame)
            t.leaf_target.append(edge.target)
            t.leaf_material.append(material)
            t.leaf_source.append(source)
            return
        _extend(t.leaf_frame, self.lane_frames(edge, frame))
        _extend(t.leaf_target, np.full(edge.count, dtype=np.int32, fill_value=edge.target))
        _extend(t.leaf_material, np.full(edge.count, dtype=np.int32, fill_value=material))
        if edge.indices is None and edge.batch >= 0:
            # Lanes numbered in order need no segment each: they are counted (see ir.COUNTED).
            t.source_parent.append(source)
            t.source_origin.append(edge.batch)
            t.source_index.append(COUNTED)
            source = len(t.source_parent) - 1
            for origin, index in edge.segments:
                t.source_parent.append(source)
                t.source_origin.append(origin)
                t.source_index.append(index)
                source = len(t.source_parent) - 1
            _extend(t.leaf_source, np.full(edge.count, dtype=np.int32, fill_value=source))
        else:
            _extend(t.leaf_source, self.lane_sources(edge, source))

    def reorder(self, starts: Sequence[int], lanes: Sequence[int], order: Integers) -> None:
        """Put the lanes of edges, whose leaves begin at `starts` and end at the last, in order."""
        sizes = np.diff(starts) // lanes
        first = np.concatenate(
            [s + size * np.arange(n) for s, size, n in zip(starts, sizes, lanes, strict=False)]
        )[order]
        size = np.repeat(sizes, lanes)[order]
        within = np.arange(size.sum()) - np.repeat(np.cumsum(size) - size, size)
        rows = np.repeat(first, size) + within
        t = self.table
        for column in (t.leaf_frame, t.leaf_target, t.leaf_material, t.leaf_source):
            leaves = np.frombuffer(column, dtype=np.int32)
            leaves[starts[0] : starts[-1]] = leaves[rows]

    def copies(self, edge: Edge, frame: int, material: int, source: int, inner: Table) -> None:
        """`edge.count` copies of a whole table."""
        t, count = self.table, edge.count
        if count == 1:
            frame, material, source = self.below(edge, frame, material, source)
            frames, sources = np.full(1, frame), np.full(1, source)
        else:
            material = combined(material, edge.material)
            frames = self.lane_frames(edge, frame)
            sources = self.lane_sources(edge, source)
        first_frame, first_source = len(t.frame_parent), len(t.source_parent)
        _extend(t.frame_parent, _placed(inner.frame_parent, frames, first_frame))
        _extend(t.frame_chain, _tiled(inner.frame_chain, count))
        _extend(t.frame_lane, _tiled(inner.frame_lane, count))
        _extend(t.source_parent, _placed(inner.source_parent, sources, first_source))
        _extend(t.source_origin, _tiled(inner.source_origin, count))
        _extend(t.source_index, _tiled(inner.source_index, count))
        frame_count, source_count = len(inner.frame_parent), len(inner.source_parent)
        _extend(t.leaf_frame, _placed(inner.leaf_frame, frames, first_frame, frame_count))
        _extend(t.leaf_source, _placed(inner.leaf_source, sources, first_source, source_count))
        _extend(t.leaf_target, _tiled(inner.leaf_target, count))
        materials = _tiled(inner.leaf_material, count)
        if material < NO_MATERIAL:
            prototypes = _tiled(inner.leaf_target, count) >= 0
            materials = np.where(prototypes, overriding(material), material)
        elif material > NO_MATERIAL:
            materials = np.where(materials == NO_MATERIAL, material, materials)
        _extend(t.leaf_material, materials)


def _extend(column: array[int], values: Integers) -> None:
    column.frombytes(np.ascontiguousarray(values, dtype=np.int32).view(np.uint8).data)


def _tiled(column: array[int], count: int) -> Integers:
    return np.tile(np.frombuffer(column, dtype=np.int32), count)


def _placed(column: array[int], tops: Integers, first: int, stride: int | None = None) -> Integers:
    """References within a table, for a copy below each of `tops`; -1 becomes the top itself.

    Copy i holds rows from `first + i · stride`; the stride is the table's length, which is that
    of the column itself unless given.
    """
    inner = np.frombuffer(column, dtype=np.int32)
    stride = len(inner) if stride is None else stride
    offsets = first + stride * np.arange(len(tops))
    return np.where(inner < 0, tops[:, None], inner + offsets[:, None]).ravel()
