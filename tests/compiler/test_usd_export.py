"""Scenes to USD stages and back."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from benchmarks.random_scenes import random_rays, random_scene, random_shape
from benchmarks.round_trip import compiled, difference, rays_through, there_and_back
from compiler.compilation import Compilation, compile_path, compile_text
from compiler.ir import SceneIR
from compiler.provenance import object_path
from compiler.usd_export import ExportError, ExportOptions, export_stage
from compiler.usd_export.fallback import Polygons, polygons
from dsl.scene import (
    SHAPE_PARAMETERS,
    Bind,
    Group,
    Mesh,
    MeshAttribute,
    Node,
    SceneGraph,
    Shape,
    ShapeKind,
)
from runtime.tracer import Tracer

EXAMPLES = sorted((Path(__file__).parents[2] / "examples").glob("*.[ou][vs]*"))


def exported(program: str, folder: Path, **options: Any) -> Any:
    """The stage of a program, opened by usd-core."""
    from pxr import Usd

    path = folder / "scene.usda"
    export_stage(compile_text(program), path, ExportOptions(**options))
    return Usd.Stage.Open(str(path))


def assert_same(scene: Compilation, back: SceneIR, rays: Any) -> None:
    found = difference(scene.ir, back, rays)
    assert (found.leaves, found.rays) == (0, 0)
    assert found.matrices < 1e-14


@given(st.integers(0, 10**9), st.sampled_from([2, 4, 16]))
@settings(max_examples=30)
def test_random_scenes_come_back_as_they_were(seed: int, many: int) -> None:
    scene = compiled(random_scene(seed))
    back = there_and_back(scene, ExportOptions(many=many, tolerance=None))
    assert_same(scene, back.ir, random_rays(scene.graph, 200, seed))


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.name)
@pytest.mark.parametrize("suffix", [".usda", ".usdc", ".usdz"])
def test_examples_come_back_as_they_were(path: Path, suffix: str) -> None:
    scene = compile_path(path)
    back = there_and_back(scene, ExportOptions(), suffix)
    assert back.warnings == ()
    assert_same(scene, back.ir, rays_through(scene.ir, 500, 1))


VIEWS = """
settings(width: 320, height: 200, samples: 5, integrator: "ambient_occlusion",
  precision: "float64", occlusion_distance: 3, exposure: -0.5)
camera(from: (1, 2, 3), at: (0, 0.5, 0), fov: 30deg, name: "main view")
camera(from: (5, 0, 0), height: 4, near: 1, far: 9)
sun(direction: (1, -2, 0.5), irradiance: 3, color: rgb(1, 0.5, 0.25), angle: 2deg)
sun(direction: (0, -1, 0))
point_light(position: (1, 2, 3), intensity: 7, radius: 0.25)
point_light(position: (1, 2, 3), intensity: 7)
point_light(position: (1, 2, 3), radius: 1, direction: (1, -1, 0), cone: 40deg, softness: 0.5)
rectangle_light(size: (2, 3), radiance: 5, cone: 60deg, focus: 2).shear(xy: 0.5).rotate_x(20deg)
disc_light(radius: 0.5).scale(1, 1, 2).translate(1, 2, 3)
cylinder_light(radius: 0.1, height: 3, color: rgb(1, 0.5, 0)).rotate_z(30deg)
sky(color: rgb(0.1, 0.2, 0.3))
sphere()
"""


def test_lights_cameras_and_settings_come_back() -> None:
    first = compile_text(VIEWS).ir
    second = there_and_back(compile_text(VIEWS), ExportOptions()).ir
    for name in first.settings.dtype.names or ():
        np.testing.assert_array_equal(first.settings[name], second.settings[name])
    for table in ("lights", "cameras"):
        one, other = getattr(first, table), getattr(second, table)
        assert len(one) == len(other)
        for name in one.dtype.names:
            if name != "name":
                np.testing.assert_allclose(one[name], other[name], rtol=3e-7, atol=1e-7)
    names = [second.text(int(n)) for n in second.cameras["name"]]
    assert names == ["/World/Cameras/main_view", "/World/Cameras/camera"]


def test_names_come_from_object_paths(tmp_path: Path) -> None:
    stage = exported(
        "let tower = { box()\n sphere().translate(0, 2, 0) }\n"
        "tower\nfor i in 0..3 { tower.translate(3 * i, 0, 5) }\n",
        tmp_path,
    )
    paths = {str(prim.GetPath()) for prim in stage.Traverse()}
    assert {"/World/tower", "/World/tower_0", "/World/tower_1", "/World/tower_2"} <= paths
    prims = [stage.GetPrimAtPath(f"/World/tower_{i}") for i in range(3)]
    assert len({prim.GetPrototype().GetPath() for prim in prims}) == 1


def test_many_instances_are_one_point_instancer_that_others_can_draw(tmp_path: Path) -> None:
    from pxr import Usd, UsdGeom

    program = (
        "let petal = sphere().scale(1, 4, 1)\n"
        "for i in 0..20 { petal.rotate_z(18deg * i).translate(i, 0, 0) }\n"
    )
    stage = exported(program, tmp_path)
    (prim,) = [p for p in stage.Traverse() if p.IsA(UsdGeom.PointInstancer)]
    instancer = UsdGeom.PointInstancer(prim)
    matrices = instancer.ComputeInstanceTransformsAtTime(
        Usd.TimeCode.Default(), Usd.TimeCode.Default()
    )
    ir = compile_text(program).ir
    expected = ir.world_from_object
    found = np.array(matrices).transpose(0, 2, 1)[:, :3]
    np.testing.assert_allclose(found, expected, atol=1e-5)
    back = compile_path(tmp_path / "scene.usda").ir
    assert object_path(back, 3) == "/World/petal/sphere@/World/petal[3]"


def test_what_shears_is_no_point_instancer(tmp_path: Path) -> None:
    from pxr import UsdGeom

    program = "for i in 0..20 { sphere().shear(xy: 1 + i).translate(i, 0, 0) }\n"
    stage = exported(program, tmp_path)
    assert not [p for p in stage.Traverse() if p.IsA(UsdGeom.PointInstancer)]


def test_materials_keep_their_strength(tmp_path: Path) -> None:
    program = """
