"""Shading normals and colours that vary over meshes, by value."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

import ovolo
from compiler import expand
from tests.runtime.textured_quad import camera, compiled, material, mesh, shown

SUN = """
def DistantLight "sun" {
    float inputs:intensity = 3.14159265
    float inputs:angle = 0
    float3 xformOp:rotateXYZ = (0, 40, 0)
    uniform token[] xformOpOrder = ["xformOp:rotateXYZ"]
}
"""
TOWARDS = np.array([np.sin(np.radians(40)), 0.0, np.cos(np.radians(40))])
WHITE = material("color3f inputs:diffuseColor = (1, 1, 1)")
GLOSSY = material(
    """color3f inputs:diffuseColor = (0.5, 0.4, 0.3)
        float inputs:roughness = 0.3"""
).replace("inputs:ior = 1", "inputs:ior = 1.5")


def listed(rows: NDArray[np.float64]) -> str:
    return "[" + ", ".join(f"({', '.join(map(repr, row))})" for row in rows.tolist()) + "]"


def ball(rings: int, sides: int) -> tuple[NDArray[np.float64], list[int], list[int]]:
    """Points, counts and corners of a unit ball of quadrilaterals and triangles."""
    theta = np.linspace(0, np.pi, rings + 1)[:, None]
    phi = np.arange(sides) * 2 * np.pi / sides
    y = np.cos(theta) + 0 * phi
    points = np.stack((np.sin(theta) * np.sin(phi), y, np.sin(theta) * np.cos(phi)), axis=-1)
    counts, corners = [], []
    for i in range(rings):
        for j in range(sides):
            a, b = i * sides + j, i * sides + (j + 1) % sides
            quad = [a, a + sides, b + sides, b]
            if i == 0:
                quad = [a, a + sides, b + sides]
            elif i == rings - 1:
                quad = [a, a + sides, b]
            counts.append(len(quad))
            corners += quad
    return points.reshape(-1, 3), counts, corners


def ball_mesh(normals: str = "", turned: bool = False) -> str:
    points, counts, corners = ball(24, 48)
    return mesh(
        normals,
        f"""point3f[] points = {listed(points)}
    int[] faceVertexCounts = {counts}
    int[] faceVertexIndices = {corners}
    uniform token subdivisionScheme = "none"
    {'uniform token orientation = "leftHanded"' if turned else ""}
""",
    )


def normals_of(interpolation: str) -> str:
    points, _, corners = ball(24, 48)
    rows = points if interpolation == "vertex" else points[corners]
    # Of any length.
    rows = rows * np.linspace(0.5, 3, len(rows))[:, None]
    return f'normal3f[] normals = {listed(rows)} (interpolation = "{interpolation}")'


VIEW = camera(2.2, 0.0)
SPHERE = """
def Sphere "q" (prepend apiSchemas = ["MaterialBindingAPI"]) {
    double radius = 1
    rel material:binding = </m>
}
"""


@pytest.mark.parametrize("interpolation", ["vertex", "faceVarying"])
@pytest.mark.parametrize("look", [WHITE, GLOSSY])
def test_a_ball_with_its_normals_is_shaded_like_the_sphere(
    tmp_path: Path, interpolation: str, look: str
) -> None:
    """Away from the outline, and from where the facets themselves turn from the light."""
    smooth = compiled(tmp_path, VIEW, SUN, look, ball_mesh(normals_of(interpolation)))
    exact = compiled(tmp_path, VIEW, SUN, look, SPHERE)
    faceted = compiled(tmp_path, VIEW, SUN, look, ball_mesh())
    pictures = [s.render(width=64, height=64, samples=1) for s in (smooth, exact, faceted)]
    normal = pictures[1].normal
    inner = (normal[..., 2] > 0.35) & (normal @ TOWARDS > 0.25)
    assert inner.sum() > 1000
    shaded, expected, flat = (film.color[..., 0][inner] for film in pictures)
    assert np.abs(shaded - expected).max() < 0.02 * expected.max()
    assert np.abs(flat - expected).max() > 0.04 * expected.max()
    # What is seen and traced stays the mesh.
    np.testing.assert_array_equal(pictures[0].normal, pictures[2].normal)
    tracers = smooth.tracer(), faceted.tracer()
    hits = [tracer.trace([0.1, 0.2, 5], [0, 0, -1.0]) for tracer in tracers]
    np.testing.assert_array_equal(hits[0].normal, hits[1].normal)


def test_normals_survive_mirrors_scales_and_the_other_hand(tmp_path: Path) -> None:
    """A quad that leans by its normals, seen through a mirrored and stretched instance."""
    lean = np.array([0.6, 0.0, 0.8])
    normals = f"normal3f[] normals = {listed(np.tile(lean, (4, 1)))}"
    placed = """double3 xformOp:scale = (-1, 1, 2)
    double3 xformOp:translate = (1, 0, 0)
    uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:scale"]"""
    film = shown(tmp_path, SUN, WHITE, mesh(f"{normals}\n{placed}"), size=1)
    turned = lean / (-1, 1, 2)
    turned /= np.linalg.norm(turned)
    np.testing.assert_allclose(film.color[0, 0, 0], max(turned @ TOWARDS, 0), atol=1e-5)


