"""Random nested scenes of every shape and step, and rays that are hard on them.

A scene is grown from its leaves: a pool of shapes, from which nodes are made by grouping, placing,
batching and binding what the pool holds, so that parts are shared. What is extreme in practice is
common here: bevels at their limits or of 1e-9, mirrors, quarter turns, needles and sheets, whole
scenes of millimetres or of megametres.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from dsl.limits import broken_limit, largest_bevel
from dsl.scene import (
    SHAPE_PARAMETERS,
    Bind,
    FloatArray,
    Group,
    Instances,
    Material,
    Mesh,
    Node,
    SceneGraph,
    Shape,
    ShapeKind,
    Step,
    StepKind,
    Transform,
)
from runtime.reference import ReferenceTracer
from runtime.reference.number import Number
from runtime.reference.transform import affine_maps

FLOAT = Number("float64")
MATERIALS = tuple(Material(diffuse=(i / 4, 0.5, 0.5)) for i in range(5))
MOST_LEAVES = 40


@dataclass(frozen=True, slots=True)
class Rays:
    """Rays `(n, 3)` and their bounds `(n,)`, in the order that `Kernel.trace` takes them."""

    origins: FloatArray
    directions: FloatArray
    t_min: FloatArray
    t_max: FloatArray

    def __iter__(self) -> Iterator[NDArray[np.float64]]:
        return iter((self.origins, self.directions, self.t_min, self.t_max))

    def at(self, index: NDArray[np.intp]) -> Rays:
        """Some of them."""
        return Rays(*(values[index] for values in self))


def random_scene(seed: int) -> SceneGraph:
    """A scene of at most `MOST_LEAVES` leaves."""
    rng = np.random.default_rng(seed)
    pool: list[tuple[Node, int]] = [(random_solid(rng), 1) for _ in range(rng.integers(1, 6))]
    for _ in range(rng.integers(1, 9)):
        node, leaves = pool[rng.integers(len(pool))]
        match rng.integers(5):
            case 0 | 1:
                pool.append((Instances(node, random_transform(rng)), leaves))
            case 2:
                count = int(rng.integers(2, 6))
                pool.append((Instances(node, random_transform(rng, count)), leaves * count))
            case 3:
                material = MATERIALS[rng.integers(len(MATERIALS))]
                pool.append((Bind(node, material, bool(rng.random() < 0.3)), leaves))
            case _:
                chosen = rng.integers(len(pool), size=rng.integers(1, 5))
                parts = [spread(pool[i][0], rng) for i in chosen]
                pool.append((Group(tuple(parts)), sum(pool[i][1] for i in chosen)))
        if pool[-1][1] > MOST_LEAVES:
            pool.pop()
    root = pool[-1][0]
    if rng.random() < 0.3:
        root = Instances(root, Transform((scaling(10.0 ** rng.uniform(-9, 9)),)))
    return SceneGraph(root)


def spread(node: Node, rng: Generator) -> Node:
    """The node, moved, or as often in the way of others."""
    if rng.random() < 0.3:
        return node
    return Instances(node, Transform((Step(StepKind.TRANSLATE, rng.normal(size=3) * 3),)))


def scaling(factor: float) -> Step:
    """The same in all directions."""
    return Step(StepKind.SCALE, np.full(3, factor))


# Shapes.


def random_solid(rng: Generator) -> Shape | Mesh:
    """Any shape, of any proportions."""
    kinds = [*ShapeKind, None]
    kind = kinds[rng.integers(len(kinds))]
    return random_mesh(rng) if kind is None else random_shape(kind, rng)


def random_shape(kind: ShapeKind, rng: Generator) -> Shape:
    """A shape of that kind, bevelled as often as not: by 1e-9, somewhat, or to the limit."""
    size = 10.0 ** rng.uniform(-1, 1)

    def some() -> float:
        return float(size * rng.uniform(0.1, 1))

    y0 = float(rng.normal() * size) if rng.random() < 0.5 else -some()
    height, low = some(), rng.normal(size=3) * size * rng.integers(2) - size / 2
    match kind:
        case ShapeKind.BOX:
            parameters = [*low, *(edge + some() for edge in low)]
        case ShapeKind.CYLINDER:
            parameters = [some(), y0, y0 + height]
        case ShapeKind.TORUS:
            major = some()
            parameters = [major, major * float(10.0 ** rng.uniform(-2, -0.1))]
        case ShapeKind.RING | ShapeKind.WEDGE:
            outer = some()
            parameters = [outer * float(rng.uniform(0.1, 0.95)), outer, y0, y0 + height]
        case ShapeKind.TRIANGLE:
            parameters = list(rng.normal(size=9) * size)
        case _:
            parameters = [some() for name in SHAPE_PARAMETERS[kind] if name != "bevel"]
    if kind is ShapeKind.WEDGE:
        start = float(rng.choice([-90.0, 0.0, 45.0, rng.uniform(-360, 360)]))
        opening = float(rng.choice([90.0, 180.0, 270.0, rng.uniform(10, 345)]))
        parameters += [start, start + opening]
    values = tuple(map(float, parameters))
    if "bevel" in SHAPE_PARAMETERS[kind]:
        limit = largest_bevel(kind, (*values, 0.0))
        share = rng.choice([0.0, 1e-9, rng.uniform(0.1, 1), rng.uniform(0.1, 1), 1.0])
        bevel = min(float(share * limit), float(size))
        while broken_limit(kind, (*values, bevel)):
            bevel = float(np.nextafter(bevel, 0))
        values = (*values, bevel)
    return Shape(kind, values)


def random_mesh(rng: Generator) -> Mesh:
    """An octahedron with its corners moved about."""
    corners = np.concatenate([np.eye(3), -np.eye(3)]) + rng.normal(size=(6, 3)) * 0.2
    triangles = [(x, y, z) for x in (0, 3) for y in (1, 4) for z in (2, 5)]
    return Mesh(corners * 10.0 ** rng.uniform(-1, 1), np.array(triangles))


# Transforms.


def random_transform(rng: Generator, count: int | None = None) -> Transform:
    """A chain of up to four steps, all kinds alike; a step of a batch may be the same for all."""
    steps = []
    kinds = list(StepKind)
    for _ in range(rng.integers(1, 5)):
        kind = kinds[rng.integers(len(kinds))]
        shared = count is None or rng.random() < 0.4
        inverse = bool(rng.random() < 0.2)
        values = random_values(kind, rng) if shared else random_rows(kind, rng, count or 0)
        steps.append(Step(kind, values, inverse))
    if count is not None:
        steps.append(Step(StepKind.TRANSLATE, rng.normal(size=(count, 3)) * 4))
    return Transform(tuple(steps))


def random_rows(kind: StepKind, rng: Generator, count: int) -> FloatArray:
    """Values of a batch."""
    return np.stack([random_values(kind, rng) for _ in range(count)])


def random_values(kind: StepKind, rng: Generator) -> FloatArray:
    """Values of one step, none of them singular."""
    axis = np.eye(3)[rng.integers(3)] if rng.random() < 0.4 else rng.normal(size=3)
    match kind:
        case StepKind.TRANSLATE:
            return np.array(rng.normal(size=3) * 10.0 ** rng.uniform(-1, 2))
        case StepKind.SCALE:
            spread = rng.choice([0.0, 0.5, 0.5, 2.0])
            factors = 10.0 ** rng.uniform(-spread, spread, 3) * rng.choice([1, 1, -1], 3)
            return np.array(factors)
        case StepKind.ROTATE:
            turn = rng.choice([90.0, 180.0, 36000090.0, rng.uniform(-720, 720)])
            return np.array([*axis, turn])
        case StepKind.ORIENT:
            turn = rng.normal(size=4)
            return np.array(turn / np.linalg.norm(turn))
        case StepKind.SHEAR:  # its determinant is 1 whatever the values
            return np.array([*rng.normal(size=2) * 2, 0, rng.normal(), 0, 0])
        case StepKind.REFLECT:
            return np.array(axis)
        case StepKind.MATRIX:
            linear = np.eye(3) + rng.uniform(-0.3, 0.3, (3, 3))
            return np.column_stack([linear, rng.normal(size=3)]).ravel()
        case StepKind.LOOK_AT:
            return rng.normal(size=9) * 3


# Rays.


def random_rays(graph: SceneGraph, count: int, seed: int) -> Rays:
    """Rays aimed at the leaves of a scene: from near and far, from inside, along axes, grazing."""
    rng = np.random.default_rng([seed, 1])
    targets = leaf_points(graph.root, rng)[rng.integers(0, 400, count) % 400]
    spread = targets - targets[rng.permutation(count)]
    reach = np.abs(spread).max(axis=1, keepdims=True) + np.abs(targets).max() * 1e-3 + 1e-300
    away = rng.normal(size=(count, 3))
    along = rng.random(count) < 0.15
    away[along] = (
        rng.choice([-1, 1], (along.sum(), 1)) * np.eye(3)[rng.integers(3, size=along.sum())]
    )
    distance = reach * 10.0 ** rng.uniform(0, 2, (count, 1))
    origins = np.where(along[:, None], targets * 1, targets) + away * distance
    directions = np.where(along[:, None], -away, targets - origins)
    inside = rng.random(count) < 0.15
    origins[inside] = targets[inside]
    directions *= 10.0 ** rng.uniform(-2, 2, (count, 1))
    t_min, t_max = np.zeros(count), np.full(count, np.inf)
    some = Rays(origins, directions, t_min, t_max)
    graze(some, graph, rng)
    cut = rng.random(count) < 0.1
    t_max[cut] = rng.uniform(0, 2, cut.sum())
    t_min[cut] = rng.uniform(0, 1, cut.sum()) * rng.integers(0, 2, cut.sum())
    return some


def graze(rays: Rays, graph: SceneGraph, rng: Generator) -> None:
    """Make every fifth ray pass along the surface that it hits, 1e-13 … 1e-2 beside it."""
    fifth = np.flatnonzero(rng.random(len(rays.t_min)) < 0.2)
    t, normal, position, *_ = ReferenceTracer(graph).trace(*rays.at(fifth))
    hit = np.isfinite(t)
    chosen, normal, position = fifth[hit], normal[hit], position[hit]
    scale = np.linalg.norm(position - rays.origins[chosen], axis=1, keepdims=True)
    tangent = np.cross(normal, rng.normal(size=(len(chosen), 3)))
    offset = rng.choice([-1, 1], scale.shape) * 10.0 ** rng.uniform(-13, -2, scale.shape)
    rays.directions[chosen] = tangent
    rays.origins[chosen] = position + scale * (offset * normal - tangent)


def leaf_points(node: Node, rng: Generator) -> FloatArray:
    """400 points in and near the leaves below a node, in the node's own space."""
    match node:
        case Shape(kind=kind, parameters=parameters):
            return around(kind, np.array(parameters), rng)
        case Mesh():
            return node.points[rng.integers(len(node.points), size=400)] * rng.uniform(
                size=(400, 1)
            )
        case Bind():
            return leaf_points(node.child, rng)
        case Group():
            return mixed([leaf_points(item, rng) for item in node.items], rng)
        case Instances():
            child = leaf_points(node.child, rng)
            parts = []
            for index in range(node.transform.count or 1):
                points = FLOAT.array(child.T)
                for affine in affine_maps(node.transform, index, FLOAT) or ():
                    points = affine.world_point(points)
                parts.append(points.T)
            return mixed(parts, rng)
    raise TypeError(node)


