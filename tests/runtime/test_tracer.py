"""Batches of rays: what shapes are taken, what comes back."""

from __future__ import annotations

import pickle
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from compiler.flatten import flatten
from dsl.scene import SceneGraph, Shape, ShapeKind
from runtime.tracer import Hits, Surface, Tracer

FloatArray = NDArray[np.float64]


class Recorder:
    """A backend that keeps what it is given and misses with every ray."""

    def __init__(self) -> None:
        self.rays: tuple[FloatArray, ...] = ()

    def trace(
        self,
        origins: FloatArray,
        directions: FloatArray,
        t_min: FloatArray,
        t_max: FloatArray,
    ) -> Any:
        self.rays = (origins, directions, t_min, t_max)
        n = len(origins)
        numbers = np.full(n, -1, np.int32)
        nowhere = np.full((n, 3), np.nan)
        return np.full(n, np.inf), nowhere, nowhere, numbers.astype(np.int64), numbers, numbers

    def occluded(
        self,
        origins: FloatArray,
        directions: FloatArray,
        t_min: FloatArray,
        t_max: FloatArray,
    ) -> NDArray[np.bool_]:
        self.rays = (origins, directions, t_min, t_max)
        return np.zeros(len(origins), np.bool_)


@pytest.mark.parametrize("method", ["trace", "occluded"])
@pytest.mark.parametrize(
    ("origins", "directions", "count"),
    [
        (np.zeros((5, 3)), np.ones((5, 3)), 5),
        ([0, 0, 0], np.ones((5, 3)), 5),
        (np.zeros((5, 3)), (0, 0, 1), 5),
        ((0, 0, 0), (0, 0, 1), 1),
        (np.zeros((0, 3)), np.zeros((0, 3)), 0),
        ((0, 0, 0), np.zeros((0, 3)), 0),
        (np.zeros((4, 6), np.float32)[::2, ::2], np.ones((2, 3), np.int8), 2),
        (np.asfortranarray(np.zeros((4, 3))), np.ones((4, 3), ">f8"), 4),
    ],
)
def test_rays_reach_the_backend_as_it_wants_them(
    method: str, origins: Any, directions: Any, count: int
) -> None:
    backend = Recorder()
    answer = getattr(Tracer.over(backend), method)(origins, directions)
    assert len(answer) == count
    points, vectors, t_min, t_max = backend.rays
    assert points.shape == vectors.shape == (count, 3)
    assert t_min.shape == t_max.shape == (1,)
    assert (t_min[0], t_max[0]) == (0.0, np.inf)
    for array in backend.rays:
        assert array.dtype == np.dtype("=f8")
        assert array.flags.c_contiguous
    assert np.array_equal(points, np.broadcast_to(np.asarray(origins), (count, 3)))
    assert np.array_equal(vectors, np.broadcast_to(np.asarray(directions), (count, 3)))


def test_bounds_may_differ_from_ray_to_ray() -> None:
    backend = Recorder()
    Tracer.over(backend).trace(np.zeros((2, 3)), (0, 0, 1), t_min=[1, 2], t_max=np.float32(9))
    assert [bound.tolist() for bound in backend.rays[2:]] == [[1.0, 2.0], [9.0]]


@pytest.mark.parametrize(
    ("rays", "words"),
    [
        ((np.zeros((5, 2)), np.zeros((5, 3))), r"origins .* \(5, 2\)"),
        ((np.zeros((5, 3)), np.zeros(4)), r"directions .* \(4,\)"),
        ((np.zeros((5, 3)), np.zeros((4, 3))), r"origins \(5, 3\) and directions \(4, 3\)"),
        ((np.zeros((1, 5, 3)), (0, 0, 1)), r"origins .* \(1, 5, 3\)"),
        ((0.0, (0, 0, 1)), r"origins .* \(\)"),
        (("north", (0, 0, 1)), "origins .* real numbers"),
        ((None, (0, 0, 1)), "origins .* real numbers"),
        ((np.zeros((2, 3)), np.zeros((2, 3)) + 1j), "directions .* real numbers, not complex128"),
        (([[0, 0, 0], [0, 0]], (0, 0, 1)), "origins .* array of numbers"),
        ((np.zeros((5, 3)), (0, 0, 1), np.zeros(4)), r"t_min .* \(5,\), not \(4,\)"),
        ((np.zeros((5, 3)), (0, 0, 1), 0.0, np.zeros((5, 1))), r"t_max .* not \(5, 1\)"),
    ],
)
def test_rays_of_another_form_are_refused_by_name(rays: tuple[Any, ...], words: str) -> None:
    tracer = Tracer.over(Recorder())
    for method in (tracer.trace, tracer.occluded):
        with pytest.raises(ValueError, match=words):
            method(*rays)


def test_hits_say_how_many_there_are() -> None:
    nowhere = np.zeros((3, 3))
    numbers = np.array([-1, 7, 4], np.int32)
    t = np.array([np.inf, 2.0, 0.5])
    surface = Surface(nowhere, nowhere, numbers, numbers, t)
    hits = Hits(t, numbers.astype(np.int64), lambda: surface)
    assert len(hits) == 3
    assert hits.hit.tolist() == [False, True, True]
    assert repr(hits) == "Hits(3 rays, 2 hit, t from 0.5 to 2)"
    missed = Tracer.over(Recorder()).trace(np.zeros((2, 3)), (0, 0, 1))
    assert repr(missed) == "Hits(2 rays, all missed)"


def test_surfaces_are_of_the_rays_as_they_were_traced() -> None:
    pytest.importorskip("runtime._kernel")
    ir = flatten(SceneGraph(Shape(ShapeKind.SPHERE, (1.0,))), lambda file: (None, [])).ir
    assert ir is not None
    origins, directions = np.array([[0.0, 0.0, 9.0]]), np.array([[0.0, 0.0, -1.0]])
    hits = Tracer(ir).trace(origins, directions)
    origins[:], directions[:] = 5.0, np.nan
    assert np.array_equal(hits.position, [[0.0, 0.0, 1.0]])
    again = pickle.loads(pickle.dumps(hits))
    assert np.array_equal(again.normal, [[0.0, 0.0, 1.0]])
    assert again.instance.tolist() == hits.instance.tolist() == [0]
