"""Kernel and interpreter say the same of random nested scenes; `benchmarks.agreement` has more."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import ovolo
from benchmarks.agreement import LIMIT, PRECISIONS, Judge, agreement
from benchmarks.random_scenes import Rays, random_rays, random_shape
from dsl.scene import Group, SceneGraph, Shape, ShapeKind
from runtime._kernel import Kernel

BOX = Shape(ShapeKind.BOX, (-1.0, -1.0, -1.0, 1.0, 1.0, 1.0, 0.25))


@pytest.mark.parametrize("first", [0, 1000, 2000])
def test_random_scenes(first: int) -> None:
    for precision, tally in agreement(range(first, first + 20), 60).items():
        assert not tally.wrong
        assert tally.hits > 300
        assert tally.undecided < 0.05 * tally.rays, precision
        assert np.concatenate(tally.errors, axis=1).max() <= LIMIT


@pytest.mark.parametrize("precision", PRECISIONS)
@pytest.mark.parametrize("kind", ShapeKind)
def test_of_two_in_the_same_place_the_first_is_hit(kind: ShapeKind, precision: str) -> None:
    rng = np.random.default_rng(4)
    for seed in range(6):
        shape = random_shape(kind, rng)
        scene = SceneGraph(Group((shape, shape)))
        rays = random_rays(scene, 100, seed)
        _, leaf, _ = Kernel(Judge(scene, "two").ir, precision).trace(*rays)
        assert set(leaf.tolist()) <= {-1, 0}


def down(*points: tuple[float, float]) -> Rays:
    """Rays along -z."""
    origins = np.array([(x, y, 5.0) for x, y in points])
    directions = np.tile([0.0, 0.0, -1.0], (len(points), 1))
    return Rays(origins, directions, np.zeros(len(points)), np.full(len(points), np.inf))


@pytest.mark.parametrize("precision", PRECISIONS)
def test_the_judge_tells_wrong_from_undecidable(precision: str) -> None:
    judge = Judge(SceneGraph(BOX), "box")
    epsilon = 2.0**-24 if precision == "float32" else 2.0**-53
    rays = down((0.2, 0.3), (1 - epsilon, 0.0), (1 + 2 * epsilon, 0.0), (1.01, 0.0), (0.9, 0.0))
    truth = judge.interpreted(rays)
    assert truth.leaf.tolist() == [0, 0, -1, -1, 0]
    miss = replace(truth, leaf=np.full(5, -1), t=np.full(5, np.inf))
    every = np.arange(5)
    hits = judge.undecidable(rays, every[truth.leaf >= 0], truth, miss, precision)
    assert hits.tolist() == [False, True, False]
    off = replace(truth, t=truth.t + 10_000 * epsilon)
    assert judge.differs(rays, truth, off, precision).tolist() == [True, False, False, False, True]
    tilted = replace(truth, normal=truth.normal + 10_000 * epsilon)
    assert judge.differs(rays, truth, tilted, precision)[0]
    traced = Kernel(judge.ir, precision).trace(
        rays.origins, rays.directions, rays.t_min, rays.t_max
    )
    assert np.array_equal(traced[1][[0, 3, 4]], truth.leaf[[0, 3, 4]])


def test_loops_that_run_in_lanes_number_their_instances_alike() -> None:
    scene = ovolo.compile(
        """
        for i in 0..40, j in 0..3 {
          if (i + j) % 2 == 0 { sphere(radius: 0.3).translate(i, j, 0) } else {
            box(size: (0.5, 0.5, 0.5)).translate(i, j, 0)
          }
        }
        for i in 0..40 { for k in 0..3 {
          sphere(radius: 0.2).translate(i, k, 5)
          box(size: (0.1, 0.1, 0.1)).translate(i, k, 7)
        } }
        """
    )
    i, j = (a.ravel() for a in np.meshgrid(np.arange(40.0), np.arange(3.0)))
    for z in (20.0, -20.0, 6.0):
        origins = np.stack([i, j, np.full(i.size, z)], axis=1)
        directions = np.broadcast_to([0.0, 0.0, -np.sign(z)], origins.shape)
        ours = scene.tracer("float64").trace(origins, directions)
        theirs = scene.tracer("reference").trace(origins, directions)
        assert (ours.instance >= 0).all()
        np.testing.assert_array_equal(ours.instance, theirs.instance)
