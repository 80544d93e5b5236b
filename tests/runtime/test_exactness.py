"""Hits are right to a few units in every group of difficulty, judged at 110 digits."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.exact_cases import GROUPS
from benchmarks.exactness import exactness


@pytest.mark.parametrize("group", GROUPS)
def test_hits_are_right_to_a_few_units(group: str) -> None:
    for tally in exactness(group, cases=2, rays=4).values():
        assert tally.wrong == []
        assert tally.rays > 0
        assert np.median(tally.units or 0.0) < 0.5
        assert max(tally.units, default=0.0) < 16
        assert max(tally.normals, default=0.0) < 16
