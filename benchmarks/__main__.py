"""`python -m benchmarks`: speed beside the peers, as a table and a dated record.

`rates` of rays given as arrays, `frames`, and `growth` with the number of instances.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from typing import get_args

from benchmarks import embree, frames, growth, rates
from benchmarks.record import Figure, write
from dsl.scene import Precision

PARTS = ("rates", "frames", "growth")


def main() -> None:
    """Measure, print each figure as it comes, and write them to `benchmarks/records`."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks", description=__doc__)
    parser.add_argument("parts", nargs="*", help="of " + ", ".join(PARTS), default=PARTS)
    names = [load.name for load in rates.WORKLOADS]
    parser.add_argument("--scene", choices=names, action="append", help="of the rates")
    parser.add_argument("--precision", choices=get_args(Precision), action="append")
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--repeat", type=int, default=3)
    parser.add_argument("--rays", type=int, default=rates.RAYS, help="rays of a batch")
    parser.add_argument("--largest", type=int, default=7, help="exponent where growth ends")
    parser.add_argument("--record", action="store_true", help="write the figures to a dated file")
    given = parser.parse_args()
    if unknown := set(given.parts) - set(PARTS):
        parser.error(f"no part {', '.join(unknown)}: there are {', '.join(PARTS)}")
    if embree.driver() is None:
        print("no Embree beside us: it needs a C++ compiler and libembree-dev")
    figures: list[Figure] = []
    for figure in measured(given):
        print(figure, flush=True)
        figures.append(figure)
    if given.record:
        print(f"written to {write(figures)}")


def measured(given: argparse.Namespace) -> Iterator[Figure]:
    """The figures asked for, as they come."""
    precisions: list[Precision] = given.precision or list(get_args(Precision))
    threads, repeat = given.threads, given.repeat
    if "rates" in given.parts:
        loads = [w for w in rates.WORKLOADS if not given.scene or w.name in given.scene]
        yield from rates.measure(loads, precisions, threads, repeat, given.rays)
    if "frames" in given.parts:
        for precision in precisions:
            yield from frames.measure(precision, threads, repeat)
        yield from frames.processes(repeat)
    if "growth" in given.parts:
        yield from growth.measure(precisions[0], threads, given.largest)


if __name__ == "__main__":
    main()
