"""Pictures of textured squares, by value."""

from __future__ import annotations

import shutil
import subprocess
import sys
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import ovolo
from runtime import textures
from tests.runtime.textured_quad import (
    ST,
    camera,
    compiled,
    glow,
    material,
    mesh,
    shown,
    write_image,
)

FILE = "asset inputs:file = @t.png@"
CLAMP = 'token inputs:wrapS = "clamp"\n        token inputs:wrapT = "clamp"'
RAW = 'token inputs:sourceColorSpace = "raw"'
GREY = np.array([[[10], [60], [110], [160]], [[20], [70], [120], [170]]], np.uint8)


def linear(codes: NDArray[Any]) -> NDArray[np.float64]:
    x = np.asarray(codes) / 255.0
    return np.where(x <= 0.04045, x / 12.92, ((x + 0.055) / 1.055) ** 2.4)


def test_a_pixel_at_a_texel_shows_the_texel_first_row_on_top(tmp_path: Path) -> None:
    texels = np.random.default_rng(1).integers(0, 256, (4, 4, 3), np.uint8)
    write_image(tmp_path / "t.png", texels)
    film = shown(tmp_path, glow(f"{FILE}\n{CLAMP}"), mesh())
    np.testing.assert_allclose(film.color[..., :3], linear(texels), atol=1e-5)
    film = shown(tmp_path, glow(f"{FILE}\n{CLAMP}\n{RAW}"), mesh())
    np.testing.assert_allclose(film.color[..., :3], texels / 255.0, atol=1e-5)
    assert film.warnings == ()


@pytest.mark.parametrize("kind", ["uint16", "float32"])
def test_numbers_of_more_than_bytes_are_linear_unless_said(tmp_path: Path, kind: str) -> None:
    texels = np.random.default_rng(2).uniform(0, 1, (4, 4, 3)).astype(np.float32)
    stored = (texels * 65535).astype(np.uint16) if kind == "uint16" else texels
    name = "t.png" if kind == "uint16" else "t.exr"
    write_image(tmp_path / name, stored)
    file = f"asset inputs:file = @{name}@\n{CLAMP}"
    film = shown(tmp_path, glow(file), mesh())
    np.testing.assert_allclose(film.color[..., :3], texels, atol=2e-5)
    film = shown(tmp_path, glow(file + '\ntoken inputs:sourceColorSpace = "sRGB"'), mesh())
    np.testing.assert_allclose(film.color[..., :3], linear(texels * 255), atol=1e-4)


@pytest.mark.parametrize(
    ("channels", "output", "expected"),
    [
        (1, "rgb", (0.2, 0.2, 0.2)),
        (1, "a", (1, 1, 1)),
        (2, "rgb", (0.2, 0.2, 0.2)),
        (2, "a", (0.4, 0.4, 0.4)),
        (4, "rgb", (0.2, 0.4, 0.6)),
        (4, "g", (0.4, 0.4, 0.4)),
        (4, "a", (0.8, 0.8, 0.8)),
    ],
)
def test_outputs_by_channel(
    tmp_path: Path, channels: int, output: str, expected: tuple[float, ...]
) -> None:
    """Colours are those of the file, whatever its alpha; grey is every colour."""
    values = np.array([51, 102, 153, 204], np.uint8)[:channels]
    write_image(tmp_path / "t.png", np.broadcast_to(values, (2, 2, channels)))
    film = shown(tmp_path, glow(f"{FILE}\n{CLAMP}\n{RAW}", output), mesh(), size=1)
    np.testing.assert_allclose(film.color[0, 0, :3], expected, atol=1e-5)


