"""Materials and display colours, also where native instances share what is below them."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

RED, GREEN, BLUE = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)
GREY = (0.18, 0.18, 0.18)
BINDABLE = 'prepend apiSchemas = ["MaterialBindingAPI"]'


def material(name: str, inputs: str) -> str:
    return f"""
def Material "{name}" {{
    token outputs:surface.connect = </{name}/shader.outputs:surface>
    float inputs:shared = 0.25
    def Shader "shader" {{
        uniform token info:id = "UsdPreviewSurface"
        {inputs}
        token outputs:surface
    }}
}}
"""


MATERIALS = material("red", "color3f inputs:diffuseColor = (1, 0, 0)") + material(
    "green", "color3f inputs:diffuseColor = (0, 1, 0)"
)


def bound(path: str, strength: str = "") -> str:
    how = f' (bindMaterialAs = "{strength}")' if strength else ""
    return f"rel material:binding = <{path}>{how}\n"


def colored(color: tuple[float, ...]) -> str:
    return f"color3f[] primvars:displayColor = [{color}]\n"


def diffuse(imported: Any) -> dict[str, tuple[float, ...]]:
    return {leaf.path: leaf.material.diffuse for leaf in imported.leaves}


def test_the_nearest_binding_wins_unless_one_above_is_stronger(load: Callable[..., Any]) -> None:
    imported = load(f"""
def Xform "weak" ({BINDABLE}) {{
    {bound("/red")}
    def Cube "inherits" {{
    }}
    def Cube "own" ({BINDABLE}) {{
        {bound("/green")}
    }}
}}
def Xform "strong" ({BINDABLE}) {{
    {bound("/red", "strongerThanDescendants")}
    def Cube "own" ({BINDABLE}) {{
        {bound("/green")}
    }}
}}
{MATERIALS}""")
    assert diffuse(imported) == {"/weak/inherits": RED, "/weak/own": GREEN, "/strong/own": RED}


def test_display_colours_are_inherited_and_give_way_to_materials(load: Callable[..., Any]) -> None:
    imported = load(f"""
def Xform "a" {{
    {colored(BLUE)}
    def Cube "inherits" {{
    }}
    def Cube "own" {{
        {colored(GREEN)}
        float[] primvars:displayOpacity = [0.5]
    }}
    def Cube "bound" ({BINDABLE}) {{
        {bound("/red")}
        {colored(GREEN)}
    }}
}}
def Cube "plain" {{
}}
{MATERIALS}""")
    assert diffuse(imported) == {
        "/a/inherits": BLUE, "/a/own": GREEN, "/a/bound": RED, "/plain": GREY,
    }  # fmt: skip
    assert imported.leaf("/a/own").material.opacity == 0.5


PROTOTYPE = f"""
class Xform "_thing" {{
    def Cube "plain" {{
    }}
    def Cube "blue" {{
        {colored(BLUE)}
    }}
    def Cube "green" ({BINDABLE}) {{
        {bound("/_thing/look")}
    }}
    def Material "look" {{
        token outputs:surface.connect = </_thing/look/shader.outputs:surface>
        def Shader "shader" {{
            uniform token info:id = "UsdPreviewSurface"
            color3f inputs:diffuseColor = (0, 1, 0)
            token outputs:surface
        }}
    }}
}}
"""
INSTANCE = "instanceable = true\ninherits = </_thing>"


def test_instances_of_one_prototype_differ_by_what_they_inherit(load: Callable[..., Any]) -> None:
    imported = load(f"""
