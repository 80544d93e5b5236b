"""The lines of a text of words, numbers and quoted texts, read word by word."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Sequence

from dsl.codes import diagnostic
from dsl.diagnostics import Diagnostic
from dsl.spans import Source, Span

_TOKEN = re.compile(r'"(?:[^"\\]|\\.)*"|[\[\]|]|[^\s\[\]|"]+|"')
_NUMBER = re.compile(r"-?(?:\d+\.?\d*(?:e[+-]?\d+)?|inf)|nan")
_INTEGER = re.compile(r"-?\d{1,18}")


class LineFault(Exception):
    """A line cannot be read."""

    def __init__(self, diagnostic: Diagnostic) -> None:
        super().__init__(diagnostic.message)
        self.diagnostic = diagnostic


class Line:
    """The words of one line, read one after the other."""

    def __init__(self, source: Source, start: int, text: str) -> None:
        self._source, self._start, self._text = source, start, text
        self._words = [(m.group(), m.start(), m.end()) for m in _TOKEN.finditer(text)]
        self._next = 0
        self.indented = text.startswith(" ")

    def fault(self, message: str) -> LineFault:
        """A fault at the word that comes next."""
        words, at = self._words, self._next
        start, end = words[at][1:] if at < len(words) else (len(self._text), len(self._text))
        first = self._start + len(self._text[:start].encode(errors="replace"))
        span = Span(
            self._source, first, first + len(self._text[start:end].encode(errors="replace"))
        )
        return LineFault(diagnostic("ir-syntax", message, span))

    def peek(self) -> str:
        """The next word, "" at the end."""
        return self._words[self._next][0] if self._next < len(self._words) else ""

    def accept(self, word: str) -> bool:
        """Read `word` if it is next."""
        if self.peek() != word:
            return False
        self._next += 1
        return True

    def expect(self, word: str) -> None:
        """Read `word`."""
        if not self.accept(word):
            raise self.fault(f"expected `{word}`")

    def choice(self, choices: Sequence[str], what: str) -> int:
        """Read one of `choices`; its index."""
        if self.peek() not in choices:
            raise self.fault(f"expected {what}")
        self._next += 1
        return choices.index(self._words[self._next - 1][0])

    def integer(self, lowest: int = 0, end: int = 2**31, suffix: str = "") -> int:
        """Read an integer in [lowest, end) that is followed by `suffix`."""
        word = self.peek().removesuffix(suffix)
        if not _INTEGER.fullmatch(word) or not self.peek().endswith(suffix):
            raise self.fault("expected an integer" + (f" and `{suffix}`" if suffix else ""))
        if not lowest <= int(word) < end:
            raise self.fault(f"the integer is outside of {lowest} … {end - 1}")
        self._next += 1
        return int(word)

    def numbers(self, count: int) -> list[float]:
        """Read `count` numbers."""
        values = []
        for _ in range(count):
            if not _NUMBER.fullmatch(self.peek()):
                raise self.fault("expected a number")
            values.append(float(self.peek()))
            self._next += 1
        return values

    def text(self) -> str:
        """Read a quoted text."""
        try:
            text = json.loads(self.peek(), strict=False)
        except ValueError:
            text = None
        if not isinstance(text, str):
            raise self.fault("expected a quoted text")
        self._next += 1
        return text

    def rows(self) -> list[float]:
        """Read `[a b c d | e f g h | i j k l]`."""
        values: list[float] = []
        for before in "[||":
            self.expect(before)
            values += self.numbers(4)
        self.expect("]")
        return values

    def finish(self) -> None:
        """Nothing may be left."""
        if self._next < len(self._words):
            raise self.fault("nothing more is expected on this line")


def lines(source: Source) -> Iterator[Line]:
    """The lines of `source` that are not blank."""
    start = 0
    for text in source.text.split("\n"):
        if text.strip():
            yield Line(source, start, text)
        start += len(text.encode(errors="replace")) + 1
