"""Curves and points, traced against curves evaluated point by point."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from compiler.flatten import flatten
from compiler.provenance import object_path
from compiler.usd.curves import FINE
from dsl.diagnostics import Diagnostic
from dsl.scene import File, Node
from runtime.tracer import Hits, Tracer


def no_files(_: File) -> tuple[Node | None, list[Diagnostic]]:
    raise AssertionError


def trace(imported: Any, origins: Any, directions: Any) -> tuple[Hits, set[str]]:
    ir, faults, _ = flatten(imported.graph, no_files)
    assert ir is not None
    assert faults == []
    hits = Tracer(ir).trace(origins, directions)
    return hits, {object_path(ir, int(i)) for i in hits.instance[hits.hit]}


def curve(points: np.ndarray, basis: str, wrap: str, t: np.ndarray) -> np.ndarray:
    """Points `(n, 3)` of all segments at `t`, by the formulas of the schema's documentation."""
    count = len(points)
    if basis == "linear":
        pairs = [(i, (i + 1) % count) for i in range(count if wrap == "periodic" else count - 1)]
        return np.concatenate(
            [np.outer(1 - t, points[i]) + np.outer(t, points[j]) for i, j in pairs]
        )
    if wrap == "pinned" and basis != "bezier":
        points = np.array([2 * points[0] - points[1], *points, 2 * points[-1] - points[-2]])
        count += 2
    step = 3 if basis == "bezier" else 1
    first = range(0, count if wrap == "periodic" else count - 3, step)
    found = []
    for i in first:
        p = [points[(i + k) % count] for k in range(4)]
        if basis == "bezier":
            for _ in range(3):
                p = [np.outer(1 - t, a) + np.outer(t, b) if a.ndim == 1
                     else (1 - t)[:, None] * a + t[:, None] * b
                     for a, b in itertools.pairwise(p)]  # fmt: skip
            found.append(p[0])
            continue
        weights = {
            "bspline": ((1 - t) ** 3 / 6, (3 * t**3 - 6 * t**2 + 4) / 6,
                        (-3 * t**3 + 3 * t**2 + 3 * t + 1) / 6, t**3 / 6),
            "catmullRom": ((-(t**3) + 2 * t**2 - t) / 2, (3 * t**3 - 5 * t**2 + 2) / 2,
                           (-3 * t**3 + 4 * t**2 + t) / 2, (t**3 - t**2) / 2),
        }[basis]  # fmt: skip
        found.append(sum(np.outer(w, q) for w, q in zip(weights, p, strict=True)))
    return np.concatenate(found)


@pytest.mark.parametrize("wrap", ["nonperiodic", "periodic", "pinned"])
@pytest.mark.parametrize("basis", ["linear", "bezier", "bspline", "catmullRom"])
def test_hits_lie_around_the_curve(load: Callable[..., Any], basis: str, wrap: str) -> None:
    count = 6 if basis == "bezier" and wrap == "periodic" else 7
    random = np.random.default_rng(4)
    points = random.uniform(-2, 2, (count, 3))
    kind = "linear" if basis == "linear" else "cubic"
    imported = load(f"""
def BasisCurves "c" {{
    uniform token type = "{kind}"
    {f'uniform token basis = "{basis}"' if kind == "cubic" else ""}
    uniform token wrap = "{wrap}"
    int[] curveVertexCounts = [{count}]
    point3f[] points = {[tuple(p) for p in points.tolist()]}
    float[] widths = [0.4] (interpolation = "constant")
}}
""")
    assert imported.diagnostics == []
    dense = curve(points, basis, wrap, np.linspace(0, 1, 300))
    targets = dense[random.integers(0, len(dense), 300)]
    origins = 20.0 * random.normal(size=(300, 3))
    hits, paths = trace(imported, origins, targets - origins)
    assert hits.hit.all()
    assert paths == {"/c"}
    apart = np.linalg.norm(hits.position[:, None] - dense, axis=2).min(axis=1)
    # A chord is within the tolerance of the curve, and so is its tube; the points are apart too.
    assert (np.abs(apart - 0.2) < 0.2 * (FINE + 0.01)).all()


