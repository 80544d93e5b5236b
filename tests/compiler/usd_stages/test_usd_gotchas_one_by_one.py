"""The traps of USD that importers fall into and `oracle` cannot judge: what is hit is written out.

Numbers are those of the list of gotchas in the project's notes on USD; see `test_usd_gotchas`.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import ovolo
from compiler.usd import StageOptions
from tests.compiler.usd_stages.oracle import pieces
from tests.compiler.usd_stages.ray_agreement import agree, compiled


def rays_along(path: Path, points: Any, direction: Any, **options: Any) -> Any:
    """Hits of rays from `points` `(n, 3)` along one direction, with the scene's paths."""
    scene, _ = compiled(path, options=StageOptions(**options))
    points = np.array(points, dtype=float)
    hits = ovolo.Tracer(scene).trace(points, np.tile(np.array(direction, float), (len(points), 1)))
    return hits, scene


def test_7_zero_and_nearly_zero_scales_are_sheets(tmp_path: Path) -> None:
    path = tmp_path / "stage.usda"
    path.write_text("""#usda 1.0
def Cube "flat" {
    float3 xformOp:scale = (1, 1, 0)
    uniform token[] xformOpOrder = ["xformOp:scale"]
}
def Sphere "thin" {
    double3 xformOp:translate = (4, 0, 0)
    float3 xformOp:scale = (1, 1, 1e-20)
    uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:scale"]
}
def Sphere "line" {
    double3 xformOp:translate = (8, 0, 0)
    float3 xformOp:scale = (1, 0, 0)
    uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:scale"]
}
def PointInstancer "many" {
    rel prototypes = </many/c>
    int[] protoIndices = [0, 0]
    point3f[] positions = [(12, 0, 0), (16, 0, 1)]
    float3[] scales = [(1, 1, 0), (1, 1, 1)]
    def Cube "c" {
    }
}
""")
    hits, _ = rays_along(path, [(x, 0.5, 5.0) for x in (0.5, 3.5, 8, 12.5, 16.5)], (0, 0, -1))
    np.testing.assert_allclose(hits.t, [5, 5, np.inf, 5, 3], atol=1e-9)
    assert np.abs(hits.normal[hits.hit][:, 2]).min() > 0.999


def test_11_faulty_instances_are_left_out_and_the_others_stay(tmp_path: Path) -> None:
    path = tmp_path / "stage.usda"
    path.write_text("""#usda 1.0
def PointInstancer "many" {
    rel prototypes = [</many/c>, </many/nothing>]
    int[] protoIndices = [0, 1, 7, -1, 0, 0, 0, 0]
    point3f[] positions = [(0, 0, 0), (4, 0, 0), (8, 0, 0), (12, 0, 0), (16, 0, 0), (20, nan, 0),
        (24, 0, 0)]
    float3[] scales = [(1, 1, 1), (1, 1, 1), (1, 1, 1), (1, 1, 1), (1, 1, 2), (1, 1, 1), (1, 1, 3),
        (1, 1, 1)]
    def Cube "c" {
    }
}
""")
    hits, scene = rays_along(path, [(4.0 * i, 0, 9) for i in range(8)], (0, 0, -1))
    np.testing.assert_allclose(hits.t, [8, *[np.inf] * 3, 7, np.inf, 6, np.inf])
    paths = [ovolo_path(scene, i) for i in hits.instance[hits.hit]]
    assert paths == [f"/many/c@/many[{i}]" for i in (0, 4, 6)]


def ovolo_path(scene: Any, leaf: Any) -> str:
    from compiler.provenance import object_path

    return object_path(scene, int(leaf))


CUBE = """
    point3f[] points = [(-1, -1, -1), (1, -1, -1), (1, 1, -1), (-1, 1, -1), (-1, -1, 1), (1, -1, 1),
        (1, 1, 1), (-1, 1, 1)]
    int[] faceVertexCounts = [4, 4, 4, 4, 4, 4]
    int[] faceVertexIndices = [3, 2, 1, 0, 4, 5, 6, 7, 0, 1, 5, 4, 1, 2, 6, 5, 2, 3, 7, 6, 3, 0, 4, 7]
"""  # noqa: E501


