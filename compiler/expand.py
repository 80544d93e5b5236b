"""Branches → tables: which groups are kept, and the leaves of each group in order of emission.

Keep or flatten. A branch that is placed more than once is a candidate to be kept as a group of
the IR. While the scene has at most `FLATTEN_LEAVES` leaves in all, every candidate is flattened:
one level is the fastest to trace. Beyond that a candidate is kept unless flattening it adds at
most `FLATTEN_ROWS` rows to the tables it is placed in, so memory grows with what was written, not
with what it multiplies out to.

Tables are integers only; matrices come later (`compiler.place`). Within a group the *frames* form
a tree: each is placed in its parent (-1: the group's own space) by one lane of one chain, and so is
each leaf. Lanes are numbered through all chains.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from compiler.column import Column, Integers
from compiler.compress import NO_MATERIAL, Branches, Chain, Edge, combined, overriding
from compiler.ir import COUNTED
from dsl.records import value

FLATTEN_LEAVES = 1 << 22
FLATTEN_ROWS = 1 << 16


class Table:
    """The leaves of one group in order of emission, its frames and its source segments.

    There is room for `leaves` of them with a frame and two segments each, and may be made for more.
    """

    def __init__(self, leaves: int) -> None:
        self.frame_parent = Column(leaves)
        self.frame_lane = Column(leaves)
        self.leaf_frame = Column(leaves)
        self.leaf_lane = Column(leaves)  # -1 only where the frame is, too
        self.leaf_target = Column(leaves)  # a leaf, or ~branch if kept
        self.leaf_material = Column(leaves)
        self.leaf_source = Column(leaves)
        self.source_parent = Column(2 * leaves)
        self.source_origin = Column(2 * leaves)
        self.source_index = Column(2 * leaves)


@value
class Plan:
    """For each branch: its leaves with all below expanded, its placements, whether it is kept.

    `levels` is the depth of kept groups below each branch, `rows` are those of its table.
    """

    leaves: list[int]
    placements: list[int]
    kept: list[bool]
    levels: list[int]
    rows: list[int]

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
    planned = Plan(leaves, placements, kept, levels, rows)
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


def first_lanes(chains: Sequence[Chain]) -> Integers:
    """The number of each chain's first lane."""
    counts = np.array([chain.count for chain in chains], dtype=np.int64)
    return np.cumsum(counts) - counts


def expand(branches: Branches, plan: Plan) -> dict[int, Table]:
    """The tables of the root (the last branch) and of every kept branch, by branch.

    Groups come in the order in which the tables refer to them, the root first.
    """
    root = len(branches.edges) - 1
    tables: dict[int, Table] = {}
    first = first_lanes(branches.chains)
    for branch, placements in enumerate(plan.placements):
        if placements > 1 or branch == root:
            tables[branch] = _table(branch, branches, plan, tables, first)
    groups = {root: tables[root]}
    queue = [root]
    for group in queue:
        targets = tables[group].leaf_target.numbers
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
    maker = _Maker(sum(len(table.leaf_target) for table in (first, *others)), (), np.empty(0, int))
    for table in (first, *others):
        maker.copies(Edge(0), -1, NO_MATERIAL, -1, table)
    return maker.table


