"""Garbage collection while trees are made."""

from __future__ import annotations

import gc
from collections.abc import Iterator
from contextlib import contextmanager
from threading import Lock

_OBJECTS = 2_000_000
"""So many more objects than were freed, of some 100 bytes each, are looked through at once."""
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
            gc.set_threshold(max(_OBJECTS, _thresholds[0]), 20, 100)
        _inside += 1
    try:
        yield
    finally:
        with _lock:
            _inside -= 1
            if not _inside:
                gc.set_threshold(*_thresholds)
