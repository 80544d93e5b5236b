"""NURBS against de Boor's algorithm, and against the spheres and circles that they are."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from compiler.compilation import Compilation, compile_path
from compiler.usd import StageOptions
from dsl.spans import PrimPlace
from runtime.tracer import Tracer

Array = NDArray[np.float64]
ARC = ([0, 0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 4], 3)
"""Knots and order of a full circle in four arcs."""
CIRCLE = np.array(
    [(1, 0), (1, 1), (0, 1), (-1, 1), (-1, 0), (-1, -1), (0, -1), (1, -1), (1, 0)], float
)
WEIGHTS = np.array([1, 0.5**0.5] * 4 + [1])


def _de_boor(knots: Any, order: int, control: Array, t: float) -> Array:
    """The point at t by insertion of t into the knots (C. de Boor, 1972)."""
    degree = order - 1
    k = max(i for i in range(degree, len(control)) if knots[i] <= t and knots[i] < knots[i + 1])
    d = [np.array(control[k - degree + j], float) for j in range(order)]
    for r in range(1, order):
        for j in range(degree, r - 1, -1):
            low, high = knots[k - degree + j], knots[k + 1 + j - r]
            share = (t - low) / (high - low)
            d[j] = (1.0 - share) * d[j - 1] + share * d[j]
    return d[degree]


def _patch(
    path: Path, control: Array, weights: Array, u: tuple[Any, int], v: tuple[Any, int], **more: Any
) -> None:
    """Write a patch of `control` `(v, u, 3)`."""
    from pxr import Gf, Usd, UsdGeom, Vt

    stage = Usd.Stage.CreateNew(str(path))
    patch = UsdGeom.NurbsPatch.Define(stage, "/patch")
    patch.CreatePointsAttr(Vt.Vec3fArray.FromNumpy(control.reshape(-1, 3).astype(np.float32)))
    patch.CreatePointWeightsAttr(weights.ravel().tolist())
    patch.CreateUVertexCountAttr(control.shape[1])
    patch.CreateVVertexCountAttr(control.shape[0])
    for name, (knots, order) in (("U", u), ("V", v)):
        getattr(patch, f"Create{name}KnotsAttr")([float(k) for k in knots])
        getattr(patch, f"Create{name}OrderAttr")(order)
        if name in more:
            getattr(patch, f"Create{name}RangeAttr")(Gf.Vec2d(*more[name]))
    if "orientation" in more:
        patch.CreateOrientationAttr(more["orientation"])
    stage.Save()


def _compiled(path: Path, complexity: Any = "limit") -> Compilation:
    return compile_path(path, options=StageOptions(complexity=complexity))


def _sphere(path: Path, radius: float, **more: Any) -> None:
    """Half circles from the south pole up, turned about z."""
    half, half_weights = CIRCLE[6:].tolist() + [(1, 0), (1, 1), (0, 1)][1:], WEIGHTS[:5]
    meridian = np.array(half)[:, [0, 1]] * radius
    control = np.array([[(x * cx, x * cy, z) for cx, cy in CIRCLE] for x, z in meridian])
    weights = half_weights[:, None] * WEIGHTS
    _patch(path, control, weights, ARC, ([0, 0, 0, 1, 1, 2, 2, 2], 3), **more)


@pytest.mark.parametrize("turned", [False, True])
def test_a_sphere_of_nurbs_is_a_sphere(tmp_path: Path, turned: bool) -> None:
    path = tmp_path / "stage.usda"
    _sphere(path, 2.0, orientation="leftHanded" if turned else "rightHanded")
    rng = np.random.default_rng(1)
    directions = rng.normal(size=(4000, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    for complexity, error in (("low", 7e-3), ("veryhigh", 8e-5)):
        scene = _compiled(path, complexity)
        hits = Tracer(scene.ir, "float64").trace(7.0 * directions, -directions)
        assert np.abs(hits.t - 5.0).max() < error  # no ray is lost at poles and seams
        facing = (hits.normal * directions).sum(axis=1)
        assert ((facing < 0.0) if turned else (facing > 0.0)).all()
    assert hits.t.min() >= 5.0 - 1e-9  # chords are within


def test_patches_are_what_de_boor_makes_of_them(tmp_path: Path) -> None:
    rng = np.random.default_rng(5)
    for case in range(4):
        order_u, order_v = (int(n) for n in rng.integers(2, 6, 2))
        count_u, count_v = order_u + int(rng.integers(0, 5)), order_v + int(rng.integers(0, 5))
        x, y = np.meshgrid(np.arange(count_u), np.arange(count_v))
        control = (
            np.stack((x, y, rng.normal(size=x.shape)), axis=-1).astype(np.float32).astype(float)
        )
        weights = rng.uniform(0.5, 2.0, x.shape).astype(np.float32).astype(float)
        knots_u, knots_v = (
            np.sort(rng.uniform(0.0, 1.0, count + order))
            for count, order in ((count_u, order_u), (count_v, order_v))
        )
        low, high = np.sort(rng.uniform(knots_u[order_u - 1], knots_u[count_u], 2))
        path = tmp_path / f"{case}.usda"
        _patch(path, control, weights, (knots_u, order_u), (knots_v, order_v), U=(low, high))
        s = rng.uniform(low, high, 300)
        t = rng.uniform(knots_v[order_v - 1], knots_v[count_v], 300)
        rows = np.concatenate((control * weights[:, :, None], weights[:, :, None]), axis=2)
        found = np.array(
            [
                _de_boor(
                    knots_v,
                    order_v,
                    np.array([_de_boor(knots_u, order_u, row, a) for row in rows]),
                    b,
                )
                for a, b in zip(s, t, strict=True)
            ]
        )
        points = found[:, :3] / found[:, 3:]
        scene = _compiled(path, "veryhigh")
        size = float(np.linalg.norm(np.ptp(points, axis=0)))
        # Height fields but for the weights: rays along z find each point among their hits.
        tracer = Tracer(scene.ir, "float64")
        above = points + np.array((0.0, 0.0, 1e-3 * size))
        down = tracer.trace(above, np.tile([0.0, 0.0, -1.0], (300, 1)))
        inner = np.isfinite(down.t)
        assert inner.mean() > 0.97
        assert np.median(np.abs(down.t[inner] - 1e-3 * size)) < 1e-5 * size
        assert (np.abs(down.t[inner] - 1e-3 * size) < 5e-5 * size).mean() > 0.97


def test_knots_of_full_multiplicity_tear_a_patch(tmp_path: Path) -> None:
    control = np.array([[(x, y, 0) for x in (0, 1, 2, 3)] for y in (0, 1)], float)
    path = tmp_path / "stage.usda"
    _patch(path, control, np.ones((2, 4)), ([0, 0, 1, 1, 2, 2], 2), ([0, 0, 1, 1], 2))
    scene = _compiled(path, "low")
    origins = np.array([(x, 0.5, 1.0) for x in (0.5, 1.5, 2.5)])
    hits = Tracer(scene.ir, "float64").trace(origins, np.tile([0.0, 0.0, -1.0], (3, 1)))
    assert np.isfinite(hits.t).tolist() == [True, False, True]


def test_patches_that_do_not_fit_and_trims_are_told(tmp_path: Path) -> None:
    from pxr import Usd, UsdGeom

    path = tmp_path / "stage.usda"
    control = np.array([[(x, y, 0) for x in (0, 1)] for y in (0, 1)], float)
    _patch(path, control, np.ones((2, 2)), ([0, 0, 1, 1], 2), ([0, 0, 1, 1], 2))
    stage = Usd.Stage.Open(str(path))
    trimmed = UsdGeom.NurbsPatch(stage.GetPrimAtPath("/patch"))
    trimmed.CreateTrimCurveCountsAttr([1])
    bad = UsdGeom.NurbsPatch.Define(stage, "/bad")
    bad.CreatePointsAttr([(0, 0, 0)] * 4)
    bad.CreateUVertexCountAttr(2)
    bad.CreateVVertexCountAttr(2)
    bad.CreateUKnotsAttr([0.0, 1.0, 0.0, 1.0])
    bad.CreateVKnotsAttr([0.0, 0.0, 1.0, 1.0])
    bad.CreateUOrderAttr(2)
    bad.CreateVOrderAttr(2)
    stage.Save()
    scene = _compiled(path)
    said = {}
    for warning in scene.warnings:
        assert warning.primary is not None
        assert isinstance(warning.primary.place, PrimPlace)
        said[warning.message] = warning.primary.place.prim
    assert said == {
        "the trim curves of a NurbsPatch are not used": "/patch",
        "a NurbsPatch whose points, orders and knots do not fit draws nothing": "/bad",
    }
    assert len(scene.ir.instance_target) == 1


def test_a_circle_of_nurbs_is_a_torus(tmp_path: Path) -> None:
    from pxr import Usd, UsdGeom, Vt

    path = tmp_path / "stage.usda"
    stage = Usd.Stage.CreateNew(str(path))
    curves = UsdGeom.NurbsCurves.Define(stage, "/c")
    line = np.array([(9, 0, 0), (9, 1, 0), (9, 2, 0)])
    circle = np.column_stack((CIRCLE * 3.0, np.zeros(9)))
    curves.CreatePointsAttr(
        Vt.Vec3fArray.FromNumpy(np.concatenate((circle, line)).astype(np.float32))
    )
    curves.CreatePointWeightsAttr([*WEIGHTS.tolist(), 1.0, 1.0, 1.0])
    curves.CreateCurveVertexCountsAttr([9, 3])
    curves.CreateOrderAttr([3, 2])
    curves.CreateKnotsAttr([*map(float, ARC[0]), 0.0, 0.0, 1.0, 2.0, 2.0])
    curves.CreateWidthsAttr([0.5])
    curves.SetWidthsInterpolation("constant")
    stage.Save()
    scene = _compiled(path)
    assert not scene.warnings
    rng = np.random.default_rng(2)
    angle, tilt = rng.uniform(0.0, 2.0 * np.pi, (2, 2000))
    axis = np.stack((np.cos(angle), np.sin(angle), np.zeros(2000)), axis=1)
    out = np.cos(tilt)[:, None] * axis + np.sin(tilt)[:, None] * (0.0, 0.0, 1.0)
    hits = Tracer(scene.ir, "float64").trace(3.0 * axis + out, -out)
    assert np.abs(hits.t - 0.75).max() < 6e-4  # chords within 0.2 % of the radius, and 5e-6 of 12
    hits = Tracer(scene.ir, "float64").trace([[9.0, 1.3, 5.0]], [[0.0, 0.0, -1.0]])
    assert abs(hits.t[0] - 4.75) < 1e-9


def test_curves_are_what_de_boor_makes_of_them(tmp_path: Path) -> None:
    from pxr import Gf, Usd, UsdGeom, Vt

    rng = np.random.default_rng(3)
    path = tmp_path / "stage.usda"
    stage = Usd.Stage.CreateNew(str(path))
    control, weights, knots, orders, counts, ranges, splines = [], [], [], [], [], [], []
    for place in range(8):
        order = int(rng.integers(2, 6))
        count = order + int(rng.integers(0, 6))
        own = np.column_stack((np.full(count, 10.0 * place), rng.normal(size=(count, 2)) * 2.0))
        own = own.astype(np.float32)
        w = rng.uniform(0.5, 2.0, count)
        own_knots = np.sort(rng.uniform(0.0, 1.0, count + order))
        low, high = np.sort(rng.uniform(own_knots[order - 1], own_knots[count], 2))
        splines.append((own_knots, order, np.column_stack((own * w[:, None], w)), low, high))
        control.append(own)
        weights += w.tolist()
        knots += own_knots.tolist()
        orders.append(order)
        counts.append(count)
        ranges.append(Gf.Vec2d(low, high))
    curves = UsdGeom.NurbsCurves.Define(stage, "/c")
    curves.CreatePointsAttr(Vt.Vec3fArray.FromNumpy(np.concatenate(control)))
    curves.CreatePointWeightsAttr(weights)
    curves.CreateCurveVertexCountsAttr(counts)
    curves.CreateOrderAttr(orders)
    curves.CreateKnotsAttr(knots)
    curves.CreateRangesAttr(ranges)
    curves.CreateWidthsAttr([0.2])
    curves.SetWidthsInterpolation("constant")
    stage.Save()
    scene = _compiled(path)
    assert not scene.warnings
    # Curves lie in planes across x: a ray along x meets the tube one radius before the curve.
    tracer = Tracer(scene.ir, "float64")
    for place, (own_knots, order, rows, low, high) in enumerate(splines):
        found = [_de_boor(own_knots, order, rows, t) for t in rng.uniform(low, high, 200)]
        rows = np.array(found)
        points = rows[:, :3] / rows[:, 3:]
        hits = tracer.trace(points - np.array((1.0, 0.0, 0.0)), np.tile([1.0, 0.0, 0.0], (200, 1)))
        assert np.abs(hits.t - 0.9).max() < 5e-4, place
