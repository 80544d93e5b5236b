"""What RenderSettings, RenderProducts and cameras say of the picture."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import ovolo

STAGE = """
(
    %s
)
def Camera "wide" {
    float horizontalAperture = 20
    float verticalAperture = 10
    float horizontalApertureOffset = 2
    float focalLength = 50
}
def Camera "other" {
}
def Scope "Render" {
    def RenderSettings "settings" {
        rel camera = </wide>
        uniform int2 resolution = (100, 100)
        %s
    }
    def RenderProduct "product" {
        %s
    }
}
def Sphere "shown" {
}
def Cube "proxy" {
    uniform token purpose = "proxy"
}
"""
NAMED = 'renderSettingsPrimPath = "/Render/settings"'


def taken(load: Callable[..., Any], settings: str = "", product: str = "", **options: Any) -> Any:
    imported = load(STAGE % (NAMED, settings, product), **options)
    cameras = [node for _, node in imported.others if hasattr(node, "projection")]
    (said,) = [node for _, node in imported.others if hasattr(node, "samples")]
    return cameras[0], said, imported


@pytest.mark.parametrize(
    ("policy", "width", "height"),
    [
        # The picture is square and the window 0.4 by 0.2.
        ("expandAperture", 0.4, 0.2),  # which shows the whole window and more by itself
        ("cropAperture", 0.2, 0.2),
        ("adjustApertureWidth", 0.2, 0.2),
        ("adjustApertureHeight", 0.4, 0.4),
    ],
)
def test_windows_conform_to_the_picture(
    load: Callable[..., Any], policy: str, width: float, height: float
) -> None:
    line = f'uniform token aspectRatioConformPolicy = "{policy}"'
    camera, said, imported = taken(load, line)
    assert (camera.name, said.width, said.height) == ("/wide", 100, 100)
    assert camera.height == pytest.approx(height)
    assert camera.height * camera.aspect == pytest.approx(width)
    assert camera.shift[0] * camera.height * camera.aspect == pytest.approx(0.04)
    assert imported.diagnostics == []


def test_a_data_window_is_a_part_of_the_expanded_picture(load: Callable[..., Any]) -> None:
    camera, said, _ = taken(load, "uniform float4 dataWindowNDC = (0.5, 0.25, 1, 0.5)")
    # The whole is 0.4 by 0.4 about (0.04, 0): its part is [0.04, 0.24] by [-0.1, 0].
    assert (said.width, said.height) == (50, 25)
    width = camera.height * camera.aspect
    x, y = camera.shift[0] * width, camera.shift[1] * camera.height
    np.testing.assert_allclose([x - width / 2, x + width / 2], [0.04, 0.24], atol=1e-12)
    np.testing.assert_allclose(
        [y - camera.height / 2, y + camera.height / 2], [-0.1, 0.0], atol=1e-12
    )


def test_products_say_more_than_their_settings(load: Callable[..., Any]) -> None:
    camera, said, imported = taken(
        load,
        "rel products = [</Render/product>, </Render/none>]\nuniform float pixelAspectRatio = 2",
        'rel camera = </other>\nuniform int2 resolution = (64, 48)\ntoken productName = "a.exr"',
    )
    assert (camera.name, said.width, said.height) == ("/other", 128, 48)
    assert imported.said("128 of them across").code == "usd-attribute"
    assert imported.said("not there").primary.place.prim == "/Render/none"
    assert said.product == "a.exr"
    assert not any("`productName`" in diagnostic.message for diagnostic in imported.diagnostics)


def test_settings_include_purposes_unless_the_caller_chooses(load: Callable[..., Any]) -> None:
    line = 'uniform token[] includedPurposes = ["default", "proxy"]'
    assert taken(load, line)[2].paths() == ["/shown", "/proxy"]
    assert taken(load, line, purposes=frozenset({"default"}))[2].paths() == ["/shown"]
    assert taken(load)[2].paths() == ["/shown"]


def test_the_only_settings_below_render_need_no_name(load: Callable[..., Any]) -> None:
    one = load(STAGE % ("", "", ""))
    assert [node.width for _, node in one.others if hasattr(node, "samples")] == [100]
    more = STAGE.replace("def RenderProduct", 'def RenderSettings "more" {}\n def RenderProduct')
    two = load(more % ("", "", ""))
    assert [node.width for _, node in two.others if hasattr(node, "samples")] == []
    assert "renderSettingsPrimPath" in two.said("none is used").help


CAMERA = """#usda 1.0
def Camera "c" {
    float exposure = 1.5
    float exposure:iso = 200
    float exposure:time = 0.5
    float exposure:fStop = 2
    float exposure:responsivity = 3
    float fStop = 4
    float focusDistance = 7
    double shutter:open = -0.25
    double shutter:close = 0.25
    double3 xformOp:scale = (2, 2, 2)
    uniform token[] xformOpOrder = ["xformOp:scale"]
}
def Sphere "s" {
}
"""


def test_cameras_expose_pictures_and_keep_their_lens(tmp_path: Path) -> None:
    from pxr import Usd, UsdGeom

    path = tmp_path / "stage.usda"
    path.write_text(CAMERA)
    scene = ovolo.compile_file(path)
    stage = Usd.Stage.Open(str(path))
    camera = UsdGeom.Camera(stage.GetPrimAtPath("/c"))
    film = scene.render(width=4, height=4, samples=1)
    assert film.exposure == pytest.approx(math.log2(camera.ComputeLinearExposureScale()))
    (record,) = scene.ir.cameras
    # f/4 at 50 tenths of a unit, in units that are twice as long.
    assert record["lens_radius"] == pytest.approx(2.0 * 5.0 / 4.0 / 2.0)
    assert record["focus_distance"] == 14.0
    assert record["shutter"].tolist() == [-0.25, 0.25]
    said = {d.message for d in scene.warnings}
    assert any("fStop" in words for words in said)
    assert any("shutter" in words for words in said)
    other = tmp_path / "again.usda"
    scene.export(other)
    (again,) = ovolo.compile_file(other).ir.cameras
    for name in ("exposure", "lens_radius", "focus_distance", "shutter"):
        np.testing.assert_allclose(again[name], record[name], rtol=1e-6)
