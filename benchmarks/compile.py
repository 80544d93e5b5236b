"""How long programs take from text to IR: `docs/compile-time.md`.

`python -m benchmarks.compile` prints the table and draws the growth into `docs/compile-time.png`.
Each program is compiled in a process of its own, so that the peak of memory is its own.
"""

from __future__ import annotations

import resource
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

from benchmarks.process import Used, ovolo

PLOT = Path(__file__).parent.parent / "docs" / "compile-time.png"
GROWTH = (10**3, 10**4, 10**5, 10**6, 10**7)


def loop(count: int) -> str:
    """So many instances in double loops with five transforms and an `if`."""
    loops = max(1, count // 10**6)  # a loop has at most two million iterations
    side = round((count / loops) ** 0.5)
    body = f"""\
for i in 0..{side}, j in 0..{side} {{
  if (i + j) % 2 == 0 {{
    ball.scale(0.1, 0.2, 0.3).rotate_x(1deg * i).translate(0, 1, 0).rotate_y(j * 1deg)
      .translate(i, 0, j)
  }} else {{
    ball.scale(0.5).rotate_z(2deg * j).rotate_y(1deg * i).translate(0, 2, 0).translate(i, 0, j)
  }}
}}
"""
    return "let ball = sphere()\n" + body * loops


def lines(count: int) -> str:
    """So many statements, all different."""
    return "".join(
        f"sphere(radius: {1 + i / 7:.6g}).rotate_y({i}deg).translate({i}, {i % 7}, 3 + {i})\n"
        for i in range(count)
    )


PROGRAMS: dict[str, Callable[[int], str]] = {"loop": loop, "lines": lines}


def measure(program: str, count: int) -> Used:
    """Compile one program of `PROGRAMS`."""
    from dataclasses import replace

    from compiler.compilation import compile_text
    from dsl.budget import DEFAULT_LIMITS

    limits = replace(DEFAULT_LIMITS, nodes=2 * 10**7, steps=10**8)
    text = PROGRAMS[program](count)
    wall, cpu = time.perf_counter(), time.process_time()
    ir = compile_text(text, limits=limits).ir
    figures = time.perf_counter() - wall, time.process_time() - cpu
    assert abs(len(ir.instance_target) / count - 1) < 0.03
    return Used(*figures, 1024 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)


def apart(program: str, count: int, repeat: int = 3) -> Used:
    """The least figures of several processes."""
    words = [sys.executable, "-m", "benchmarks.compile", program, str(count)]
    runs = []
    for _ in range(repeat):
        answer = subprocess.run(words, capture_output=True, text=True, check=True).stdout.split()
        runs.append(Used(float(answer[0]), float(answer[1]), int(answer[2])))
    return Used(*map(min, zip(*runs, strict=True)))


def empty_check() -> Used:
    """The whole process `ovolo check` of an empty file."""
    import tempfile

    with tempfile.NamedTemporaryFile(suffix=".ovo") as file:
        runs = [ovolo("check", file.name) for _ in range(10)]
    return Used(*map(min, zip(*runs, strict=True)))


def plot(counts: list[int], figures: list[Used]) -> None:
    """Draw seconds over instances, and the line on which they would be proportional."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    seconds = [each.cpu for each in figures]
    million = seconds[counts.index(10**6)]
    figure, axes = pyplot.subplots(figsize=(6.4, 3.6), dpi=100)
    axes.loglog(counts, [million * count / 1e6 for count in counts], "--", label="proportional")
    axes.loglog(counts, seconds, "o-", label="text to IR")
    axes.set_xlabel("instances of a double loop")
    axes.set_ylabel("CPU seconds")
    axes.grid(alpha=0.3)
    axes.legend()
    figure.tight_layout()
    figure.savefig(PLOT)


def row(name: str, figures: Used) -> str:
    """A row of the table."""
    return f"| {name} | {figures.wall:.3g} s | {figures.cpu:.3g} s | {figures.peak / 1e6:,.0f} MB |"


def main() -> None:
    """Print the table and draw the plot; with a program and a count, the figures of that one."""
    if sys.argv[1:]:
        print(*measure(sys.argv[1], int(sys.argv[2])))
        return
    print("| program | wall | CPU | peak memory |\n|---|---|---|---|", flush=True)
    figures = []
    for count in GROWTH:
        figures.append(apart("loop", count, 3 if count < 10**7 else 1))
        print(row(f"{count:,} instances in a double loop", figures[-1]), flush=True)
    for count in (10**3, 10**4):
        print(row(f"{count:,} different statements", apart("lines", count)), flush=True)
    print(row("`ovolo check` of an empty file, the whole process", empty_check()), flush=True)
    plot(list(GROWTH), figures)


if __name__ == "__main__":
    main()