@pytest.mark.parametrize(
    ("interpolation", "widths", "at"),
    [
        ("vertex", "[0.2, 0.6, 0.2]", {0.0: 0.1, 2.0: 0.3, 3.0: 0.2}),
        ("varying", "[0.2, 0.6, 0.2]", {0.0: 0.1, 2.0: 0.3, 3.0: 0.2}),
        ("uniform", "[0.4]", {0.0: 0.2, 2.0: 0.2, 3.0: 0.2}),
        ("vertex", "[0.4]", {0.0: 0.2, 2.0: 0.2, 3.0: 0.2}),
    ],
)
def test_widths_are_diameters(
    load: Callable[..., Any], interpolation: str, widths: str, at: dict[float, float]
) -> None:
    imported = load(f"""
def BasisCurves "c" {{
    uniform token type = "linear"
    int[] curveVertexCounts = [3]
    point3f[] points = [(0, 0, 0), (2, 0, 0), (4, 0, 0)]
    float[] widths = {widths} (interpolation = "{interpolation}")
}}
""")
    origins = np.array([(x, 0.0, 5.0) for x in at])
    hits, _ = trace(imported, origins, np.tile((0.0, 0.0, -1.0), (len(at), 1)))
    radii = np.array(list(at.values()))
    np.testing.assert_allclose(5.0 - hits.t, radii, atol=1e-4)


@pytest.mark.parametrize("primvar", [False, True])
def test_tapered_tubes_are_cones(load: Callable[..., Any], primvar: bool) -> None:
    widths = "float[] widths = [2, 0.5]"
    if primvar:
        widths = """float[] widths = [9]
    float[] primvars:widths = [0.5, 2] (interpolation = "vertex")
    int[] primvars:widths:indices = [1, 0]"""
    imported = load(f"""
def BasisCurves "c" {{
    uniform token type = "linear"
    int[] curveVertexCounts = [2]
    point3f[] points = [(0, 0, 0), (4, 0, 0)]
    {widths}
}}
""")
    assert imported.diagnostics == []
    random = np.random.default_rng(8)
    along = random.uniform(1.5, 3.5, 200)
    turn = random.uniform(0.0, 2.0 * np.pi, 200)
    out = np.stack((np.zeros(200), np.cos(turn), np.sin(turn)), axis=1)
    origins = 5.0 * out
    origins[:, 0] = along
    hits, _ = trace(imported, origins, -out)
    slope = 0.75 / 4.0
    np.testing.assert_allclose(hits.t, 5.0 - (1.0 - slope * along), atol=1e-5)
    normals = (out + np.array((slope, 0.0, 0.0))) / np.hypot(1.0, slope)
    assert (np.einsum("ij,ij->i", hits.normal, normals) > 1.0 - 1e-4).all()


def test_points_are_balls_in_place(load: Callable[..., Any]) -> None:
    imported = load("""
def Points "p" {
    double3 xformOp:scale = (2, 2, 2)
    uniform token[] xformOpOrder = ["xformOp:scale"]
    point3f[] points = [(0, 0, 0), (3, 0, 0), (nan, 0, 0), (9, 9, 9)]
    float[] widths = [1, 0.5, 1, 0]
    color3f[] primvars:displayColor = [(1, 0, 0)]
    int64[] ids = [7, 8, 9, 10]
}
""")
    origins = np.array([(0.0, 0.0, 10.0), (6.0, 0.0, 10.0), (6.4, 0.0, 10.0), (18, 18, 90)])
    hits, paths = trace(imported, origins, np.tile((0.0, 0.0, -1.0), (4, 1)))
    np.testing.assert_allclose(hits.t[:3], [9.0, 9.5, 10.0 - np.sqrt(0.25 - 0.16)], rtol=1e-5)
    assert not hits.hit[3]
    assert paths == {"/p"}
    assert imported.said("2 points without").code == "usd-curves"
    assert {leaf.material.diffuse for leaf in imported.leaves} == {(1.0, 0.0, 0.0)}


def test_many_curves_of_one_prim_share_two_shapes(load: Callable[..., Any]) -> None:
    counts = [4, 4, 2, 7, 9]
    points = np.random.default_rng(5).uniform(-1, 1, (sum(counts[:4]) + 3, 3))
    imported = load(f"""
def BasisCurves "hair" {{
    int[] curveVertexCounts = {counts}
    point3f[] points = {[tuple(p) for p in points.tolist()]}
    float[] widths = {[0.1] * (len(points) - 1)} (interpolation = "vertex")
}}
""")
    assert imported.said("2 curves with too few points").primary.place.prim == "/hair"
    assert "wrong number of `widths`" in imported.said("widths").message
    ir, _, _ = flatten(imported.graph, no_files)
    assert ir is not None
    assert len(ir.prototype_kind) == 2
    first = curve(points[:4], "bezier", "nonperiodic", np.array([0.0, 1.0]))
    balls = [leaf.world[:3, 3] for leaf in imported.leaves if leaf.node.kind == "sphere"]
    for end in first:
        assert min(np.linalg.norm(ball - end) for ball in balls) < 1e-6


