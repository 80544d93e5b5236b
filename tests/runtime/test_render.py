from __future__ import annotations

import math
import os
import signal
import threading
from typing import get_args

import numpy as np
import pytest

from compiler.flatten import flatten
from compiler.ir import INTEGRATORS, PRECISIONS, SceneIR
from dsl.diagnostics import Diagnostic
from dsl.scene import (
    AreaLight,
    Bind,
    Camera,
    File,
    Group,
    Instances,
    Integrator,
    Material,
    Node,
    PointLight,
    Precision,
    SceneGraph,
    Settings,
    Shape,
    ShapeKind,
    Shaping,
    Sky,
    Step,
    StepKind,
    Sun,
    Transform,
    Vector,
)
from runtime._kernel import instruction_sets
from runtime.camera import choose_camera, default_camera
from runtime.film import Film
from runtime.render import MAX_SAMPLES, render

MATTE = Material(diffuse=(0.5, 0.5, 0.5), specular_workflow=True)
SPHERE = Shape(ShapeKind.SPHERE, (1.0,))
PLANE = Shape(ShapeKind.PLANE, ())


def scene(*items: Node) -> SceneIR:
    def load(_: File) -> tuple[Node | None, list[Diagnostic]]:
        raise AssertionError("these scenes name no files")

    ir = flatten(SceneGraph(Group(items)), load).ir
    assert ir is not None
    return ir


def moved(node: Node, x: float, y: float, z: float) -> Instances:
    return Instances(node, Transform((Step(StepKind.TRANSLATE, np.array([x, y, z])),)))


def looking(node: Node, eye: tuple[float, float, float], at: tuple[float, float, float]) -> Node:
    step = Step(StepKind.LOOK_AT, np.array([*eye, *at, 0.0, 1.0, 0.0]))
    return Instances(node, Transform((step,)))


def still_life() -> SceneIR:
    """Spheres on a plane, a soft sun, a ball of light and a sky, with every kind of material."""
    glossy = Material(diffuse=(0.9, 0.6, 0.2), metallic=1.0, roughness=0.3)
    coated = Material(diffuse=(0.7, 0.1, 0.1), clearcoat=1.0, roughness=0.7)
    glass = Material(diffuse=(0.3, 0.8, 0.4), opacity=0.4)
    return scene(
        Bind(PLANE, MATTE),
        Bind(moved(SPHERE, -2.2, 1, 0), glossy),
        Bind(moved(SPHERE, 0, 1, 0), coated),
        Bind(moved(SPHERE, 2.2, 1, 0), glass),
        Sun((-1, -2, -1), (2, 2, 1.8), angle=3.0),
        PointLight((3, 4, 3), (10, 10, 20), radius=0.5),
        Sky((0.3, 0.4, 0.6)),
        looking(Camera("perspective", 0.6), (1, 4, 12), (0, 0.8, 0)),
    )


def pixel(film: Film, column: float, row: float) -> np.ndarray[tuple[int], np.dtype[np.float32]]:
    """The colour at that fraction of the width and height."""
    color = film.color[int(row * film.height), int(column * film.width)]
    return np.asarray(color)


def test_names_are_those_of_the_language() -> None:
    assert get_args(Integrator) == INTEGRATORS
    assert get_args(Precision) == PRECISIONS


@pytest.mark.parametrize("precision", get_args(Precision))
def test_neither_threads_nor_instruction_sets_change_a_picture(precision: Precision) -> None:
    ir = still_life()
    for integrator in get_args(Integrator):
        films = [
            render(
                ir,
                width=70,
                height=50,
                samples=5,
                integrator=integrator,
                precision=precision,
                threads=threads,
                isa=isa,
            )
            for threads, isa in [
                *((n, None) for n in (1, 2, 3)),
                *((2, s) for s in instruction_sets()),
            ]
        ]
        for film in films[1:]:
            for name in ("color", "error", "depth", "normal", "instance"):
                np.testing.assert_array_equal(film.aov(name), films[0].aov(name), name)
            assert film.rays == films[0].rays


PLAIN: tuple[Node, ...] = (
    PLANE,
    Bind(moved(SPHERE, 0, 1, 0), MATTE),
    moved(SPHERE, 2.2, 1, 0),
    Sun((-1, -2, -1), (2, 2, 1.8)),
    looking(Camera("perspective", 0.6), (1, 4, 12), (0, 0.8, 0)),
)