@pytest.mark.parametrize(("complexity", "center", "corner"), [
    ("low", 1.0, 1.0), ("high", 68 / 81, 0.5), ("limit", 68 / 81, 0.5),
])  # fmt: skip
def test_12_schemes_are_catmull_clark_by_default(
    tmp_path: Path, complexity: Any, center: float, corner: float
) -> None:
    """The limit of a cube's face centre and corner are known: 68/81 and 1/2 of the half size."""
    path = tmp_path / "stage.usda"
    path.write_text(f'#usda 1.0\ndef Mesh "m" {{{CUBE}}}\n')
    hits, _ = rays_along(path, [(1e-7, 2e-7, 9)], (0, 0, -1), complexity=complexity)
    np.testing.assert_allclose(9 - hits.t, center, rtol=1e-5)
    hits, _ = rays_along(path, [(9 + 1e-7, 9 + 2e-7, 9)], (-1, -1, -1), complexity=complexity)
    np.testing.assert_allclose(9 - hits.t, corner, rtol=1e-5)


@pytest.mark.parametrize(
    "normals",
    [
        "normal3f[] normals = [(1, 0, 0)]",
        "normal3f[] primvars:normals = [(1, 0, 0), (1, 0, 0)]",
        'string normals = "odd"',
        "normal3f normals = (1, 0, 0)",
        "int[] normals = [1, 2]",
        "normal3f[] normals = [(nan, nan, nan), (0, 0, 0), (1, 0, 0), (0, 1, 0)]",
    ],
)
def test_14_authored_normals_move_no_hit_and_no_geometric_normal(
    tmp_path: Path, normals: str
) -> None:
    path = tmp_path / "stage.usda"
    path.write_text(f"""#usda 1.0
def Mesh "m" {{
    point3f[] points = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]
    int[] faceVertexCounts = [4]
    int[] faceVertexIndices = [0, 1, 2, 3]
    uniform token subdivisionScheme = "none"
    {normals}
}}
""")
    hits, _ = rays_along(path, [(0.25, 0.5, 3)], (0, 0, -1))
    np.testing.assert_allclose(hits.t, 3)
    np.testing.assert_allclose(hits.normal, [(0, 0, 1)])


def test_16_and_17_hits_have_the_material_that_usd_core_binds(tmp_path: Path) -> None:
    from pxr import Usd, UsdShade

    def material(name: str, red: float) -> str:
        return f"""
    def Material "{name}" {{
        token outputs:surface.connect = </Looks/{name}/s.outputs:surface>
        def Shader "s" {{
            uniform token info:id = "UsdPreviewSurface"
            color3f inputs:diffuseColor = ({red}, 0.5, 0.25)
            token outputs:surface
        }}
    }}"""

    path = tmp_path / "stage.usda"
    api = 'prepend apiSchemas = ["MaterialBindingAPI"]'
    path.write_text(f"""#usda 1.0
def Scope "Looks" {{{material("a", 0.125)}{material("b", 0.75)}{material("c", 1.0)}
}}
def Xform "world" (
    prepend apiSchemas = ["MaterialBindingAPI", "CollectionAPI:some"]
) {{
    rel material:binding = </Looks/a>
    uniform token collection:some:expansionRule = "expandPrims"
    rel collection:some:includes = </world/singled>
    rel material:binding:collection:some = [</world.collection:some>, </Looks/c>]
    def Sphere "plain" {{
    }}
    def Sphere "own" ({api}) {{
        rel material:binding = </Looks/b>
        double3 xformOp:translate = (3, 0, 0)
        uniform token[] xformOpOrder = ["xformOp:translate"]
    }}
    def Sphere "singled" {{
        double3 xformOp:translate = (6, 0, 0)
        uniform token[] xformOpOrder = ["xformOp:translate"]
    }}
    def Xform "strong" ({api}) {{
        rel material:binding = </Looks/c> (
            bindMaterialAs = "strongerThanDescendants"
        )
        def Sphere "below" ({api}) {{
            rel material:binding = </Looks/b>
            double3 xformOp:translate = (9, 0, 0)
            uniform token[] xformOpOrder = ["xformOp:translate"]
        }}
    }}
    def Sphere "dangling" ({api}) {{
        rel material:binding = </Nowhere>
        color3f[] primvars:displayColor = [(0.3, 0.3, 0.3)]
        double3 xformOp:translate = (12, 0, 0)
        uniform token[] xformOpOrder = ["xformOp:translate"]
    }}
}}
def Sphere "bare" {{
    double3 xformOp:translate = (15, 0, 0)
    uniform token[] xformOpOrder = ["xformOp:translate"]
}}
def Sphere "colored" {{
    color3f[] primvars:displayColor = [(0.3, 0.2, 0.1)]
    double3 xformOp:translate = (18, 0, 0)
    uniform token[] xformOpOrder = ["xformOp:translate"]
}}
""")
    hits, scene = rays_along(path, [(3.0 * i, 0, 9) for i in range(7)], (0, 0, -1))
    stage = Usd.Stage.Open(str(path))
    for leaf, number in zip(hits.instance, hits.material, strict=True):
        prim = stage.GetPrimAtPath(ovolo_path(scene, leaf))
        bound, _ = UsdShade.MaterialBindingAPI(prim).ComputeBoundMaterial()
        expected = {
            "/bare": (0.18, 0.18, 0.18),
            "/colored": (0.3, 0.2, 0.1),
            "/world/dangling": (0.3,) * 3,
        }.get(str(prim.GetPath()))
        if bound:
            shader = bound.ComputeSurfaceSource()[0]
            expected = shader.GetInput("diffuseColor").Get()
        assert scene.materials["diffuse"][number] == pytest.approx(expected, rel=1e-6)


