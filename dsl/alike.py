"""Lines of one form: statements that differ in their numbers only, in any order among others.

Programs that write scenes write such lines by the thousand. The form of a line is its text with
every number replaced by one and the same; what has the form of another line has its words and its
syntax, too. So only the first line of each form is read: it stands for all, and what differs
between them is a column of numbers.

Only lines that are surely whole statements take part: a name and calls, on one line, without words
of the language. Whether they are, the parser tells of the first.
"""

from __future__ import annotations

import re
from bisect import bisect_left
from collections.abc import Iterator, Sequence
from itertools import accumulate

import numpy as np

from dsl.angles import degrees_from_literal
from dsl.records import node
from dsl.scene import FloatArray, IntArray
from dsl.tokens import KEYWORDS

FEWEST = 32
"""Fewer lines of a form are read and evaluated one by one: that is as fast."""

_NUMBER = re.compile(r"(?<!\w)[0-9]+(?:\.[0-9]+)?(?:[eE][+-]?[0-9]+)?", re.ASCII)
_CALLS = re.compile(r"[A-Za-z_]\w*[(.][\w .,:+\-*/%()\[\]\t]*[)\]]", re.ASCII)
_WORD = re.compile(r"[A-Za-z_]\w*", re.ASCII)
_BYTES = re.compile(
    r"\brgb[ \t]*\((?=[^()]*(?:(?<![\w.])[0-9]{2}|[0-9][eE]))(?:[\w .:,\t]|(?<=[eE])[+-])*\)",
    re.ASCII,
)
"""There may be advice on such a line, see `dsl.slips`."""


@node
class Lines:
    """Lines of one form, without the space around them; line i begins at byte `starts[i]`.

    Number j of the first begins at its character `numbers[j]`, and that of line i is the word
    `words[j][i]`; what follows j numbers stands `shifts[j][i]` further from the line's beginning
    than in the first.
    """

    texts: Sequence[str]
    starts: IntArray
    numbers: Sequence[int]
    words: Sequence[Sequence[str]]
    shifts: Sequence[IntArray]

    @property
    def end(self) -> int:
        """Where the first line ends."""
        return int(self.starts[0]) + len(self.texts[0])

    def values(self) -> list[float | FloatArray]:
        """The numbers, or degrees: one where all lines have the same, else an array of them."""
        values: list[float | FloatArray] = []
        for start, words in zip(self.numbers, self.words, strict=True):
            unit = _WORD.match(self.texts[0], start + len(words[0]))
            if unit is None:
                column = list(map(float, words))
            else:
                column = [degrees_from_literal(word, unit[0]) for word in words]
            same = words.count(words[0]) == len(words)
            values.append(column[0] if same else np.array(column))
        return values

    def moved(self, place: int) -> list[int]:
        """Where in every line that stands which is at a byte of the first."""
        offset = place - int(self.starts[0])
        moved = self.starts + offset + self.shifts[bisect_left(self.numbers, offset)]
        places: list[int] = moved.tolist()
        return places


def lines_alike(text: str) -> list[Lines]:
    """The lines of a program of which there are enough of one form, between two others."""
    lines = text.split("\n")
    forms = [form.strip(" \t\r") for form in _NUMBER.sub("0", text).split("\n")]
    if len(forms) < FEWEST:
        return []
    groups = [group for group in _groups(lines, forms) if len(group) >= FEWEST]
    if not groups:
        return []
    sizes = lines if text.isascii() else [_encoded(line) for line in lines]
    begin = list(accumulate((len(line) + 1 for line in sizes), initial=0))
    return [_lines(lines, begin, group) for group in groups]


def without(text: str, alike: Sequence[Lines]) -> str:
    """The text with nothing but space in the place of lines that are told by the first."""
    encoded = _encoded(text)
    first = {int(lines.starts[0]) for lines in alike}
    places = sorted(
        (start, start + len(line))
        for lines in alike
        for start, line in zip(lines.starts.tolist(), lines.texts, strict=True)
        if start not in first
    )
    pieces, done = list[bytes](), 0
    for start, end in places:
        between = encoded[done:start]
        pieces += (between if between.strip() else b" " * len(between), b" " * (end - start))
        done = end
    return b"".join((*pieces, encoded[done:])).decode("utf-8", "surrogatepass")


def _groups(lines: Sequence[str], forms: Sequence[str]) -> Iterator[list[int]]:
    """The numbers of lines that have one form, between two lines that cannot be left out."""
    known: dict[str, bool] = {}
    groups: dict[str, list[int]] = {}
    before = -1  # the last line with words, if it is of a form that counts
    for number, form in enumerate(forms):
        if not form or form.startswith("//"):
            continue
        if form not in known:
            known[form] = _is_statement(form)
        if not known[form]:  # and perhaps the rest of the one before
            yield from groups.values()
            groups, before = {}, -1
            continue
        if before >= 0:
            groups.setdefault(forms[before], []).append(before)
        before = -1 if "rgb" in form and _BYTES.search(lines[number]) else number
    if before >= 0:
        groups.setdefault(forms[before], []).append(before)
    yield from groups.values()


def _is_statement(form: str) -> bool:
    """Whether a line of that form is surely a statement, unless it is in brackets or a comment."""
    return (
        _CALLS.fullmatch(form) is not None
        and "//" not in form
        and "/*" not in form
        and form.count("(") == form.count(")")
        and KEYWORDS.isdisjoint(_WORD.findall(form))
    )


def _lines(lines: Sequence[str], begin: Sequence[int], group: Sequence[int]) -> Lines:
    texts = [lines[number].strip(" \t\r") for number in group]
    starts = np.array([begin[number] for number in group])
    starts += [lines[number].index(text) for number, text in zip(group, texts, strict=True)]
    words = _NUMBER.findall("\n".join(texts))
    count = len(words) // len(texts)
    columns = [words[place::count] for place in range(count)]
    shifts = [np.zeros(len(texts), dtype=np.int64)]
    for column in columns:
        lengths = np.array(list(map(len, column)))
        shifts.append(shifts[-1] + lengths - lengths[0])
    numbers = [found.start() for found in _NUMBER.finditer(texts[0])]
    return Lines(texts, starts, numbers, columns, shifts)


def _encoded(text: str) -> bytes:
    return text.encode("utf-8", "surrogatepass")
