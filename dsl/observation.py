"""What making a scene takes and what it reads, for those who watch it being made."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, field
from pathlib import Path
from time import perf_counter

Stamp = tuple[int, int] | None
"""When a file was last written, in nanoseconds, and its size; None for one that does not exist."""


@dataclass(slots=True)
class Observation:
    """Seconds by stage, in the order in which stages end, and the files asked for.

    A stage inside another counts for itself alone. Files have the stamp of when they were first
    asked for.
    """

    seconds: dict[str, float] = field(default_factory=dict)
    files: dict[Path, Stamp] = field(default_factory=dict)
    inner: float = 0.0
    """Seconds of the stages inside the current one."""


_current: ContextVar[Observation | None] = ContextVar("observation", default=None)


@contextmanager
def observe() -> Iterator[Observation]:
    """Watch what this thread does from here on."""
    observation = Observation()
    token = _current.set(observation)
    try:
        yield observation
    finally:
        _current.reset(token)


@contextmanager
def stage(name: str) -> Iterator[None]:
    """What is done inside is a stage of that name."""
    observation = _current.get()
    if observation is None:
        yield
        return
    start, outer = perf_counter(), observation.inner
    observation.inner = 0.0
    try:
        yield
    finally:
        spent = perf_counter() - start
        own = spent - observation.inner
        observation.seconds[name] = observation.seconds.get(name, 0.0) + own
        observation.inner = outer + spent


def asked_for(path: Path) -> None:
    """A file is looked for."""
    observation = _current.get()
    if observation is not None and path not in observation.files:
        observation.files[path] = stamp(path)


def stamp(path: Path) -> Stamp:
    """What tells whether a file has changed."""
    try:
        status = path.stat()
    except OSError:
        return None
    return status.st_mtime_ns, status.st_size
