"""Solids that a zero scale has pressed flat, as meshes.

A matrix of rank 2 has no inverse, so what it places cannot be traced in its own space. It is
pressed here instead: meshes point by point, convex solids as the hull of their shadow, whose round
outlines get `ROUND` points. Ranks below 2 leave nothing that a ray could hit.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from compiler.transforms import compose
from dsl.scene import (
    Bind,
    FloatArray,
    Group,
    Instances,
    Mesh,
    Node,
    Shape,
    ShapeKind,
    Step,
    StepKind,
    Transform,
)

ROUND = 512
"""Points of a circle: its outline is right to 2e-5 of the radius."""

LEAVES = 4096
"""Leaves that are pressed at once, and levels of nodes above them; beyond, nothing is."""
LEVELS = 200

FLAT = 1e-12
"""A singular value that is smaller, relative to the largest, counts as zero."""


def is_singular(steps: tuple[Step, ...]) -> bool:
    """Whether a single chain flattens what it places, wholly or nearly."""
    if not any(map(_is_suspect, steps)):
        return False
    linear = _matrices(Transform(steps), 1)[0, :, :3]
    if not np.isfinite(linear).all():
        return False
    stretch = np.linalg.svd(linear, compute_uv=False)
    return bool(stretch[2] <= FLAT * stretch[0])


def _is_suspect(step: Step) -> bool:
    """Whether a step may flatten: a cheap question, with few wrong answers."""
    if step.kind is StepKind.SCALE:
        return bool(is_flat(np.sort(np.abs(step.values))))
    if step.kind is not StepKind.MATRIX:
        return False
    linear = step.values.reshape(3, 4)[:, :3]
    bound = np.linalg.norm(linear, axis=1).prod()
    return not abs(np.linalg.det(linear)) > FLAT * bound


def is_flat(stretch: FloatArray) -> NDArray[np.bool_]:
    """Whether the smallest of three ascending scales `(..., 3)` is nothing beside the largest."""
    return np.asarray(stretch[..., 0] <= FLAT * stretch[..., 2])


def pressed(node: Node) -> Node | None:
    """The same with all leaves pressed in place of their transforms, keeping their origins.

    None where there is nothing to be seen, or where it is too much to be pressed.
    """
    try:
        return _Press().node(node, np.eye(3, 4), 0)
    except _TooMuchError:
        return None


class _TooMuchError(Exception):
    pass


class _Press:
    def __init__(self) -> None:
        self._leaves = 0

    def node(self, node: Node, matrix: FloatArray, level: int) -> Node | None:
        """A node below `matrix` `(3, 4)`, in the space above it."""
        if level > LEVELS:
            raise _TooMuchError
        if isinstance(node, Group):
            items = [self.node(item, matrix, level + 1) for item in node.items]
            kept = tuple(item for item in items if item is not None)
            return replace(node, items=kept) if kept else None
        if isinstance(node, Bind):
            child = self.node(node.child, matrix, level + 1)
            return None if child is None else replace(node, child=child)
        if isinstance(node, Instances):
            return self._instances(node, matrix, level)
        self._leaves += 1
        if self._leaves > LEAVES:
            raise _TooMuchError
        if isinstance(node, Mesh):
            return _pressed_mesh(node, matrix)
        return _shadow(node, matrix) if isinstance(node, Shape) else None

    def _instances(self, node: Instances, matrix: FloatArray, level: int) -> Node | None:
        count = node.transform.count
        if count is not None and count > LEAVES:
            raise _TooMuchError
        placed = _matrices(node.transform, count or 1)
        children = [self.node(node.child, _product(matrix, own), level + 1) for own in placed]
        if count is None:
            child = children[0]
            return None if child is None else replace(node, child=child, transform=Transform())
        still = Transform((Step(StepKind.TRANSLATE, np.zeros((1, 3))),))
        numbers = np.arange(count) if node.indices is None else node.indices
        lanes = tuple(
            replace(node, child=child, transform=still, indices=numbers[row : row + 1])
            for row, child in enumerate(children)
            if child is not None
        )
        return Group(lanes) if lanes else None


def _matrices(transform: Transform, count: int) -> FloatArray:
    """The `(n, 3, 4)` matrices of a transform."""
    matrices = np.empty((count, 3, 4))
    compose(transform.steps).forward.round_into(matrices)
    return matrices


def _product(outer: FloatArray, inner: FloatArray) -> FloatArray:
    product = outer[:, :3] @ inner
    product[:, 3] += outer[:, 3]
    return np.asarray(product)


def _plane(matrix: FloatArray) -> FloatArray | None:
    """Two axes `(3, 2)` of the plane that a matrix presses into, or None unless it is one."""
    linear = matrix[:, :3]
    if not np.isfinite(matrix).all():
        return None
    axes, stretch, _ = np.linalg.svd(linear)
    flat = stretch <= FLAT * stretch[0]
    return np.asarray(axes[:, :2]) if flat.tolist() == [False, False, True] else None


def _pressed_mesh(mesh: Mesh, matrix: FloatArray) -> Mesh | None:
    plane = _plane(matrix)
    if plane is None:
        return None
    points = mesh.points @ matrix[:, :3].T + matrix[:, 3]
    a, b, c = ((mesh.points @ (matrix[:, :3].T @ plane))[mesh.triangles[:, i]] for i in range(3))
    area = _cross(b - a, c - a)
    kept = np.abs(area) > FLAT * np.abs(area).max(initial=0.0)
    if not kept.any():
        return None
    return replace(mesh, points=points, triangles=mesh.triangles[kept], attributes=())


def _shadow(shape: Shape, matrix: FloatArray) -> Mesh | None:
    """The shadow of a convex solid; None for solids that are not."""
    plane = _plane(matrix)
    corners = None if plane is None else _outline(shape, matrix)
    if plane is None or corners is None:
        return None
    points = corners @ matrix[:, :3].T + matrix[:, 3]
    hull = _hull(corners @ (matrix[:, :3].T @ plane))
    if len(hull) < 3:
        return None
    steps = np.arange(1, len(hull) - 1)
    fan = np.stack((np.zeros_like(steps), steps, steps + 1), axis=1)
    return Mesh(points[hull], fan, shape.origin)


def _outline(shape: Shape, matrix: FloatArray) -> FloatArray | None:
    """Points of a solid whose shadows have the solid's shadow as their hull, `(n, 3)`."""
    values = shape.parameters
    turns = 2.0 * np.pi * np.arange(ROUND) / ROUND
    cos, sin = np.cos(turns), np.sin(turns)
    ring = np.stack((cos, 0.0 * cos, sin), axis=1)
    # The outline of a ball is its great circle in the plane that is not pressed away.
    _, _, kept = np.linalg.svd(matrix[:, :3])
    great = cos[:, None] * kept[0] + sin[:, None] * kept[1]
    up = np.array([0.0, 1.0, 0.0])
    match shape.kind:
        case ShapeKind.SPHERE:
            return np.asarray(values[0] * great)
        case ShapeKind.BOX if values[6] == 0.0:
            ends = [(values[axis], values[axis + 3]) for axis in range(3)]
            return np.array(np.meshgrid(*ends)).reshape(3, 8).T
        case ShapeKind.CYLINDER if values[3] in (0.0, values[0]):
            radius, bevel = values[0], values[3]
            circle = radius * (great if bevel else ring)
            heights = (values[1] + bevel, values[2] - bevel)
            return np.concatenate([circle + height * up for height in heights])
        case ShapeKind.CONE if values[2] == 0.0:
            return np.concatenate((values[0] * ring, [values[1] * up]))
        case ShapeKind.RECTANGLE:
            x, z = values[0] / 2.0, values[1] / 2.0
            return np.array([(-x, 0, -z), (-x, 0, z), (x, 0, z), (x, 0, -z)], dtype=np.float64)
        case _:
            return None


def _hull(points: FloatArray) -> list[int]:
    """Corners of the convex hull of points `(n, 2)`, in order (Andrew's monotone chain)."""
    order = np.lexsort((points[:, 1], points[:, 0])).tolist()
    halves: list[list[int]] = []
    for row in (order, order[::-1]):
        chain: list[int] = []
        for number in row:
            while len(chain) > 1 and _turn(points, chain[-2], chain[-1], number) <= 0.0:
                chain.pop()
            chain.append(number)
        halves.append(chain[:-1])
    return halves[0] + halves[1]


def _turn(points: FloatArray, a: int, b: int, c: int) -> float:
    return float(_cross(points[b] - points[a], points[c] - points[a]))


def _cross(first: FloatArray, second: FloatArray) -> FloatArray:
    return np.asarray(first[..., 0] * second[..., 1] - first[..., 1] * second[..., 0])
