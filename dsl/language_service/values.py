"""Evaluating a program while it is typed: its faults, and the values of its top-level names."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

from dsl import ast
from dsl.budget import DEFAULT_LIMITS, Limits
from dsl.diagnostics import Diagnostic, Label
from dsl.evaluate import evaluate, in_order
from dsl.garbage import seldom_collecting
from dsl.language_service.program import Program
from dsl.language_service.project import Project
from dsl.spans import Span
from dsl.values import Angle, Color, Interval, Scope, Value, Vector, format_number, shown

TYPING_LIMITS = replace(DEFAULT_LIMITS, steps=1_000_000)
"""A twentieth of what a render may take: a second or two."""

Valued = ast.Let | ast.Param
Values = Mapping[Valued, Value]
"""The values of the names of a file's top level, as far as they have one."""


@dataclass(frozen=True, slots=True)
class Evaluation:
    """What came out of a program: everything that is wrong with it, and its values."""

    diagnostics: list[Diagnostic]
    values: Values


@seldom_collecting()
def evaluate_program(
    project: Project, program: Program, limits: Limits = TYPING_LIMITS
) -> Evaluation:
    """Evaluate a program; that it is too large to do so while typing is no fault of it."""
    scope = Scope()
    _, found = evaluate(program.module, project.files, limits, scope=scope)
    steps_matter = limits.steps >= DEFAULT_LIMITS.steps
    found = [d for d in found if steps_matter or d.code != "limit-steps"]
    placed = (_placed(d, project, program) for d in found)
    diagnostics = in_order([*program.faults, *placed, *_advice(program)])
    by_place = {b.span: value for b, value in scope.values.items() if b.span is not None}
    values = {
        node: by_place[node.name_span]
        for node in program.module.body.statements
        if isinstance(node, Valued) and node.name_span in by_place
    }
    return Evaluation(diagnostics, values)


def shown_value(value: Value | None) -> str | None:
    """A number, angle, vector, color, interval or truth value as text; None for others."""
    if isinstance(value, float | bool | Angle | Vector | Color | Interval):
        return shown(value, _number)
    return None


@dataclass(frozen=True, slots=True)
class Inlay:
    """A text to be shown behind an offset."""

    offset: int
    text: str


def inlays(program: Program, values: Values) -> list[Inlay]:
    """The values of computed names; a literal says its value itself."""
    result = []
    for node in program.module.body.statements:
        if not isinstance(node, Valued):
            continue
        expression = node.value if isinstance(node, ast.Let) else node.default
        text = None if _is_literal(expression) else shown_value(values.get(node))
        if text is not None:
            result.append(Inlay(expression.span.end, f"= {text}"))
    return result


def _is_literal(node: ast.Expression) -> bool:
    match node:
        case ast.Unary():
            return _is_literal(node.operand)
        case ast.VectorLiteral():
            return all(map(_is_literal, node.components))
        case ast.Operation() if node.operators[0].symbol == "..":
            return all(map(_is_literal, node.operands))
        case _:
            return isinstance(
                node, ast.Number | ast.AngleLiteral | ast.Boolean | ast.ColorLiteral | ast.Missing
            )


def _number(value: float) -> str:
    """Six digits, which is what there is room for."""
    return format_number(float(f"{value:.6g}"))


def _advice(program: Program) -> list[Diagnostic]:
    """Advice on names; none on unused ones that a statement not yet read, or a file, may use."""
    advice = program.resolution.advice
    if program.faults:
        return [found for found in advice if found.code != "advice-unused"]
    statements = program.module.body.statements
    if all(isinstance(statement, ast.Definition) for statement in statements):
        own = {node.name_span for node in program.top_level.values()}
        return [d for d in advice if d.primary is None or d.primary.place not in own]
    return advice


def _placed(found: Diagnostic, project: Project, program: Program) -> Diagnostic:
    """A fault of a used file, told at the `use` that leads to it."""
    place = found.primary.place if found.primary is not None else None
    if found.primary is None or not isinstance(place, Span):
        return found
    if place.source.name == program.path:
        return found
    leading = [u for u in program.uses if _leads_to(project, program, u, place.source.name)]
    if not (leading or program.uses):
        return found
    use = (leading or program.uses)[0]
    span = use.span if use.path is None else use.path.span
    primary = Label(span, "in this file")
    return replace(found, primary=primary, secondary=(found.primary, *found.secondary))


def _leads_to(project: Project, program: Program, use: ast.Use, name: str) -> bool:
    used = project.used(program, use)
    return used is not None and any(each.path == name for each in (used, *project.reachable(used)))