def Xform "bare" ({INSTANCE}) {{
}}
def Xform "colored" ({INSTANCE}) {{
    {colored(RED)}
}}
def Xform "bound" ({INSTANCE}
    {BINDABLE}) {{
    {bound("/red")}
}}
def Xform "strong" ({BINDABLE}) {{
    {bound("/red", "strongerThanDescendants")}
    def Xform "inner" ({INSTANCE}) {{
    }}
}}
def Xform "bound_again" ({INSTANCE}
    {BINDABLE}) {{
    {bound("/red")}
}}
{PROTOTYPE}{MATERIALS}""")
    assert diffuse(imported) == {
        "/bare/plain": GREY, "/bare/blue": BLUE, "/bare/green": GREEN,
        "/colored/plain": RED, "/colored/blue": BLUE, "/colored/green": GREEN,
        "/bound/plain": RED, "/bound/blue": RED, "/bound/green": GREEN,
        "/strong/inner/plain": RED, "/strong/inner/blue": RED, "/strong/inner/green": RED,
        "/bound_again/plain": RED, "/bound_again/blue": RED, "/bound_again/green": GREEN,
    }  # fmt: skip


def test_a_colour_below_and_an_opacity_above_an_instance_meet(load: Callable[..., Any]) -> None:
    imported = load(f"""
def Xform "half" ({INSTANCE}) {{
    float[] primvars:displayOpacity = [0.5]
}}
def Xform "full" ({INSTANCE}) {{
}}
{PROTOTYPE}""")
    assert imported.leaf("/half/blue").material.opacity == 0.5
    assert imported.leaf("/half/plain").material.opacity == 0.5
    assert imported.leaf("/full/blue").material.opacity == 1.0


def test_collections_may_single_out_one_instance(load: Callable[..., Any]) -> None:
    imported = load(f"""
def Xform "w" (prepend apiSchemas = ["MaterialBindingAPI", "CollectionAPI:picked"]) {{
    uniform token collection:picked:expansionRule = "expandPrims"
    rel collection:picked:includes = </w/b/plain>
    rel material:binding:collection:picked = [</w.collection:picked>, </red>]
    def Xform "a" ({INSTANCE}) {{
    }}
    def Xform "b" ({INSTANCE}) {{
    }}
}}
{PROTOTYPE}{MATERIALS}""")
    found = diffuse(imported)
    assert found["/w/a/plain"] == GREY
    assert found["/w/b/plain"] == RED
    assert found["/w/b/green"] == GREEN


def test_point_instances_take_their_instancers_material(load: Callable[..., Any]) -> None:
    imported = load(f"""
def PointInstancer "p" ({BINDABLE}) {{
    {bound("/red")}
    rel prototypes = [</p/inside>, </outside>]
    int[] protoIndices = [0, 1]
    point3f[] positions = [(0, 0, 0), (1, 0, 0)]
    def Cube "inside" {{
    }}
}}
def Sphere "outside" {{
}}
{MATERIALS}""")
    assert diffuse(imported) == {
        "/p/inside@/p[0]": RED, "/outside@/p[1]": RED, "/outside": GREY,
    }  # fmt: skip


def test_all_constant_inputs_are_read(load: Callable[..., Any]) -> None:
    text = material(
        "m",
        """color3f inputs:emissiveColor = (1, 2, 3)
        int inputs:useSpecularWorkflow = 1
        color3f inputs:specularColor = (0.1, 0.2, 0.3)
        float inputs:metallic = 0.5
        float inputs:roughness.connect = </m.inputs:shared>
        float inputs:clearcoat = 0.75
        float inputs:clearcoatRoughness = 0.125
        float inputs:opacity = 0.375
        float inputs:opacityThreshold = 0.0625
        float inputs:ior = 2""",
    )
    (leaf,) = load(f'def Cube "c" ({BINDABLE}) {{\n{bound("/m")}}}\n{text}').leaves
    found = leaf.material
    assert found.emission == (1.0, 2.0, 3.0)
    assert found.specular_workflow
    assert found.specular == pytest.approx((0.1, 0.2, 0.3))
    assert (found.metallic, found.roughness, found.clearcoat) == (0.5, 0.25, 0.75)
    assert (found.clearcoat_roughness, found.opacity) == (0.125, 0.375)
    assert (found.opacity_threshold, found.ior, found.diffuse) == (0.0625, 2.0, GREY)


def test_where_textures_are_not_used_their_fallback_is_the_color(load: Callable[..., Any]) -> None:
    imported = load(f"""
