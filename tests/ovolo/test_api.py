"""The public Python API, line by line."""

from __future__ import annotations

import dataclasses
import pickle
import tomllib
import traceback
from pathlib import Path

import numpy as np
import pytest

import ovolo
from dsl.spans import PrimPlace, Span

ROOT = Path(__file__).parent.parent.parent

TWO = """\
let ball = sphere(radius: 1)
ball
ball.translate(4, 0, 0).material(matte(color: rgb(1, 0, 0)))
camera(from: (0, 0, 10), at: (0, 0, 0), fov: 40deg)
sun(direction: (0, 0, -1), irradiance: 3)
"""

STAGE = """\
#usda 1.0
def Sphere "Ball" {
    double radius = 1
    double3 xformOp:translate = (0, 0, 5)
    double3 xformOp:translate.timeSamples = { 1: (0, 0, 1), 2: (0, 0, 2) }
    uniform token[] xformOpOrder = ["xformOp:translate"]
}
"""


def test_everything_public_can_be_had() -> None:
    for name in ovolo.__all__:
        assert getattr(ovolo, name) is getattr(ovolo, name)
    assert {name for name in dir(ovolo) if name[:2] != "__"} == {*ovolo.__all__} - {"__version__"}
    with pytest.raises(AttributeError, match="compile_fiel"):
        ovolo.compile_fiel  # noqa: B018


def test_what_is_made_says_in_a_line_what_it_is() -> None:
    scene = ovolo.compile(TWO, "two.ovo")
    assert repr(scene) == "Scene('two.ovo', 2 instances of 1 prototypes)"
    assert repr(scene.ir).startswith("SceneIR(2 instances, 1 prototypes, ")
    assert repr(scene.tracer("float32", isa="portable")) == "Tracer(float32, portable)"
    assert repr(scene.tracer("float64").updated(scene.ir)).startswith("Tracer(float64, ")
    assert repr(scene.tracer("reference")) == "Tracer(reference)"


def test_an_error_shows_its_places_and_goes_to_other_processes() -> None:
    with pytest.raises(ovolo.CompileError) as caught:
        ovolo.compile("spher()", "a.ovo")
    shown = "".join(traceback.format_exception(caught.value))
    assert "\n --> a.ovo:1:1\n" in shown
    assert "= help: did you mean `sphere`?" in shown
    back = pickle.loads(pickle.dumps(caught.value))
    assert (str(back), back.diagnostics) == (str(caught.value), caught.value.diagnostics)


@pytest.mark.parametrize("text", [b"sphere()", None, Path("a.ovo")])
def test_what_is_no_text_is_named(text: object) -> None:
    with pytest.raises(TypeError, match=f"a program is a str, not {type(text).__name__}"):
        ovolo.compile(text)  # type: ignore[arg-type]


@pytest.mark.parametrize("threads", [-1, 1025, 10**9])
def test_threads_have_a_limit(threads: int) -> None:
    with pytest.raises(ValueError, match=r"threads is -?\d+, which is not in 0 … 1024"):
        ovolo.compile("sphere()").tracer(threads=threads)


@pytest.mark.parametrize(
    ("choice", "words"),
    [
        ({"complexity": "fine"}, "complexity is one of low, "),
        ({"purposes": ["gudie"]}, "purposes are default, render, proxy, guide, not 'gudie'"),
        ({"prim": "/World"}, "for stages"),
        ({"mask": ["/World"]}, "for stages"),
        ({"variants": ["/World{a=b}"]}, "for stages"),
    ],
)
def test_choices_that_cannot_be_are_named(
    tmp_path: Path, choice: dict[str, object], words: str
) -> None:
    (tmp_path / "ball.ovo").write_text("sphere()")
    with pytest.raises(ValueError, match=words):
        ovolo.compile_file(tmp_path / "ball.ovo", **choice)  # type: ignore[arg-type]


@pytest.mark.parametrize("tolerance", [0.0, -1.0, 1.0, np.nan])
def test_an_export_has_a_tolerance(tmp_path: Path, tolerance: float) -> None:
    with pytest.raises(ValueError, match="tolerance is "):
        ovolo.compile("sphere()").export(tmp_path / "a.usda", tolerance=tolerance)


def test_numpy_scalars_are_numbers() -> None:
    source = "param r = 1\nparam on = true\nparam at = (0, 0, 0)\nsphere(radius: r + time)"
    given = {"r": np.float32(2), "on": np.bool_(False), "at": np.array([1, 2, 3])}
    scene = ovolo.compile(source, params=given, time=np.float32(3))  # type: ignore[arg-type]
    assert [param.value for param in scene.params] == [2.0, False, (1.0, 2.0, 3.0)]
    assert scene.ir.shape_parameters.tolist() == [5.0]
    with pytest.raises(ValueError, match="now"):
        ovolo.compile("sphere()", time="now")  # type: ignore[arg-type]


