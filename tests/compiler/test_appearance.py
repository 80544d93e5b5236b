"""What maps do to lights and cameras: against decimal arithmetic, and one by one."""

from __future__ import annotations

from decimal import Context, Decimal
from pathlib import Path

from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_array_equal

from compiler.compilation import compile_text

EXACT = Context(prec=60)
numbers = st.floats(0.01, 100.0)
scales = st.floats(-30.0, 30.0).map(lambda exponent: 10.0**exponent)


@given(numbers, scales, scales, scales)
@settings(max_examples=50, deadline=None)
def test_a_radius_grows_by_the_cube_root_of_the_volume(
    radius: float, x: float, y: float, z: float
) -> None:
    text = f"point_light(radius: {radius!r}).scale({x!r}, {-y!r}, {z!r})"
    (light,) = compile_text(text).ir.lights
    volume = EXACT.multiply(EXACT.multiply(Decimal(x), Decimal(y)), Decimal(z))
    root = EXACT.power(volume, EXACT.divide(Decimal(1), Decimal(3)))
    assert light["size"] == float(EXACT.multiply(Decimal(radius), root))


@given(numbers, numbers, scales, scales, scales)
@settings(max_examples=50, deadline=None)
def test_a_window_and_its_depths_are_scaled(
    height: float, near: float, x: float, y: float, z: float
) -> None:
    camera = f"camera(from: (0, 0, 5), height: {height!r}, near: {near!r}, far: {near * 2!r})"
    (placed,) = compile_text(f"{camera}.scale({x!r}, {y!r}, {z!r})").ir.cameras
    assert placed["height"] == float(EXACT.multiply(Decimal(height), Decimal(y)))
    assert placed["near"] == float(EXACT.multiply(Decimal(near), Decimal(z)))
    assert placed["far"] == float(EXACT.multiply(Decimal(near * 2), Decimal(z)))


EXAMPLES = Path(__file__).parents[2] / "examples"
LINES = [
    "sun(direction: (1, -2, 3), irradiance: 3, angle: 2deg)",
    "point_light(position: (1, 2, 3), radius: 0.5)",
    "point_light(direction: (1, 2, 3), cone: 30deg, softness: 0.5, focus: 2)",
    "rectangle_light(size: (1, 2), cone: 40deg)",
    "disc_light(radius: 3)",
    "cylinder_light(radius: 0.1, height: 7)",
    "sky(color: rgb(0.1, 0.2, 0.3))",
    'sky(texture: "igloo.png")',
    'camera(from: (1, 2, 3), fov: 30deg, near: 0.5, name: "left")',
    "camera(from: (1, 2, 3), height: 7, far: 100)",
]


@given(st.lists(st.tuples(st.sampled_from(LINES), numbers, scales, numbers), max_size=9))
@settings(max_examples=15, deadline=None)
def test_many_lights_are_placed_as_each_alone(lines: list[tuple[str, float, float, float]]) -> None:
    texts = [
        f"{light}.translate({x!r}, 2, 3).scale(1, {s!r}, 1).rotate((1, 2, 3), {a!r}deg)"
        for light, x, s, a in lines
    ]
    together, *alone = (
        compile_text(text, str(EXAMPLES / "scene.ovo")).ir for text in ("\n".join(texts), *texts)
    )
    for table in ("lights", "cameras"):
        found = getattr(together, table)
        for name in sorted({*found.dtype.names} - {"file", "name"}):  # those are numbers of texts
            due = [row for ir in alone for row in getattr(ir, table)[name].tolist()]
            assert_array_equal(found[name].tolist(), due)
