"""The collector's thresholds while scenes are compiled, by one thread and by several."""

from __future__ import annotations

import gc
from concurrent.futures import ThreadPoolExecutor
from threading import Barrier

from dsl.garbage import seldom_collecting


def test_overlapping_threads_leave_the_thresholds_as_they_were() -> None:
    before = gc.get_threshold()
    entered, left = Barrier(2), Barrier(2)

    def first() -> None:
        with seldom_collecting():
            entered.wait()
        left.wait()

    def second() -> int:
        with seldom_collecting():
            entered.wait()
            left.wait()
            return gc.get_threshold()[0]

    with ThreadPoolExecutor(2) as pool:
        pool.submit(first)
        assert pool.submit(second).result() > before[0]
    assert gc.get_threshold() == before
