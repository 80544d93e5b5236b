"""Skinned meshes are posed at a time code."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

ARM = """
def SkelRoot "arm" (prepend apiSchemas = ["SkelBindingAPI"]) {
    double3 xformOp:translate = (100, 0, 0)
    uniform token[] xformOpOrder = ["xformOp:translate"]
    def Skeleton "bones" (prepend apiSchemas = ["SkelBindingAPI"]) {
        uniform token[] joints = ["upper", "upper/lower"]
        uniform matrix4d[] bindTransforms = [
            ((1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 1, 0), (0, 0, 0, 1)),
            ((1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 1, 0), (2, 0, 0, 1))]
        uniform matrix4d[] restTransforms = [
            ((1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 1, 0), (0, 0, 0, 1)),
            ((1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 1, 0), (2, 0, 0, 1))]
        rel skel:animationSource = </arm/bend>
    }
    def SkelAnimation "bend" {
        uniform token[] joints = ["upper", "upper/lower"]
        float3[] translations = [(0, 0, 0), (2, 0, 0)]
        quatf[] rotations.timeSamples = {
            0: [(1, 0, 0, 0), (1, 0, 0, 0)],
            10: [(1, 0, 0, 0), (0.70710678, 0, 0, 0.70710678)],
        }
        half3[] scales = [(1, 1, 1), (1, 1, 1)]
    }
    def Mesh "skin" (prepend apiSchemas = ["SkelBindingAPI"]) {
        double3 xformOp:translate = (0, 0, 5)
        uniform token[] xformOpOrder = ["xformOp:translate"]
        matrix4d primvars:skel:geomBindTransform = ((1, 0, 0, 0), (0, 1, 0, 0),
            (0, 0, 1, 0), (0, 0, 0, 1))
        rel skel:skeleton = </arm/bones>
        uniform token[] skel:joints = ["upper/lower", "upper"]
        int[] primvars:skel:jointIndices = [1, 0, 0, 1, 0, 1] (
            elementSize = 2
            interpolation = "vertex")
        float[] primvars:skel:jointWeights = [1, 0, 1, 0, 0.25, 0.75] (
            elementSize = 2
            interpolation = "vertex")
        point3f[] points = [(1, 0, 0), (4, 0, 0), (2, 1, 0)]
        int[] faceVertexCounts = [3]
        int[] faceVertexIndices = [0, 1, 2]
        uniform token subdivisionScheme = "none"
    }
}
"""


@pytest.mark.parametrize(
    ("time", "points"),
    [
        (None, [(1, 0, 0), (4, 0, 0), (2, 1, 0)]),
        (0.0, [(1, 0, 0), (4, 0, 0), (2, 1, 0)]),
        # The lower arm turns by 90° about (2, 0, 0): (4, 0) goes to (2, 2), (2, 1) to (1, 0) of
        # which it takes a quarter.
        (10.0, [(1, 0, 0), (2, 2, 0), (1.75, 0.75, 0)]),
    ],
)
def test_joints_move_points_by_their_weights(
    load: Callable[..., Any], time: float | None, points: Any
) -> None:
    imported = load(ARM, time=time)
    assert [d.message for d in imported.diagnostics] == []
    (leaf,) = imported.leaves
    world = leaf.node.points @ leaf.world[:3, :3].T + leaf.world[:3, 3]
    np.testing.assert_allclose(world, np.add(points, (100, 0, 0)), atol=1e-6)


def test_normals_that_would_not_move_are_ignored(load: Callable[..., Any]) -> None:
    normals = "normal3f[] normals = [(0, 0, 1), (0, 0, 1), (0, 0, 1)]\n        point3f[] points"
    imported = load(ARM.replace("point3f[] points", normals), time=10.0)
    assert imported.said("does not move").primary.place.prim == "/arm/skin"
    assert imported.leaves[0].node.attributes == ()


def test_what_inherits_joints_moves_with_them(load: Callable[..., Any]) -> None:
    held = """
    def Xform "held" (prepend apiSchemas = ["SkelBindingAPI"]) {
        rel skel:skeleton = </arm/bones>
        uniform token[] skel:joints = ["upper/lower"]
        int[] primvars:skel:jointIndices = [0] (elementSize = 1)
        float[] primvars:skel:jointWeights = [1] (elementSize = 1)
        def Mesh "m" {
            point3f[] points = [(2, 0, 0), (4, 0, 0), (2, 1, 0)]
            int[] faceVertexCounts = [3]
            int[] faceVertexIndices = [0, 1, 2]
            uniform token subdivisionScheme = "none"
        }
        def Cube "c" {
            double3 xformOp:translate = (3, 0, 0)
            uniform token[] xformOpOrder = ["xformOp:translate"]
        }
    }
}
"""
    imported = load(ARM.rstrip()[:-1] + held, time=10.0)
    assert imported.diagnostics == []
    mesh, cube = imported.leaf("/arm/held/m"), imported.leaf("/arm/held/c")
    # The lower arm turns by 90° about (2, 0, 0). Joints place a prim: its own place is not used.
    moved = mesh.node.points + mesh.world[:3, 3]
    np.testing.assert_allclose(moved, [(102, 0, 0), (102, 2, 0), (101, 0, 0)], atol=1e-6)
    turned = [(0, -1, 0, 102), (1, 0, 0, -2), (0, 0, 1, 0), (0, 0, 0, 1)]
    np.testing.assert_allclose(cube.world, turned, atol=1e-5)


def test_instances_are_posed_by_their_own_animations(load: Callable[..., Any]) -> None:
    body = ARM.replace('def SkelRoot "arm"', 'class SkelRoot "_arm"').replace("</arm/", "</_arm/")
    still = """
