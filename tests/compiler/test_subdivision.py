"""Subdivision surfaces against closed forms, B-splines, and one another."""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from compiler.subdivision import INFINITE, Cage, Creases, Surface, cage, limit_surface

SIGNS = np.array(list(itertools.product((-0.5, 0.5), repeat=3)))
CUBE = np.array([0, 1, 3, 2, 4, 6, 7, 5, 0, 4, 5, 1, 2, 3, 7, 6, 0, 2, 6, 4, 1, 5, 7, 3])
OCTAHEDRON = np.concatenate((np.eye(3), -np.eye(3)))
OCTANTS = np.array([0, 1, 2, 1, 3, 2, 3, 4, 2, 4, 0, 2, 1, 0, 5, 3, 1, 5, 4, 3, 5, 0, 4, 5])


def grid(size: int) -> np.ndarray:
    """Corners of the quadrilaterals of a grid of `size` × `size` points, row by row."""
    number = np.arange(size * size).reshape(size, size)
    quads = (number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:])
    return np.stack(quads, axis=-1).reshape(-1)


def flat(size: int) -> np.ndarray:
    x, y = np.meshgrid(np.arange(size), np.arange(size), indexing="ij")
    return np.stack((x, y, 0 * x), axis=-1).reshape(-1, 3).astype(float)


def sharp(edges: Any = (), values: Any = (), points: Any = (), point_values: Any = ()) -> Creases:
    pairs = np.array(edges, dtype=np.int64).reshape(-1, 2)
    return Creases(
        pairs,
        np.array(values, dtype=float),
        np.array(points, dtype=np.int64),
        np.array(point_values, dtype=float),
    )


