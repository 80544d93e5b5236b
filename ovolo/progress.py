"""The progress of a render, where somebody is watching."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager

Progress = Callable[[float, int], object]


@contextmanager
def progress_bar(wanted: bool = True) -> Iterator[Progress | None]:
    """A bar with rays per second and the time left, on a terminal; elsewhere nothing."""
    if not wanted or not sys.stderr.isatty():
        yield None
        return
    from rich.console import Console
    from rich.progress import (
        BarColumn,
        TaskProgressColumn,
        TextColumn,
        TimeElapsedColumn,
        TimeRemainingColumn,
    )
    from rich.progress import Progress as Bar

    columns = (
        BarColumn(),
        TaskProgressColumn(),
        TextColumn("{task.fields[rate]}"),
        TimeElapsedColumn(),
        TextColumn("left:"),
        TimeRemainingColumn(),
    )
    with Bar(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task("", total=1.0, rate="")

        def update(done: float, rays: int) -> None:
            elapsed = bar.tasks[0].elapsed
            rate = f"{rays / elapsed / 1e6:.1f} Mrays/s" if elapsed else ""
            bar.update(task, completed=done, rate=rate)

        yield update
