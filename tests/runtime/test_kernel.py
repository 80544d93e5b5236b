"""The kernel through its Python face, on scenes built by hand."""

from __future__ import annotations

import dataclasses
import itertools
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from compiler.ir import SceneIR
from runtime import _kernel
from tests.runtime.flat_scenes import (
    PRECISIONS,
    TOLERANCE,
    Builder,
    rays,
    rotation,
    scaling,
    trace,
    translation,
)


@pytest.fixture(params=PRECISIONS)
def precision(request: pytest.FixtureRequest) -> str:
    """Either precision."""
    return str(request.param)


def test_instruction_sets_end_with_the_portable_one() -> None:
    names = _kernel.instruction_sets()
    assert names[-1] == "portable"
    kernel = _kernel.Kernel(Builder().build(), "float32")
    assert kernel.isa == names[0]
    with pytest.raises(ValueError, match="instruction set"):
        _kernel.Kernel(Builder().build(), "float32", "mmx")
    with pytest.raises(ValueError, match="float16"):
        _kernel.Kernel(Builder().build(), "float16")


def test_an_empty_scene_is_missed(precision: str) -> None:
    kernel = _kernel.Kernel(Builder().build(), precision)
    hits = trace(kernel, [0, 0, 5], [[0, 0, -1]] * 20)
    assert np.all(np.isinf(hits.t))
    assert np.all(np.isnan(hits.normal))
    assert np.all(np.isnan(hits.position))
    for indices in (hits.instance, hits.prototype, hits.material):
        assert np.all(indices == -1)
    assert kernel.bounds[0, 0] > kernel.bounds[1, 0]
    none = trace(kernel, np.zeros((0, 3)), np.zeros((0, 3)))
    assert len(none.t) == 0


def test_a_sphere_is_hit_from_outside_and_inside(precision: str) -> None:
    builder = Builder()
    builder.place(builder.shape("sphere", 2.0), translation(1, 0, 0), material=3)
    kernel = _kernel.Kernel(builder.build(), precision)
    hits = trace(kernel, [[1, 0, 10], [1, 0, 0]], [[0, 0, -2], [0, 0, -2]])
    np.testing.assert_allclose(hits.t, [4.0, 1.0], rtol=TOLERANCE[precision])
    np.testing.assert_allclose(hits.position, [[1, 0, 2], [1, 0, -2]], atol=1e-6)
    np.testing.assert_allclose(hits.normal, [[0, 0, 1], [0, 0, -1]], atol=1e-6)
    assert hits.material.tolist() == [3, 3]
    np.testing.assert_allclose(kernel.bounds, [[-1, -2, -2], [3, 2, 2]], rtol=1e-12)


def test_intervals_are_open_and_per_ray(precision: str) -> None:
    builder = Builder()
    builder.place(builder.shape("sphere", 1.0))
    kernel = _kernel.Kernel(builder.build(), precision)
    o, d = [[0, 0, 4]] * 5, [[0, 0, -1]] * 5
    hits = trace(kernel, o, d, [0, 3, 3.5, 0, -9], [9, 9, 9, 3, -1])
    assert hits.t.tolist() == [3.0, 5.0, 5.0, np.inf, np.inf]


def test_rays_that_are_no_rays_miss(precision: str) -> None:
    builder = Builder()
    builder.place(builder.shape("sphere", 1.0))
    builder.place(builder.shape("plane"))
    kernel = _kernel.Kernel(builder.build(), precision)
    o = [[0, 0, 4], [np.nan, 0, 0], [np.inf, 0, 0], [0, 0, 4], [0, 0, 4], [0, 0, 4]]
    d = [[0, 0, -1], [0, 0, -1], [0, 0, -1], [0, 0, 0], [np.nan, 0, 0], [0, np.inf, 0]]
    hits = trace(kernel, o, d)
    assert (hits.instance >= 0).tolist() == [True, False, False, False, False, False]
    hits = trace(kernel, [0, 0, 4], [0, 0, -1], [np.nan], [9])
    assert hits.instance.tolist() == [-1]


