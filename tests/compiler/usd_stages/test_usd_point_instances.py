"""Point instancers: placed, masked, named, coloured, and robust."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from compiler.compilation import compile_path

POINTS = """
def Xform "world" {
    double3 xformOp:translate = (5, 0, 0)
    uniform token[] xformOpOrder = ["xformOp:translate"]
    def PointInstancer "trees" {
        float3 xformOp:rotateXYZ = (10, 20, 30)
        uniform token[] xformOpOrder = ["xformOp:rotateXYZ"]
        rel prototypes = [</world/trees/oak>, </elsewhere/fir>]
        int[] protoIndices = [1, 0, 1, 0, 0]
        point3f[] positions = [(0, 0, 0), (1, 0, 0), (2, 0, 0), (3, 0, 0), (4, 0, 0)]
        float3[] scales = [(1, 1, 1), (2, 1, 1), (1, 3, 1), (1, 1, 1), (1, 1, 0.5)]
        quath[] orientations = [(1, 0, 0, 0), (0.7071, 0.7071, 0, 0), (0, 0, 1, 0),
                                (0.5, 0.5, 0.5, 0.5), (0.9, 0.436, 0, 0)]
        MASKS
        def Xform "oak" {
            double3 xformOp:translate = (0, 0, 7)
            uniform token[] xformOpOrder = ["xformOp:translate"]
            def Cube "crown" {
                double3 xformOp:translate = (0, 2, 0)
                uniform token[] xformOpOrder = ["xformOp:translate"]
            }
            def Cylinder "trunk" {
                uniform token axis = "Y"
            }
        }
    }
}
def Xform "elsewhere" {
    double3 xformOp:translate = (1000, 0, 0)
    uniform token[] xformOpOrder = ["xformOp:translate"]
    def Sphere "fir" {
        double3 xformOp:translate = (0, 0, 3)
        uniform token[] xformOpOrder = ["xformOp:translate"]
    }
}
"""


@pytest.mark.parametrize(
    ("masks", "kept"),
    [
        ("", [0, 1, 2, 3, 4]),
        ("int64[] invisibleIds = [1, 2]", [0, 3, 4]),
        ("int64[] ids = [10, 11, 12, 13, 14]\nint64[] invisibleIds = [11, 3]", [0, 2, 3, 4]),
        ("int64[] ids = [10, 11, 12]\nint64[] invisibleIds = [0]", [1, 2, 3, 4]),
    ],
)
def test_points_stand_where_usd_core_has_them(
    load: Callable[..., Any], tmp_path: Path, masks: str, kept: list[int]
) -> None:
    from pxr import Usd, UsdGeom

    imported = load(POINTS.replace("MASKS", masks))
    stage = Usd.Stage.Open(str(tmp_path / "stage.usda"))
    instancer = UsdGeom.PointInstancer.Get(stage, "/world/trees")
    instancer.GetInvisibleIdsAttr().Clear()
    transforms = instancer.ComputeInstanceTransformsAtTime(0, 0)
    cache = UsdGeom.XformCache()
    outer = cache.GetLocalToWorldTransform(instancer.GetPrim())
    parts = {0: ["/world/trees/oak/crown", "/world/trees/oak/trunk"], 1: ["/elsewhere/fir"]}
    expected = []
    for number, root in enumerate(["/world/trees/oak", "/elsewhere/fir"]):
        for row in kept:
            if instancer.GetProtoIndicesAttr().Get()[row] == number:
                for part in parts[number]:
                    local, _ = cache.ComputeRelativeTransform(
                        stage.GetPrimAtPath(part), stage.GetPrimAtPath(root)
                    )
                    world = np.array(local * transforms[row] * outer).T
                    expected.append((f"{part}@/world/trees[{row}]", world))
    expected.append(
        ("/elsewhere/fir",
         np.array(cache.GetLocalToWorldTransform(stage.GetPrimAtPath("/elsewhere/fir"))).T)
    )  # fmt: skip
    assert imported.paths() == [path for path, _ in expected]
    for leaf, (_, world) in zip(imported.leaves, expected, strict=True):
        np.testing.assert_allclose(leaf.world, world, atol=1e-6)


@pytest.mark.parametrize("prototypes", [1, 3, 12])
def test_many_points_stand_where_usd_core_has_them(tmp_path: Path, prototypes: int) -> None:
    from pxr import Usd, UsdGeom, Vt

    count = 40_000
    random = np.random.default_rng(prototypes)
    path = tmp_path / "stage.usdc"
    stage = Usd.Stage.CreateNew(str(path))
    instancer = UsdGeom.PointInstancer.Define(stage, "/p")
    for k in range(prototypes):
        UsdGeom.Sphere.Define(stage, f"/p/s{k}").CreateRadiusAttr(k + 1.0)
    instancer.GetPrototypesRel().SetTargets([f"/p/s{k}" for k in range(prototypes)])
    numbers = random.integers(0, prototypes, count)
    places = random.uniform(0.0, 100.0, (count, 3)).astype(np.float32)
    places[35_000, 1] = np.nan
    turns = random.normal(size=(count, 4))
    turns /= np.linalg.norm(turns, axis=1, keepdims=True)
    scales = random.uniform(0.5, 1.5, (count, 3)).astype(np.float32)
    scales[38_000, 2] = 0.0
    instancer.CreatePositionsAttr(Vt.Vec3fArray.FromNumpy(places))
    instancer.CreateOrientationsAttr(Vt.QuathArray.FromNumpy(turns.astype(np.float16)))
    instancer.CreateScalesAttr(Vt.Vec3fArray.FromNumpy(scales))
    instancer.CreateProtoIndicesAttr(Vt.IntArray.FromNumpy(numbers.astype(np.int32)))
    matrices = np.array(
        instancer.ComputeInstanceTransformsAtTime(0, 0, applyMask=UsdGeom.PointInstancer.IgnoreMask)
    )
    wrong = numbers.astype(np.int32)
    wrong[30_000] = prototypes
    instancer.GetProtoIndicesAttr().Set(Vt.IntArray.FromNumpy(wrong))
    stage.Save()
    ir = compile_path(path).ir
    sources = ir.instance_source
    while (ir.source_index[sources] < 0).any():
        up = ir.source_index[sources] < 0
        sources = np.where(up, ir.source_parent[sources], sources)
    rows = ir.source_index[sources]
    sound = np.delete(np.arange(count), [30_000, 35_000])
    np.testing.assert_array_equal(np.sort(rows), sound)
    solid = rows != 38_000
    rows, targets, worlds = rows[solid], ir.instance_target[solid], ir.world_from_object[solid]
    radii = ir.shape_parameters[ir.prototype_data[targets]]
    np.testing.assert_array_equal(radii, numbers[rows] + 1.0)
    expected = np.moveaxis(matrices[rows], 1, 2)[:, :3]
    np.testing.assert_allclose(worlds, expected, rtol=0, atol=2e-5)


def test_inactive_ids_are_left_out(load: Callable[..., Any]) -> None:
    text = POINTS.replace("MASKS", "").replace(
        'def PointInstancer "trees" {', 'def PointInstancer "trees" (inactiveIds = [0, 4]) {'
    )
    paths = load(text).paths()
    assert [p for p in paths if "fir@" in p] == ["/elsewhere/fir@/world/trees[2]"]
    assert "/world/trees/oak/crown@/world/trees[4]" not in paths


def test_bad_points_are_left_out_and_the_others_keep_their_places(
    load: Callable[..., Any],
) -> None:
    imported = load("""
