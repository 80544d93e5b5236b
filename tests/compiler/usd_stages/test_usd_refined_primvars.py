"""Primvars of refined meshes: subdivided like points, or linear within the faces of the cage."""

from __future__ import annotations

from collections.abc import Callable
from itertools import chain
from typing import Any

import numpy as np
import pytest

POINTS = [(0, 0, 0), (2, 0, 1), (4, 0, 0), (0, 2, 0), (2, 2, 2), (4, 2, 0), (1, 4, 0), (3, 4, 1)]
FACES = [[0, 1, 4, 3], [1, 2, 5, 4], [4, 5, 7], [3, 4, 7, 6]]
CORNERS = list(chain(*FACES))


def mesh(scheme: str, interpolation: str, values: Any, more: str = "") -> str:
    return f"""
def Mesh "m" {{
    uniform token subdivisionScheme = "{scheme}"
    point3f[] points = {POINTS}
    int[] faceVertexCounts = {[len(face) for face in FACES]}
    int[] faceVertexIndices = {CORNERS}
    int[] creaseIndices = [0, 1, 4]
    int[] creaseLengths = [3]
    float[] creaseSharpnesses = [2.5]
    color3f[] primvars:displayColor = {[tuple(v) for v in values]} (
        interpolation = "{interpolation}"
    )
    {more}
}}
"""


def corners(imported: Any) -> tuple[np.ndarray, np.ndarray]:
    """Points and colours `(m, 3, 3)` of all corners of the one mesh's triangles."""
    (leaf,) = imported.leaves
    (colour,) = [a for a in leaf.node.attributes if a.name == "displayColor"]
    rows = leaf.node.triangles if colour.corners is None else colour.corners
    return leaf.node.points[leaf.node.triangles], colour.values[rows].astype(np.float64)


@pytest.mark.parametrize("orientation", ["rightHanded", "leftHanded"])
@pytest.mark.parametrize("complexity", ["low", "medium", "veryhigh"])
@pytest.mark.parametrize("scheme", ["catmullClark", "loop", "bilinear"])
def test_vertex_primvars_are_subdivided_like_the_points(
    load: Callable[..., Any], scheme: str, complexity: str, orientation: str
) -> None:
    order = [3, 1, 4, 0, 5, 2, 6, 7]
    values = [POINTS[order.index(i)] for i in range(len(POINTS))]
    more = f"""uniform token orientation = "{orientation}"
    int[] holeIndices = [1]
    int[] primvars:displayColor:indices = {order}"""
    points, colours = corners(load(mesh(scheme, "vertex", values, more), complexity=complexity))
    np.testing.assert_allclose(colours, points, atol=1e-6)


@pytest.mark.parametrize("interpolation", ["varying", "faceVarying"])
def test_other_primvars_are_linear_within_the_cage(
    load: Callable[..., Any], interpolation: str
) -> None:
    places = range(len(POINTS)) if interpolation == "varying" else CORNERS
    stage = mesh("catmullClark", interpolation, [POINTS[place] for place in places])
    _, colours = corners(load(stage, complexity="high"))
    # Bilinear subdivision brings the points where linear values are.
    points, _ = corners(load(mesh("bilinear", "vertex", POINTS), complexity="high"))
    assert {tuple(p) for p in np.round(colours.reshape(-1, 3), 4)} == {
        tuple(p) for p in np.round(points.reshape(-1, 3), 4)
    }
    middle = {tuple(p) for p in np.round(colours.mean(axis=1), 3)}
    assert len(middle) == len(colours)  # every triangle has its own place in the cage


@pytest.mark.parametrize("interpolation", ["varying", "faceVarying"])
def test_loop_triangles_are_parts_of_their_cages(
    load: Callable[..., Any], interpolation: str
) -> None:
    places = range(len(POINTS)) if interpolation == "varying" else CORNERS
    stage = mesh("loop", interpolation, [POINTS[place] for place in places])
    cage, _ = corners(load(stage, complexity="low"))
    _, colours = corners(load(stage, complexity="high"))
    assert len(colours) == 16 * len(cage)
    areas = np.linalg.norm(_normals(colours), axis=1)
    whole = np.linalg.norm(_normals(cage), axis=1)
    np.testing.assert_allclose(np.sort(areas), np.sort(np.repeat(whole / 16.0, 16)), atol=1e-5)
    np.testing.assert_allclose(_normals(colours).sum(axis=0), _normals(cage).sum(axis=0), atol=1e-4)


def _normals(triangles: np.ndarray) -> np.ndarray:
    sides = triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]
    return np.asarray(np.cross(*sides))


def test_wrong_counts_are_reported_on_refined_meshes_too(load: Callable[..., Any]) -> None:
    stage = mesh("catmullClark", "faceVarying", POINTS[:3])
    imported = load(stage, complexity="medium")
    assert imported.said("`displayColor` has a wrong number").primary.place.prim == "/m"