def limit(
    points: np.ndarray, corners: np.ndarray, level: int, sides: int = 4, **choices: Any
) -> Surface:
    scheme = choices.pop("scheme", "catmullClark")
    counts = np.full(len(corners) // sides, sides)
    return limit_surface(cage(len(points), counts, corners, **choices), points, scheme, level)


def area(surface: Surface) -> float:
    """Of quadrilaterals or triangles that are nearly flat."""
    corners = surface.points[surface.corners.reshape(len(surface.counts), -1)]
    across = np.cross(corners[:, 2] - corners[:, 0], corners[:, -1] - corners[:, 1])
    if corners.shape[1] == 3:
        across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    return float(np.linalg.norm(across, axis=1).sum() / 2.0)


@pytest.mark.parametrize("level", range(5))
def test_the_corners_of_a_cube_end_halfway(level: int) -> None:
    # n = 3: (9 v + 4 Σ edges + Σ diagonals) / 24, in each coordinate of a corner at 1/2:
    # (9/2 + 4 (1/2 + 1/2 - 1/2) + (1/2 - 1/2 - 1/2)) / 24 = 1/4.
    surface = limit(SIGNS, CUBE, level)
    np.testing.assert_allclose(surface.points[:8], SIGNS / 2.0, atol=1e-15)
    assert len(surface.counts) == 6 * 4**level


def test_a_cube_becomes_rounder_and_smaller() -> None:
    surface = limit(SIGNS, CUBE, 4)
    radii = np.linalg.norm(surface.points, axis=1)
    assert np.abs(surface.points).max() < 0.42
    # From 1 : √3 for the cube itself.
    assert radii.max() / radii.min() < 1.1
    assert area(surface) < 0.5 * 6.0
    # The middle of a face by the closed form for its first refinement: face point 1/2, edge
    # points 3/8, corners of the face 5/18 and its neighbours' none: (16 · 1/2 + 4 · 4 · 3/8 +
    # 4 · 5/18) / 36.
    assert np.abs(surface.points).max() == pytest.approx((8.0 + 6.0 + 4 * 5 / 18) / 36.0)


@pytest.mark.parametrize("boundary", ["edgeAndCorner", "edgeOnly"])
@pytest.mark.parametrize("level", [0, 1, 3])
def test_flat_grids_stay_flat_and_in_place(boundary: Any, level: int) -> None:
    points = flat(5)
    surface = limit(points, grid(5), level, boundary=boundary)
    assert np.abs(surface.points[:, 2]).max() == 0.0
    inner = ((points[:, :2] > 0) & (points[:, :2] < 4)).all(axis=1)
    np.testing.assert_allclose(surface.points[:25][inner], points[inner], atol=1e-13)
    corner = surface.points[0, :2]
    rounded = {"edgeAndCorner": 0.0, "edgeOnly": 1.0 / 6.0}[boundary]
    np.testing.assert_allclose(corner, rounded, atol=1e-15)
    if boundary == "edgeAndCorner":
        assert area(surface) == pytest.approx(16.0, rel=1e-12)
    middles = surface.points[surface.corners.reshape(-1, 4)].mean(axis=1)
    if boundary == "edgeAndCorner":
        assert (np.floor(middles[:, 0]) * 4 + np.floor(middles[:, 1]) == surface.faces).all()


def test_regular_patches_are_bicubic_b_splines() -> None:
    points = np.random.default_rng(1).normal(size=(25, 3))
    surface = limit(points, grid(5), 3)
    t = np.linspace(0.0, 1.0, 9)
    basis = (
        np.stack(
            ((1 - t) ** 3, 3 * t**3 - 6 * t**2 + 4, -3 * t**3 + 3 * t**2 + 3 * t + 1, t**3), axis=1
        )
        / 6.0
    )
    control = points.reshape(5, 5, 3)
    for i, j in itertools.product(range(2), repeat=2):
        patch = np.einsum("ai,bj,ijk->abk", basis, basis, control[i : i + 4, j : j + 4])
        apart = np.linalg.norm(patch.reshape(-1, 1, 3) - surface.points, axis=2)
        assert apart.min(axis=1).max() < 1e-13


@pytest.mark.parametrize("level", [1, 3])
def test_creases_and_boundaries_are_cubic_b_splines_of_their_own(level: int) -> None:
    points = np.random.default_rng(2).normal(size=(25, 3))
    line = [10, 11, 12, 13, 14]
    creases = sharp(list(itertools.pairwise(line)), [INFINITE] * 4)
    surface = limit(points, grid(5), level, creases=creases)
    for row in (0, 10):
        before, at, after = (
            points[row : row + 3],
            points[row + 1 : row + 4],
            points[row + 2 : row + 5],
        )
        expected = (before + 4.0 * at + after) / 6.0
        np.testing.assert_allclose(surface.points[row + 1 : row + 4], expected, atol=1e-14)
    np.testing.assert_allclose(surface.points[[0, 4, 20, 24]], points[[0, 4, 20, 24]])


def shapes() -> st.SearchStrategy[tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """Counts, corners and random points of a few kinds of cages."""
    pyramid = [3, 3, 3, 3, 4], [0, 1, 4, 1, 2, 4, 2, 3, 4, 3, 0, 4, 3, 2, 1, 0]
    prism = [5, 5, 4, 4, 4, 4, 4], [4, 3, 2, 1, 0, 5, 6, 7, 8, 9, 0, 1, 6, 5, 1, 2, 7, 6,
                                    2, 3, 8, 7, 3, 4, 9, 8, 4, 0, 5, 9]  # fmt: skip
    sheet = [4] * 4 + [3, 5], [*grid(3), 2, 9, 5, 5, 9, 10, 11, 8]
    found = st.sampled_from([pyramid, prism, sheet, ([4] * 6, CUBE.tolist())])
    return st.tuples(found, st.integers(0, 10**6)).map(
        lambda drawn: (
            np.array(drawn[0][0]),
            np.array(drawn[0][1]),
            np.random.default_rng(drawn[1]).normal(size=(max(drawn[0][1]) + 1, 3)),
        )
    )


def darts(made: Cage, count: int) -> np.ndarray:
    """Where a crease ends within a surface: the limit is taken by the smooth rule, nearly."""
    ends = made.topology.edges[np.isinf(made.edge_sharpness)]
    found = np.bincount(ends.ravel(), minlength=count) == 1
    found[: len(made.point_sharpness)] &= ~np.isinf(made.point_sharpness)
    return np.asarray(found)


@settings(max_examples=25)
@given(shapes(), st.data())
def test_every_refinement_ends_at_the_same_points(shape: Any, data: Any) -> None:
    """The limit rules undo the rules of refinement, whatever is sharp and for how long."""
    counts, corners, points = shape
    amounts = st.one_of(st.just(0.0), st.floats(0.0, 3.5), st.just(INFINITE))
    edges = np.stack((corners[:-1], corners[1:]), axis=1)
    some = st.lists(amounts, min_size=len(edges), max_size=len(edges))
    at_points = st.lists(amounts, min_size=len(points), max_size=len(points))
    creases = sharp(edges, data.draw(some), np.arange(len(points)), data.draw(at_points))
    boundary = data.draw(st.sampled_from(["edgeOnly", "edgeAndCorner"]))
    made = cage(len(points), counts, corners, boundary=boundary, creases=creases)
    one, four = (limit_surface(made, points, "catmullClark", level) for level in (1, 4))
    exact = ~darts(made, len(one.points))
    np.testing.assert_allclose(one.points[exact], four.points[: len(one.points)][exact], atol=1e-12)


@settings(max_examples=25)
@given(shapes(), st.integers(0, 10**6))
def test_surfaces_move_with_their_cages(shape: Any, seed: int) -> None:
    counts, corners, points = shape
    random = np.random.default_rng(seed)
    linear, offset = random.normal(size=(3, 3)), 10.0 * random.normal(size=3)
    made = cage(len(points), counts, corners, creases=sharp([corners[:2]], [1.5], [0], [0.5]))
    for scheme in ("catmullClark", "bilinear"):
        surface = limit_surface(made, points, scheme, 2)
        moved = limit_surface(made, points @ linear + offset, scheme, 2)
        np.testing.assert_allclose(moved.points, surface.points @ linear + offset, atol=1e-12)


def test_sharpness_grows_from_smooth_to_sharp() -> None:
    edge = [[0, 1]]
    ends = [
        limit(SIGNS, CUBE, 6, creases=sharp(edge * 1, [s])).points[0] for s in (0, 1e-9, 0.5, 1, 5)
    ]
    np.testing.assert_allclose(ends[0], ends[1], atol=1e-8)
    # One sharp edge makes a dart at each of its ends, and darts are smooth.
    middles = [
        limit(SIGNS, CUBE, 6, creases=sharp(edge, [s])).points for s in (0.0, 0.5, 1.0, 2.0, 5.0)
    ]
    reach = [np.linalg.norm(points[:, :2], axis=1).max() for points in middles]
    assert reach == sorted(reach)
    assert reach[0] < 0.53 < 0.59 < reach[-1]


def test_corners_stay_and_all_edges_sharp_make_the_cube_itself() -> None:
    pinned = limit(SIGNS, CUBE, 3, creases=sharp(points=[7], point_values=[INFINITE]))
    np.testing.assert_array_equal(pinned.points[7], SIGNS[7])
    pairs = np.stack((CUBE.reshape(-1, 4), np.roll(CUBE.reshape(-1, 4), -1, axis=1)), axis=-1)
    box = limit(SIGNS, CUBE, 3, creases=sharp(pairs, np.full(24, 12.0)))
    np.testing.assert_array_equal(np.abs(box.points).max(axis=1), 0.5)
    assert area(box) == pytest.approx(6.0, rel=1e-14)


def test_faces_at_an_open_boundary_are_hidden() -> None:
    surface = limit(flat(5), grid(5), 2, boundary="none")
    assert set(surface.faces.tolist()) == {5, 6, 9, 10}
    assert len(surface.counts) == 4 * 16
    drawn = surface.points[surface.corners]
    np.testing.assert_allclose([drawn.min(), drawn[:, :2].max()], [0.0, 3.0], atol=1e-13)
    assert drawn[:, :2].min() == pytest.approx(1.0)


def test_edges_of_three_faces_stay_where_they_are() -> None:
    points = np.array([(0, 0, 0), (0, 0, 1), *itertools.product((1, -1, 0), (0,), (0, 1))], float)
    points[6:, 1] = 1.0
    corners = np.array([0, 2, 3, 1, 0, 4, 5, 1, 0, 6, 7, 1])
    surface = limit(points, corners, 3)
    np.testing.assert_array_equal(surface.points[:2], points[:2])
    assert np.isfinite(surface.points).all()


def test_faces_at_a_boundary_that_is_sharp_by_choice_are_not_hidden() -> None:
    around = [0, 1, 2, 3, 4, 9, 14, 19, 24, 23, 22, 21, 20, 15, 10, 5, 0]
    creases = sharp(list(itertools.pairwise(around)), [INFINITE] * 16)
    surface = limit(flat(5), grid(5), 1, boundary="none", creases=creases)
    assert len(surface.counts) == 16 * 4


def test_a_line_where_three_sheets_meet_is_a_crease() -> None:
    random = np.random.default_rng(3)
    line, count = np.arange(5), 5
    points = random.normal(size=(20, 3))
    sheets = [np.stack((line[:-1], line[1:], line[1:] + count * k, line[:-1] + count * k), axis=1)
              for k in (1, 2, 3)]  # fmt: skip
    sheets[1] = sheets[1][:, ::-1]
    surface = limit(points, np.concatenate(sheets).ravel(), 2)
    np.testing.assert_array_equal(surface.points[[0, 4]], points[[0, 4]])
    spline = (points[:3] + 4.0 * points[1:4] + points[2:5]) / 6.0
    np.testing.assert_allclose(surface.points[1:4], spline, atol=1e-14)


def test_points_where_faces_meet_that_share_no_edge_stay() -> None:
    # Two closed bodies at one point, and a face that touches a third one.
    second = np.where(CUBE == 0, 7, CUBE + 7)
    points = np.concatenate((SIGNS, SIGNS[1:] + 1.0, [(3.0, 1.0, 0.0), (3.0, 2.0, 1.0)]))
    counts = np.array([4] * 12 + [3])
    corners = np.concatenate((CUBE, second, [14, 15, 16]))
    surface = limit_surface(cage(len(points), counts, corners), points, "catmullClark", 2)
    stays = (surface.points[: len(points)] == points).all(axis=1)
    assert np.flatnonzero(stays).tolist() == [7, 14, 15, 16]


def test_faces_that_turn_the_other_way_are_cut_off_by_sharp_edges() -> None:
    corners = grid(5).reshape(-1, 4).copy()
    corners[5] = corners[5, ::-1]
    points = np.random.default_rng(4).normal(size=(25, 3))
    surface = limit(points, corners.ravel(), 2)
    np.testing.assert_array_equal(surface.points[corners[5]], points[corners[5]])
    assert (surface.points[18] != points[18]).all()


def test_bilinear_faces_are_saddles() -> None:
    points = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 1), (0, 1, 0)], dtype=float)
    found = limit(points, np.arange(4), 4, scheme="bilinear", boundary="edgeOnly").points
    np.testing.assert_allclose(found[:, 2], found[:, 0] * found[:, 1], atol=1e-15)
    assert len(found) == 17 * 17


