"""Words of the language."""

from __future__ import annotations

from dsl.records import node

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

TokenValue = float | str | tuple[float, float, float] | None


@node
class Token:
    """One word.

    `kind` is the text itself for keywords and symbols, otherwise "number", "angle", "string",
    "color", "name", "reserved", "newline", "end", "fault" for what the lexer has reported, or
    "foreign" for characters that begin no word, which the parser reports.
    `start` and `end` are UTF-8 byte offsets. `value`: a number's value, an angle's degrees, a
    string's, name's or foreign text, a colour's linear components, and for
    a symbol or keyword that was written as in another language, which the lexer has reported, that.
    """

    kind: str
    start: int
    end: int
    value: TokenValue = None


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