def test_materials_resolve_through_levels(precision: str) -> None:
    builder = Builder()
    sphere = builder.shape("sphere", 0.4)
    inner = builder.group()
    builder.place(sphere, translation(0, 0, 0), group=inner)  # inherits
    builder.place(sphere, translation(1, 0, 0), group=inner, material=2)  # bound
    builder.place(sphere, translation(2, 0, 0), group=inner, material=-2 - 3)  # overrides
    builder.place(~inner, translation(0, 0, 0))
    builder.place(~inner, translation(0, 1, 0), material=4)
    builder.place(~inner, translation(0, 2, 0), material=-2 - 5)
    kernel = _kernel.Kernel(builder.build(), precision)
    points = [[x, y, 5] for y in range(3) for x in range(3)]
    hits = trace(kernel, points, [0, 0, -1])
    assert hits.instance.tolist() == list(range(9))
    assert hits.material.tolist() == [0, 2, 3, 4, 2, 3, 5, 5, 5]
    assert set(hits.prototype.tolist()) == {sphere}


def test_ties_go_to_the_lowest_leaf(precision: str) -> None:
    builder = Builder()
    sphere = builder.shape("sphere", 1.0)
    for i in range(30):
        builder.place(sphere, translation(i % 3 * 3, 0, 0), material=i % 8)
    kernel = _kernel.Kernel(builder.build(), precision)
    points = [[x * 3 + dx, 0, 5] for x in range(3) for dx in np.linspace(-0.9, 0.9, 16)]
    hits = trace(kernel, points, [0, 0, -1])
    assert hits.instance.tolist() == [0] * 16 + [1] * 16 + [2] * 16


def nested_scene(rng: np.random.Generator, flat: bool) -> SceneIR:
    """Spheres and boxes in groups in groups, or the same with one level only."""
    builder = Builder()
    sphere, box = (
        builder.shape("sphere", 0.5),
        builder.shape("box", -0.4, -0.2, -0.3, 0.4, 0.2, 0.3, 0),
    )

    def affine() -> NDArray[np.float64]:
        low = rng.uniform(0.5, 1.5, 3) * rng.choice([-1, 1], 3)
        matrix = rotation(rng) @ scaling(*low)
        matrix[:3, 3] = rng.normal(size=3) * 2
        return np.asarray(matrix)

    leaves = [(prototype, affine()) for prototype in (sphere, box, sphere, box)]
    middle = [affine() for _ in range(4)]
    top = [affine() for _ in range(5)]
    if flat:
        for a in top:
            for prototype, c in leaves:
                builder.place(prototype, a @ c)
            for b, (prototype, c) in itertools.product(middle, leaves):
                builder.place(prototype, a @ b @ c)
        return builder.build()
    inner, outer = builder.group(), builder.group()
    for prototype, c in leaves:
        builder.place(prototype, c, group=inner)
        builder.place(prototype, c, group=outer)
    for b in middle:
        builder.place(~inner, b, group=outer)
    for a in top:
        builder.place(~outer, a)
    return builder.build()


def test_nesting_equals_flattening(precision: str) -> None:
    nested = _kernel.Kernel(nested_scene(np.random.default_rng(1), flat=False), precision)
    flat = _kernel.Kernel(nested_scene(np.random.default_rng(1), flat=True), precision)
    rng = np.random.default_rng(2)
    o = rng.normal(size=(3000, 3)) * 8
    d = rng.normal(size=(3000, 3)) * 2 - o
    one, other = trace(nested, o, d), trace(flat, o, d)
    assert 500 < np.count_nonzero(one.instance >= 0) < 2900
    differs = one.instance != other.instance
    assert np.count_nonzero(differs) <= 1  # a graze
    hit = (one.instance >= 0) & ~differs
    np.testing.assert_allclose(
        one.t[hit], other.t[hit], rtol=1e-4 if precision == "float32" else 1e-11
    )
    np.testing.assert_allclose(one.normal[hit], other.normal[hit], atol=1e-3)


