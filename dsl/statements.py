"""How files, blocks and loops are evaluated, and what their statements emit.

An expression statement *emits* its value: an object gets an `Origin` with the statement's span, the
name that the statement begins with, and the index of the loop in whose body it stands.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from heapq import heappop, heappush
from itertools import count, product
from pathlib import PurePath
from types import GeneratorType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dsl import ast, batches, emission, lanes, scene
from dsl.builtins import BUILTINS
from dsl.faults import Fault, Poisoned, mismatch, source_text
from dsl.files import FileFault
from dsl.lanes import Sequential
from dsl.observation import stage
from dsl.parameters import settled
from dsl.parser import one_by_one, parse, read
from dsl.resolve import resolve
from dsl.run import Run, Steps, Task
from dsl.spans import Source, Span
from dsl.values import (
    EVERY,
    POISON,
    Binding,
    Builtin,
    Closure,
    File,
    Interval,
    List,
    Objects,
    Scope,
    Value,
    Vector,
    is_node,
    is_placeable,
    type_name,
)


def module(run: Run, module: ast.Module, scope: Scope) -> Task:
    """The value of a file; `scope` receives its top-level names."""
    run.sources[module.source.name] = module.source.text
    names = {**BUILTINS, "time": Binding("time", value=run.time)}
    resolution = resolve(module, names, run.limits.diagnostics)
    if resolution.alike and resolution.diagnostics:  # there may be more of them
        module, _ = parse(module.source, run.limits)
        resolution = resolve(module, names, run.limits.diagnostics)
    run.alike.update(resolution.alike)
    run.uses.update(resolution.uses)
    run.definitions.update(resolution.definitions)
    run.report(*resolution.diagnostics)
    if module.source is run.source:
        run.advice = resolution.advice
    emitted = yield from _statements(run, module.body, scope)
    return _block_value(run, emitted, module.body.span)


def block(run: Run, block: ast.Block, scope: Scope) -> Task:
    """`{ statements }`: the value of its only expression, or the group of them."""
    emitted = yield from _statements(run, block, Scope(scope, scope.index))
    return _block_value(run, emitted, block.span)


def loop(run: Run, node: ast.For, scope: Scope) -> Task:
    """The group of what the body's first statement emits for every index, then the second, …."""
    ranges = []
    total = 1
    lengths: scene.IntArray | None = None  # the iterations of each lane, if they differ
    for variable in node.variables:
        value = yield variable.range, scope.inside()
        if len(node.variables) == 1 and (longest := lanes.longest(value)) is not None:
            value, lengths = longest
        items, count = _iterated(value, variable.range)
        total *= count
        ranges.append(items)
    if run.lanes is not None and total > run.lanes.count:
        raise Sequential  # the inner loop is the one to evaluate at once
    if total > run.limits.iterations:
        raise Fault(
            "limit-iterations",
            f"a loop of {float(min(total, 10**300)):.7g} iterations, more than "
            f"{run.limits.iterations}",
            node.variables[0].span,
        )
    run.spend(total, node.span)
    bindings = [run.definitions[variable] for variable in node.variables]
    if run.lanes is None and total >= lanes.FEWEST and node not in run.sequential:
        try:
            return _at_once(run, node, scope, ranges, total)
        except Sequential:
            run.sequential.add(node)
    rows: list[list[Value]] = []
    for index, raw in enumerate(product(*ranges) if total else ()):
        values = tuple(float(v) if isinstance(v, int) else v for v in raw)
        variables = Scope(scope, None, dict(zip(bindings, values, strict=True)))
        run.context.append((node, values))
        body = Scope(variables, index)
        if lengths is None or (index < lengths).all():
            row = yield from _statements(run, node.body, body)
        else:
            row = yield from _in_some(run, node.body, body, index < lengths)
        run.context.pop()
        if any(value is POISON for value in row):
            return POISON  # the iterations after it would say the same
        rows.append(row)
    columns = zip(*rows, strict=True)
    group = _group(run, [v for column in columns for v in column], node.span)
    return run.made(group, node.span) if isinstance(group, scene.Group) else group


