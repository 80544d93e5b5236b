from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from dsl.language_service.colors import colors, presentations
from dsl.language_service.lines import Lines, Position, Unit
from dsl.language_service.outline import Fold, folds, symbols
from dsl.language_service.values import evaluate_program, inlays
from tests.dsl.language_service.editing import at_cursor


def test_definitions_are_listed_with_those_inside_them() -> None:
    project, program, _ = at_cursor(
        'use "b.ovo" as b\nlet n = 3\nfn f(x) { let y = x\nfn g() { box() }\ng() }\n'
        "let dome = { let z = 1\nfor i in 0..n { let w = i\nsphere() } }\n"
    )
    found = symbols(project, program)
    tree = [(s.name, s.kind, [c.name for c in s.children]) for s in found]
    assert tree == [
        ("b", "a file", []),
        ("n", "a number", []),
        ("f", "a function", ["y", "g"]),
        ("dome", "an object", ["z", "w"]),
    ]


def test_brackets_comments_and_uses_fold() -> None:
    _, program, _ = at_cursor(
        'use "a.ovo" as a\nuse "b.ovo" as b\n// one\n// two\nfor i in 0..3 {\n  box(\n    1,\n  )\n'
        "}\n/* a\nb */\nfn f() {\n"
    )
    assert folds(program, Lines(program.source.text)) == [
        Fold(0, 1, "imports"),
        Fold(2, 3, "comment"),
        Fold(4, 7, "region"),
        Fold(5, 6, "region"),
        Fold(9, 10, "comment"),
    ]


def test_colors_are_found_and_written_back() -> None:
    _, program, _ = at_cursor(
        "let a = #D2b48c\nlet b = rgb(0.5, 0, 1)\nlet c = rgb(2, 0, 0)\nrgb(a, 1, 1)"
    )
    found = colors(program)
    assert [program.encoded[c.start : c.end] for c in found] == [b"#D2b48c", b"rgb(0.5, 0, 1)"]
    assert presentations(found[0].encoded, "#D2b48c")[0] == "#d2b48c"
    assert presentations(found[1].encoded, "rgb(0.5, 0, 1)")[0] == "rgb(0.5, 0, 1)"


@given(st.tuples(*[st.integers(0, 255)] * 3))
def test_a_color_written_as_rgb_is_the_same_on_screen(components: tuple[int, int, int]) -> None:
    red, green, blue = (c / 255.0 for c in components)
    hexadecimal, linear = presentations((red, green, blue), "#")
    _, program, _ = at_cursor(f"{hexadecimal}\n{linear}")
    first, second = colors(program)
    assert presentations(first.encoded, "#")[0] == presentations(second.encoded, "#")[0]


def test_computed_values_are_shown_and_literals_are_not() -> None:
    project, program, _ = at_cursor(
        "let n = 16\nlet m = n * 2\nlet v = (1, 2, 3) / 3\nlet a = 360deg / m\n"
        "let c = mix(#000000, #ffffff, 0.5)\nlet s = sphere()\n"
        "let faulty = n + sphere()\nlet i = 0..m\nlet w = (-1, 2)\nlet b = n > 3\n"
    )
    evaluation = evaluate_program(project, program)
    assert [inlay.text for inlay in inlays(program, evaluation.values)] == [
        "= 32",
        "= (0.333333, 0.666667, 1)",
        "= 11.25deg",
        "= rgb(0.5, 0.5, 0.5)",
        "= 0..32",
        "= true",
    ]
    assert [d.code for d in evaluation.diagnostics if d.severity == "error"] == ["type-operator"]


def test_faults_of_a_used_file_are_told_where_it_is_used() -> None:
    project, program, _ = at_cursor(
        'use "a.ovo" as a\nuse "b.ovo" as b\nb.x',
        a="let y = 1",
        b='use "c.ovo" as c\nlet x = box()',
        c="let z = 1 + true",
    )
    [found] = [d for d in evaluate_program(project, program).diagnostics if d.severity == "error"]
    assert found.code == "type-operator"
    assert found.primary is not None
    assert found.primary.place == program.uses[1].path.span  # type: ignore[union-attr]
    assert found.secondary[0].place.source.name == "/scenes/c.ovo"  # type: ignore[union-attr]


def test_a_program_too_large_for_typing_has_no_fault_for_it() -> None:
    project, program, _ = at_cursor(
        "fn f(n) { if n < 1 { 1 } else { f(n - 1) + f(n - 1) } }\nsphere(radius: f(40))"
    )
    assert evaluate_program(project, program).diagnostics == []


@given(st.text(alphabet="a\r\n\té高😀\u2028\x0b"), st.sampled_from(["utf-8", "utf-16", "utf-32"]))
def test_positions_and_offsets_are_inverse(text: str, unit: Unit) -> None:
    lines = Lines(text, unit)
    codec = {"utf-8": "utf-8", "utf-16": "utf-16-le", "utf-32": "utf-32-le"}[unit]
    width = {"utf-8": 1, "utf-16": 2, "utf-32": 4}[unit]
    offset, line, column = 0, 0, 0
    for index, letter in enumerate(text):
        assert lines.position(offset) == (line, column)
        if letter == "\n" and text[index - 1 : index] == "\r":
            pass  # between CR and LF there is no position
        else:
            assert lines.offset(Position(line, column)) == offset
        offset += len(letter.encode())
        column += len(letter.encode(codec)) // width
        if letter == "\n" or (letter == "\r" and text[index + 1 : index + 2] != "\n"):
            line, column = line + 1, 0
    assert lines.position(offset) == (line, column)
    assert lines.offset(Position(line, column)) == offset
    assert lines.offset(Position(line + 5, 3)) == offset


def test_a_position_inside_or_behind_a_line_is_moved_into_it() -> None:
    lines = Lines("a😀b\nc")
    assert lines.offset(Position(0, 2)) == 1  # between the halves of a surrogate pair
    assert lines.offset(Position(0, 99)) == len("a😀b".encode())
    assert lines.offset(Position(-1, -1)) == 0


def test_advice_on_names_waits_until_all_can_be_read() -> None:
    def advised(text: str) -> list[str]:
        project, program, _ = at_cursor(text)
        return [d.code for d in evaluate_program(project, program).diagnostics]

    assert advised("let a = 1\nsphere()") == ["advice-unused"]
    assert advised("let a = 1\nsphere(radius: a") == ["syntax-unclosed"]
    assert advised("let a = 1\nfn f(b) { sphere() }") == ["advice-unused"]  # b; a file may use a
