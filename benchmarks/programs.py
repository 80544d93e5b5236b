"""Random programs by the hundred thousand: `python -m benchmarks.programs --count 100000 --jobs 2`.

Each is evaluated with its loop in all iterations at once and one after the other, which is to give
the same scene or the same faults, and formatted, which is to keep its meaning and to change nothing
twice: itself or, every second time, another one of any words that the grammar allows, with
comments. Beside each, one of lines that differ in numbers is read and evaluated line by line and at
once. Program k of a seed is the same in every run: `--first k --count 1` repeats it. Exits with
1 if one fails; it is kept in `--keep`.
"""

from __future__ import annotations

import argparse
import multiprocessing
import sys
import time
import traceback
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from random import Random

from benchmarks.fuzz.author import program, program_of_lines
from benchmarks.fuzz.targets import formatter, lines_alike, ways
from tests.dsl.programs import text_of

CHUNK = 60
"""Programs that a process takes at once."""
TOGETHER = 20
"""Programs whose scenes are flattened as one."""
PROGRESS = 20
"""Seconds between two lines that tell how far it is."""


@dataclass(frozen=True, slots=True)
class Result:
    """What a chunk came to: executions, CPU seconds, and the programs that failed, with why."""

    executions: int
    seconds: float
    failed: tuple[tuple[int, str, str], ...]


def texts_of(seed: int, number: int) -> tuple[str, str, str]:
    """The program with a number, what is formatted, and the program of lines."""
    random = Random(f"{seed} {number}")
    text = program(random)
    formatted = text if number % 2 else text_of(random.randrange(2**64))
    return text, formatted, program_of_lines(random)


def run(seed: int, numbers: range) -> Result:
    """Check the programs of these numbers."""
    start = time.process_time()
    texts = [texts_of(seed, number) for number in numbers]
    failed: list[tuple[int, str, str]] = []

    def check(number: int, target: Callable[[str], None], text: str) -> None:
        try:
            target(text)
        except Exception:  # whatever it is, it is told, and the others go on
            failed.append((number, text, f"{target.__name__}\n{traceback.format_exc()}"))

    for first in range(0, len(texts), TOGETHER):
        some = range(first, min(first + TOGETHER, len(texts)))
        try:
            ways(*(texts[k][0] for k in some))
        except Exception:  # which one it is
            for k in some:
                check(numbers[k], ways, texts[k][0])
    for number, (_, text, lines) in zip(numbers, texts, strict=True):
        check(number, formatter, text)
        check(number, lines_alike, lines)
    return Result(3 * len(texts), time.process_time() - start, tuple(failed))


def main() -> None:
    """Check all programs, telling now and then how far it is."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.programs", description=__doc__)
    parser.add_argument("--count", type=int, default=100_000, metavar="N")
    parser.add_argument("--first", type=int, default=0, metavar="K")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--keep", type=Path, default=Path("out/programs"), metavar="FOLDER")
    given = parser.parse_args()
    end = given.first + given.count
    chunks = [range(k, min(k + CHUNK, end)) for k in range(given.first, end, CHUNK)]
    programs = executions = failures = 0
    seconds = 0.0
    told = time.monotonic()
    with multiprocessing.get_context("spawn").Pool(given.jobs) as pool:
        results = pool.imap(partial(run, given.seed), chunks)
        for chunk, result in zip(chunks, results, strict=True):
            programs, executions = programs + len(chunk), executions + result.executions
            seconds += result.seconds
            for number, text, reason in result.failed:
                failures += 1
                given.keep.mkdir(parents=True, exist_ok=True)
                (given.keep / f"{given.seed}-{number}.ovo").write_text(text, encoding="utf-8")
                print(f"program {number} of seed {given.seed}: {reason}", flush=True)
            if time.monotonic() - told > PROGRESS or programs == given.count:
                told = time.monotonic()
                print(
                    f"{programs} programs, {executions} executions, {failures} failed, "
                    f"{seconds:.0f} s of CPU",
                    flush=True,
                )
    sys.exit(1 if failures else 0)


if __name__ == "__main__":
    main()