def _in_some(
    run: Run, block: ast.Block, scope: Scope, holds: NDArray[np.bool_]
) -> Steps[list[Value]]:
    """What a block's statements emit in the lanes where a loop is not over yet."""
    outer = run.lanes
    assert outer is not None
    some, others = outer.only(holds), np.flatnonzero(~holds)
    run.take(some)
    row = yield from _statements(run, block, scope)
    run.take(outer)
    pieces = [[(some.within(outer), value), (others, scene.Group(()))] for value in row]
    return [lanes.merged(each, outer.count) for each in pieces]


def _at_once(
    run: Run, node: ast.For, scope: Scope, ranges: list[Sequence[Any]], total: int
) -> scene.Group:
    """The loop's value from one evaluation of its body for all iterations; or Sequential."""
    every = lanes.Lanes(np.arange(total))
    variables = Scope(scope)
    around, within = 1, total
    for variable, values in zip(node.variables, ranges, strict=True):
        within //= len(values)
        number = np.tile(np.repeat(np.arange(len(values)), within), around)
        around *= len(values)
        if isinstance(values, range):
            if max(abs(values[0]), abs(values[-1])) > 2**53:
                raise Sequential
            value: Any = values[0] + number.astype(np.float64)
        else:
            value = lanes.chosen(values, number)
        variables.values[run.definitions[variable]] = value

    def body() -> Task:
        objects: list[scene.Node] = []
        for value in (yield from _statements(run, node.body, Scope(variables, EVERY))):
            nodes, edges = batches.emitted(value, node.span)
            objects += (run.made(each, node.span, edges) for each in nodes)
        return scene.Group(tuple(objects), scene.Origin(node.span))

    group = run.at_once(body(), every)
    assert isinstance(group, scene.Group)
    return run.made(group, node.span)


def _statements(run: Run, block: ast.Block, scope: Scope) -> Steps[list[Value]]:
    """Evaluate a block's statements in its scope: the value of each expression statement."""
    expressions = 0
    alike = False
    for statement in block.statements:
        if isinstance(statement, ast.Function):
            scope.values[run.definitions[statement]] = Closure(statement, scope)
        elif not isinstance(statement, ast.Definition):
            expressions += 1
            alike |= isinstance(statement, ast.Alike)
    grouped = expressions > 1 or scope.index is not None or alike
    emitted: list[Value] = []
    places: list[int] = []  # where the statements that emitted them begin, if some are alike
    due = _Due(block.statements if alike else ())
    for statement in due if alike else block.statements:
        value: Value = POISON
        try:
            match statement:
                case ast.Function():
                    continue
                case ast.Let():
                    value = yield statement.value, scope.inside()
                case ast.Use():
                    value = yield from _use(run, statement)
                case ast.Param():
                    value = yield from _param(run, statement, scope)
                case ast.Alike():
                    try:
                        emitted += _of_one_form(run, statement, scope)
                        places += statement.lines.starts.tolist()
                    except Sequential:
                        due.add(_singly(run, statement))
                    continue
                case _:
                    inside = scope if type(statement) in _EMITTING else scope.inside()
                    begun = run.begin(statement, inside)
                    value = (yield begun) if type(begun) is GeneratorType else begun
                    value = _emitted(run, value, statement, scope, grouped)
        except (Fault, Poisoned) as fault:
            run.record(fault)
        if isinstance(statement, ast.Definition):
            scope.values[run.definitions[statement]] = value
        else:
            emitted.append(value)
            if alike:
                places.append(statement.span.start)
    if alike:
        emitted = [emitted[number] for number in sorted(range(len(places)), key=places.__getitem__)]
    return emitted


class _Due:
    """Statements that are to be evaluated in the order of their places."""

    def __init__(self, statements: Iterable[ast.Statement]) -> None:
        self._heap: list[tuple[int, int, ast.Statement]] = []
        self._count = count()
        self.add(statements)

    def add(self, statements: Iterable[ast.Statement]) -> None:
        for each in statements:
            heappush(self._heap, (each.span.start, next(self._count), each))

    def __iter__(self) -> Iterator[ast.Statement]:
        while self._heap:
            yield heappop(self._heap)[-1]


