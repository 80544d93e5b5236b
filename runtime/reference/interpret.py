"""The recursion over the scene graph.

`meet` says what a ray meets of a node, given what it meets of the node's children: it is written
as a recursive function would be, but *yields* its recursive calls, so that `run` can keep the
waiting callers in a list. A scene 100 000 instances deep is then no deeper than any other.
"""

from __future__ import annotations

from collections.abc import Callable, Generator
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dsl.scene import (
    DEFAULT_MATERIAL,
    Bind,
    File,
    FloatArray,
    Group,
    Instances,
    IntArray,
    Material,
    Mesh,
    Node,
    SceneGraph,
    Shape,
    Step,
    Transform,
)
from runtime.reference.intersect import Meeting, Rays, intersect
from runtime.reference.number import Array, Number, NumberName, finite
from runtime.reference.placement import Placement
from runtime.reference.transform import Affine, affine_maps


@dataclass(frozen=True, slots=True)
class Hits:
    """The closest hits of rays with a node, in the node's own space.

    `t` `(n,)`, inf for a miss; `point` and `normal` `(3, n)`, the normal of any length; `leaf`,
    `prototype` and `material` `(n,)` int64 numbers of the tracer's, -1 for a miss.
    """

    t: Array
    point: Array
    normal: Array
    leaf: IntArray
    prototype: IntArray
    material: IntArray

    def nearer(self, other: Hits) -> Hits:
        """Of each ray the hit with the smaller t; of two the same, this one."""
        other_is = other.t < self.t
        return Hits(
            *(
                np.where(other_is, theirs, ours)
                for ours, theirs in (
                    (self.t, other.t),
                    (self.point, other.point),
                    (self.normal, other.normal),
                    (self.leaf, other.leaf),
                    (self.prototype, other.prototype),
                    (self.material, other.material),
                )
            )
        )


@dataclass(frozen=True, slots=True)
class Bound:
    """The material in force on the way down; `override` forbids to replace it."""

    material: Material = DEFAULT_MATERIAL
    override: bool = False

    def __and__(self, bind: Bind) -> Bound:
        """What is in force below a `Bind`."""
        return self if self.override else Bound(bind.material, bind.override)


Recursion = Generator[tuple[Node, Rays, Bound, Placement], Hits, Hits]


@dataclass(slots=True)
class Numbering:
    """Leaves in order of emission, prototypes and materials in order of first use."""

    leaves: int = 0
    prototypes: dict[object, int] = field(default_factory=dict)
    materials: dict[Material, int] = field(default_factory=dict)

    def of(self, shape: Shape | Mesh, material: Material) -> tuple[int, int, int]:
        """The numbers of the next leaf, its prototype and its material."""
        if isinstance(shape, Shape):
            key: object = shape.kind, shape.parameters
        else:
            key = id(shape.points), id(shape.triangles)
        prototype = self.prototypes.setdefault(key, len(self.prototypes))
        self.leaves += 1
        return (
            self.leaves - 1,
            prototype,
            self.materials.setdefault(material, len(self.materials)),
        )


