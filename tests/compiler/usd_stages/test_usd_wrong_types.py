"""Attributes of other types than their schema's: a scene or diagnostics, never a traceback."""

from __future__ import annotations

import random
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from compiler.flatten import flatten
from compiler.usd import StageOptions, import_stage
from tests.compiler.usd_stages.ray_agreement import no_files

VALUES = {
    "int": "-3",
    "uint": "4000000000",
    "half": "3",
    "float": "nan",
    "double": "1e300",
    "bool": "1",
    "string": '"x"',
    "token": '"y"',
    "timecode": "3",
    "asset": "@nothing.png@",
    "float2": "(1, 0)",
    "float3": "(1, nan, 2)",
    "double3": "(1, 2, 3)",
    "quatf": "(0, 0, 0, 0)",
    "matrix4d": "((0, 0, 0, 0), (0, 0, 0, 0), (0, 0, 0, 0), (0, 0, 0, 0))",
    "int[]": "[5, -2, 7]",
    "float[]": "[nan, 1]",
    "double[]": "[]",
    "float2[]": "[(0, 0)]",
    "point3f[]": "[(0, 0, 0), (1, 1, 1), (inf, 0, 0)]",
    "color3f[]": "[(1, 1, 1)]",
    "quath[]": "[(0, 0, 0, 0)]",
    "matrix4d[]": "[]",
    "token[]": '["a", "b"]',
    "string[]": '["z"]',
}
KINDS = [
    "Mesh",
    "Cube",
    "Sphere",
    "Cylinder",
    "Cone",
    "Capsule",
    "Capsule_1",
    "Cylinder_1",
    "Plane",
    "PointInstancer",
    "BasisCurves",
    "NurbsCurves",
    "NurbsPatch",
    "HermiteCurves",
    "Points",
    "TetMesh",
    "Camera",
    "SphereLight",
    "RectLight",
    "DiskLight",
    "CylinderLight",
    "DistantLight",
    "DomeLight",
    "DomeLight_1",
    "RenderProduct",
    "Skeleton",
    "SkelAnimation",
    "SkelRoot",
    "GeomSubset",
    "Material",
    "BlendShape",
    "Xform",
]
OTHERS = [
    "visibility",
    "purpose",
    "model:drawMode",
    "model:applyDrawMode",
    "primvars:displayColor",
    "primvars:displayOpacity",
    "primvars:displayColor:indices",
    "primvars:st",
    "primvars:normals",
    "primvars:widths",
    "primvars:skel:jointIndices",
    "primvars:skel:jointWeights",
]
OPERATIONS = [
    f"xformOp:{kind}"
    for kind in ["translate", "scaleX", "rotateY", "rotateXYZ", "orient", "transform"]
]


def _prim(kind: str, name: str, chance: random.Random) -> str:
    from pxr import Sdf, Usd

    definition = Usd.SchemaRegistry().FindConcretePrimDefinition(kind)
    own = [
        each
        for each in definition.GetPropertyNames()
        if definition.GetSpecType(each) == Sdf.SpecTypeAttribute and each != "xformOpOrder"
    ]
    chosen = chance.sample(own, min(len(own), chance.randrange(1, 9)))
    operations = chance.sample(OPERATIONS, chance.randrange(3))
    lines = []
    for attribute in {*chosen, *chance.sample(OTHERS, 3), *operations}:
        right = attribute in own and str(definition.GetAttributeDefinition(attribute).GetTypeName())
        type = right if right in VALUES and chance.random() < 0.25 else chance.choice([*VALUES])
        value = VALUES[str(type)]
        if chance.random() < 0.2:
            lines.append(f"{type} {attribute}.timeSamples = {{ 0: {value}, 3: {value} }}")
        else:
            lines.append(f"{type} {attribute} = {value}")
    listed = ", ".join(f'"{operation}"' for operation in operations)
    lines.append(f"uniform token[] xformOpOrder = [{listed}]")
    if kind == "RenderSettings":
        lines += ["rel products = </p0>", "rel camera = </p1>"]
    return f'def {kind} "{name}" {{\n' + "\n".join(lines) + "\n}\n"


@pytest.mark.parametrize("seed", range(40))
def test_attributes_of_any_type_are_read_or_reported(seed: int, tmp_path: Path) -> None:
    chance = random.Random(seed)
    kinds = ["RenderProduct", "Camera", *chance.choices(KINDS, k=12)]
    prims = [_prim(kind, f"p{number}", chance) for number, kind in enumerate(kinds)]
    settings = _prim("RenderSettings", "s", chance)
    path = tmp_path / "stage.usda"
    path.write_text("#usda 1.0\n" + "".join(prims) + f'def Scope "Render" {{\n{settings}}}\n')
    for time in (None, 1.5):
        options = StageOptions(complexity=chance.choice(("low", "limit")))
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", RuntimeWarning)  # of numbers near 1e300
            graph, found = import_stage(path, time=time, options=options)
            flatten(graph, no_files)
        assert not [d for d in found if d.severity == "error"]


def test_operations_of_other_types_are_left_out_and_said(load: Callable[..., Any]) -> None:
    imported = load("""
def Cube "c" {
    double xformOp:translate = 5
    double3 xformOp:rotateX = (1, 2, 3)
    double3 xformOp:scale = (2, 3, 4)
    uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:rotateX", "xformOp:scale"]
}
def SphereLight "l" {
    float inputs:color = 3
    double xformOp:translate = 5
    uniform token[] xformOpOrder = ["xformOp:translate"]
}
def Camera "k" {
    float clippingRange = 3
}
""")
    (cube,) = imported.leaves
    assert cube.world.diagonal().tolist() == [2.0, 3.0, 4.0, 1.0]
    assert imported.said("`xformOp:translate` has no finite value of its type")
    assert imported.said("`xformOp:rotateX` has no finite value of its type")
    assert imported.said("`inputs:color` is not of its type").primary.place.prim == "/l"
    assert imported.said("`clippingRange` is not of its type").primary.place.prim == "/k"


def test_settings_of_unknown_purposes_draw_the_others(load: Callable[..., Any]) -> None:
    imported = load("""
def Scope "Render" {
    def RenderSettings "s" {
        uniform token[] includedPurposes = ["default", "guide", "secret"]
    }
}
def Cube "c" {
    uniform token purpose = "guide"
}
""")
    assert imported.paths() == ["/c"]
    assert imported.said("the purpose 'secret' of `includedPurposes` is not known")


def test_a_single_number_is_no_list_of_colours_of_instances(load: Callable[..., Any]) -> None:
    imported = load("""
def PointInstancer "p" {
    rel prototypes = </p/c>
    int[] protoIndices = [0, 0]
    point3f[] positions = [(0, 0, 0), (5, 0, 0)]
    float primvars:displayOpacity = 0.5 (
        interpolation = "vertex"
    )
    color3f[] primvars:displayColor = [(1, 0, 0), (0, 1, 0)] (
        interpolation = "vertex"
    )
    def Cube "c" {
    }
}
""")
    drawn = {leaf.path: leaf.material.diffuse for leaf in imported.leaves}
    assert drawn == {"/p/c@/p[0]": (1.0, 0.0, 0.0), "/p/c@/p[1]": (0.0, 1.0, 0.0)}