def _table(
    branch: int, branches: Branches, plan: Plan, tables: dict[int, Table], first: Integers
) -> Table:
    """Expand one branch; branches placed once are expanded in place, others copied if not kept."""
    maker = _Maker(plan.rows[branch], branches.chains, first)
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
    def __init__(self, leaves: int, chains: Sequence[Chain], first: Integers) -> None:
        self.table = Table(leaves)
        self.chains = chains
        self.first = first

    def below(self, edge: Edge, frame: int, material: int, source: int) -> tuple[int, int, int]:
        """Frame, material and source below a single placement."""
        frame = self.frame(self.parts(edge.chain), frame)
        return frame, combined(material, edge.material), self.source(edge, source)

    def frame(self, chains: Sequence[int], frame: int) -> int:
        """The innermost of frames, one for each chain."""
        t = self.table
        for chain in chains:
            t.frame_parent.append(frame)
            t.frame_lane.append(int(self.first[chain]))
            frame = len(t.frame_parent) - 1
        return frame

    def source(self, edge: Edge, source: int) -> int:
        """The innermost of an edge's segments."""
        t = self.table
        for origin, index in edge.segments:
            t.source_parent.append(source)
            t.source_origin.append(origin)
            t.source_index.append(index)
            source = len(t.source_parent) - 1
        return source

    def lane_frames(self, chains: Sequence[int], count: int, frame: int) -> Integers | int:
        """The innermost frame for each lane of a batch."""
        t = self.table
        lanes = np.arange(count, dtype=np.int32)
        frames: Integers | int = frame
        for chain in chains:
            first = len(t.frame_parent)
            t.frame_parent.extend(frames, count)
            t.frame_lane.extend(lanes + np.int32(self.first[chain]), count)
            frames = first + lanes
        return frames

    def parts(self, chain: int) -> tuple[int, ...]:
        """The chains that are frames of their own, outermost first."""
        return () if chain < 0 else self.chains[chain].apart or (chain,)

    def lane_sources(self, edge: Edge, source: int) -> Integers:
        """Each lane's source: segments of its own where the batch adds to the path."""
        t = self.table
        count = edge.count if edge.batch >= 0 else 1
        segments: list[tuple[int, Integers | int]] = [*edge.segments]
        if edge.batch >= 0:
            indices = np.arange(count, dtype=np.int32) if edge.indices is None else edge.indices
            segments.insert(0, (edge.batch, indices))
        parents = np.full(count, source, dtype=np.int32)
        for origin, index in segments:
            first = len(t.source_parent)
            t.source_parent.extend(parents, count)
            t.source_origin.extend(origin, count)
            t.source_index.extend(index, count)
            parents = np.arange(first, first + count, dtype=np.int32)
        return np.broadcast_to(parents, edge.count)

    def leaves(self, edge: Edge, frame: int, material: int, source: int) -> None:
        """A leaf, or a batch of them."""
        t = self.table
        material = combined(material, edge.material)
        if edge.target >= 0 and material < NO_MATERIAL:
            material = overriding(material)  # nothing is below a leaf that could be overridden
        *outer, own = self.parts(edge.chain) or (-1,)
        if edge.count == 1:
            frame = self.frame(outer, frame)
            frame, lane = (frame, int(self.first[own])) if own >= 0 else self.last_of(frame)
            t.leaf_frame.append(frame)
            t.leaf_lane.append(lane)
            t.leaf_target.append(edge.target)
            t.leaf_material.append(material)
            t.leaf_source.append(self.source(edge, source))
            return
        # The lanes of a batch have a chain.
        t.leaf_frame.extend(self.lane_frames(outer, edge.count, frame), edge.count)
        t.leaf_lane.extend(
            np.arange(edge.count, dtype=np.int32) + np.int32(self.first[own]), edge.count
        )
        t.leaf_target.extend(edge.target, edge.count)
        t.leaf_material.extend(material, edge.count)
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
            t.leaf_source.extend(source, edge.count)
        else:
            t.leaf_source.extend(self.lane_sources(edge, source), edge.count)

    def last_of(self, frame: int) -> tuple[int, int]:
        """The frame around a frame, and the lane that places it there."""
        t = self.table
        if frame < 0:
            return -1, -1
        return int(t.frame_parent.numbers[frame]), int(t.frame_lane.numbers[frame])

    def reorder(self, starts: Sequence[int], lanes: Sequence[int], order: Integers) -> None:
        """Put the lanes of edges, whose leaves begin at `starts` and end at the last, in order."""
        sizes = np.diff(starts) // lanes
        rows = starts[0] + order
        if (sizes != 1).any():
            first = np.concatenate(
                [s + size * np.arange(n) for s, size, n in zip(starts, sizes, lanes, strict=False)]
            )[order]
            size = np.repeat(sizes, lanes)[order]
            within = np.arange(size.sum()) - np.repeat(np.cumsum(size) - size, size)
            rows = np.repeat(first, size) + within
        t = self.table
        columns = t.leaf_frame, t.leaf_lane, t.leaf_target, t.leaf_material, t.leaf_source
        for column in columns:
            leaves = column.numbers
            leaves[starts[0] : starts[-1]] = leaves[rows]

    def copies(self, edge: Edge, frame: int, material: int, source: int, inner: Table) -> None:
        """`edge.count` copies of a whole table."""
        t, count = self.table, edge.count
        if count == 1:
            frame, material, source = self.below(edge, frame, material, source)
            frames, sources = np.full(1, frame), np.full(1, source)
        else:
            material = combined(material, edge.material)
            chains = self.parts(edge.chain)
            frames = np.broadcast_to(self.lane_frames(chains, count, frame), count)
            sources = self.lane_sources(edge, source)
        first_frame, first_source = len(t.frame_parent), len(t.source_parent)
        _extend(t.frame_parent, _placed(inner.frame_parent, frames, first_frame))
        _extend(t.frame_lane, _tiled(inner.frame_lane, count))
        _extend(t.source_parent, _placed(inner.source_parent, sources, first_source))
        _extend(t.source_origin, _tiled(inner.source_origin, count))
        _extend(t.source_index, _tiled(inner.source_index, count))
        frame_count, source_count = len(inner.frame_parent), len(inner.source_parent)
        leaf_frames = _placed(inner.leaf_frame, frames, first_frame, frame_count)
        leaf_lanes = _tiled(inner.leaf_lane, count)
        bare = np.flatnonzero((leaf_lanes < 0) & (leaf_frames >= 0))
        if len(bare):
            around = leaf_frames[bare]
            leaf_frames[bare] = t.frame_parent.numbers[around]
            leaf_lanes[bare] = t.frame_lane.numbers[around]
        _extend(t.leaf_frame, leaf_frames)
        _extend(t.leaf_lane, leaf_lanes)
        _extend(t.leaf_source, _placed(inner.leaf_source, sources, first_source, source_count))
        _extend(t.leaf_target, _tiled(inner.leaf_target, count))
        materials = _tiled(inner.leaf_material, count)
        if material < NO_MATERIAL:
            prototypes = _tiled(inner.leaf_target, count) >= 0
            materials = np.where(prototypes, overriding(material), material)
        elif material > NO_MATERIAL:
            materials = np.where(materials == NO_MATERIAL, material, materials)
        _extend(t.leaf_material, materials)


def _extend(column: Column, numbers: Integers) -> None:
    column.extend(numbers, len(numbers))


def _tiled(column: Column, count: int) -> Integers:
    return np.tile(column.numbers, count)


def _placed(column: Column, tops: Integers, first: int, stride: int | None = None) -> Integers:
    """References within a table, for a copy below each of `tops`; -1 becomes the top itself.

    Copy i holds rows from `first + i · stride`; the stride is the table's length, which is that
    of the column itself unless given.
    """
    inner = column.numbers
    stride = len(inner) if stride is None else stride
    offsets = first + stride * np.arange(len(tops))
    return np.where(inner < 0, tops[:, None], inner + offsets[:, None]).ravel()