def _of_one_form(run: Run, alike: ast.Alike, scope: Scope) -> list[scene.Node]:
    """What statements of one form emit, from one evaluation of the first; or Sequential."""
    if run.lanes is not None or alike in run.single:
        raise Sequential

    def value() -> Task:
        try:
            return (yield alike.first, scope.inside())
        except (Fault, Poisoned):
            raise Sequential from None

    found = run.at_once(value(), lanes.Lanes(np.arange(len(alike.lines.texts))))
    origin = scene.Origin(alike.span, _label(run, alike.first, scope), scope.index)
    nodes = emission.each(found, origin, alike.lines)
    run.made(nodes[0], alike.span, len(nodes))
    return nodes


def _singly(run: Run, alike: ast.Alike) -> tuple[ast.Statement, ...]:
    """The statements of one form, which cannot be evaluated at once."""
    if alike not in run.single:
        statements = run.single[alike] = one_by_one(alike, run.limits)
        tree = ast.Module(alike.span.source, ast.Block(alike.span, statements))
        run.uses.update(resolve(tree, run.alike[alike], run.limits.diagnostics).uses)
    return run.single[alike]


def _param(run: Run, statement: ast.Param, scope: Scope) -> Task:
    """The value of a parameter; only those of the program itself can be set."""
    default = yield statement.default, scope
    allowed: Value | None = None
    if statement.allowed is not None:
        allowed = yield statement.allowed, scope
    if default is POISON or allowed is POISON:
        raise Poisoned
    own = statement.span.source is run.source
    value, told = settled(statement, default, allowed, run.settings if own else {})
    if own:
        run.params.append(told)
    return value


def _use(run: Run, statement: ast.Use) -> Task:
    """The file that a `use` names; each is evaluated once."""
    run.one_by_one()
    if statement.path is None:
        raise Poisoned
    span, path = statement.path.span, statement.path.text
    start = span.source.folder
    try:
        resolved = str(run.files.resolve(path, start))
        if resolved in run.loaded:
            known = run.loaded[resolved]
            if known is None:
                raise Fault(
                    "file-cycle",
                    f"`{path}` uses itself, directly or through others",
                    span,
                    help="move what both need into a third file",
                )
            return known
        if len(run.loaded) > run.limits.files:  # which the program itself does not count for
            raise Fault("limit-files", f"more than {run.limits.files} files", span)
        text = run.files.read_text(path, start, run.limits.source_bytes)
    except FileFault as fault:
        raise Fault(fault.code, fault.message, span, help=fault.help) from None
    with stage("parse"):
        tree, diagnostics = read(Source(str(PurePath(start) / path), text), run.limits)
    run.report(*diagnostics)
    run.loaded[resolved] = None if tree.complete else POISON
    if not tree.complete:
        raise Poisoned
    scope = Scope()
    yield from module(run, tree, scope)
    members = {binding.name: value for binding, value in scope.values.items()}
    file = run.loaded[resolved] = File(path, members)
    return file


def _emitted(
    run: Run, value: Value, statement: ast.Expression, scope: Scope, grouped: bool
) -> Value:
    """What an expression statement adds to a scene; in a group it must be a scene value."""
    if type(statement) not in _EMITTING:
        if is_placeable(value):
            value = _labelled(run, value, statement, scope)
        if scope.index == EVERY and is_node(value):
            raise Sequential  # it is the same in every iteration and has no name
    if value is POISON:
        raise Poisoned
    if grouped and not is_node(value) and not isinstance(value, Objects):
        raise no_scene_value(value, statement)
    return value


_EMITTING = frozenset((ast.If, ast.Block))
"""What emits what it contains, with the same index."""


def _labelled(
    run: Run, value: scene.Node | Objects, statement: ast.Expression, scope: Scope
) -> Value:
    """The object with its statement's origin: its own, if the statement made it, or around it."""
    label = _label(run, statement, scope)
    if not label:
        return value
    if run.lanes is not None and (isinstance(value, Objects) or scope.index == EVERY):
        numbers = run.lanes.numbers if scope.index == EVERY else None
        index = None if scope.index == EVERY else scope.index
        origin = scene.Origin(statement.span, label, index)
        return batches.labelled(value, origin, numbers, run.lanes.count)
    assert not isinstance(value, Objects)
    origin = scene.Origin(statement.span, label, scope.index)
    old = value.origin
    if old is not None and old.place is statement.span and not old.label:
        if type(value) is scene.Instances:  # as most are: `replace` takes its time
            return scene.Instances(value.child, value.transform, value.indices, origin)
        return replace(value, origin=origin)
    return run.made(scene.Instances(value, scene.Transform(), origin=origin), statement.span)


