"""Textures of materials and the attributes of meshes that they read."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

MATERIAL = """
def Material "m" {
    token outputs:surface.connect = </m/s.outputs:surface>
    token inputs:map = "uv_set"
    def Shader "s" {
        uniform token info:id = "UsdPreviewSurface"
        color3f inputs:diffuseColor.connect = </m/t.outputs:rgb>
        float inputs:roughness.connect = </m/t.outputs:g>
        color3f inputs:emissiveColor.connect = </m/c.outputs:result>
        token outputs:surface
    }
    def Shader "t" {
        uniform token info:id = "UsdUVTexture"
        asset inputs:file = @brick.png@
        float2 inputs:st.connect = </m/x.outputs:result>
        token inputs:wrapS = "mirror"
        token inputs:sourceColorSpace = "raw"
        float4 inputs:scale = (2, 2, 2, 2)
        float4 inputs:fallback = (0.5, 0.25, 0.125, 1)
        float3 outputs:rgb
        float outputs:g
    }
    def Shader "x" {
        uniform token info:id = "UsdTransform2d"
        float2 inputs:in.connect = </m/r.outputs:result>
        float2 inputs:scale = (2, 3)
        float inputs:rotation = 90
        float2 inputs:translation = (10, 20)
        float2 outputs:result
    }
    def Shader "r" {
        uniform token info:id = "UsdPrimvarReader_float2"
        token inputs:varname.connect = </m.inputs:map>
        float2 outputs:result
    }
    def Shader "c" {
        uniform token info:id = "UsdPrimvarReader_float3"
        string inputs:varname = "glow"
        float3 outputs:result
    }
}
"""
STRIP = """
    point3f[] points = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (2, 0, 0), (2, 1, 0)]
    int[] faceVertexCounts = [4, 2, 4]
    int[] faceVertexIndices = [0, 1, 2, 3, 0, 1, 1, 4, 5, 2]
    uniform token subdivisionScheme = "none"
"""


def mesh_of(load: Callable[..., Any], body: str, bound: bool = True) -> Any:
    binding = "rel material:binding = </m>" if bound else ""
    imported = load(
        f"""{MATERIAL}
def Mesh "mesh" (prepend apiSchemas = ["MaterialBindingAPI"]) {{{STRIP}
    {binding}
    {body}
}}
"""
    )
    (leaf,) = imported.leaves
    return imported, leaf


def at_corners(mesh: Any, name: str) -> dict[tuple[float, ...], list[list[float]]]:
    """The values of an attribute by where the corner is."""
    (attribute,) = [a for a in mesh.attributes if a.name == name]
    corners = mesh.triangles if attribute.corners is None else attribute.corners
    found: dict[tuple[float, ...], list[list[float]]] = {}
    for triangle, rows in zip(mesh.triangles, corners, strict=True):
        for point, row in zip(triangle, rows, strict=True):
            values = found.setdefault(tuple(mesh.points[point].tolist()), [])
            value = attribute.values[row].tolist()
            values += [value] if value not in values else []
    return found


def test_a_network_is_a_texture_of_each_parameter(load: Callable[..., Any]) -> None:
    _, leaf = mesh_of(load, "")
    textures = {texture.parameter: texture for texture in leaf.material.textures}
    assert textures.keys() == {"diffuse", "roughness", "emission"}
    diffuse = textures["diffuse"]
    assert diffuse.file.endswith("brick.png")
    assert (diffuse.attribute, diffuse.channels) == ("uv_set", "rgb")
    assert diffuse.wrap == ("mirror", "useMetadata")
    assert (diffuse.color_space, diffuse.scale) == ("raw", (2, 2, 2, 2))
    assert textures["roughness"].channels == "g"
    assert (textures["emission"].file, textures["emission"].attribute) == ("", "glow")
    # (1, 1) times (2, 3), turned by 90 degrees, moved by (10, 20)
    place = np.array(diffuse.matrix).reshape(2, 3) @ (1, 1, 1)
    np.testing.assert_allclose(place, (10 - 3, 20 + 2), atol=1e-12)
    assert leaf.material.diffuse == pytest.approx((0.5, 0.25, 0.125))


@pytest.mark.parametrize("turned", [False, True])
def test_corners_keep_their_face_varying_values(load: Callable[..., Any], turned: bool) -> None:
    """Values follow their corners past a face that is dropped, and through the other hand."""
    orientation = 'uniform token orientation = "leftHanded"' if turned else ""
    _, leaf = mesh_of(
        load,
        f"""{orientation}
    texCoord2f[] primvars:uv_set = [(0, 0), (1, 0), (1, 1), (0, 1), (9, 9), (2, 0), (2, 1)] (
        interpolation = "faceVarying"
    )
    int[] primvars:uv_set:indices = [0, 1, 2, 3, 4, 4, 1, 5, 6, 2]
