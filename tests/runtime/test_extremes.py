"""Neither scale nor distance from the origin costs a pixel, in either precision."""

from __future__ import annotations

from typing import Literal

import pytest

from benchmarks import extremes
from dsl.scene import Precision


@pytest.mark.parametrize("precision", ["float32", "float64"])
@pytest.mark.parametrize(
    ("kind", "value"),
    [*(("scale", s) for s in extremes.SCALES), *(("shift", s) for s in extremes.SHIFTS)],
)
def test_a_sphere_has_the_same_silhouette_anywhere(
    kind: Literal["scale", "shift"], value: float, precision: Precision
) -> None:
    found = extremes.picture(kind, value, precision)
    assert found.hits > 15_000
    assert found.wrong == 0
    assert found.error < (1e-6 if precision == "float32" else 1e-14)
