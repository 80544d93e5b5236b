r"""Source text as words in nested brackets, every comment kept where it was.

The tree that the formatter prints. It knows no grammar beyond brackets, commas and statements: a
bracket holds items (arguments, list items, statements), an item holds words and brackets.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field

from dsl.budget import Limits
from dsl.lexer import tokenize
from dsl.spans import Source
from dsl.tokens import Token

_TRIVIA = re.compile(r"//[^\n]*|/\*[\s\S]*?\*/|\n")
_CLOSERS = {"(": ")", "[": "]", "{": "}"}
_VALUES = frozenset(
    ("name", "reserved", "number", "angle", "string", "color", "true", "false", ")", "]", "}")
)
_OPERATORS = frozenset(
    ("or", "and", "==", "!=", "<", "<=", ">", ">=", "+", "-", "*", "/", "%"),
)


@dataclass(slots=True)
class Comment:
    """A comment; `blank` says that an empty line comes before it.

    `beside` says that it shares the line of the comment before it: a `///` there documents nothing.
    """

    text: str
    blank: bool = False
    beside: bool = False


@dataclass(slots=True)
class Gap:
    """What stands between two words.

    `trailing` comments follow the first word on its line, `leading` ones have lines of their own,
    `inline` ones share a line with the second word. `newline` says that the second word begins a
    line and is to stay there, `blank` that an empty line precedes it.
    """

    trailing: list[str] = field(default_factory=list)
    leading: list[Comment] = field(default_factory=list)
    inline: list[str] = field(default_factory=list)
    newline: bool = False
    blank: bool = False


@dataclass(slots=True, eq=False)
class Word:
    """One word: its kind (see `Token`; a member's is "name"), its text, and what is before it.

    `role` is "prefix" for a sign or `not`, "operator" between two operands, "suffix" for the
    bracket of a call, of parameters or of an index, otherwise "".
    """

    kind: str
    text: str
    gap: Gap
    role: str = ""


@dataclass(slots=True, eq=False)
class Item:
    """An argument, a list item or a statement.

    `leading` comments stand on lines above it, `inline` ones before its comma, `trailing` ones
    at the end of its line. `newline` says that it begins a line, `blank` that an empty line
    precedes it.
    """

    leading: list[Comment]
    newline: bool
    blank: bool
    nodes: list[Node] = field(default_factory=list)
    inline: list[str] = field(default_factory=list)
    trailing: list[str] = field(default_factory=list)


@dataclass(slots=True, eq=False)
class Bracket:
    """A bracket and its items.

    `trailing` comments follow the opening word on its line; `last` ones stand on lines of their
    own after the last item.
    """

    opener: Word
    items: list[Item] = field(default_factory=list)
    trailing: list[str] = field(default_factory=list)
    last: list[Comment] = field(default_factory=list)

    @property
    def closer(self) -> str:
        """The closing word."""
        return _CLOSERS[self.opener.kind]

    @property
    def is_block(self) -> bool:
        """Whether the items are statements."""
        return self.opener.kind == "{"

    @property
    def is_broken(self) -> bool:
        """Whether the items cannot, or are not to, share the line of the opening word."""
        return bool(
            self.trailing
            or self.last
            or any(item.leading or item.trailing for item in self.items)
            or (self.items and self.items[0].newline)
            or (self.is_block and len(self.items) > 1)
        )


Node = Word | Bracket


def read_layout(text: str, limits: Limits) -> Bracket:
    r"""The file as the items of a block; it has no faults of syntax, and `\n` ends its lines."""
    source = Source("", text)
    tokens = list(tokenize(source, limits)[0])
    file = Bracket(Word("{", "", Gap()))
    _Reader(source.encoded(), tokens).block(file)
    return file


class _Reader:
    def __init__(self, encoded: bytes, tokens: list[Token]) -> None:
        self.encoded = encoded
        self.tokens = [token for token in tokens if token.kind != "newline"]
        self.starts: set[int] = set()  # where a newline has ended a statement
        for index, token in enumerate(tokens):
            if token.kind == "newline":
                self.starts.add(index - len(self.starts))
        self.position = 0
        self.value = False  # the word before ends an operand
        self.member = False  # the word before is a dot
        self.token = self.tokens[0]
        self.gap = self.gap_before()

    def advance(self) -> None:
        self.value = self.member or self.token.kind in _VALUES
        self.member = self.token.kind == "."
        self.position += 1
        self.token = self.tokens[self.position]
        self.gap = self.gap_before()

    def gap_before(self) -> Gap:
        """What stands before the current token."""
        start = self.tokens[self.position - 1].end if self.position else 0
        between = self.encoded[start : self.token.start].decode("utf-8", "surrogatepass")
        gap = Gap()
        if self.position and not between.strip(" "):
            return gap
        line: list[Comment] = []
        lines = newlines = 0 if self.position else 1  # in all, and since the last comment
        for match in _TRIVIA.finditer(between):
            if match[0] != "\n":
                line.append(Comment(match[0].rstrip(), newlines > 1, beside=bool(line)))
                newlines = 0
                continue
            self.end_line(gap, line, lines)
            line = []
            lines, newlines = lines + 1, newlines + 1
        gap.newline = lines > 0
        gap.blank = line[0].blank if line else newlines > 1
        if self.token.kind == "end":
            self.end_line(gap, line, lines)
        else:
            gap.inline = [comment.text for comment in line]
        return gap

    def end_line(self, gap: Gap, line: list[Comment], lines: int) -> None:
        if lines:
            gap.leading += line
        else:
            gap.trailing = [comment.text for comment in line]

    def block(self, block: Bracket) -> None:
        """Statements, up to what closes them."""
        while self.token.kind not in ("}", "end"):
            item = self.item(block)
            self.value = False
            while True:
                self.node(item)
                if self.token.kind in ("}", "end") or self.position in self.starts:
                    break
        self.close(block)

    def sequence(self, bracket: Bracket) -> None:
        """Items between commas, up to what closes them."""
        while self.token.kind != bracket.closer:
            item = self.item(bracket)
            while self.token.kind not in (",", bracket.closer):
                self.node(item)
            if self.token.kind == ",":
                gap = self.gap
                if gap.newline:
                    leading = [comment.text for comment in gap.leading]
                    item.trailing += gap.trailing + leading + gap.inline
                else:
                    item.inline += gap.inline
                self.advance()
        self.close(bracket)

    def item(self, bracket: Bracket) -> Item:
        """A new item, which has the comments before its first word."""
        gap = self.gap
        (bracket.items[-1] if bracket.items else bracket).trailing.extend(gap.trailing)
        item = Item(gap.leading, gap.newline, gap.blank)
        bracket.items.append(item)
        self.gap = Gap(inline=gap.inline)
        return item

    def close(self, bracket: Bracket) -> None:
        """The comments before the closing word."""
        gap = self.gap
        inline = [Comment(text, beside=i > 0) for i, text in enumerate(gap.inline)]
        if bracket.items:
            bracket.items[-1].trailing += gap.trailing
            if gap.newline:
                gap.leading += inline
            else:
                bracket.items[-1].inline += gap.inline
        else:
            bracket.trailing += gap.trailing
            gap.leading += inline
        bracket.last += gap.leading

    def node(self, item: Item) -> None:
        """A word, or a bracket up to its end."""
        word = self.word(item)
        if word.kind not in _CLOSERS:
            item.nodes.append(word)
            return
        bracket = Bracket(word)
        item.nodes.append(bracket)
        if bracket.is_block:
            self.block(bracket)
        else:
            self.sequence(bracket)
        self.advance()

    def word(self, item: Item) -> Word:
        token = self.token
        text = self.encoded[token.start : token.end].decode("utf-8", "surrogatepass")
        word = Word("name" if self.member else token.kind, text, self.gap)
        if word.kind in ("number", "color"):
            word.text = text.lower()
        if word.kind in ("(", "[") and self.value:
            word.role = "suffix"
        elif word.kind == "not" or (word.kind == "-" and not self.value):
            word.role = "prefix"
        elif word.kind in _OPERATORS:
            word.role = "operator"
        if item.nodes:
            self.settle(word, item.nodes[-1])
        self.advance()
        return word

    def settle(self, word: Word, before: Node) -> None:
        """Let a line begin only with a dot, an operator, or what follows a `//` comment."""
        gap = word.gap
        if word.kind == "." or word.role == "operator":
            return
        comments = [*gap.trailing, *(comment.text for comment in gap.leading)]
        if any(text.startswith("//") for text in comments):
            return
        if gap.newline and not comments and isinstance(before, Word) and before.role == "operator":
            before.gap.newline = True
        word.gap = Gap(inline=comments + gap.inline)
