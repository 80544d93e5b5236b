"""Diagnostics as text for people and as JSON for programs."""

from __future__ import annotations

import unicodedata
from collections.abc import Callable, Iterable, Iterator
from itertools import accumulate
from typing import Any

from dsl.diagnostics import Diagnostic, Label
from dsl.spans import Place, PrimPlace, Source, Span

JSON_VERSION = 1
"""Version of the shape that `to_json` gives; a change that breaks readers raises it."""

_Paint = Callable[[str, str], str]
"""Gives a text a colour."""

_WINDOW = 100
"""Columns of a source line that are shown; longer lines are cut around the marked place."""
_TAB = 4
_LONG = 10_000

_RED, _YELLOW, _BLUE, _BOLD, _RESET = "\x1b[1;31m", "\x1b[1;33m", "\x1b[1;34m", "\x1b[1m", "\x1b[0m"


def render_diagnostics(diagnostics: Iterable[Diagnostic], color: bool = False) -> str:
    """All diagnostics as text, an empty line between two; ends with a newline unless empty."""
    return "\n".join(render_diagnostic(found, color) for found in diagnostics)


def render_diagnostic(found: Diagnostic, color: bool = False) -> str:
    r"""One diagnostic as text, ending with a newline; `color` adds ANSI escapes.

    The source line is shown with the primary place underlined by `^` and others by `-`. Control
    characters of the source are shown as symbols, so that text cannot command a terminal.
    """
    tint = _RED if found.severity == "error" else _YELLOW
    paint = _painter(color)
    lines = [
        paint(f"{found.severity}[{found.code}]", tint) + paint(f": {_clean(found.message)}", _BOLD)
    ]
    files = _by_file(found)
    rows = [
        _Line(label.place) for labels in files for label in labels if isinstance(label.place, Span)
    ]
    gutter = " " * len(str(max((row.number for row in rows), default=0)))
    bar = f"{gutter} {paint('|', _BLUE)}"
    for position, labels in enumerate(files):
        arrow = paint("-->" if position == 0 else ":::", _BLUE)
        lines.append(f"{gutter}{arrow} {_clean(_place_name(labels[0].place))}")
        lines += _excerpt(labels, found.primary, gutter, bar, tint, paint)
    if found.help is not None:
        if rows:
            lines.append(bar)
        lines.append(f"{gutter} {paint('=', _BLUE)} {paint('help', _BOLD)}: {_clean(found.help)}")
    return "\n".join(lines) + "\n"


def to_json(found: Diagnostic) -> dict[str, Any]:
    """A diagnostic as JSON values.

    A place is `{"file", "start", "end", "line", "column", "end_line", "end_column", "text"}` with
    UTF-8 byte offsets and 1-based lines and columns (see `line_and_column`), or `{"stage", "prim",
    "text"}`; `text` is the label's.
    """
    return {
        "version": JSON_VERSION,
        "code": found.code,
        "severity": found.severity,
        "message": found.message,
        "primary": None if found.primary is None else _label_to_json(found.primary),
        "secondary": [_label_to_json(label) for label in found.secondary],
        "help": found.help,
    }


def line_and_column(source: Source, offset: int) -> tuple[int, int]:
    """The 1-based line and column of a UTF-8 byte offset.

    Columns count what a reader takes for one character: extended grapheme clusters (UAX 29), or
    the code points of a line of more than 10 000. An offset inside a cluster has its column.
    """
    line = _Line(Span(source, offset, offset))
    index = len(line.before)
    text = line.before + line.after
    if len(text) > _LONG or (line.before.isascii() and line.after[:1].isascii()):
        return line.number, index + 1
    starts = accumulate(map(len, _clusters(text)), initial=0)
    return line.number, sum(start <= index for start in starts)


def _label_to_json(label: Label) -> dict[str, Any]:
    place = label.place
    if isinstance(place, PrimPlace):
        return {"stage": place.stage, "prim": place.prim, "text": label.text}
    line, column = line_and_column(place.source, place.start)
    end_line, end_column = line_and_column(place.source, place.end)
    return {
        "file": place.source.name,
        "start": place.start,
        "end": place.end,
        "line": line,
        "column": column,
        "end_line": end_line,
        "end_column": end_column,
        "text": label.text,
    }


def _by_file(found: Diagnostic) -> list[list[Label]]:
    """Labels of one file together, the primary's file first and in it the primary label."""
    labels = [*([found.primary] if found.primary else []), *found.secondary]
    files: dict[str, list[Label]] = {}
    for label in labels:
        files.setdefault(_file_name(label.place), []).append(label)
    return list(files.values())


