"""Objects in lanes: how they are placed, bound, grouped and emitted as batches of instances."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from itertools import accumulate
from typing import Any

import numpy as np

from dsl import scene, sizes
from dsl.lanes import Sequential, among, as_objects, chosen, distinct, of_lanes, stacked
from dsl.limits import SIZES
from dsl.scene import IntArray
from dsl.spans import Span
from dsl.values import Choice, Object, Objects, Part, Value

_LONG = 16
"""Longer runs of maps below a shared node are composed apart; see `compiler.compress`."""


def shapes(
    kind: scene.ShapeKind,
    parameters: Sequence[Any],
    make: Callable[[tuple[float, ...]], scene.Shape],
    span: Span,
) -> Objects:
    """A shape in every lane, `make` those of different parameters, or one unit for all of them."""
    count = next(len(value) for value in parameters if isinstance(value, np.ndarray))
    first, place = distinct(parameters, count)
    unit = sizes.unit_of(kind, parameters)
    if unit is None or len(first) <= sizes.MOST:
        columns = [np.broadcast_to(value, count)[first].tolist() for value in parameters]
        objects: Objects = chosen([make(row) for row in zip(*columns, strict=True)], place)
        return objects
    scales = stacked(unit[1])
    if not ((scales >= SIZES[0]) & (scales <= SIZES[1])).all():
        raise Sequential  # some may not be valid
    child = scene.Shape(kind, unit[0], scene.Origin(span), sized=True)
    return Objects((Part(np.arange(count), child, sizes=scales),), count)


def placed(value: Value, transform: scene.Transform, count: int) -> Objects:
    """Every lane's object, placed."""
    objects = as_objects(value, count)
    parts = _apart(objects) if _crowded(objects) else objects.parts
    return Objects(tuple(_moved(part, transform) for part in parts), objects.count)


def _apart(objects: Objects) -> Iterator[Part]:
    """The parts, their maps so far composed apart in lanes with several: a group's items there."""
    times = np.bincount(np.concatenate([part.lanes for part in objects.parts]))
    for part in objects.parts:
        if part.origin is not None or not _is_solid(part.child):
            raise Sequential
        several = times[part.lanes] > 1
        if several.any():
            item = among(part, several, part.lanes[several])
            yield replace(item, inner=(*item.inner, item.steps), steps=())
        if not several.all():
            yield among(part, ~several, part.lanes[~several])


def _moved(part: Part, transform: scene.Transform) -> Part:
    below = 0 if part.inner else _run_length(part.child)
    if part.origin is not None or (part.steps and len(part.steps) + below >= _LONG):
        raise Sequential
    steps = transform.steps
    if not np.array_equal(part.lanes, np.arange(transform.count or 0)):
        steps = tuple(of_lanes(step, part.lanes) for step in steps)
    return replace(part, steps=part.steps + steps)


def check_length(node: scene.Node, steps: int) -> None:
    """Sequential if so many maps more would be composed apart because the lanes share them."""
    if steps + _run_length(node) >= _LONG:
        raise Sequential


def _run_length(node: scene.Node) -> int:
    """The maps between a node and where the graph below it divides, counted up to 16.

    A shape may have a map of its own, see `dsl.sizes`.
    """
    length = 1
    while length < _LONG:
        match node:
            case scene.Instances():
                length += len(node.transform.steps)
                node = node.child
            case scene.Bind():
                node = node.child
            case scene.Group(items=(only,)):
                node = only
            case _:
                break
    return length


def bound(value: Value, material: Any, override: bool, span: Span) -> Objects:
    """Every lane's object with a material; one of them differs between lanes."""
    parts: list[Part] = []
    n = value.count if isinstance(value, Objects) else len(material.which)
    for part in as_objects(value, n).parts:
        if part.origin is not None:
            raise Sequential
        for kept, option in _options(material, part.lanes):
            child = scene.Bind(part.child, option, override, scene.Origin(span))
            parts.append(
                replace(part if kept is None else among(part, kept, part.lanes[kept]), child=child)
            )
    return Objects(tuple(parts), n)


def _options(material: Any, lanes: IntArray) -> Iterable[tuple[IntArray | None, scene.Material]]:
    """Each material and which of the lanes have it, in order; None for all."""
    if isinstance(material, scene.Material):
        return [(None, material)]
    if not isinstance(material, Choice):
        raise Sequential
    order = np.argsort(material.which[lanes], kind="stable")
    used, starts = np.unique(material.which[lanes][order], return_index=True)
    return zip(np.split(order, starts[1:]), map(material.options.__getitem__, used), strict=True)


