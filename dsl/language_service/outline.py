"""The definitions of a file, and the parts of it that can be folded away."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

from dsl import ast
from dsl.language_service.describe import headline
from dsl.language_service.lines import Lines
from dsl.language_service.meaning import Reader
from dsl.language_service.program import Program, children
from dsl.language_service.project import Project
from dsl.spans import Span

_COMMENT = re.compile(rb"//[^\r\n]*|/\*[\s\S]*?\*/")
_CLOSERS = {")": "(", "]": "[", "}": "{"}


@dataclass(frozen=True, slots=True)
class Symbol:
    """A definition with those inside it; `kind` is that of its value."""

    name: str
    kind: str
    detail: str
    span: Span
    name_span: Span
    children: tuple[Symbol, ...]


def symbols(project: Project, program: Program) -> list[Symbol]:
    """The definitions of the top level, each with those in its blocks."""
    return _symbols(Reader(project, program), program, program.module.body)


def _symbols(reader: Reader, program: Program, node: Any) -> list[Symbol]:
    found: list[Symbol] = []
    waiting = list(reversed(list(children(node))))
    while waiting:
        each = waiting.pop()
        if isinstance(each, ast.Definition):
            detail = headline(each, program)
            found.append(
                Symbol(
                    each.name,
                    reader.defined(each, program).kind,
                    detail,
                    each.span,
                    each.name_span,
                    tuple(_symbols(reader, program, each)),
                )
            )
        else:
            waiting += reversed(list(children(each)))
    return found


@dataclass(frozen=True, slots=True)
class Fold:
    """Lines, counted from 0, of which the first stays."""

    first: int
    last: int
    kind: Literal["region", "comment", "imports"]


def folds(program: Program, lines: Lines) -> list[Fold]:
    """Brackets, runs of comments, and runs of `use` that are longer than a line."""
    tokens = program.tokens
    found: list[Fold] = []
    opened: list[tuple[str, int]] = []
    for token in tokens:
        if token.kind in ("(", "[", "{"):
            opened.append((token.kind, lines.line_of(token.start)))
        elif opener := _CLOSERS.get(token.kind):
            while opened:
                kind, line = opened.pop()
                if kind == opener:
                    # The line of the closing bracket stays in sight.
                    found.append(Fold(line, lines.line_of(token.start) - 1, "region"))
                    break
    found += _runs(
        [(lines.line_of(u.span.start), lines.line_of(u.span.end)) for u in program.uses], "imports"
    )
    comments: list[tuple[int, int]] = []
    end = 0
    for token in tokens:
        for match in _COMMENT.finditer(program.encoded, end, token.start):
            comments.append((lines.line_of(match.start()), lines.line_of(match.end())))
        end = token.end
    found += _runs(comments, "comment")
    return sorted((f for f in set(found) if f.last > f.first), key=lambda f: (f.first, f.last))


def _runs(parts: Sequence[tuple[int, int]], kind: Literal["comment", "imports"]) -> list[Fold]:
    """Parts on lines that follow one another, as one."""
    found: list[Fold] = []
    for first, last in parts:
        if found and first <= found[-1].last + 1:
            found[-1] = Fold(found[-1].first, last, kind)
        else:
            found.append(Fold(first, last, kind))
    return found
