"""How expressions without suffixes are evaluated; see `dsl.run` for what a handler is."""

from __future__ import annotations

from dsl import ast, scene
from dsl.diagnostics import Label
from dsl.faults import Fault, Poisoned, mismatch
from dsl.operators import binary, negate, truth
from dsl.run import Run, Task
from dsl.values import POISON, Angle, Color, List, Scope, Value, Vector


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
    components = []
    for part in node.components:
        value = yield part, scope
        if value is POISON:
            raise Poisoned
        if not isinstance(value, float):
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
        return not truth(value, node.operand, "the operand of `not`")
    return negate(node.operator, value, node.operand)


def operation(run: Run, node: ast.Operation, scope: Scope) -> Task:
    """Binary operators from the left; `and` and `or` stop where the answer is known."""
    left_node = node.operands[0]
    left = yield left_node, scope
    for op, right_node in zip(node.operators, node.operands[1:], strict=True):
        if op.symbol in ("and", "or"):
            subject = f"an operand of `{op.symbol}`"
            if truth(left, left_node, subject) is (op.symbol == "or"):
                return left
            left = yield right_node, scope
            truth(left, right_node, subject)
        else:
            right = yield right_node, scope
            left = binary(op, left, right, left_node, right_node)
            if isinstance(left, List):
                run.check_length(len(left.items), node.span)
            elif isinstance(left, scene.Transform):
                run.check_length(len(left.steps), node.span)
        left_node = right_node
    return left


def conditional(run: Run, node: ast.If, scope: Scope) -> Task:
    """The block of the first condition that holds; without one, the empty group."""
    for condition, block in node.branches:
        value = yield condition, scope.inside()
        if truth(value, condition, "a condition"):
            return (yield block, scope)
    if node.otherwise is not None:
        return (yield node.otherwise, scope)
    return scene.Group((), scene.Origin(node.span))
