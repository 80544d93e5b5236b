"""Damaged and hostile stages: whatever they are, what comes out is a scene or diagnostics."""

from __future__ import annotations

import random
import re
import zipfile
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest

import ovolo
from compiler.usd import import_stage
from dsl.diagnostics import CompileError

ORCHARD = Path(__file__).parents[3] / "examples" / "orchard.usda"
NUMBERS = ("-1", "1e308", "nan", "inf", "0", "99999999999", "2147483647", "-0.0", "7")
TYPES = ("Mesh", "Cube", "PointInstancer", "BasisCurves", "Camera", "OvoloWedge", "SphereLight")
_NUMBER = re.compile(r"(?<![\w.])-?\d+(\.\d+)?(?![\w.])")


def damaged(text: str, chance: random.Random) -> str:
    """A stage with some numbers, types or lines that are not what they should be."""
    for _ in range(chance.randrange(1, 6)):
        match chance.randrange(3):
            case 0:
                found = chance.choice(list(_NUMBER.finditer(text, 12)))
                text = text[: found.start()] + chance.choice(NUMBERS) + text[found.end() :]
            case 1:
                lines = text.split("\n")
                line = chance.randrange(1, len(lines))
                if not set("{}") & set(lines[line]):
                    del lines[line]
                text = "\n".join(lines)
            case _:
                found = chance.choice(list(re.finditer(r"\bdef (\w+) ", text)))
                text = text[: found.start(1)] + chance.choice(TYPES) + text[found.end(1) :]
    return text


@pytest.mark.parametrize("seed", range(30))
def test_damaged_stages_are_scenes_or_diagnostics(seed: int, tmp_path: Path) -> None:
    stage = tmp_path / "stage.usda"
    stage.write_text(damaged(ORCHARD.read_text(), random.Random(seed)))
    with suppress(CompileError):
        ovolo.compile_file(stage, complexity="limit")


@pytest.mark.parametrize("seed", range(10))
def test_broken_bytes_are_scenes_or_diagnostics(seed: int, tmp_path: Path) -> None:
    chance = random.Random(seed)
    data = bytearray(ORCHARD.read_bytes())
    for _ in range(chance.randrange(1, 20)):
        data[chance.randrange(len(data))] = chance.randrange(256)
    stage = tmp_path / "stage.usda"
    stage.write_bytes(data)
    with suppress(CompileError):
        ovolo.compile_file(stage)


def test_packages_that_unpack_to_much_are_not_unpacked(tmp_path: Path) -> None:
    stage = tmp_path / "bomb.usdz"
    with zipfile.ZipFile(stage, "w", zipfile.ZIP_DEFLATED) as package:
        package.writestr("a.usda", "#usda 1.0\n" + " " * 50_000_000)
    with pytest.raises(CompileError) as caught:
        ovolo.compile_file(stage)
    assert caught.value.diagnostics[0].code == "usd-open"


def test_a_mesh_without_a_usable_face_draws_nothing(load: Callable[..., Any]) -> None:
    imported = load(
        'def Mesh "m" {\nint[] faceVertexCounts = [3]\nint[] faceVertexIndices = [0, 1, 99]\n'
        "point3f[] points = [(0, 0, 0), (1, 0, 0), (0, 1, 0)]\n}\n"
    )
    assert imported.leaves == []
    assert imported.said("draws nothing").primary.place.prim == "/m"


def test_prims_beyond_a_thousand_levels_are_left_out(tmp_path: Path) -> None:
    depth = 1200
    stage = tmp_path / "deep.usda"
    ball = 'def Sphere "s" {\n}\n'
    stage.write_text("#usda 1.0\n" + f'def "a" {{\n{ball}' * depth + "}\n" * depth)
    graph, faults = import_stage(stage)
    (fault,) = faults
    assert (fault.code, fault.severity) == ("usd-unsupported", "warning")
    assert "1000 levels" in fault.message
    assert graph.root is not None
