"""Columns of integers that grow, one by one or by many at once."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

Integers = NDArray[np.signedinteger[Any]]


class Column:
    """int32 numbers in one piece of memory, which is made for `room` of them.

    Room that is never used costs no memory; growing beyond it leaves holes in the heap.
    """

    __slots__ = ("_count", "_held", "_last", "append")

    def __init__(self, room: int = 0) -> None:
        self._held = np.empty(max(room, 8), dtype=np.int32)
        self._count = 0
        self._last: list[int] = []  # those that came one by one, which NumPy would take longer for
        self.append = self._last.append
        """Put one at the end."""

    def __len__(self) -> int:
        return self._count + len(self._last)

    @property
    def numbers(self) -> NDArray[np.int32]:
        """All of them, to be read and changed in place, but not while the column grows."""
        self._gather()
        return self._held[: self._count]

    def extend(self, numbers: Integers | int, count: int) -> None:
        """Put `count` at the end, or `count` times the same."""
        self._gather()
        self._put(numbers, count)

    def _gather(self) -> None:
        if self._last:
            self._put(np.array(self._last, dtype=np.int32), len(self._last))
            self._last.clear()

    def _put(self, numbers: Integers | int, count: int) -> None:
        end = self._count + count
        if end > len(self._held):
            self._grow(end)
        self._held[self._count : end] = numbers
        self._count = end

    def _grow(self, least: int) -> None:
        held = np.empty(max(least, 2 * len(self._held)), dtype=np.int32)
        held[: self._count] = self._held[: self._count]
        self._held = held
