"""Geometric primitives: the analytic shapes lie where the schema says."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from dsl.scene import Shape, ShapeKind

TURNS = {"X": [1, 2, 0], "Y": [2, 0, 1], "Z": [0, 1, 2]}
"""Where (first, second, axis) coordinates of a solid of revolution stand in (x, y, z)."""


def surface(type_name: str, radius: float, height: float) -> np.ndarray:
    """Points (u, v, w) of the surface about the axis w, by the schema's own words."""
    random = np.random.default_rng(1)
    angle = random.uniform(0.0, 2.0 * math.pi, 200)
    along = random.uniform(-height / 2, height / 2, 200)
    if type_name == "Cone":
        reach = radius * (height / 2 - along) / height
    elif type_name == "Capsule":
        along = random.uniform(-height / 2 - radius, height / 2 + radius, 200)
        beyond = np.maximum(np.abs(along) - height / 2, 0.0)
        reach = np.sqrt(radius**2 - beyond**2)
    else:
        reach = np.full(200, radius)
    return np.stack((reach * np.cos(angle), reach * np.sin(angle), along), axis=1)


def distance(shape: Shape, points: np.ndarray) -> np.ndarray:
    """Signed distance (or what has its zeros) of our shapes, from their definitions."""
    x, y, z = points.T
    rho = np.hypot(x, z)
    values = dict(zip(("a", "b", "c", "d"), shape.parameters, strict=False))
    if shape.kind is ShapeKind.CYLINDER:
        radius, y0, y1, bevel = shape.parameters
        over = np.maximum(rho - (radius - bevel), 0.0)
        up = np.maximum(np.maximum(y - (y1 - bevel), (y0 + bevel) - y), 0.0)
        return np.asarray(np.hypot(over, up) - bevel if bevel else rho - radius)
    if shape.kind is ShapeKind.CONE:
        return np.asarray(rho - values["a"] * (values["b"] - y) / values["b"])
    assert shape.kind is ShapeKind.SPHERE
    return np.asarray(np.linalg.norm(points, axis=1) - values["a"])


@pytest.mark.parametrize("axis", ["X", "Y", "Z", None])
@pytest.mark.parametrize(
    ("type_name", "radius", "height"),
    [("Cylinder", 0.7, 3.0), ("Cone", 1.5, 0.5), ("Capsule", 0.25, 2.0), ("Capsule", 0.5, 0.0)],
)
def test_solids_of_revolution_stand_on_their_axis(
    load: Callable[..., Any], type_name: str, radius: float, height: float, axis: str | None
) -> None:
    said = f'uniform token axis = "{axis}"' if axis else ""
    (leaf,) = load(f"""
def {type_name} "p" {{
    double radius = {radius}
    double height = {height}
    {said}
}}
""").leaves
    points = np.empty((200, 3))
    points[:, TURNS[axis or "Z"]] = surface(type_name, radius, height)
    local = (points - leaf.world[:3, 3]) @ np.linalg.inv(leaf.world[:3, :3]).T
    assert np.linalg.det(leaf.world[:3, :3]) == pytest.approx(1.0)
    np.testing.assert_allclose(distance(leaf.node, local), 0.0, atol=1e-12)


def test_cubes_and_spheres_are_centred(load: Callable[..., Any]) -> None:
    imported = load("""
def Cube "c" {
    double size = 3
}
def Cube "fallback" {
}
def Sphere "s" {
    double radius = 2.5
}
""")
    assert imported.leaf("/c").node.parameters == (-1.5,) * 3 + (1.5,) * 3 + (0.0,)
    assert imported.leaf("/fallback").node.parameters[3] == 1.0
    assert imported.leaf("/s").node.parameters == (2.5,)


@pytest.mark.parametrize(("axis", "extent"), [("X", (0, 6, 4)), ("Y", (4, 0, 6)), ("Z", (4, 6, 0))])
def test_planes_have_their_width_and_length_where_the_schema_says(
    load: Callable[..., Any], axis: str, extent: tuple[float, ...]
) -> None:
    (leaf,) = load(f"""
def Plane "p" {{
    double width = 4
    double length = 6
    uniform token axis = "{axis}"
}}
""").leaves
    width, length = leaf.node.parameters
    corners = np.array([(width / 2, 0, length / 2), (-width / 2, 0, -length / 2)])
    world = corners @ leaf.world[:3, :3].T
    np.testing.assert_allclose(np.ptp(world, axis=0), extent, atol=1e-15)
    normal = leaf.world[:3, :3] @ (0, 1, 0)
    np.testing.assert_allclose(normal, np.eye(3)["XYZ".index(axis)], atol=1e-15)


