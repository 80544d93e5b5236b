"""What an editor's cursor stands in, from the words before it alone.

A program that is being typed seldom has a tree at the cursor, but its words are always there.
"""

from __future__ import annotations

import re
from bisect import bisect_left
from dataclasses import dataclass

from dsl import ast
from dsl.language_service.meaning import METHODS, Lookup, Meaning, Reader, builtin_named
from dsl.language_service.program import Program
from dsl.language_service.project import Project
from dsl.parser import parse
from dsl.spans import Source
from dsl.tokens import KEYWORDS

_OPENERS = {")": "(", "]": "[", "}": "{"}
_COMMENT = re.compile(rb"//[^\r\n]*|/\*(?:[\s\S]*?\*/|[\s\S]*)")
_LONGEST = 2000  # words that are looked back over for the bracket around the cursor


@dataclass(frozen=True, slots=True)
class CallSite:
    """A call around the cursor.

    `argument` counts the commas before the cursor; `name` is that of its argument, if it has
    one, and `given` are those of all arguments before it; `begins` says that no word of the
    argument comes before the one at the cursor.
    """

    callee: Meaning
    argument: int
    name: str | None
    given: tuple[str, ...]
    begins: bool


class Cursor:
    """The words around an offset; `start..end` is the name there, as far as it is typed."""

    def __init__(self, project: Project, program: Program, offset: int) -> None:
        self.project = project
        self.program = program
        self.offset = offset
        tokens = program.tokens
        before = bisect_left(tokens, offset, key=lambda token: token.start)
        self.before = before - 1  # the last token that begins before the cursor
        self.start = self.end = offset
        self.inside: str | None = None  # the kind of the token that the cursor is in
        if self.before >= 0:
            token = tokens[self.before]
            if token.kind in ("name", "reserved") or token.kind in KEYWORDS:
                if offset <= token.end:
                    self.start, self.end = token.start, token.end
                    self.before -= 1
            elif offset < token.end or (
                token.kind in ("number", "angle", "fault") and offset == token.end
            ):
                self.inside = token.kind

    @property
    def in_comment(self) -> bool:
        """Whether nothing that is typed here is read."""
        start = self.program.tokens[self.before].end if self.before >= 0 else 0
        between = self.program.encoded[start : self.offset]
        return any(
            match.end() == len(between) and not (match[0].endswith(b"*/") and len(match[0]) > 3)
            for match in _COMMENT.finditer(between)
        )

    @property
    def kind(self) -> str:
        """The kind of the token before the word at the cursor."""
        return self.program.tokens[self.before].kind if self.before >= 0 else ""

    @property
    def names_something(self) -> bool:
        """Whether the word at the cursor is a new name."""
        if self.kind in ("let", "fn", "for", "as", "param"):
            return True
        opener = self._around() if self.kind in ("(", ",") else None
        return opener is not None and self._is_head(opener)

    @property
    def lookup(self) -> Lookup:
        """What names mean at the cursor."""
        names = self.program.visible(self.offset)
        return lambda name: names.get(name) or builtin_named(name)

    def base(self) -> Meaning:
        """What stands before the dot before the cursor."""
        return self._meaning(self.before - 1)

    def call(self) -> CallSite | None:
        """The innermost call whose brackets the cursor is in, with no block between."""
        opener = self._around()
        while opener is not None and self.program.tokens[opener].kind != "{":
            if self._is_call(opener):
                return self._site(opener)
            opener = self._around(opener - 1)
        return None

    def _around(self, last: int | None = None) -> int | None:
        """The bracket that is open behind a token."""
        tokens = self.program.tokens
        last = self.before if last is None else last
        depth = 0
        for position in range(last, max(-1, last - _LONGEST), -1):
            kind = tokens[position].kind
            depth += (kind in _OPENERS) - (kind in ("(", "[", "{"))
            if depth < 0:
                return position
        return None

    def _is_call(self, opener: int) -> bool:
        tokens = self.program.tokens
        callee = opener > 0 and tokens[opener - 1].kind in ("name", ")", "]", "reserved")
        return callee and tokens[opener].kind == "(" and not self._is_head(opener)

    def _is_head(self, opener: int) -> bool:
        """Whether the bracket holds the parameters of a definition."""
        return opener > 1 and self.program.tokens[opener - 2].kind == "fn"

    def _site(self, opener: int) -> CallSite:
        tokens = self.program.tokens
        begins = [opener + 1]
        depth = 0
        for position in range(opener + 1, self.before + 1):
            kind = tokens[position].kind
            depth += (kind in ("(", "[", "{")) - (kind in _OPENERS)
            if kind == "," and not depth:
                begins.append(position + 1)
        names: list[str | None] = []
        for begin in begins:
            named = begin + 1 <= self.before and tokens[begin + 1].kind == ":"
            names.append(str(tokens[begin].value or tokens[begin].kind) if named else None)
        return CallSite(
            self._callee(opener - 1),
            len(begins) - 1,
            names[-1],
            tuple(name for name in names[:-1] if name is not None),
            begins[-1] > self.before,
        )

    def _callee(self, last: int) -> Meaning:
        """What a call calls whose callee ends with that token."""
        tokens = self.program.tokens
        if tokens[last].kind == "name" and last >= 2 and tokens[last - 1].kind == ".":
            before = self._meaning(last - 2)
            if before.file is None:
                return Meaning(callee=METHODS.get(str(tokens[last].value)))
        return self._meaning(last)

    def _meaning(self, last: int) -> Meaning:
        """The meaning of the operand that ends with that token."""
        tokens = self.program.tokens
        first = self._operand(last)
        if first is None:
            return Meaning()
        text = self.program.encoded[tokens[first].start : tokens[last].end]
        source = Source(self.program.path, text.decode("utf-8", "replace"))
        statements = parse(source)[0].body.statements
        if len(statements) != 1 or isinstance(statements[0], ast.Definition):
            return Meaning()
        return Reader(self.project, self.program, self.lookup).meaning(statements[0])

    def _operand(self, last: int) -> int | None:
        """The first token of a base with suffixes that ends with a token."""
        tokens = self.program.tokens
        position = last
        while position >= 0:
            kind = tokens[position].kind
            if kind in _OPENERS:
                opener = self._opener(position)
                if opener is None:
                    return None
                suffix = kind != "}" and opener > 0 and tokens[opener].kind in ("(", "[")
                if suffix and tokens[opener - 1].kind in ("name", ")", "]", "}"):
                    position = opener - 1
                    continue
                first = opener
            elif kind in ("name", "reserved", "string", "color", "number", "angle"):
                first = position
            else:
                return None
            if first >= 2 and tokens[first - 1].kind == ".":
                position = first - 2
                continue
            return first
        return None

    def _opener(self, closer: int) -> int | None:
        tokens = self.program.tokens
        depth = 0
        for position in range(closer, max(-1, closer - 10 * _LONGEST), -1):
            kind = tokens[position].kind
            depth += (kind in _OPENERS) - (kind in ("(", "[", "{"))
            if depth == 0:
                return position
        return None