def mixed(parts: list[FloatArray], rng: Generator) -> FloatArray:
    """400 points of all parts."""
    points = np.stack(parts)
    return points[rng.integers(len(parts), size=400), np.arange(400)]


def around(kind: ShapeKind, p: FloatArray, rng: Generator) -> FloatArray:
    """400 points of the box around a shape, half of them nearer to its middle."""
    low, high = np.array(BOXES[kind](p), dtype=np.float64)
    share = rng.uniform(-1, 1, (400, 3)) * np.where(np.arange(400) % 2, 0.5, 1)[:, None]
    return (low + high) / 2 + share * (high - low) / 2  # type: ignore[no-any-return]


def round_box(r: float, y0: float, y1: float) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """The box around a solid of revolution."""
    return (-r, y0, -r), (r, y1, r)


BOXES: dict[ShapeKind, Callable[[FloatArray], object]] = {
    ShapeKind.SPHERE: lambda p: round_box(p[0], -p[0], p[0]),
    ShapeKind.BOX: lambda p: (p[:3], p[3:6]),
    ShapeKind.CYLINDER: lambda p: round_box(p[0], p[1], p[2]),
    ShapeKind.CONE: lambda p: round_box(p[0], 0, p[1]),
    ShapeKind.TORUS: lambda p: round_box(p[0] + p[1], -p[1], p[1]),
    ShapeKind.DISC: lambda p: round_box(p[0], 0, 0),
    ShapeKind.RECTANGLE: lambda p: ((-p[0] / 2, 0, -p[1] / 2), (p[0] / 2, 0, p[1] / 2)),
    ShapeKind.PLANE: lambda p: round_box(3, 0, 0),
    ShapeKind.TRIANGLE: lambda p: (p.reshape(3, 3).min(axis=0), p.reshape(3, 3).max(axis=0)),
    ShapeKind.RING: lambda p: round_box(p[1], p[2], p[3]),
    ShapeKind.WEDGE: lambda p: round_box(p[1], p[2], p[3]),
}
