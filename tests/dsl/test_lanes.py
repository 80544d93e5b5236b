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


@pytest.mark.parametrize("path", sorted(EXAMPLES.glob("*.ovo")), ids=lambda path: path.name)
def test_examples(path: Path) -> None:
    ways(path.read_text())
