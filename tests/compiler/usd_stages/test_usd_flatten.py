"""Stages all the way to the flat scene: object paths, matrices, materials, order."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from compiler.flatten import flatten
from compiler.ir import UP_AXES, SceneIR
from compiler.provenance import object_path
from dsl.diagnostics import Diagnostic
from dsl.scene import File, Node

GROVE = """
(
    upAxis = "Z"
)
class Xform "_grove" {
    color3f[] primvars:displayColor = [(0, 0.5, 0)]
    def PointInstancer "outer" {
        rel prototypes = [</_grove/outer/inner>, </_grove/outer/stone>]
        int[] protoIndices = [0, 1, 0, 1]
        point3f[] positions = [(0, 0, 0), (5, 0, 0), (10, 0, 0), (15, 0, 0)]
        quath[] orientations = [(0.5, 0.5, 0.5, 0.5), (1, 0, 0, 0), (1, 0, 0, 0), (1, 0, 0, 0)]
        def PointInstancer "inner" {
            rel prototypes = </_grove/outer/inner/car>
            int[] protoIndices = [0, 0, 0]
            point3f[] positions = [(0, 0, 0), (1, 0, 0), (2, 0, 0)]
            int64[] invisibleIds = [1]
            def Xform "car" (instanceable = true
                inherits = </_car>
            ) {
                double3 xformOp:scale = (1, 2, 3)
                uniform token[] xformOpOrder = ["xformOp:scale"]
            }
        }
        def Sphere "stone" {
            color3f[] primvars:displayColor = [(0.5, 0.5, 0.5)]
        }
    }
}
class Xform "_car" {
    def Cube "body" {
    }
    def Xform "wheel" {
        float xformOp:rotateX = 30
        uniform token[] xformOpOrder = ["xformOp:rotateX"]
        def Cylinder "rim" {
        }
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
    color3f[] primvars:displayColor = [(1, 0, 0)]
}
"""


def flat(imported: Any) -> SceneIR:
    def no_files(_: File) -> tuple[Node | None, list[Diagnostic]]:
        raise AssertionError

    ir, diagnostics, _ = flatten(imported.graph, no_files)
    assert ir is not None
    assert diagnostics == []
    return ir


def test_the_flat_scene_is_the_graph_expanded(load: Callable[..., Any]) -> None:
    imported = load(GROVE)
    ir = flat(imported)
    assert [object_path(ir, i) for i in range(len(imported.leaves))] == imported.paths()
    assert "/north/outer/inner/car/wheel/rim@/north/outer/inner[2]@/north/outer[0]" in (
        imported.paths()
    )
    worlds = np.array([leaf.world[:3] for leaf in imported.leaves])
    np.testing.assert_allclose(ir.world_from_object, worlds, atol=1e-12)
    colors = ir.materials["diffuse"][np.maximum(ir.instance_material, 0)]
    np.testing.assert_allclose(colors, [leaf.material.diffuse for leaf in imported.leaves])
    assert len(ir.prototype_kind) == 3
    assert UP_AXES[ir.settings["up"][0]] == "z"


@pytest.mark.parametrize("count", [10_000])
def test_point_instances_are_numbered_prototype_by_prototype(
    load: Callable[..., Any], count: int
) -> None:
    indices = ", ".join(str(i % 2) for i in range(count))
    positions = ", ".join(f"({i}, 0, 0)" for i in range(count))
    ir = flat(
        load(f"""
def PointInstancer "p" {{
    rel prototypes = [</p/a>, </p/b>]
    int[] protoIndices = [{indices}]
    point3f[] positions = [{positions}]
    def Cube "a" {{
    }}
    def Sphere "b" {{
    }}
}}
""")
    )
    expected = [*range(0, count, 2), *range(1, count, 2)]
    assert ir.world_from_object[:, 0, 3].tolist() == expected
    assert object_path(ir, 1) == "/p/a@/p[2]"
    assert object_path(ir, count - 1) == f"/p/b@/p[{count - 1}]"