@pytest.mark.parametrize("integrator", get_args(Integrator))
@pytest.mark.parametrize("samples", [1, 9])
@pytest.mark.parametrize("plain", [False, True])
def test_the_picture_is_the_same_without_surfaces(
    integrator: Integrator, samples: int, plain: bool
) -> None:
    ir = scene(*PLAIN) if plain else still_life()
    whole, colors = (
        render(ir, width=37, height=21, samples=samples, integrator=integrator, surfaces=surfaces)
        for surfaces in (True, False)
    )
    np.testing.assert_array_equal(colors.color, whole.color)
    np.testing.assert_array_equal(colors.error, whole.error)
    assert colors.rays == whole.rays
    assert colors.surfaces is None
    assert whole.instance.max() > 0


@pytest.mark.parametrize("samples", [1, 9])
@pytest.mark.parametrize("sky", [(), (Sky((0.3, 0.4, 0.6)),)])
@pytest.mark.parametrize("unseen", [Material(opacity=0.5), Material(emission=(1.0, 1.0, 1.0))])
def test_what_is_not_seen_does_not_change_what_is(
    samples: int, sky: tuple[Node, ...], unseen: Material
) -> None:
    below = Bind(moved(SPHERE, 0, -9, 0), unseen)
    plain, other = (
        render(scene(*PLAIN, *sky, *more), width=37, height=21, samples=samples)
        for more in ((), (below,))
    )
    for image in ("color", "error", "depth", "normal", "instance"):
        np.testing.assert_array_equal(plain.aov(image), other.aov(image))


def test_seeds_choose_other_samples() -> None:
    ir = still_life()
    first, again, other = (
        render(ir, width=32, height=24, samples=4, seed=seed).color for seed in (1, 1, 2)
    )
    np.testing.assert_array_equal(first, again)
    assert (first != other).mean() > 0.3


def test_up_is_up_and_right_is_right() -> None:
    # Seen from +z: x to the right, y up.
    red, green = (Material(diffuse=(0, 0, 0), emission=c) for c in [(1, 0, 0), (0, 1, 0)])
    ir = scene(
        Bind(moved(SPHERE, 2, 0, 0), red),
        Bind(moved(SPHERE, 0, 2, 0), green),
        looking(Camera("perspective", 1.0), (0, 0, 10), (0, 0, 0)),
    )
    film = render(ir, width=100, height=100, samples=1)
    np.testing.assert_allclose(pixel(film, 0.7, 0.5), [1, 0, 0, 1])
    np.testing.assert_allclose(pixel(film, 0.5, 0.3), [0, 1, 0, 1])
    np.testing.assert_allclose(pixel(film, 0.3, 0.5), [0, 0, 0, 0])
    assert film.instance[50, 70] == 0
    assert film.instance[30, 50] == 1
    assert film.instance[0, 0] == -1
    # The sphere at x = 2 is seen in the direction (0.2, 0, -1): its near side.
    assert film.depth[50, 70] == pytest.approx(9, abs=0.1)
    assert film.depth[0, 0] == math.inf
    np.testing.assert_allclose(np.linalg.norm(film.normal[30, 50]), 1, rtol=1e-6)


def test_closed_forms_of_light() -> None:
    camera = looking(Camera("orthographic", 0.1), (0, 5, 0.001), (0, 0, 0))
    ground = Bind(PLANE, MATTE)
    # Radiance of a matte surface is albedo · irradiance / π.
    sun = render(scene(ground, Sun((0, -1, 0), (math.pi,) * 3), camera), width=4, height=4)
    np.testing.assert_allclose(sun.color[..., 0], 0.5, rtol=1e-5)
    slanted = scene(ground, Sun((math.sqrt(3), -1, 0), (math.pi,) * 3), camera)
    np.testing.assert_allclose(render(slanted, width=4, height=4).color[..., 0], 0.25, rtol=1e-5)
    lamp = scene(ground, PointLight((0, 2, 0), (4 * math.pi,) * 3), camera)
    np.testing.assert_allclose(render(lamp, width=4, height=4).color[..., 0], 0.5, rtol=1e-2)
    # A disc of radiance L and radius r at height h: π L r² / (r² + h²).
    axes: tuple[Vector, Vector, Vector] = ((1.5, 0, 0), (0, 0, 1.5), (0, -1, 0))
    disc = scene(ground, AreaLight("disc", (2, 2, 2), axes, (0, 2, 0)), camera)
    color = render(disc, width=4, height=4, samples=256).color[..., 0]
    np.testing.assert_allclose(color, 0.5 * 2 * 1.5**2 / (1.5**2 + 2**2), rtol=1e-2)
    spots = [
        PointLight((0, 2, 0), (4 * math.pi,) * 3, shaping=shaping, direction=(1, -1, 0))
        for shaping in (Shaping(40), Shaping(50), Shaping(focus=2.0))
    ]
    lit = [render(scene(ground, s, camera), width=4, height=4).color[..., 0].mean() for s in spots]
    np.testing.assert_allclose(lit, [0.0, 0.5, 0.25], rtol=2e-2)
    sky = scene(ground, Sky((0.8, 0.8, 0.8)), camera)
    np.testing.assert_allclose(render(sky, width=4, height=4).color[..., 0], 0.4, rtol=1e-5)


