"""The canonical form of a program.

Words, their order and every comment stay; spaces, indentation, empty lines and trailing commas are
settled here. Where a line may break is the author's choice as long as it fits: a bracket whose
first item is on a new line keeps its rows, a chain keeps the lines that begin with a dot. What does
not fit into `WIDTH` columns is broken at blocks, then before dots, then at the widest bracket.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

from dsl.budget import DEFAULT_LIMITS, Limits
from dsl.diagnostics import Diagnostic
from dsl.garbage import seldom_collecting
from dsl.layout import Bracket, Comment, Gap, Node, Word, read_layout
from dsl.parser import parse
from dsl.spans import Source

WIDTH = 100
"""Columns of a line, if its words allow."""
_INDENT = 2


@seldom_collecting()
def format_source(
    source: Source, limits: Limits = DEFAULT_LIMITS
) -> tuple[str | None, list[Diagnostic]]:
    """The program in its canonical form, or None with the faults of its syntax.

    Formatting what is formatted changes nothing, and no formatting changes what a program denotes.
    """
    _, faults = parse(source, limits)
    if faults:
        return None, faults
    text = source.text.replace("\r\n", "\n").replace("\r", "\n")
    return _Printer().file(read_layout(text, limits)), []


class _Measure(NamedTuple):
    """What nodes are on one line: `flat` is None if they do not fit or if they break the line.

    `head` is the text up to the first break, to measure and not to write: more may come after it.
    """

    flat: str | None
    head: str
    breaks: bool = False


class _Line(NamedTuple):
    code: str
    comment: str


class _Printer:
    def __init__(self) -> None:
        self.lines: list[_Line] = []
        self.line = ""
        self.base = 0  # indentation of the current line
        self.measures: dict[Bracket, _Measure] = {}

    def file(self, file: Bracket) -> str:
        self.statements(file, 0)
        return "".join(f"{line}\n" for line in _aligned(self.lines))

    def start(self, indent: int) -> None:
        """Begin a line."""
        self.base = indent
        self.line = " " * indent

    def end(self, comments: Sequence[str] = (), indent: int = 0) -> bool:
        """End the line, with comments behind it; those after a `//` have lines of their own.

        Return whether there are such lines.
        """
        ends = (i + 1 for i, comment in enumerate(comments) if comment.startswith("//"))
        end = next(ends, len(comments))
        self.lines.append(_Line(self.line.rstrip(), " ".join(comments[:end])))
        self.own_lines([Comment(text) for text in comments[end:]], indent, first=True)
        return end < len(comments)

    def own_lines(self, comments: Sequence[Comment], indent: int, first: bool) -> None:
        """Comments on lines apart from code; no empty line comes first."""
        lines: list[list[Comment]] = []
        for comment in comments:
            if comment.beside and lines:
                lines[-1].append(comment)
            else:
                lines.append([comment])
        for position, line in enumerate(lines):
            if line[0].blank and not (first and position == 0):
                self.lines.append(_Line("", ""))
            text = " ".join(comment.text for comment in line)
            self.lines.append(_Line(" " * indent + text, ""))

    def fits(self, text: str, room: int) -> bool:
        return _column(self.line) + len(text) <= room

    def statements(self, block: Bracket, indent: int) -> None:
        for position, item in enumerate(block.items):
            first = position == 0
            self.own_lines(item.leading, indent, first)
            if item.blank and not (first and not item.leading):
                self.lines.append(_Line("", ""))
            self.start(indent)
            self.nodes(item.nodes, WIDTH)
            self.end([*item.inline, *item.trailing], indent)
        self.own_lines(block.last, indent, not block.items)

    def nodes(self, nodes: Sequence[Node], room: int) -> None:
        """Write an item from where the line is; `room` is the column where it must end."""
        measure = self.measure(nodes)
        if measure.flat is not None and self.fits(measure.flat, room):
            self.line += measure.flat
            return
        indent = self.base + _INDENT
        blocks = {n for n in nodes if isinstance(n, Bracket) and n.is_block and n.items}
        starts = [0, *(i for i in range(1, len(nodes)) if _may_break(nodes, i)), len(nodes)]
        if measure.breaks and self.fits(measure.head, room):
            around = [(a, b) for a, b in pairwise(starts) if not blocks.isdisjoint(nodes[a:b])]
            flat = (self.measure(nodes[a:b]).flat for a, b in around)
            widths = (None if text is None else len(text) for text in flat)
            begins = (indent if a else _column(self.line) for a, _ in around)
            if all(w is not None and c + w <= room for w, c in zip(widths, begins, strict=True)):
                blocks = set()
        for start, stop in pairwise(starts):
            segment = nodes[start:stop]
            if start and _gap(segment[0]).newline:
                self.break_line(_gap(segment[0]), indent)
            elif start:
                space = _space(nodes[start - 1], segment[0])
                if self.fits(space + self.measure(segment).head, room):
                    self.line += space
                else:
                    self.break_line(Gap(), indent)
            self.segment(segment, blocks, room)

    def break_line(self, gap: Gap, indent: int) -> None:
        self.end(gap.trailing)
        self.own_lines(gap.leading, indent, first=True)
        self.start(indent)

    def segment(self, nodes: Sequence[Node], blocks: set[Bracket], room: int) -> None:
        """Write nodes among which no line ends but in brackets; `blocks` are to be broken."""
        brackets = [node for node in nodes if isinstance(node, Bracket) and node.items]
        broken = blocks.intersection(brackets)
        measure = self.measure(nodes)
        if not broken and not measure.breaks:
            if measure.flat is not None and self.fits(measure.flat, room):
                self.line += measure.flat
                return
            if brackets:
                broken = {max(brackets, key=lambda bracket: len(self.bracket(bracket).head))}
        for position, node in enumerate(nodes):
            if position:
                self.line += _space(nodes[position - 1], node)
            if isinstance(node, Word):
                self.line += _text(node)
                continue
            own = self.bracket(node)
            if node.is_broken or node in broken:
                self.broken(node)
            elif own.flat is not None and self.fits(own.flat, room):
                self.line += own.flat
            elif node.items and not (own.breaks and self.fits(own.head, room)):
                self.broken(node)
            else:
                self.unbroken(node, room)

    def unbroken(self, bracket: Bracket, room: int) -> None:
        """Write a bracket from where the line is, even if something in it breaks the line."""
        inside = " " if bracket.is_block and bracket.items else ""
        self.line += _text(bracket.opener) + inside
        for position, item in enumerate(bracket.items):
            self.line += ", " if position else ""
            self.nodes(item.nodes, room)
            self.line += "".join(f" {comment}" for comment in item.inline)
        self.line += inside + bracket.closer

    def broken(self, bracket: Bracket) -> None:
        """Write a bracket with its items on lines of their own."""
        outside, inside = self.base, self.base + _INDENT
        self.line += _text(bracket.opener)
        self.end(bracket.trailing)
        if bracket.is_block:
            self.statements(bracket, inside)
        else:
            self.rows(bracket, inside)
        self.start(outside)
        self.line += bracket.closer

    def rows(self, bracket: Bracket, indent: int) -> None:
        """Write arguments or list items, those that the author put into one row in one row."""
        opener = bracket.opener
        is_index = opener.kind == "[" and opener.role == "suffix"
        is_group = opener.kind == "(" and not opener.role and len(bracket.items) == 1
        by_author = bool(bracket.items) and bracket.items[0].newline
        behind: list[str] = []
        for position, item in enumerate(bracket.items):
            head = f" {self.measure(item.nodes).head},"
            if (
                by_author
                and position
                and not (item.newline or item.leading or behind)
                and self.fits(head, WIDTH)
            ):
                self.line += " "
            else:
                if position and self.end(behind, indent):
                    self.lines.append(_Line("", ""))  # they document no parameter below them
                self.own_lines(item.leading, indent, first=True)
                if item.leading and item.blank:
                    self.lines.append(_Line("", ""))
                self.start(indent)
            self.nodes(item.nodes, WIDTH - 1)
            behind = item.trailing
            if is_index or is_group:
                behind = item.inline + behind
            else:
                self.line += "".join(f" {comment}" for comment in item.inline) + ","
        if bracket.items:
            self.end(behind, indent)
        self.own_lines(bracket.last, indent, first=True)

    def measure(self, nodes: Sequence[Node]) -> _Measure:
        """What an item is on one line."""
        text = ""
        for position, node in enumerate(nodes):
            if position:
                if _gap(node).newline:
                    return _Measure(None, text, True)
                text += _space(nodes[position - 1], node)
            if isinstance(node, Word):
                own = _text(node)
                if "\n" in own:
                    return _Measure(None, text + own.partition("\n")[0], True)
                own_breaks = False
            else:
                _, own, own_breaks = self.bracket(node)
            if len(text) <= WIDTH:
                text += own
            if own_breaks:
                return _Measure(None, text, True)
        return _Measure(text if len(text) <= WIDTH else None, text)

    def bracket(self, bracket: Bracket) -> _Measure:
        """What a bracket is on one line."""
        if bracket not in self.measures:
            self.measures[bracket] = self.measure_bracket(bracket)
        return self.measures[bracket]

    def measure_bracket(self, bracket: Bracket) -> _Measure:
        text = _text(bracket.opener)
        if "\n" in text:
            return _Measure(None, text.partition("\n")[0], True)
        if bracket.is_broken:
            return _Measure(None, text, True)
        inside = " " if bracket.is_block and bracket.items else ""
        text += inside
        for position, item in enumerate(bracket.items):
            text += ", " if position else ""
            _, head, breaks = self.measure(item.nodes)
            if len(text) <= WIDTH:
                text += head
            if breaks:
                return _Measure(None, text, True)
            for comment in item.inline:
                text += f" {comment}"
                if "\n" in comment:
                    return _Measure(None, text.partition("\n")[0], True)
        text += inside + bracket.closer
        return _Measure(text if len(text) <= WIDTH else None, text)


def _gap(node: Node) -> Gap:
    return node.gap if isinstance(node, Word) else node.opener.gap


def _text(word: Word) -> str:
    """The word with the comments directly before it."""
    return "".join(f"{comment} " for comment in word.gap.inline) + word.text


def _may_break(nodes: Sequence[Node], index: int) -> bool:
    """Whether a line begins there, or may begin there: before the dot of a suffix call."""
    node, before = nodes[index], nodes[index - 1]
    suffix = isinstance(node, Word) and node.kind == "." and isinstance(before, Bracket)
    return suffix or _gap(node).newline


def _space(left: Node, right: Node) -> str:
    word = right if isinstance(right, Word) else right.opener
    if word.gap.inline:
        return " "
    if word.role == "suffix" or word.kind in (".", ":", "..", ","):
        return ""
    if isinstance(left, Word):
        sign = left.role == "prefix" and left.kind == "-"
        if sign or left.kind in (".", ".."):
            return ""
    return " "


def _aligned(lines: Sequence[_Line]) -> list[str]:
    """The lines as text; comments behind lines that follow one another begin in one column."""
    result: list[str] = []
    run: list[_Line] = []

    def finish() -> None:
        column = max((_column(line.code) for line in run), default=0) + 2
        for line in run:
            space = " " * (column - _column(line.code))
            result.append(line.code + space + line.comment)
        run.clear()

    for line in lines:
        if run and not (line.comment and _indent(line) == _indent(run[0])):
            finish()
        if line.comment:
            run.append(line)
        else:
            result.append(line.code)
    finish()
    return result


def _column(text: str) -> int:
    """Where a text ends on its last line: a comment in it may have several."""
    return len(text) - text.rfind("\n") - 1


def _indent(line: _Line) -> int:
    return len(line.code) - len(line.code.lstrip(" "))
