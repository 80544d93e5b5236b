"""Shapes and meshes as prims."""

from __future__ import annotations

from typing import Any

import numpy as np
from pxr import Gf, Vt

from compiler.usd.schema import EXACT_POINTS, SOLIDS, type_name
from compiler.usd_export.fallback import polygons
from compiler.usd_export.layer import apply_schema, attribute
from compiler.usd_export.textures import write_primvar
from dsl.scene import FloatArray, Mesh, Shape, ShapeKind, Step, StepKind

Leaf = Shape | Mesh


def is_heavy(leaf: Leaf) -> bool:
    """Whether a leaf has points, which are better written once."""
    return not isinstance(leaf, Shape) or _native_type(leaf) is None


def leaf_name(leaf: Leaf) -> str:
    """What a leaf is called that the program gives no name."""
    return leaf.kind.value if isinstance(leaf, Shape) else "mesh"


def inner_steps(leaf: Leaf) -> tuple[Step, ...]:
    """Steps from the leaf's space to that of its prim: USD centres its cones."""
    if isinstance(leaf, Shape) and _native_type(leaf) == "Cone":
        return (Step(StepKind.TRANSLATE, np.array([0.0, leaf.parameters[1] / 2.0, 0.0])),)
    return ()


def write_leaf(prim: Any, leaf: Leaf, tolerance: float | None) -> None:
    """Make a prim that shape or mesh."""
    if isinstance(leaf, Mesh):
        prim.typeName = "Mesh"
        _write_points(prim, leaf.points, np.full(len(leaf.triangles), 3), leaf.triangles)
        for given in leaf.attributes:
            write_primvar(prim, given)
        return
    native = _native_type(leaf)
    if native is not None:
        prim.typeName = native
        _write_native(prim, native, leaf.parameters)
        return
    prim.typeName = type_name(leaf.kind)
    first = 0
    for parameter in SOLIDS[leaf.kind]:
        values = leaf.parameters[first : first + len(parameter.default)]
        first += len(values)
        attribute(prim, parameter.name, parameter.type_name, _value(values))
    if tolerance is not None:
        mesh = polygons(leaf.kind, leaf.parameters, tolerance)
        _write_points(prim, mesh.points, mesh.counts, mesh.corners, exact=False)


def _native_type(shape: Shape) -> str | None:
    """USD's own type for a shape that it can say exactly."""
    p = shape.parameters
    match shape.kind:
        case ShapeKind.SPHERE:
            return "Sphere"
        case ShapeKind.RECTANGLE:
            return "Plane"
        case ShapeKind.BOX if p[6] == 0.0 and len({*p[3:6], *(-x for x in p[:3])}) == 1:
            return "Cube"
        case ShapeKind.CYLINDER if p[3] == 0.0 and p[1] == -p[2]:
            return "Cylinder"
        case ShapeKind.CONE if p[2] == 0.0:
            return "Cone"
        case _:
            return None


def _write_native(prim: Any, native: str, p: tuple[float, ...]) -> None:
    match native:
        case "Sphere":
            numbers = {"radius": p[0]}
        case "Plane":
            numbers = {"width": p[0], "length": p[1]}
        case "Cube":
            numbers = {"size": 2.0 * p[3]}
        case "Cylinder":
            numbers = {"radius": p[0], "height": 2.0 * p[2]}
        case _:
            numbers = {"radius": p[0], "height": p[1]}
    for name, value in numbers.items():
        attribute(prim, name, "double", value)
    if native in ("Plane", "Cylinder", "Cone"):
        attribute(prim, "axis", "token", "Y", uniform=True)
    attribute(prim, "extent", "float3[]", _extent(native, p))


def _extent(native: str, p: tuple[float, ...]) -> Any:
    match native:
        case "Sphere":
            reach = (p[0], p[0], p[0])
        case "Plane":
            reach = (p[0] / 2.0, 0.0, p[1] / 2.0)
        case "Cube":
            reach = (p[3], p[3], p[3])
        case "Cylinder":
            reach = (p[0], p[2], p[0])
        case _:
            reach = (p[0], p[1] / 2.0, p[0])
    return Vt.Vec3fArray([Gf.Vec3f(*(-x for x in reach)), Gf.Vec3f(*reach)])


def _write_points(
    prim: Any, points: FloatArray, counts: Any, corners: Any, *, exact: bool = True
) -> None:
    rounded = np.ascontiguousarray(points, dtype=np.float32)
    attribute(prim, "points", "point3f[]", Vt.Vec3fArray.FromNumpy(rounded))
    if exact and not np.array_equal(rounded, points):
        apply_schema(prim, "OvoloMeshAPI")
        values = Vt.Vec3dArray.FromNumpy(np.ascontiguousarray(points))
        attribute(prim, EXACT_POINTS, "double3[]", values)
    for name, array in (("faceVertexCounts", counts), ("faceVertexIndices", corners)):
        values = Vt.IntArray.FromNumpy(np.ascontiguousarray(array, dtype=np.int32).ravel())
        attribute(prim, name, "int[]", values)
    attribute(prim, "subdivisionScheme", "token", "none", uniform=True)
    ends = np.stack([rounded.min(axis=0), rounded.max(axis=0)])
    attribute(prim, "extent", "float3[]", Vt.Vec3fArray.FromNumpy(ends))


def _value(values: tuple[float, ...]) -> Any:
    match len(values):
        case 1:
            return values[0]
        case 2:
            return Gf.Vec2d(*values)
        case _:
            return Gf.Vec3d(*values)