@pytest.mark.parametrize("isa", _kernel.instruction_sets()[1:])
def test_every_instruction_set_answers_alike(precision: str, isa: str) -> None:
    ir = nested_scene(np.random.default_rng(3), flat=False)
    best, other = _kernel.Kernel(ir, precision), _kernel.Kernel(ir, precision, isa)
    rng = np.random.default_rng(4)
    o = rng.normal(size=(1, 3)) * 8
    coherent = rng.normal(size=(1, 3)) + np.linspace(-1, 1, 2000)[:, None] * rng.normal(size=3)
    scattered = rng.normal(size=(1000, 3))
    for d in (coherent - o, scattered - o):
        one, two = trace(best, o, d), trace(other, o, d, threads=2)
        for a, b in zip(dataclasses.astuple(one), dataclasses.astuple(two), strict=True):
            np.testing.assert_array_equal(a, b)


@pytest.mark.parametrize("scale", [1e-30, 1e-18, 1.0, 1e18, 1e30])
@pytest.mark.parametrize("far", [0.0, 1e6, 1e12])
def test_scale_and_place_do_not_matter(precision: str, scale: float, far: float) -> None:
    rng = np.random.default_rng(5)
    builder, plain = Builder(), Builder()
    place = np.array([far, -far, far / 3])
    for b, unit, where in ((plain, 1.0, np.zeros(3)), (builder, scale, place)):
        rng = np.random.default_rng(5)
        sphere = b.shape("sphere", 1.0)
        for center in rng.integers(-4, 5, (12, 3)):
            t = (center + where) * unit
            b.place(
                sphere,
                translation(*t) @ scaling(unit, unit, unit),
                inverse=scaling(1 / unit, 1 / unit, 1 / unit) @ translation(*-t),
            )
    o = rng.normal(size=(400, 3)) * 4 + [0, 0, 20]
    d = np.array([0, 0, -1]) + rng.normal(size=(400, 3)) * 0.1
    # Origins as they are after rounding at that place.
    start = (o + place) * scale
    exact = (start / scale) - place if far else o
    if far:
        o = exact
    here = trace(_kernel.Kernel(plain.build(), precision), o, d)
    there = trace(_kernel.Kernel(builder.build(), precision), start, d * scale)
    if far > 1e6 or (far and scale != 1.0):
        # Rounding in world space moves the objects relative to each other by an ulp of `far`.
        same = here.instance == there.instance
        assert np.mean(same) > 0.98
        np.testing.assert_allclose(there.t[same], here.t[same], rtol=1e-3)
        return
    np.testing.assert_array_equal(here.instance, there.instance)
    np.testing.assert_allclose(there.t, here.t, rtol=1e-4 if precision == "float32" else 1e-9)
    np.testing.assert_allclose(there.normal, here.normal, atol=1e-3)


def test_a_mesh_is_watertight_and_shared(precision: str) -> None:
    n = 24
    u, v = np.meshgrid(np.linspace(-1, 1, n + 1), np.linspace(-1, 1, n + 1), indexing="ij")
    points = np.stack([u, np.sin(3 * u) * np.cos(2 * v) * 0.3, v], -1).reshape(-1, 3)
    i = (np.arange(n)[:, None] * (n + 1) + np.arange(n)).ravel()
    quads = np.stack([i, i + 1, i + n + 2, i + n + 1], 1)
    triangles = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    builder = Builder()
    mesh = builder.mesh(points, triangles)
    rng = np.random.default_rng(6)
    for k in range(5):
        builder.place(mesh, translation(0, 3 * k, 0) @ scaling(1, 0.5, 1))
    kernel = _kernel.Kernel(builder.build(), precision)
    o = rng.uniform(-0.999, 0.999, (4000, 3))
    o[:, 1] = 20.0
    # Straight down, also exactly through vertices and edges.
    o[:625] = np.stack([u, np.full_like(u, 20.0), v], -1).reshape(-1, 3) * [0.999, 1, 0.999]
    hits = trace(kernel, o, [0, -1, 0])
    assert np.all(hits.instance == 4)
    np.testing.assert_array_less(0, hits.normal[:, 1])
    # Next to an edge the point keeps some units away from it.
    atol = {"float32": 8e-6, "float64": 1e-13}[precision]
    np.testing.assert_allclose(hits.position[:, [0, 2]], o[:, [0, 2]], atol=atol)