def PointInstancer "p" {
    rel prototypes = [</p/a>, </p/missing>, </p/b>]
    int[] protoIndices = [0, 1, 7, -1, 2, 0, 0]
    point3f[] positions = [(0, 0, 0), (1, 0, 0), (2, 0, 0), (3, 0, 0), (4, 0, 0), (nan, 0, 0)]
    float3[] scales = []
    def Cube "a" {
    }
    def Cube "b" {
    }
}
def PointInstancer "empty" {
}
""")
    assert imported.paths() == ["/p/a@/p[0]", "/p/b@/p[4]"]
    assert [leaf.world[0, 3] for leaf in imported.leaves] == [0.0, 4.0]
    assert imported.said("6 `positions` for 7 instances")
    assert imported.said("2 instances whose prototype index is out of range")
    assert imported.said("missing prototype </p/missing>")
    assert imported.said("1 instances whose `positions` are not finite")
    assert imported.said("without indices or positions").primary.place.prim == "/empty"


def test_quaternions_far_from_unit_are_normalised(load: Callable[..., Any]) -> None:
    (leaf,) = load("""
def PointInstancer "p" {
    rel prototypes = </p/a>
    int[] protoIndices = [0]
    point3f[] positions = [(0, 0, 0)]
    quath[] orientations = [(3, 0, 0, 3)]
    quatf[] orientationsf = [(2, 0, 0, 2)]
    def Cube "a" {
    }
}
""").leaves
    np.testing.assert_allclose(leaf.world[:3, :3] @ [1, 0, 0], [0, 1, 0], atol=1e-15)


def test_instancers_nest_in_each_other_and_in_native_instances(load: Callable[..., Any]) -> None:
    imported = load("""