""",
    )
    found = at_corners(leaf.node, "uv_set")
    assert len(found) == 6
    for point, values in found.items():
        assert values == [list(point[:2])]


@pytest.mark.parametrize(
    ("interpolation", "values", "expected"),
    [
        ("vertex", "[(0, 0), (1, 0), (1, 1), (0, 1), (2, 0), (2, 1)]", {(2.0, 1.0, 0.0): [[2, 1]]}),
        ("uniform", "[(5, 5), (6, 6), (7, 7)]", {(1.0, 0.0, 0.0): [[5, 5], [7, 7]]}),
        ("constant", "[(3, 4)]", {(0.0, 0.0, 0.0): [[3, 4]]}),
    ],
)
def test_other_interpolations(
    load: Callable[..., Any], interpolation: str, values: str, expected: Any
) -> None:
    _, leaf = mesh_of(
        load, f'texCoord2f[] primvars:uv_set = {values} (interpolation = "{interpolation}")'
    )
    found = at_corners(leaf.node, "uv_set")
    assert {point: found[point] for point in expected} == expected


def test_wrong_counts_and_indices_are_ignored_and_reported(load: Callable[..., Any]) -> None:
    for body in (
        'texCoord2f[] primvars:uv_set = [(0, 0)] (interpolation = "vertex")',
        """texCoord2f[] primvars:uv_set = [(0, 0)] (interpolation = "constant")
    int[] primvars:uv_set:indices = [4]""",
        'texCoord2f[] primvars:uv_set = [(nan, 0)] (interpolation = "constant")',
        'string primvars:uv_set = "odd"',
    ):
        imported, leaf = mesh_of(load, body)
        assert leaf.node.attributes == ()
        assert "uv_set" in imported.said("is ignored").message


def test_primvars_of_normals_come_first_and_cages_have_none(load: Callable[..., Any]) -> None:
    body = """normal3f[] normals = [(1, 0, 0), (1, 0, 0), (1, 0, 0), (1, 0, 0), (1, 0, 0),
        (1, 0, 0)]
    normal3f[] primvars:normals = [(0, 0, 1)]"""
    _, leaf = mesh_of(load, body, bound=False)
    assert set(map(repr, at_corners(leaf.node, "normals").values())) == {"[[0.0, 0.0, 1.0]]"}
    smooth = STRIP.replace("none", "catmullClark")
    (leaf,) = load(f'def Mesh "m" {{{smooth}{body}\n}}', complexity="low").leaves
    assert leaf.node.attributes == ()


def test_colours_that_vary_are_kept_and_nothing_that_is_not_asked_for(
    load: Callable[..., Any],
) -> None:
    body = """color3f[] primvars:displayColor = [(1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 1, 1),
        (0, 0, 0), (1, 1, 0)] (interpolation = "vertex")
    texCoord2f[] primvars:st = [(0, 0)]"""
    _, leaf = mesh_of(load, body, bound=False)
    assert at_corners(leaf.node, "displayColor")[1.0, 1.0, 0.0] == [[0, 0, 1]]
    _, leaf = mesh_of(load, body)
    assert leaf.node.attributes == ()
