"""`python -m benchmarks`: ray rates beside the peers, as a table and a dated record."""

from __future__ import annotations

import argparse
import csv
import datetime
import platform
import subprocess
from pathlib import Path
from typing import get_args

from benchmarks.rates import RAYS, WORKLOADS, Rate, measure
from dsl.scene import Precision

RECORD = Path(__file__).parent / "record"


def main() -> None:
    """Measure, print each figure as it comes, and write them to `benchmarks/record`."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks", description=__doc__)
    parser.add_argument("scenes", nargs="*", help="of " + ", ".join(w.name for w in WORKLOADS))
    parser.add_argument("--precision", choices=get_args(Precision), action="append")
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--repeat", type=int, default=3)
    parser.add_argument("--rays", type=int, default=RAYS, help="rays of a batch")
    parser.add_argument("--record", action="store_true", help="write the figures to a dated file")
    given = parser.parse_args()
    chosen = [w for w in WORKLOADS if not given.scenes or w.name in given.scenes]
    rates: list[Rate] = []
    for precision in given.precision or get_args(Precision):
        for rate in measure(chosen, precision, given.threads, given.repeat, given.rays):
            print(
                f"{rate.scene:13} {rate.rays:7} {rate.query:8} {rate.who:15} "
                f"{rate.threads} thread(s) {rate.mrays:8.2f} Mrays/s {rate.hits:9} hits",
                flush=True,
            )
            rates.append(rate)
    if given.record:
        print(f"written to {write(rates)}")


def write(rates: list[Rate]) -> Path:
    """A CSV of the figures, with the machine and the commit in its name and first columns."""
    RECORD.mkdir(exist_ok=True)
    commit = subprocess.run(
        ["git", "rev-parse", "--short", "HEAD"], capture_output=True, text=True, check=True
    ).stdout.strip()
    machine = _processor()
    path = RECORD / f"{datetime.date.today()}-{commit}.csv"
    with path.open("w", newline="") as file:
        table = csv.writer(file)
        table.writerow(["machine", "commit", *Rate.__dataclass_fields__])
        for rate in rates:
            values = (getattr(rate, name) for name in Rate.__dataclass_fields__)
            table.writerow([machine, commit, *values])
    return path


def _processor() -> str:
    """The name of the CPU."""
    for line in Path("/proc/cpuinfo").read_text().splitlines():
        if line.startswith("model name"):
            return line.partition(":")[2].strip()
    return platform.processor()


if __name__ == "__main__":
    main()
