"""Files of MaterialX that stages refer to, with and without the package that reads them."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from pxr import Sdf

DOCUMENT = """<?xml version="1.0"?>
<materialx version="1.38" colorspace="lin_rec709">
  <nodegraph name="wood">
    <tiledimage name="grain" type="color3">
      <input name="file" type="filename" value="tex/wood.png" colorspace="srgb_texture" />
      <input name="uvtiling" type="vector2" value="2, 3" />
      <input name="vaddressmode" type="string" value="clamp" />
    </tiledimage>
    <image name="bumps" type="vector3">
      <input name="file" type="filename" value="tex/bumps.png" />
    </image>
    <normalmap name="bent" type="vector3">
      <input name="in" type="vector3" nodename="bumps" />
    </normalmap>
    <noise2d name="noise" type="float" />
    <output name="color" type="color3" nodename="grain" />
    <output name="normal" type="vector3" nodename="bent" />
    <output name="rough" type="float" nodename="noise" />
  </nodegraph>
  <standard_surface name="wooden" type="surfaceshader">
    <input name="base" type="float" value="0.5" />
    <input name="base_color" type="color3" nodegraph="wood" output="color" />
    <input name="normal" type="vector3" nodegraph="wood" output="normal" />
    <input name="coat" type="float" value="0.25" />
  </standard_surface>
  <surfacematerial name="Wood" type="material">
    <input name="surfaceshader" type="surfaceshader" nodename="wooden" />
  </surfacematerial>
  <UsdPreviewSurface name="painted" type="surfaceshader">
    <input name="diffuseColor" type="color3" value="0.5, 0, 1" colorspace="srgb_texture" />
    <input name="metallic" type="float" value="1" />
    <input name="roughness" type="float" nodegraph="wood" output="rough" />
  </UsdPreviewSurface>
  <surfacematerial name="Paint" type="material">
    <input name="surfaceshader" type="surfaceshader" nodename="painted" />
  </surfacematerial>
</materialx>
"""
STAGE = """
def Scope "looks" (references = @./look.mtlx@</MaterialX/Materials>) {
}
def Sphere "wood" (apiSchemas = ["MaterialBindingAPI"]) {
    rel material:binding = </looks/Wood>
}
def Xform "paint" (references = @./look.mtlx@) {
    def Sphere "ball" (apiSchemas = ["MaterialBindingAPI"]) {
        rel material:binding = </paint/Materials/Paint>
    }
}
"""


@pytest.fixture
def look(tmp_path: Path) -> Path:
    path = tmp_path / "look.mtlx"
    path.write_text(DOCUMENT)
    return path


def test_references_to_files_bring_their_materials(look: Path, load: Callable[..., Any]) -> None:
    imported = load(STAGE)
    wood = imported.leaf("/wood").material
    color, normal = sorted(wood.textures, key=lambda texture: texture.parameter)
    assert (color.parameter, color.file) == ("diffuse", str(look.parent / "tex/wood.png"))
    assert (color.color_space, color.wrap) == ("sRGB", ("repeat", "clamp"))
    assert (color.matrix, color.scale[:3]) == ((2.0, 0.0, 0.0, 0.0, 3.0, 0.0), (0.5, 0.5, 0.5))
    assert (normal.parameter, normal.color_space) == ("normal", "raw")
    assert (normal.scale[:3], normal.bias[:3]) == ((2.0,) * 3, (-1.0,) * 3)
    assert wood.clearcoat == 0.25
    paint = imported.leaf("/paint/ball").material
    assert paint.diffuse == pytest.approx((0.21404, 0.0, 1.0), abs=1e-5)
    assert paint.metallic == 1.0
    assert "`inputs:roughness` comes from a network" in imported.said("roughness").message
    assert not any("usd-core" in diagnostic.message for diagnostic in imported.diagnostics)


@pytest.mark.usefixtures("look")
def test_layers_are_left_as_they_were(load: Callable[..., Any], tmp_path: Path) -> None:
    (tmp_path / "stage.usda").write_text("#usda 1.0\n" + STAGE)
    layer = Sdf.Layer.FindOrOpen(str(tmp_path / "stage.usda"))
    before = layer.ExportToString()
    load(tmp_path / "stage.usda")
    assert layer.ExportToString() == before


@pytest.mark.usefixtures("look")
def test_without_the_package_there_is_one_warning_with_its_mend(
    load: Callable[..., Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "MaterialX", None)
    (said,) = load(STAGE).diagnostics
    assert (said.code, said.severity) == ("usd-material", "warning")
    assert said.help == "install the package that reads them: pip install 'ovolo[materialx]'"


@pytest.mark.parametrize(
    ("content", "why"),
    [
        (b"<materialx", "is not read"),
        (b"\xff\xfe<materialx/>", "its text is not UTF-8"),
        (None, "it cannot be found"),
    ],
)
def test_files_that_cannot_be_read_are_said(
    content: bytes | None, why: str, load: Callable[..., Any], tmp_path: Path
) -> None:
    if content is not None:
        (tmp_path / "look.mtlx").write_bytes(content)
    imported = load(STAGE)
    assert imported.paths() == ["/wood", "/paint/ball"]
    assert imported.said(why).code == "usd-material"


def test_textures_of_files_stay_within_the_root(
    look: Path, load: Callable[..., Any], tmp_path: Path
) -> None:
    look.write_text(DOCUMENT.replace("tex/bumps.png", "../../bumps.png"))
    imported = load(STAGE, root=tmp_path)
    assert imported.codes() == ["usd-outside"]
    assert "`../../bumps.png`" in imported.diagnostics[0].message
