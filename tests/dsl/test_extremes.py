"""Sources at the limits: depth, length, recursion, letters and line ends of every kind."""

from __future__ import annotations

import pytest

import ovolo
from dsl.diagnostics import CompileError


def codes(text: str) -> list[str]:
    try:
        ovolo.compile(text)
    except CompileError as error:
        return [found.code for found in error.diagnostics]
    return []


@pytest.mark.parametrize("opener", ["(", "[", "{", "-", "not ", "f(", "if true {", "a.b("])
def test_a_hundred_thousand_brackets_are_too_many(opener: str) -> None:
    assert "limit-nesting" in codes(opener * 100_000)


@pytest.mark.parametrize("closer", [")", "]", "}", "let"])
def test_brackets_that_do_not_match_cost_no_more(closer: str) -> None:
    assert "limit-nesting" in codes("(" * 100_000 + f"{closer} " * 100_000)


def test_a_hundred_thousand_maps_in_one_chain() -> None:
    scene = ovolo.compile("sphere()" + ".rotate_y(90deg).translate(1, 0, 0)" * 50_000)
    assert scene.ir.world_from_object[0].tolist() == [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0]]


def test_functions_that_call_one_another_for_ever_end() -> None:
    assert codes("fn even(n) { odd(n + 1) }\nfn odd(n) { even(n + 1) }\neven(0)") == [
        "limit-call-depth"
    ]


def test_a_loop_of_functions_that_call_one_another_ends() -> None:
    text = "fn a(n) { b(n + 1) }\nfn b(n) { a(n + 1) }\nfor i in 0..50 { a(i) }"
    assert codes(text) == ["limit-call-depth"]


@pytest.mark.parametrize("number", ["9" * 308, "0." + "0" * 400 + "1", "1" + "0" * 300 + "e-300"])
def test_long_numbers_are_numbers(number: str) -> None:
    assert codes(f"let a = {number}") == []


def test_a_number_beyond_float64_is_a_fault() -> None:
    assert codes("let a = " + "9" * 100_000) == ["syntax-number"]


@pytest.mark.parametrize("newline", ["\n", "\r\n", "\r"])
@pytest.mark.parametrize("mark", ["", "\ufeff"])
def test_marks_and_line_ends_of_other_systems(mark: str, newline: str) -> None:
    text = newline.join([mark + "let größe = 2", "", "sphere(radius: größe)", "  .scale(2)", ""])
    assert len(ovolo.compile(text).ir.instance_target) == 1


@pytest.mark.parametrize("text", ["", "\ufeff", "\n", "// nothing", "/* nothing */", "{}"])
def test_nothing_is_a_scene(text: str) -> None:
    assert len(ovolo.compile(text).ir.instance_target) == 0


@pytest.mark.parametrize("name", ["日本", "größe", "𝒜", "ا", "a\u0301"])
def test_names_of_any_script(name: str) -> None:
    assert codes(f"let {name} = 1\nsphere(radius: {name})") == []


@pytest.mark.parametrize("letter", ["\u200b", "\ud800", "\0", "\u202e", "👍", "²", "\ue000"])
def test_what_is_no_letter_is_a_fault(letter: str) -> None:
    assert codes(f"let {letter} = 1") == ["syntax-unexpected-character"]
