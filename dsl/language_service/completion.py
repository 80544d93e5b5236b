"""What could be written at the cursor."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Literal

from dsl import ast
from dsl.angles import UNITS
from dsl.language_service.cursor import CallSite, Cursor
from dsl.language_service.describe import documentation, forms, headline
from dsl.language_service.meaning import Reader, members, methods
from dsl.language_service.program import NAMES, Defined, Program
from dsl.language_service.project import Project
from dsl.values import Binding, Builtin, Parameter

Kind = Literal[
    "function", "method", "variable", "parameter", "constant", "member", "file", "keyword", "unit"
]

_UNIT = re.compile(r"(?<![\w.])[0-9]+(?:\.[0-9]+)?(?:[eE][+-]?[0-9]+)?([a-zA-Z]*)\Z")
_STATEMENTS = {
    "let": "let ${1:name} = $0",
    "fn": "fn ${1:name}(${2:parameters}) {\n  $0\n}",
    "use": 'use "${1:file.ovo}" as ${2:name}',
    "param": "param ${1:name} = ${2:1} in ${3:0..10}",
}
_EXPRESSIONS = {
    "for": "for ${1:i} in ${2:0..10} {\n  $0\n}",
    "if": "if ${1:condition} {\n  $0\n}",
    "true": "true",
    "false": "false",
    "not": "not $0",
}
_OPERATORS = ("and", "or", "in", "else", "as")
_COMMON_VALUES = {
    "an angle": ("90deg", "0.25turn"),
    "a color": ("rgb(${1:0.8}, ${2:0.8}, ${3:0.8})", "#d2b48c"),
    "a truth value": ("true", "false"),
}


@dataclass(frozen=True, slots=True)
class Completion:
    """A word that could stand at `start..end`.

    `snippet` is what to insert, with placeholders as editors write them; `order` sorts, the
    likeliest first; `doc` is Markdown.
    """

    label: str
    kind: Kind
    start: int
    end: int
    snippet: str
    detail: str = ""
    doc: str = ""
    order: int = 5


def completions(project: Project, program: Program, offset: int) -> list[Completion]:
    """The words that make sense at an offset, in no order but `order`."""
    cursor = Cursor(project, program, offset)
    if cursor.in_comment or cursor.inside not in (None, "number", "angle", "fault"):
        return []
    if cursor.inside is not None:
        return list(_units(cursor))
    if cursor.kind == ".":
        return list(_after_dot(cursor))
    if cursor.names_something:
        return []
    found: dict[str, Completion] = {}
    call = cursor.call()
    listed = [] if call is None else [*_arguments(cursor, call)]
    for item in (*listed, *_names(cursor, call), *_keywords(cursor)):
        found.setdefault(item.label, item)
    return list(found.values())


def _item(
    cursor: Cursor, label: str, kind: Kind, snippet: str = "", *, order: int = 5, **words: str
) -> Completion:
    return Completion(
        label, kind, cursor.start, cursor.end, snippet or _plain(label), order=order, **words
    )


def _units(cursor: Cursor) -> Iterator[Completion]:
    """Units behind the digits before the cursor."""
    line = cursor.program.encoded[max(0, cursor.offset - 60) : cursor.offset]
    match = _UNIT.search(line.decode("utf-8", "replace"))
    if match is not None:
        start = cursor.offset - len(match[1])
        for unit in UNITS:
            yield Completion(unit, "unit", start, cursor.offset, unit, "unit of angle")


def _after_dot(cursor: Cursor) -> Iterator[Completion]:
    before = cursor.base()
    if before.file is not None:
        for name, node in before.file.top_level.items():
            yield _defined(cursor, name, node, before.file)
        return
    for name in members(before.kind):
        yield _item(cursor, name, "member", order=1)
    if before.kind == "a transform":
        detail = "inverse() → a transform"
        yield _item(cursor, "inverse", "method", "inverse()", detail=detail, order=1)
    for name, builtin in methods(before.kind).items():
        yield _function(cursor, name, builtin, None, "method")


def _arguments(cursor: Cursor, call: CallSite) -> Iterator[Completion]:
    """Names of the call's parameters, and values that are usual for the one being given."""
    callee = call.callee.callee
    if isinstance(callee, Builtin):
        seen: set[str] = set()
        for signature in callee.signatures:
            for position, parameter in enumerate(signature.parameters):
                if parameter.name in seen or parameter.name in call.given:
                    continue
                if call.begins and (position >= call.argument or call.given):
                    seen.add(parameter.name)
                    yield _named(cursor, parameter.name, parameter.kind.name, parameter.doc)
        expected = _expected(callee, call)
        for snippet in _COMMON_VALUES.get(expected.kind.name if expected else "", ()):
            label = re.sub(r"\$\{\d+:([^}]*)\}", r"\1", snippet)
            if not label.startswith("#") or cursor.start == cursor.offset:
                yield _item(cursor, label, "constant", snippet, order=2)
    elif callee is not None and call.begins:
        for position, own in enumerate(callee.parameters):
            if own.name not in call.given and (position >= call.argument or call.given):
                yield _named(cursor, own.name, "", own.doc)