def labelled(value: Value, origin: scene.Origin, numbers: IntArray | None, n: int) -> Objects:
    """Every lane's object as a statement emits it: `numbers` if in the body of the loop itself."""
    parts = []
    for part in as_objects(value, n).parts:
        if part.origin is not None:
            raise Sequential
        if numbers is not None:
            part = replace(part, origin=origin, numbers=numbers[part.lanes])
        else:
            part = replace(
                part, child=scene.Instances(part.child, scene.Transform(), origin=origin)
            )
        parts.append(part)
    return Objects(tuple(parts), n)


def grouped(values: Sequence[Any], count: int) -> Objects:
    """In every lane the group of what the values are in it."""
    parts = [part for value in values for part in as_objects(value, count).parts]
    return Objects(tuple(parts), count)


def _crowded(objects: Objects) -> bool:
    """Whether some lane has several parts."""
    total = sum(len(part.lanes) for part in objects.parts)
    if total > objects.count:
        return True
    if len(objects.parts) < 2:
        return False
    times = np.bincount(np.concatenate([part.lanes for part in objects.parts]))
    return int(times.max(initial=0)) > 1


def emitted(value: Value, span: Span) -> tuple[list[scene.Node], int]:
    """One statement's objects of all lanes, lane by lane, and how many they are."""
    if not isinstance(value, Objects):
        return [], 0  # the empty group
    parts = [part for part in value.parts if len(part.lanes)]
    nodes = [_batch(part, span) for part in parts]
    total = sum(len(part.lanes) for part in parts)
    if len(nodes) < 2:
        return list(nodes), total
    if any(map(_sheds_light, {id(part.child): part.child for part in parts}.values())):
        raise Sequential
    order = np.argsort(np.concatenate([part.lanes for part in parts]), kind="stable")
    return [scene.Group(tuple(nodes), scene.Origin(span), order)], total


def _batch(part: Part, span: Span) -> scene.Node:
    origin, numbers = part.origin or scene.Origin(span), part.numbers
    rows = [*part.inner, part.steps]
    if part.sizes is not None:
        if len(distinct(list(part.sizes.T), len(part.lanes))[0]) <= sizes.MOST:
            raise Sequential  # they may be prototypes of their own
        rows[0] = (scene.Step(scene.StepKind.SCALE, part.sizes), *rows[0])
    # An empty first row parts the maps that the child itself has from those around it.
    rows = [rows[0], *filter(None, rows[1:])]
    chain = tuple(step for row in rows for step in row)
    breaks = tuple(accumulate(map(len, rows[:-1])))
    if len(part.lanes) == 1 and not breaks:
        steps = tuple(
            step if step.values.ndim == 1 else scene.Step(step.kind, step.values[0], step.inverse)
            for step in chain
        )
        index = None if numbers is None else int(numbers[0])
        return scene.Instances(
            part.child, scene.Transform(steps), origin=replace(origin, index=index)
        )
    if not chain:
        raise Sequential
    transform = scene.Transform(chain, breaks)
    if transform.count is None:
        first = chain[0]
        values = np.broadcast_to(first.values, (len(part.lanes), len(first.values)))
        same = scene.Step(first.kind, values, first.inverse)
        transform = scene.Transform((same, *chain[1:]), breaks)
    return scene.Instances(part.child, transform, numbers, origin)


def _is_solid(node: scene.Node) -> bool:
    """Whether a node surely has a shape below it, and counts where it stands in a group."""
    stack = [node]
    while stack:
        below = stack.pop()
        match below:
            case scene.Shape():
                return True
            case scene.Group():
                stack += below.items
            case scene.Instances() | scene.Bind():
                stack.append(below.child)
    return False


def _sheds_light(node: scene.Node) -> bool:
    """Whether there is something other than objects below a node: it has an order of its own."""
    stack, seen = [node], {id(node)}
    while stack:
        below = stack.pop()
        match below:
            case scene.Group():
                children = below.items
            case scene.Instances() | scene.Bind():
                children = (below.child,)
            case _ if isinstance(below, Object):
                children = ()
            case _:
                return True
        stack += (child for child in children if id(child) not in seen)
        seen.update(map(id, children))
    return False
