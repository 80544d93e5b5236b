"""Triangulation: every polygon is covered once, in its own winding."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from compiler.usd.polygons import triangulate, usable_faces


def vector_area(corners: np.ndarray) -> np.ndarray:
    """Of a closed polygon (Newell), halved."""
    around = np.cross(corners, np.roll(corners, -1, axis=0)).sum(axis=0)
    return np.asarray(around / 2.0)


def triangle_areas(points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    a, b, c = (points[triangles[:, i]] for i in range(3))
    return np.asarray(np.cross(b - a, c - a) / 2.0)


@settings(max_examples=60)
@given(
    st.lists(st.floats(0.05, 1.0), min_size=3, max_size=14),
    st.tuples(*[st.floats(-1.0, 1.0)] * 3).filter(lambda v: np.linalg.norm(v) > 0.1),
    st.sampled_from([1e-20, 1.0, 1e20]),
    st.booleans(),
)
def test_star_polygons_in_any_plane_are_covered_once(
    radii: list[float], normal: tuple[float, ...], size: float, flip: bool
) -> None:
    w = np.array(normal) / np.linalg.norm(normal)
    u = np.cross(w, np.eye(3)[np.argmin(np.abs(w))])
    u /= np.linalg.norm(u)
    angles = np.arange(len(radii)) * 2.0 * math.pi / len(radii)
    flat = np.array(radii)[:, None] * np.stack((np.cos(angles), np.sin(angles)), axis=1)
    points = size * (flat[:, :1] * u + flat[:, 1:] * np.cross(w, u))
    indices = np.arange(len(radii))[:: -1 if flip else 1]

    found = triangulate(points, np.array([len(radii)]), indices)

    areas = triangle_areas(points / size, indices[found.corners])
    whole = vector_area(points[indices] / size)
    np.testing.assert_allclose(areas.sum(axis=0), whole, atol=1e-12)
    # Nothing is covered twice: all parts face the way of the whole.
    assert np.linalg.norm(areas, axis=1).sum() == pytest.approx(np.linalg.norm(whole), rel=1e-9)


def test_concave_quadrilaterals_are_split_at_the_reflex_corner() -> None:
    arrow = np.array([(0, 0, 0), (2, 1, 0), (0, 2, 0), (0.5, 1, 0)], dtype=float)
    for turn in range(4):
        order = np.roll(np.arange(4), turn)
        found = triangulate(arrow, np.array([4]), order)
        areas = triangle_areas(arrow, order[found.corners])
        assert (areas[:, 2] > 0).all()
        assert areas[:, 2].sum() == pytest.approx(1.5)


def test_faces_of_all_sizes_keep_their_order() -> None:
    ring = np.stack((np.cos(np.arange(8)), np.sin(np.arange(8)), np.zeros(8)), axis=1)
    counts = np.array([3, 5, 3, 4, 5])
    indices = np.concatenate([np.arange(count) for count in counts])
    found = triangulate(ring, counts, indices)
    assert found.rows.tolist() == [0, 1, 1, 1, 2, 3, 3, 4, 4, 4]


def test_faulty_faces_are_dropped_and_counted() -> None:
    points = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (np.nan, 0, 0), (0, -1e200, 0)])
    counts = np.array([3, 2, 3, 3, -1, 3, 3, 3])
    indices = np.array([0, 1, 2, 0, 1, 0, 1, 9, 0, 1, 3, 2, 1, 0, 0, 1, 4, 0])
    found = usable_faces(points, counts, indices)
    assert found.corners.tolist() == [0, 1, 2, 2, 1, 0]
    assert found.faces.tolist() == [0, 5]
    assert found.counts.tolist() == [3, 3]
    assert found.dropped == {
        "of fewer than 3 corners": 2,
        "with indices out of range": 1,
        "with points that are not finite": 2,
        "that run beyond the list of indices": 1,
    }


def test_degenerate_polygons_do_no_harm() -> None:
    points = np.zeros((6, 3))
    found = triangulate(points, np.array([4, 6]), np.array([0, 0, 0, 0, 0, 1, 2, 3, 4, 5]))
    assert found.corners.max() < 10
    line = np.stack((np.arange(6.0), np.zeros(6), np.zeros(6)), axis=1)
    triangulate(line, np.array([6]), np.arange(6))
    bow = np.array([(0, 0, 0), (1, 1, 0), (1, 0, 0), (0, 1, 0)], dtype=float)
    assert len(triangulate(bow, np.array([4]), np.arange(4)).corners) == 2


def test_repeated_corners_are_taken_out() -> None:
    points = np.arange(15.0).reshape(5, 3)
    counts = np.array([4, 3, 5, 3])
    indices = np.array([0, 1, 1, 2, 3, 3, 3, 4, 0, 1, 2, 4, 0, 1, 0])
    found = usable_faces(points, counts, indices).distinct()
    assert found.counts.tolist() == [3, 4]
    assert found.corners.tolist() == [0, 1, 2, 4, 0, 1, 2]
    assert found.faces.tolist() == [0, 2]
    assert found.dropped == {"of fewer than 3 corners": 2}