def test_what_stands_before_a_surface_of_light_shadows_and_what_lies_in_it_does_not() -> None:
    camera = looking(Camera("orthographic", 0.1), (3, 5, 0.001), (0, 0, 0))
    axes: tuple[Vector, Vector, Vector] = ((1, 0, 0), (0, 0, 1), (0, -1, 0))
    light = AreaLight("rectangle", (1, 1, 1), axes, (0, 2, 0))
    panel = Shape(ShapeKind.RECTANGLE, (2.0, 2.0))
    seen = [
        render(scene(Bind(PLANE, MATTE), *items, light, camera), width=4, height=4)
        .color[..., 0]
        .mean()
        for items in ([], [moved(panel, 0, 2, 0)], [moved(panel, 0, 1.9, 0)])
    ]
    assert seen[0] > 0.1
    assert seen[1] == pytest.approx(seen[0])
    assert seen[2] == 0.0


def test_there_is_no_acne_and_no_leak() -> None:
    # Convex things of all sizes under a sky and a grazing sun: nothing shadows itself.
    for size in (1e-12, 1.0, 1e12):
        for precision in get_args(Precision):
            ball = Shape(ShapeKind.SPHERE, (size,))
            ir = scene(
                Bind(ball, MATTE),
                Sky((1, 1, 1)),
                looking(Camera("orthographic", 1.9 * size), (0, 0, 10 * size), (0, 0, 0)),
            )
            film = render(ir, width=64, height=64, samples=4, precision=precision)
            inside = film.instance == 0
            assert inside.mean() > 0.7
            assert (film.color[inside][:, 0] >= 0.5 - 1e-6).all()
            # And a closed room has no light: seen from inside, all is occluded.
            room = scene(
                Bind(ball, MATTE),
                looking(Camera("perspective", 1.0), (0, 0, 0.5 * size), (0, 0, 0)),
            )
            closed = render(
                room,
                width=64,
                height=64,
                samples=16,
                precision=precision,
                integrator="ambient_occlusion",
            )
            assert (closed.color[..., :3] == 0).all()


def test_without_lights_a_headlight_shows_the_scene() -> None:
    film = render(scene(Bind(SPHERE, MATTE)), width=64, height=64)
    assert pixel(film, 0.5, 0.5)[0] > 0.3
    np.testing.assert_array_equal(pixel(film, 0.01, 0.01), 0)


def test_occlusion_distance_is_taken_from_the_scene() -> None:
    camera = looking(Camera("perspective", 1.0), (0, 0, 0.5), (0, 0, 0))
    room = [Bind(Shape(ShapeKind.SPHERE, (10.0,)), MATTE), camera]
    far, near = (
        render(
            scene(*room, Settings(occlusion_distance=d, integrator="ambient_occlusion")), width=8
        )
        for d in (30.0, 1.0)
    )
    assert far.color[..., 0].max() == 0
    assert near.color[..., 0].min() > 0.7


def test_settings_of_the_scene_yield_to_arguments() -> None:
    said = Settings(
        width=40, height=20, samples=2, integrator="ids", precision="float64", exposure=1.5
    )
    ir = scene(SPHERE, said)
    film = render(ir)
    assert (film.width, film.height, film.samples) == (40, 20, 2)
    assert (film.integrator, film.exposure) == ("ids", 1.5)
    film = render(ir, width=30, samples=1, integrator="normals")
    assert (film.width, film.height) == (30, 15)
    assert film.integrator == "normals"
    assert render(ir, height=5, samples=1).width == 10


def test_the_size_follows_the_camera_where_nothing_is_said() -> None:
    film = render(scene(SPHERE, Camera("perspective", 1.0, aspect=2.0)), samples=1)
    assert (film.width, film.height) == (640, 320)
    film = render(scene(SPHERE), samples=1)
    assert (film.width, film.height) == (640, 480)


