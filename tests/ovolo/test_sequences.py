"""Sequences of frames, their names and their contact sheet; cameras by name."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from ovolo.__main__ import main
from ovolo.exits import Exit

STAGE = """#usda 1.0
def Sphere "Ball" {
    double radius = 1
    double3 xformOp:translate.timeSamples = { 1: (0, 0, 0), 3: (20, 0, 0) }
    uniform token[] xformOpOrder = ["xformOp:translate"]
}
def Camera "Cam" {
    double3 xformOp:translate = (0, 0, 10)
    uniform token[] xformOpOrder = ["xformOp:translate"]
}
"""
SIZE = ("--imageWidth", "16", "--height", "12", "--samples", "1", "--quiet")


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    (tmp_path / "stage.usda").write_text(STAGE)
    (tmp_path / "clock.ovo").write_text(
        "camera(from: (0, 0, 10), at: (0, 0, 0))\nsphere().translate(10 * (time - 1), 0, 0)\n"
    )
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize("scene", ["stage.usda", "clock.ovo"])
def test_a_sequence_renders_each_frame_at_its_time(
    folder: Path, scene: str, capsys: pytest.CaptureFixture[str]
) -> None:
    code = main(["render", scene, *SIZE, "--frames", "1:3x2", "--json", "--integrator", "normals"])
    assert code == Exit.OK
    frames = json.loads(capsys.readouterr().out)
    assert [frame["time"] for frame in frames] == [1, 3]
    stem = Path(scene).stem
    assert [frame["outputs"] for frame in frames] == [[f"{stem}.0001.png"], [f"{stem}.0003.png"]]
    first, second = (pixels(folder / f"{stem}.{k:04}.png") for k in (1, 3))
    assert first[6, 8].any()
    assert not second.any()


def pixels(path: Path) -> np.ndarray:
    import OpenImageIO as oiio  # noqa: N813

    return np.asarray(oiio.ImageBuf(str(path)).get_pixels(oiio.UINT8))


def test_a_contact_sheet_shows_all_frames(folder: Path) -> None:
    arguments = ["render", "stage.usda", *SIZE, "--frames", "1:3", "--integrator", "normals"]
    assert main([*arguments, "-o", "f.#.png", "--contact-sheet", "sheet.png"]) == Exit.OK
    sheet = pixels(folder / "sheet.png")
    assert sheet.shape[:2] == (24, 32)
    np.testing.assert_array_equal(sheet[:12, :16], pixels(folder / "f.1.png"))
    assert not sheet[12:].any()


def test_large_pictures_are_small_on_a_contact_sheet(folder: Path) -> None:
    arguments = ["render", "clock.ovo", "--width", "700", "--height", "30", "--samples", "1"]
    assert main([*arguments, "--quiet", "--contact-sheet", "sheet.png"]) == Exit.OK
    assert pixels(folder / "sheet.png").shape[:2] == (10, 233)


def test_a_camera_is_found_by_the_last_part_of_its_path(folder: Path) -> None:
    arguments: list[Any] = ["render", "stage.usda", *SIZE, "-o", "c.png", "--camera"]
    assert main([*arguments, "Cam"]) == Exit.OK
    assert main([*arguments, "/Cam"]) == Exit.OK
    assert main([*arguments, "Cim"]) == Exit.USAGE


def test_a_sequence_tells_a_warning_once(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (folder / "stage.usda").write_text(STAGE + 'def Volume "t" {\n}\n')
    arguments = ["render", "stage.usda", *SIZE[:-1], "--frames", "1:3"]
    assert main(arguments) == Exit.OK
    assert capsys.readouterr().err.count("warning[usd-unsupported]") == 1
