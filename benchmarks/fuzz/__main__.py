"""`python -m benchmarks.fuzz`: random inputs against every reader, for so long or so many.

Prints executions for each target, and what was found: the input goes to `--keep`.
"""

from __future__ import annotations

import argparse
import resource
import signal
import tempfile
import time
import traceback
from collections.abc import Callable, Iterator
from contextlib import suppress
from functools import partial
from itertools import count, cycle
from pathlib import Path
from random import Random

from benchmarks.fuzz import targets
from benchmarks.fuzz.author import program, program_of_lines
from benchmarks.fuzz.mutations import damaged_bytes, damaged_text
from compiler.compilation import compile_text
from compiler.ir_binary import write_ir
from compiler.ir_text import print_ir
from dsl.diagnostics import CompileError
from dsl.examples import read_examples
from tests.dsl.programs import text_of

SLOW = 10.0
"""CPU seconds that no input may take."""
MEMORY = 4 << 30
"""Bytes of address space that no input may need more than."""

TARGETS = [*targets.TEXT_TARGETS, "ir_binary"]
Input = str | bytes
Case = tuple[str, Callable[[], None], Input]


class Fuzzer:
    """The inputs, grown from a seed, and the targets that they go to."""

    def __init__(self, seed: int, folder: Path) -> None:
        self.random = Random(seed)
        self.folder = folder
        examples = list(read_examples())
        self.sources = [example.source for example in examples if example.language == "ovolo"]
        self.irs = [example.outcome for example in examples if example.kind == "ir"]
        self.irs += [print_ir(compile_text(text).ir, sources=True) for text in _GRAPHS]
        self.binaries = list(self._binaries())

    def _binaries(self) -> Iterator[bytes]:
        for number, text in enumerate(_GRAPHS):
            path = self.folder / f"{number}.bin"
            write_ir(compile_text(text).ir, path)
            yield path.read_bytes()

    def cases(self, chosen: list[str]) -> Iterator[Case]:
        """Cases without end, one target after the other."""
        for name in cycle(chosen):
            if name == "ir_binary":
                content = damaged_bytes(self.random, self.binaries)
                path = self.folder / "scene.bin"
                yield name, partial(targets.ir_binary, content, path), content
                continue
            text = self.text(name)
            yield name, partial(targets.TEXT_TARGETS[name], text), text

    def text(self, name: str) -> str:
        """An input for a target that takes a text."""
        if name == "ways":
            return program(self.random)
        if name == "lines_alike" and self.random.random() < 0.5:
            return program_of_lines(self.random)
        if name == "ir_text":
            return damaged_text(self.random, self.irs)
        grown = (
            program(self.random),
            program_of_lines(self.random),
            text_of(self.random.randrange(2**64)),
        )
        if self.random.random() < (0.5 if name == "formatter" else 0.2):
            return self.random.choice(grown)
        return damaged_text(self.random, [*grown, *self.random.sample(self.sources, 8)])


_GRAPHS = (
    "",
    "for i in 0..40 { sphere(radius: 1 + i % 3).translate(i, 0, 0).rotate_y(7deg * i) }",
    "let a = { box(bevel: 0.1)\nwedge(r: 1..2, y: 0..1, phi: 0deg..90deg) }\n"
    "for i in 0..3 { a.scale(1 + i).material(metal(rgb(1, i / 3, 0))) }\n"
    "sun(direction: (0, -1, 0), irradiance: 3)\ncamera(from: (0, 0, 9))\nsettings(width: 8)",
)


def main() -> None:
    """Fuzz until the time is over, the number reached, or Ctrl-C; exit 1 if something was found."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.fuzz", description=__doc__)
    parser.add_argument("targets", nargs="*", default=TARGETS, help="of " + ", ".join(TARGETS))
    parser.add_argument("--seconds", type=float, default=float("inf"), help="CPU seconds")
    parser.add_argument("--executions", type=int, default=10**9)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--keep", type=Path, default=Path("out/fuzz"), metavar="FOLDER")
    given = parser.parse_args()
    signal.signal(signal.SIGINT, signal.default_int_handler)  # which shells ignore behind `&`
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    done = dict.fromkeys(given.targets, 0)
    spent = dict.fromkeys(given.targets, 0.0)
    slowest = dict.fromkeys(given.targets, 0.0)
    found: dict[str, int] = {}
    with tempfile.TemporaryDirectory() as folder:
        fuzzer = Fuzzer(given.seed, Path(folder))
        start = time.process_time()
        with suppress(KeyboardInterrupt):
            for number, (name, run, content) in zip(
                count(), fuzzer.cases(given.targets), strict=False
            ):
                before = time.process_time()
                if number >= given.executions or before - start > given.seconds:
                    break
                fault = _fault(run)
                seconds = time.process_time() - before
                done[name] += 1
                spent[name] += seconds
                slowest[name] = max(slowest[name], seconds)
                if fault is None and seconds > SLOW:
                    fault = f"{seconds:.1f} s"
                if fault is not None:
                    _keep(given.keep, name, content, fault, found)
    for name in given.targets:
        print(
            f"{name:10} {done[name]:8} executions, {spent[name]:7.1f} s of CPU, slowest "
            f"{slowest[name]:.2f} s"
        )
    print(f"{sum(done.values())} executions, {len(found)} different faults, seed {given.seed}")
    raise SystemExit(1 if found else 0)


def _fault(run: Callable[[], None]) -> str | None:
    """Where and how a case went wrong, if it did."""
    try:
        run()
    except (Exception, RecursionError, MemoryError) as error:
        if isinstance(error, CompileError):
            return f"CompileError {error}"
        frames = traceback.extract_tb(error.__traceback__)
        places = [f"{Path(f.filename).name}:{f.lineno}" for f in frames[-3:]]
        return f"{type(error).__name__} {' '.join(places)}"
    return None


def _keep(folder: Path, name: str, content: Input, fault: str, found: dict[str, int]) -> None:
    """Print a fault that is new, and keep its input."""
    key = f"{name}: {fault}"
    found[key] = found.get(key, 0) + 1
    if found[key] > 1:
        return
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / f"{name}-{len(found)}"
    data = content if isinstance(content, bytes) else content.encode("utf-8", "surrogatepass")
    path.write_bytes(data)
    print(f"{key}: {path}", flush=True)


if __name__ == "__main__":
    main()
