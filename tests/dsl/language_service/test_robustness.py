"""Every question has an answer at every place of every text, however broken."""

from __future__ import annotations

from contextlib import suppress

from hypothesis import given, settings
from hypothesis import strategies as st

from dsl.examples import read_examples
from dsl.language_service.colors import colors
from dsl.language_service.completion import completions
from dsl.language_service.hover import hover
from dsl.language_service.lines import Lines
from dsl.language_service.navigation import definition, references
from dsl.language_service.outline import folds, symbols
from dsl.language_service.program import Program
from dsl.language_service.project import Project
from dsl.language_service.rename import RefusedError, rename
from dsl.language_service.signature import signature_help
from dsl.language_service.values import evaluate_program, inlays
from dsl.spans import Span

PROGRAMS = sorted({e.source for e in read_examples() if e.language == "ovolo"}, key=len)
WORDS = st.sampled_from(
    [
        *("let a = ", "a", "fn f(x) {", "for i in 0..3 {", "if ", "else", 'use "x.ovo" as x'),
        *("(", ")", "[", "]", "{", "}", ".", ",", "..", "1", "1deg", "#d2b48c", '"', "é😀"),
        *("sphere(", "translate", "radius: ", "rgb(", "material(", "//", "/*", "/// doc\n"),
        *("\n", "\r", " ", "\u2028", "\x00"),
    ]
)


def ask_everything(text: str, offset: int) -> None:
    project = Project()
    project.open("/scenes/main.ovo", text)
    program = project.program("/scenes/main.ovo")
    assert program is not None
    lines = Lines(text)
    size = len(program.encoded)
    hovered = hover(project, program, offset)
    assert hovered is None or within(hovered.span, size)
    for item in completions(project, program, offset):
        assert 0 <= item.start <= item.end <= size
    signature_help(project, program, offset)
    definition(project, program, offset)
    for each in references(project, program, offset):
        assert within(each.span, size)
    with suppress(RefusedError):
        rename(project, program, offset, "renamed")
    for symbol in symbols(project, program):
        assert within(symbol.name_span, size)
    for fold in folds(program, lines):
        assert 0 <= fold.first < fold.last <= text.count("\n") + text.count("\r")
    colors(program)
    evaluation = evaluate_program(project, program)
    inlays(program, evaluation.values)


def within(span: Span, size: int) -> bool:
    return 0 <= span.start <= span.end <= size


@settings(max_examples=150)
@given(st.lists(WORDS, max_size=25).map("".join), st.floats(0.0, 1.0))
def test_random_words(text: str, where: float) -> None:
    ask_everything(text, round(where * len(text.encode())))


@settings(max_examples=60)
@given(st.data())
def test_programs_cut_off_while_they_are_typed(data: st.DataObject) -> None:
    program = data.draw(st.sampled_from(PROGRAMS[:150]))
    cut = data.draw(st.integers(0, len(program)))
    tail = data.draw(st.sampled_from(["", "\nsphere()\n", program[cut + 3 :]]))
    ask_everything(program[:cut] + tail, len(program[:cut].encode()))


def test_deep_nesting_and_long_chains() -> None:
    for text in (
        "(" * 100_000,
        "sphere()" + ".scale(2)" * 5_000,
        "let x = " + "1 + " * 10_000,
        "{" * 5_000 + "\n" + "}" * 5_000,
        "fn f() { f() }\nlet g = f()\ng.x(",
        "let a0 = 1\n" + "\n".join(f"let a{i} = a{i - 1}" for i in range(1, 300)) + "\na299.",
    ):
        ask_everything(text, len(text.encode()))


def test_names_that_define_one_another_end() -> None:
    project = Project()
    project.open("/a.ovo", 'use "b.ovo" as b\nlet x = b.y\nx.')
    project.open("/b.ovo", 'use "a.ovo" as a\nlet y = a.x')
    program = project.program("/a.ovo")
    assert isinstance(program, Program)
    assert completions(project, program, len(program.encoded))