def _file_name(place: Place) -> str:
    if isinstance(place, PrimPlace):
        return f"{place.stage}:{place.prim}"
    return place.source.name


def _place_name(place: Place) -> str:
    if isinstance(place, PrimPlace):
        return f"{place.stage}:{place.prim}"
    line, column = line_and_column(place.source, place.start)
    return f"{place.source.name}:{line}:{column}"


class _Line:
    """The first line of a span: its number, and its text before, in and after the span."""

    def __init__(self, span: Span) -> None:
        data = span.source.encoded()
        start, end = min(span.start, len(data)), min(span.end, len(data))
        head = data[:start].decode(errors="replace").replace("\r\n", "\n").replace("\r", "\n")
        self.number = head.count("\n") + 1
        self.before = head[head.rfind("\n") + 1 :]
        rest = data[start:].decode(errors="replace")
        line = rest.replace("\r", "\n").partition("\n")[0]
        marked = data[start:end].decode(errors="replace").replace("\r", "\n").partition("\n")[0]
        self.marked, self.after = marked, line[len(marked) :]


def _excerpt(
    labels: list[Label],
    primary: Label | None,
    gutter: str,
    bar: str,
    tint: str,
    paint: _Paint,
) -> list[str]:
    """The lines of one file with their labels underlined."""
    if isinstance(labels[0].place, PrimPlace):
        return [f"{gutter} = note: {_clean(label.text)}" for label in labels if label.text]
    placed = sorted(
        ((_Line(label.place), label) for label in labels if isinstance(label.place, Span)),
        key=lambda pair: (pair[0].number, pair[1] is not primary, len(pair[0].before)),
    )
    lines = [bar]
    shown = 0
    for line, label in placed:
        text = line.before + line.marked + line.after
        start, width = len(line.before), len(line.marked)
        text, start = _window(text, start)
        cells = _cells(text)
        if line.number != shown:
            if shown and line.number > shown + 1:
                lines.append(paint("...", _BLUE))
            number = str(line.number).rjust(len(gutter))
            lines.append(f"{paint(f'{number} |', _BLUE)} {_shown(text)}".rstrip())
            shown = line.number
        columns = [0, *accumulate(cells)]
        begin = columns[min(start, len(cells))]
        end = columns[min(start + width, len(cells))]
        mark, hue = ("^", tint) if label is primary else ("-", _BLUE)
        underline = mark * max(1, end - begin)
        note = f" {_clean(label.text)}" if label.text else ""
        lines.append(f"{bar} {' ' * begin}{paint(underline + note, hue)}")
    return lines


def _window(text: str, start: int) -> tuple[str, int]:
    """A long line cut around the marked place, and where that begins in it."""
    if len(text) <= _WINDOW:
        return text, start
    first = max(0, min(start - _WINDOW // 4, len(text) - _WINDOW))
    cut = text[first : first + _WINDOW]
    if first + _WINDOW < len(text):
        cut = cut[:-1] + "…"
    if first > 0:
        cut = "…" + cut[1:]
    return cut, start - first


def _clusters(text: str) -> Iterator[str]:
    """The extended grapheme clusters of a text."""
    if text.isascii():
        return iter(text)
    from wcwidth import iter_graphemes

    return iter_graphemes(text)


def _cells(text: str) -> list[int]:
    """Terminal columns of each character as shown; those of a cluster count for its first."""
    cells: list[int] = []
    column = 0
    for cluster in _clusters(text):
        width = _TAB - column % _TAB if cluster == "\t" else _width(_clean(cluster))
        cells += [width, *[0] * (len(cluster) - 1)]
        column += width
    return cells


def _width(shown: str) -> int:
    """Terminal columns of a text without control characters."""
    if shown.isascii():
        return len(shown)
    from wcwidth import wcswidth

    return max(0, int(wcswidth(shown)))


def _shown(text: str) -> str:
    cells = _cells(text)
    return "".join(
        " " * width if character == "\t" else _symbol(character)
        for character, width in zip(text, cells, strict=True)
    )


def _symbol(character: str) -> str:
    """A control character's picture; directional controls, which reorder text, vanish."""
    category = unicodedata.category(character)
    if category == "Cf":
        return ""
    if category in ("Cc", "Cs", "Zl", "Zp"):
        return (
            chr(0x2400 + ord(character)) if ord(character) < 0x20 else "\N{REPLACEMENT CHARACTER}"
        )
    return character


def _clean(text: str) -> str:
    return "".join(" " if c in "\n\r\t" else _symbol(c) for c in text)


def _painter(color: bool) -> _Paint:
    if not color:
        return lambda text, hue: text
    return lambda text, hue: f"{hue}{text}{_RESET}"
