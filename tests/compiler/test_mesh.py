"""Mesh files: what is in them, faults, and confinement."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import trimesh

from compiler.flatten import flatten
from compiler.mesh import load_file, load_mesh
from dsl.files import FileFault, Files
from dsl.scene import File, Mesh, SceneGraph
from tests.compiler.graphs import origin

SQUARE = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n"


def load(folder: Path, name: str) -> tuple[Mesh | None, list[str]]:
    mesh, diagnostics = load_mesh(name, Files(folder), origin=origin())
    assert all(d.primary is not None for d in diagnostics)
    return mesh, [d.code for d in diagnostics]


def test_points_and_faces_stay_as_the_file_has_them(tmp_path: Path) -> None:
    (tmp_path / "a.obj").write_text(SQUARE + "v 9 9 9\nv 0 0 0\nf 3 2 1\nf 6 3 4\n")
    mesh, codes = load(tmp_path, "a.obj")
    assert mesh is not None
    assert codes == []
    assert mesh.triangles.tolist() == [[2, 1, 0], [5, 2, 3]]
    assert mesh.points.shape == (6, 3)


def test_polygons_are_cut_into_fans(tmp_path: Path) -> None:
    (tmp_path / "a.obj").write_text(SQUARE + "f 1 2 3 4\n")
    mesh, _ = load(tmp_path, "a.obj")
    assert mesh is not None
    assert mesh.triangles.tolist() == [[0, 1, 2], [2, 3, 0]]


@pytest.mark.parametrize("ending", ["glb", "gltf"])
def test_scenes_become_one_mesh_with_their_transforms(tmp_path: Path, ending: str) -> None:
    scene = trimesh.Scene()
    box = trimesh.creation.box()
    scene.add_geometry(box)
    scene.add_geometry(box, transform=trimesh.transformations.translation_matrix([5, 0, 0]))
    exported = scene.export(file_type=ending)
    files = exported if isinstance(exported, dict) else {"model.glb": exported}
    for name, data in files.items():
        (tmp_path / name).write_bytes(data)
    mesh, codes = load(tmp_path, f"model.{ending}")
    assert mesh is not None
    assert codes == []
    assert len(mesh.triangles) == 24
    assert mesh.points.min(axis=0).tolist() == [-0.5, -0.5, -0.5]
    assert mesh.points.max(axis=0).tolist() == [5.5, 0.5, 0.5]


@pytest.mark.parametrize("ending", ["off", "ply", "stl"])
def test_other_formats_keep_their_volume(tmp_path: Path, ending: str) -> None:
    trimesh.creation.box((1, 2, 3)).export(tmp_path / f"a.{ending}")
    mesh, _ = load(tmp_path, f"a.{ending}")
    assert mesh is not None
    corners = mesh.points[mesh.triangles]
    assert np.linalg.det(corners).sum() / 6 == pytest.approx(6.0)


def test_faces_of_bad_points_are_left_out_with_a_warning(tmp_path: Path) -> None:
    (tmp_path / "a.off").write_text("OFF\n4 2 0\n0 0 0\n1 0 0\n0 nan 0\n0 1 0\n3 0 1 3\n3 0 1 2\n")
    mesh, codes = load(tmp_path, "a.off")
    assert mesh is not None
    assert codes == ["mesh-bad-faces"]
    assert mesh.triangles.tolist() == [[0, 1, 3]]
    assert np.isfinite(mesh.points).all()


@pytest.mark.parametrize(
    ("name", "content", "code"),
    [
        ("a.txt", b"", "mesh-format"),
        ("a", b"", "mesh-format"),
        ("a.obj", b"", "mesh-empty"),
        ("a.obj", b"v 0 0 0\nf 1 2 99\n", "mesh-unreadable"),
        ("a.ply", b"\0" * 50, "mesh-unreadable"),
        ("a.stl", b"\0" * 50, "mesh-empty"),
        ("a.glb", b"glTF" + b"\xff" * 100, "mesh-unreadable"),
        ("a.gltf", b"[" * 5000, "file-missing"),
        ("a.gltf", b"{}", "mesh-empty"),
    ],
)
def test_damaged_files_are_diagnostics(
    tmp_path: Path, name: str, content: bytes, code: str
) -> None:
    (tmp_path / name).write_bytes(content)
    mesh, codes = load(tmp_path, name)
    assert mesh is None
    assert codes == [code]


def test_what_a_mesh_file_refers_to_is_confined_too(tmp_path: Path) -> None:
    (tmp_path / "secret.bin").write_bytes(b"\0" * 36)
    (tmp_path / "scene").mkdir()
    (tmp_path / "scene" / "a.gltf").write_text(
        '{"asset": {"version": "2.0"}, "buffers": [{"uri": "../secret.bin", "byteLength": 36}]}'
    )
    assert load(tmp_path / "scene", "a.gltf") == (None, ["file-outside"])


def test_a_missing_file_is_a_fault_or_a_diagnostic(tmp_path: Path) -> None:
    with pytest.raises(FileFault):
        load_mesh("no.obj", Files(tmp_path))
    node, diagnostics = load_file(File("mesh", "no.obj", origin=origin()), Files(tmp_path))
    assert node is None
    assert [d.code for d in diagnostics] == ["file-missing"]


def test_files_of_both_kinds_reach_the_flat_scene(tmp_path: Path) -> None:
    (tmp_path / "a.obj").write_text(SQUARE + "f 1 2 3\n")
    (tmp_path / "b.usda").write_text('#usda 1.0\ndef Sphere "Ball" {\n double radius = 2\n}\n')
    files = Files(tmp_path)
    for file, kind in ((File("mesh", "a.obj"), 11), (File("usd", "b.usda"), 0)):
        result = flatten(SceneGraph(file), lambda f: load_file(f, files))
        assert result.ir is not None
        assert result.ir.prototype_kind.tolist() == [kind]


def test_only_objects_of_a_stage_come_into_a_program(tmp_path: Path) -> None:
    (tmp_path / "set.usda").write_text("""#usda 1.0
(
    upAxis = "Z"
)
def Sphere "Ball" {
}
def Cube "Lamp" (
    prepend apiSchemas = ["LightAPI"]
) {
}
def Camera "Eye" {
    double shutter:open = 1
    def Cube "Rig" {
    }
}
def SphereLight "Sun" {
}
def RectLight "Panel" {
}
""")
    files = Files(tmp_path)
    result = flatten(SceneGraph(File("usd", "set.usda")), lambda f: load_file(f, files))
    assert result.ir is not None
    assert result.diagnostics == []
    assert result.ir.instance_target.tolist() == [0, 1, 1]
    assert len(result.ir.cameras) == len(result.ir.lights) == 0
    assert result.ir.settings["up"].tolist() == [0]