@pytest.mark.parametrize(
    "body",
    [
        "",
        "point3f[] points = [(0, 0, 0)]\nint[] curveVertexCounts = [1]",
        "point3f[] points = [(0, 0, 0), (1, 0, 0)]\nint[] curveVertexCounts = [-2, 99]",
        'point3f[] points = [(0, 0, 0)]\nint[] curveVertexCounts = [4]\ntoken wrap = "pinned"',
        "int[] points = [1, 2]\nint[] curveVertexCounts = [2]",
    ],
)
@pytest.mark.parametrize("kind", ["BasisCurves", "Points"])
def test_what_cannot_be_drawn_is_reported(load: Callable[..., Any], kind: str, body: str) -> None:
    if kind == "Points":
        body = (
            body.split("\n")[0]
            .replace("(0, 0, 0)", "(nan, 0, 0)")
            .replace("(1, 0, 0)", "(inf, 0, 0)")
        )
    imported = load(f'def {kind} "c" {{\n{body}\n}}')
    assert imported.leaves == []
    assert "usd-curves" in imported.codes()


def test_chords_stay_near_their_curves_by_the_size_of_the_prim(load: Callable[..., Any]) -> None:
    points = np.array([(0, 0, 0), (0, 4, 0), (4, 4, 0), (4, 0, 0)], dtype=float)
    imported = load(f"""
def BasisCurves "c" {{
    uniform token basis = "bezier"
    int[] curveVertexCounts = [4]
    point3f[] points = {[tuple(p) for p in points.tolist()]}
    float[] widths = [1] (interpolation = "constant")
}}
""")
    t = np.linspace(0.2, 0.8, 30)[:, None]
    weights = ((1 - t) ** 3, 3 * t * (1 - t) ** 2, 3 * t * t * (1 - t), t**3)
    at = sum(w * p for w, p in zip(weights, points, strict=True))
    hits, _ = trace(imported, at + np.array((0.0, 0.0, 5.0)), np.tile((0.0, 0.0, -1.0), (30, 1)))
    np.testing.assert_allclose(hits.t, 4.5, atol=4e-5)
    hits, _ = trace(imported, np.array([(2.0, 9.0, 0.0)]), np.array([(0.0, -1.0, 0.0)]))
    np.testing.assert_allclose(hits.t, 9.0 - 3.5, atol=4e-5)


def test_widths_are_inherited_like_other_primvars(load: Callable[..., Any]) -> None:
    imported = load("""
def Xform "above" {
    float[] primvars:widths = [0.6] (interpolation = "constant")
    def Points "inherited" {
        point3f[] points = [(0, 0, 0)]
    }
    def Points "own" {
        point3f[] points = [(0, 0, 0)]
        float[] widths = [0.2] (interpolation = "constant")
    }
}
""")
    assert [leaf.world[0, 0] for leaf in imported.leaves] == pytest.approx([0.3, 0.1])
    assert imported.diagnostics == []


def test_many_segments_get_fewer_tubes(
    load: Callable[..., Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    points = [tuple(p) for p in np.random.default_rng(6).uniform(-9, 9, (23, 3)).tolist()]
    stage = f"""
def BasisCurves "c" {{
    uniform token basis = "bspline"
    int[] curveVertexCounts = [23]
    point3f[] points = {points}
    float[] widths = [0.01] (interpolation = "constant")
}}
"""
    many = [leaf for leaf in load(stage).leaves if leaf.node.kind == "cylinder"]
    assert len(many) > 20 * 128
    monkeypatch.setattr("compiler.usd.curves.BUDGET", 100)
    imported = load(stage)
    tubes = [leaf for leaf in imported.leaves if leaf.node.kind == "cylinder"]
    assert 80 <= len(tubes) <= 100
    assert f"{len(many)} tubes" in imported.said("fewer").message


def test_hermite_curves_are_the_bezier_curves_they_are(load: Callable[..., Any]) -> None:
    widths = "float[] widths = [0.5]"
    hermite = load(f"""
def HermiteCurves "c" {{
    int[] curveVertexCounts = [3, 2]
    point3f[] points = [(0, 0, 0), (3, 0, 0), (3, 3, 0), (0, 0, 9), (3, 0, 9)]
    vector3f[] tangents = [(3, 3, 0), (0, 3, 0), (3, 0, 0), (0, 0, 3), (0, 0, 3)]
    {widths}
}}
""")
    bezier = load(f"""
def BasisCurves "c" {{
    uniform token type = "cubic"
    uniform token basis = "bezier"
    int[] curveVertexCounts = [7, 4]
    point3f[] points = [(0, 0, 0), (1, 1, 0), (3, -1, 0), (3, 0, 0), (3, 1, 0), (2, 3, 0),
        (3, 3, 0), (0, 0, 9), (0, 0, 10), (3, 0, 8), (3, 0, 9)]
    {widths}
}}
""")
    assert len(hermite.leaves) > 4
    for one, other in zip(hermite.leaves, bezier.leaves, strict=True):
        np.testing.assert_allclose(one.world, other.world, atol=1e-9)
