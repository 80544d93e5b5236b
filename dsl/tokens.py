"""Words of the language."""

from __future__ import annotations

from collections.abc import Sequence
from typing import overload

from dsl.records import node
from dsl.scene import FloatArray

KEYWORDS = frozenset(
    (
        "let",
        "fn",
        "for",
        "in",
        "if",
        "else",
        "use",
        "param",
        "as",
        "and",
        "or",
        "not",
        "true",
        "false",
    )
)
RESERVED = frozenset(("time",))
"""Words that programs cannot define: `time` is a number that every scene has."""

TokenValue = float | str | tuple[float, float, float] | FloatArray | None


@node
class Token:
    """One word.

    `kind` is the text itself for keywords and symbols, otherwise "number", "angle", "string",
    "color", "name", "reserved", "newline", "end", "fault" for what the lexer has reported, or
    "foreign" for characters that begin no word, which the parser reports.
    `start` and `end` are UTF-8 byte offsets. `value`: a number's value, an angle's degrees, a
    string's, name's or foreign text, a colour's linear components, of several lines at once (see
    `dsl.alike`) an array of numbers, and for
    a symbol or keyword that was written as in another language, which the lexer has reported, that.
    """

    kind: str
    start: int
    end: int
    value: TokenValue = None


class Tokens(Sequence[Token]):
    """The words of a source in columns: most are read, and few looked at as a `Token`."""

    __slots__ = ("ends", "kinds", "starts", "values")

    def __init__(self) -> None:
        self.kinds: list[str] = []
        self.starts: list[int] = []
        self.ends: list[int] = []
        self.values: list[TokenValue] = []

    def append(self, kind: str, start: int, end: int, value: TokenValue = None) -> None:
        """Add a word."""
        self.kinds.append(kind)
        self.starts.append(start)
        self.ends.append(end)
        self.values.append(value)

    def pop(self) -> None:
        """Take the last word away."""
        for column in (self.kinds, self.starts, self.ends, self.values):
            column.pop()

    def __len__(self) -> int:
        return len(self.kinds)

    @overload
    def __getitem__(self, place: int) -> Token: ...
    @overload
    def __getitem__(self, place: slice) -> list[Token]: ...
    def __getitem__(self, place: int | slice) -> Token | list[Token]:
        if isinstance(place, slice):
            return [self[each] for each in range(*place.indices(len(self)))]
        kind, start = self.kinds[place], self.starts[place]
        return Token(kind, start, self.ends[place], self.values[place])


def describe(token: Token) -> str:
    """The token as messages name it."""
    match token.kind:
        case "newline":
            return "the end of the line"
        case "end":
            return "the end of the file"
        case "number" | "angle" | "string" | "color":
            article = "an" if token.kind == "angle" else "a"
            return f"{article} {token.kind}"
        case "name" | "reserved" | "foreign":
            return f"`{token.value}`"
        case _:
            return f"`{token.kind}`"
