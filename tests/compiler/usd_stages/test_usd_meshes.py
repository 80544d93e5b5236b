"""Meshes: orientation, holes, odd types, and splitting by colour or subset."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

SQUARE = """
    point3f[] points = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]
    int[] faceVertexCounts = [4]
    int[] faceVertexIndices = [0, 1, 2, 3]
    uniform token subdivisionScheme = "none"
"""
STRIP = """
    point3f[] points = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (2, 0, 0), (2, 1, 0),
                        (3, 0, 0), (3, 1, 0)]
    int[] faceVertexCounts = [4, 4, 4]
    int[] faceVertexIndices = [0, 1, 2, 3, 1, 4, 5, 2, 4, 6, 7, 5]
    uniform token subdivisionScheme = "none"
"""


def normals(mesh: Any) -> np.ndarray:
    a, b, c = (mesh.points[mesh.triangles[:, i]] for i in range(3))
    return np.asarray(np.cross(b - a, c - a))


@pytest.mark.parametrize(("orientation", "sign"), [("rightHanded", 1.0), ("leftHanded", -1.0)])
def test_normals_follow_the_orientation(
    load: Callable[..., Any], orientation: str, sign: float
) -> None:
    (leaf,) = load(f"""
def Mesh "m" {{{SQUARE}
    uniform token orientation = "{orientation}"
}}
""").leaves
    np.testing.assert_allclose(normals(leaf.node), [[0, 0, sign]] * 2)


def test_holes_are_left_out_and_unused_points_with_them(load: Callable[..., Any]) -> None:
    (leaf,) = load(f"""
def Mesh "m" {{{STRIP}
    int[] holeIndices = [0, 99]
}}
""").leaves
    assert len(leaf.node.triangles) == 4
    assert leaf.node.points[:, 0].min() == 1.0
    assert len(leaf.node.points) == 6


@pytest.mark.parametrize("points", ["double3[]", "half3[]", "int3[]", "vector3d[]"])
def test_points_of_any_numeric_triples_are_read(load: Callable[..., Any], points: str) -> None:
    (leaf,) = load('def Mesh "m" {' + SQUARE.replace("point3f[]", points) + "}").leaves
    assert leaf.node.points.tolist() == [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]


@pytest.mark.parametrize(
    "points", ["int[] points = [1, 2, 3]", "float3 points = (1, 2, 3)", "string points = 'x'",
               "float4[] points = [(1, 2, 3, 4)]"],
)  # fmt: skip
def test_points_of_other_types_are_reported(load: Callable[..., Any], points: str) -> None:
    first = SQUARE.index("int[] face")
    imported = load('def Mesh "m" {\n    ' + points + "\n    " + SQUARE[first:] + "}")
    assert imported.leaves == []
    assert imported.said("wrong type").primary.place.prim == "/m"


@pytest.mark.parametrize("body", ["", "point3f[] points = [(0, 0, 0)]"])
def test_empty_meshes_are_reported(load: Callable[..., Any], body: str) -> None:
    imported = load(f'def Mesh "m" {{\n{body}\n}}')
    assert imported.leaves == []
    assert imported.codes() == ["usd-mesh"]


def test_faults_name_their_mesh_and_the_rest_is_drawn(load: Callable[..., Any]) -> None:
    imported = load("""
def Mesh "m" {
    point3f[] points = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (nan, 0, 0)]
    int[] faceVertexCounts = [3, 3, 3, 3]
    int[] faceVertexIndices = [0, 1, 2, 0, 1, 7, 0, 1, 3, 0]
    uniform token subdivisionScheme = "none"
}
""")
    (leaf,) = imported.leaves
    assert leaf.node.triangles.tolist() == [[0, 1, 2]]
    assert np.isfinite(leaf.node.points).all()
    assert imported.codes() == ["usd-mesh"] * 3


def test_uniform_colours_split_a_mesh(load: Callable[..., Any]) -> None:
    imported = load(f"""
def Mesh "m" {{{STRIP}
    color3f[] primvars:displayColor = [(1, 0, 0), (0, 0, 1)] (interpolation = "uniform")
    int[] primvars:displayColor:indices = [1, 0, 1]
}}
""")
    found = {leaf.material.diffuse: leaf.node.points[:, 0] for leaf in imported.leaves}
    assert imported.paths() == ["/m", "/m"]
    assert sorted(set(found[(1.0, 0.0, 0.0)])) == [1.0, 2.0]
    assert sorted(set(found[(0.0, 0.0, 1.0)])) == [0.0, 1.0, 2.0, 3.0]


@pytest.mark.parametrize("interpolation", ["vertex", "varying", "faceVarying"])
def test_smooth_colours_vary_over_the_mesh(load: Callable[..., Any], interpolation: str) -> None:
    colors = ", ".join(["(1, 0, 0)", "(0, 1, 0)"] * 2)
    imported = load(f"""
def Mesh "m" {{{SQUARE}
    color3f[] primvars:displayColor = [{colors}] (interpolation = "{interpolation}")
}}
""")
    assert imported.leaves[0].material.diffuse == (0.5, 0.5, 0.0)
    assert imported.codes() == []
    (texture,) = imported.leaves[0].material.textures
    assert (texture.parameter, texture.file, texture.attribute) == ("diffuse", "", "displayColor")
    (attribute,) = imported.leaves[0].node.attributes
    assert attribute.name == "displayColor"


def test_subsets_take_their_materials_and_the_rest_falls_back(load: Callable[..., Any]) -> None:
    imported = load(f"""
