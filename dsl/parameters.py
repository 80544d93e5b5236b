"""`param`: values of a program that whoever compiles it may set.

    param count = 24 in 3..60
    param tilt = 10deg
    param finish = "matte" in ["matte", "metal"]

A setting has the type of the default. Text, as a command line or a query has it, is read as a
literal of the language, or is the string itself where the default is one.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import TypeAlias, cast

import numpy as np

from dsl import ast
from dsl.budget import Limits
from dsl.codes import diagnostic
from dsl.diagnostics import Diagnostic
from dsl.faults import Fault, mismatch, source_text
from dsl.parser import parse
from dsl.scene import Param, Plain
from dsl.spans import Source, Span
from dsl.suggest import did_you_mean
from dsl.values import Angle, Color, Interval, List, Value, Vector, shown, type_name

Setting: TypeAlias = float | bool | str | Sequence[float]
"""A value from outside: a sequence is a vector, or the linear components of a color."""
Settings = Mapping[str, Setting]

_KINDS = (float, bool, str, Angle, Vector, Color)
_LONGEST = 1000
"""Characters of a setting that is read as a literal."""


def unknown_settings(module: ast.Module | None, settings: Settings) -> list[Diagnostic]:
    """A fault for each setting that is no `param` of the program; a stage has none."""
    body = module.body.statements if module is not None else ()
    known = [s.name for s in body if isinstance(s, ast.Param)]
    found = []
    for name in settings:
        if name not in known:
            help = None if module is None else "declare it: `param name = default`"
            if known:
                help = f"its parameters are {', '.join(f'`{word}`' for word in known)}"
            found.append(
                diagnostic(
                    "name-unknown-setting",
                    f"the scene has no parameter `{name[:80]}`",
                    help=did_you_mean(name, known) or help,
                )
            )
    return found


def settled(
    statement: ast.Param, default: Value, allowed: Value | None, settings: Settings
) -> tuple[Value, Param]:
    """A parameter's value, and what tools are told of it. Raises Fault.

    The default is judged by what is allowed as much as a setting is.
    """
    if not isinstance(default, _KINDS):
        due = "a number, a truth value, a string, an angle, a vector or a color"
        raise mismatch(f"the default of `{statement.name}`", due, default, statement.default)
    if statement.allowed is not None:
        _check_allowed(statement, default, allowed, statement.allowed)
    value: Value = default
    own = statement.default.span
    _check(allowed, value, f"the default of `{statement.name}` is", own)
    if statement.name in settings:
        value = _setting(statement, default, settings[statement.name])
        place = own if statement.allowed is None else statement.allowed.span
        _check(allowed, value, f"`{statement.name}` is set to", place)
    low = high = None
    if isinstance(allowed, Interval):
        low, high = _plain(allowed.start), _plain(allowed.end)
    choices = tuple(map(_plain, allowed.items)) if isinstance(allowed, List) else ()
    told = Param(statement.name, _plain(value), _plain(default), low, high, choices, statement.doc)
    return value, told


def _check_allowed(
    statement: ast.Param, default: Value, allowed: Value | None, node: ast.Expression
) -> None:
    """Fault unless `allowed` is an interval, or a list, of the default's type."""
    subject = f"what is allowed for `{statement.name}`"
    plain = "angles" if isinstance(default, Angle) else "numbers"
    if isinstance(allowed, Interval) and isinstance(default, float | Angle):
        if type(allowed.start) is not type(default):
            raise mismatch(subject, f"an interval of {plain}", allowed, node)
        if _number(allowed.start) > _number(allowed.end):
            raise Fault("value-order", "the start of the interval is above its end", node.span)
    elif isinstance(allowed, List) and allowed.items:
        for item in allowed.items:
            if type_name(item) != type_name(default):
                raise mismatch(f"a choice of `{statement.name}`", type_name(default), item, node)
    else:
        due = "a list of choices"
        if isinstance(default, float | Angle):
            due = f"an interval of {plain} or a list of choices"
        raise mismatch(subject, due, cast("Value", allowed), node)