class Xform "_grove" {
    def PointInstancer "outer" {
        rel prototypes = </_grove/outer/inner>
        int[] protoIndices = [0, 0]
        point3f[] positions = [(0, 0, 0), (10, 0, 0)]
        def PointInstancer "inner" {
            rel prototypes = </_grove/outer/inner/car>
            int[] protoIndices = [0, 0]
            point3f[] positions = [(0, 0, 0), (1, 0, 0)]
            int64[] invisibleIds = [0]
            def Xform "car" (instanceable = true
                inherits = </_car>
            ) {
            }
        }
    }
}
class Xform "_car" {
    def Sphere "s" {
    }
}
def Xform "north" (instanceable = true
    inherits = </_grove>
) {
    double3 xformOp:translate = (0, 100, 0)
    uniform token[] xformOpOrder = ["xformOp:translate"]
}
def Xform "south" (instanceable = true
    inherits = </_grove>
) {
}
""")
    assert imported.paths() == [
        f"/{side}/outer/inner/car/s@/{side}/outer/inner[1]@/{side}/outer[{i}]"
        for side in ("north", "south")
        for i in (0, 1)
    ]
    assert [leaf.world[:2, 3].tolist() for leaf in imported.leaves] == [
        [1.0, 100.0], [11.0, 100.0], [1.0, 0.0], [11.0, 0.0],
    ]  # fmt: skip
    assert imported.diagnostics == []


def test_prototypes_may_be_classes_and_overs(load: Callable[..., Any]) -> None:
    imported = load("""
def PointInstancer "p" {
    rel prototypes = [</_class>, </p/over>]
    int[] protoIndices = [0, 1]
    point3f[] positions = [(0, 0, 0), (1, 0, 0)]
    over "over" {
        def Sphere "s" {
        }
    }
}
class Xform "_class" {
    def Cube "c" {
    }
    def "native" (instanceable = true
        inherits = </_inner>
    ) {
    }
}
class Xform "_inner" {
    def Cone "d" {
    }
}
""")
    assert imported.paths() == [
        "/_class/c@/p[0]",
        "/_class/native/d@/p[0]",
        "/p/over/s@/p[1]",
    ]


def test_a_reset_within_a_prototype_drops_what_is_within_the_prototype(
    load: Callable[..., Any],
) -> None:
    (leaf,) = load("""
def PointInstancer "p" {
    double3 xformOp:translate = (100, 0, 0)
    uniform token[] xformOpOrder = ["xformOp:translate"]
    rel prototypes = </p/a>
    int[] protoIndices = [0]
    point3f[] positions = [(0, 10, 0)]
    def Xform "a" {
        def Xform "moved" {
            double3 xformOp:translate = (7, 7, 7)
            uniform token[] xformOpOrder = ["xformOp:translate"]
            def Cube "c" {
                double3 xformOp:translate = (0, 0, 1)
                uniform token[] xformOpOrder = ["!resetXformStack!", "xformOp:translate"]
            }
        }
    }
}
""").leaves
    assert leaf.world[:3, 3].tolist() == [100.0, 10.0, 1.0]


def test_prototypes_that_contain_themselves_end(load: Callable[..., Any]) -> None:
    imported = load("""
