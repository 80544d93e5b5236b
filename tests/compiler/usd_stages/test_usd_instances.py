"""Native instances: shared, placed and named."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from compiler.compilation import compile_path

NESTED = """
class Xform "_wheel" {
    def Sphere "tyre" {
        double3 xformOp:translate = (0, 0, 1)
        uniform token[] xformOpOrder = ["xformOp:translate"]
    }
}
class Xform "_car" {
    def Cube "body" {
    }
    def Xform "left" (instanceable = true
        inherits = </_wheel>
    ) {
        double3 xformOp:translate = (-1, 0, 0)
        uniform token[] xformOpOrder = ["xformOp:translate"]
    }
    def "right" (instanceable = true
        inherits = </_wheel>
    ) {
    }
}
def Xform "lot" {
    double3 xformOp:translate = (0, 10, 0)
    uniform token[] xformOpOrder = ["xformOp:translate"]
    def Xform "a" (instanceable = true
        inherits = </_car>
    ) {
        double3 xformOp:translate = (100, 0, 0)
        uniform token[] xformOpOrder = ["xformOp:translate"]
    }
    def "b" (instanceable = true
        inherits = </_car>
    ) {
    }
}
"""


def expected_worlds(path: Path) -> dict[str, np.ndarray]:
    """World matrices of all gprims by path through instance proxies, by usd-core alone."""
    from pxr import Usd, UsdGeom

    stage = Usd.Stage.Open(str(path))
    cache = UsdGeom.XformCache()
    return {
        str(prim.GetPath()): np.array(cache.GetLocalToWorldTransform(prim)).T
        for prim in Usd.PrimRange(
            stage.GetPseudoRoot(), Usd.TraverseInstanceProxies(Usd.PrimDefaultPredicate)
        )
        if prim.IsA(UsdGeom.Gprim)
    }


def test_nested_native_instances_stand_where_usd_core_has_them(
    load: Callable[..., Any], tmp_path: Path
) -> None:
    imported = load(NESTED)
    worlds = expected_worlds(tmp_path / "stage.usda")
    assert imported.paths() == list(worlds)
    for leaf in imported.leaves:
        np.testing.assert_allclose(leaf.world, worlds[leaf.path], atol=1e-13)
    assert len({id(leaf.node) for leaf in imported.leaves}) == 2


def test_insides_of_equal_instances_are_one_node(load: Callable[..., Any]) -> None:
    copies = "".join(
        f'def Xform "i{n}" (instanceable = true\ninherits = </_pair>\n) {{\n}}\n' for n in range(50)
    )
    imported = load("""
class Xform "_pair" {
    def Cube "a" {
    }
    def Cube "b" {
    }
}
""" + copies)  # fmt: skip
    assert len({id(edge.child) for edge in imported.graph.root.items}) == 1
    assert imported.paths()[98:] == ["/i49/a", "/i49/b"]


def test_meshes_of_a_prototype_are_shared_even_where_contexts_differ(
    load: Callable[..., Any],
) -> None:
    triangle = """
        point3f[] points = [(0, 0, 0), (1, 0, 0), (0, 1, 0)]
        int[] faceVertexCounts = [3]
        int[] faceVertexIndices = [0, 1, 2]
    """
    imported = load(f"""