@pytest.mark.parametrize(
    ("wrap", "expected"),
    [
        ("black", [0, 0, 10, 60, 110, 160, 0, 0]),
        ("useMetadata", [0, 0, 10, 60, 110, 160, 0, 0]),
        ("clamp", [10, 10, 10, 60, 110, 160, 160, 160]),
        ("repeat", [110, 160, 10, 60, 110, 160, 10, 60]),
        ("mirror", [60, 10, 10, 60, 110, 160, 160, 110]),
    ],
)
def test_wraps(tmp_path: Path, wrap: str, expected: list[int]) -> None:
    """Coordinates from -1/2 to 3/2 over eight pixels and four texels: a texel for each pixel."""
    write_image(tmp_path / "t.png", GREY[:1])
    body = "texCoord2f[] primvars:st = [(-0.5, 0), (1.5, 0), (1.5, 1), (-0.5, 1)]"
    body += '(interpolation = "faceVarying")'
    texture = f'{FILE}\n{RAW}\ntoken inputs:wrapT = "clamp"\ntoken inputs:wrapS = "{wrap}"'
    scene = compiled(tmp_path, camera(), glow(texture), mesh(body))
    row = scene.render(width=8, height=8, samples=1).color[4, :, 0]
    np.testing.assert_allclose(row, np.array(expected) / 255.0, atol=1e-5)


def test_between_texels_values_are_bilinear_after_decoding(tmp_path: Path) -> None:
    write_image(tmp_path / "t.png", np.repeat(GREY, 3, axis=2))
    film = shown(tmp_path, glow(f"{FILE}\n{CLAMP}"), mesh(), size=1)
    expected = linear(GREY[:, 1:3, 0]).mean()
    np.testing.assert_allclose(film.color[0, 0, :3], expected, rtol=1e-5)


def test_scale_and_bias_hold_for_texels(tmp_path: Path) -> None:
    write_image(tmp_path / "t.png", np.full((1, 1, 4), 51, np.uint8))
    texture = f"""{FILE}\n{RAW}\n{CLAMP}
        float4 inputs:scale = (20, 2, 1, 1)
        float4 inputs:bias = (0, 0.5, -0.1, 1)"""
    film = shown(tmp_path, glow(texture), mesh(), size=1)
    np.testing.assert_allclose(film.color[0, 0, :3], (4, 0.9, 0.1), rtol=1e-6)


def test_a_transform_scales_then_turns_then_moves(tmp_path: Path) -> None:
    """The middle of each pixel, taken through the same by hand, is the middle of a texel."""
    texels = np.random.default_rng(3).integers(0, 256, (4, 4, 1), np.uint8)
    write_image(tmp_path / "t.png", texels)
    transform = """def Shader "x" {
        uniform token info:id = "UsdTransform2d"
        float2 inputs:in.connect = </m/r.outputs:result>
        float2 inputs:scale = (0.5, 2)
        float inputs:rotation = 90
        float2 inputs:translation = (0.25, 0.125)
        float2 outputs:result
    }"""
    wraps = 'token inputs:wrapS = "repeat"\ntoken inputs:wrapT = "repeat"'
    prim = glow(f"{FILE}\n{RAW}\n{wraps}", more=transform)
    prim = prim.replace("inputs:st.connect = </m/r", "inputs:st.connect = </m/x")
    film = shown(tmp_path, prim, mesh(), size=8)
    u, v = np.meshgrid((np.arange(8) + 0.5) / 8, 1 - (np.arange(8) + 0.5) / 8)
    x, y = 0.25 - 2 * v, 0.125 + 0.5 * u
    # Bilinear, by hand.
    x, y = x * 4 - 0.5, (1 - y) * 4 - 0.5
    left, top = np.floor(x).astype(int), np.floor(y).astype(int)
    across, down = x - left, y - top
    expected = sum(
        (across if i else 1 - across)
        * (down if j else 1 - down)
        * texels[(top + j) % 4, (left + i) % 4, 0]
        for i in (0, 1)
        for j in (0, 1)
    )
    np.testing.assert_allclose(film.color[..., 0], expected / 255.0, atol=1e-5)


def test_a_texture_without_coordinates_is_one_texel(tmp_path: Path) -> None:
    """As Storm has it: at (0, 0), or where `st` says."""
    write_image(tmp_path / "t.png", GREY)
    for st, expected in (("", 20), ("float2 inputs:st = (0.875, 0.75)", 160)):
        prim = glow(f"{FILE}\n{RAW}\n{CLAMP}\n{st}")
        prim = prim.replace("float2 inputs:st.connect = </m/r.outputs:result>", "")
        film = shown(tmp_path, prim, mesh(""), size=1)
        np.testing.assert_allclose(film.color[0, 0, 0], expected / 255, atol=1e-5)