def test_zero_scale_is_never_hit(precision: str) -> None:
    builder = Builder()
    sphere = builder.shape("sphere", 1.0)
    builder.place(sphere, scaling(1, 0, 1), inverse=scaling(1, np.inf, 1))
    builder.place(sphere, scaling(0, 0, 0), inverse=np.full((4, 4), np.nan))
    builder.place(sphere, translation(0, 0, -3))
    hits = trace(_kernel.Kernel(builder.build(), precision), [0, 0, 5], [0, 0, -1])
    assert hits.instance.tolist() == [2]


def test_planes_are_hit_everywhere(precision: str) -> None:
    builder = Builder()
    builder.place(builder.shape("sphere", 1.0), translation(0, 1, 0))
    group = builder.group()
    builder.place(builder.shape("plane"), group=group)
    builder.place(~group)
    kernel = _kernel.Kernel(builder.build(), precision)
    np.testing.assert_allclose(kernel.bounds, [[-1, 0, -1], [1, 2, 1]], atol=1e-12)
    far = [[1e9, 1, 0], [-1e9, 3, 5], [0, 1e9, 7], [4, -2, 4]]
    hits = trace(kernel, far, [[0, -1, 0], [3, -4, 0], [0, -1, 0], [0, 1, 0]])
    np.testing.assert_allclose(hits.t, [1, 0.75, 1e9, 2], rtol=TOLERANCE[precision])
    assert np.all(hits.position[:, 1] == 0.0)
    assert np.all(hits.instance == 1)


def test_deep_nesting_needs_no_machine_stack(precision: str) -> None:
    depth = 20_000
    builder = Builder()
    sphere = builder.shape("sphere", 1.0)
    group = 0
    for _ in range(depth):
        inner = builder.group()
        builder.place(~inner, translation(1, 0, 0), group=group)
        group = inner
    builder.place(sphere, group=group, material=1)
    kernel = _kernel.Kernel(builder.build(), precision)
    hits = trace(kernel, [[depth, 0, 5]] * 3, [0, 0, -1])
    np.testing.assert_allclose(hits.t, 4.0, rtol=1e-6)
    assert hits.material.tolist() == [1, 1, 1]


def test_a_thousand_million_leaves_take_little_memory() -> None:
    builder = Builder()
    targets = [~builder.group(), ~builder.group(), builder.shape("sphere", 0.3)]
    for group, (target, step) in enumerate(zip(targets, (100.0, 10.0, 1.0), strict=True)):
        for cell in itertools.product(range(10), repeat=3):
            builder.place(target, translation(*(step * np.array(cell))), group=group)
    kernel = _kernel.Kernel(builder.build(), "float32")
    hits = trace(kernel, [[123, 456, 2000]] * 4, [0, 0, -1])
    # Cells are numbered x, y, z within each level; the ray comes down to z = 999.
    expected = 149 * 10**6 + 259 * 10**3 + 369
    assert hits.instance.tolist() == [expected] * 4
    np.testing.assert_allclose(hits.t, 2000 - 999 - 0.3, rtol=1e-6)
    assert kernel.nbytes < 1_000_000


HOSTILE: dict[str, dict[str, Any]] = {
    "unknown target": {"instance_target": np.array([7], np.int32)},
    "unknown target -9": {"instance_target": np.array([-9], np.int32)},
    "contains itself": {"instance_target": np.array([~0], np.int32)},
    "unknown kind": {"prototype_kind": np.array([200], np.uint8)},
    "not within": {"prototype_data": np.array([2**62], np.int64)},
    "prototype 0": {"prototype_data": np.array([-1], np.int64)},
    "group 0": {"group_ranges": np.array([[0, 2]], np.int64)},
    "overlap": {"group_ranges": np.array([[0, 1], [0, 1]], np.int64)},
    "is empty": {"group_ranges": np.zeros((0, 2), np.int64)},
    "unknown material": {"instance_material": np.array([-2 - 99], np.int32)},
    "instance_material": {"instance_material": np.zeros(2, np.int32)},
    "world_from_object": {"world_from_object": np.zeros((1, 4, 4))},
    "object_from_world": {"object_from_world": np.zeros((1, 3, 4), np.float32)},
    "translation_low": {"translation_low": np.zeros((3, 3), np.float32)},
    "Sphere": {"shape_parameters": np.array([np.nan])},
    "shape_parameters": {"shape_parameters": np.zeros(8)[::2]},
}