def _check(allowed: Value | None, value: Value, subject: str, place: Span) -> None:
    """Fault if the value is not allowed."""
    if isinstance(allowed, Interval):
        low, high = shown(allowed.start), shown(allowed.end)
        if not _number(allowed.start) <= _number(value) <= _number(allowed.end):
            message = f"{subject} {shown(value)}, outside of {low}..{high}"
            help = f"choose a value from {low} to {high}"
            raise Fault("value-out-of-range", message, place, help=help)
    elif isinstance(allowed, List) and value not in allowed.items:
        near = None
        if isinstance(value, str):
            near = did_you_mean(value, [item for item in allowed.items if isinstance(item, str)])
        options = ", ".join(map(shown, allowed.items[:10]))
        message = f"{subject} {shown(value)}, which is not among the choices"
        raise Fault("value-choice", message, place, help=near or f"choose one of {options}")


def _setting(statement: ast.Param, default: Value, given: Setting) -> Value:
    """The value of a setting in the type of the default. Raises Fault."""
    value: object = given.tolist() if isinstance(given, np.generic | np.ndarray) else given
    if isinstance(given, str) and not isinstance(default, str):
        value = _literal(given)
    result: Value
    match default, value:
        case (bool(), bool()) | (str(), str()) | (Angle(), Angle()) | (Color(), Color()):
            result = cast("Value", value)
        case float(), int() | float() if not isinstance(value, bool):
            result = float(value)
        case Vector(components), Vector(others) if len(components) == len(others):
            result = value
        case ((Vector(components) | Color(components)), list() | tuple()):
            if len(value) != len(components) or not all(
                isinstance(x, int | float) and not isinstance(x, bool) for x in value
            ):
                raise _unfit(statement, default, given)
            result = type(default)(tuple(map(float, value)))  # type: ignore[arg-type]
        case _:
            raise _unfit(statement, default, given)
    if isinstance(default, float | Vector | Color):
        numbers = (result,) if isinstance(result, float) else result.components  # type: ignore[union-attr]
        if not all(map(math.isfinite, numbers)):
            raise Fault(
                "value-not-finite",
                f"`{statement.name}` is set to what is not finite",
                statement.name_span,
            )
    return result


def _unfit(statement: ast.Param, default: Value, given: Setting) -> Fault:
    code = "type-mismatch"
    if isinstance(default, Angle) and (
        isinstance(given, float | int) or isinstance(_literal(str(given)), float)
    ):
        code = "type-angle-unit"
    text = f'"{given}"' if isinstance(given, str) else str(given)
    return Fault(
        code,
        f"`{statement.name}` is set to {text[:80]}, and must be {type_name(default)}",
        statement.name_span,
        help=f"set it to a value such as `{source_text(statement.default.span)[:80]}`",
    )


def _literal(text: str) -> Value | None:
    """The value of a literal of the language; None for any other text."""
    module, faults = parse(Source("", text[:_LONGEST]), Limits(nesting=8))
    statements = module.body.statements
    if faults or len(text) > _LONGEST or len(statements) != 1:
        return None
    return _value(cast("ast.Expression", statements[0]))


def _value(node: ast.Expression) -> Value | None:
    match node:
        case ast.Number(value=value) | ast.Boolean(value=value):
            return value
        case ast.String(text=text):
            return text
        case ast.AngleLiteral(degrees=degrees):
            return Angle(degrees)
        case ast.ColorLiteral(components=components):
            return Color(components)
        case ast.Unary(operator=ast.Operator(symbol="-"), operand=operand):
            match _value(operand):
                case float(number) if not isinstance(number, bool):
                    return -number
                case Angle(degrees):
                    return Angle(-degrees)
        case ast.VectorLiteral(components=parts):
            numbers = _numbers(parts)
            return Vector(numbers) if numbers is not None else None
        case ast.Chain(base=ast.Name(name="rgb"), suffixes=(ast.Call(arguments=parts),)):
            match _numbers([part.value for part in parts if part.name is None]):
                case (red, green, blue):
                    return Color((red, green, blue))
    return None


def _numbers(nodes: Iterable[ast.Expression]) -> tuple[float, ...] | None:
    values = [_value(node) for node in nodes]
    if all(type(value) is float for value in values):
        return tuple(cast("list[float]", values))
    return None


def _number(value: Value) -> float:
    return value.degrees if isinstance(value, Angle) else cast("float", value)


def _plain(value: Value) -> Plain:
    """The value as a setting would give it."""
    match value:
        case bool() | float() | str():
            return value
        case Vector(components) | Color(components):
            return components
        case _:
            return shown(value)
