"""Branches of a scene (`compiler.compress`) as prims."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pxr import Sdf

from compiler.compress import NO_MATERIAL, Branches, Edge
from compiler.provenance import Origins
from compiler.usd_export import ExportOptions
from compiler.usd_export.instancer import is_sayable, write_instances
from compiler.usd_export.layer import child, identifier, matrices, place, relationship
from compiler.usd_export.looks import Looks
from compiler.usd_export.shapes import Leaf, inner_steps, is_heavy, leaf_name, write_leaf
from dsl.scene import FloatArray, IntArray, Step, StepKind

DEEPEST = 100
"""Levels of prims that are written in place; what is deeper becomes a class of its own."""


@dataclass(slots=True)
class Writer:
    """Writes branches below a root prim.

    Every branch, and every leaf with points, that is used more than once is written once, as a
    class below `Prototypes`.
    """

    root: Any
    branches: Branches
    leaves: Sequence[Leaf]
    origins: Origins
    looks: Looks
    options: ExportOptions
    _labels: list[str] = field(default_factory=list)
    _composed: dict[int, tuple[FloatArray, NDArray[np.bool_]]] = field(default_factory=dict)
    _sayable: dict[int, bool] = field(default_factory=dict)
    _uses: dict[int, int] = field(default_factory=dict)
    _classes: dict[int, Any] = field(default_factory=dict)
    _pending: list[tuple[int, Any, int]] = field(default_factory=list)

    def write(self) -> None:
        """Write everything that the last branch, the scene's root, refers to."""
        last = len(self.branches.edges) - 1
        self._labels = [key[4] for key in self.origins.numbers]
        self._uses = self._counted(last)
        self._pending.append((~last, self.root, 1))
        while self._pending:
            target, prim, depth = self._pending.pop()
            if target >= 0:
                self._leaf(prim, target)
                continue
            for edges in self._runs(self._edges(~target)):
                self._place(prim, edges, depth + 1)

    def _counted(self, last: int) -> dict[int, int]:
        """How often each target is written, native instances of a batch each for itself."""
        uses: dict[int, int] = {}
        stack = [last]
        while stack:
            for edge in self.branches.edges[stack.pop()]:
                if edge.target < 0 and edge.target not in uses:
                    stack.append(~edge.target)
                times = 2 if edge.count > 1 and not self._is_instanced(edge) else 1
                uses[edge.target] = uses.get(edge.target, 0) + times
        return uses

    def _edges(self, branch: int) -> tuple[Edge, ...]:
        """The edges of a branch, with those of branches that only it uses and says nothing of."""
        edges: list[Edge] = []
        stack = list(reversed(self.branches.edges[branch]))
        while stack:
            edge = stack.pop()
            below = self.branches.edges[~edge.target] if self._is_plain(edge) else ()
            if below and not edge.segments:
                stack += reversed(below)
            elif len(below) == 1:
                stack.append(replace(below[0], segments=edge.segments + below[0].segments))
            else:
                edges.append(edge)
        return tuple(edges)

    def _is_plain(self, edge: Edge) -> bool:
        """Whether an edge only groups what is below."""
        alone = edge.target < 0 and self._uses[edge.target] == 1 == edge.count
        return alone and edge.chain < 0 and edge.material == NO_MATERIAL

    def _runs(self, edges: Sequence[Edge]) -> Iterator[list[Edge]]:
        """Neighbouring single edges to one target that a point instancer could hold, together."""
        run: list[Edge] = []
        for edge in edges:
            alike = run and edge.count == 1 == run[0].count and _alike(edge, run[0])
            if not alike and run:
                yield run
                run = []
            run.append(edge)
        if run:
            yield run

    def _place(self, parent: Any, edges: list[Edge], depth: int) -> None:
        first = edges[0]
        if first.count > 1:
            self._batch(parent, first, depth)
            return
        if len(edges) >= self.options.many:
            each = [self._rows(edge) for edge in edges]
            rows = np.concatenate([rows[exists] for rows, exists in each])
            if len(rows) and is_sayable(rows):
                self._instancer(parent, first, rows, None, depth)
                return
        for edge in edges:
            self._single(parent, edge, depth)

    def _single(self, parent: Any, edge: Edge, depth: int) -> None:
        steps = self.branches.chains[edge.chain].steps if edge.chain >= 0 else ()
        if any(map(_may_be_singular, steps)) and not self._rows(edge)[1][0]:
            return
        prim = child(parent, self._name(edge, numbered=True), "Xform")
        self.looks.bind(prim, edge.material)
        place(prim, self._inner(edge.target) + steps)
        self._fill(prim, edge, depth)

    def _batch(self, parent: Any, edge: Edge, depth: int) -> None:
        rows, exists = self._rows(edge)
        numbers = np.arange(edge.count) if edge.indices is None else edge.indices
        if self._is_instanced(edge):
            ids = None if edge.indices is None and exists.all() else numbers[exists]
            self._instancer(parent, edge, rows[exists], ids, depth)
            return
        name = self._name(edge)
        for matrix, number in zip(rows[exists], numbers[exists].tolist(), strict=True):
            prim = child(parent, f"{name}_{number}", "Xform")
            self.looks.bind(prim, edge.material)
            step = Step(StepKind.MATRIX, matrix.ravel())
            place(prim, (*self._inner(edge.target), step))
            self._fill(prim, edge, depth)

    def _instancer(
        self, parent: Any, edge: Edge, rows: FloatArray, ids: IntArray | None, depth: int
    ) -> None:
        prim = child(parent, self._name(edge), "PointInstancer")
        self.looks.bind(prim, edge.material)
        write_instances(prim, rows, ids)
        prototype = child(prim, self._target_name(edge.target), "Xform")
        relationship(prim, "prototypes", prototype.path)
        place(prototype, self._inner(edge.target))
        self._fill(prototype, edge, depth + 1)

    def _fill(self, prim: Any, edge: Edge, depth: int) -> None:
        """Make an Xform prim the edge's target: in place, or an instance of its class."""
        target = edge.target
        heavy = target < 0 or is_heavy(self.leaves[target])
        if not heavy or (self._uses.get(target, 0) <= 1 and depth < DEEPEST):
            self._pending.append((target, prim, depth))
            return
        prim.SetInfo("instanceable", True)
        prim.referenceList.prependedItems = [Sdf.Reference("", self._class(edge).path)]

    def _class(self, edge: Edge) -> Any:
        """The class of an edge's target, named by its first use."""
        target = edge.target
        if target in self._classes:
            return self._classes[target]
        scope = self.root.nameChildren.get("Prototypes")
        if scope is None:
            scope = child(self.root, "Prototypes", "Scope", specifier=Sdf.SpecifierClass)
        prim = child(scope, self._name(edge), "Xform")
        self._classes[target] = prim
        if target < 0:
            self._pending.append((target, prim, 3))
        else:
            # The root of an instance is not shared: what is drawn is below it.
            self._pending.append((target, child(prim, self._target_name(target), "Xform"), 4))
        return prim

    def _leaf(self, prim: Any, target: int) -> None:
        write_leaf(prim, self.leaves[target], self.options.tolerance)

    def _inner(self, target: int) -> tuple[Step, ...]:
        return inner_steps(self.leaves[target]) if target >= 0 else ()

    def _rows(self, edge: Edge) -> tuple[FloatArray, NDArray[np.bool_]]:
        """The matrices of an edge's lanes, and which of them have an inverse."""
        if edge.chain < 0:
            return np.eye(3, 4)[None], np.ones(1, dtype=bool)
        if edge.chain not in self._composed:
            self._composed[edge.chain] = matrices(self.branches.chains[edge.chain].steps)
        return self._composed[edge.chain]

    def _is_instanced(self, edge: Edge) -> bool:
        """Whether a batch becomes a point instancer."""
        if edge.count < self.options.many:
            return False
        if edge.chain not in self._sayable:
            rows, exists = self._rows(edge)
            self._sayable[edge.chain] = bool(exists.any() and is_sayable(rows[exists]))
        return self._sayable[edge.chain]

    def _name(self, edge: Edge, *, numbered: bool = False) -> str:
        """A name from the object path."""
        words = []
        for origin, number in edge.segments:
            if label := self._labels[origin]:
                suffix = f"_{number}" if number >= 0 and numbered else ""
                words.append(identifier(label) + suffix)
        if edge.batch >= 0 and (label := self._labels[edge.batch]):
            words.insert(0, identifier(label))
        return "_".join(words) or self._target_name(edge.target)

    def _target_name(self, target: int) -> str:
        return "group" if target < 0 else leaf_name(self.leaves[target])


def _alike(a: Edge, b: Edge) -> bool:
    names = [[origin for origin, _ in edge.segments] for edge in (a, b)]
    return a.target == b.target and a.material == b.material and names[0] == names[1]


def _may_be_singular(step: Step) -> bool:
    return step.kind in (StepKind.SCALE, StepKind.MATRIX)
