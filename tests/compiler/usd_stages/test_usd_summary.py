"""What `ovolo inspect` says of a stage: what is there, what is drawn, and why not."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from ovolo.__main__ import main
from ovolo.exits import Exit

STAGE = """#usda 1.0
(
    defaultPrim = "World"
    upAxis = "Z"
    startTimeCode = 1
    endTimeCode = 24
)
def Xform "World" {
    def Sphere "shown" {
    }
    def Sphere "hidden" {
        token visibility = "invisible"
    }
    def Scope "proxies" {
        uniform token purpose = "proxy"
        def Cube "a" {
        }
        def Cube "b" {
            uniform token purpose = "render"
        }
    }
    def Volume "patch" {
    }
    def Camera "Cam" {
    }
    def Xform "i1" (instanceable = true
        references = </Model>) {
    }
    def Xform "i2" (instanceable = true
        references = </Model>) {
    }
}
class Xform "Model" (
    variants = { string size = "big" }
    prepend variantSets = "size"
) {
    def Cone "cone" {
    }
    variantSet "size" = {
        "big" {
        }
        "small" {
        }
    }
}
"""


def test_inspect_says_what_is_drawn_and_why_not(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "stage.usda"
    path.write_text(STAGE)
    answers: list[Any] = []
    for more in ([], ["--deadline", "100"]):
        assert main(["inspect", str(path), "--json", *more]) == Exit.OK
        answers.append(json.loads(capsys.readouterr().out)["stage"])
    here, apart = answers
    assert here == apart
    assert here["types"]["Sphere"] == {"there": 2, "drawn": 1, "invisible": 1}
    assert here["types"]["Cube"] == {"there": 2, "drawn": 1, "purpose proxy": 1}
    assert here["types"]["Cone"] == {"there": 2, "drawn": 2}
    assert here["types"]["Volume"] == {"there": 1, "left out": 1}
    assert (here["native_instances"], here["native_prototypes"]) == (2, 1)
    assert (here["up"], here["time_codes"]) == ("Z", [1, 24])
    assert here["camera_paths"] == ["/World/Cam"]
    assert here["variants"]["/World/i1{size=big}"] == ["big", "small"]
    assert main(["inspect", str(path)]) == Exit.OK
    out, err = capsys.readouterr()
    assert "Volume" in err
    assert "Cube                2        1  1 purpose proxy\n" in out
    assert "cameras     1: /World/Cam\n" in out
