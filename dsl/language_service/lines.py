"""Offsets of UTF-8 bytes to the lines and columns of editors, and back."""

from __future__ import annotations

import re
from bisect import bisect_right
from typing import Literal, NamedTuple

Unit = Literal["utf-8", "utf-16", "utf-32"]
"""What an editor counts columns in."""

_NEWLINE = re.compile(rb"\r\n?|\n")


class Position(NamedTuple):
    """A line and a column, both counted from 0."""

    line: int
    character: int


class Lines:
    """The lines of a text; they end with LF, CR or CR LF, as in the lexer and the protocol."""

    def __init__(self, text: str, unit: Unit = "utf-16") -> None:
        self.encoded = text.encode("utf-8", "surrogatepass")
        self.unit: Unit = unit
        self._ascii = len(self.encoded) == len(text)
        ends = [match.span() for match in _NEWLINE.finditer(self.encoded)]
        self._starts = [0, *(end for _, end in ends)]
        self._ends = [*(start for start, _ in ends), len(self.encoded)]

    def line_of(self, offset: int) -> int:
        """The line that an offset is in."""
        return bisect_right(self._starts, offset) - 1

    def position(self, offset: int) -> Position:
        """The position of an offset; what lies in the middle of a character is at its start."""
        offset = min(max(offset, 0), len(self.encoded))
        line = self.line_of(offset)
        before = self.encoded[self._starts[line] : offset]
        return Position(line, len(before) if self._ascii else self._units(before))

    def offset(self, position: Position) -> int:
        """The offset of a position, moved into the text and to the start of a character."""
        line, character = position
        if line >= len(self._starts):
            return len(self.encoded)
        if line < 0 or character <= 0:
            return self._starts[max(line, 0)]
        text = self.encoded[self._starts[line] : self._ends[line]]
        if self._ascii:
            return self._starts[line] + min(character, len(text))
        column = 0
        start = 0
        for letter in text.decode("utf-8", "surrogatepass"):
            size = letter.encode("utf-8", "surrogatepass")
            column += self._units(size)
            if column > character:
                break
            start += len(size)
        return self._starts[line] + start

    def _units(self, encoded: bytes) -> int:
        """The columns of whole characters; a lone surrogate is one."""
        if self.unit == "utf-8":
            return len(encoded)
        # A character is as many units as it has bytes that begin one, and in UTF-16 one more
        # beyond U+FFFF, where it has four bytes.
        first = sum(byte & 0xC0 != 0x80 for byte in encoded)
        return first + (sum(byte >= 0xF0 for byte in encoded) if self.unit == "utf-16" else 0)