def PointInstancer "p" {
    rel prototypes = [</p/a>, </p/b>]
    int[] protoIndices = [0, 1]
    point3f[] positions = [(0, 0, 0), (1, 0, 0)]
    def Xform "a" {
        def PointInstancer "q" {
            rel prototypes = [</p/a>]
            int[] protoIndices = [0]
            point3f[] positions = [(0, 0, 0)]
        }
    }
    def Cube "b" {
    }
}
""")
    assert imported.paths() == ["/p/b@/p[1]"]
    assert imported.said("contains itself").primary.place.prim == "/p/a"


COLORED = """
def PointInstancer "p" {
    rel prototypes = [</p/plain>, </p/own>, </far>]
    int[] protoIndices = [0, 1, 2, 0, 1, 2, 0]
    point3f[] positions = [(0, 0, 0), (2, 0, 0), (4, 0, 0), (6, 0, 0), (8, 0, 0), (10, 0, 0),
        (12, 0, 0)]
    COLORS
    def Cube "plain" {
    }
    def Sphere "own" {
        color3f[] primvars:displayColor = [(1, 1, 1)]
    }
}
def Cone "far" {
}
"""


@pytest.mark.parametrize("interpolation", ["vertex", "varying", "faceVarying"])
def test_each_instance_has_its_own_colour_unless_its_prims_have(
    load: Callable[..., Any], interpolation: str
) -> None:
    imported = load(
        COLORED.replace(
            "COLORS",
            f"""
    color3f[] primvars:displayColor = [(1, 0, 0), (0, 0.5, 0)] (
        interpolation = "{interpolation}"
    )
    int[] primvars:displayColor:indices = [0, 0, 1, 1, 1, 0, 0]
    float[] primvars:displayOpacity = [0.5, 1, 1, 1, 1, 1, 0.25] (
        interpolation = "vertex"
    )
""",
        )
    )
    red, green, white = (1.0, 0.0, 0.0), (0.0, 0.5, 0.0), (1.0, 1.0, 1.0)
    drawn = {
        leaf.world[0, 3]: (leaf.material.diffuse, leaf.material.opacity)
        for leaf in imported.leaves
        if "@" in leaf.path
    }
    assert drawn == {
        0.0: (red, 0.5),
        2.0: (white, 1.0),
        4.0: (green, 1.0),
        6.0: (green, 1.0),
        8.0: (white, 1.0),
        10.0: (red, 1.0),
        12.0: (red, 0.25),
    }
    assert sorted(leaf.path for leaf in imported.leaves if "plain" in leaf.path) == [
        "/p/plain@/p[0]",
        "/p/plain@/p[3]",
        "/p/plain@/p[6]",
    ]
    assert not imported.diagnostics


def test_a_constant_colour_of_an_instancer_is_that_of_all(load: Callable[..., Any]) -> None:
    imported = load(COLORED.replace("COLORS", "color3f[] primvars:displayColor = [(0, 0, 1)]"))
    drawn = {leaf.path: leaf.material.diffuse for leaf in imported.leaves}
    assert drawn["/p/plain@/p[3]"] == (0.0, 0.0, 1.0)
    assert drawn["/p/own@/p[1]"] == (1.0, 1.0, 1.0)


def test_a_uniform_colour_of_an_instancer_is_that_of_all(load: Callable[..., Any]) -> None:
    colors = """color3f[] primvars:displayColor = [(0, 0, 1), (0, 1, 0)] (
        interpolation = "uniform"
    )"""
    imported = load(COLORED.replace("COLORS", colors))
    drawn = {leaf.path: leaf.material.diffuse for leaf in imported.leaves}
    assert drawn["/p/plain@/p[0]"] == drawn["/p/plain@/p[6]"] == (0.0, 0.0, 1.0)
    assert drawn["/far@/p[2]"] == (0.0, 0.0, 1.0)
    assert drawn["/p/own@/p[1]"] == (1.0, 1.0, 1.0)
    assert not imported.diagnostics


def test_of_several_elements_for_an_instance_its_first_is_its_colour(
    load: Callable[..., Any],
) -> None:
    listed = ", ".join(f"(0.{n}, 0, 0), (0, 1, 1)" for n in range(1, 8))
    colors = f"""color3f[] primvars:displayColor = [{listed}] (
        elementSize = 2
        interpolation = "varying"
    )"""
    imported = load(COLORED.replace("COLORS", colors))
    drawn = {leaf.path: leaf.material.diffuse for leaf in imported.leaves}
    assert drawn["/p/plain@/p[0]"] == pytest.approx((0.1, 0.0, 0.0))
    assert drawn["/far@/p[5]"] == pytest.approx((0.6, 0.0, 0.0))
    assert not imported.diagnostics


def test_the_innermost_instancer_colours_its_instances(load: Callable[..., Any]) -> None:
    imported = load("""
