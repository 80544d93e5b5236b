"""`python -m benchmarks.plot`: the latest record as `docs/performance.svg`."""

from __future__ import annotations

import sys
from pathlib import Path

from benchmarks.record import RECORDS, Figure, commit, read

PICTURE = Path(__file__).parents[1] / "docs" / "performance.svg"
COLORS = {"ovolo float32": "#1f77b4", "ovolo float64": "#9ec9e8", "embree": "#c0c0c0"}


def main() -> None:
    """Bars of the rates, ours beside Embree's, from the file named or the newest."""
    path = Path(sys.argv[1]) if sys.argv[1:] else max(RECORDS.glob("*.csv"))
    figures = [figure for figure in read(path) if figure.unit == "Mrays/s"]
    draw([figure for figure in figures if "^" not in figure.scene], PICTURE)
    print(f"{PICTURE}, of {path.name} at {commit()}")


def draw(figures: list[Figure], path: Path) -> None:
    """A row of bars for each scene and kind of query."""
    import matplotlib

    matplotlib.use("svg")
    matplotlib.rcParams["svg.hashsalt"] = "ovolo"
    from matplotlib import pyplot

    rows = list(dict.fromkeys((figure.scene, figure.work) for figure in figures))
    picture, axes = pyplot.subplots(figsize=(8, 0.34 * len(rows) + 1))
    for place, (who, color) in enumerate(COLORS.items()):
        rates = {(f.scene, f.work): f.value for f in figures if f.who == who}
        at = [i + 0.27 * (place - 1) for i, row in enumerate(rows) if row in rates]
        lengths = [rates[row] for row in rows if row in rates]
        axes.barh(at, lengths, height=0.25, color=color, label=who)
    axes.set_yticks(range(len(rows)), [f"{scene}, {work}" for scene, work in rows], fontsize=7)
    axes.set(xscale="log", xlabel="million rays per second and thread")
    axes.invert_yaxis()
    axes.legend(fontsize=8)
    picture.tight_layout()
    picture.savefig(path, metadata={"Date": None})


if __name__ == "__main__":
    main()
