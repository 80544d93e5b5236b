"""What statements of one form emit: the nodes that each on its own would have made."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import repeat
from typing import Any, TypeGuard

import numpy as np

from dsl import scene, sizes
from dsl.alike import Lines
from dsl.lanes import Sequential, as_objects
from dsl.spans import Place, Span
from dsl.values import Part


def each(value: Any, origin: scene.Origin, lines: Lines) -> list[scene.Node]:
    """The objects of all lanes as the statements on the lines emit them; or Sequential.

    `origin` is that of the first statement. Places within it become those of the other lines; nodes
    with a place elsewhere are common to all.
    """
    objects = as_objects(value, len(lines.texts))
    nodes: dict[int, scene.Node] = {}
    for part in objects.parts:
        lanes = part.lanes.tolist()
        nodes.update(zip(lanes, _Statements(origin, lines, lanes).emitted(part), strict=True))
    if not len(nodes) == objects.count == sum(len(part.lanes) for part in objects.parts):
        raise Sequential
    return [nodes[lane] for lane in range(objects.count)]


class _Statements:
    """The statements in some lanes."""

    def __init__(self, origin: scene.Origin, lines: Lines, lanes: Sequence[int]) -> None:
        self.origin, self.lines, self.lanes = origin, lines, lanes

    def emitted(self, part: Part) -> Sequence[scene.Node]:
        """The objects of a part, under the statement's name."""
        if part.inner or part.origin is not None:
            raise Sequential
        top = part.child.origin
        if not part.steps and top is not None and top.place is self.origin.place:
            return self.copies(part, self.origin)
        placed = _transforms(part.steps, len(self.lanes))
        rows = zip(self.copies(part, top), placed, self.origins(self.origin), strict=True)
        return [scene.Instances(node, transform, None, place) for node, transform, place in rows]

    def copies(self, part: Part, top: scene.Origin | None) -> Sequence[scene.Node]:
        """What a part places, with `top` for the origin of the outermost node."""
        around: list[scene.Instances | scene.Bind] = []
        node: Any = part.child
        while isinstance(node, scene.Instances | scene.Bind) and (
            self.is_own(node) or part.sizes is not None
        ):
            around.append(node)
            node = node.child
        origins = [self.origins(each.origin) for each in (*around, node)]
        origins[0] = self.origins(top)
        copies: Sequence[scene.Node] = [node] * len(self.lanes)
        if isinstance(node, scene.Shape):
            parameters: Any = repeat(node.parameters)
            if part.sizes is not None:
                unit = node.kind, node.parameters
                parameters = (sizes.scaled(*unit, scale) for scale in part.sizes.tolist())
            if part.sizes is not None or self.is_own(node):
                kinds = repeat(node.kind)
                copies = list(map(scene.Shape, kinds, parameters, origins[-1]))
        elif self.is_own(node):
            raise Sequential
        for outer, places in zip(reversed(around), reversed(origins[:-1]), strict=True):
            below = zip(copies, places, strict=True)
            if isinstance(outer, scene.Bind):
                bound = outer.material, outer.override
                copies = [scene.Bind(each, *bound, place) for each, place in below]
            else:
                placed = outer.transform, outer.indices
                copies = [scene.Instances(each, *placed, place) for each, place in below]
        return copies

    def is_own(self, node: scene.Node) -> bool:
        """Whether a node has been made on the first line."""
        return node.origin is not None and self.is_within(node.origin.place)

    def is_within(self, place: Place) -> TypeGuard[Span]:
        """Whether a place is on the first line."""
        line = self.origin.place
        assert isinstance(line, Span)
        return (
            isinstance(place, Span)
            and place.source is line.source
            and line.start <= place.start
            and place.end <= line.end
        )

    def origins(self, origin: scene.Origin | None) -> Sequence[scene.Origin | None]:
        """An origin as it is on every line."""
        if origin is None or not self.is_within(origin.place):
            return [origin] * len(self.lanes)
        source, words = origin.place.source, (origin.label, origin.index)
        starts, ends = self.lines.moved(origin.place.start), self.lines.moved(origin.place.end)
        return [scene.Origin(Span(source, starts[lane], ends[lane]), *words) for lane in self.lanes]


def _transforms(steps: Sequence[scene.Step], count: int) -> Sequence[scene.Transform]:
    """The maps of every lane."""
    columns = [
        [step] * count
        if step.values.ndim == 1
        else [scene.Step(step.kind, row, step.inverse) for row in np.ascontiguousarray(step.values)]
        for step in steps
    ]
    return [scene.Transform(row) for row in (zip(*columns, strict=True) if steps else [()] * count)]
