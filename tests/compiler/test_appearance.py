"""What scales do to lights and cameras, against decimal arithmetic: numbers are rounded once."""

from __future__ import annotations

from decimal import Context, Decimal

from hypothesis import given, settings
from hypothesis import strategies as st

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