@pytest.mark.parametrize("message", HOSTILE)
def test_hostile_arrays_are_refused(message: str) -> None:
    builder = Builder()
    builder.place(builder.shape("sphere", 1.0))
    ir = dataclasses.replace(builder.build(), **HOSTILE[message])
    with pytest.raises(ValueError, match=message):
        _kernel.Kernel(ir, "float32")


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("mesh_triangles", np.array([[0, 1, 3]], np.int32)),
        ("mesh_triangles", np.array([[0, 1, -1]], np.int32)),
        ("mesh_points", np.array([[0, 0, 0], [1, 0, 0], [0, np.inf, 0]])),
        ("mesh_ranges", np.array([[0, 4, 0, 1]], np.int64)),
        ("mesh_ranges", np.array([[0, 3, 1, 0]], np.int64)),
        ("mesh_ranges", np.zeros((0, 4), np.int64)),
    ],
)
def test_hostile_meshes_are_refused(field: str, value: Any) -> None:
    builder = Builder()
    builder.place(builder.mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]]))
    ir = builder.build()
    _kernel.Kernel(ir, "float64")
    with pytest.raises(ValueError, match=r"mesh 0|prototype 0"):
        _kernel.Kernel(dataclasses.replace(ir, **{field: value}), "float64")


def test_wrong_ray_arrays_are_refused() -> None:
    kernel = _kernel.Kernel(Builder().build(), "float32")
    good, one = np.zeros((4, 3)), np.zeros(1)
    single: Any = np.zeros((4, 3), np.float32)
    for bad in (np.zeros((4, 2)), single, np.zeros((8, 3))[::2], np.zeros(3)):
        with pytest.raises(ValueError, match="origins"):
            kernel.trace(bad, good, one, one)
    with pytest.raises(ValueError, match="directions"):
        kernel.trace(good, np.zeros((5, 3)), one, one)
    with pytest.raises(ValueError, match="t_max"):
        kernel.occluded(good, good, one, np.zeros(3))
    found = kernel.trace(good, good, one, one)
    with pytest.raises(ValueError, match="origins"):
        kernel.surface(good[1:], good, *found)
    with pytest.raises(ValueError, match="primitive"):
        kernel.surface(good, good, found[0], found[1], found[2][1:])


def test_surfaces_of_hits_that_cannot_be_are_misses() -> None:
    builder = Builder()
    builder.place(builder.mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]]))
    kernel = _kernel.Kernel(builder.build(), "float64")
    o, d = rays([[0.2, 0.2, 1.0]] * 4, [0.0, 0.0, -1.0])
    instance = np.array([0, 1, -5, 0])
    primitive = np.array([0, 0, 0, 1], np.uint32)
    normal, position, prototype, material, _ = kernel.surface(o, d, np.ones(4), instance, primitive)
    assert prototype.tolist() == [0, -1, -1, -1]
    assert (material[1:] == -1).all()
    assert np.isnan(position[1:]).all()
    assert np.isnan(normal[1:]).all()


def test_read_only_arrays_are_not_copied() -> None:
    builder = Builder()
    sphere = builder.shape("sphere", 0.2)
    for x in range(1000):
        builder.place(sphere, translation(x, 0, 0))
    ir = builder.build()
    copied = _kernel.Kernel(ir, "float32")
    for field in dataclasses.fields(ir):
        getattr(ir, field.name).setflags(write=False)
    shared = _kernel.Kernel(ir, "float32")
    assert shared.nbytes < 100_000
    assert copied.nbytes - shared.nbytes == 1000 * (96 + 96 + 4 + 4)
    del ir
    hits = trace(shared, [500, 0, 5], [0, 0, -1])
    assert hits.instance.tolist() == [500]
