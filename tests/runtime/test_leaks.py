"""No ray leaves a closed scene, however it is scaled and wherever it is."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.leaks import PLACES, SCENES, Closed, bounce
from benchmarks.rates import prepared
from compiler.flatten import flatten
from dsl.scene import (
    Instances,
    Precision,
    SceneGraph,
    Shape,
    ShapeKind,
    Step,
    StepKind,
    Transform,
)
from runtime.reference import ReferenceTracer
from runtime.tracer import Tracer

RAYS = 50_000


@pytest.mark.parametrize("precision", ["float32", "float64"])
@pytest.mark.parametrize("closed", SCENES, ids=lambda closed: closed.name)
def test_nothing_leaks(closed: Closed, precision: Precision) -> None:
    for seed, place in enumerate(PLACES):
        leaks = bounce(closed, place, precision, RAYS, seed)
        assert (leaks.escaped, leaks.crossed) == (0, 0), place


def test_rays_that_meet_the_seam_of_touching_solids_go_on_in_the_open() -> None:
    """Not within the neighbour of the solid whose side they met in the seam.

    Where the rounding of transforms leaves a gap, rays along it get further in than a point may be
    moved: some in ten thousand of rays aimed at seams to the last bits.
    """
    wedge = Shape(ShapeKind.WEDGE, (0.6, 0.8, 0.0, 0.5, 0.0, 45.0, 0.0))
    turns = Step(StepKind.ROTATE, np.array([[0, 1, 0, 45.0 * i] for i in range(8)]))
    tracer = prepared(SceneGraph(Instances(wedge, Transform((turns,)))), "float32")
    rng = np.random.default_rng(0)
    n = 100_000
    phi = np.radians(45 * rng.integers(0, 8, n)) + rng.uniform(-2e-7, 2e-7, n)
    seams = np.stack([0.6 * np.sin(phi), rng.uniform(0.1, 0.4, n), 0.6 * np.cos(phi)], 1)
    turn, radius = rng.uniform(0, 2 * np.pi, n), 0.6 * np.sqrt(rng.uniform(0, 0.99, n))
    origins = np.stack([radius * np.sin(turn), rng.uniform(0, 0.5, n), radius * np.cos(turn)], 1)
    directions = seams - origins
    hits = tracer.trace(origins, directions)
    onward = rng.normal(size=(n, 3))
    onward *= np.sign(np.einsum("ij,ij->i", onward, hits.normal))[:, None]
    nearby = tracer.trace(hits.spawn(onward), onward)
    facing = np.einsum("ij,ij->i", onward, nearby.normal)
    inside = nearby.hit & (facing > 1e-3 * np.linalg.norm(onward, axis=1))
    assert hits.hit.all()
    assert inside.mean() < 1e-3


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