let red = matte(color: rgb(1, 0, 0))
let blue = matte(color: rgb(0, 0, 1))
let pair = { sphere().material(red)
 box().translate(3, 0, 0) }
pair.material(blue)
pair.translate(0, 0, 5).override(blue)
"""
    scene = compile_text(program)
    back = there_and_back(scene, ExportOptions())
    diffuse = [tuple(m["diffuse"]) for m in back.ir.materials[back.ir.instance_material]]
    assert diffuse == [(1, 0, 0), (0, 0, 1), (0, 0, 1), (0, 0, 1)]


def test_nested_groups_keep_their_levels(tmp_path: Path) -> None:
    program = (
        "let row = { for i in 0..20 { sphere().scale(0.4).translate(i, 0, 0) } }\n"
        "let sheet = { for i in 0..20 { row.translate(0, 0, i) } }\n"
        "for i in 0..20 { sheet.translate(0, i, 0) }\n"
    )
    path = tmp_path / "deep.usdc"
    scene = compile_text(program)
    export_stage(scene, path)
    assert path.stat().st_size < 30_000
    back = compile_path(path)
    assert_same(scene, back.ir, rays_through(scene.ir, 200, 1))


def test_a_chain_of_groups_however_long_is_written(tmp_path: Path) -> None:
    nested = "sphere()\n"
    program = "let g0 = sphere()\n" + "".join(
        f"let g{i + 1} = {{ g{i}.translate(1, 0, 0)\n box(size: (0.1, 0.1, 0.1)) }}\n"
        for i in range(150)
    )
    scene = compile_text(f"{nested}{program}g150\n")
    back = there_and_back(scene, ExportOptions(), ".usdc")
    assert_same(scene, back.ir, rays_through(scene.ir, 100, 1))


def test_instances_without_an_inverse_are_left_out_of_stages_too() -> None:
    scene = compile_text("sphere()\nsphere().scale(0, 1, 1)\nbox().scale(0)\n")
    back = there_and_back(scene, ExportOptions())
    assert len(back.ir.instance_target) == 1


@pytest.mark.parametrize("name", ["missing/scene.usda", "scene.txt", "folder.usda"])
def test_what_cannot_be_written_is_told(tmp_path: Path, name: str) -> None:
    (tmp_path / "folder.usda").mkdir()
    with pytest.raises(ExportError, match=r"scene|folder"):
        export_stage(compile_text("sphere()"), tmp_path / name)


SOLIDS = [k for k in ShapeKind if k not in (ShapeKind.SPHERE, ShapeKind.RECTANGLE)]


@given(st.sampled_from(SOLIDS), st.integers(0, 10**9))
@example(ShapeKind.WEDGE, 267)  # narrow: its diameter is far below that of its circle
@settings(max_examples=30)
def test_fallback_meshes_lie_on_their_solid(kind: ShapeKind, seed: int) -> None:
    shape = random_shape(kind, np.random.default_rng(seed))
    mesh = polygons(kind, shape.parameters, 1e-3)
    assert mesh.counts.sum() == len(mesh.corners)
    assert mesh.counts.min() >= 3
    edges: dict[tuple[int, int], int] = {}
    first = 0
    for count in mesh.counts.tolist():
        face = mesh.corners[first : first + count].tolist()
        first += count
        for a, b in zip(face, face[1:] + face[:1], strict=True):
            edges[a, b] = edges.get((a, b), 0) + 1
    if kind not in (ShapeKind.DISC, ShapeKind.PLANE, ShapeKind.TRIANGLE):
        # A closed surface: every edge is used once in each direction.
        assert set(edges.values()) == {1}
        assert all((b, a) in edges for a, b in edges)
    assert_within(shape, mesh, 1e-3)


def assert_within(shape: Shape, mesh: Polygons, tolerance: float) -> None:
    """From just outside each face, the solid is met just as far behind it as it may be."""
    sharp = shape.parameters
    if "bevel" in SHAPE_PARAMETERS[shape.kind]:
        sharp = (*sharp[:-1], 0.0)
    size = float(np.ptp(polygons(shape.kind, sharp, 0.1).points, axis=0).max())
    starts = np.concatenate([[0], np.cumsum(mesh.counts)[:-1]])
    a, b, c = (mesh.points[mesh.corners[starts + k]] for k in range(3))
    normals = np.cross(b - a, c - a)
    areas = np.linalg.norm(normals, axis=1)
    # What is much narrower than the tolerance may lie on any side.
    wide = np.sqrt(areas) > 1e-2 * size
    if not wide.any():
        return
    middle, normals = ((a + b + c) / 3)[wide], normals[wide] / areas[wide, None]
    distance = 4.0 * tolerance * size
    hits = Tracer(compiled(SceneGraph(shape)).ir).trace(middle + distance * normals, -normals)
    assert (hits.t <= 2.0 * distance).all()


SURFACE = """#usda 1.0
def Mesh "m" (prepend apiSchemas = ["MaterialBindingAPI"]) {
    uniform token subdivisionScheme = "none"
    int[] faceVertexCounts = [3, 3]
    int[] faceVertexIndices = [0, 1, 2, 0, 2, 3]
    point3f[] points = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]
    normal3f[] normals = [(0, 0, 1), (0, 0.6, 0.8), (0.6, 0, 0.8), (0, 0, 1)] (
        interpolation = "vertex"
    )
    texCoord2f[] primvars:map = [(0, 0), (1, 0), (1, 1), (0, 1)] (interpolation = "faceVarying")
    int[] primvars:map:indices = [0, 1, 2, 0, 2, 3]
    rel material:binding = </look>
}
def Material "look" {
    token outputs:surface.connect = </look/s.outputs:surface>
    def Shader "s" {
        uniform token info:id = "UsdPreviewSurface"
        color3f inputs:diffuseColor.connect = </look/t.outputs:rgb>
        float inputs:roughness.connect = </look/t.outputs:g>
        token outputs:surface
    }
    def Shader "t" {
        uniform token info:id = "UsdUVTexture"
        asset inputs:file = @picture.png@
        float2 inputs:st.connect = </look/p.outputs:result>
        token inputs:wrapS = "repeat"
        token inputs:sourceColorSpace = "raw"
        float4 inputs:scale = (2, 1, 1, 1)
        float4 inputs:fallback = (0.5, 0, 0, 1)
        float3 outputs:rgb
        float outputs:g
    }
    def Shader "p" {
        uniform token info:id = "UsdTransform2d"
        float2 inputs:in.connect = </look/r.outputs:result>
        float inputs:rotation = 30
        float2 inputs:scale = (2, -3)
        float2 inputs:translation = (0.25, 0.5)
        float2 outputs:result
    }
    def Shader "r" {
        uniform token info:id = "UsdPrimvarReader_float2"
        string inputs:varname = "map"
        float2 outputs:result
    }
}
"""


def test_textures_and_what_they_are_laid_by_come_back(tmp_path: Path) -> None:
    stage = tmp_path / "stage.usda"
    stage.write_text(SURFACE)
    scene = compile_path(stage)
    export_stage(scene, tmp_path / "again.usda")
    back = compile_path(tmp_path / "again.usda")
    (bound, mesh), (other_bound, other_mesh) = (surface(c.graph.root) for c in (scene, back))
    assert len(bound.material.textures) == len(other_bound.material.textures) == 2
    for one, other in zip(bound.material.textures, other_bound.material.textures, strict=True):
        np.testing.assert_allclose(one.matrix, other.matrix, atol=1e-6)
        same = replace(other, matrix=one.matrix, file=one.file)
        assert one == same
        assert Path(other.file).name == "picture.png"
    assert [a.name for a in mesh.attributes] == [a.name for a in other_mesh.attributes]
    for a, b in zip(mesh.attributes, other_mesh.attributes, strict=True):
        np.testing.assert_array_equal(corners(mesh, a), corners(other_mesh, b))


def surface(node: Node) -> tuple[Bind, Mesh]:
    """The only mesh below a node, and what binds it."""
    bound: Bind | None = None
    while not isinstance(node, Mesh):
        if isinstance(node, Bind):
            bound = node
        node = node.items[0] if isinstance(node, Group) else node.child  # type: ignore[union-attr]
    assert bound is not None
    return bound, node


def corners(mesh: Mesh, attribute: MeshAttribute) -> np.ndarray:
    """The values at the corners of each triangle."""
    rows = mesh.triangles if attribute.corners is None else attribute.corners
    return np.asarray(attribute.values[rows])