class ReferenceTracer:
    """Traces a scene graph by the definition; answers like `runtime._kernel.Kernel`.

    `load` gives the node for a `File`. `number` is what to compute with; mpmath takes `digits`
    decimal digits. Meant to be compared with: time grows with rays × leaves × depth.

    After a trace `materials` lists the materials that `material` indexes, in order of first use.
    An instance whose transform has no inverse has no hits and no leaf numbers, nor has what is out
    of range or a mesh without triangles.
    """

    def __init__(
        self,
        graph: SceneGraph,
        load: Callable[[File], Node] | None = None,
        number: NumberName = "float64",
        digits: int = 50,
    ) -> None:
        self._graph = graph
        self._load = load
        self._loaded: dict[int, Node] = {}
        self._number = Number(number, digits)
        self.materials: list[Material] = []

    def trace(
        self,
        origins: FloatArray,
        directions: FloatArray,
        t_min: FloatArray,
        t_max: FloatArray,
    ) -> tuple[FloatArray, FloatArray, FloatArray, IntArray, NDArray[np.int32], NDArray[np.int32]]:
        """Closest hits with t_min < t < t_max.

        t `(n,)`, unit normal and position `(n, 3)`, instance, prototype and material `(n,)`. Rays
        `(n, 3)`, bounds `(n,)` or `(1,)`, world space. A miss has t = inf, normal and position NaN,
        indices -1. A ray that is not finite, or has a zero direction, misses. Ties in t go to the
        lowest leaf number.
        """
        hits = self.closest(origins, directions, t_min, t_max)
        hit = hits.leaf >= 0
        length = np.where(hit, self._number.length(hits.normal), 1)
        normal = np.where(hit, hits.normal / length, np.nan)
        position = np.where(hit, hits.point, np.nan)
        return (
            hits.t.astype(np.float64),
            np.ascontiguousarray(normal.T.astype(np.float64)),
            np.ascontiguousarray(position.T.astype(np.float64)),
            hits.leaf,
            hits.prototype.astype(np.int32),
            hits.material.astype(np.int32),
        )

    def occluded(
        self,
        origins: FloatArray,
        directions: FloatArray,
        t_min: FloatArray,
        t_max: FloatArray,
    ) -> NDArray[np.bool_]:
        """Whether anything is hit with t_min < t < t_max, (n,)."""
        return self.closest(origins, directions, t_min, t_max).leaf >= 0

    def closest(
        self, origins: FloatArray, directions: FloatArray, t_min: FloatArray, t_max: FloatArray
    ) -> Hits:
        """The hits as `trace` finds them, before they are rounded to float64."""
        ends = np.stack([np.broadcast_to(end, len(origins)) for end in (t_min, t_max)])
        usable = np.isfinite(origins).all(axis=1) & np.isfinite(directions).all(axis=1)
        usable &= directions.any(axis=1)
        rays = Rays(
            self._number.array(origins[usable].T),
            self._number.array(directions[usable].T),
            *self._number.array(ends[:, usable]),
        )
        numbering = Numbering()
        found = self._run(self._graph.root, rays, numbering)
        self.materials = list(numbering.materials)

        everywhere = missed(len(origins), self._number)
        for name in ("t", "point", "normal", "leaf", "prototype", "material"):
            getattr(everywhere, name)[..., usable] = getattr(found, name)
        return everywhere

    def _run(self, root: Node, rays: Rays, numbering: Numbering) -> Hits:
        """`meet` with its recursive calls."""
        world = Placement.of_the_world(self._number)
        callers = [self._meet(root, rays, Bound(), world, numbering)]
        answer: Hits | None = None
        while True:
            try:
                call = callers[-1].send(answer)  # type: ignore[arg-type]
            except StopIteration as returned:
                callers.pop()
                answer = returned.value
                if not callers:
                    return returned.value  # type: ignore[no-any-return]
            else:
                callers.append(self._meet(*call, numbering))
                answer = None

    def _meet(
        self, node: Node, rays: Rays, bound: Bound, placed: Placement, numbering: Numbering
    ) -> Recursion:
        """The closest hits of the rays with a node, all in the space that the node is in."""
        number = self._number
        match node:
            case Mesh() if not len(node.triangles):
                return missed(rays.t_min.size, number)
            case Shape() | Mesh() if not placed.holds(node):
                return missed(rays.t_min.size, number)
            case Shape() | Mesh():
                return leaf_hits(intersect(node, rays, number), *numbering.of(node, bound.material))
            case Bind():
                return (yield node.child, rays, bound & node, placed)
            case File():
                return (yield self._open(node), rays, bound, placed)
            case Group():
                hits = missed(rays.t_min.size, number)
                for item in node.items if node.order is None else ordered_edges(node, node.order):
                    hits = hits.nearer((yield item, rays, bound, placed))
                return hits
            case Instances():
                hits = missed(rays.t_min.size, number)
                count = node.transform.count
                for index in range(1 if count is None else count):
                    maps = affine_maps(node.transform, index, number)
                    if maps is None:
                        continue
                    inner = object_rays(maps, rays)
                    inside = yield node.child, inner, bound, placed.below(maps)
                    hits = hits.nearer(world_hits(maps, inside))
                return hits
        return missed(rays.t_min.size, number)

    def _open(self, file: File) -> Node:
        """The node that a file holds, read once."""
        if self._load is None:
            raise ValueError(f"the scene refers to {file.path!r}: give a `load`")
        if id(file) not in self._loaded:
            self._loaded[id(file)] = self._load(file)
        return self._loaded[id(file)]


def ordered_edges(group: Group, order: IntArray) -> list[Node]:
    """The edges of the group's batches, each as a node of its own, in the order of emission."""
    edges: list[Node] = []
    for item in group.items:
        count = item.transform.count if isinstance(item, Instances) else None
        if not isinstance(item, Instances) or count is None:
            edges.append(item)
            continue
        for index in range(count):
            steps = tuple(
                Step(step.kind, step.values[index], step.inverse) if step.values.ndim == 2 else step
                for step in item.transform.steps
            )
            edges.append(Instances(item.child, Transform(steps)))
    return [edges[number] for number in order]


def object_rays(maps: list[Affine], rays: Rays) -> Rays:
    """Step 1: the rays as the untransformed object sees them. t stays what it is."""
    origin, direction = rays.origin, rays.direction
    for affine in reversed(maps):
        origin, direction = affine.object_point(origin), affine.object_direction(direction)
    return Rays(origin, direction, rays.t_min, rays.t_max)


def world_hits(maps: list[Affine], hits: Hits) -> Hits:
    """Steps 4 and 5: hit points by the transform, normals by its inverse transpose."""
    point, normal = hits.point, hits.normal
    for affine in maps:
        point, normal = affine.world_point(point), affine.world_normal(normal)
        normal = normal / np.maximum(np.abs(normal).max(axis=0), np.finfo(np.float64).tiny)
    return Hits(hits.t, point, normal, hits.leaf, hits.prototype, hits.material)


def leaf_hits(meeting: Meeting, leaf: int, prototype: int, material: int) -> Hits:
    """Steps 2 and 3 are `intersect`; its answer with the numbers of the leaf."""
    hit = finite(meeting.t)
    numbers = (np.where(hit, number, -1) for number in (leaf, prototype, material))
    return Hits(meeting.t, meeting.point, meeting.normal, *numbers)


def missed(n: int, number: Number) -> Hits:
    """No hits: n rays that miss."""
    nothing: Any = np.full(n, -1, np.int64)
    return Hits(
        number.array(np.full(n, np.inf)),
        number.array(np.zeros((3, n))),
        number.array(np.zeros((3, n))),
        nothing,
        nothing.copy(),
        nothing.copy(),
    )