def test_a_missing_picture_is_its_fallback_and_a_warning(tmp_path: Path) -> None:
    texture = f"{FILE}\nfloat4 inputs:fallback = (0.25, 0.5, 0.75, 1)"
    film = shown(tmp_path, glow(texture), mesh(), size=1)
    np.testing.assert_allclose(film.color[0, 0, :3], (0.25, 0.5, 0.75))
    assert [warning.code for warning in film.warnings] == ["texture-unreadable"]
    assert "t.png" in film.warnings[0].message


def test_damaged_and_huge_pictures_are_not_read(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "t.png").write_bytes(b"\x89PNG\r\n\x1a\n no more")
    assert len(shown(tmp_path, glow(FILE), mesh(), size=1).warnings) == 1
    write_image(tmp_path / "t.png", GREY)
    assert shown(tmp_path, glow(FILE), mesh(), size=1).warnings == ()
    monkeypatch.setattr(textures, "MAX_TEXELS", 7)
    assert "more than 7" in shown(tmp_path, glow(FILE), mesh(), size=1).warnings[0].message
    monkeypatch.undo()
    monkeypatch.setattr(textures, "MAX_BYTES", 7)
    assert "all textures" in shown(tmp_path, glow(FILE), mesh(), size=1).warnings[0].message


@pytest.mark.parametrize("tiles", ["./t.<UDIM>.png", "t.<UDIM>.png"])
def test_pictures_in_packages_and_in_tiles(tmp_path: Path, tiles: str) -> None:
    for number, value in ((1001, 51), (1002, 102), (1011, 153)):
        write_image(tmp_path / f"t.{number}.png", np.full((2, 2, 1), value, np.uint8))
    body = "texCoord2f[] primvars:st = [(0, 0), (2, 0), (2, 2), (0, 2)]"
    body += '(interpolation = "vertex")'
    texture = f"asset inputs:file = @{tiles}@\n{RAW}"
    texture += "\nfloat4 inputs:fallback = (0.9, 0.9, 0.9, 1)"
    film = shown(tmp_path, glow(texture), mesh(body), size=2)
    np.testing.assert_allclose(film.color[..., 0], [[0.6, 0.9], [0.2, 0.4]], atol=1e-5)
    shutil.copy(tmp_path / "t.1001.png", tmp_path / "t.png")
    prims = camera(), glow(f"{FILE}\n{RAW}\n{CLAMP}"), mesh()
    (tmp_path / "root.usda").write_text("#usda 1.0\n" + "".join(prims))
    with zipfile.ZipFile(tmp_path / "stage.usdz", "w", zipfile.ZIP_STORED) as package:
        for name in ("root.usda", "t.png"):
            package.write(tmp_path / name, name)
    film = ovolo.compile_file(tmp_path / "stage.usdz").render(width=1, height=1, samples=1)
    np.testing.assert_allclose(film.color[0, 0, 0], 0.2)


def test_opacity_blends_or_cuts_out(tmp_path: Path) -> None:
    """Half a pane at threshold 0.3 is there, the other half is not; without one both blend."""
    write_image(tmp_path / "t.png", np.array([[[51], [102]]], np.uint8))
    inputs = """color3f inputs:diffuseColor = (0, 0, 0)
        color3f inputs:emissiveColor = (1, 1, 1)
        float inputs:opacity.connect = </m/t.outputs:r>"""
    texture = f"{FILE}\n{RAW}\n{CLAMP}"
    film = shown(tmp_path, material(inputs, texture), mesh(), size=2)
    np.testing.assert_allclose(film.color[0, :, 3], (0.2, 0.4), rtol=1e-6)
    inputs += "\nfloat inputs:opacityThreshold = 0.3"
    film = shown(tmp_path, material(inputs, texture), mesh(), size=2)
    np.testing.assert_array_equal(film.color[0, :, 3], (0, 1))


