"""All widths of lanes answer alike, to the bit: shapes of every kind, levels, coherent and not."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.random_scenes import random_rays, random_scene
from compiler.flatten import flatten
from dsl.scene import Precision
from runtime._kernel import instruction_sets
from runtime.tracer import Tracer


@pytest.mark.parametrize("precision", ["float32", "float64"])
@pytest.mark.parametrize("isa", instruction_sets()[1:])
def test_random_scenes_look_alike_on_every_instruction_set(isa: str, precision: Precision) -> None:
    for seed in range(40):
        graph = random_scene(seed)
        ir = flatten(graph, lambda file: (None, [])).ir
        assert ir is not None
        best, other = Tracer(ir, precision), Tracer(ir, precision, isa)
        rays = random_rays(graph, 64, seed)
        origin, target = rays.origins[0], rays.origins[:1] + rays.directions[:1]
        fan = target + np.linspace(-0.02, 0.02, 64)[:, None] * rays.directions[1] - origin
        for batch in (tuple(rays), (origin, fan)):
            one, two = best.trace(*batch), other.trace(*batch)
            for name in ("t", "instance", "position", "normal", "material", "offset"):
                message = f"scene {seed}, {name}"
                np.testing.assert_array_equal(getattr(one, name), getattr(two, name), message)
            np.testing.assert_array_equal(best.occluded(*batch), one.hit, f"scene {seed}")
            np.testing.assert_array_equal(other.occluded(*batch), two.hit, f"scene {seed}")