def test_cameras_are_chosen_by_name_or_number() -> None:
    ir = scene(
        SPHERE, Camera("perspective", 1.0, name="left"), Camera("perspective", 2.0, name="7")
    )
    heights = {choice: choose_camera(ir, choice) for choice in (None, "left", 1, "1", "7")}
    assert [float(camera["height"]) for camera in heights.values() if camera is not None] == [
        1.0,
        1.0,
        2.0,
        2.0,
        2.0,
    ]
    with pytest.raises(ValueError, match=r"'right'.*0 'left', 1 '7'"):
        choose_camera(ir, "right")
    with pytest.raises(ValueError, match="number 2"):
        choose_camera(ir, 2)
    with pytest.raises(ValueError, match="number -1"):
        choose_camera(ir, -1)
    with pytest.raises(ValueError, match="has none"):
        choose_camera(scene(SPHERE), "left")


@pytest.mark.parametrize("up", ["y", "z"])
@pytest.mark.parametrize("aspect", [0.3, 1.0, 2.5])
@pytest.mark.parametrize("size", [(1.0, 1.0, 1.0), (100.0, 1.0, 0.0), (1e-20, 1e-22, 1e-21)])
def test_the_default_camera_sees_the_whole_box(
    up: str, aspect: float, size: tuple[float, float, float]
) -> None:
    center = np.array([5.0, -3.0, 2.0]) * size[0]
    bounds = np.stack([center - size, center + size])
    camera = default_camera(bounds, up, aspect)
    right, above, back, eye = camera["world_from_camera"].T
    np.testing.assert_allclose(np.cross(right, above), back, atol=1e-12)
    vertical = np.array([0, 1, 0] if up == "y" else [0, 0, 1])
    front = np.array([0, 0, 1] if up == "y" else [0, -1, 0])
    assert right @ vertical == pytest.approx(0)
    assert min(above @ vertical, back @ vertical, back @ front) > 0.2
    corners = np.array(np.meshgrid(*bounds.T)).reshape(3, 8).T - eye
    depth = -corners @ back
    window = float(camera["height"]) / 2 * depth
    assert (depth > 0).all()
    fill = np.maximum(abs(corners @ above) / window, abs(corners @ right) / (window * aspect))
    assert 0.5 < fill.max() <= 1


def test_an_empty_scene_is_a_picture_too() -> None:
    film = render(scene(), width=8, height=8)
    assert (film.color == 0).all()
    assert (film.instance == -1).all()
    assert film.seconds > 0


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("width", 0),
        ("height", -3),
        ("width", 1 << 20),
        ("samples", 0),
        ("samples", MAX_SAMPLES + 1),
        ("threads", -1),
        ("seed", -1),
        ("seed", 1 << 64),
    ],
)
def test_settings_out_of_range_are_refused_by_name(name: str, value: int) -> None:
    with pytest.raises(ValueError, match=name):
        render(scene(SPHERE), **{name: value})  # type: ignore[arg-type]


def test_pictures_too_large_and_unknown_names_are_refused() -> None:
    ir = scene(SPHERE)
    with pytest.raises(ValueError, match="limit"):
        render(ir, width=60_000, height=60_000)
    with pytest.raises(ValueError, match=r"'path'.*direct"):
        render(ir, integrator="path")  # type: ignore[arg-type]
    with pytest.raises(ValueError, match=r"'half'.*float32"):
        render(ir, precision="half")  # type: ignore[arg-type]


def test_progress_goes_from_start_to_end() -> None:
    calls: list[tuple[float, int]] = []
    film = render(
        still_life(), width=120, height=90, progress=lambda done, rays: calls.append((done, rays))
    )
    fractions, rays = zip(*calls, strict=True)
    assert list(fractions) == sorted(fractions)
    assert list(rays) == sorted(rays)
    assert calls[-1] == (1.0, film.rays)
    assert film.rays > 120 * 90 * 16


def test_what_progress_raises_ends_the_render() -> None:
    class StopError(Exception):
        pass

    def stop(done: float, _: int) -> None:
        assert done < 0.5
        raise StopError

    with pytest.raises(StopError):
        render(still_life(), width=4000, height=4000, samples=1000, progress=stop)


def test_interrupting_ends_the_render() -> None:
    timer = threading.Timer(0.3, os.kill, (os.getpid(), signal.SIGINT))
    timer.start()
    with pytest.raises(KeyboardInterrupt):
        render(still_life(), width=4000, height=4000, samples=1000)
    timer.join()