def _named(cursor: Cursor, name: str, kind: str, doc: str) -> Completion:
    return _item(cursor, f"{name}:", "parameter", f"{name}: $0", detail=kind, doc=doc, order=0)


def _expected(callee: Builtin, call: CallSite) -> Parameter | None:
    """The parameter that the argument at the cursor is for."""
    for signature in callee.signatures:
        for position, parameter in enumerate(signature.parameters):
            if call.name == parameter.name or (call.name is None and position == call.argument):
                return parameter
    return None


def _names(cursor: Cursor, call: CallSite | None) -> Iterator[Completion]:
    """Names that are visible, those of the kind that is due first."""
    callee = call.callee.callee if call is not None else None
    expected = _expected(callee, call) if isinstance(callee, Builtin) and call else None
    due = expected.kind.name if expected is not None else ""
    reader = Reader(cursor.project, cursor.program)
    for name, node in cursor.program.visible(cursor.offset).items():
        fits = bool(due) and reader.defined(node, cursor.program).kind == due
        yield _defined(cursor, name, node, cursor.program, 1 if fits else 3)
    for name, binding in NAMES.items():
        if isinstance(binding.value, Builtin):
            fits = bool(due) and binding.value.result == due
            yield _function(cursor, name, binding.value, None, "function", 2 if fits else 5)
        else:
            yield _item(cursor, name, "constant", doc=documentation(Binding(name)))


def _keywords(cursor: Cursor) -> Iterator[Completion]:
    begins = cursor.kind in ("", "newline", "{", "}")
    for words, order in ((_STATEMENTS if begins else {}, 4), (_EXPRESSIONS, 6)):
        for word, snippet in words.items():
            yield _item(cursor, word, "keyword", snippet, order=order)
    for word in () if begins else _OPERATORS:
        yield _item(cursor, word, "keyword", order=7)


def _defined(cursor: Cursor, name: str, node: Defined, home: Program, order: int = 3) -> Completion:
    if isinstance(node, ast.Function):
        return _function(cursor, name, node, home, "function", order)
    kinds: dict[type, Kind] = {ast.Use: "file", ast.Parameter: "parameter"}
    return _item(
        cursor,
        name,
        kinds.get(type(node), "variable"),
        detail=headline(node, home),
        doc=documentation(node),
        order=order,
    )


def _function(
    cursor: Cursor,
    name: str,
    callee: ast.Function | Builtin,
    home: Program | None,
    kind: Kind,
    order: int = 3,
) -> Completion:
    listed = forms(callee, home)
    following = cursor.program.encoded[cursor.end : cursor.end + 1]
    snippet = _plain(name) if following == b"(" else f"{_plain(name)}({_placeholders(callee)})"
    return _item(
        cursor,
        name,
        kind,
        snippet,
        detail=listed[0].text if listed else "",
        doc=documentation(callee),
        order=order,
    )


def _placeholders(callee: ast.Function | Builtin) -> str:
    """The arguments that must be given; where there are none, the place for others."""
    if isinstance(callee, Builtin):
        signature = callee.signatures[0]
        needed = [p.name for p in signature.parameters if p.required]
        takes = bool(signature.parameters or signature.rest)
    else:
        needed = [p.name for p in callee.parameters if p.default is None]
        takes = bool(callee.parameters)
    if not needed:
        return "$1" if takes else ""
    if len(needed) == 1:
        return f"${{1:{needed[0]}}}"
    return ", ".join(_labelled(needed))


def _labelled(needed: Iterable[str]) -> Iterator[str]:
    for number, name in enumerate(needed, 1):
        yield f"{name}: ${{{number}:{name}}}"


def _plain(text: str) -> str:
    """A text without meaning as a snippet."""
    return re.sub(r"([\\$}])", r"\\\1", text)
