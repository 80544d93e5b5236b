"""The interpreter's walk: the five steps, order, materials, and graphs of any depth."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from dsl.scene import (
    DEFAULT_MATERIAL,
    Bind,
    Camera,
    File,
    Group,
    Instances,
    Material,
    Mesh,
    Node,
    SceneGraph,
    Shape,
    ShapeKind,
    Sky,
    Step,
    StepKind,
    Transform,
)
from runtime.reference import ReferenceTracer
from runtime.reference.number import Number, NumberName

FloatArray = NDArray[np.float64]
RED, GREEN, BLUE = (Material(diffuse=c) for c in ((1, 0, 0), (0, 1, 0), (0, 0, 1)))
SPHERE = Shape(ShapeKind.SPHERE, (1.0,))
BOX = Shape(ShapeKind.BOX, (-1.0, -1.0, -1.0, 1.0, 1.0, 1.0, 0.25))
ALWAYS = np.zeros(1), np.full(1, np.inf)


def step(kind: str, *values: float | Sequence[float], inverse: bool = False) -> Step:
    return Step(StepKind(kind), np.array(values, float), inverse)


def placed(child: Node, *steps: Step) -> Instances:
    return Instances(child, Transform(steps))


def rays(*pairs: tuple[Sequence[float], Sequence[float]]) -> tuple[FloatArray, FloatArray]:
    origins, directions = zip(*pairs, strict=True)
    return np.array(origins, float), np.array(directions, float)


def down(*xs: float) -> tuple[FloatArray, FloatArray]:
    """Rays along -z from z = 10, one per x."""
    return rays(*(((x, 0, 10), (0, 0, -1)) for x in xs))


def test_the_ellipsoid_of_the_seed() -> None:
    scene = SceneGraph(placed(SPHERE, step("scale", 1, 4, 1), step("translate", 0, 10, 0)))
    t, normal, position, instance, prototype, material = ReferenceTracer(scene).trace(
        *rays(((0, 0, 0), (0, 2, 0)), ((0, 12, 5), (0, 0, -1))), *ALWAYS
    )
    assert t[0] == 3.0  # directions are not normalised
    assert np.array_equal(position[0], (0, 6, 0))
    assert np.array_equal(normal[0], (0, -1, 0))
    np.testing.assert_allclose(t[1], 5 - np.sqrt(0.75))
    gradient = np.array((0, 2 / 16, np.sqrt(0.75)))
    np.testing.assert_allclose(normal[1], gradient / np.linalg.norm(gradient))
    assert (instance.tolist(), prototype.tolist(), material.tolist()) == ([0, 0], [0, 0], [0, 0])


axis = st.tuples(*[st.floats(-1, 1)] * 3).filter(lambda v: np.linalg.norm(v) > 0.1)
factor = st.floats(0.1, 10).flatmap(lambda x: st.sampled_from([x, -x]))
number = st.floats(-5, 5)
steps = st.one_of(
    st.builds(lambda v: ("translate", v), st.tuples(number, number, number)),
    st.builds(lambda v: ("scale", v), st.tuples(factor, factor, factor)),
    st.builds(lambda a, d: ("rotate", (*a, d)), axis, st.floats(-720, 720)),
    st.builds(lambda v: ("shear", (v, 0, 0, v / 2, 0, 0)), st.floats(-3, 3)),
    st.builds(lambda a: ("reflect", a), axis),
    st.builds(
        lambda v: ("matrix", (2, 0, 1, v[0], 0, -1, 0.5, v[1], 0.25, 0, 1, v[2])),
        st.tuples(number, number, number),
    ),
    st.builds(
        lambda e, d: ("look_at", (*e, *np.add(e, d), 0.3, 1, 0.2)),
        st.tuples(number, number, number),
        axis.filter(lambda v: abs(v[0]) > 0.1),
    ),
)


def matrix(kind: str, v: Sequence[float]) -> FloatArray:
    """The 4x4 matrix of a step, from the text books."""
    m = np.eye(4)
    match kind:
        case "translate":
            m[:3, 3] = v
        case "scale":
            m[[0, 1, 2], [0, 1, 2]] = v
        case "rotate":
            x, y, z = np.array(v[:3]) / np.linalg.norm(v[:3])
            k = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
            angle = np.radians(v[3])
            m[:3, :3] += np.sin(angle) * k + (1 - np.cos(angle)) * k @ k
        case "shear":
            m[0, 1:3], m[1, [0, 2]], m[2, :2] = v[0:2], v[2:4], v[4:6]
        case "reflect":
            m[:3, :3] -= 2 * np.outer(v, v) / np.dot(v, v)
        case "matrix":
            m[:3] = np.reshape(v, (3, 4))
        case "look_at":
            back = np.subtract(v[:3], v[3:6])
            right = np.cross(v[6:], back)
            columns = (right, np.cross(back, right), back)
            m[:3, :3] = np.stack([c / np.linalg.norm(c) for c in columns], axis=1)
            m[:3, 3] = v[:3]
    return m


@settings(max_examples=60)
@given(st.lists(st.tuples(steps, st.booleans()), min_size=1, max_size=4), st.integers(0, 2**32 - 1))
def test_chains_equal_their_matrix(
    chain: list[tuple[tuple[str, Sequence[float]], bool]], seed: int
) -> None:
    world = np.eye(4)
    for (kind, values), inverse in chain:
        m = matrix(kind, values)
        world = (np.linalg.inv(m) if inverse else m) @ world
    rng = np.random.default_rng(seed)
    origins, targets = rng.normal(size=(40, 3)) * 4, rng.uniform(-1, 1, (40, 3))
    directions = targets - origins
    expected = ReferenceTracer(SceneGraph(BOX)).trace(origins, directions, *ALWAYS)

    made = [step(kind, *values, inverse=inverse) for (kind, values), inverse in chain]
    nested: Node = BOX
    for one in made:
        nested = placed(nested, one)
    there = Transform(tuple(made))
    for node in (
        Instances(BOX, there),
        nested,
        Instances(Instances(Instances(BOX, there), there.inverted()), there),
    ):
        t, normal, position, *_ = ReferenceTracer(SceneGraph(node)).trace(
            origins @ world[:3, :3].T + world[:3, 3], directions @ world[:3, :3].T, *ALWAYS
        )
        inverse_transpose = np.linalg.inv(world[:3, :3])
        n = expected[1] @ inverse_transpose
        precision = 1e-12 * np.linalg.cond(world) ** 2
        hit = np.isfinite(expected[0]) & np.isfinite(t)
        assert (hit == np.isfinite(expected[0])).mean() > 0.9  # all but those that graze
        np.testing.assert_allclose(t[hit], expected[0][hit], rtol=precision)
        np.testing.assert_allclose(
            position[hit],
            expected[2][hit] @ world[:3, :3].T + world[:3, 3],
            atol=precision * np.abs(world).max() * 10,
        )
        cosine = (normal[hit] * n[hit]).sum(axis=1) / np.linalg.norm(n[hit], axis=1)
        assert (cosine > 1 - precision).mean() > 0.9 if hit.any() else True


@pytest.mark.parametrize("name", ["float64", "longdouble", "mpmath"])
def test_quarter_turns_are_exact(name: NumberName) -> None:
    exact = Number(name)
    for quarter in range(-8, 9):
        sine, cosine = exact.sine_cosine(90.0 * quarter)
        assert (sine, cosine) == ((0, 1), (1, 0), (0, -1), (-1, 0))[quarter % 4]
    assert exact.sine_cosine(36000090.0) == (1, 0)
    assert float(exact.sine_cosine(30.0)[0]) == pytest.approx(0.5, rel=1e-15)


def test_ten_thousand_transforms_deep() -> None:
    makers: tuple[Callable[[Node], Node], ...] = (
        lambda node: placed(node, step("translate", 1, 0, 0)),
        lambda node: Group((placed(node, step("rotate", 0, 1, 0, 90)),)),
        lambda node: placed(Bind(node, RED), step("scale", -1, 1, 1)),
    )
    for make in makers:
        node: Node = SPHERE
        for _ in range(10_000):
            node = make(node)
        tracer = ReferenceTracer(SceneGraph(node))
        t, *_, instance, _, _ = tracer.trace(*down(0, 10_000), *ALWAYS)
        assert np.isfinite(t).sum() == 1
        assert t.min() == 9.0
        assert instance.max() == 0


def test_leaves_are_numbered_in_order_of_emission() -> None:
    pair = Group((SPHERE, placed(BOX, step("translate", 0, 4, 0))), None)
    batch = Instances(pair, Transform((step("translate", (0, 0, 0), (4, 0, 0), (8, 0, 0)),)))
    scene = SceneGraph(Group((Sky((1, 1, 1)), batch, Camera("perspective", 1.0), pair)))
    origins, directions = rays(*(((x, y, 10), (0, 0, -1)) for x in (0, 4, 8) for y in (0, 4)))
    tracer = ReferenceTracer(scene)
    *_, instance, prototype, _ = tracer.trace(origins, directions, *ALWAYS)
    assert instance.tolist() == [0, 1, 2, 3, 4, 5]  # leaves 6 and 7 tie with 0 and 1, and lose
    assert prototype.tolist() == [0, 1, 0, 1, 0, 1]


def test_instances_without_an_inverse_are_left_out() -> None:
    flat = (
        step("scale", 1, 0, 1),
        step("shear", 1, 0, 1, 0, 0, 0),
        step("matrix", 1, 2, 3, 0, 2, 4, 6, 0, 0, 0, 1, 0),
        step("rotate", 0, 0, 0, 45),
        step("reflect", 0, 0, 0),
        step("look_at", 1, 2, 3, 1, 3, 3, 0, 2, 0),
        step("scale", np.inf, 1, 1),
    )
    scene = SceneGraph(Group((*(placed(SPHERE, one) for one in flat), SPHERE)))
    *_, instance, _, _ = ReferenceTracer(scene).trace(*down(0), *ALWAYS)
    assert instance.tolist() == [0]


def test_the_innermost_material_wins_but_for_the_outermost_override() -> None:
    plain = Bind(SPHERE, RED)
    forced = Bind(SPHERE, RED, override=True)
    nodes: tuple[tuple[Node, Material], ...] = (
        (SPHERE, DEFAULT_MATERIAL),
        (Bind(plain, GREEN), RED),
        (Bind(Group((plain,)), GREEN, override=True), GREEN),
        (Bind(forced, GREEN), RED),
        (Bind(Bind(forced, GREEN, override=True), BLUE), GREEN),
        (Bind(Bind(SPHERE, GREEN, override=True), BLUE, override=True), BLUE),
    )
    items = (placed(node, step("translate", 4 * i, 0, 0)) for i, (node, _) in enumerate(nodes))
    tracer = ReferenceTracer(SceneGraph(Group(tuple(items))))
    *_, material = tracer.trace(*down(*(4.0 * i for i in range(len(nodes)))), *ALWAYS)
    assert [tracer.materials[i] for i in material] == [expected for _, expected in nodes]


def test_misses_and_rays_that_are_none() -> None:
    tracer = ReferenceTracer(SceneGraph(SPHERE))
    origins, directions = rays(
        ((5, 0, 10), (0, 0, -1)),
        ((0, 0, 10), (0, 0, 0)),
        ((np.nan, 0, 10), (0, 0, -1)),
        ((0, 0, 10), (0, np.inf, -1)),
        ((0, 0, 10), (0, 0, 1)),
    )
    t, normal, position, *_ = hits = tracer.trace(origins, directions, *ALWAYS)
    assert np.isinf(t).all()
    assert np.isnan(normal).all()
    assert np.isnan(position).all()
    assert (np.stack(hits[3:]) == -1).all()
    assert [each.dtype for each in hits[3:]] == [np.int64, np.int32, np.int32]
    assert not tracer.occluded(origins, directions, *ALWAYS).any()


@pytest.mark.parametrize("node", [Group(()), Mesh(np.zeros((0, 3)), np.zeros((0, 3), np.int64))])
def test_nothing_is_hit_in_an_empty_scene(node: Node) -> None:
    tracer = ReferenceTracer(SceneGraph(node))
    assert not tracer.occluded(*down(0, 1), *ALWAYS).any()
    assert tracer.trace(np.zeros((0, 3)), np.zeros((0, 3)), *ALWAYS)[1].shape == (0, 3)


@pytest.mark.parametrize("shape", [SPHERE, BOX, Shape(ShapeKind.TORUS, (0.75, 0.25))])
def test_the_interval_of_t_is_open(shape: Shape) -> None:
    tracer = ReferenceTracer(SceneGraph(shape))
    origins, directions = rays(*[((0.75, 0, 10), (0, 0, -1))] * 5)
    first = tracer.trace(origins, directions, *ALWAYS)[0][0]
    last = tracer.trace(origins, directions, np.full(1, first + 0.1), ALWAYS[1])[0][0]
    assert first < last
    t_min = np.array([0, first, first + 0.1, last, 0])
    t_max = np.array([first, np.inf, last, np.inf, np.nan])
    if shape.kind is ShapeKind.TORUS:  # a start on a marched surface is within rounding of it
        t_min[[1, 3]] += 1e-12
    t, *_ = tracer.trace(origins, directions, t_min, t_max)
    assert t.tolist() == [np.inf, pytest.approx(last), np.inf, np.inf, np.inf]


def test_files_are_loaded_once() -> None:
    file = File("mesh", "a.ply")
    scene = SceneGraph(Group((file, placed(file, step("translate", 4, 0, 0)))))
    asked = []

    def load(wanted: File) -> Node:
        asked.append(wanted)
        return SPHERE

    tracer = ReferenceTracer(scene, load)
    *_, instance, prototype, _ = tracer.trace(*down(0, 4), *ALWAYS)
    assert (instance.tolist(), prototype.tolist(), asked) == ([0, 1], [0, 0], [file])
    with pytest.raises(ValueError, match="a\\.ply"):
        ReferenceTracer(scene).trace(*down(0), *ALWAYS)


def test_numbers_agree_to_their_precision() -> None:
    node: Node = Group((BOX, placed(SPHERE, step("translate", 1, 0.5, 0.25))))
    for values in ((3, 1, 2, 37.0), (1, -1, 0.5, 211.0)):
        node = placed(node, step("rotate", *values), step("shear", 0.5, 0, 0.25, 0, 0, -1))
    rng = np.random.default_rng(2)
    origins = rng.normal(size=(40, 3)) * 6
    found = {
        name: ReferenceTracer(SceneGraph(node), number=name).closest(origins, -origins, *ALWAYS)
        for name in ("float64", "longdouble", "mpmath")
    }
    exact = found["mpmath"]
    assert (exact.leaf >= 0).all()
    for name, bound in (("float64", 3e-14), ("longdouble", 2e-17)):
        error = np.abs((found[name].t - exact.t).astype(float))
        assert 0 < error.max() < bound
        assert np.array_equal(found[name].leaf, exact.leaf)
    with pytest.raises(ValueError, match="longdouble"):
        Number("float16")  # type: ignore[arg-type]
