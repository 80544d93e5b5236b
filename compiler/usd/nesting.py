"""How deep the text of a layer nests: usd-core reads it by recursion, and crashes where that ends.

Brackets are counted wherever they stand, in strings and comments too: what counts as too deep is
far more than any text needs. Crate files and packages are not looked at.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

DEEPEST = 5000
"""Levels of brackets that are read; usd-core crashes at some tens of thousands."""

_MAGIC = b"#usda"
_BLOCK = 1 << 22

_STEPS = np.zeros(256, dtype=np.int8)
_STEPS[list(b"([{")] = 1
_STEPS[list(b")]}")] = -1


def nests_too_deep(path: str) -> bool:
    """Whether a file is USD's text and nests deeper than `DEEPEST`; False where it is no file."""
    try:
        with Path(path).open("rb") as file:
            if file.read(len(_MAGIC)) != _MAGIC:
                return False
            level = 0
            while block := file.read(_BLOCK):
                # Most blocks cannot get that deep, and need no sum.
                opened = sum(block.count(bracket) for bracket in (b"(", b"[", b"{"))
                closed = sum(block.count(bracket) for bracket in (b")", b"]", b"}"))
                if level + opened > DEEPEST:
                    steps = _STEPS[np.frombuffer(block, dtype=np.uint8)]
                    if level + int(np.cumsum(steps, dtype=np.int32).max()) > DEEPEST:
                        return True
                level += opened - closed
    except (OSError, ValueError):
        return False  # who opens it says so
    return False