def test_light_passes_where_the_texture_lets_it(tmp_path: Path) -> None:
    """A cut-out pane above a white floor: its shadow has the holes of the texture."""
    write_image(tmp_path / "t.png", np.array([[[0], [255]], [[255], [0]]], np.uint8))
    inputs = """float inputs:opacity.connect = </m/t.outputs:r>
        float inputs:opacityThreshold = 0.5"""
    light = """
def DistantLight "sun" { float inputs:intensity = 3.14159265 }
def Mesh "floor" {
    point3f[] points = [(2, 0, -1), (3, 0, -1), (3, 1, -1), (2, 1, -1)]
    int[] faceVertexCounts = [4]
    int[] faceVertexIndices = [0, 1, 2, 3]
    uniform token subdivisionScheme = "none"
    color3f[] primvars:displayColor = [(1, 1, 1)]
}
"""
    # The light comes along (1, 0, -0.5): from the pane at x in 0 … 1 to the floor at 2 … 3.
    light = light.replace(
        "3.14159265 }",
        """3.14159265
    float inputs:angle = 0
    float3 xformOp:rotateXYZ = (0, -63.43494882, 0)
    uniform token[] xformOpOrder = ["xformOp:rotateXYZ"]
}""",
    )
    floor = camera().replace("(0.5, 0.5, 5)", "(2.5, 0.5, 5)")
    texture = f"{FILE}\n{RAW}\n{CLAMP}"
    scene = compiled(tmp_path, floor, material(inputs, texture), mesh(), light)
    lit = scene.render(width=4, height=4, samples=1).color[..., 0] > 0.05
    expected = np.kron([[1, 0], [0, 1]], np.ones((2, 2)))
    np.testing.assert_array_equal(lit, expected)


def test_a_normal_map_turns_the_surface_towards_the_light(tmp_path: Path) -> None:
    """Tangent space is that of the coordinates: +x of the map is where u grows."""
    normal = np.array([0.6, 0.0, 0.8])
    texel = np.round((normal + 1) / 2 * 255).astype(np.uint8)
    write_image(tmp_path / "t.png", texel.reshape(1, 1, 3))
    inputs = """color3f inputs:diffuseColor = (1, 1, 1)
        normal3f inputs:normal.connect = </m/t.outputs:rgb>"""
    texture = f"""{FILE}\n{RAW}\n{CLAMP}
        float4 inputs:scale = (2, 2, 2, 1)
        float4 inputs:bias = (-1, -1, -1, 0)"""
    sun = """
def DistantLight "sun" {
    float inputs:intensity = 3.14159265
    float inputs:angle = 0
    float3 xformOp:rotateXYZ = (0, 30, 0)
    uniform token[] xformOpOrder = ["xformOp:rotateXYZ"]
}
"""
    towards = np.array([0.5, 0.0, np.sqrt(0.75)])
    flat = texel / 255.0 * 2 - 1
    flat /= np.linalg.norm(flat)
    for st, bent in (
        (ST, flat),
        (ST.replace("(0, 0), (1, 0), (1, 1), (0, 1)", "(1, 0), (0, 0), (0, 1), (1, 1)"),
         flat * (-1, 1, 1)),
        (ST.replace("(0, 0), (1, 0), (1, 1), (0, 1)", "(0, 0), (0, 1), (1, 1), (1, 0)"),
         flat[[1, 0, 2]]),
    ):  # fmt: skip
        film = shown(tmp_path, material(inputs, texture), mesh(st), sun, size=1)
        np.testing.assert_allclose(film.color[0, 0, 0], bent @ towards, atol=1e-4)


def test_a_scene_without_textures_loads_no_reader_of_pictures(tmp_path: Path) -> None:
    (tmp_path / "s.ovo").write_text("sphere()")
    lines = "import ovolo, sys; ovolo.compile_file('s.ovo').render(width=2, height=2, samples=1); "
    lines += "assert 'OpenImageIO' not in sys.modules"
    path = str(Path(ovolo.__file__).parent.parent)
    subprocess.run(
        [sys.executable, "-c", f"import sys; sys.path.insert(0, {path!r}); {lines}"],
        cwd=tmp_path,
        check=True,
    )
