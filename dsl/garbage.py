"""Garbage collection while trees are made."""

from __future__ import annotations

import gc
from collections.abc import Iterator
from contextlib import contextmanager
from threading import Lock

_lock = Lock()
_inside = 0
_thresholds = gc.get_threshold()


@contextmanager
def seldom_collecting() -> Iterator[None]:
    """Look for garbage less often: trees of syntax and of scenes are large, acyclic, and stay.

    Several threads may be inside; the last to leave restores what the first has found.
    """
    global _inside, _thresholds
    with _lock:
        if not _inside:
            _thresholds = gc.get_threshold()
            gc.set_threshold(max(100_000, _thresholds[0]), 20, 100)
        _inside += 1
    try:
        yield
    finally:
        with _lock:
            _inside -= 1
            if not _inside:
                gc.set_threshold(*_thresholds)
