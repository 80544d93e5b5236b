"""Scene graph → branches: every run of single-child nodes becomes one edge.

What is left are *branches*, the places where a scene divides, whose *edges* carry everything
between two of them: a chain of elementary steps (batched or not), a material, and the segments
of the object path. A batch ends its run, as the group of n instances that it stands for would.
Branches are numbered children first.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from compiler.provenance import Origins
from compiler.walk import Walk
from dsl.records import node, value
from dsl.scene import Bind, Group, Instances, IntArray, Material, Node, Origin, Step, Transform

# A run this long below a node with several parents is composed once, not once for each parent.
_LONG = 16

NO_MATERIAL = -1

T = TypeVar("T")


Codes = TypeVar("Codes", int, NDArray[np.signedinteger[Any]])


def overriding(material: Codes) -> Codes:
    """The code of a material that overrides all below (see `SceneIR.instance_material`).

    It is its own inverse.
    """
    return -2 - material


def combined(outer: int, inner: int) -> int:
    """The material code of `inner` below `outer`."""
    return outer if outer < NO_MATERIAL or inner == NO_MATERIAL else inner


@value
class Leaf:
    """What a node is that has nothing below it: a number, and a scale that comes before all."""

    number: int
    size: Transform | None = None


Segment = tuple[int, int]
"""One step of an object path: an index of origins, and its number among siblings or -1."""


@value
class Chain:
    """Elementary steps in reading order; `count` lanes.

    One that is composed in parts has them, `apart`, as chains of their own, outermost first.
    """

    steps: tuple[Step, ...]
    count: int
    apart: tuple[int, ...] = ()


@value
class Edge:
    """`count` placements of a leaf (`target` ≥ 0) or a branch (`~target`).

    `chain` is an index of chains, -1 for the identity; `segments` run from the outermost; for a
    batch that adds to the path, `batch` is its origin and `indices` its numbers, None: 0 … n - 1.
    """

    target: int
    chain: int = -1
    count: int = 1
    material: int = NO_MATERIAL
    segments: tuple[Segment, ...] = ()
    batch: int = -1
    indices: IntArray | None = None


@dataclass(slots=True)
class Branches:
    """The branches of a graph, children first; the last is the root."""

    edges: list[tuple[Edge, ...]] = field(default_factory=list)
    orders: dict[int, IntArray] = field(default_factory=dict)  # of the edges' lanes, see Group
    chains: list[Chain] = field(default_factory=list)


_Link = tuple[T, "_Link[T] | None"]
"""A list that shares its tail: the head, outermost first, and what follows."""


@node
class _Run:
    """An edge in the making: what is above may still be added."""

    target: int
    transforms: _Link[Transform] | None = None
    length: int = 0
    material: int = NO_MATERIAL
    segments: _Link[Segment] | None = None


def compress(
    walk: Walk,
    leaf: Callable[[Node], Leaf | None],
    material: Callable[[Material], int],
    origins: Origins,
) -> Branches:
    """The branches of the graph that `walk` went over, down to its leaves.

    `leaf` numbers the nodes that are leaves and answers None for others; `material` numbers
    materials. Nodes without a leaf below them vanish.
    """
    maker = _Compressor(walk, leaf, material, origins)
    runs: dict[int, _Run | None] = {}
    for each in walk.order:
        run = maker.run(each, runs)
        if run and run.length >= _LONG and walk.references.get(id(each), 0) > 1:
            run = maker.close(run)
        runs[id(each)] = run
    root = runs[id(walk.root)]
    maker.branch([maker.edge(root)] if root else [])
    return maker.branches


class _Compressor:
    def __init__(
        self,
        walk: Walk,
        leaf: Callable[[Node], Leaf | None],
        material: Callable[[Material], int],
        origins: Origins,
    ) -> None:
        self.walk, self.leaf, self.material, self.origins = walk, leaf, material, origins
        self.branches = Branches()

    def branch(self, edges: Iterable[Edge]) -> int:
        self.branches.edges.append(tuple(edges))
        return len(self.branches.edges) - 1

    def run(self, node: Node, runs: dict[int, _Run | None]) -> _Run | None:
        """The run that `node` heads, given those of its children."""
        if isinstance(node, Instances):
            return self.placed(node, runs.get(id(node.child)))
        leaf = self.leaf(node)
        if leaf is not None:
            segments = self.segments(leaf.number, None, node.origin)
            if leaf.size is None:
                return _Run(leaf.number, segments=segments)
            size = (leaf.size, None)
            return _Run(leaf.number, size, len(leaf.size.steps), segments=segments)
        children = [runs[id(child)] for child in self.walk.children(node)]
        below = [run for run in children if run]
        if not below:
            return None
        if len(below) == 1:
            run = below[0]
        elif isinstance(node, Group) and node.order is not None:
            run = _Run(~self.ordered(node, children))
        else:
            run = _Run(~self.branch(self.edge(child) for child in below))
        if isinstance(node, Bind):
            code = self.material(node.material)
            outer = overriding(code) if node.override else code
            bound = combined(outer, run.material)
            run = _Run(run.target, run.transforms, run.length, bound, run.segments)
        segments = self.segments(run.target, run.segments, node.origin)
        return run if segments is run.segments else replace(run, segments=segments)

    def placed(self, node: Instances, run: _Run | None) -> _Run | None:
        """The run that `node` heads over that of its child; no lanes place nothing."""
        count = node.transform.count
        if run is None or count == 0:
            return None
        if count is not None and (count > 1 or node.transform.breaks):
            return self.batch(run, node)
        length, transforms = run.length, run.transforms
        if node.transform.steps:
            transform = node.transform if count is None else _first_lane(node.transform)
            length += len(transform.steps)
            transforms = (transform, transforms)
        origin = node.origin
        if count == 1 and origin:
            index = int(node.indices[0]) if node.indices is not None else 0
            origin = replace(origin, index=index)
        segments = self.segments(run.target, run.segments, origin)
        return _Run(run.target, transforms, length, run.material, segments)

    def segments(
        self, target: int, below: _Link[Segment] | None, origin: Origin | None
    ) -> _Link[Segment] | None:
        """A path's segments with one above: what adds to the path, or is a leaf's only place."""
        if origin is None or not (origin.label or (target >= 0 and below is None)):
            return below
        index = -1 if origin.index is None else origin.index
        return (self.origins.index(origin), index), below

    def edge(self, run: _Run) -> Edge:
        """The finished edge of a run that holds no batch."""
        steps = _steps(run.transforms)
        return Edge(
            target=run.target,
            chain=self.chain(Chain(steps, 1)) if steps else -1,
            material=run.material,
            segments=_items(run.segments),
        )

    def close(self, run: _Run) -> _Run:
        """A new run over a branch with `run` as its only edge."""
        return _Run(~self.branch([self.edge(run)]))

    def batch(self, run: _Run, node: Instances) -> _Run:
        """A new run over a branch with the batch `node` over `run` as its only edge."""
        count = node.transform.count or 1
        inner = _steps(run.transforms)
        transform = node.transform if count > 1 else _first_lane(node.transform)
        steps = (*inner, *transform.steps)
        labelled = node.origin is not None and node.origin.label
        places = (len(inner) + place for place in node.transform.breaks)
        breaks = sorted({0, *places, len(steps)})
        apart = [
            self.chain(Chain(steps[start:end], count))
            for start, end in pairwise(breaks)
            if len(breaks) > 2
        ]
        batch = Edge(
            target=run.target,
            chain=self.chain(Chain(steps, count, tuple(apart[::-1]))),
            count=count,
            material=run.material,
            segments=_items(run.segments),
            batch=self.origins.index(node.origin) if node.origin and labelled else -1,
            indices=node.indices if labelled else None,
        )
        if count == 1 and batch.batch >= 0:
            number = int(batch.indices[0]) if batch.indices is not None else 0
            segments = ((batch.batch, number), *batch.segments)
            batch = replace(batch, segments=segments, batch=-1, indices=None)
        return _Run(~self.branch([batch]))

    def ordered(self, node: Group, runs: Sequence[_Run | None]) -> int:
        """The branch of a group whose batches' lanes have an order of their own."""
        assert node.order is not None
        counts = [_lanes(item) for item in node.items]
        order = node.order
        if None in runs:
            exists = np.repeat([run is not None for run in runs], counts)
            order = (np.cumsum(exists) - 1)[order[exists[order]]]
        edges = []
        for run, item in zip(runs, node.items, strict=True):
            if run is None:
                continue
            if _lanes(item) == 1:
                edges.append(self.edge(run))
            else:
                (batch,) = self.branches.edges[~run.target]
                edges.append(batch)
                if self.walk.references[id(item)] == 1:
                    self.branches.edges[~run.target] = ()
        branch = self.branch(edges)
        self.branches.orders[branch] = order
        return branch

    def chain(self, chain: Chain) -> int:
        self.branches.chains.append(chain)
        return len(self.branches.chains) - 1


def _lanes(node: Node) -> int:
    count = node.transform.count if isinstance(node, Instances) else None
    return 1 if count is None else count


def _items(link: _Link[T] | None) -> tuple[T, ...]:
    items: list[T] = []
    while link:
        head, link = link
        items.append(head)
    return tuple(items)


def _steps(transforms: _Link[Transform] | None) -> tuple[Step, ...]:
    if transforms is not None and transforms[1] is None:
        return transforms[0].steps
    steps: list[Step] = []
    for transform in reversed(_items(transforms)):
        steps += transform.steps
    return tuple(steps)


def _first_lane(transform: Transform) -> Transform:
    return Transform(
        tuple(
            Step(s.kind, s.values.reshape(-1, s.values.shape[-1])[0], s.inverse)
            for s in transform.steps
        )
    )
