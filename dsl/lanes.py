"""Values that differ between the iterations of a loop: arrays with one lane for each.

A loop's body is evaluated once with such values in the place of plain ones: an array of float64 is
a number in every lane, and angles, vectors, colors, intervals, lists and transforms hold arrays
where they hold numbers. Under a condition only the lanes in which it holds are evaluated, so an
array never has a lane that the program did not ask for. What cannot be done so, and every
fault, raises `Sequential`: the loop is then evaluated iteration by iteration.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import repeat
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dsl import scene
from dsl.scene import FloatArray, IntArray
from dsl.values import Angle, Choice, Color, Interval, List, Object, Objects, Part, Truths, Vector

FEWEST = 32
"""Loops of fewer iterations are evaluated one by one: that is as fast."""

_SINGLE = frozenset((float, bool, str, type(None)))


class Sequential(Exception):
    """The iterations of a loop have to be evaluated one after the other."""


@dataclass(frozen=True, slots=True, eq=False)
class Lanes:
    """The iterations being evaluated, by number; `chosen` are those lanes of `parent`."""

    numbers: IntArray
    parent: Lanes | None = None
    chosen: IntArray | None = None

    @property
    def count(self) -> int:
        """How many they are; fewer than those of the parent."""
        return len(self.numbers)

    def only(self, holds: NDArray[np.bool_]) -> Lanes:
        """The lanes where a condition holds, which is not everywhere and not nowhere."""
        chosen = np.flatnonzero(holds)
        return Lanes(self.numbers[chosen], self, chosen)

    def within(self, outer: Lanes) -> IntArray:
        """The lanes of `outer` that these are."""
        return self.selection(outer.count)

    def selection(self, count: int) -> IntArray:
        """The lanes that these are of those around them that have that count."""
        selection: IntArray | None = None
        lanes = self
        while lanes.count != count:
            if lanes.parent is None or lanes.chosen is None:
                raise Sequential
            selection = lanes.chosen if selection is None else lanes.chosen[selection]
            lanes = lanes.parent
        return np.arange(self.count) if selection is None else selection

    def narrowed(self, value: Any) -> Any:
        """A value from outside of the conditions, in the lanes where they hold."""
        return gathered(value, self.selection, self.count) if varies(value) else value


def varies(value: Any) -> bool:
    """Whether a value has lanes."""
    if type(value) in _SINGLE:
        return False
    match value:
        case np.ndarray() | Truths() | Choice() | Objects():
            return True
        case Angle(degrees):
            return isinstance(degrees, np.ndarray)
        case Vector(components) | Color(components):
            return any(isinstance(component, np.ndarray) for component in components)
        case Interval(start, end):
            return varies(start) or varies(end)
        case List(items) | tuple(items):
            return any(map(varies, items))
        case scene.Transform():
            return value.count is not None
        case _:
            return False


def longest(value: Any) -> tuple[Interval, IntArray] | None:
    """The longest of the intervals of all lanes, if only their ends differ.

    Also how many integers are in each.
    """
    match value:
        case Interval(float(start), np.ndarray() as end):
            first = float(math.ceil(start))
            lengths = np.maximum(np.ceil(end) - first, 0.0)
            if lengths.max() > 2**53:
                raise Sequential  # which refuses so many
            return Interval(first, first + float(lengths.max())), lengths.astype(np.int64)
    return None


def among(part: Part, kept: IntArray | NDArray[np.bool_], lanes: IntArray) -> Part:
    """The part in those of its lanes that are kept, under new numbers."""
    numbers = None if part.numbers is None else part.numbers[kept]
    sizes = None if part.sizes is None else part.sizes[kept]
    *inner, steps = (
        tuple(of_lanes(step, kept) for step in steps) for steps in (*part.inner, part.steps)
    )
    return Part(lanes, part.child, steps, part.origin, numbers, sizes, tuple(inner))


def gathered(value: Any, selection: Callable[[int], IntArray], count: int) -> Any:
    """`count` lanes of a value: those that `selection` names of as many as the value has."""

    def take(array: Any) -> Any:
        if not isinstance(array, np.ndarray) or len(array) == count:
            return array
        return array[selection(len(array))]

    match value:
        case np.ndarray():
            return take(value)
        case Truths(values):
            return Truths(take(values))
        case Choice(options, which):
            return Choice(options, take(which))
        case Angle(degrees):
            return Angle(take(degrees))
        case Vector(components):
            return Vector(tuple(map(take, components)))
        case Color((red, green, blue)):
            return Color((take(red), take(green), take(blue)))
        case Interval(start, end):
            return Interval(*(gathered(v, selection, count) for v in (start, end)))
        case List(items):
            return List(tuple(gathered(item, selection, count) for item in items))
        case scene.Transform(steps):
            return scene.Transform(
                tuple(
                    step
                    if step.values.ndim == 1
                    else scene.Step(step.kind, take(step.values), step.inverse)
                    for step in steps
                )
            )
        case Objects(parts, total) if total != count:
            chosen = selection(total)
            place = np.full(total, -1)
            place[chosen] = np.arange(len(chosen))
            moved = [(part, place[part.lanes]) for part in parts]
            kept = ((part, lanes >= 0, lanes[lanes >= 0]) for part, lanes in moved)
            return Objects(tuple(among(*some) for some in kept if len(some[2])), count)
        case _:
            return value


def chosen(options: Sequence[Any], which: IntArray) -> Any:
    """One of several values in every lane: `options[which[lane]]`."""
    if options and all(isinstance(option, float | np.ndarray) for option in options):
        if any(map(varies, options)):
            rows = np.stack(np.broadcast_arrays(*options, which)[:-1])
            return rows[which, np.arange(len(which))]
    elif not options or any(map(varies, options)):
        raise Sequential
    kinds = set(map(type, options))
    kind = kinds.pop()
    if kinds:
        if all(isinstance(option, scene.Node) for option in options):
            return _chosen_objects(options, which)
        raise Sequential
    if kind is float:
        return np.array(options)[which]
    if kind is bool:
        return Truths(np.array(options)[which])
    if kind is Angle:
        return Angle(chosen([option.degrees for option in options], which))
    if kind is scene.Material:
        return Choice(tuple(options), which)
    if kind is Vector or kind is Color:
        columns: list[Any] = list(zip(*(option.components for option in options), strict=False))
        if any(len(option.components) != len(columns) for option in options):
            raise Sequential
        return kind(tuple(_array(column)[which] for column in columns))
    if kind is scene.Transform:
        return _chosen_transform(options, which)
    if issubclass(kind, scene.Node):
        return _chosen_objects(options, which)
    raise Sequential


def _array(numbers: Any) -> Any:
    return np.array(numbers)


def _chosen_objects(options: Sequence[scene.Node], which: IntArray) -> Objects:
    order = np.argsort(which, kind="stable")
    ends = np.searchsorted(which[order], np.arange(len(options) + 1))
    return Objects(
        tuple(
            Part(order[start:end], option)
            for option, start, end in zip(options, ends, ends[1:], strict=False)
            if start < end
        ),
        len(which),
    )


def _chosen_transform(options: Sequence[scene.Transform], which: IntArray) -> scene.Transform:
    forms = {tuple((step.kind, step.inverse) for step in option.steps) for option in options}
    if len(forms) > 1:
        raise Sequential
    columns = zip(*(option.steps for option in options), strict=True)
    return scene.Transform(
        tuple(
            scene.Step(column[0].kind, np.array([s.values for s in column])[which], s.inverse)
            for column in columns
            for s in column[:1]
        )
    )


def packed(results: Sequence[Any]) -> Any:
    """The value with these in its lanes."""
    every = np.arange(len(results))
    first = results[0]
    if isinstance(first, scene.Material):
        numbers: dict[Any, int] = {}
        which = np.array([numbers.setdefault(result, len(numbers)) for result in results])
        return chosen(list(numbers), which)
    return chosen(results, every)


def merged(pieces: Iterable[tuple[IntArray, Any]], count: int) -> Any:
    """The value that in the lanes of each piece is the piece's; the pieces cover all lanes."""
    pieces = list(pieces)
    values = [value for _, value in pieces]

    def scattered(arrays: Sequence[Any]) -> Any:
        out = np.empty(count, dtype=np.result_type(*arrays))
        for (lanes, _), array in zip(pieces, arrays, strict=True):
            out[lanes] = array
        return out

    def is_all(*kinds: Any) -> bool:
        return all(isinstance(value, kinds) for value in values)

    if is_all(scene.Node, Objects):
        parts: list[Part] = []
        for lanes, value in pieces:
            inner = as_objects(value, len(lanes))
            parts += (replace(part, lanes=lanes[part.lanes]) for part in inner.parts)
        return Objects(tuple(parts), count)
    if is_all(bool, Truths):
        return Truths(scattered([v.values if isinstance(v, Truths) else v for v in values]))
    if is_all(float, np.ndarray):
        return scattered(values)
    if is_all(Angle):
        return Angle(scattered([value.degrees for value in values]))
    if (is_all(Vector) or is_all(Color)) and len({len(v.components) for v in values}) == 1:
        columns = zip(*(value.components for value in values), strict=True)
        return type(values[0])(tuple(map(scattered, columns)))
    if is_all(scene.Material, Choice):
        options: list[scene.Material] = []
        which = np.empty(count, dtype=np.int64)
        for lanes, value in pieces:
            if isinstance(value, Choice):
                which[lanes] = value.which + len(options)
                options += value.options
            else:
                which[lanes] = len(options)
                options.append(value)
        return Choice(tuple(options), which)
    raise Sequential


