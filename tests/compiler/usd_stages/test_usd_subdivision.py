"""Subdivision meshes of stages: which surface, how fine, and what of it is reported."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from compiler.usd.options import StageOptions

CUBE = """
    point3f[] points = [(-0.5, -0.5, -0.5), (-0.5, -0.5, 0.5), (-0.5, 0.5, -0.5), (-0.5, 0.5, 0.5),
                        (0.5, -0.5, -0.5), (0.5, -0.5, 0.5), (0.5, 0.5, -0.5), (0.5, 0.5, 0.5)]
    int[] faceVertexCounts = [4, 4, 4, 4, 4, 4]
    int[] faceVertexIndices = [0, 1, 3, 2, 4, 6, 7, 5, 0, 4, 5, 1, 2, 3, 7, 6, 0, 2, 6, 4,
                               1, 5, 7, 3]
"""


def volume(mesh: Any) -> float:
    a, b, c = (mesh.points[mesh.triangles[:, i]] for i in range(3))
    return float(np.einsum("ij,ij->", a, np.cross(b, c)) / 6.0)


def cube(load: Callable[..., Any], lines: str = "", **options: Any) -> Any:
    imported = load(f'def Mesh "m" {{{CUBE}{lines}\n}}', **options)
    assert imported.paths() == ["/m"]
    return imported


def test_a_cage_is_drawn_with_a_warning_unless_told_otherwise(load: Callable[..., Any]) -> None:
    imported = cube(load, complexity=StageOptions().complexity)
    assert len(imported.leaves[0].node.triangles) == 12
    assert imported.said("drawn as their cages").code == "usd-subdivision"


def test_the_limit_of_a_cube_is_round_and_outside_out(
    load: Callable[..., Any],
) -> None:
    imported = cube(load)
    mesh = imported.leaves[0].node
    assert imported.diagnostics == []
    assert len(mesh.triangles) == 6 * 4**6 * 2
    radii = np.linalg.norm(mesh.points, axis=1)
    assert radii.max() / radii.min() < 1.1
    assert 0.0 < volume(mesh) < 0.5


@pytest.mark.parametrize(
    ("complexity", "triangles"), [("low", 12), ("medium", 48), ("high", 192), ("veryhigh", 768)]
)
def test_complexity_is_the_number_of_refinements(
    load: Callable[..., Any], complexity: str, triangles: int
) -> None:
    mesh = cube(load, complexity=complexity).leaves[0].node
    assert len(mesh.triangles) == triangles
    reach = np.abs(mesh.points).max()
    assert reach == 0.5 if complexity == "low" else reach < 0.42


@pytest.mark.parametrize(("scheme", "size"), [("none", 1.0), ("bilinear", 1.0)])
def test_flat_schemes_keep_the_cube(load: Callable[..., Any], scheme: str, size: float) -> None:
    mesh = cube(load, f'uniform token subdivisionScheme = "{scheme}"').leaves[0].node
    assert volume(mesh) == pytest.approx(size)


def test_left_handed_and_loop_surfaces(load: Callable[..., Any]) -> None:
    assert volume(cube(load, 'uniform token orientation = "leftHanded"').leaves[0].node) < 0.0
    imported = cube(load, 'uniform token subdivisionScheme = "loop"')
    assert 0.0 < volume(imported.leaves[0].node) < 0.5
    assert imported.said("cut into triangles").code == "usd-subdivision"


def test_creases_and_corners_are_sharp(load: Callable[..., Any]) -> None:
    ring = """
    int[] creaseIndices = [1, 5, 7, 3, 1]
    int[] creaseLengths = [5]
    float[] creaseSharpnesses = [10]
    """
    points = cube(load, ring).leaves[0].node.points
    assert points[:, 2].max() == 0.5
    assert points[:, 2].min() > -0.45
    # The ring ends as a cubic B-spline of its four points: half way (-1 + 23 + 23 - 1) / 48.
    top = points[np.abs(points[:, 2] - 0.5) < 1e-12]
    assert np.abs(top[:, :2]).max() == pytest.approx(0.5 * 44 / 48)
    pinned = """
    int[] cornerIndices = [7]
    float[] cornerSharpnesses = [10]
    """
    points = cube(load, pinned).leaves[0].node.points
    np.testing.assert_array_equal(points.max(axis=0), 0.5)
    each = "int[] creaseIndices = [1, 5, 7]\nint[] creaseLengths = [3]\n"
    one, many = (
        cube(load, each + f"float[] creaseSharpnesses = {values}").leaves[0].node.points
        for values in ("[2.5]", "[2.5, 2.5]")
    )
    np.testing.assert_array_equal(one, many)


def test_holes_shape_their_neighbours_but_are_not_drawn(load: Callable[..., Any]) -> None:
    whole = cube(load).leaves[0].node
    mesh = cube(load, "int[] holeIndices = [0]").leaves[0].node
    assert len(mesh.triangles) == 5 * 4**6 * 2
    known = {tuple(point) for point in whole.points}
    assert all(tuple(point) in known for point in mesh.points)


@pytest.mark.parametrize(
    ("boundary", "low"), [("edgeAndCorner", 0.0), ("edgeOnly", 1 / 6), ("none", 1.0)]
)
def test_boundaries(load: Callable[..., Any], boundary: str, low: float) -> None:
    points = ", ".join(f"({i}, {j}, 0)" for i in range(4) for j in range(4))
    faces = [(4 * i + j, 4 * i + j + 4, 4 * i + j + 5, 4 * i + j + 1)
             for i in range(3) for j in range(3)]  # fmt: skip
    (leaf,) = load(f"""
