"""The interpreter's shapes against their definitions: volumes, rolling balls, and each other."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from math import asin, atan2, hypot, pi, radians, sqrt

import numpy as np
import pytest
from numpy.typing import NDArray

from dsl.scene import SHAPE_PARAMETERS, Mesh, SceneGraph, Shape, ShapeKind
from runtime.reference import ReferenceTracer

FloatArray = NDArray[np.float64]
ALWAYS = np.zeros(1), np.full(1, np.inf)


def shape(kind: str, *parameters: float) -> Shape:
    return Shape(ShapeKind(kind), tuple(float(x) for x in parameters))


def extruded(a0: float, a1: float, chi: int, height: float, b: float) -> float:
    """Volume of a bevelled prism: area, perimeter and Euler number of its core, and its height."""
    h = height - 2 * b
    return (
        h * (a0 + a1 * b + pi * chi * b * b)
        + 2 * a0 * b
        + pi / 2 * a1 * b * b
        + 4 * pi / 3 * chi * b**3
    )


def volume(solid: Shape) -> float:
    p = solid.parameters
    match solid.kind:
        case ShapeKind.SPHERE:
            return 4 / 3 * pi * p[0] ** 3
        case ShapeKind.BOX:
            b = p[6]
            x, y, z = (p[i + 3] - p[i] for i in range(3))
            x, z = x - 2 * b, z - 2 * b
            return extruded(x * z, 2 * (x + z), 1, y, b)
        case ShapeKind.CYLINDER:
            r, y0, y1, b = p
            return extruded(pi * (r - b) ** 2, 2 * pi * (r - b), 1, y1 - y0, b)
        case ShapeKind.RING:
            r0, r1, y0, y1, b = p
            inner, outer = r0 + b, r1 - b
            return extruded(pi * (outer**2 - inner**2), 2 * pi * (outer + inner), 0, y1 - y0, b)
        case ShapeKind.TORUS:
            return 2 * pi**2 * p[0] * p[1] ** 2
        case ShapeKind.CONE:
            r, h, b = p
            slant, gamma = hypot(r, h), atan2(r, h)
            rc = r - b * (r + slant) / h
            hc = rc * h / r
            return (
                pi * rc**2 * hc / 3
                + pi * rc * (rc + hypot(rc, hc)) * b
                + (pi * rc * (pi / 2 + gamma) + pi * hc) * b**2
                + 4 * pi * b**3 / 3
            )
        case ShapeKind.WEDGE:
            r0, r1, y0, y1, phi0, phi1, b = p
            inner, outer, opening = r0 + b, r1 - b, radians(phi1 - phi0)

            def half(rho: float) -> float:
                return opening * rho**2 / 2 - rho**2 * asin(b / rho) - b * sqrt(rho**2 - b**2)

            a1 = 2 * (sqrt(outer**2 - b**2) - sqrt(inner**2 - b**2))
            a1 += (opening - 2 * asin(b / outer)) * outer
            a1 += (opening - 2 * asin(b / inner)) * inner
            return extruded(half(outer) - half(inner), a1, 1, y1 - y0, b)
    raise AssertionError(solid.kind)


def wedge_limit(r0: float, opening: float) -> float:
    s = np.sin(np.radians(min(opening, 180) / 2))
    return float(r0 * s / (1 - s)) if s < 1 else np.inf


SOLIDS = [
    shape("sphere", 1.2),
    shape("box", -1, -0.8, -1.1, 1, 0.9, 1, 0),
    shape("box", -1, -0.8, -1.1, 1, 0.9, 1, 0.3),
    shape("box", -1, -1, -1, 1, 1, 1, 1),
    shape("cylinder", 0.8, -1, 0.7, 0),
    shape("cylinder", 0.8, -1, 0.7, 0.4),
    shape("cylinder", 0.5, -1, 1, 0.5),
    shape("cone", 1, 2, 0),
    shape("cone", 1, 0.4, 0.1),
    shape("cone", 0.6, 2, 0.2),
    shape("torus", 1, 0.4),
    shape("ring", 0.4, 1.1, -0.5, 0.5, 0),
    shape("ring", 0.4, 1.1, -0.5, 0.5, 0.2),
    shape("ring", 0.4, 1.2, -0.4, 0.4, 0.4),
    shape("wedge", 0.4, 1.2, -0.5, 0.5, 20, 110, 0),
    shape("wedge", 0.4, 1.2, -0.5, 0.5, 20, 110, 0.15),
    shape("wedge", 0.2, 1.4, -0.5, 0.5, -30, 30, wedge_limit(0.2, 60)),
    shape("wedge", 0.4, 1.2, -0.5, 0.5, 0, 180, 0.2),
    shape("wedge", 0.4, 1.2, -0.5, 0.5, 300, 590, 0),
    shape("wedge", 0.4, 1.2, -0.5, 0.5, 300, 590, 0.25),
    shape("wedge", 0.4, 1.2, -0.4, 0.4, 10, 355, 0.4),
]


def name(solid: Shape) -> str:
    return f"{solid.kind}{solid.parameters}"


def crossings(
    node: Shape | Mesh, origins: FloatArray, directions: FloatArray
) -> list[tuple[FloatArray, FloatArray]]:
    """All crossings of each ray, in order: t and normal, until no ray finds another."""
    tracer = ReferenceTracer(SceneGraph(node))
    found: list[tuple[FloatArray, FloatArray]] = []
    t = np.zeros(len(origins))
    for _ in range(12):
        t, normal, *_ = tracer.trace(origins, directions, t + 1e-9, np.full(1, np.inf))
        if not np.isfinite(t).any():
            return found
        found.append((t, normal))
    raise AssertionError("more than twelve crossings")


@pytest.mark.parametrize("solid", SOLIDS, ids=name)
@pytest.mark.parametrize("axis", [(0.0, 1.0, 0.0), (1.0, 0.3, 0.2)])
def test_parallel_rays_measure_the_closed_volume(
    solid: Shape, axis: tuple[float, float, float]
) -> None:
    n, extent = 64, 1.8
    steps = (np.arange(n) + 0.5) / n * 2 - 1
    z = np.add.outer(steps, 1j * steps).ravel() * extent * np.exp(0.7j)
    u, v = z.real + 0.0148, z.imag + 0.0084  # a lattice aligned with nothing
    direction = np.array(axis) / np.linalg.norm(axis)
    across = np.linalg.svd(direction[None])[2][1:]
    origins = u[:, None] * across[0] + v[:, None] * across[1] - 5 * direction
    origins[:, 1] += 0.9 if solid.kind is ShapeKind.CONE else 0.0
    directions = np.broadcast_to(direction, origins.shape)
    length = np.zeros(n * n)
    for t, normal in crossings(solid, origins, directions):
        entering = (normal * directions).sum(axis=1) < 0
        length += np.where(np.isfinite(t), np.where(entering, -t, t), 0)
    measured = length.sum() * (2 * extent / n) ** 2
    assert measured == pytest.approx(volume(solid), rel=1e-2)


def plain_depth(solid: Shape) -> Callable[[FloatArray], FloatArray]:
    """Depth below the surface of the solid without its bevel, for points `(n, 3)` inside."""
    q = solid.parameters

    def depth(p: FloatArray) -> FloatArray:
        x, y, z = p.T
        rho = np.hypot(x, z)
        match solid.kind:
            case ShapeKind.BOX:
                return np.minimum(p - q[:3], q[3:6] - p).min(axis=1)  # type: ignore[no-any-return]
            case ShapeKind.CYLINDER:
                return np.min([q[0] - rho, y - q[1], q[2] - y], axis=0)  # type: ignore[no-any-return]
            case ShapeKind.CONE:
                side = (q[0] * (q[1] - y) - q[1] * rho) / hypot(q[0], q[1])
                return np.minimum(side, y)  # type: ignore[no-any-return]
            case ShapeKind.RING:
                return np.min([rho - q[0], q[1] - rho, y - q[2], q[3] - y], axis=0)  # type: ignore[no-any-return]
        walls = [rho - q[0], q[1] - rho, y - q[2], q[3] - y]
        azimuth = np.degrees(np.arctan2(x, z))
        for angle in (azimuth - q[4]) % 360, (q[5] - azimuth) % 360:
            inward = angle % 360
            walls.append(np.where(inward <= 90, rho * np.sin(np.radians(inward)), np.inf))
            walls.append(np.where(inward > q[5] - q[4], -np.inf, np.inf))
        return np.min(walls, axis=0)  # type: ignore[no-any-return]

    return depth


BEVELLED = [s for s in SOLIDS if "bevel" in SHAPE_PARAMETERS[s.kind] and s.parameters[-1] > 0]


@pytest.mark.parametrize("solid", BEVELLED, ids=name)
def test_a_bevelled_solid_is_all_that_a_ball_of_the_bevel_radius_reaches(solid: Shape) -> None:
    rng = np.random.default_rng(7)
    b, depth = solid.parameters[-1], plain_depth(solid)
    origins = rng.normal(size=(300, 3)) * 4
    targets = rng.uniform(-1, 1, (300, 3))
    t, normal, point, *_ = ReferenceTracer(SceneGraph(solid)).trace(
        origins, targets - origins, *ALWAYS
    )
    hit = np.isfinite(t)
    assert hit.sum() > 50
    # The ball behind every point of the surface fits into the plain solid …
    assert depth(point[hit] - b * normal[hit]).min() > b - 1e-12
    # … and no ball that fits reaches out of the surface.
    balls = rng.uniform(-1.5, 2.1, (200_000, 3))
    balls = balls[depth(balls) >= b][:4000]
    if len(balls):
        gap = np.linalg.norm(point[hit][:, None] - balls, axis=2).min(axis=1)
        assert gap.min() > b - 1e-12


@pytest.mark.parametrize("solid", SOLIDS, ids=name)
def test_rays_from_inside_meet_the_same_surface(solid: Shape) -> None:
    rng = np.random.default_rng(11)
    origins = rng.normal(size=(200, 3)) * 4
    directions = rng.uniform(-1, 1, (200, 3)) - origins
    found = crossings(solid, origins, directions)
    assert len(found) >= 2
    tracer = ReferenceTracer(SceneGraph(solid))
    for (t0, normal0), (t1, normal1) in pairwise(found):
        both = np.isfinite(t1) & (t1 > t0 + 1e-6)
        facing = (normal0[both] * directions[both]).sum(axis=1)
        assert np.array_equal(facing > 0, (normal1[both] * directions[both]).sum(axis=1) < 0)
        middle = origins[both] + ((t0[both] + t1[both]) / 2)[:, None] * directions[both]
        ahead = tracer.trace(middle, directions[both], *ALWAYS)
        behind = tracer.trace(middle, -directions[both], *ALWAYS)
        half = (t1[both] - t0[both]) / 2
        np.testing.assert_allclose(ahead[0], half, rtol=0, atol=1e-12)
        np.testing.assert_allclose(behind[0], half, rtol=0, atol=1e-12)
        np.testing.assert_allclose(behind[1], normal0[both], rtol=0, atol=1e-6)


@pytest.mark.parametrize("solid", BEVELLED, ids=name)
def test_a_vanishing_bevel_gives_the_plain_solid(solid: Shape) -> None:
    rng = np.random.default_rng(3)
    origins = rng.normal(size=(500, 3)) * 4
    directions = rng.uniform(-1, 1, (500, 3)) - origins
    plain, thin = (
        ReferenceTracer(SceneGraph(shape(solid.kind, *solid.parameters[:-1], b))).trace(
            origins, directions, *ALWAYS
        )
        for b in (0.0, 1e-9)
    )
    same = np.isclose(plain[0], thin[0], rtol=0, atol=1e-15)
    assert same.mean() > 0.99
    np.testing.assert_allclose(plain[1][same], thin[1][same], rtol=0, atol=1e-6)


def test_grazing_rays_are_decided_within_rounding() -> None:
    height = np.array([1e-15, 1e-12, 1e-9, 1e-6])
    for solid, edge in (
        (shape("sphere", 1), 1.0),
        (shape("torus", 1, 0.25), 1.25),
        (shape("cylinder", 1, -1, 1, 0.5), 1.0),
        (shape("wedge", 0.5, 1, -1, 1, 40, 320, 0.2), 1.0),
        (shape("ring", 0.5, 1, -1, 1, 0.2), 1.0),
    ):
        tracer = ReferenceTracer(SceneGraph(solid), number="longdouble")
        for sign in (-1, 1):
            origins = np.stack([0 * height - 3, 0 * height, -(edge + sign * height)], axis=1)
            hits = tracer.trace(origins, np.tile([1.0, 0, 0], (4, 1)), *ALWAYS)
            assert np.array_equal(hits[3] == 0, np.full(4, sign < 0)) or solid.kind == "wedge"
            if solid.kind == "wedge":  # seen through its gap: the wall starts left and right of it
                assert np.isfinite(hits[0]).all() == (sign < 0)


def test_mesh_is_watertight_and_equals_the_box() -> None:
    corners = np.array([[x, y, z] for x in (-1.0, 1) for y in (-1.0, 1) for z in (-1.0, 1)])
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    triangles = np.array([t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))])
    mesh, box = Mesh(corners, triangles), shape("box", -1, -1, -1, 1, 1, 1, 0)
    rng = np.random.default_rng(5)
    ends = corners[triangles[rng.integers(12, size=600)]]
    edge = np.arange(600) % 3
    start, end = ends[np.arange(600), edge], ends[np.arange(600), (edge + 1) % 3]
    share = rng.choice([0.0, 0.25, 0.5, rng.uniform()], (600, 1))
    origins = rng.uniform(-0.5, 0.5, (600, 3))
    directions = start + share * (end - start) - origins
    outwards = ReferenceTracer(SceneGraph(mesh)).trace(origins, directions, *ALWAYS)
    np.testing.assert_allclose(outwards[0], 1, rtol=1e-14)

    origins = rng.normal(size=(600, 3)) * 5
    directions = rng.uniform(-1, 1, (600, 3)) - origins
    ours, theirs = (
        ReferenceTracer(SceneGraph(node)).trace(origins, directions, *ALWAYS)
        for node in (mesh, box)
    )
    np.testing.assert_allclose(ours[0], theirs[0], rtol=1e-13)
    np.testing.assert_allclose(ours[1], theirs[1], atol=1e-15)


@pytest.mark.parametrize("size", [1e-30, 1e30])
@pytest.mark.parametrize("solid", SOLIDS, ids=name)
def test_the_size_of_a_shape_does_not_matter(solid: Shape, size: float) -> None:
    size = 2.0 ** round(np.log2(size))
    angles = ("phi0", "phi1")
    scaled = shape(
        solid.kind,
        *(
            x if parameter in angles else x * size
            for parameter, x in zip(SHAPE_PARAMETERS[solid.kind], solid.parameters, strict=True)
        ),
    )
    rng = np.random.default_rng(3)
    origins = rng.normal(size=(60, 3)) * 4
    directions = rng.uniform(-1, 1, (60, 3)) - origins
    one = ReferenceTracer(SceneGraph(solid)).trace(origins, directions, *ALWAYS)
    other = ReferenceTracer(SceneGraph(scaled)).trace(origins * size, directions * size, *ALWAYS)
    np.testing.assert_allclose(other[0], one[0], rtol=1e-14)
    np.testing.assert_allclose(other[1], one[1], atol=1e-13)
