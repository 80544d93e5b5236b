"""Skies with pictures: where they are, what they light, and what is said of those that are not.

Longitude and latitude are those of OpenEXR's latitude-longitude maps, which UsdLux takes over:
https://openusd.org/release/user_guides/schemas/usdLux/DomeLight_1.html
"""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

import ovolo
from compiler.ir_text import print_ir
from runtime import textures
from runtime._kernel import instruction_sets
from runtime.render import render
from tests.runtime.textured_quad import material, write_image

AXES = {name: np.array(v, float) for name, v in zip("xyz", np.eye(3), strict=True)}
AXES |= {f"-{name}": -v for name, v in list(AXES.items())}


def in_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, text: str) -> ovolo.Scene:
    monkeypatch.chdir(tmp_path)
    return ovolo.compile(text)


def seen(scene: ovolo.Scene, camera: str | int | None = None) -> NDArray[np.float32]:
    """The colour in the middle of a picture."""
    film = scene.render(width=1, height=1, samples=1, camera=camera)
    return film.color[0, 0, :3]


def looking(towards: NDArray[np.float64], name: str) -> str:
    up = AXES["z"] if abs(towards[1]) > 0.9 else AXES["y"]
    at, above = (f"({x}, {y}, {z})" for x, y, z in (towards, up))
    return f'camera(from: (0, 0, 0), at: {at}, up: {above}, fov: 0.01deg, name: "{name}")\n'


CAMERAS = "".join(looking(v, name) for name, v in AXES.items())


def four_colors(path: Path) -> dict[str, NDArray[np.float32]]:
    """A map whose colours are by the word of OpenEXR; the colour that is due in each direction.

    Longitude is +π at the left edge and -π at the right one, and π/2 is +x; latitude is π/2 at the
    top, which is +y.
    """
    rows, columns = 16, 32
    longitude = math.pi * (1.0 - 2.0 * (np.arange(columns) + 0.5) / columns)
    latitude = math.pi * (0.5 - (np.arange(rows) + 0.5) / rows)
    colors = np.random.default_rng(5).uniform(0.1, 5.0, (6, 3)).astype(np.float32)
    texels = np.empty((rows, columns, 3), np.float32)
    for k, middle in enumerate((0.0, math.pi / 2, math.pi, -math.pi / 2)):
        apart = np.abs(np.mod(longitude - middle + math.pi, 2 * math.pi) - math.pi)
        texels[:, apart < math.pi / 4] = colors[k]
    texels[latitude > 1.0], texels[latitude < -1.0] = colors[4], colors[5]
    write_image(path, texels)
    return dict(zip(("z", "x", "-z", "-x", "y", "-y"), colors, strict=True))


