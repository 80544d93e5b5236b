"""What a zero scale presses flat is drawn as a sheet."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from compiler.flatten import flatten
from compiler.provenance import object_path
from dsl.diagnostics import Diagnostic
from dsl.scene import File, Node
from runtime.tracer import Hits, Tracer


def no_files(_: File) -> tuple[Node | None, list[Diagnostic]]:
    raise AssertionError


def seen(imported: Any) -> tuple[Hits, np.ndarray, list[str]]:
    """Rays down -z from z = 10 over a grid of ±4, their x and y, and the paths they hit."""
    ir, _, _ = flatten(imported.graph, no_files)
    assert ir is not None
    x, y = (a.ravel() for a in np.meshgrid(np.linspace(-4, 4, 80), np.linspace(-4, 4, 80)))
    origins = np.stack((x, y, np.full(len(x), 10.0)), axis=1)
    hits = Tracer(ir).trace(origins, np.tile((0.0, 0.0, -1.0), (len(x), 1)))
    paths = [object_path(ir, int(i)) for i in hits.instance[hits.hit]]
    return hits, origins, paths


@pytest.mark.parametrize(
    ("prim", "inside"),
    [
        ('Sphere "p" { double radius = 2', lambda x, y: np.hypot(x, y) < 2),
        ('Cube "p" { double size = 3', lambda x, y: np.maximum(abs(x), abs(y)) < 1.5),
        (
            'Cylinder "p" { double radius = 1\ndouble height = 5\nuniform token axis = "X"',
            lambda x, y: (abs(x) < 2.5) & (abs(y) < 1),
        ),
        ('Cylinder "p" { double radius = 1.5', lambda x, y: np.hypot(x, y) < 1.5),
        (
            'Cone "p" { double radius = 2\ndouble height = 4\nuniform token axis = "Y"',
            lambda x, y: (y > -2) & (abs(x) < (2 - y) / 2),
        ),
        (
            'Capsule "p" { double radius = 1\ndouble height = 3\nuniform token axis = "X"',
            lambda x, y: np.hypot(np.maximum(abs(x) - 1.5, 0), y) < 1,
        ),
        (
            'Mesh "p" { uniform token subdivisionScheme = "none"\n'
            "point3f[] points = [(0, 0, 5), (3, 0, -2), (0, 3, 1), (0, 0, 0)]\n"
            "int[] faceVertexCounts = [3, 3]\nint[] faceVertexIndices = [0, 1, 2, 3, 1, 2]",
            lambda x, y: (x > 0) & (y > 0) & (x + y < 3),
        ),
    ],
)
@pytest.mark.parametrize("scale", ["(1, 1, 0)", "(2, 1, 0)"])
def test_solids_are_seen_as_their_shadows(
    load: Callable[..., Any], prim: str, inside: Callable[..., Any], scale: str
) -> None:
    imported = load(f"""
def Xform "flat" {{
    double3 xformOp:translate = (0, 0, 1)
    double3 xformOp:scale = {scale}
    uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:scale"]
    def {prim}
    }}
}}
""")
    hits, origins, paths = seen(imported)
    width = float(scale[1])
    expected = inside(origins[:, 0] / width, origins[:, 1])
    near = inside((origins[:, 0] + 1e-3) / width, origins[:, 1] + 1e-3) != inside(
        (origins[:, 0] - 1e-3) / width, origins[:, 1] - 1e-3
    )
    assert expected.sum() > 100
    assert (hits.hit == expected)[~near].all()
    np.testing.assert_allclose(hits.t[hits.hit], 9.0, rtol=1e-6)
    np.testing.assert_allclose(np.abs(hits.normal[hits.hit]), [(0, 0, 1)] * hits.hit.sum())
    assert set(paths) == {"/flat/p"}


def test_sheets_turn_with_what_is_above_and_keep_their_paths(load: Callable[..., Any]) -> None:
    imported = load("""
class Xform "_ball" {
    double3 xformOp:scale = (0, 1, 1)
    uniform token[] xformOpOrder = ["xformOp:scale"]
    def Sphere "s" {
        color3f[] primvars:displayColor = [(1, 0, 0)]
    }
}
def Xform "a" (instanceable = true
    inherits = </_ball>
) {
    double3 xformOp:translate = (2, 0, 0)
    float xformOp:rotateY = 90
    double3 xformOp:scale = (0, 1, 1)
    uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:rotateY", "xformOp:scale"]
}
def PointInstancer "points" {
    rel prototypes = </points/cube>
    int[] protoIndices = [0, 0, 0]
    point3f[] positions = [(-3, 0, 0), (-1, 0, 0), (0, 3, 0)]
    float3[] scales = [(1, 1, 0), (0.5, 0.5, 0.5), (1, 0, 0)]
    def Cube "cube" {
        double size = 1
    }
}
""")
    hits, origins, paths = seen(imported)
    assert set(paths) == {"/a/s", "/points/cube@/points[0]", "/points/cube@/points[1]"}
    hit = origins[hits.hit]
    sheet = np.array([path.endswith("[0]") for path in paths])
    np.testing.assert_allclose(hits.t[hits.hit][sheet], 10.0)
    assert np.abs(hit[sheet][:, :2] - (-3, 0)).max() < 0.5
    solid = np.array([path.endswith("[1]") for path in paths])
    np.testing.assert_allclose(hits.t[hits.hit][solid], 9.75)
    ball = np.array([path == "/a/s" for path in paths])
    reach = np.hypot(hit[ball][:, 0] - 2, hit[ball][:, 1]).max()
    assert 0.9 < reach < 1.0


@pytest.mark.parametrize("scale", ["(1, 0, 0)", "(0, 0, 0)"])
def test_what_is_pressed_to_a_line_is_still_reported(load: Callable[..., Any], scale: str) -> None:
    imported = load(f"""
def Cube "c" {{
    double3 xformOp:scale = {scale}
    uniform token[] xformOpOrder = ["xformOp:scale"]
}}
""")
    _, diagnostics, pruned = flatten(imported.graph, no_files)
    assert [d.code for d in diagnostics] == ["scene-singular-transform"]
    assert pruned.singular_instances == 1


def test_many_sheets_are_left_to_be_reported(load: Callable[..., Any]) -> None:
    count = 5000
    imported = load(f"""
def PointInstancer "points" {{
    rel prototypes = </points/cube>
    int[] protoIndices = {[0] * count}
    point3f[] positions = {[(0, 0, 0)] * count}
    float3[] scales = {[(1, 1, 0)] * count}
    def Cube "cube" {{ }}
}}
""")
    assert flatten(imported.graph, no_files).pruned.singular_instances == count


def test_matrices_that_nearly_press_are_left_alone(load: Callable[..., Any]) -> None:
    (leaf,) = load("""
def Cube "c" {
    matrix4d xformOp:transform = ((1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 1e-14, 0), (0, 0, 0, 1))
    uniform token[] xformOpOrder = ["xformOp:transform"]
}
""").leaves
    assert leaf.node.kind == "box"