def Mesh "m" (prepend apiSchemas = ["MaterialBindingAPI"]) {{{STRIP}
    color3f[] primvars:displayColor = [(0, 1, 0)]
    uniform token subsetFamily:materialBind:familyType = "nonOverlapping"
    def GeomSubset "s" (prepend apiSchemas = ["MaterialBindingAPI"]) {{
        uniform token elementType = "face"
        uniform token familyName = "materialBind"
        int[] indices = [1, 77]
        rel material:binding = </red>
    }}
}}
def Material "red" {{
    token outputs:surface.connect = </red/shader.outputs:surface>
    def Shader "shader" {{
        uniform token info:id = "UsdPreviewSurface"
        color3f inputs:diffuseColor = (1, 0, 0)
        token outputs:surface
    }}
}}
""")
    found = {leaf.material.diffuse: len(leaf.node.triangles) for leaf in imported.leaves}
    assert found == {(1.0, 0.0, 0.0): 2, (0.0, 1.0, 0.0): 4}


RED = """
def Material "red" {
    token outputs:surface.connect = </red/shader.outputs:surface>
    def Shader "shader" {
        uniform token info:id = "UsdPreviewSurface"
        color3f inputs:diffuseColor = (1, 0, 0)
        token outputs:surface
    }
}
"""


def subset(name: str, indices: str, element: str = "face", family: str = "materialBind") -> str:
    return f"""
    def GeomSubset "{name}" (prepend apiSchemas = ["MaterialBindingAPI"]) {{
        uniform token elementType = "{element}"
        uniform token familyName = "{family}"
        int[] indices = {indices}
        rel material:binding = </red>
    }}
"""


def test_subsets_that_cannot_be_used_are_reported(load: Callable[..., Any]) -> None:
    stage = (
        f'def Mesh "m" {{{STRIP}'
        + subset("points", "[0, 1]", element="point")
        + subset("other", "[0, 1]", family="parts")
        + subset("first", "[2, -1, 77]")
        + subset("second", "[2, 2]")
        + "}\n"
        + RED
    )
    imported = load(stage)
    red = [leaf for leaf in imported.leaves if leaf.material.diffuse == (1.0, 0.0, 0.0)]
    assert sum(len(leaf.node.triangles) for leaf in red) == 2
    for words, prim in (
        ("`point` subsets", "points"),
        ("the family `parts`", "other"),
        ("2 faces of a subset are beyond", "first"),
        ("1 faces of a subset are of a subset before it", "second"),
    ):
        assert imported.said(words).primary.place.prim == f"/m/{prim}"


def test_meshes_that_are_instances_themselves_have_their_subsets(load: Callable[..., Any]) -> None:
    kept = subset("s", "[1]")
    imported = load(f"""
class Mesh "_m" {{{STRIP}{kept}}}
def "i" (instanceable = true
    inherits = </_m>) {{
}}
{RED}""")
    red = [leaf for leaf in imported.leaves if leaf.material.diffuse == (1.0, 0.0, 0.0)]
    assert [leaf.path for leaf in red] == ["/i"]


def test_a_wrong_number_of_colours_is_the_first_of_them(load: Callable[..., Any]) -> None:
    imported = load(f"""
def Mesh "m" {{{STRIP}
    color3f[] primvars:displayColor = [(1, 0, 0), (0, 1, 0)] (interpolation = "uniform")
}}
""")
    assert [leaf.material.diffuse for leaf in imported.leaves] == [(1.0, 0.0, 0.0)]
    assert imported.said("read as its first").code == "usd-primvar"


def test_bindings_to_what_is_no_material_are_reported(load: Callable[..., Any]) -> None:
    imported = load("""
def Cube "nowhere" (prepend apiSchemas = ["MaterialBindingAPI"]) {
    rel material:binding = </gone>
}
def Cube "cube" (prepend apiSchemas = ["MaterialBindingAPI"]) {
    rel material:binding = </nowhere>
}
def Cube "blocked" (prepend apiSchemas = ["MaterialBindingAPI"]) {
    rel material:binding = None
}
""")
    (said,) = imported.diagnostics
    assert [label.place.prim for label in (said.primary, *said.secondary)] == ["/nowhere", "/cube"]
    assert "no material" in said.message


@pytest.mark.parametrize("surface", ["int3[] surfaceFaceVertexIndices = [(0, 2, 1), (0, 1, 3), "
                                     "(0, 3, 2), (1, 2, 3)]", ""])  # fmt: skip
def test_tetrahedra_show_their_surface_outwards(load: Callable[..., Any], surface: str) -> None:
    (leaf,) = load(f"""
def TetMesh "t" {{
    point3f[] points = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)]
    int4[] tetVertexIndices = [(0, 1, 2, 3)]
    {surface}
}}
""").leaves
    assert len(leaf.node.triangles) == 4
    centers = leaf.node.points[leaf.node.triangles].mean(axis=1)
    assert (np.einsum("ij,ij->i", normals(leaf.node), centers - 0.2) > 0.0).all()
