"""Inputs made by damaging others: texts by characters and words, files by bytes."""

from __future__ import annotations

from collections.abc import Sequence
from random import Random

_SYNTAX = (
    *("let", "fn", "for", "in", "if", "else", "use", "param", "as", "and", "or", "not", "time"),
    *("true", "false", "sphere", "box", "wedge", "i", "a", "random", "material", "translate"),
    *("(", ")", "[", "]", "{", "}", ".", "..", ",", ":", "=", "==", "<", "+", "-", "*", "/", "%"),
    *("f(f(", "((((", "[[[[", "{{{{", "----", "not not ", ".x.y", ".scale(0)", "[0]", "{}"),
)
_SPACES = ("\n", "\r\n", "\r", " ", "\t", "\f", "\v", "\0", "//", "/*", "*/", "///", '"', "\\", "#")
_NUMBERS = (
    *("0", "-0", "1", "1e308", "1e-320", "9" * 400, "0.1", "40deg", "1e300turn", "2rad", "1foo"),
    *("9007199254740993", "1e18", "nan", "inf", "#d2b48c", "#fff"),
)
_LETTERS = (
    *('"\\u{110000}"', '"\\u{1F600}"', "\ufeff", "é", "e\u0301", "日本", "𝒜", "\u200d", "\u202e"),
    *("\u2028", "\x85", "\ud800", "ﬁ", "٣", "²", "\ue000"),
)
WORDS = _SYNTAX + _SPACES + _NUMBERS + _LETTERS
"""What a text may be damaged with."""


def damaged_text(random: Random, texts: Sequence[str]) -> str:
    """A text with some of its characters changed, or parts of two."""
    text = random.choice(texts)
    for _ in range(random.choice((0, 1, 1, 2, 3, 5, 10))):
        a = random.randrange(len(text) + 1)
        b = min(len(text), a + random.choice((0, 1, 2, 5, 20, 100)))
        match random.randrange(7):
            case 0 | 1:
                text = text[:a] + random.choice(WORDS) + text[a:]
            case 2:
                text = text[:a] + random.choice(WORDS) + text[b:]
            case 3:
                text = text[:a] + text[b:]
            case 4:
                text = text[:b] + text[a:b] * random.choice((1, 2, 10)) + text[b:]
            case 5:
                other = random.choice(texts)
                c = random.randrange(len(other) + 1)
                text = text[:a] + other[c : c + random.choice((5, 50, 500))] + text[b:]
            case _:
                text = text[:a] + chr(random.randrange(random.choice((128, 0x10FFFF)))) + text[b:]
    return text[:20_000]


def damaged_bytes(random: Random, contents: Sequence[bytes]) -> bytes:
    """A file with some of its bytes changed, cut, or longer than it was."""
    content = bytearray(random.choice(contents))
    for _ in range(random.choice((1, 1, 2, 4))):
        if not content:
            break
        # Half of them into the header, where most of the meaning is.
        a = random.randrange(min(len(content), random.choice((1200, len(content)))))
        match random.randrange(5):
            case 0:
                content[a] ^= 1 << random.randrange(8)
            case 1:
                content[a] = random.choice((0, 1, 0x7F, 0x80, 0xFF))
            case 2:
                word = random.choice((-1, -2, 0, 1, 2**31 - 1, -(2**63), 2**63 - 1))
                content[a : a + 8] = word.to_bytes(8, "little", signed=True)
            case 3:
                del content[a : random.choice((a + 1, a + 8, len(content)))]
            case _:
                content[a:a] = random.randbytes(random.choice((1, 8, 64)))
    return bytes(content)
