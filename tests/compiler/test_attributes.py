"""Attributes of meshes and textures of materials: through every form of the IR and back."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from compiler.attributes import mesh_attributes
from compiler.flatten import flatten
from compiler.ir import SceneIR
from compiler.ir_binary import content_hash, read_ir, write_ir
from compiler.ir_parse import parse_ir
from compiler.ir_text import print_ir
from compiler.validate import validate
from dsl.scene import Bind, Group, Material, Mesh, MeshAttribute, SceneGraph, Texture

POINTS = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]])
TRIANGLES = np.array([[0, 1, 2], [2, 1, 3]])
ATTRIBUTES = (
    MeshAttribute("normals", np.array([[0, 0.1, 1]] * 4, np.float32)),
    MeshAttribute("st", np.array([[0, 0], [1, 0.3]], np.float32), np.array([[0, 1, 0], [1, 1, 0]])),
)
BRICK = Texture("diffuse", "brick ü.png", "map1", wrap=("repeat", "black"), bias=(0.1, 0, 0, 0))
PAPER = Texture("opacity", "paper.png", channels="a", matrix=(2, 0, 0, 0, 2, 0.5))


def scene(material: Material = Material(textures=(BRICK, PAPER))) -> SceneIR:  # noqa: B008
    plain = Mesh(POINTS.copy(), TRIANGLES.copy())
    mesh = Mesh(POINTS, TRIANGLES, attributes=ATTRIBUTES)
    ir = flatten(SceneGraph(Group((plain, Bind(mesh, material)))), lambda _: (None, [])).ir
    assert ir is not None
    return ir


def test_meshes_keep_their_own_attributes() -> None:
    ir = scene()
    assert list(mesh_attributes(ir, 0)) == []
    found = list(mesh_attributes(ir, 1))
    for one, other in zip(found, ATTRIBUTES, strict=True):
        assert one.name == other.name
        np.testing.assert_array_equal(one.values, other.values)
        assert (one.corners is None) == (other.corners is None)
        if one.corners is not None and other.corners is not None:
            np.testing.assert_array_equal(one.corners, other.corners)


def test_text_and_binary_read_back(tmp_path: Path) -> None:
    ir = scene()
    text = print_ir(ir)
    assert print_ir(parse_ir(text)) == text
    assert 'diffuse of 1: "brick ü.png" "map1" channels rgb wrap_s repeat wrap_t black' in text
    write_ir(ir, tmp_path / "scene.ir")
    assert print_ir(read_ir(tmp_path / "scene.ir")) == text
    assert content_hash(parse_ir(text)) == content_hash(ir)


def test_another_file_is_another_scene() -> None:
    other = scene(Material(textures=(BRICK, replace(PAPER, file="other.png"))))
    assert content_hash(other) != content_hash(scene())


def test_materials_that_differ_in_a_texture_are_two() -> None:
    assert Material() != Material(textures=(BRICK,))
    assert scene().textures["material"].tolist() == [1, 1]


@pytest.mark.parametrize(
    ("table", "column", "value"),
    [("mesh_attributes", "mesh", 9), ("mesh_attributes", "name", 99),
     ("mesh_attributes", "end_value", 10**9), ("mesh_attributes", "width", 0),
     ("mesh_attributes", "first_corner", 5), ("textures", "material", 7),
     ("textures", "file", -1), ("textures", "wrap_t", 9), ("textures", "matrix", np.nan)],
)  # fmt: skip
def test_damage_is_found(table: str, column: str, value: float) -> None:
    ir = scene()
    damaged = getattr(ir, table).copy()
    damaged[column][-1] = value
    assert [fault.code for fault in validate(replace(ir, **{table: damaged}))] == ["ir-invalid"]
