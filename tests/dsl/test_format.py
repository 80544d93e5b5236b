"""The formatter: canonical, and faithful to words, comments and meaning."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dsl.format import WIDTH, format_source
from dsl.parser import parse
from dsl.spans import Source, Span
from tests.dsl.programs import programs

ROOT = Path(__file__).parent.parent.parent
COMMENT = re.compile(r'"(?:[^"\\\n]|\\.)*"|(//[^\n]*|/\*[\s\S]*?\*/)')


def formatted(text: str) -> str:
    result, faults = format_source(Source("scene.ovo", text))
    assert not faults
    assert result is not None
    return result


def meaning(text: str) -> object:
    """The syntax tree without places."""

    def plain(node: object) -> object:
        if isinstance(node, tuple):
            return tuple(plain(part) for part in node)
        if hasattr(node, "__dataclass_fields__") and not isinstance(node, Span):
            fields = [getattr(node, f) for f in node.__dataclass_fields__]
            return (type(node).__name__, *(plain(f) for f in fields if not isinstance(f, Span)))
        return node

    module, faults = parse(Source("scene.ovo", text))
    assert not faults
    return plain(module.body)


def comments(text: str) -> list[str]:
    return [match[1].rstrip() for match in COMMENT.finditer(text) if match[1]]


@settings(max_examples=60)
@given(programs())
def test_random_programs_keep_their_meaning_and_comments(text: str) -> None:
    once = formatted(text)
    assert meaning(once) == meaning(text)
    assert comments(once) == comments(text)
    assert formatted(once) == once


@settings(max_examples=30)
@given(programs(comments=False))
def test_lines_have_no_trailing_space_and_open_no_empty_lines(text: str) -> None:
    lines = formatted(text).split("\n")
    assert lines.pop() == ""
    for line, after in zip(lines, [*lines[1:], "end"], strict=False):
        assert line == line.rstrip()
        assert line or after
        assert not (line.endswith(("(", "[", "{")) and not after)
        assert "\t" not in line


@pytest.mark.parametrize("path", sorted(ROOT.glob("examples/*.ovo")), ids=lambda path: path.name)
def test_examples_are_canonical(path: Path) -> None:
    assert formatted(path.read_text()) == path.read_text()


@settings(max_examples=60)
@given(st.text(alphabet='()[]{},.:=-+*/ \n"#ab1.le/t', max_size=30))
def test_any_text_is_formatted_or_refused(text: str) -> None:
    result, faults = format_source(Source("scene.ovo", text))
    assert (result is None) == bool(faults)
    if result is not None:
        assert formatted(result) == result


def test_a_long_line_is_broken_where_it_reads_best() -> None:
    long = ", ".join(f"parameter_{i}: {i}" for i in range(8))
    assert formatted(f"f({long})").split("\n")[:2] == ["f(", "  parameter_0: 0,"]
    block = formatted(f"for i in 0..3 {{ f({long[:80]}).g() }}")
    assert block.startswith("for i in 0..3 {\n  f(")
    chain = formatted("ball" + ".translate(10, 20, 30)" * 6)
    assert all(len(line) <= WIDTH for line in chain.split("\n"))
    assert chain.split("\n")[1].startswith("  .translate(10, 20, 30)")


def test_faulty_syntax_is_refused_with_its_faults() -> None:
    result, faults = format_source(Source("scene.ovo", "sphere(1\nlet a = 1"))
    assert result is None
    assert [fault.code for fault in faults] == ["syntax-unclosed"]


def test_line_ends_and_marks_of_other_systems() -> None:
    assert formatted("let a = 1\r\n/* b\r\nc */\rsphere()") == "let a = 1\n/* b\nc */\nsphere()\n"
    assert formatted("") == ""
    assert formatted("\n\n // only\n\n") == "// only\n"


def test_ten_thousand_suffixes_and_a_deep_nest() -> None:
    chain = "sphere()" + ".scale(2)" * 10_000
    assert meaning(formatted(chain)) == meaning(chain)
    deep = "f(" * 60 + "1" + ")" * 60
    assert meaning(formatted(deep)) == meaning(deep)


def test_the_blocks_of_a_conditional_after_a_comment_are_broken_together() -> None:
    long = "a_name_that_is_rather_long(" + "1, " * 17 + "1)"
    text = f"f(if  // why\n  a {{ short }} else {{ {long} }})"
    once = formatted(text)
    assert formatted(once) == once
    assert "a {\n    short\n  } else {\n" in once