class Xform "_x" {{
    def Mesh "m" {{{triangle}
    }}
}}
def Xform "a" (instanceable = true
    inherits = </_x>
) {{
    token purpose = "render"
}}
def Xform "b" (instanceable = true
    inherits = </_x>
) {{
    color3f[] primvars:displayColor = [(1, 0, 0)]
}}
""")
    a, b = imported.leaves
    assert a.node is b.node
    assert a.material.diffuse == (0.18, 0.18, 0.18)
    assert b.material.diffuse == (1.0, 0.0, 0.0)


def test_deep_hierarchies_are_no_matter(load: Callable[..., Any], tmp_path: Path) -> None:
    from pxr import Sdf

    layer = Sdf.Layer.CreateNew(str(tmp_path / "deep.usda"))
    path = Sdf.Path("/x")
    for _ in range(900):
        Sdf.CreatePrimInLayer(layer, path).specifier = Sdf.SpecifierDef
        path = path.AppendChild("x")
    cube = Sdf.CreatePrimInLayer(layer, path)
    cube.specifier, cube.typeName = Sdf.SpecifierDef, "Cube"
    layer.Save()
    (leaf,) = load(tmp_path / "deep.usda").leaves
    assert leaf.path == str(path)


def test_instances_that_are_meshes_share_what_they_do_not_say_themselves(tmp_path: Path) -> None:
    path = tmp_path / "stage.usda"
    path.write_text(
        """#usda 1.0
class Mesh "_m" {
    uniform token subdivisionScheme = "none"
    point3f[] points = [(0, 0, 0), (4, 0, 0), (4, 4, 0)]
    int[] faceVertexCounts = [3]
    int[] faceVertexIndices = [0, 1, 2]
}
"""
        + "".join(
            f"""def Mesh "m{number}" (instanceable = true
    inherits = </_m>) {{
    double3 xformOp:translate = (0, {number}, 0)
    uniform token[] xformOpOrder = ["xformOp:translate"]
    {"point3f[] points = [(0, 0, 0), (9, 0, 0), (4, 4, 0)]" if number == 3 else ""}
}}
"""
            for number in range(5)
        )
    )
    ir = compile_path(path).ir
    targets = ir.instance_target.tolist()
    assert len(set(targets)) == 2
    assert targets.count(targets[3]) == 1


PRIMVARS_ABOVE = """
def Material "painted" {
    token outputs:surface.connect = </painted/surface.outputs:surface>
    def Shader "surface" {
        uniform token info:id = "UsdPreviewSurface"
        color3f inputs:diffuseColor.connect = </painted/reader.outputs:result>
        token outputs:surface
    }
    def Shader "reader" {
        uniform token info:id = "UsdPrimvarReader_float3"
        string inputs:varname = "tint"
        float3 outputs:result
    }
}
class Xform "_x" {
    def Points "drops" {
        point3f[] points = [(0, 0, 0)]
    }
    def Mesh "leaf" (prepend apiSchemas = ["MaterialBindingAPI"]) {
        rel material:binding = </painted>
        uniform token subdivisionScheme = "none"
        point3f[] points = [(0, 0, 0), (4, 0, 0), (4, 4, 0)]
        int[] faceVertexCounts = [3]
        int[] faceVertexIndices = [0, 1, 2]
    }
}
"""


def test_each_instance_passes_its_own_primvars_on(load: Callable[..., Any]) -> None:
    said = {
        "plain": "",
        "thin": "float[] primvars:widths = [0.5]",
        "red": "color3f[] primvars:tint = [(1, 0, 0)]",
        "thick": "float[] primvars:widths = [3]",
        "green": "color3f[] primvars:tint = [(0, 1, 0)]",
        "wasted": "color3f[] primvars:hue = [(0, 1, 0)]",
    }
    imported = load(
        PRIMVARS_ABOVE
        + "".join(
            f'def Xform "{name}" (instanceable = true\n inherits = </_x>) {{ {line}\n }}\n'
            for name, line in said.items()
        )
    )
    radii = {name: imported.leaf(f"/{name}/drops").world[0, 0] for name in said}
    assert radii == dict.fromkeys(said, 0.5) | {"thin": 0.25, "thick": 1.5}
    leaves = {name: imported.leaf(f"/{name}/leaf").node for name in said}
    tints = {name: [a.values.tolist() for a in leaf.attributes] for name, leaf in leaves.items()}
    assert tints == {name: [] for name in said} | {"red": [[[1, 0, 0]]], "green": [[[0, 1, 0]]]}
    assert leaves["plain"] is leaves["thin"]
    assert [d.message for d in imported.diagnostics] == ["primvar `hue` is not used"]
