"""What a benchmark finds, and the dated files that keep it."""

from __future__ import annotations

import csv
import datetime
import platform
import subprocess
from collections.abc import Iterable
from dataclasses import dataclass, fields
from pathlib import Path

RECORDS = Path(__file__).parent / "records"


@dataclass(frozen=True, slots=True)
class Figure:
    """One measurement: of `who`, doing `work` in `scene`; `unit` is Mrays/s, s or bytes.

    Rates and seconds are of CPU time over threads, so that a machine shared with others does not
    blur them. `ratio` is how many times better ours is than the best peer in the same run.
    """

    scene: str
    work: str
    who: str
    threads: int
    value: float
    unit: str
    ratio: float | None = None

    def __str__(self) -> str:
        value = f"{self.value:.4g}" if self.value < 1000 else f"{self.value:,.0f}"
        ratio = "" if self.ratio is None else f"   {self.ratio:.2f} × the best peer"
        return f"{self.scene:16} {self.work:18} {self.who:16} {value:>10} {self.unit:8}{ratio}"


def write(figures: Iterable[Figure]) -> Path:
    """A CSV of the figures, with the machine, the commit and the date."""
    RECORDS.mkdir(exist_ok=True)
    date = datetime.datetime.now(datetime.UTC)
    path = RECORDS / f"{date:%Y-%m-%d-%H%M}-{commit()}.csv"
    with path.open("w", newline="") as file:
        table = csv.writer(file)
        names = [field.name for field in fields(Figure)]
        table.writerow(["machine", "commit", "date", *names])
        for figure in figures:
            values = ("" if (v := getattr(figure, name)) is None else v for name in names)
            table.writerow([processor(), commit(), f"{date:%Y-%m-%d}", *values])
    return path


def read(path: Path) -> list[Figure]:
    """The figures of a file."""
    with path.open(newline="") as file:
        return [
            Figure(
                row["scene"],
                row["work"],
                row["who"],
                int(row["threads"]),
                float(row["value"]),
                row["unit"],
                float(row["ratio"]) if row["ratio"] else None,
            )
            for row in csv.DictReader(file)
        ]


def commit() -> str:
    """The short hash of what is checked out."""
    command = ["git", "rev-parse", "--short", "HEAD"]
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout.strip()


def processor() -> str:
    """The name of the CPU."""
    for line in Path("/proc/cpuinfo").read_text().splitlines():
        if line.startswith("model name"):
            return line.partition(":")[2].strip()
    return platform.processor()