def test_one_version_everywhere() -> None:
    from runtime import _kernel

    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    assert ovolo.__version__ == project["version"] == _kernel.__version__


@pytest.mark.parametrize("precision", ["float32", "float64", "reference"])
def test_hits_are_arrays_row_by_row(precision: str) -> None:
    tracer = ovolo.compile(TWO).tracer(precision=precision)  # type: ignore[arg-type]
    origins = np.array([[0.0, 0, 10], [4, 0, 10], [2, 0, 10]])
    hits = tracer.trace(origins, np.array([0.0, 0.0, -2.0]))
    assert hits.t.tolist() == pytest.approx([4.5, 4.5, np.inf])  # in units of the direction
    assert hits.instance.tolist() == [0, 1, -1]
    assert hits.prototype.tolist() == [0, 0, -1]
    assert hits.material[0] != hits.material[1]
    assert hits.material[2] == -1
    np.testing.assert_allclose(hits.normal[:2], [[0, 0, 1], [0, 0, 1]], atol=1e-6)
    np.testing.assert_allclose(hits.position[:2], [[0, 0, 1], [4, 0, 1]], atol=1e-6)
    assert np.isnan(hits.position[2]).all()
    assert np.isnan(hits.normal[2]).all()
    assert [hits.t.dtype, hits.normal.dtype, hits.position.dtype] == [np.float64] * 3
    assert [hits.instance.dtype, hits.material.dtype] == [np.int64, np.int32]


@pytest.mark.parametrize("precision", ["float32", "float64", "reference"])
def test_bounds_of_t_are_open_and_may_differ(precision: str) -> None:
    tracer = ovolo.compile("sphere()").tracer(precision=precision)  # type: ignore[arg-type]
    origins, direction = np.tile([0.0, 0, 3], (4, 1)), (0, 0, -1)
    t_min, t_max = [0.0, 2.5, 0.0, 4.5], [np.inf, np.inf, 1.5, 9.0]
    hits = tracer.trace(origins, direction, t_min=t_min, t_max=t_max)
    assert hits.t.tolist() == pytest.approx([2.0, 4.0, np.inf, np.inf])
    assert tracer.occluded(origins, direction, t_min, t_max).tolist() == [True, True, False, False]
    # Seen from inside, the normal still points out of the solid.
    assert hits.normal[1].tolist() == pytest.approx([0, 0, -1])


def test_an_unknown_precision_or_instruction_set_is_refused() -> None:
    scene = ovolo.compile("sphere()")
    with pytest.raises(ValueError, match="float16"):
        scene.tracer(precision="float16")  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="abacus"):
        scene.tracer(isa="abacus")


def test_every_instance_knows_what_made_it() -> None:
    scene = ovolo.compile(TWO, name="two.ovo")
    place = scene.source_span(1)
    assert isinstance(place, Span)
    assert place.source.name == "two.ovo"
    words = TWO.encode()[place.start : place.end].decode()
    assert words.startswith("ball.translate(4, 0, 0)")
    assert "ball" in scene.object_path(0)
    for miss in (-1, 2):
        with pytest.raises(IndexError):
            scene.object_path(miss)
        with pytest.raises(IndexError):
            scene.source_span(miss)
    assert scene.object_path(np.int64(1)) == scene.object_path(1)
    with pytest.raises(TypeError, match="float"):
        scene.object_path(1.5)  # type: ignore[arg-type]
    with pytest.raises(TypeError, match="float"):
        scene.source_span(np.float64(1.0))  # type: ignore[arg-type]


@pytest.mark.parametrize(("time", "z"), [(None, 5.0), ("earliest", 1.0), (2, 2.0), (1.5, 1.5)])
def test_a_stage_is_a_scene_too(tmp_path: Path, time: float | None, z: float) -> None:
    path = tmp_path / "ball.usda"
    path.write_text(STAGE)
    scene = ovolo.compile_file(path, time=time)
    hits = scene.tracer().trace((0, 0, 10), (0, 0, -1))
    assert hits.t[0] == pytest.approx(9 - z)
    assert scene.object_path(0) == "/Ball"
    place = scene.source_span(0)
    assert isinstance(place, PrimPlace)
    assert place.prim == "/Ball"


