"""The formatter: canonical, and faithful to words, comments and meaning."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dsl.budget import DEFAULT_LIMITS
from dsl.format import WIDTH, format_source
from dsl.lexer import tokenize
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


def check(text: str) -> None:
    once = formatted(text)
    assert comments(once) == comments(text)
    assert meaning(once) == meaning(text)
    assert formatted(once) == once


@settings(max_examples=60)
@given(programs())
def test_random_programs_keep_their_meaning_and_comments(text: str) -> None:
    check(text)


@pytest.mark.parametrize("width", [1, WIDTH])
@pytest.mark.parametrize(
    "program",
    [
        'param p = 3 in 1..a\nuse "b.ovo" as b\n\n/// c\nlet c = -p * b.a\n',
        "fn f(x, y = 2) { let a = x\n a }\nf(1, y: [])\n",
        "for i in 0..a, j in [0] { f().in((a, 2)[0]) }\n",
        "if not a { f() } else { }\n",
        "f(\n  1, a,\n  if a { } else { },\n)\n  .x()\n",
    ],
)
def test_comments_are_kept_wherever_they_stand(program: str, width: int) -> None:
    text = re.sub(r"\b[af]\b", lambda name: name[0].ljust(width, "_"), program)
    tokens, _ = tokenize(Source("scene.ovo", text), DEFAULT_LIMITS)
    tried = 0
    for place in sorted({place for token in tokens for place in (token.start, token.end)}):
        for comment in ("/* c\n c */", "// c\n", "\n/* c */ /// c\n\n", "// c\n/// c\n"):
            commented = f"{text[:place]} {comment} {text[place:]}"
            if not parse(Source("scene.ovo", commented))[1]:
                check(commented)
                tried += 1
    assert tried > len(tokens)


def test_a_comment_of_lines_before_a_bracket_that_does_not_fit_is_kept_whole() -> None:
    name = "a" * WIDTH
    assert formatted(f"{name}/* b\n c */()") == f"{name} /* b\n c */ ()\n"
    assert formatted(f"f(if {name}/* b\n c */{{}})") == f"f(\n  if {name} /* b\n c */ {{}},\n)\n"


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("/* a */ /// b\nlet c = 1\n", "/* a */ /// b\nlet c = 1\n"),
        ("fn f(\n/// a\n\nx) { x }", "fn f(\n  /// a\n\n  x,\n) {\n  x\n}\n"),
        (
            "fn f(x // a\n/// b\n, y) { x }",
            "fn f(\n  x,  // a\n  /// b\n\n  y,\n) {\n  x\n}\n",
        ),
    ],
)
def test_what_documents_nothing_does_not_become_documentation(text: str, expected: str) -> None:
    assert formatted(text) == expected
    check(text)


def test_comments_begin_in_one_column_beside_code_of_several_lines() -> None:
    assert formatted("f(a /* b\n c */) // d\nx // e") == "f(a /* b\n c */)  // d\nx       // e\n"


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