def test_second_versions_with_one_radius_are_the_first(load: Callable[..., Any]) -> None:
    imported = load("""
def Cylinder_1 "tube" {
}
def Cylinder_1 "cone" {
    double radiusTop = 0
    double radiusBottom = 2
}
def Cylinder_1 "funnel" {
    double radiusBottom = 0
    double height = 4
}
def Capsule_1 "pill" {
}
""")
    assert imported.paths() == ["/tube", "/cone", "/funnel", "/pill"]
    tip = imported.leaf("/funnel").world @ (0, 4, 0, 1)
    np.testing.assert_allclose(tip, (0, 0, -2, 1), atol=1e-15)
    tip = imported.leaf("/cone").world @ (0, 2, 0, 1)
    np.testing.assert_allclose(tip, (0, 0, 1, 1), atol=1e-15)


def test_a_height_below_zero_turns_solids_over(load: Callable[..., Any]) -> None:
    imported = load("""
def Cone "cone" {
    double height = -3
}
def Cylinder_1 "funnel" {
    double radiusTop = 0
    double height = -4
}
def Capsule_1 "pill" {
    double radiusTop = 0.25
    double height = -1
}
def Capsule_1 "same" {
    double radiusBottom = 0.25
    double height = 1
}
""")
    tip = imported.leaf("/cone").world @ (0, 3, 0, 1)
    np.testing.assert_allclose(tip, (0, 0, -1.5, 1), atol=1e-15)
    tip = imported.leaf("/funnel").world @ (0, 4, 0, 1)
    np.testing.assert_allclose(tip, (0, 0, -2, 1), atol=1e-15)
    assert imported.leaf("/pill").node is imported.leaf("/same").node


def test_equal_prims_share_one_shape(load: Callable[..., Any]) -> None:
    cubes = "".join(f'def Cube "c{i}" {{\n}}\n' for i in range(5))
    assert len({id(leaf.node) for leaf in load(cubes).leaves}) == 1


@pytest.mark.parametrize(
    "text",
    ['def Cube "p" {\ndouble size = 0\n}', 'def Sphere "p" {\ndouble radius = 0\n}',
     'def Cone "p" {\ndouble height = 0\n}', 'def Capsule "p" {\ndouble radius = 0\n}',
     'def Plane "p" {\ndouble width = 0\n}'],
)  # fmt: skip
def test_what_has_no_size_is_reported(load: Callable[..., Any], text: str) -> None:
    imported = load(text)
    assert imported.leaves == []
    assert imported.said("zero draws nothing").primary.place.prim == "/p"


@pytest.mark.parametrize(
    "text",
    ['def Sphere "p" {\ndouble radius = 1e308\n}', 'def Cone "p" {\ndouble height = 1e-320\n}',
     'def Capsule_1 "p" {\ndouble radiusTop = 1e308\n}'],
)  # fmt: skip
def test_what_cannot_be_measured_is_reported(load: Callable[..., Any], text: str) -> None:
    imported = load(text)
    assert imported.leaves == []
    assert imported.said("draws nothing").primary.place.prim == "/p"


@pytest.mark.parametrize("size", ["major = 1e200", "minor = 1e-200"])
def test_what_the_language_cannot_measure_is_its_error(load: Callable[..., Any], size: str) -> None:
    imported = load(f'def OvoloTorus "p" {{\ndouble {size}\n}}')
    assert imported.leaves == []
    assert imported.said("1e").code == "value-out-of-range"


@pytest.mark.parametrize("value", ["double radius = nan", 'token radius = "big"'])
def test_sizes_that_are_no_numbers_are_the_fallback(load: Callable[..., Any], value: str) -> None:
    imported = load(f'def Sphere "s" {{\n{value}\n}}')
    assert imported.leaf("/s").node.parameters == (1.0,)
    assert imported.said("no finite number").code == "usd-attribute"
