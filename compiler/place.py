"""Frames → matrices: every leaf's placement in its group, in double-double, rounded once."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from compiler.affine import STILL, Placement, scatter_placements
from compiler.column import Integers
from compiler.compress import Chain
from compiler.double_double import Part
from compiler.expand import Table, first_lanes
from compiler.transforms import Factor, compose, compose_many, prepared

# Lanes worked on at once: few enough that their matrices stay in the caches.
_CHUNK = 8192
# Chains of more lanes are composed when they are needed, and not held in double-double.
_LARGE = 8192
# A low part below this fraction of its number is less than the rounding of `translation_low`.
_NOISE = 2.0**-80


class Large(NamedTuple):
    """A chain that is composed when it is needed, and the number of its first lane."""

    factor: Factor
    first: int


class Chunk(NamedTuple):
    """Some leaves: of one large chain, or of the others."""

    leaves: slice | Integers
    chain: Large | None


class Frames:
    """The frames of a table, ready to be evaluated for any of its leaves.

    A frame d levels deep is the product of d placements: the outer d - 1 in pairs, pairs of
    pairs and so on from the inside, times its own. Which products are made depends on d only.
    """

    def __init__(self, chains: Sequence[Chain], table: Table) -> None:
        self._chains = chains
        self._parent = table.frame_parent.numbers
        self._lane = table.frame_lane.numbers
        self._leaf_frame = table.leaf_frame.numbers
        self._leaf_lane = table.leaf_lane.numbers
        self._first = first_lanes(chains)
        self._large = np.array([chain.count > _LARGE for chain in chains], dtype=bool)
        self._pool, self._place = self._pooled()
        parents = np.zeros(len(self._parent) + 1, dtype=bool)
        parents[self._parent] = True
        parents[self._leaf_frame] = True
        parents[-1] = False  # which stands for the group's own space
        self._inner = np.flatnonzero(parents)
        self._outer = self._inner_placements(self._inner)

    def chunks(self) -> Iterator[Chunk]:
        """All leaves, some at a time."""
        for number, run in _grouped(self._large_chain(self._leaf_lane)):
            chain = self._prepared(number)
            for a in range(0, len(run), _CHUNK):
                leaves = run[a : a + _CHUNK]
                first, last = int(leaves[0]), int(leaves[-1])
                whole = last - first + 1 == len(leaves)
                chosen = slice(first, last + 1) if whole else np.asarray(leaves)
                yield Chunk(chosen, chain)

    def _prepared(self, chain: int) -> Large | None:
        if chain < 0:
            return None
        return Large(prepared(self._chains[chain].steps), int(self._first[chain]))

    def _large_chain(self, lanes: Integers) -> Integers:
        """The chain of each lane if it is large, else -1."""
        chains = np.full(len(lanes), -1, dtype=np.int32)
        large = np.flatnonzero(self._large)
        if not len(large):
            return chains
        firsts = self._first[large]
        ends = firsts + [self._chains[chain].count for chain in large.tolist()]
        for start in range(0, len(lanes), _CHUNK):
            some = lanes[start : start + _CHUNK]
            near = np.searchsorted(firsts, some, side="right") - 1
            within = (near >= 0) & (some < ends[near])
            chains[start : start + _CHUNK][within] = large[near[within]]
        return chains

    def placements(self, chunk: Chunk) -> Placement:
        """The placements of some leaves."""
        with np.errstate(all="ignore"):
            return self._placements(chunk)

    def _placements(self, chunk: Chunk) -> Placement:
        parent, lane = self._leaf_frame[chunk.leaves], self._leaf_lane[chunk.leaves]
        own = self._of_lanes(lane, chunk.chain)
        if (parent < 0).all():
            return own
        if (parent == parent[0]).all():
            return self._outer.take(int(self._outer_lane(parent[0]))) @ own
        placed = np.flatnonzero(parent >= 0)
        free = np.flatnonzero(parent < 0)
        product = self._outer.take(self._outer_lane(parent[placed])) @ own.take(placed)
        return scatter_placements([(product, placed), (own.take(free), free)], len(parent))

    def _of_lanes(self, lanes: Integers, large: Large | None) -> Placement:
        """What some lanes place, of a large chain or of the pool."""
        if large is None:
            return self._pool.take(self._pool_lane(lanes))
        return _lanes(large.factor, lanes - large.first)

    def _outer_lane(self, frame: Integers) -> Integers:
        """Where `_outer` holds the placement of a frame that has frames in it."""
        return np.searchsorted(self._inner, frame)

    def _pool_lane(self, lanes: Integers) -> Integers:
        """Where the pool holds what some lanes place: first the identity, for lane -1."""
        if not len(self._chains):
            return np.zeros(len(lanes), dtype=np.int64)
        chain = np.searchsorted(self._first, lanes, side="right") - 1
        return np.where(lanes < 0, 0, self._place[chain] + lanes - self._first[chain])

    def _pooled(self) -> tuple[Placement, Integers]:
        """All lanes of all chains but the large ones, and the first of each chain."""
        counts = np.where(self._large, 0, [chain.count for chain in self._chains]).astype(np.int64)
        first = 1 + np.cumsum(counts) - counts
        single = np.flatnonzero(counts == 1)
        parts = [(STILL, np.zeros(1, dtype=np.int64))]
        if len(single):
            parts.append(
                (compose_many([self._chains[c].steps for c in single.tolist()]), first[single])
            )
        parts += [
            (compose(self._chains[c].steps), first[c] + np.arange(counts[c]))
            for c in np.flatnonzero(counts > 1).tolist()
        ]
        return scatter_placements(parts, int(1 + counts.sum())), first

    def _inner_placements(self, frames: Integers) -> Placement:
        """The placements of frames that have frames in them, by doubling the known way upwards."""
        if not len(frames):
            return STILL
        parts: list[tuple[Placement, Integers]] = []
        lanes = self._lane[frames]
        large = self._large_chain(lanes)
        for chain in np.unique(large).tolist():
            where = np.flatnonzero(large == chain)
            parts.append((self._of_lanes(lanes[where], self._prepared(chain)), where))
        known = scatter_placements(parts, len(frames))
        parents = self._parent[frames]
        above = np.where(parents < 0, -1, self._outer_lane(parents))
        with np.errstate(all="ignore"):
            while (above >= 0).any():
                rest = np.flatnonzero(above >= 0)
                done = np.flatnonzero(above < 0)
                product = known.take(above[rest]) @ known.take(rest)
                parts = [(product, rest), (known.take(done), done)]
                known = scatter_placements(parts, len(frames))
                above[rest] = above[above[rest]]
        return known


def _grouped(numbers: Integers) -> Iterator[tuple[int, range | Integers]]:
    """Where each of the `numbers` stands; ranges if all stand in few runs, as batches do."""
    starts = np.append(0, np.flatnonzero(numbers[1:] != numbers[:-1]) + 1)[: len(numbers)]
    if len(starts) * _CHUNK <= len(numbers):
        for start, end in zip(starts, np.append(starts[1:], len(numbers)), strict=False):
            yield int(numbers[start]), range(int(start), int(end))
        return
    order = np.argsort(numbers, kind="stable")
    ends = np.flatnonzero(np.diff(numbers[order], append=-2)) + 1
    for where in np.split(order, ends[:-1]):
        yield int(numbers[where[0]]), where


def _lanes(chain: Factor, lanes: Integers) -> Placement:
    """Some lanes of a chain; runs of them are views of its values."""
    if len(lanes) and (np.diff(lanes) == 1).all():
        return chain.lanes(slice(int(lanes[0]), int(lanes[-1]) + 1))
    return chain.lanes(lanes)


def matrices(
    frames: Frames, count: int, limit: float
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float32], NDArray[np.bool_]]:
    """All leaves: world_from_object, object_from_world, translation_low; whether both are ordinary.

    They are where no number of them exceeds `limit`.
    """
    forward, inverse = np.empty((count, 3, 4)), np.empty((count, 3, 4))
    low = np.zeros((count, 3), dtype=np.float32)
    ordinary = np.empty(count, dtype=bool)

    def fill(chunk: Chunk) -> None:
        placement, leaves = frames.placements(chunk), chunk.leaves
        for out, affine in (forward, placement.forward), (inverse, placement.inverse):
            if isinstance(leaves, slice):
                affine.round_into(out[leaves])
            else:
                rows = np.empty((len(leaves), 3, 4))
                affine.round_into(rows)
                out[leaves] = rows
        for axis, entry in enumerate(placement.forward.translation):
            if np.any(entry.lo):
                low[leaves, axis] = _significant(entry.lo, entry.hi)
        ordinary[leaves] = placement.forward.is_within(limit) & placement.inverse.is_within(limit)

    _each(fill, list(frames.chunks()))
    return forward, inverse, low, ordinary


def _each(fill: Callable[[Chunk], None], chunks: Sequence[Chunk]) -> None:
    """Fill all chunks, several at a time: NumPy computes without the interpreter's lock."""
    if len(chunks) < 2:
        for chunk in chunks:
            fill(chunk)
        return
    from concurrent.futures import ThreadPoolExecutor

    pending = iter(chunks)

    def work() -> None:
        for chunk in pending:
            fill(chunk)

    # This thread takes part: its heap has holes enough, another thread's is its own.
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        others = [pool.submit(work) for _ in range((os.cpu_count() or 1) - 1)]
        work()
        for other in others:
            other.result()


def _significant(lo: Part, hi: Part) -> NDArray[np.float32] | np.float32:
    """`lo` where it says something about `hi` and float32 can hold it, else 0 without sign."""
    with np.errstate(invalid="ignore"):
        says = (np.abs(lo) > _NOISE * np.abs(hi)) & (np.abs(lo) < np.finfo(np.float32).max)
    return np.where(says, lo, 0.0).astype(np.float32) + np.float32(0.0)