def test_a_picture_is_rendered_and_saved(tmp_path: Path) -> None:
    seen: list[tuple[float, int]] = []
    scene = ovolo.compile(TWO)
    image = scene.render(
        width=32,
        height=24,
        samples=2,
        camera=0,
        integrator="direct",
        precision="float32",
        progress=lambda done, rays: seen.append((done, rays)),
    )
    assert image.pixels.shape[:2] == (24, 32)
    assert image.aov("depth").shape == (24, 32)
    assert np.isfinite(image.aov("depth")[12, 16])
    assert seen[-1][0] == 1.0
    for name in ("a.png", "a.jpg", "a.exr"):
        image.save(tmp_path / name)
        assert (tmp_path / name).stat().st_size > 100
    image.save(str(tmp_path / "b.png"))
    assert image._repr_png_().startswith(b"\x89PNG\r\n")


def test_settings_of_a_picture_that_cannot_be_are_refused() -> None:
    scene = ovolo.compile(TWO)
    for wrong in ({"width": 0}, {"samples": -1}, {"camera": "side"}, {"camera": 7}):
        with pytest.raises(ValueError, match=r"width|samples|camera"):
            scene.render(**{"width": 8, "height": 8, **wrong})  # type: ignore[arg-type]


def test_what_progress_raises_ends_the_render() -> None:
    class Enough(Exception):
        pass

    def stop(done: float, rays: int) -> None:
        raise Enough

    with pytest.raises(Enough):
        ovolo.compile(TWO).render(width=256, height=256, samples=64, progress=stop)


def test_faults_are_frozen_diagnostics() -> None:
    with pytest.raises(ovolo.CompileError) as caught:
        ovolo.compile("spher()\nbox(size: 1deg)\n", name="faulty.ovo")
    diagnostics = caught.value.diagnostics
    assert len(diagnostics) == 2
    first = diagnostics[0]
    assert isinstance(first, ovolo.Diagnostic)
    assert (first.code, first.severity) == ("name-unknown", "error")
    assert first.primary is not None
    assert isinstance(first.primary.place, Span)
    assert (first.primary.place.start, first.primary.place.end) == (0, 5)
    with pytest.raises(dataclasses.FrozenInstanceError):
        first.code = "other"  # type: ignore[misc]


@pytest.mark.parametrize(
    ("name", "content", "code"),
    [
        ("missing.ovo", None, "file-missing"),
        ("missing.usda", None, "file-missing"),
        ("binary.ovo", b"\x00\xff\xfe\x80", "file-encoding"),
        ("binary.usdc", b"\x00\xff\xfe\x80" * 100, "usd-open"),
        ("empty.usdz", b"", "usd-open"),
        (".", None, "file-unreadable"),
    ],
)
def test_files_that_cannot_be_read_are_diagnostics(
    tmp_path: Path, name: str, content: bytes | None, code: str
) -> None:
    if content is not None:
        (tmp_path / name).write_bytes(content)
    with pytest.raises(ovolo.CompileError) as caught:
        ovolo.compile_file(tmp_path / name)
    assert [d.code for d in caught.value.diagnostics if d.severity == "error"] == [code]


def test_files_are_found_beside_the_scene_and_kept_inside_a_root(tmp_path: Path) -> None:
    (tmp_path / "parts").mkdir()
    (tmp_path / "parts" / "ball.ovo").write_text("let ball = sphere()\n")
    text = 'use "ball.ovo" as parts\nparts.ball\n'
    (tmp_path / "parts" / "scene.ovo").write_text(text)
    assert len(ovolo.compile_file(tmp_path / "parts" / "scene.ovo").ir.instance_target) == 1
    assert len(ovolo.compile(text, root=tmp_path / "parts").ir.instance_target) == 1
    assert len(ovolo.compile(text, name="parts/scene.ovo", root=tmp_path).ir.instance_target) == 1
    outside = text.replace("ball.ovo", "../parts/ball.ovo")
    (tmp_path / "root").mkdir()
    with pytest.raises(ovolo.CompileError) as caught:
        ovolo.compile(outside, root=tmp_path / "root")
    assert caught.value.diagnostics[0].code == "file-outside"


def test_a_scene_has_bounds_and_warnings() -> None:
    scene = ovolo.compile(TWO + "plane()\nball.scale(0)\n")
    assert scene.bounds is not None
    assert scene.bounds.tolist() == [[-1, -1, -1], [5, 1, 1]]
    assert [warning.code for warning in scene.warnings] == ["scene-singular-transform"]


def test_an_empty_scene_is_a_scene() -> None:
    scene = ovolo.compile("")
    assert scene.bounds is None
    assert scene.warnings == ()
    assert repr(scene) == "Scene('scene.ovo', 0 instances of 0 prototypes)"
    hits = scene.tracer().trace(np.zeros((2, 3)), (0, 0, 1))
    assert not hits.hit.any()
    assert scene.render(width=4, height=4, samples=1).pixels.shape[:2] == (4, 4)
