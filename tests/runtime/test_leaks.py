"""No ray leaves a closed scene, however it is scaled and wherever it is."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.leaks import PLACES, SCENES, Closed, bounce
from compiler.flatten import flatten
from dsl.scene import Precision, SceneGraph, Shape, ShapeKind
from runtime.reference import ReferenceTracer
from runtime.tracer import Tracer

RAYS = 50_000


@pytest.mark.parametrize("precision", ["float32", "float64"])
@pytest.mark.parametrize("closed", SCENES, ids=lambda closed: closed.name)
def test_nothing_leaks(closed: Closed, precision: Precision) -> None:
    for seed, place in enumerate(PLACES):
        leaks = bounce(closed, place, precision, RAYS, seed)
        assert (leaks.escaped, leaks.crossed) == (0, 0), place


@pytest.mark.parametrize(
    "shape",
    [
        Shape(ShapeKind.RING, (0.6, 1.0, -0.3, 0.4, 0.1)),
        Shape(ShapeKind.WEDGE, (0.6, 1.0, -0.3, 0.4, 0.0, 300.0, 0.1)),
        Shape(ShapeKind.CYLINDER, (1.0, -0.3, 0.4, 0.1)),
    ],
    ids=lambda shape: shape.kind.value,
)
def test_rays_that_start_just_within_a_wall_and_graze_it_come_out(shape: Shape) -> None:
    """Kernel and interpreter agree on where, although plain and bevelled wall are one there."""
    rng = np.random.default_rng(0)
    n = 400
    turn, tilt = rng.uniform(1, 4, n), rng.uniform(0, 2 * np.pi, n)
    sink = rng.uniform(-0.02, 0.02, n)
    zero = np.zeros(n)
    outward = np.stack([np.sin(turn), zero, np.cos(turn)], 1)
    around = np.stack([np.cos(turn), zero, -np.sin(turn)], 1)
    directions = np.cos(tilt)[:, None] * around - sink[:, None] * outward
    directions[:, 1] = np.sin(tilt)
    origins = outward * (1 - 4e-15)
    origins[:, 1] = rng.uniform(-0.15, 0.25, n)
    graph = SceneGraph(shape)
    ir = flatten(graph, lambda file: (None, [])).ir
    assert ir is not None
    found = Tracer(ir).trace(origins, directions)
    truth = Tracer.over(ReferenceTracer(graph, number="longdouble")).trace(origins, directions)
    assert found.hit.all()
    assert truth.hit.all()
    np.testing.assert_allclose(found.t, truth.t, rtol=1e-9, atol=2e-11)