def test_directions_are_those_of_openexr(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    due = four_colors(tmp_path / "sky.exr")
    scene = in_folder(tmp_path, monkeypatch, 'sky(texture: "sky.exr")\n' + CAMERAS)
    for name, color in due.items():
        np.testing.assert_allclose(seen(scene, name), color, rtol=1e-5)


@pytest.mark.parametrize(
    ("transform", "moved"),
    [
        ("rotate_y(90deg)", {"z": "x", "x": "-z", "y": "y"}),
        ("rotate_x(90deg).scale(3, 1, 1)", {"y": "z", "z": "-y", "x": "x"}),
        ("translate(1e200, 0, 0)", {"z": "z", "x": "x", "y": "y"}),
        ("scale(5)", {"z": "z", "x": "x", "y": "y"}),
        ("scale(-1, 1, 1)", {"z": "z", "x": "-x", "y": "y"}),
    ],
)
def test_groups_turn_and_mirror_skies(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, transform: str, moved: dict[str, str]
) -> None:
    due = four_colors(tmp_path / "sky.exr")
    program = f'{{ sky(texture: "sky.exr") }}.{transform}\n{CAMERAS}'
    scene = in_folder(tmp_path, monkeypatch, program)
    for own, world in moved.items():
        np.testing.assert_allclose(seen(scene, world), due[own], rtol=1e-5)


def test_of_a_shear_the_nearest_rotation_counts(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    four_colors(tmp_path / "sky.exr")
    program = 'sky(texture: "sky.exr").rotate_z(20deg).shear(xy: 0.5).scale(1, 7, 2)'
    scene = in_folder(tmp_path, monkeypatch, program)
    axes = np.column_stack([scene.ir.lights[0][name] for name in "uvw"])
    np.testing.assert_allclose(axes.T @ axes, np.eye(3), atol=1e-14)
    c, s = math.cos(math.radians(20)), math.sin(math.radians(20))
    linear = (
        np.diag([1, 7, 2])
        @ [[1, 0.5, 0], [0, 1, 0], [0, 0, 1]]
        @ [[c, -s, 0], [s, c, 0], [0, 0, 1]]
    )
    # The polar decomposition: what is left is symmetric and positive.
    rest = axes.T @ linear
    np.testing.assert_allclose(rest, rest.T, atol=1e-12)
    assert (np.linalg.eigvalsh(rest) > 0).all()


def test_a_sky_pressed_flat_is_left_out(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    four_colors(tmp_path / "sky.exr")
    scene = in_folder(
        tmp_path, monkeypatch, 'sphere()\nsky(texture: "sky.exr").scale(1, 0, 1)\nsky().scale(0)'
    )
    assert [w.code for w in scene.warnings] == ["scene-singular-transform"]
    assert len(scene.ir.lights) == 1


@pytest.mark.parametrize(
    ("schema", "axis", "up", "turned"),
    [
        ("DomeLight", None, "Y", False),
        ("DomeLight", None, "Z", False),
        ("DomeLight_1", None, "Y", False),
        ("DomeLight_1", None, "Z", True),
        ("DomeLight_1", "scene", "Y", False),
        ("DomeLight_1", "scene", "Z", True),
        ("DomeLight_1", "Y", "Z", False),
        ("DomeLight_1", "Z", "Y", True),
    ],
)
def test_one_bright_texel_lights_by_the_pole(
    tmp_path: Path, schema: str, axis: str | None, up: str, turned: bool
) -> None:
    """Its light, and the shadow of a ball, are where the schema has them."""
    # Latitude 45° and longitude 90°: +x and +y of the dome's own.
    texels = np.zeros((256, 512, 3), np.float32)
    texels[63:65, 127:129] = 1000.0
    write_image(tmp_path / "sky.exr", texels)
    own = np.array([1.0, 1.0, 0.0]) / math.sqrt(2)
    # A Z pole is the dome's +Y, and -Y is where its +Z is.
    light = np.array([own[0], -own[2], own[1]]) if turned else own
    said = f'uniform token poleAxis = "{axis}"' if axis else ""
    (tmp_path / "stage.usda").write_text(f"""#usda 1.0
(
    upAxis = "{up}"
)
def {schema} "dome" {{
    asset inputs:texture:file = @sky.exr@
    float inputs:intensity = 2
    float inputs:exposure = 1
    color3f inputs:color = (1, 0.5, 0.25)
    {said}
}}
{material("color3f inputs:diffuseColor = (0.5, 0.5, 0.5)")}
{ball("ball", 5.0 * light, 0.5)}
{ball("ground", 0.0 * light, 1.0)}
{usd_camera("down", 2.0 * light, light)}
{usd_camera("up", 9.0 * light, -light)}
""")
    scene = ovolo.compile_file(tmp_path / "stage.usda")
    assert scene.warnings == ()
    # Between the ball and the ground: the ball's shadow is in the middle.
    down = scene.render(camera="/down", width=31, height=31, samples=64)
    place = np.hypot(*np.mgrid[-15:16, -15:16]) * 1.9 / 31
    power = 4000.0 * (4 * math.pi / 512) * (2 * math.pi / 256) * math.sqrt(0.5)
    due = 0.5 / math.pi * power * np.sqrt(np.maximum(0.0, 1.0 - place**2))
    lit = (place > 0.65) & (place < 0.9)
    assert down.color[..., 0][place < 0.3].max() < 1e-3 * due.max()
    light_there = down.color[lit][:, :3].mean(0)
    np.testing.assert_allclose(light_there, due[lit].mean() * np.array([1, 0.5, 0.25]), rtol=0.03)
    np.testing.assert_allclose(seen(scene, "/up"), (4000, 2000, 1000), rtol=1e-3)


def ball(name: str, middle: NDArray[np.float64], radius: float) -> str:
    x, y, z = middle
    return f"""def Sphere "{name}" (prepend apiSchemas = ["MaterialBindingAPI"]) {{
    double radius = {radius}
    rel material:binding = </m>
    double3 xformOp:translate = ({x}, {y}, {z})
    uniform token[] xformOpOrder = ["xformOp:translate"]
}}
"""


def usd_camera(name: str, place: NDArray[np.float64], back: NDArray[np.float64]) -> str:
    """An orthographic camera that looks against `back` at a window of 1.9."""
    side = np.cross(back, (0.1, 0.2, 0.3))
    side /= np.linalg.norm(side)
    rows = ", ".join(
        f"({x}, {y}, {z}, {w})"
        for (x, y, z), w in zip(
            (side, np.cross(back, side), back, place), (0, 0, 0, 1), strict=True
        )
    )
    return f"""def Camera "{name}" {{
    token projection = "orthographic"
    float horizontalAperture = 19
    float verticalAperture = 19
    matrix4d xformOp:transform = ( {rows} )
    uniform token[] xformOpOrder = ["xformOp:transform"]
}}
"""


def test_a_texture_of_one_color_is_the_sky_of_that_color(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    write_image(tmp_path / "sky.exr", np.full((3, 5, 3), (0.5, 1.0, 2.0), np.float32))
    scenery = """
sphere().translate(0, 1, 0).material(metal(rgb(0.9, 0.6, 0.3), roughness: 0.2))
plane().material(plastic(rgb(0.2, 0.5, 0.7)))
camera(from: (3, 2, 4), at: (0, 0.7, 0))
"""
    films = []
    for sky in ('sky(color: rgb(2, 2, 1), texture: "sky.exr")', "sky(color: rgb(1, 2, 2))"):
        scene = in_folder(tmp_path, monkeypatch, sky + scenery)
        films.append(scene.render(width=24, height=16, samples=1024).color)
    textured, uniform = films
    nothing = uniform[..., 0] == 1.0
    assert nothing.any()
    np.testing.assert_allclose(textured[nothing], uniform[nothing], rtol=1e-6)
    np.testing.assert_allclose(textured, uniform, rtol=0.05, atol=0.08)
    np.testing.assert_allclose(textured.mean((0, 1)), uniform.mean((0, 1)), rtol=2e-3)


def test_light_is_the_integral_of_the_picture(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Irradiance of tilted planes, drawn where it is bright, against a sum over all texels."""
    random = np.random.default_rng(3)
    rows, columns = 16, 32
    texels = (10.0 ** random.uniform(-2, 2, (rows, columns, 3))).astype(np.float32)
    write_image(tmp_path / "sky.exr", texels)
    fine = 16
    x = (np.arange(columns * fine) + 0.5) / fine - 0.5
    y = np.clip((np.arange(rows * fine) + 0.5) / fine - 0.5, 0, rows - 1)
    left, top = np.floor(x).astype(int), np.floor(y).astype(int)
    across, down = (x - left)[None, :, None], (y - top)[:, None, None]
    right, below = (left + 1) % columns, np.minimum(top + 1, rows - 1)
    line = texels[:, left % columns] * (1 - across) + texels[:, right] * across
    radiance = line[top] * (1 - down) + line[below] * down
    theta = math.pi * (np.arange(rows * fine) + 0.5)[:, None] / (rows * fine)
    longitude = math.pi * (1 - 2 * (np.arange(columns * fine) + 0.5) / (columns * fine))
    towards = np.stack(np.broadcast_arrays(
        np.sin(theta) * np.sin(longitude), np.cos(theta), np.sin(theta) * np.cos(longitude)
    ), axis=-1)  # fmt: skip
    solid = 2 * math.pi**2 * np.sin(theta) / (rows * columns * fine**2)
    for tilt in (0, 70, 160):
        program = f"""sky(texture: "sky.exr")
plane().rotate_x({tilt}deg).material(matte(rgb(1, 1, 1)))
{{ camera(from: (0, 5, 0), at: (0, 0, 0), up: (0, 0, -1), height: 0.001) }}.rotate_x({tilt}deg)
"""
        scene = in_folder(tmp_path, monkeypatch, program)
        angle = math.radians(tilt)
        normal = np.array([0.0, math.cos(angle), math.sin(angle)])
        cosine = np.maximum(0.0, towards @ normal)[..., None] * solid[..., None]
        due = (radiance * cosine).sum((0, 1)) / math.pi
        film = scene.render(width=8, height=8, samples=512)
        np.testing.assert_allclose(film.color[..., :3].mean((0, 1)), due, rtol=0.01)


def test_programs_and_stages_of_a_sky_come_back(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from compiler.ir_binary import content_hash, read_ir, write_ir
    from compiler.ir_parse import parse_ir

    due = four_colors(tmp_path / "sky.exr")
    four_colors(tmp_path / "other.exr")
    program = 'sky(color: rgb(1, 0.5, 2), texture: "sky.exr").rotate_x(90deg)\n' + CAMERAS
    scene = in_folder(tmp_path, monkeypatch, program)
    scene.export("out.usda")
    again = ovolo.compile_file("out.usda")
    assert again.warnings == ()
    np.testing.assert_allclose(seen(again, 1), due["-z"] * (1, 0.5, 2), rtol=1e-5)  # y
    again.export("twice.usda")
    assert print_ir(ovolo.compile_file("twice.usda").ir) == print_ir(again.ir)
    text = print_ir(scene.ir)
    assert 'sky "sky.exr" radiance 1 0.5 2 v 0 0 1 w 0 -1 0' in text
    assert print_ir(parse_ir(text)) == text
    write_ir(scene.ir, tmp_path / "scene.ir")
    assert print_ir(read_ir(tmp_path / "scene.ir")) == text
    other = ovolo.compile(program.replace("sky.exr", "other.exr"))
    assert content_hash(other.ir) != content_hash(scene.ir)


def test_a_stage_of_a_sky_is_a_program(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from compiler.compilation import compile_path
    from compiler.program import write_program

    due = four_colors(tmp_path / "sky.exr")
    (tmp_path / "stage.usda").write_text("""#usda 1.0
def DomeLight_1 "dome" {
    asset inputs:texture:file = @sky.exr@
    uniform token poleAxis = "Z"
}
""")
    written = write_program(compile_path(tmp_path / "stage.usda"))
    assert not written.unsaid
    scene = in_folder(tmp_path, monkeypatch, written.text + CAMERAS)
    np.testing.assert_allclose(seen(scene, "z"), due["y"], rtol=1e-5)


@pytest.mark.parametrize(
    ("content", "words"),
    [(b"no picture", "cannot be read"), (None, "texels, more than 3")],
)
def test_a_picture_that_is_not_read_leaves_the_color(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, content: bytes | None, words: str
) -> None:
    four_colors(tmp_path / "sky.exr")
    if content is None:
        monkeypatch.setattr(textures, "MAX_TEXELS", 3)
    else:
        (tmp_path / "sky.exr").write_bytes(content)
    scene = in_folder(tmp_path, monkeypatch, 'sky(color: rgb(1, 2, 3), texture: "sky.exr")')
    film = scene.render(width=1, height=1, samples=1)
    (warning,) = film.warnings
    assert warning.code == "texture-unreadable"
    assert words in warning.message
    np.testing.assert_allclose(film.color[0, 0, :3], (1, 2, 3))


def test_a_picture_of_several_skies_takes_memory_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    write_image(tmp_path / "s.exr", np.ones((8, 16, 3), np.float32))
    monkeypatch.setattr(textures, "MAX_BYTES", 8 * 16 * 3 * 4)
    skies = 'sky(texture: "s.exr")\nsky(texture: "s.exr", color: rgb(2, 2, 2))\n'
    scene = in_folder(tmp_path, monkeypatch, skies + looking(AXES["x"], "x"))
    film = scene.render(width=1, height=1, samples=1)
    assert film.warnings == ()
    np.testing.assert_allclose(film.color[0, 0, :3], 3.0, rtol=1e-6)


def test_a_program_reads_the_pictures_of_its_root_only(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    due = four_colors(tmp_path / "sky.exr")
    (tmp_path / "inner").mkdir()
    monkeypatch.chdir("/")
    scene = ovolo.compile('sky(texture: "sky.exr")\n' + CAMERAS, root=tmp_path)
    np.testing.assert_allclose(seen(scene, "x"), due["x"], rtol=1e-5)
    with pytest.raises(ovolo.CompileError) as refused:
        ovolo.compile('sky(texture: "../sky.exr")', root=tmp_path / "inner")
    assert [d.code for d in refused.value.diagnostics] == ["file-outside"]


def test_neither_threads_nor_instruction_sets_change_a_picture_under_a_sky(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    four_colors(tmp_path / "sky.exr")
    program = """
        camera(from: (0, 2, 6), at: (0, 0.5, 0), fov: 40deg)
        sky(texture: "sky.exr").rotate_y(40deg)
        plane().translate(0, -1, 0).material(matte(rgb(0.4, 0.5, 0.6)))
        sphere().material(metal(rgb(0.9, 0.8, 0.7), roughness: 0.2))
        box(bevel: 0.1).translate(1.6, 0, 0)
    """
    scene = in_folder(tmp_path, monkeypatch, program)
    first, *others = (
        render(scene.ir, width=40, height=30, samples=4, threads=threads, isa=isa)
        for threads, isa in [(1, None), (3, None), *((2, isa) for isa in instruction_sets())]
    )
    for film in others:
        np.testing.assert_array_equal(film.color, first.color)