def PointInstancer "outer" {
    rel prototypes = [</outer/colored>, </outer/plain>]
    int[] protoIndices = [0, 1]
    point3f[] positions = [(0, 0, 0), (10, 0, 0)]
    color3f[] primvars:displayColor = [(1, 0, 0), (0, 1, 0)] (
        interpolation = "vertex"
    )
    def PointInstancer "colored" {
        rel prototypes = </ball>
        int[] protoIndices = [0]
        point3f[] positions = [(0, 0, 0)]
        color3f[] primvars:displayColor = [(0, 0, 1)] (
            interpolation = "vertex"
        )
    }
    def PointInstancer "plain" {
        rel prototypes = </ball>
        int[] protoIndices = [0]
        point3f[] positions = [(0, 0, 0)]
    }
}
def Sphere "ball" {
}
""")
    drawn = {leaf.path: leaf.material.diffuse for leaf in imported.leaves}
    assert drawn["/ball@/outer/colored[0]@/outer[0]"] == (0.0, 0.0, 1.0)
    assert drawn["/ball@/outer/plain[0]@/outer[1]"] == (0.0, 1.0, 0.0)


def test_a_wrong_number_of_colours_is_told_and_drawn_as_their_mean(
    load: Callable[..., Any],
) -> None:
    colors = """color3f[] primvars:displayColor = [(0, 0, 1), (0, 1, 0)] (
        interpolation = "vertex"
    )"""
    imported = load(COLORED.replace("COLORS", colors))
    assert imported.said("interpolation `vertex` is drawn as its mean")
    assert imported.leaves[0].material.diffuse == (0.0, 0.5, 0.5)


def test_very_many_colours_are_rounded(tmp_path: Path) -> None:
    from pxr import Sdf, Usd, UsdGeom, Vt

    count = 20_000
    path = tmp_path / "stage.usdc"
    stage = Usd.Stage.CreateNew(str(path))
    instancer = UsdGeom.PointInstancer.Define(stage, "/p")
    UsdGeom.Sphere.Define(stage, "/p/s")
    instancer.GetPrototypesRel().SetTargets(["/p/s"])
    places = np.zeros((count, 3), np.float32)
    places[:, 0] = np.arange(count)
    colors = np.random.default_rng(1).uniform(0.0, 1.0, (count, 3)).astype(np.float32)
    instancer.CreateProtoIndicesAttr(Vt.IntArray.FromNumpy(np.zeros(count, np.int32)))
    instancer.CreatePositionsAttr(Vt.Vec3fArray.FromNumpy(places))
    primvar = UsdGeom.PrimvarsAPI(instancer).CreatePrimvar(
        "displayColor", Sdf.ValueTypeNames.Color3fArray, UsdGeom.Tokens.vertex
    )
    primvar.Set(Vt.Vec3fArray.FromNumpy(colors))
    stage.Save()
    scene = compile_path(path)
    np.testing.assert_array_equal(scene.ir.world_from_object[:, 0, 3], np.arange(count))
    drawn = scene.ir.materials["diffuse"][scene.ir.instance_material]
    assert np.abs(np.sqrt(drawn) - np.sqrt(colors)).max() < 0.5 / 15 + 1e-6
    assert any("20000 colours are drawn in rounded ones" in d.message for d in scene.warnings)


def test_colours_of_an_instancer_meet_the_opacity_of_each_instance_around_it(
    load: Callable[..., Any],
) -> None:
    stage = """
class Xform "_c" {
    def PointInstancer "p" {
        rel prototypes = </_c/p/k>
        int[] protoIndices = [0, 0]
        point3f[] positions = [(0, 0, 0), (4, 0, 0)]
        color3f[] primvars:displayColor = [(1, 0, 0), (0, 1, 0)] (
            interpolation = "vertex"
        )
        def Cube "k" {
        }
    }
}
"""
    for name, opacity in (("a", 0.25), ("b", 0.5)):
        stage += f"""
def Xform "{name}" (instanceable = true
    inherits = </_c>
) {{
    float[] primvars:displayOpacity = [{opacity}]
}}
"""
    drawn = {leaf.path: leaf.material for leaf in load(stage).leaves}
    assert {path[1]: material.opacity for path, material in drawn.items()} == {"a": 0.25, "b": 0.5}
    assert drawn["/b/p/k@/b/p[0]"].diffuse == (1.0, 0.0, 0.0)
