"""Loops evaluated in all iterations at once, judged by evaluating them one by one."""

from __future__ import annotations

from pathlib import Path
from random import Random

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from benchmarks.fuzz.author import program
from benchmarks.fuzz.targets import ways

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