def SkelAnimation "still" {
    uniform token[] joints = ["upper", "upper/lower"]
    float3[] translations = [(0, 0, 1), (2, 0, 0)]
    quatf[] rotations = [(1, 0, 0, 0), (1, 0, 0, 0)]
    half3[] scales = [(1, 1, 1), (1, 1, 1)]
}
"""
    body = body.replace("        rel skel:animationSource = </_arm/bend>\n", "")
    imported = load(
        body
        + still
        + still.replace("still", "low").replace("0, 0, 1", "0, -3, 0")
        + """
def "a" (instanceable = true
    inherits = </_arm>
    prepend apiSchemas = ["SkelBindingAPI"]) {
    rel skel:animationSource = </still>
}
def "b" (instanceable = true
    inherits = </_arm>
    prepend apiSchemas = ["SkelBindingAPI"]) {
    rel skel:animationSource = </low>
}
"""
    )
    assert [d.message for d in imported.diagnostics] == []
    assert imported.paths() == ["/a/skin", "/b/skin"]
    offsets = [(leaf.node.points @ leaf.world[:3, :3].T + leaf.world[:3, 3])[0]
               for leaf in imported.leaves]  # fmt: skip
    np.testing.assert_allclose(offsets, [(101, 0, 1), (101, -3, 0)], atol=1e-6)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("[1, 0, 0, 1, 0, 1]", "[1, 0, 0, 9, 0, 1]", "do not fit"),
        ("[1, 0, 0, 1, 0, 1]", "[1, 0]", "do not fit"),
        ("rel skel:skeleton = </arm/bones>", "", "without a skeleton"),
        ("rel skel:skeleton = </arm/bones>", "rel skel:skeleton = </no>", "without a skeleton"),
        ('def SkelRoot "arm"', 'def Xform "arm"', "without a skeleton"),
    ],
)
def test_what_cannot_be_posed_stays_and_is_reported(
    load: Callable[..., Any], old: str, new: str, words: str
) -> None:
    imported = load(ARM.replace(old, new), time=10)
    (leaf,) = imported.leaves
    np.testing.assert_array_equal(leaf.node.points[1], (4, 0, 0))
    assert imported.said(words).code == "usd-skinning"


def test_joints_that_the_skeleton_does_not_have_stay(load: Callable[..., Any]) -> None:
    named = 'uniform token[] skel:joints = ["upper", "nothing"]\n        point3f[] points'
    imported = load(ARM.replace("point3f[] points", named), time=10)
    (leaf,) = imported.leaves
    world = leaf.node.points @ leaf.world[:3, :3].T + leaf.world[:3, 3]
    np.testing.assert_allclose(world[1], (104, 0, 0), atol=1e-6)
    assert imported.said("does not have do not move").code == "usd-skinning"


def test_what_is_pressed_flat_is_not_posed(load: Callable[..., Any]) -> None:
    flat = """float3 xformOp:scale = (1, 1, 0)
        uniform token[] xformOpOrder = ["xformOp:scale"]
        point3f[] points"""
    imported = load(ARM.replace("point3f[] points", flat), time=10)
    (leaf,) = imported.leaves
    assert np.isfinite(leaf.node.points).all()
    assert imported.said("presses flat").code == "usd-skinning"


def test_blend_shapes_move_points_before_joints_do(load: Callable[..., Any]) -> None:
    shapes = """
    def BlendShape "up" {
        uniform vector3f[] offsets = [(0, 0, 4)]
        uniform vector3f[] inbetweens:half = [(0, 0, 1)] (
            weight = 0.5
        )
        uniform int[] pointIndices = [1]
    }
    def BlendShape "wide" {
        uniform vector3f[] offsets = [(0, 1, 0), (0, 1, 0), (0, 1, 0)]
    }
"""
    body = ARM.replace('    def Mesh "skin"', shapes + '    def Mesh "skin"')
    body = body.replace(
        "rel skel:skeleton = </arm/bones>",
        'rel skel:skeleton = </arm/bones>\n        uniform token[] skel:blendShapes = ["u", "w"]\n'
        "        rel skel:blendShapeTargets = [</arm/up>, </arm/wide>]",
    )
    body = body.replace(
        "half3[] scales",
        'uniform token[] blendShapes = ["w", "other", "u"]\n'
        "        float[] blendShapeWeights = [0.5, 9, 0.5]\n        half3[] scales",
    )
    (leaf,) = load(body, time=0.0).leaves
    world = leaf.node.points @ leaf.world[:3, :3].T + leaf.world[:3, 3]
    # The inbetween stands for the half way: 1 and not 2.
    expected = [(101, 0.5, 0), (104, 0.5, 1), (102, 1.5, 0)]
    np.testing.assert_allclose(world, expected, atol=1e-5)


def test_dual_quaternions_keep_the_distance_from_a_turning_axis(load: Callable[..., Any]) -> None:
    method = 'uniform token primvars:skel:skinningMethod = "dualQuaternion"\n        '
    imported = load(ARM.replace("rel skel:skeleton", method + "rel skel:skeleton"), time=10.0)
    assert imported.diagnostics == []
    (leaf,) = imported.leaves
    world = leaf.node.points @ leaf.world[:3, :3].T + leaf.world[:3, 3]
    np.testing.assert_allclose(world[:2], [(101, 0, 0), (102, 2, 0)], atol=1e-5)
    # (2, 1) turns about (2, 0) by a quarter of the way, and stays at its distance.
    assert np.linalg.norm(world[2] - (102, 0, 0)) == pytest.approx(1.0, abs=1e-5)
