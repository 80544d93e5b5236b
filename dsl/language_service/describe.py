"""Signatures and documentation as text: what hover, completion and `ovolo doc` show."""

from __future__ import annotations

from dataclasses import dataclass

from dsl import ast
from dsl.calls import shown
from dsl.language_service.occurrences import BuiltinParameter, Target
from dsl.language_service.program import Program
from dsl.values import Binding, Builtin, Signature

_CONSTANTS = {
    "pi": "The ratio of a circle's circumference to its diameter. An angle is written `0.5turn`.",
    "time": "The time of the picture, which `--time` sets; 0 otherwise.",
}


@dataclass(frozen=True, slots=True)
class Form:
    """One way to call a function: its text, and of each parameter the text in it and the doc."""

    text: str
    parameters: tuple[tuple[str, str], ...]
    doc: str


def builtin_form(builtin: Builtin, signature: Signature) -> Form:
    """A signature as the reference writes it, `sphere(radius: 1) → an object`."""
    parameters = [
        (shown(p), ", ".join(w for w in (p.kind.name, p.doc) if w)) for p in signature.parameters
    ]
    if signature.rest is not None:
        parameters.append(("…", signature.rest.name))
    words = ", ".join(word for word, _ in parameters)
    text = f"{builtin.name}({words}) → {builtin.result}"
    return Form(text, tuple(parameters), builtin.doc)


def function_form(function: ast.Function, home: Program) -> Form:
    """The head of a function of a program."""
    parameters = [
        (p.name if p.default is None else f"{p.name}: {home.text(p.default.span)}", p.doc)
        for p in function.parameters
    ]
    words = ", ".join(word for word, _ in parameters)
    return Form(f"{function.name}({words})", tuple(parameters), function.doc)


def forms(callee: ast.Function | Builtin, home: Program | None) -> list[Form]:
    """All ways to call something."""
    if isinstance(callee, Builtin):
        return [builtin_form(callee, signature) for signature in callee.signatures]
    return [function_form(callee, home)] if home is not None else []


def headline(target: Target, home: Program | None) -> str:
    """The target in a line or a few, as code."""
    match target:
        case Builtin():
            return "\n".join(form.text for form in forms(target, None))
        case BuiltinParameter():
            return f"{shown(target.parameter)} // {target.parameter.kind.name}"
        case Binding():
            return target.name
        case ast.Function():
            return "fn " + "".join(form.text for form in forms(target, home))
        case ast.Parameter():
            if target.default is None or home is None:
                return f"{target.name} // a parameter"
            return f"{target.name} = {_short(home.text(target.default.span))} // a parameter"
        case ast.LoopVariable():
            return f"{target.name} in {_short(home.text(target.range.span) if home else '…')}"
        case _:
            return _short(home.text(target.span) if home is not None else target.name)


def documentation(target: Target) -> str:
    """What is said about a target, in Markdown."""
    match target:
        case BuiltinParameter():
            return target.parameter.doc
        case Binding():
            return _CONSTANTS.get(target.name, "")
        case ast.Function():
            listed = [f"- `{p.name}`: {p.doc}" for p in target.parameters if p.doc]
            return "\n\n".join(part for part in (target.doc, "\n".join(listed)) if part)
        case ast.LoopVariable():
            return ""
        case _:
            return target.doc


def _short(text: str) -> str:
    """The first line, and no more than fits."""
    line = text.splitlines()[0] if text else ""
    return line if len(line) <= 80 and line == text else line[:80].rstrip() + " …"