def Mesh "m" {{
    point3f[] points = [{points}]
    int[] faceVertexCounts = {[4] * 9}
    int[] faceVertexIndices = {[corner for face in faces for corner in face]}
    uniform token interpolateBoundary = "{boundary}"
}}
""").leaves
    nearest = leaf.node.points[np.argmin(leaf.node.points.sum(axis=1))]
    np.testing.assert_allclose(nearest[:2], low, atol=1e-12)
    assert np.abs(leaf.node.points[:, 2]).max() == 0.0


@pytest.mark.parametrize(
    ("lines", "words"),
    [
        ("int[] creaseIndices = [0, 1]\nint[] creaseLengths = [3]", "lengths do not fit"),
        ("int[] creaseIndices = [0, 1]\nint[] creaseLengths = [2]", "sharpnesses do not fit"),
        (
            "int[] creaseIndices = [0, 99]\nint[] creaseLengths = [2]\n"
            "float[] creaseSharpnesses = [1]",
            "creases through points that do not exist",
        ),
        (
            "int[] cornerIndices = [-1]\nfloat[] cornerSharpnesses = [2]",
            "corners at points that do not exist",
        ),
        ("int[] cornerIndices = [1, 2]\nfloat[] cornerSharpnesses = [2]", "differ in number"),
        ('uniform token interpolateBoundary = "no"', "interpolateBoundary"),
        ('uniform token subdivisionScheme = "butterfly"', "subdivisionScheme"),
    ],
)
def test_what_cannot_be_used_is_reported(load: Callable[..., Any], lines: str, words: str) -> None:
    imported = cube(load, lines)
    found = imported.said(words)
    assert (found.code, found.primary.place.prim) == ("usd-subdivision", "/m")
    smooth = "butterfly" not in lines
    assert volume(imported.leaves[0].node) == pytest.approx(0.365 if smooth else 1.0, abs=0.1)


def test_faces_with_repeated_corners_and_nan_sharpness_do_no_harm(
    load: Callable[..., Any],
) -> None:
    imported = load("""
def Mesh "m" {
    point3f[] points = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (5, nan, 0)]
    int[] faceVertexCounts = [5, 3, 3]
    int[] faceVertexIndices = [0, 1, 1, 2, 3, 2, 2, 2, 0, 1, 4]
    int[] cornerIndices = [0, 0]
    float[] cornerSharpnesses = [nan, inf]
}
""")
    (leaf,) = imported.leaves
    assert np.isfinite(leaf.node.points).all()
    assert leaf.node.points.min() == 0.0
    assert sorted(d.message for d in imported.diagnostics) == [
        "1 faces of fewer than 3 corners are left out",
        "1 faces with points that are not finite are left out",
    ]


def test_the_finer_the_mesh_the_fewer_refinements(load: Callable[..., Any]) -> None:
    counts = {}
    for rows, columns in ((5, 5), (10, 10), (20, 20), (20, 21), (40, 50), (80, 100), (80, 101)):
        number = np.arange((rows + 1) * (columns + 1)).reshape(rows + 1, columns + 1)
        corners = (number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:])
        quads = np.stack(corners, axis=-1).reshape(-1, 4)
        points = ", ".join(f"({i}, {j}, 0)" for i in range(rows + 1) for j in range(columns + 1))
        (leaf,) = load(f"""
def Mesh "m" {{
    point3f[] points = [{points}]
    int[] faceVertexCounts = {[4] * len(quads)}
    int[] faceVertexIndices = {quads.ravel().tolist()}
}}
""").leaves
        counts[len(quads)] = len(leaf.node.triangles) // (2 * len(quads))
    assert counts == {25: 4096, 100: 1024, 400: 256, 420: 64, 2000: 64, 8000: 16, 8080: 4}


def test_many_meshes_are_refined_less_all_alike(
    load: Callable[..., Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    stage = "".join(f'def Mesh "m{i}" {{{CUBE}}}\n' for i in range(10))
    instance = 'def "copy{}" (instanceable = true\n inherits = </_box>\n) {{\n}}\n'
    stage += f'class Xform "_box" {{\ndef Mesh "m" {{{CUBE}}}\n}}\n'
    stage += "".join(instance.format(i) for i in range(50))
    monkeypatch.setattr("compiler.usd.refinement.STAGE_TRIANGLES", 12 * 12 * 4**2)
    imported = load(stage)
    assert {len(leaf.node.triangles) for leaf in imported.leaves} == {12 * 4**2}
    assert "refined 4 times less" in imported.said("for so many").message
    assert load(stage, complexity="veryhigh").diagnostics == []
