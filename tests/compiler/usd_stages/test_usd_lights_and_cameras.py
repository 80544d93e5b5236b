"""Lights and cameras of stages: where they are, how bright, and what has no effect."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from dsl.scene import AreaLight, Camera, PointLight, Shaping, Sky, Sun


def one(imported: Any, kind: type) -> tuple[np.ndarray, Any]:
    (found,) = [(world, node) for world, node in imported.others if isinstance(node, kind)]
    return found


def test_what_lights_do_not_have_is_named_one_by_one(
    load: Callable[..., Any], tmp_path: Path
) -> None:
    (tmp_path / "dusk.exr").touch()
    imported = load("""
def SphereLight "spot" (prepend apiSchemas = ["ShapingAPI"]) {
    color3f inputs:shaping:focusTint = (1, 0, 0)
    asset inputs:shaping:ies:file = @lamp.ies@
}
def DistantLight "sun" (prepend apiSchemas = ["ShapingAPI"]) {
    float inputs:shaping:cone:angle = 30
}
def DomeLight_1 "sky" {
    asset inputs:texture:file = @sky.exr@
    token inputs:texture:format = "angular"
}
def DomeLight "night" {
    asset inputs:texture:file = @no.exr@
}
def DomeLight_1 "dusk" {
    asset inputs:texture:file = @./dusk.exr@
    uniform token poleAxis = "X"
}
def RectLight "panel" {
    asset inputs:texture:file = @panel.png@
}
def DiskLight "nothing" {
    float inputs:radius = 0
}
""")
    for name, path in (
        ("focusTint", "/spot"), ("ies:file", "/spot"), ("cone:angle", "/sun"),
        ("`angular`", "/sky"), ("no.exr", "/night"), ("poleAxis", "/dusk"),
        ("texture:file", "/panel"), ("without a surface", "/nothing"),
    ):  # fmt: skip
        assert imported.said(name).primary.place.prim == path
    assert len(imported.diagnostics) == 8


def test_shaping_is_around_the_way_that_a_light_points(load: Callable[..., Any]) -> None:
    imported = load("""
def SphereLight "spot" (prepend apiSchemas = ["ShapingAPI"]) {
    float inputs:shaping:cone:angle = 30
    float inputs:shaping:cone:softness = 0.5
    float inputs:shaping:focus = 2
    float xformOp:rotateX = -90
    uniform token[] xformOpOrder = ["xformOp:rotateX"]
}
def SphereLight "half" (prepend apiSchemas = ["ShapingAPI"]) {
}
""")
    (_, spot), (_, half) = imported.others
    assert spot.shaping == Shaping(30.0, 0.5, 2.0)
    np.testing.assert_allclose(spot.direction, (0, -1, 0), atol=1e-15)
    assert (half.shaping, half.direction) == (Shaping(90.0), (0.0, 0.0, -1.0))
    assert imported.diagnostics == []


def test_cameras_are_placed_and_named_by_path(load: Callable[..., Any]) -> None:
    world, camera = one(
        load("""
class Xform "_rig" {
    def Camera "cam" {
        float horizontalAperture = 36
        float verticalAperture = 24
        float focalLength = 50
        float horizontalApertureOffset = 3.6
        float2 clippingRange = (0.5, 100)
        double3 xformOp:translate = (0, 0, 5)
        uniform token[] xformOpOrder = ["xformOp:translate"]
    }
}
def Xform "rig" (instanceable = true
    inherits = </_rig>
) {
    token visibility = "invisible"
    double3 xformOp:translate = (1, 0, 0)
    uniform token[] xformOpOrder = ["xformOp:translate"]
}
"""),
        Camera,
    )
    assert camera.name == "/rig/cam"
    assert world[:3, 3].tolist() == [1.0, 0.0, 5.0]
    assert (camera.projection, camera.near, camera.far) == ("perspective", 0.5, 100.0)
    assert camera.height == pytest.approx(24 / 50)
    assert camera.aspect == pytest.approx(1.5)
    assert camera.shift == pytest.approx((0.1, 0.0))


def test_orthographic_windows_are_in_tenths_of_a_unit(load: Callable[..., Any]) -> None:
    _, camera = one(
        load("""
def Camera "cam" {
    token projection = "orthographic"
    float horizontalAperture = 40
    float verticalAperture = 20
    float fStop = 2
}
"""),
        Camera,
    )
    assert (camera.projection, camera.height, camera.aspect) == ("orthographic", 2.0, 2.0)


def test_lights_become_suns_points_and_the_sky(load: Callable[..., Any]) -> None:
    imported = load("""
def Xform "turned" {
    float xformOp:rotateX = -90
    uniform token[] xformOpOrder = ["xformOp:rotateX"]
    def DistantLight "sun" {
        float inputs:intensity = 2
        float inputs:exposure = 1
        bool inputs:normalize = 1
        color3f inputs:color = (1, 0.5, 0.25)
    }
}
def SphereLight "bulb" {
    float inputs:intensity = 3
    float inputs:radius = 0.5
    float3 xformOp:scale = (2, 2, 2)
    double3 xformOp:translate = (1, 2, 3)
    uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:scale"]
}
def DomeLight "sky" {
    float inputs:intensity = 0.5
}
def DomeLight "off" {
    token visibility = "invisible"
}
""")
    _, sun = one(imported, Sun)
    np.testing.assert_allclose(sun.direction, (0, -1, 0), atol=1e-15)
    assert sun.irradiance == (4.0, 2.0, 1.0)
    assert sun.angle == pytest.approx(0.53)
    _, bulb = one(imported, PointLight)
    assert bulb.position == (1.0, 2.0, 3.0)
    assert bulb.radius == pytest.approx(1.0)
    assert bulb.intensity == pytest.approx((3 * math.pi,) * 3)
    assert one(imported, Sky)[1].radiance == (0.5, 0.5, 0.5)
    assert imported.diagnostics == []


def test_an_unnormalised_sun_shines_by_its_solid_angle(load: Callable[..., Any]) -> None:
    _, sun = one(load('def DistantLight "s" {\nfloat inputs:intensity = 50000\n}'), Sun)
    expected = 50000 * 2 * math.pi * (1 - math.cos(math.radians(0.53 / 2)))
    assert sun.irradiance[0] == pytest.approx(expected, rel=1e-4)


@pytest.mark.parametrize(
    ("light", "size", "surface"),
    [
        ("RectLight", "float inputs:width = 3", 3 * 2 * 1),
        ("DiskLight", "float inputs:radius = 2", math.pi * 4 * 2),
        ("CylinderLight", "float inputs:radius = 0.25", math.pi * 0.5 * 2),
    ],
)
@pytest.mark.parametrize("normalize", [0, 1])
def test_area_lights_emit_radiance_or_power(
    load: Callable[..., Any], light: str, size: str, surface: float, normalize: int
) -> None:
    """Radiance 5, or that over the surface; the scale is (2, 1, 1)."""
    imported = load(f"""
def {light} "l" {{
    float inputs:intensity = 5
    bool inputs:normalize = {normalize}
    {size}
    float3 xformOp:scale = (2, 1, 1)
    double3 xformOp:translate = (1, 2, 3)
    uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:scale"]
}}
""")
    _, lamp = one(imported, AreaLight)
    assert lamp.radiance[0] == pytest.approx(5 / (surface if normalize else 1.0), rel=1e-6)
    assert lamp.position == (1.0, 2.0, 3.0)
    assert imported.diagnostics == []
