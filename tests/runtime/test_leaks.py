"""No ray leaves a closed scene, however it is scaled and wherever it is."""

from __future__ import annotations

import pytest

from benchmarks.leaks import PLACES, SCENES, Closed, bounce
from dsl.scene import Precision

RAYS = 50_000


@pytest.mark.parametrize("precision", ["float32", "float64"])
@pytest.mark.parametrize("closed", SCENES, ids=lambda closed: closed.name)
def test_nothing_leaks(closed: Closed, precision: Precision) -> None:
    for seed, place in enumerate(PLACES):
        leaks = bounce(closed, place, precision, RAYS, seed)
        assert (leaks.escaped, leaks.crossed) == (0, 0), place
