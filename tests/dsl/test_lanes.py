"""Loops evaluated in all iterations at once, judged by evaluating them one by one."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from random import Random

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from benchmarks.fuzz.author import program
from benchmarks.fuzz.targets import ways
from dsl.budget import DEFAULT_LIMITS
from dsl.evaluate import evaluate_source
from dsl.files import Files
from dsl.spans import Source

EXAMPLES = Path(__file__).parent.parent.parent / "examples"


@settings(max_examples=120)
@given(st.integers(0, 2**64))
def test_random_programs(seed: int) -> None:
    ways(program(Random(seed)))


def test_what_does_not_vary_is_composed_apart_in_a_group_that_does() -> None:
    ways(
        "for i in 0..4 {\nlet a = {\n{\nlet b = {\nsphere().scale(-3)"
        ".matrix(1, 0, 0, 4, 0, 1, 0, 0, 0, -3, 1, 0)\ncone().scale(1 + i)\n}\n"
        "b.shear(xy: 2.5)\n}\nbox()\n}\na.transform(rotate_x(10deg * i) * translate(1, i, 0))\n}"
    )


@pytest.mark.parametrize("path", sorted(EXAMPLES.glob("*.ovo")), ids=lambda path: path.name)
def test_examples(path: Path) -> None:
    ways(path.read_text())


@pytest.mark.parametrize(
    "text",
    [
        "for i in 0..40 { for j in 0..i { sphere().translate(i, j, 0) } }",
        "for i in 0..40 { for j in 1.5..i / 2 { box().scale(1 + j).translate(i, j, 0)\n"
        "if j > i / 3 { cone().translate(j, i, 1) } else { sphere(1 + i) } } }",
        "let s = sphere()\nfor i in 0..40 { for j in 0..i % 3 { s } }",
        "for i in 0..40 { for j in 0..i % 3 {\n"
        "box().material(matte(rgb(i / 40, j / 40, 0))).translate(i, 0, 0)\n"
        "for k in 0..j + i % 2 { box().translate(i, j, k) } } }",
        "fn tower(n) { for k in 0..n { box().translate(0, k, 0) } }\n"
        "for i in 0..50 { tower(i % 7).translate(3 * i, 0, 0) }",
        "for i in 0..40 { let a = { for j in 0..i { sphere().translate(i, j, 0)\nbox() } }\n"
        "a.rotate_x(1deg * i) }",
        "for i in 0..40 { for j in 0..0 * i { sphere() }\nbox().translate(0, i, 0) }",
        "for i in 0..40 { for j in 0..i { sphere(1 - j / 38).translate(i, j, 0) } }",
        "for i in 0..40 { for j in 0..i, k in 0..i { sphere().translate(i, j, k) } }",
        "for i in 0..40 { for j in i..i + 2 { sphere().translate(i, j, 0) } }",
        "for i in 0..40 { for j in 0..i * 100 { sphere().translate(i, j, 0) } }",
        "for i in 0..40 { for j in 0..i * 1e300 { sphere() } }",
        "for i in 0..40 { for j in 0..i { point_light(position: (i, j, 0)) } }",
        "for i in 0..40 { if i > 3 { for j in -3..i - 8 { if j < 0 { sphere().scale(i) } } } }",
    ],
)
def test_inner_loops_of_different_lengths(text: str) -> None:
    ways(text)


def test_inner_loops_of_different_lengths_are_evaluated_at_once() -> None:
    text = "for i in 0..5000 { for j in 0..i % 20 { sphere().translate(i, j, 0) } }"
    limits = replace(DEFAULT_LIMITS, steps=100_000)  # one after the other take seven times as many
    graph, faults = evaluate_source(Source("scene.ovo", text), Files(), limits)
    assert graph is not None
    assert not faults
