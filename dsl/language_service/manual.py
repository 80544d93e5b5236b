"""The documentation of a program: what `///` says of its parameters, functions and names."""

from __future__ import annotations

from typing import Any

from dsl import ast
from dsl.language_service.describe import function_form
from dsl.language_service.program import Program


def manual(program: Program) -> dict[str, Any]:
    """The documentation as JSON values.

    `params` (name, default, allowed, doc) and `functions` (name, parameters with name, default
    and doc, doc) are all those of the top level, `lets` (name, value, doc) the documented ones;
    defaults and values as they are written, null for none.
    """
    found: dict[str, Any] = {"file": program.path, "params": [], "functions": [], "lets": []}
    for statement in program.module.body.statements:
        match statement:
            case ast.Param():
                found["params"].append(
                    {
                        "name": statement.name,
                        "default": _text(program, statement.default),
                        "allowed": _text(program, statement.allowed),
                        "doc": statement.doc,
                    }
                )
            case ast.Function():
                parameters = [
                    {"name": p.name, "default": _text(program, p.default), "doc": p.doc}
                    for p in statement.parameters
                ]
                found["functions"].append(
                    {
                        "name": statement.name,
                        "signature": function_form(statement, program).text,
                        "parameters": parameters,
                        "doc": statement.doc,
                    }
                )
            case ast.Let() if statement.doc:
                value = _text(program, statement.value)
                found["lets"].append({"name": statement.name, "value": value, "doc": statement.doc})
            case _:
                pass
    return found


def markdown(found: dict[str, Any]) -> str:
    """The documentation as Markdown; ends with a newline."""
    parts = [f"# {found['file']}"]
    if found["params"]:
        parts.append("## Parameters")
        for param in found["params"]:
            allowed = f" in {param['allowed']}" if param["allowed"] else ""
            parts += [f"### `{param['name']} = {_line(param['default'])}{allowed}`", param["doc"]]
    if found["functions"]:
        parts.append("## Functions")
        for function in found["functions"]:
            rows = [f"- `{p['name']}`: {p['doc']}" for p in function["parameters"] if p["doc"]]
            parts += [f"### `{function['signature']}`", function["doc"], "\n".join(rows)]
    if found["lets"]:
        parts.append("## Names")
        for let in found["lets"]:
            parts += [f"### `{let['name']} = {_line(let['value'])}`", let["doc"]]
    return "\n\n".join(part for part in parts if part) + "\n"


def _text(program: Program, node: ast.Expression | None) -> str | None:
    return None if node is None else program.text(node.span)


def _line(text: str | None) -> str:
    """What fits on a line."""
    line = (text or "…").partition("\n")[0]
    return line if line == text and len(line) <= 60 else line[:60].rstrip() + " …"
