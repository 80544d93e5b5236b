"""Frames as the command line says them, and the names of their pictures."""

from __future__ import annotations

from pathlib import Path

import pytest

from ovolo.frames import numbered, parse_frames


@pytest.mark.parametrize(
    ("text", "frames"),
    [
        ("1:4", [1, 2, 3, 4]),
        ("1:6x2", [1, 3, 5]),
        ("3:1", [3, 2, 1]),
        ("4:-4x-4", [4, 0, -4]),
        ("7", [7]),
        ("0:0.3x0.1", [0, 0.1, 0.2, 0.3]),
        ("1:2,9", [1, 2, 9]),
    ],
)
def test_frames_are_read(text: str, frames: list[float]) -> None:
    assert [float(frame) for frame in parse_frames(text)] == frames


@pytest.mark.parametrize(
    "text", ["", "1:", ":2", "1:2x0", "1:2x-1", "1x2", "a", "1:1e9", "0:9999999", "nan", "1,"]
)
def test_what_are_no_frames_is_refused(text: str) -> None:
    with pytest.raises(ValueError, match="frame"):
        parse_frames(text)


@pytest.mark.parametrize(
    ("name", "frames", "names"),
    [
        ("a.png", "1:2", ["a.0001.png", "a.0002.png"]),
        ("a_##.png", "9:10", ["a_09.png", "a_10.png"]),
        ("#.png", "100", ["100.png"]),
        (
            "a.##.png",
            "0:1x0.25",
            [f"a.{t}.png" for t in ("00.00", "00.25", "00.50", "00.75", "01.00")],
        ),
        ("a.##.png", "-1:1x2", ["a.-01.png", "a.01.png"]),
    ],
)
def test_pictures_are_numbered(name: str, frames: str, names: list[str]) -> None:
    paths = numbered(Path("out") / name, parse_frames(frames))
    assert paths == [Path("out") / each for each in names]
