"""Scenes to programs and back."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from benchmarks.random_scenes import random_rays, random_scene
from benchmarks.round_trip import compiled, difference, rays_through
from compiler.compilation import Compilation, compile_path, compile_text
from compiler.program import ProgramError, write_program
from dsl.scene import Group, Mesh, Node, SceneGraph
from ovolo.__main__ import main
from ovolo.exits import Exit

EXAMPLES = sorted((Path(__file__).parents[2] / "examples").glob("*.[ou][vs]*"))


def has_mesh(node: Node) -> bool:
    if isinstance(node, Group):
        return any(map(has_mesh, node.items))
    child = getattr(node, "child", None)
    return isinstance(node, Mesh) if child is None else has_mesh(child)


@given(st.integers(0, 10**9))
@settings(max_examples=20)
def test_random_scenes_come_back_as_they_were(seed: int) -> None:
    graph = random_scene(seed)
    scene = compiled(graph)
    program = write_program(scene)
    assert not program.unsaid
    back = compile_text(program.text)
    rays = random_rays(graph, 100, seed)
    if has_mesh(graph.root):
        assert_same_distances(scene, back, rays)
        return
    found = difference(scene.ir, back.ir, rays)
    assert (found.leaves, found.rays) == (0, 0)
    assert found.matrices < 1e-14


def assert_same_distances(scene: Compilation, back: Compilation, rays: Any) -> None:
    """Meshes come back as triangles: leaves of their own."""
    from runtime.tracer import Tracer

    first, second = (Tracer(c.ir, "float64").trace(*rays).t for c in (scene, back))
    near = np.isclose(first, second, rtol=1e-7, atol=0.0) | (first == second)
    # Rays from a surface, or along it, are decided by the last bit.
    length = np.linalg.norm(rays.directions, axis=1)
    starts = np.minimum(first, second) * length < 1e-12 * np.abs(rays.origins).max(axis=1)
    assert np.count_nonzero(~near & ~starts) <= 3


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.name)
def test_examples_come_back_as_they_were(path: Path, tmp_path: Path) -> None:
    scene = compile_path(path)
    assert main(["import", str(path), "-o", str(tmp_path / "again.ovo"), "--quiet"]) == Exit.OK
    back = compile_path(tmp_path / "again.ovo")
    assert back.warnings == scene.warnings
    rays = rays_through(scene.ir, 500, 1)
    if path.suffix == ".ovo":
        found = difference(scene.ir, back.ir, rays)
        assert (found.leaves, found.rays) == (0, 0)
    else:
        assert_same_distances(scene, back, rays)
    assert len(back.ir.lights) == len(scene.ir.lights)
    assert len(back.ir.cameras) == len(scene.ir.cameras)


def test_programs_read_like_programs() -> None:
    program = write_program(
        compile_text(
            "let leg = cylinder(radius: 0.1, y: 0..2, bevel: 0.05)\n"
            "let table = { leg\n leg.translate(2, 0, 0)\n box().material(matte(color: #ff0000)) }\n"
            "table\ntable.rotate_y(30deg).override(metal(color: #ffffff))\n"
        )
    )
    assert program.text == (
        "let leg = cylinder(radius: 0.1, y: 0..2, bevel: 0.05)\n"
        "let paint = material(diffuse: rgb(1, 0, 0), specular_workflow: true, roughness: 1)\n"
        "let table = {\n"
        "  leg\n"
        "  leg.translate(2, 0, 0)\n"
        "  box(min: (-1, -1, -1), max: (1, 1, 1)).material(paint)\n"
        "}\n"
        "let paint_2 = material(diffuse: rgb(1, 1, 1), metallic: 1, roughness: 0.3)\n"
        "\n"
        "table\n"
        "table.rotate_y(30deg).override(paint_2)\n"
    )


def test_large_meshes_become_files(tmp_path: Path) -> None:
    rng = np.random.default_rng(1)
    mesh = Mesh(
        rng.normal(size=(100, 3)), rng.permuted(np.tile(np.arange(100), (100, 1)), axis=1)[:, :3]
    )
    scene = compiled(SceneGraph(mesh))
    program = write_program(scene, "parts")
    assert list(program.meshes) == ["parts/mesh_2.obj"]
    assert 'mesh("parts/mesh_2.obj")' in program.text
    assert program.text.count("triangle") == 0
    assert write_program(scene).text.count("triangle") == 100


def test_what_is_not_small_is_refused(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    scene = compile_text("for i in 0..6000 { sphere().translate(i, 0, 0) }\n")
    with pytest.raises(ProgramError, match="6,000 instances"):
        write_program(scene)
    path = tmp_path / "many.ovo"
    path.write_text("for i in 0..6000 { sphere().translate(i, 0, 0) }\n")
    assert main(["import", str(path)]) == Exit.FAULTS
    assert 'usd("many.ovo")' in capsys.readouterr().err


STAGE = """#usda 1.0
(upAxis = "Z")
def Sphere "let" {
}
def Camera "shifted" {
    float horizontalApertureOffset = 2
}
"""


def test_what_cannot_be_said_is_told(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "stage.usda"
    path.write_text(STAGE)
    assert main(["import", str(path)]) == Exit.OK
    out, err = capsys.readouterr()
    assert "sphere(radius: 1)" in out
    assert "warning[usd-program]: camera `/shifted` has a window beside its axis" in err
    path.write_text(STAGE.partition("def Camera")[0])
    assert main(["import", str(path)]) == Exit.OK
    assert "z is up" in capsys.readouterr().err
