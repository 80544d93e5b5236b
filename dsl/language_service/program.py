"""One file as the service knows it: its words, its tree and what its names mean."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import fields, is_dataclass
from functools import cached_property
from typing import Any

from dsl import ast
from dsl.budget import DEFAULT_LIMITS
from dsl.builtins import BUILTINS
from dsl.garbage import seldom_collecting
from dsl.lexer import tokenize
from dsl.parser import parse_tokens
from dsl.resolve import Resolution, resolve
from dsl.spans import Source, Span
from dsl.values import Binding

NAMES: dict[str, Binding] = {**BUILTINS, "time": Binding("time", value=0.0)}
"""What every program starts with, see `dsl.builtins`; only the name of `time` counts here."""

Defined = ast.Definition | ast.Parameter | ast.LoopVariable
"""What gives a name a meaning."""


class Program:
    """One version of one file: its words (the last of kind "end"), its tree, their faults."""

    @seldom_collecting()
    def __init__(self, path: str, text: str) -> None:
        self.path = path
        self.source = Source(path, text)
        tokens, self.faults = tokenize(self.source, DEFAULT_LIMITS)
        self.module = parse_tokens(self.source, tokens, self.faults, DEFAULT_LIMITS)
        self.tokens = list(tokens)
        # What has been found out about it, and from which versions of the files that it uses.
        self.remembered: tuple[tuple[Program, ...], Any] | None = None

    @cached_property
    def encoded(self) -> bytes:
        """The bytes that spans count."""
        return self.source.encoded()

    @cached_property
    @seldom_collecting()
    def resolution(self) -> Resolution:
        """What the names refer to."""
        return resolve(self.module, NAMES, DEFAULT_LIMITS.diagnostics)

    @cached_property
    def definitions(self) -> dict[Binding, Defined]:
        """What defines each binding."""
        return {
            binding: node
            for node, binding in self.resolution.definitions.items()
            if isinstance(node, Defined)
        }

    @cached_property
    def top_level(self) -> dict[str, Defined]:
        """The names that a file which uses this one can reach; the last definition counts."""
        return {s.name: s for s in self.module.body.statements if isinstance(s, ast.Definition)}

    @cached_property
    def uses(self) -> tuple[ast.Use, ...]:
        """The `use`s of the top level."""
        return tuple(s for s in self.module.body.statements if isinstance(s, ast.Use))

    def text(self, span: Span) -> str:
        """The words of a place in this file."""
        return self.encoded[span.start : span.end].decode("utf-8", "replace")

    def enclosing(self, offset: int) -> list[Any]:
        """The nodes around an offset, outermost first."""
        path: list[Any] = [self.module.body]
        while True:
            inner = [n for n in children(path[-1]) if n.span.start <= offset <= n.span.end]
            if not inner:
                return path
            path.append(inner[-1])

    def visible(self, offset: int) -> dict[str, Defined]:
        """The names that the program itself defines and that can be used at an offset."""
        names: dict[str, Defined] = {}
        for node in self.enclosing(offset):
            match node:
                case ast.Block():
                    for statement in node.statements:
                        if isinstance(statement, ast.Function) or (
                            isinstance(statement, ast.Definition) and statement.span.end <= offset
                        ):
                            names[statement.name] = statement
                case ast.Function():
                    for parameter in node.parameters:
                        if parameter.span.end <= offset:
                            names[parameter.name] = parameter
                case ast.For() if offset >= node.body.span.start:
                    names.update({variable.name: variable for variable in node.variables})
                case _:
                    pass
        return names


def children(node: Any) -> Iterator[Any]:
    """The nodes directly below a node of the syntax tree, in order of their text."""
    for name in _fields(type(node)):
        value = getattr(node, name)
        if isinstance(value, tuple):
            yield from _nodes(value)
        elif is_dataclass(value) and not isinstance(value, Span):
            yield value


def walk(node: Any) -> Iterator[Any]:
    """A node and all below it, in order of their text."""
    stack = [node]
    while stack:
        found = stack.pop()
        yield found
        stack += reversed(list(children(found)))


def _nodes(values: tuple[Any, ...]) -> Iterator[Any]:
    for value in values:
        if isinstance(value, tuple):
            yield from _nodes(value)
        elif is_dataclass(value):
            yield value


def _fields(kind: type) -> tuple[str, ...]:
    if kind not in _FIELDS:
        _FIELDS[kind] = tuple(field.name for field in fields(kind) if "span" not in field.name)
    return _FIELDS[kind]


_FIELDS: dict[type, tuple[str, ...]] = {}