def _label(run: Run, statement: ast.Expression, scope: Scope) -> str:
    """The name that a statement begins with; of a file's member, the member's.

    One without a name is called by its construct where it has an index to tell, and a list's item,
    which has no statement of its own, always.
    """
    base = statement.base if isinstance(statement, ast.Chain) else statement
    if not isinstance(base, ast.Name):
        shown = scope.index is not None or isinstance(base, ast.ListLiteral)
        return _CONSTRUCTS.get(type(base), "") if shown else ""
    if not isinstance(statement, ast.Chain):
        return base.name
    first, binding = statement.suffixes[0], run.uses.get(base)
    of_file = binding is not None and isinstance(scope.find(binding), File)
    return first.name if of_file and isinstance(first, ast.Member) else base.name


_CONSTRUCTS = {ast.For: "for", ast.If: "if", ast.Block: "block", ast.ListLiteral: "list"}


def _block_value(run: Run, emitted: list[Value], span: Span) -> Value:
    if any(value is POISON for value in emitted):
        return POISON
    return emitted[0] if len(emitted) == 1 else _group(run, emitted, span)


def _group(run: Run, values: list[Value], span: Span) -> scene.Group | Objects:
    """The group of scene values; empty groups contribute nothing."""
    if run.lanes is not None and any(isinstance(value, Objects) for value in values):
        return batches.grouped(values, run.lanes.count)
    items = [v for v in values if not (isinstance(v, scene.Group) and not v.items)]
    return scene.Group(tuple(items), scene.Origin(span))  # type: ignore[arg-type]


def only(block: ast.Block) -> ast.Expression:
    """The last expression statement of a block that has one."""
    return [s for s in block.statements if not isinstance(s, ast.Definition)][-1]


def no_scene_value(value: Value, statement: ast.Expression) -> Fault:
    """The fault of a statement whose value a scene cannot contain."""
    help = "name it with `let`, or leave it out"
    if isinstance(value, Closure | Builtin):
        words = statement.name if isinstance(statement, ast.Name) else "…"
        help = f"call it: `{words}(…)`"
    elif isinstance(value, File):
        help = "place what is in it, such as `file.name`"
    elif isinstance(value, scene.Transform):
        help = "apply it to an object: `object.transform(t)`"
        if isinstance(statement, ast.Chain) and isinstance(statement.base, ast.Name):
            help = f"it follows an object: `object.{source_text(statement.span)[:40]}`"
    elif isinstance(value, scene.Material):
        help = "bind it to an object: `object.material(m)`"
    elif isinstance(value, List):
        help = "place its items in a loop: `for item in list { item }`"
    return Fault(
        "type-not-a-scene-value",
        f"{type_name(value)} cannot be part of a scene",
        statement.span,
        help=help,
    )


def _iterated(value: Value, node: ast.Expression) -> tuple[Sequence[Any], int]:
    """What a loop runs over and how much that is: the integers a <= i < b, or a list's items."""
    if value is POISON:
        raise Poisoned
    match value:
        case List(items):
            return items, len(items)
        case Interval(float(start), float(end)):
            first, last = math.ceil(start), math.ceil(end)
            return range(first, last), max(0, last - first)
    fault = mismatch("what a loop runs over", "an interval of numbers or a list", value, node)
    if isinstance(value, float):
        help = f"write `0..{source_text(node.span)}` for 0, 1, 2 and so on"
        fault.diagnostic = replace(fault.diagnostic, help=help)
    elif isinstance(value, Vector):
        help = "a list is written in square brackets: `[a, b, c]`"
        fault.diagnostic = replace(fault.diagnostic, help=help)
    raise fault