@pytest.mark.parametrize("seed", range(4))
def test_24_cameras_see_what_usd_cores_see(tmp_path: Path, seed: int) -> None:
    """Corners and centre of the window, by usd-core's frustum and by the IR's record."""
    from pxr import Gf, Usd, UsdGeom

    random = np.random.default_rng(seed)
    stage = Usd.Stage.CreateNew(str(tmp_path / "stage.usda"))
    outer = UsdGeom.Xform.Define(stage, "/a")
    outer.AddRotateXYZOp().Set(tuple(random.uniform(-90, 90, 3)))
    if not seed % 2:
        # usd-core's frustum knows no scale, which matters to parallel projections.
        outer.AddScaleOp().Set((2, 2, 2))
    camera = UsdGeom.Camera.Define(stage, "/a/c")
    camera.AddTranslateOp().Set(tuple(random.uniform(-5, 5, 3)))
    camera.CreateHorizontalApertureAttr(float(random.uniform(10, 40)))
    camera.CreateVerticalApertureAttr(float(random.uniform(10, 40)))
    camera.CreateHorizontalApertureOffsetAttr(float(random.uniform(-5, 5)))
    camera.CreateVerticalApertureOffsetAttr(float(random.uniform(-5, 5)))
    camera.CreateFocalLengthAttr(float(random.uniform(20, 80)))
    camera.CreateProjectionAttr("orthographic" if seed % 2 else "perspective")
    stage.Save()
    scene, _ = compiled(tmp_path / "stage.usda")
    (record,) = scene.cameras
    frustum = camera.GetCamera(Usd.TimeCode.Default()).frustum
    for x, y in ((0, 0), (-1, -1), (1, -1), (-1, 1), (1, 1)):
        line = frustum.ComputePickRay(Gf.Vec2d(x, y))
        width = record["height"] * record["aspect"]
        window = np.array([
            (x / 2 + record["shift"][0]) * width, (y / 2 + record["shift"][1]) * record["height"]
        ])  # fmt: skip
        axes, place = record["world_from_camera"][:, :3], record["world_from_camera"][:, 3]
        direction = -axes[:, 2]
        if seed % 2:
            place = place + axes[:, :2] @ window
        else:
            direction = direction + axes[:, :2] @ window
        expected = np.array(line.direction)
        np.testing.assert_allclose(direction / np.linalg.norm(direction), expected, atol=1e-6)
        off = np.array(line.startPoint) - place
        np.testing.assert_allclose(off - off @ expected * expected, 0, atol=1e-5)


def test_25_offsets_of_layers_scale_by_time_codes(tmp_path: Path) -> None:
    (tmp_path / "moving.usda").write_text("""#usda 1.0
(
    defaultPrim = "s"
    timeCodesPerSecond = 48
    framesPerSecond = 12
)
def Sphere "s" {
    double3 xformOp:translate.timeSamples = { 0: (0, 0, 0), 48: (48, 0, 0) }
    uniform token[] xformOpOrder = ["xformOp:translate"]
}
""")
    path = tmp_path / "stage.usda"
    path.write_text("""#usda 1.0
(
    timeCodesPerSecond = 24
)
def "a" (references = @moving.usda@ (offset = 10; scale = 2)) {
}
""")
    for time in (5.0, 10.0, 20.0, 58.0, 500.0):
        shown = pieces(path, time)
        agree(path, shown, time=time, count=50)