def test_seen_from_behind_normals_are_those_of_that_side(tmp_path: Path) -> None:
    lean = np.array([0.6, 0.0, 0.8])
    normals = f"normal3f[] normals = {listed(np.tile(-lean, (4, 1)))}"
    film = shown(tmp_path, SUN, WHITE, mesh(normals), size=1)
    np.testing.assert_allclose(film.color[0, 0, 0], lean @ TOWARDS, atol=1e-5)


@pytest.mark.parametrize("turned", [False, True])
def test_subdivision_surfaces_have_the_normals_of_their_limit(tmp_path: Path, turned: bool) -> None:
    """A coarse refinement is shaded like a fine one, where faces would differ."""
    faces = "[0, 1, 3, 2, 4, 6, 7, 5, 0, 4, 5, 1, 2, 3, 7, 6, 0, 2, 6, 4, 1, 5, 7, 3]"
    corners = [(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]
    cube = f"""point3f[] points = {corners}
    int[] faceVertexCounts = [4, 4, 4, 4, 4, 4]
    int[] faceVertexIndices = {faces}
    {'uniform token orientation = "leftHanded"' if turned else ""}
"""
    prims = VIEW, SUN, WHITE, mesh("", cube)
    films = [
        compiled(tmp_path, *prims, complexity=complexity).render(width=48, height=48, samples=1)
        for complexity in ("veryhigh", "limit")
    ]
    expected, shaded = films[1].color[..., 0], films[0].color[..., 0]
    outward = [film.normal * np.sign(film.normal[..., 2:]) for film in films]
    inner = (outward[1][..., 2] > 0.4) & (outward[1] @ TOWARDS > 0.3)
    inner &= films[0].instance == 0
    facets = np.maximum(outward[0] @ TOWARDS, 0)
    assert inner.sum() > 300
    assert np.abs(shaded - expected)[inner].max() < 0.015
    assert np.abs(facets - expected)[inner].max() > 0.08


def test_creases_stay_sharp(tmp_path: Path) -> None:
    """A cube with sharp edges, refined: its faces are as flat as before."""
    cube = """point3f[] points = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0),
        (0, 0, -1), (1, 0, -1), (1, 1, -1), (0, 1, -1)]
    int[] faceVertexCounts = [4, 4, 4, 4, 4, 4]
    int[] faceVertexIndices = [0, 1, 2, 3, 1, 5, 6, 2, 5, 4, 7, 6, 4, 0, 3, 7, 3, 2, 6, 7,
        4, 5, 1, 0]
    int[] creaseIndices = [0, 1, 2, 3, 0, 4, 5, 6, 7, 4, 0, 4, 1, 5, 2, 6, 3, 7]
    int[] creaseLengths = [5, 5, 2, 2, 2, 2]
    float[] creaseSharpnesses = [10, 10, 10, 10, 10, 10]
"""
    film = shown(tmp_path, SUN, WHITE, mesh("", cube), size=8, complexity="high")
    np.testing.assert_allclose(film.color[..., 0], TOWARDS[2], atol=1e-5)


RED, GREEN, BLUE, GREY = (1, 0, 0), (0, 1, 0), (0, 0, 1), (0.5, 0.5, 0.5)


@pytest.mark.parametrize("scheme", ["none", "bilinear"])
@pytest.mark.parametrize(
    ("interpolation", "colors", "expected"),
    [
        ("constant", [GREY], [[GREY, GREY], [GREY, GREY]]),
        ("uniform", [RED, BLUE], [[RED, BLUE], [RED, BLUE]]),
        ("vertex", [RED, GREEN, BLUE, RED, GREEN, BLUE], "linear"),
        ("varying", [RED, GREEN, BLUE, RED, GREEN, BLUE], "linear"),
        ("faceVarying", [RED] * 4 + [BLUE] * 4, [[RED, BLUE], [RED, BLUE]]),
    ],
)
def test_display_colours_by_interpolation(
    tmp_path: Path, interpolation: str, colors: list[tuple[float, ...]], expected: object,
    scheme: str,
) -> None:  # fmt: skip
    strip = f"""point3f[] points = [(0, 0, 0), (0.5, 0, 0), (1, 0, 0),
        (0, 1, 0), (0.5, 1, 0), (1, 1, 0)]
    int[] faceVertexCounts = [4, 4]
    int[] faceVertexIndices = [0, 1, 4, 3, 1, 2, 5, 4]
    uniform token subdivisionScheme = "{scheme}"
"""
    body = f'color3f[] primvars:displayColor = {colors} (interpolation = "{interpolation}")'
    sun = SUN.replace("(0, 40, 0)", "(0, 0, 0)")
    complexity = "low" if scheme == "none" else "high"
    film = shown(tmp_path, sun, mesh(body, strip, ""), size=2, complexity=complexity)
    if expected == "linear":
        middle = (np.array(RED) + GREEN) / 2, (np.array(GREEN) + BLUE) / 2
        expected = [list(middle), list(middle)]
    # The default material's gloss towards its mirror direction: F / (4 α²).
    gloss = 0.04 / (4 * 0.25**2)
    np.testing.assert_allclose(film.color[..., :3], np.array(expected) * 0.96 + gloss, atol=1e-5)


def test_display_opacity_varies_too(tmp_path: Path) -> None:
    body = """color3f[] primvars:displayColor = [(1, 1, 1)]
    float[] primvars:displayOpacity = [0, 1, 1, 0] (interpolation = "vertex")"""
    film = shown(tmp_path, SUN, mesh(body, binding=""), size=4)
    np.testing.assert_allclose(film.color[0, :, 3], [0.125, 0.375, 0.625, 0.875], atol=1e-5)


def test_a_bound_material_wins_over_display_colours_unless_it_reads_them(tmp_path: Path) -> None:
    body = """color3f[] primvars:displayColor = [(1, 0, 0), (1, 0, 0), (0, 0, 1), (0, 0, 1)] (
        interpolation = "vertex"
    )"""
    sun = SUN.replace("(0, 40, 0)", "(0, 0, 0)")
    film = shown(tmp_path, sun, WHITE, mesh(body), size=1)
    np.testing.assert_allclose(film.color[0, 0, :3], 1, atol=1e-5)
    reader = """def Shader "c" {
        uniform token info:id = "UsdPrimvarReader_float3"
        string inputs:varname = "displayColor"
        float3 outputs:result
    }"""
    look = material("color3f inputs:diffuseColor.connect = </m/c.outputs:result>", more=reader)
    film = shown(tmp_path, sun, look, mesh(body), size=1)
    np.testing.assert_allclose(film.color[0, 0, :3], (0.5, 0, 0.5), atol=1e-5)


def test_the_way_through_nested_groups_ends_at_the_same_triangles(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    prims = WHITE, ball_mesh(normals_of("vertex"))
    compiled(tmp_path, *prims)
    text = """
let ball = usd("stage.usda")
let pair = {
    ball.scale(0.5, 0.25, 0.5)
    ball.scale(0.25).translate(0.5, 0.5, 0)
}
let four = {
    pair.rotate_z(30deg).translate(-0.5, 0, 0)
    pair.scale(-1, 1, 1)
}
four.rotate_y(20deg)
four.scale(0.3).translate(0, -0.8, 0)
sun(direction: (-1, -0.5, -1), irradiance: 3)
camera(from: (0, 0, 5), at: (0, 0, 0), height: 2.4)
"""
    pictures = []
    for leaves in (expand.FLATTEN_LEAVES, 0):
        monkeypatch.setattr(expand, "FLATTEN_LEAVES", leaves)
        monkeypatch.setattr(expand, "FLATTEN_ROWS", leaves)
        scene = ovolo.compile(text, str(tmp_path / "scene.ovo"))
        assert (len(scene.ir.group_ranges) > 1) == (leaves == 0)
        pictures.append(scene.render(width=48, height=48, samples=1))
    flat, nested = pictures
    np.testing.assert_array_equal(flat.instance, nested.instance)
    np.testing.assert_allclose(flat.color, nested.color, atol=1e-4)
