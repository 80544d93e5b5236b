"""What has a meaning, and most probably another one than was meant."""

from __future__ import annotations

import re

from dsl import ast
from dsl.codes import diagnostic
from dsl.diagnostics import Diagnostic
from dsl.spans import Span

DIVISION = "`//` begins a comment: a quotient is `a / b`, its whole part `floor(a / b)`"
_DIVISOR = re.compile(rb"[ \t]*(//[ \t]*\d[\d.]*)")
_COMMENT_OF_NUMBERS = re.compile(
    rb"[ \t]*(//[ \t]*\d[\d.]*(?:[ \t]*[-+*/%][ \t]*[\w.]+)*)[ \t]*[\r\n]"
)
_FEWEST = 32.0
"""A byte of a color is probably no less: brightness beyond 1 has its uses, but seldom so large."""


def begins_division(text: bytes, position: int) -> bool:
    """Whether what follows looks like a number after Python's sign for whole division."""
    return _DIVISOR.match(text, position) is not None


def hidden_divisor(let: ast.Let, text: bytes) -> Diagnostic | None:
    """Advice on `let n = 7 // 2`; `text` is the source's."""
    if not isinstance(let.value, ast.Number | ast.Name | ast.Operation):
        return None
    found = _COMMENT_OF_NUMBERS.match(text, let.span.end)
    if found is None:
        return None
    words = found[1].decode("utf-8", "replace")
    span = Span(let.span.source, *found.span(1))
    return diagnostic("advice-comment", f"`{words}` is a comment", span, help=DIVISION)


def color_of_bytes(call: ast.Chain) -> Diagnostic | None:
    """Advice on `rgb(255, 165, 0)`, a call of the language's `rgb`."""
    first = call.suffixes[0]
    if not isinstance(first, ast.Call):
        return None
    numbers = (a.value.value for a in first.arguments if isinstance(a.value, ast.Number))
    values = [number for number in numbers if type(number) is float]  # and not of lines alike
    if len(values) != 3 or not all(value <= 255.0 and value.is_integer() for value in values):
        return None
    if max(values) < _FEWEST:
        return None
    in_order = all(argument.name is None for argument in first.arguments)
    example = "".join(f"{int(value):02x}" for value in values) if in_order else "ffa500"
    return diagnostic(
        "advice-color",
        "components of `rgb` go from 0 to 1",
        Span(call.span.source, call.base.span.start, first.span.end),
        help=f"a color of the web is written `#{example}`",
    )


def descending(interval: ast.Expression) -> Diagnostic | None:
    """Advice on `for i in 5..0`, of whose interval this is."""
    if not isinstance(interval, ast.Operation) or interval.operators[0].symbol != "..":
        return None
    start, end = map(_constant, interval.operands)
    if start is None or end is None or start <= end:
        return None
    return diagnostic(
        "advice-descending",
        "no number is in this interval, and the loop does nothing",
        interval.span,
        help="count down within the loop: `n - 1 - i` for i in `0..n`",
    )


def _constant(node: ast.Expression) -> float | None:
    """The value of a literal number, or of one with a sign."""
    if isinstance(node, ast.Unary) and node.operator.symbol == "-":
        value = _constant(node.operand)
        return None if value is None else -value
    return node.value if isinstance(node, ast.Number) else None
