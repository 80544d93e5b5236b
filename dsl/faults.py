"""Faults of evaluation: raised where they are found, recorded at the statement around them."""

from __future__ import annotations

from dsl import ast
from dsl.codes import diagnostic
from dsl.diagnostics import Diagnostic, Label
from dsl.elsewhere import AXIS, MIDDLE
from dsl.scene import Group
from dsl.spans import Span
from dsl.values import Angle, Value, Vector, type_name


class Fault(Exception):
    """An expression has no value; carries the diagnostic."""

    def __init__(
        self,
        code: str,
        message: str,
        span: Span,
        text: str = "",
        *,
        help: str | None = None,
        secondary: tuple[Label, ...] = (),
    ) -> None:
        super().__init__(message)
        self.span = span
        self.diagnostic = diagnostic(code, message, span, text, help=help, secondary=secondary)


class Exhausted(Exception):
    """A limit is reached and the run ends; carries the diagnostic, if there is one to add."""

    def __init__(self, found: Diagnostic | None = None) -> None:
        super().__init__()
        self.diagnostic = found


class Poisoned(Exception):
    """An operand is faulty, and its fault is reported already."""


def source_text(span: Span) -> str:
    """The user's own words."""
    return span.source.encoded()[span.start : span.end].decode(errors="replace")


def mismatch(subject: str, due: str, value: Value, expression: ast.Expression) -> Fault:
    """The fault of a value of the wrong type: `subject` (`` `radius` ``) is to be `due`."""
    found = type_name(value)
    code, help = "type-mismatch", None
    if due == "an angle" and isinstance(value, float):
        code = "type-angle-unit"
        words = source_text(expression.span)
        if isinstance(expression, ast.Number):
            help = f"write `{words}deg`"
            if not value.is_integer() and abs(value) <= 6.3:
                help += f", or `{words}rad` if it is in radians"
        else:
            unit = "rad" if "pi" in words else "deg"
            help = f"give the number a unit by multiplying it: `… * 1{unit}`"
    elif due == "a number" and isinstance(value, Angle):
        code = "type-angle-unit"
        if isinstance(expression, ast.AngleLiteral):
            number = source_text(expression.span).rstrip("abcdefghijklmnopqrstuvwxyz")
            help = f"write `{number}` without a unit"
        else:
            help = "divide it by a unit to have its number: `… / 1deg`"
    elif due == "an interval of angles" and found == "an interval of numbers":
        code, help = "type-angle-unit", "give both ends a unit: `0deg..90deg`"
    elif due == "an interval of numbers" and found == "an interval of angles":
        code, help = "type-angle-unit", "write both ends without a unit"
    elif due == "a color" and found == "a vector of 3":
        help = f"write `rgb{source_text(expression.span)}`"
        if not isinstance(expression, ast.VectorLiteral):
            help = "make it of components: `rgb(v.x, v.y, v.z)`"
    elif due == "a color" and isinstance(expression, ast.String) and "." in expression.text:
        help = f'a picture is for skies: `sky(texture: "{expression.text[:40]}")`'
    elif due == "a color" and found == "a string":
        help = "a color is written `rgb(1, 0, 0)` or `#ff0000`"
    elif due.startswith("a vector") and isinstance(expression, ast.ListLiteral):
        help = f"a vector is written in round brackets: `({source_text(expression.span)[1:-1]})`"
    elif due == "an interval of numbers" and found in ("a list", "a vector of 2"):
        help = "an interval is written `a..b`"
    elif due == "an interval of numbers" and found == "a number":
        help = f"an interval is written `a..b`, such as `0..{source_text(expression.span)[:20]}`"
    elif due.startswith("a number") and found == "a list":
        help = "an item is written `list[0]`"
    elif due == "a number" and isinstance(value, Vector):
        if not isinstance(expression, ast.VectorLiteral):
            help = "a component is written `v.x`"
        elif subject == "`radius`":
            help = MIDDLE
        elif subject.startswith("an argument"):
            help = "each number is an argument of its own: leave the inner brackets out"
    elif due == "a truth value" and found == "a number":
        help = "compare it, as in `x > 0`"
    elif due == "a vector of 3" and isinstance(expression, ast.String):
        help = AXIS if expression.text.strip("+-").lower() in ("x", "y", "z") else None
    elif due == "a transform" and isinstance(value, Vector):
        help = f"a transform is made by a call: `translate({source_text(expression.span)[:40]})`"
    elif due == "a transform" and found == "a list":
        help = "`matrix(…)` takes the twelve numbers of the upper three rows"
    elif due == "a material" and found == "a color":
        help = f"make a material of it: `matte({source_text(expression.span)[:40]})`"
    elif due == "a material" and found == "a string":
        help = "a material is made by a call: `matte(rgb(1, 0, 0))`"
    elif due in ("a number", "an angle") and isinstance(expression, ast.String):
        if expression.text[:1].isdigit():
            help = f"write it without quotes: `{expression.text[:20]}`"
    elif isinstance(value, Group) and not value.items:
        found = "the empty group"
        help = "a block without an expression, and an `if` without `else`, has no value"
    elif found == "a function" and isinstance(expression, ast.Name):
        help = f"call it: `{expression.name}()`"
    return Fault(code, f"{subject} must be {due}, not {found}", expression.span, help=help)
