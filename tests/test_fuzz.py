"""A short run of `python -m benchmarks.fuzz`: whatever the input, the answer is diagnostics."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import islice
from pathlib import Path

import pytest

from benchmarks import programs
from benchmarks.fuzz.__main__ import TARGETS, Case, Fuzzer


def run_cases(cases: Iterator[Case], count: int) -> None:
    for _, run, _ in islice(cases, count):
        run()


@pytest.mark.parametrize("target", [name for name in TARGETS if name != "ways"])
def test_damaged_input_is_refused_or_read(target: str, tmp_path: Path) -> None:
    run_cases(Fuzzer(20, tmp_path).cases([target]), 150)


def test_the_fuzzer_finds_what_is_wrong(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A formatter that loses spaces is noticed."""
    monkeypatch.setattr("dsl.format._space", lambda left, right: "")
    cases = Fuzzer(20, tmp_path).cases(["formatter"])
    with pytest.raises(AssertionError):
        run_cases(cases, 100)


def test_random_programs_that_fail_are_told(monkeypatch: pytest.MonkeyPatch) -> None:
    numbers = range(3, 12)
    assert programs.run(3, numbers).failed == ()

    def without_tori(*texts: str) -> None:
        assert not any("torus" in text for text in texts)

    monkeypatch.setattr(programs, "ways", without_tori)
    told = [number for number, _, _ in programs.run(3, numbers).failed]
    assert told == [number for number in numbers if "torus" in programs.texts_of(3, number)[0]]
    assert told
