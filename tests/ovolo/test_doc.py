from __future__ import annotations

import json
from pathlib import Path

import pytest

from ovolo.__main__ import main

SCENE = """/// How many bricks a course has.
param count = 24 in 3..60
param tilt = 10deg

/// The material of everything.
let clay = matte(color: #d8cfc0)
let scratch = 1

/// A course of bricks.
///
/// Its first brick is at azimuth 0.
fn course(
  /// how many
  n,
  bevel = 0.02,
) { box(bevel: bevel) }
fn plain() { sphere() }
"""


@pytest.fixture
def scene(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    monkeypatch.chdir(tmp_path)
    Path("dome.ovo").write_text(SCENE)
    return "dome.ovo"


def test_markdown(scene: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["doc", scene]) == 0
    assert (
        capsys.readouterr().out
        == """# dome.ovo

## Parameters

### `count = 24 in 3..60`

How many bricks a course has.

### `tilt = 10deg`

## Functions

### `course(n, bevel: 0.02)`

A course of bricks.

Its first brick is at azimuth 0.

- `n`: how many

### `plain()`

## Names

### `clay = matte(color: #d8cfc0)`

The material of everything.
"""
    )


def test_json(scene: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["doc", scene, "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["params"][0] == {
        "name": "count",
        "default": "24",
        "allowed": "3..60",
        "doc": "How many bricks a course has.",
    }
    assert found["params"][1]["allowed"] is None
    assert [p["default"] for p in found["functions"][0]["parameters"]] == [None, "0.02"]
    assert [let["name"] for let in found["lets"]] == ["clay"]


def test_faults(scene: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["doc", "none.ovo"]) == 3
    Path(scene).write_text("let = 1\n")
    assert main(["doc", scene]) == 1
    assert "error[syntax-expected]" in capsys.readouterr().err
    assert main(["doc", scene, "--json"]) == 1
    assert json.loads(capsys.readouterr().out)["ok"] is False
