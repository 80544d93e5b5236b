"""How a base with suffixes is evaluated: calls, members, items, and the placing of objects."""

from __future__ import annotations

from types import GeneratorType

from dsl import ast, batches, scene
from dsl.calls import Site, assign, call_builtin
from dsl.diagnostics import Label
from dsl.faults import Exhausted, Fault, Poisoned, source_text
from dsl.lanes import varies
from dsl.run import Run, Task
from dsl.spans import Span
from dsl.suffixes import field, file_member, item, suffix_call
from dsl.transforms import PLACE
from dsl.values import (
    POISON,
    Angle,
    Builtin,
    Closure,
    File,
    List,
    Objects,
    Scope,
    Value,
    Vector,
    is_movable,
    is_node,
    type_name,
)


def chain(run: Run, node: ast.Chain, scope: Scope) -> Task:
    """A base with its suffixes in reading order; neighbouring maps of an object become one node."""
    begun = run.begin(node.base, scope)
    value: Value = (yield begun) if type(begun) is GeneratorType else begun
    name = node.base.name if type(node.base) is ast.Name else "this"
    steps: list[scene.Step] | None = None  # maps that are not yet applied to the value
    suffixes, place = node.suffixes, 0
    while place < len(suffixes):
        if value is POISON:
            raise Poisoned
        suffix = suffixes[place]
        place += 1
        member: ast.Member | None = None
        if type(suffix) is ast.Member and type(value) is not File and place < len(suffixes):
            following = suffixes[place]
            if type(following) is ast.Call:
                member, suffix = suffix, following
                place += 1
        if member is None:
            value, steps = _placed(run, value, steps, node.span), None
        if isinstance(suffix, ast.Call):
            given: list[Value] = []
            for argument in suffix.arguments:
                begun = run.begin(argument.value, scope)
                given.append((yield begun) if type(begun) is GeneratorType else begun)
            if member is not None:
                site = _site(run, member.name, node.span, suffix)
                builtin = PLACE.get(member.name)
                if builtin is not None and is_movable(value):
                    transform = call_builtin(builtin, given, site)
                    assert isinstance(transform, scene.Transform)
                    steps = [] if steps is None else steps
                    steps += transform.steps
                    run.spend(len(transform.steps), node.span)
                    continue
                value, steps = _placed(run, value, steps, node.span), None
                value = suffix_call(value, member, given, site)
                if is_node(value):
                    run.made(value, node.span)
                elif isinstance(value, scene.Transform):
                    run.check_length(len(value.steps), node.span)
                continue
            span = node.span
            if place < len(suffixes):
                span = Span(span.source, span.start, suffix.span.end)
            if isinstance(value, Closure):
                value = yield from _call_closure(run, value, given, suffix, span)
            else:
                value = _called(run, value, name, given, suffix, span)
        elif isinstance(suffix, ast.Index):
            index = yield suffix.index, scope
            value = item(value, index, suffix)
        elif isinstance(value, File):
            value, name = file_member(value, suffix), suffix.name
        else:
            value = field(value, suffix)
    return _placed(run, value, steps, node.span)


def _placed(run: Run, value: Value, steps: list[scene.Step] | None, span: Span) -> Value:
    """The value with the maps that are due."""
    if steps is None:
        return value
    run.check_length(len(steps), span)
    transform = scene.Transform(tuple(steps))
    if run.lanes is not None and (isinstance(value, Objects) or varies(transform)):
        return batches.placed(value, transform, run.lanes.count)
    assert is_node(value)
    if run.lanes is not None:
        batches.check_length(value, len(steps))
    return run.made(scene.Instances(value, transform, origin=scene.Origin(span)), span)


def _site(run: Run, name: str, span: Span, call: ast.Call) -> Site:
    return Site(name, span, run.files, call.arguments, run.lanes is not None)


def _called(
    run: Run, value: Value, name: str, given: list[Value], call: ast.Call, span: Span
) -> Value:
    """What a builtin gives; `span` is the text from the start of the chain."""
    if isinstance(value, Builtin):
        result = call_builtin(value, given, _site(run, name, span, call))
        return run.made(result, span) if is_node(result) else result
    callee = Span(span.source, span.start, call.span.start)
    raise Fault(
        "type-not-callable",
        f"{type_name(value)} cannot be called",
        callee,
        help="put a `,` between two items" if _on_two_lines(callee) else _instead_of_call(value),
    )


def _on_two_lines(callee: Span) -> bool:
    """Whether a newline follows: what is called was to be an item of its own."""
    between = callee.source.encoded()[callee.start : callee.end]
    return between.rstrip() != between.rstrip(b" \t")


def _instead_of_call(value: Value) -> str:
    """Help for a call of what is no function."""
    if isinstance(value, List | Vector):
        return "an item is written `list[0]`"
    if isinstance(value, float | Angle):
        return "a product is written `a * b`"
    return "only functions can be called"


def _call_closure(
    run: Run, closure: Closure, given: list[Value], call: ast.Call, span: Span
) -> Task:
    definition = closure.definition
    if definition.body is None or any(value is POISON for value in given):
        raise Poisoned
    names = tuple([parameter.name for parameter in definition.parameters])

    def form() -> str:
        words = (p.name if p.default is None else f"{p.name}: {source_text(p.default.span)}"
                 for p in definition.parameters)  # fmt: skip
        return f"it is called as `{definition.name}({', '.join(words)})`"

    places = assign(definition.name, names, call.arguments, form)
    for parameter, place in zip(definition.parameters, places, strict=True):
        if parameter.default is None and place < 0:
            raise Fault(
                "type-missing-argument",
                f"`{definition.name}` needs `{parameter.name}`",
                span,
                help=form(),
                secondary=(Label(parameter.span, "has no default"),),
            )
    limit = run.limits.call_depth
    if not run.depth:
        run.faults_before = run.faults
    if run.depth >= limit:
        run.one_by_one()
        if run.faults > run.faults_before:  # but for which the recursion may end
            raise Exhausted
        message = f"more than {limit} calls within one another"
        run.exhaust("limit-call-depth", message, span, "does the recursion end?")
    scope = Scope(closure.scope)
    run.depth += 1
    run.context.append(Label(span, f"in this call of `{definition.name}`"))
    try:
        for parameter, place in zip(definition.parameters, places, strict=True):
            if place >= 0:
                value = given[place]
            else:
                assert parameter.default is not None
                value = yield parameter.default, scope
            scope.values[run.definitions[parameter]] = value
        return (yield definition.body, scope)
    finally:
        run.depth -= 1
        run.context.pop()