def as_objects(value: Any, count: int) -> Objects:
    """A node that is the same in all lanes, or what differs already."""
    if isinstance(value, Objects):
        return value
    if isinstance(value, scene.Group) and not value.items:
        return Objects((), count)
    if not isinstance(value, Object):
        raise Sequential
    return Objects((Part(np.arange(count), value),), count)


def each(function: Callable[..., Any], arguments: Sequence[Any]) -> Any:
    """A function of plain values in every lane, one after the other."""
    varying = [n for n, argument in enumerate(arguments) if varies(argument)]
    if len(varying) == 1 and isinstance(arguments[varying[0]], np.ndarray):
        # Loops have few different numbers; by their bits, for -0 is not 0.
        bits = np.ascontiguousarray(arguments[varying[0]]).view(np.int64)
        distinct, place = np.unique(bits, return_inverse=True)
        if len(distinct) < len(bits):
            fewer: list[Any] = list(arguments)
            fewer[varying[0]] = distinct.view(np.float64)
            results = each(function, fewer)
            return gathered(results, lambda count: place, -1)
    return packed([function(*row) for row in zip(*map(_split, arguments), strict=False)])


def _split(value: Any) -> Iterator[Any]:
    """A value's lanes; one without lanes goes on for ever."""
    if not varies(value):
        return repeat(value)
    match value:
        case np.ndarray():
            return iter(value.tolist())
        case Truths(values):
            return iter(values.tolist())
        case tuple():
            return zip(*map(_split, value), strict=False)
        case Angle(degrees):
            return map(Angle, _split(degrees))
        case Vector(components):
            return map(Vector, _split(components))
        case Color(components):
            return map(Color, _split(components))
        case Choice(options, which):
            return (options[index] for index in which.tolist())
        case _:
            raise Sequential


def distinct(columns: Sequence[Any], count: int) -> tuple[IntArray, IntArray]:
    """The first lane of each different row of numbers, by their bits, and each lane's row."""
    place = np.zeros(count, dtype=np.int64)
    first = np.zeros(1, dtype=np.int64)
    for column in columns:
        if isinstance(column, np.ndarray):
            bits, codes = np.unique(
                np.ascontiguousarray(column).view(np.int64), return_inverse=True
            )
            _, first, place = np.unique(
                place * len(bits) + codes, return_index=True, return_inverse=True
            )
    return first, place


def of_lanes(step: scene.Step, lanes: IntArray | NDArray[np.bool_]) -> scene.Step:
    """The step in some lanes."""
    if step.values.ndim == 1:
        return step
    return scene.Step(step.kind, step.values[lanes], step.inverse)


def stacked(values: Sequence[Any]) -> FloatArray:
    """The values of a step, `(k,)`, or `(n, k)`, column by column, where one of them has lanes."""
    try:
        columns = np.array(values, np.float64)
        return columns if columns.ndim == 1 else columns.T
    except ValueError:  # numbers beside arrays
        return np.stack(np.broadcast_arrays(*values)).T