@pytest.mark.parametrize("level", [0, 1, 4])
def test_loop_points_end_where_the_closed_form_has_them(level: int) -> None:
    surface = limit(OCTAHEDRON, OCTANTS, level, sides=3, scheme="loop")
    # n = 4: β = (5/8 - (3/8)²) / 4 = 31/256; of neighbours that cancel, 1 / (4 + 3/(8 β)) each.
    kept = 1.0 - 4.0 / (4.0 + 3.0 / (8.0 * 31.0 / 256.0))
    np.testing.assert_allclose(surface.points[:6], kept * OCTAHEDRON, atol=1e-15)
    assert len(surface.counts) == 8 * 4**level


def test_loop_refinements_end_at_the_same_points() -> None:
    points = np.random.default_rng(3).normal(size=(6, 3))
    open_faces = OCTANTS[:18]
    creases = sharp([[0, 1], [1, 2], [2, 3]], [1.25, INFINITE, 0.5], [4], [1.5])
    made = cage(6, np.full(6, 3), open_faces, creases=creases)
    two, four = (limit_surface(made, points, "loop", level) for level in (2, 4))
    exact = ~darts(made, len(two.points))
    assert exact.sum() == len(exact) - 2
    np.testing.assert_allclose(two.points[exact], four.points[: len(two.points)][exact], atol=1e-13)


