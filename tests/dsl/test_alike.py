"""Lines that differ in their numbers, read and evaluated at once, judged by doing it one by one."""

from __future__ import annotations

from dataclasses import replace
from itertools import count
from random import Random

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from benchmarks.fuzz.author import program_of_lines
from benchmarks.fuzz.targets import lines_alike
from dsl import ast
from dsl.alike import FEWEST
from dsl.budget import DEFAULT_LIMITS
from dsl.evaluate import evaluate_source
from dsl.files import Files
from dsl.parser import one_by_one, parse, read
from dsl.spans import Source


def numbered(form: str, many: int = FEWEST) -> str:
    """So many lines of a form, whose `#` are 1, 2.5, 4, 5.5, …."""
    numbers = (f"{1 + 1.5 * k:g}" for k in count())
    return "".join(
        "".join(c if c != "#" else next(numbers) for c in form) + "\n" for _ in range(many)
    )


def statements(text: str) -> tuple[ast.Statement, ...]:
    module, faults = read(Source("scene.ovo", text))
    assert not faults
    return module.body.statements


@settings(max_examples=120)
@given(st.integers(0, 2**64))
def test_random_programs(seed: int) -> None:
    lines_alike(program_of_lines(Random(seed)))


FORMS = [
    "sphere(radius: #).rotate_y(#deg).translate(#, -#, # + #)",
    "box(size: (#, 2, #)).scale(0.01).rotate(axis: (1, 0, #), angle: #turn).translate(#, #, #)",
    "ball.translate(# , #, 0).material(matte(rgb(# / 1000, 0.5, 1e-3)))",
    "pair.rotate_x(#rad).scale(#)",
    "both(#).translate(#, 0, 0)",
    "cylinder(radius: 1, y: 0..#, bevel: 0.1)",
    "mirrored.override(clay)",
]
DEFINITIONS = """\
let ball = sphere()
let clay = matte()
let pair = {
  ball
  box().translate(0, 3, 0)
}
let mirrored = pair.reflect((1, 0, 0))
fn both(x) {
  ball.translate(x, 0, 0)
  sphere(radius: x)
}
"""


@pytest.mark.parametrize("form", FORMS)
def test_lines_of_one_form(form: str) -> None:
    text = numbered(form, 80)
    assert len(statements(text)) == 1
    lines_alike(DEFINITIONS + text)


@pytest.mark.parametrize("newline", ["\n", "\r\n", "\n\n", "\n// é, a comment\n\t"])
def test_forms_that_alternate(newline: str) -> None:
    lines = "".join(numbered(form, 40) for form in FORMS).splitlines()
    Random(7).shuffle(lines)
    text = newline.join(lines)
    assert len(statements(text)) == len(FORMS)
    lines_alike(DEFINITIONS + text)
    inside = newline.join(("fn all(x) {", text, "}", "all(1)", "all(2).translate(3, 0, 0)"))
    lines_alike(DEFINITIONS + inside)


@pytest.mark.parametrize(
    "text",
    [
        numbered("sphere(#).translate(#, 0, 0)") + ".scale(2)\n",
        numbered("sphere(#)\n.translate(#, 0, 0)"),
        "let list = [\n" + numbered("f(#, 0),") + "]\nfn f(a, b) { a }\nsphere(radius: list[3])\n",
        "/*\n" + numbered("sphere(#)") + "*/\nbox()\n",
        "sphere().translate(\n" + numbered("max(#)", 3) + ")\n" + numbered("max(#)"),
        numbered("sphere(#)") + "let sphere = box\n" + numbered("sphere(#)"),
        numbered("a.translate(#, 0, 0)") + "let a = box()\n",
        numbered("sphere(#)", 50) + "sphere(0)\n" + numbered("sphere(#)", 50),
        numbered("sphere(0 * #)", 70) + numbered("spere(#)", 40),
        "".join(f"sphere({k % 2})\nbox(size: ({1 - k % 2}, 1, 1))\n" for k in range(120)),
        numbered("point_light(position: (#, 0, 0))"),
        numbered("sphere().material(matte(rgb(#, #, #)))"),
        numbered("sphere().material(matte(rgb(255, 128, 0))).translate(#, 0, 0)"),
        numbered("sphere(#e307)") + numbered("sphere(1).rotate_x(#e307turn)"),
        numbered("sphere(#px)"),
        numbered("#.5"),
        numbered("sphere(#) sphere(#)"),
        numbered("[sphere(), box()][# % 2]"),
        "for i in 0..40 {\n" + numbered("sphere(radius: # + i)") + "}\n",
        "for i in 0..3 {\n" + numbered("sphere(radius: # + i).translate(#, i, 0)") + "}\n",
        "let all = {\n" + numbered("sphere(#)") + "}\nall.scale(2)\n",
        numbered("course(#)") + "fn course(n) { if n > 20 { box().scale(n) } else { sphere() } }\n",
        numbered("course(#)") + "fn course(n) { if n > 20 { box().scale(n) } }\n",
        numbered("tower(#)", 40) + "fn tower(n) { for i in 0..n { box().translate(0, i, n) } }\n",
    ],
)  # fmt: skip
def test_lines_with_more_to_them(text: str) -> None:
    lines_alike(text)


def test_lines_of_one_form_are_evaluated_at_once() -> None:
    text = numbered("sphere(radius: #).rotate_y(#deg).translate(#, #, 3 + #)", 1000)
    limits = replace(DEFAULT_LIMITS, steps=6_000)  # one after the other take three times as many
    graph, faults = evaluate_source(Source("scene.ovo", text), Files(), limits)
    assert graph is not None
    assert not faults


def test_lines_one_by_one_are_what_the_parser_reads() -> None:
    text = "let é = 2\n\n" + numbered("  sphere(#).translate(0, # , 0)\t\r")
    _, alike = statements(text)
    assert isinstance(alike, ast.Alike)
    tree, _ = parse(Source("scene.ovo", text))
    assert repr(one_by_one(alike)) == repr(tree.body.statements[1:])
