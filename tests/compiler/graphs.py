"""Random scene graphs, and what they denote by plain recursion: one leaf at a time."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from hypothesis import strategies as st

from compiler.ir import KINDS, SceneIR
from dsl.scene import (
    DEFAULT_MATERIAL,
    MATERIAL_PARAMETERS,
    SHAPE_PARAMETERS,
    Bind,
    Group,
    Instances,
    Material,
    Node,
    Origin,
    Shape,
    ShapeKind,
    Step,
    StepKind,
    Transform,
)
from dsl.spans import Source, Span

SOURCE = Source("scene.ovo", "…" * 100)
MATERIALS = [DEFAULT_MATERIAL, Material((1, 0, 0)), Material(roughness=0.125), Material(ior=2)]


def origin(label: str = "", index: int | None = None, start: int = 0) -> Origin:
    return Origin(Span(SOURCE, start, start + 1), label, index)


def step(kind: str, *values: float) -> Step:
    return Step(StepKind(kind), np.array(values, dtype=np.float64))


def placed(child: Node, *steps: Step, label: str = "") -> Instances:
    return Instances(child, Transform(steps), origin=origin(label) if label else None)


def ball(radius: float = 1.0) -> Shape:
    return Shape(ShapeKind.SPHERE, (radius,), origin("ball", start=7))


@dataclass(frozen=True)
class Leaf:
    """One leaf of a scene: its shape, its steps from the inside out, its material, its path."""

    shape: tuple[str, tuple[float, ...]]
    steps: tuple[Step, ...]
    material: Material
    path: str


def leaves(node: Node) -> list[Leaf]:
    """What a graph denotes, by the rules of `dsl.scene` and nothing else."""
    return list(_leaves(node, (), (), None, None))


def _leaves(
    node: Node,
    steps: tuple[Step, ...],
    path: tuple[str, ...],
    bound: Material | None,
    override: Material | None,
) -> Iterator[Leaf]:
    label, index = (node.origin.label, node.origin.index) if node.origin else ("", None)
    match node:
        case Shape():
            key = (str(node.kind), node.parameters)
            material = override or bound or DEFAULT_MATERIAL
            yield Leaf(key, steps, material, "/".join((*path, *_words(label, index))))
        case Group():
            for item in node.items:
                yield from _leaves(item, steps, (*path, *_words(label, index)), bound, override)
        case Bind():
            if node.override:
                override = override or node.material
            else:
                bound = node.material
            words = (*path, *_words(label, index))
            yield from _leaves(node.child, steps, words, bound, override)
        case Instances():
            for lane in range(1 if node.transform.count is None else node.transform.count):
                own = tuple(
                    s if s.values.ndim == 1 else Step(s.kind, s.values[lane], s.inverse)
                    for s in node.transform.steps
                )
                if node.transform.count is not None:
                    index = lane if node.indices is None else int(node.indices[lane])
                lane_path = (*path, *_words(label, index))
                yield from _leaves(node.child, own + steps, lane_path, bound, override)


def _words(label: str, index: int | None) -> tuple[str, ...]:
    return () if not label else (label if index is None else f"{label}[{index}]",)


def rows(ir: SceneIR) -> list[tuple[tuple[str, tuple[float, ...]], np.ndarray, Material]]:
    """The leaves of an IR with all groups expanded: shape, world_from_object, material."""
    return list(_rows(ir, 0, np.eye(4), -1))


def _rows(
    ir: SceneIR, group: int, outer: np.ndarray, code: int
) -> Iterator[tuple[tuple[str, tuple[float, ...]], np.ndarray, Material]]:
    for row in range(*ir.group_ranges[group]):
        matrix = outer @ np.vstack([ir.world_from_object[row], [0, 0, 0, 1]])
        own = int(ir.instance_material[row])
        inner = code if code < -1 or own == -1 else own
        target = int(ir.instance_target[row])
        if target < 0:
            yield from _rows(ir, ~target, matrix, inner)
            continue
        kind = KINDS[ir.prototype_kind[target]]
        first = int(ir.prototype_data[target])
        count = len(SHAPE_PARAMETERS[ShapeKind(kind)])
        number = max(inner if inner >= -1 else -2 - inner, 0)
        record = ir.materials[number]
        fields: dict[str, Any] = {
            name: tuple(record[name].tolist()) if record[name].ndim else record[name].item()
            for name in MATERIAL_PARAMETERS
        }
        material = Material(**fields)
        yield (kind, tuple(ir.shape_parameters[first : first + count])), matrix, material


numbers = st.sampled_from([-3.0, -1.5, -1.0, 0.25, 1.0, 2.0, 7.0])


@st.composite
def transforms(draw: st.DrawFn) -> Transform:
    count = draw(st.sampled_from([None, None, 1, 2, 3]))
    steps = []
    for _ in range(draw(st.integers(0, 3))):
        kind = draw(st.sampled_from(["translate", "scale", "rotate", "reflect", "shear"]))
        width = {"rotate": 4, "shear": 6}.get(kind, 3)
        batched = count is not None and draw(st.booleans())
        lanes = []
        for _ in range(count if batched and count else 1):
            values = [0.0] * width
            if kind == "shear":
                values[draw(st.integers(0, 5))] = draw(numbers)
            else:
                values = [draw(numbers) for _ in range(width)]
            lanes.append(values)
        steps.append(Step(StepKind(kind), np.array(lanes if batched else lanes[0])))
    return Transform(tuple(steps))


@st.composite
def graphs(draw: st.DrawFn) -> Node:
    """A graph of up to a dozen nodes in which nodes are shared freely."""
    nodes: list[Node] = [
        Shape(ShapeKind.SPHERE, (1.0,), origin("ball")),
        Shape(ShapeKind.SPHERE, (1.0,)),
        Shape(ShapeKind.BOX, (-1.0, -1.0, -1.0, 1.0, 2.0, 3.0, 0.5), origin("box", 4)),
        Group(()),
    ]
    for number in range(draw(st.integers(1, 8))):
        child = draw(st.sampled_from(nodes))
        made = draw(st.sampled_from(["group", "instances", "bind"]))
        where = origin(*draw(st.sampled_from([("", None), ("a", None), ("b", 2)])), start=number)
        if made == "group":
            items = draw(st.lists(st.sampled_from(nodes), min_size=1, max_size=3))
            nodes.append(Group(tuple(items), where))
        elif made == "instances":
            transform = draw(transforms())
            indices = None
            if transform.count and draw(st.booleans()):
                indices = 10 * np.arange(transform.count)
            nodes.append(Instances(child, transform, indices, where))
        else:
            material = draw(st.sampled_from(MATERIALS))
            nodes.append(Bind(child, material, draw(st.booleans()), where))
    return nodes[-1]