def test_loop_keeps_flat_sheets() -> None:
    points = flat(4) @ np.array([(1, 0, 0), (0.5, 0.8, 0), (0, 0, 1)])
    quads = grid(4).reshape(-1, 4)
    corners = np.concatenate((quads[:, [0, 1, 3]], quads[:, [1, 2, 3]])).ravel()
    pinned = sharp(points=[0, 3, 12, 15], point_values=[INFINITE] * 4)
    surface = limit(points, corners, 3, sides=3, scheme="loop", creases=pinned)
    assert np.abs(surface.points[:, 2]).max() == 0.0
    assert area(surface) == pytest.approx(9 * 0.8, rel=1e-12)
    np.testing.assert_allclose(surface.points[[5, 6, 9, 10]], points[[5, 6, 9, 10]], atol=1e-14)


def test_points_of_no_face_do_no_harm() -> None:
    points = np.concatenate((SIGNS, [[np.nan, np.inf, 0.0]]))
    surface = limit(points, CUBE, 2)
    assert np.isfinite(surface.points).all()
    assert surface.corners.max() < len(surface.points)
    assert 8 not in surface.corners


def test_the_rule_for_triangles_makes_a_cone_of_them_rounder() -> None:
    points = np.array([(1, 1, 0), (-1, 1, 0), (-1, -1, 0), (1, -1, 0), (0, 0, 1.5)])
    counts = np.array([3, 3, 3, 3, 4])
    corners = np.array([0, 1, 4, 1, 2, 4, 2, 3, 4, 3, 0, 4, 3, 2, 1, 0])
    made = cage(5, counts, corners)
    plain, smooth = (
        limit_surface(made, points, "catmullClark", 3, smooth_triangles=flag)
        for flag in (False, True)
    )
    assert not np.allclose(plain.points, smooth.points, atol=1e-3)
    np.testing.assert_allclose(smooth.points[4, :2], 0.0, atol=1e-15)
