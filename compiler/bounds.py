"""Boxes that hold a scene, its groups and its prototypes."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from compiler.double_double import FloatArray
from compiler.ir import KINDS, MESH, SceneIR, groups_children_first
from dsl.scene import SHAPE_PARAMETERS, ShapeKind

_NOTHING = np.array([[np.inf] * 3, [-np.inf] * 3])


def bounds(scene: SceneIR) -> FloatArray | None:
    """The corners `(2, 3)` of a world-space box that holds all bounded leaves; None without any.

    Bevels are taken for the corners that they round, and turned boxes for their boxes: the
    kernel's bounds are tighter.
    """
    prototypes = np.array(
        [prototype_bounds(scene, p) for p in range(len(scene.prototype_kind))]
    ).reshape(-1, 2, 3)
    groups = np.broadcast_to(_NOTHING, (len(scene.group_ranges), 2, 3)).copy()
    for group in groups_children_first(scene):
        first, end = scene.group_ranges[group]
        target = scene.instance_target[first:end]
        boxes = np.empty((len(target), 2, 3))
        boxes[target >= 0] = prototypes[target[target >= 0]]
        boxes[target < 0] = groups[~target[target < 0]]
        bounded = np.isfinite(boxes).all(axis=(1, 2))
        if bounded.any():
            placed = _moved(boxes[bounded], scene.world_from_object[first:end][bounded])
            groups[group] = placed[:, 0].min(axis=0), placed[:, 1].max(axis=0)
    return groups[0] if np.isfinite(groups[0]).all() else None


def prototype_bounds(scene: SceneIR, prototype: int) -> FloatArray:
    """The corners `(2, 3)` of a prototype's box in its own space; infinite for a plane."""
    data = int(scene.prototype_data[prototype])
    if scene.prototype_kind[prototype] == MESH:
        first, end, first_triangle, end_triangle = scene.mesh_ranges[data]
        used = scene.mesh_triangles[first_triangle:end_triangle]
        points = scene.mesh_points[first:end][used.ravel()]
        return np.array([points.min(axis=0), points.max(axis=0)]) if len(points) else _NOTHING
    kind = ShapeKind(KINDS[scene.prototype_kind[prototype]])
    names = SHAPE_PARAMETERS[kind]
    values = scene.shape_parameters[data : data + len(names)].tolist()
    return np.array(_shape_bounds(kind, dict(zip(names, values, strict=True))))


def _shape_bounds(kind: ShapeKind, p: dict[str, float]) -> list[list[float]]:
    def around(radius: float, y0: float, y1: float) -> list[list[float]]:
        return [[-radius, y0, -radius], [radius, y1, radius]]

    match kind:
        case ShapeKind.SPHERE:
            return around(p["radius"], -p["radius"], p["radius"])
        case ShapeKind.BOX:
            return [[p["x0"], p["y0"], p["z0"]], [p["x1"], p["y1"], p["z1"]]]
        case ShapeKind.CYLINDER:
            return around(p["radius"], p["y0"], p["y1"])
        case ShapeKind.CONE:
            return around(p["radius"], 0.0, p["height"])
        case ShapeKind.TORUS:
            return around(p["major"] + p["minor"], -p["minor"], p["minor"])
        case ShapeKind.DISC:
            return around(p["radius"], 0.0, 0.0)
        case ShapeKind.RECTANGLE:
            x, z = p["size_x"] / 2, p["size_z"] / 2
            return [[-x, 0.0, -z], [x, 0.0, z]]
        case ShapeKind.PLANE:
            return [[-math.inf] * 3, [math.inf] * 3]
        case ShapeKind.TRIANGLE:
            corners = [[p[f"{corner}{axis}"] for axis in "xyz"] for corner in "abc"]
            axes = list(zip(*corners, strict=True))
            return [[min(axis) for axis in axes], [max(axis) for axis in axes]]
        case ShapeKind.RING:
            return around(p["r1"], p["y0"], p["y1"])
        case ShapeKind.WEDGE:
            phi0, phi1 = p["phi0"], p["phi1"]
            # Extremes lie on the four edges, or where the outer wall crosses an axis.
            crossed = range(math.ceil(phi0 / 90), math.floor(phi1 / 90) + 1)
            turns = [(p["r1"], 90.0 * quarter) for quarter in list(crossed)[:4]]
            edges = [(r, phi) for r in (p["r0"], p["r1"]) for phi in (phi0, phi1)]
            points = [
                (r * math.sin(math.radians(phi % 360)), r * math.cos(math.radians(phi % 360)))
                for r, phi in turns + edges
            ]
            (x0, x1), (z0, z1) = ((min(axis), max(axis)) for axis in zip(*points, strict=True))
            return [[x0, p["y0"], z0], [x1, p["y1"], z1]]


def _moved(boxes: FloatArray, matrices: NDArray[np.float64]) -> FloatArray:
    """The boxes of moved boxes."""
    center, half = boxes.mean(axis=1), (boxes[:, 1] - boxes[:, 0]) / 2
    linear = matrices[:, :, :3]
    middle = np.einsum("nij,nj->ni", linear, center) + matrices[:, :, 3]
    reach = np.einsum("nij,nj->ni", np.abs(linear), half)
    return np.stack([middle - reach, middle + reach], axis=1)