def Cube "c" ({BINDABLE}) {{
    {bound("/m")}
}}
{material("m", "color3f inputs:diffuseColor.connect = </map.outputs:rgb>")}
def Shader "map" {{
    uniform token info:id = "UsdUVTexture"
    asset inputs:file = @missing.png@
    float4 inputs:fallback = (1, 0.5, 0.25, 1)
    float3 outputs:rgb
}}
""")
    assert imported.leaves[0].material.diffuse == (1.0, 0.5, 0.25)
    (texture,) = imported.leaves[0].material.textures
    assert texture.fallback == (1.0, 0.5, 0.25, 1.0)


def test_unknown_surfaces_and_dangling_bindings_are_drawn_in_the_default(
    load: Callable[..., Any],
) -> None:
    imported = load(f"""
def Cube "a" ({BINDABLE}) {{
    {bound("/nowhere")}
    {colored(RED)}
}}
def Cube "b" ({BINDABLE}) {{
    {bound("/empty")}
}}
def Material "empty" {{
}}
""")
    assert diffuse(imported) == {"/a": RED, "/b": GREY}
    assert imported.said("without a surface").primary.place.prim == "/empty"


def test_a_binding_to_nothing_hides_materials_of_instances_above(load: Callable[..., Any]) -> None:
    shape = f"({BINDABLE}) {{\n{bound('/nothing')}"
    imported = load(
        MATERIALS
        + f"""
class Xform "_c" {{
    def Cube "plain" {{
    }}
    def Cube "void" {shape}
    }}
    def Mesh "coloured" {shape}
        {colored(BLUE)}
        point3f[] points = [(0, 0, 0), (4, 0, 0), (4, 4, 0)]
        int[] faceVertexCounts = [3]
        int[] faceVertexIndices = [0, 1, 2]
        uniform token subdivisionScheme = "none"
    }}
}}
def Xform "i" (
    instanceable = true
    inherits = </_c>
    {BINDABLE}
) {{
    {bound("/red")}
}}
def PointInstancer "p" ({BINDABLE}) {{
    {bound("/green")}
    rel prototypes = </p/j>
    int[] protoIndices = [0]
    point3f[] positions = [(0, 0, 9)]
    def Xform "j" (instanceable = true
        inherits = </_c>
    ) {{
    }}
}}
"""
    )
    assert diffuse(imported) == {
        "/i/plain": RED,
        "/i/void": GREY,
        "/i/coloured": BLUE,
        "/p/j/plain@/p[0]": GREEN,
        "/p/j/void@/p[0]": GREY,
        "/p/j/coloured@/p[0]": BLUE,
    }


@pytest.mark.parametrize(
    ("purposes", "color"),
    [({"": "red", ":preview": "green"}, GREEN), ({":full": "red", ":preview": "green"}, RED),
     ({"": "red", ":full": "green"}, GREEN), ({":preview": "green"}, GREEN)],
)  # fmt: skip
def test_full_comes_before_preview_and_preview_before_all(
    load: Callable[..., Any], purposes: dict[str, str], color: tuple[float, ...]
) -> None:
    rels = "\n".join(f"rel material:binding{p} = </{name}>" for p, name in purposes.items())
    imported = load(f'def Cube "c" ({BINDABLE}) {{\n{rels}\n}}\n{MATERIALS}')
    assert diffuse(imported) == {"/c": color}


def test_prototypes_elsewhere_inherit_where_they_stand(load: Callable[..., Any]) -> None:
    instancer = """
    rel prototypes = [</kit/plain>, </tinted/ball>]
    int[] protoIndices = [0, 1]
    point3f[] positions = [(0, 0, 0), (5, 0, 0)]
"""
    imported = load(f"""
class "kit" ({BINDABLE}) {{
    {bound("/red")}
    def Sphere "plain" {{
    }}
}}
class "tinted" {{
    {colored(BLUE)}
    def Sphere "ball" {{
    }}
}}
def PointInstancer "bare" {{
{instancer}
}}
def Xform "above" ({BINDABLE}) {{
    {bound("/green")}
    def PointInstancer "green" {{
{instancer}
    }}
}}
{MATERIALS}""")
    assert list(diffuse(imported).values()) == [RED, BLUE, RED, BLUE]
