"""How expressions without suffixes are evaluated; see `dsl.run` for what a handler is."""

from __future__ import annotations

from types import GeneratorType
from typing import Any

import numpy as np

from dsl import ast, scene
from dsl.diagnostics import Label
from dsl.faults import Fault, Poisoned, mismatch
from dsl.lanes import merged
from dsl.operators import binary, negate, truth
from dsl.run import Run, Task
from dsl.scene import IntArray
from dsl.values import POISON, Angle, Color, List, Scope, Truths, Value, Vector


def missing(run: Run, node: ast.Missing, scope: Scope) -> Value:
    """What could not be read has no value, and its fault is reported."""
    raise Poisoned


def plain(run: Run, node: ast.Number | ast.Boolean, scope: Scope) -> Value:
    """A number or a truth value."""
    return node.value


def angle(run: Run, node: ast.AngleLiteral, scope: Scope) -> Value:
    """`40deg`."""
    return Angle(node.degrees)


def string(run: Run, node: ast.String, scope: Scope) -> Value:
    """`"text"`."""
    return node.text


def color(run: Run, node: ast.ColorLiteral, scope: Scope) -> Value:
    """`#d2b48c`."""
    return Color(node.components)


def name(run: Run, node: ast.Name, scope: Scope) -> Value:
    """The value of a name; a name that nothing defines has been reported."""
    binding = run.uses.get(node)
    if binding is None:
        raise Poisoned
    if binding.value is not None:
        return binding.value
    value = scope.find(binding)
    if run.lanes is not None:
        value = run.lanes.narrowed(value)
    if value is None:
        raise Fault(
            "name-before-definition",
            f"`{node.name}` is used before its `let` is reached",
            node.span,
            help="call the function only after it",
            secondary=(Label(binding.span, "defined here"),) if binding.span else (),
        )
    return value


def vector(run: Run, node: ast.VectorLiteral, scope: Scope) -> Task:
    """`(x, y, z)`."""
    components: list[Any] = []
    for part in node.components:
        value = yield part, scope
        if value is POISON:
            raise Poisoned
        if not isinstance(value, float | np.ndarray):
            raise mismatch("a component of a vector", "a number", value, part)
        components.append(value)
    return Vector(tuple(components))


def listed(run: Run, node: ast.ListLiteral, scope: Scope) -> Task:
    """`[a, b]`."""
    items = []
    for part in node.items:
        value = yield part, scope
        if value is POISON:
            raise Poisoned
        items.append(value)
    run.check_length(len(items), node.span)
    return List(tuple(items))


def unary(run: Run, node: ast.Unary, scope: Scope) -> Task:
    """`-a` and `not a`."""
    value = yield node.operand, scope
    if node.operator.symbol == "not":
        if isinstance(value, Truths):
            return Truths(~value.values)
        return not truth(value, node.operand, "the operand of `not`")
    return negate(node.operator, value, node.operand)


def operation(run: Run, node: ast.Operation, scope: Scope) -> Task:
    """Binary operators from the left; `and` and `or` stop where the answer is known."""
    left_node = node.operands[0]
    begun = run.begin(left_node, scope)
    left: Value = (yield begun) if type(begun) is GeneratorType else begun
    for place, op in enumerate(node.operators, 1):
        right_node = node.operands[place]
        if op.symbol in ("and", "or"):
            subject = f"an operand of `{op.symbol}`"
            if isinstance(left, Truths):
                left = yield from _undecided(run, left, op, right_node, scope)
                continue
            if truth(left, left_node, subject) is (op.symbol == "or"):
                return left
            left = yield right_node, scope
            if not isinstance(left, Truths):
                truth(left, right_node, subject)
        else:
            begun = run.begin(right_node, scope)
            right = (yield begun) if type(begun) is GeneratorType else begun
            left = binary(op, left, right, left_node, right_node)
            if isinstance(left, List):
                run.check_length(len(left.items), node.span)
            elif isinstance(left, scene.Transform):
                run.check_length(len(left.steps), node.span)
        left_node = right_node
    return left


def conditional(run: Run, node: ast.If, scope: Scope) -> Task:
    """The block of the first condition that holds; without one, the empty group."""
    outer, pieces = run.lanes, list[tuple[IntArray, Value]]()
    try:
        for condition, block in node.branches:
            value = yield condition, scope.inside()
            if isinstance(value, Truths) and not value.values.all():
                here = run.lanes
                assert here is not None
                assert outer is not None
                if value.values.any():
                    held = here.only(value.values)
                    run.take(held)
                    pieces.append((held.within(outer), (yield block, scope)))
                    run.take(here.only(~value.values))
            elif isinstance(value, Truths) or truth(value, condition, "a condition"):
                result = yield block, scope
                break
        else:
            if node.otherwise is not None:
                result = yield node.otherwise, scope
            else:
                result = scene.Group((), scene.Origin(node.span))
        if not pieces:
            return result
        assert run.lanes is not None
        assert outer is not None
        merge: Value = merged([*pieces, (run.lanes.within(outer), result)], outer.count)
        return merge
    finally:
        run.take(outer)


def _undecided(
    run: Run, left: Truths, op: ast.Operator, right: ast.Expression, scope: Scope
) -> Task:
    """`left and right`, `left or right` in lanes: `right` where `left` does not settle it."""
    lanes = rest = run.lanes
    assert lanes is not None
    assert rest is not None
    settled = left.values if op.symbol == "or" else ~left.values
    if settled.all():
        return left
    try:
        if settled.any():
            rest = lanes.only(~settled)
            run.take(rest)
        value = yield right, scope
        if not isinstance(value, Truths):
            truth(value, right, f"an operand of `{op.symbol}`")
        if not settled.any():
            return value
        known = np.flatnonzero(settled)
        pieces = [(known, op.symbol == "or"), (rest.within(lanes), value)]
        result: Value = merged(pieces, lanes.count)
        return result
    finally:
        run.take(lanes)
