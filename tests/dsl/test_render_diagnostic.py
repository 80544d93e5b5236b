"""Rendering: the marks stand under the words, and nothing of a source commands a terminal."""

from __future__ import annotations

import json
import re
import unicodedata

import pytest
from hypothesis import given
from hypothesis import strategies as st
from wcwidth import wcswidth

from dsl.diagnostics import Diagnostic, Label
from dsl.render_diagnostic import line_and_column, render_diagnostic, to_json
from dsl.spans import PrimPlace, Source, Span


def found(place: Span | PrimPlace, *secondary: Label, help: str | None = None) -> Diagnostic:
    return Diagnostic("name-unknown", "error", "nothing", Label(place, "here"), secondary, help)


def test_the_form() -> None:
    source = Source("temple.ovo", "let a = 1\n\ncolum.scale(a)\n")
    text = render_diagnostic(
        found(Span(source, 11, 16), Label(Span(source, 4, 5), "near"), help="mend it")
    )
    assert text == (
        "error[name-unknown]: nothing\n"
        " --> temple.ovo:3:1\n"
        "  |\n"
        "1 | let a = 1\n"
        "  |     - near\n"
        "...\n"
        "3 | colum.scale(a)\n"
        "  | ^^^^^ here\n"
        "  |\n"
        "  = help: mend it\n"
    )


def test_a_prim_of_a_stage() -> None:
    text = render_diagnostic(found(PrimPlace("stage.usda", "/World/Prim")))
    assert text == "error[name-unknown]: nothing\n --> stage.usda:/World/Prim\n  = note: here\n"


def test_no_place() -> None:
    diagnostic = Diagnostic("file-missing", "error", "no file `a`", help="look for it")
    assert (
        render_diagnostic(diagnostic) == "error[file-missing]: no file `a`\n  = help: look for it\n"
    )


@given(st.text(max_size=30), st.text(min_size=1, max_size=5), st.text(max_size=10), st.booleans())
def test_marks_stand_under_the_words(before: str, word: str, after: str, crlf: bool) -> None:
    line = re.sub(r"[\r\n]", " ", before)
    word = re.sub(r"\s", "x", word)
    newline = "\r\n" if crlf else "\n"
    text = f"first{newline}{line}{word}{after}{newline}last"
    start = len(f"first{newline}{line}".encode())
    span = Span(Source("a.ovo", text), start, start + len(word.encode()))
    rendered = render_diagnostic(found(span)).split("\n")
    if text.isascii():
        assert rendered[1] == f" --> a.ovo:2:{len(line) + 1}"
    shown = rendered[3].removeprefix("2 | ") if len(rendered[3]) > 3 else ""
    mark = rendered[4].removeprefix("  | ")
    column = len(mark) - len(mark.lstrip())
    assert _width(shown.ljust(200)[: len(shown)]) >= column or not shown.strip()
    assert mark.strip().startswith("^")


def _width(text: str) -> int:
    return sum(2 if unicodedata.east_asian_width(c) in "WF" else 1 for c in text)


@given(st.text(max_size=40))
def test_a_source_cannot_command_a_terminal(text: str) -> None:
    source = Source(f"a{text}.ovo", text)
    rendered = render_diagnostic(found(Span(source, 0, len(text.encode()))))
    categories = {unicodedata.category(c) for c in rendered.replace("\n", "")}
    assert not categories & {"Cc", "Cf", "Cs", "Zl", "Zp"}


def test_a_long_line_is_cut_around_the_place() -> None:
    source = Source("a.ovo", "x" * 10_000 + "WORD" + "y" * 10_000)
    lines = render_diagnostic(found(Span(source, 10_000, 10_004))).split("\n")
    assert len(lines[3]) < 120
    column = lines[4].index("^")
    assert lines[3][column : column + 4] == "WORD"


def test_a_place_at_the_end_of_the_source() -> None:
    source = Source("a.ovo", "let a =")
    assert "1 | let a =\n  |        ^ here\n" in render_diagnostic(found(Span(source, 7, 7)))


def test_json() -> None:
    source = Source("a.ovo", "größe\nbreite")
    place = Span(source, 8, 14)
    value = json.loads(json.dumps(to_json(found(place, Label(PrimPlace("s.usd", "/A"), "p")))))
    assert value == {
        "version": 1,
        "code": "name-unknown",
        "severity": "error",
        "message": "nothing",
        "primary": {
            "file": "a.ovo",
            "start": 8,
            "end": 14,
            "line": 2,
            "column": 1,
            "end_line": 2,
            "end_column": 7,
            "text": "here",
        },
        "secondary": [{"stage": "s.usd", "prim": "/A", "text": "p"}],
        "help": None,
    }


@given(
    st.text(st.characters(max_codepoint=0x2FF, exclude_characters="\r\xad"), max_size=40), st.data()
)
def test_columns_of_latin_text_count_its_letters(text: str, data: st.DataObject) -> None:
    position = data.draw(st.integers(0, len(text)))
    line, column = line_and_column(Source("a", text), len(text[:position].encode()))
    assert line == text.count("\n", 0, position) + 1
    assert column == position - (text.rfind("\n", 0, position) + 1) + 1


@pytest.mark.parametrize(
    "cluster",
    [
        "e\u0301",  # a letter and its accent
        "\U0001f469\u200d\U0001f469\u200d\U0001f467",  # a family
        "\U0001f1e9\U0001f1ea",  # a flag
        "\u1112\u1161\u11ab",  # a syllable of three jamo
        "\u2764\ufe0f",  # an emoji by its variation selector
        "\u0915\u094d\u0937",  # a conjunct
    ],
)
def test_columns_count_grapheme_clusters(cluster: str) -> None:
    text = f"let {cluster}{cluster} = 1"
    source, size = Source("a", text), len(cluster.encode())
    assert line_and_column(source, 4) == (1, 5)
    assert line_and_column(source, 4 + size) == (1, 6)
    assert line_and_column(source, 4 + 2 * size) == (1, 7)
    assert line_and_column(source, len(text.encode())) == (1, 11)
    assert line_and_column(source, 4 + len(cluster[0].encode())) == (1, 5)
    line, mark = render_diagnostic(found(Span(source, 4 + 2 * size, 5 + 2 * size))).split("\n")[3:5]
    assert wcswidth(line.partition(" = ")[0]) == mark.index("^")


def test_columns_of_a_very_long_line_are_counted_soon() -> None:
    source = Source("a", "日" * 3_000_000)
    assert line_and_column(source, 9_000_000) == (1, 3_000_001)
