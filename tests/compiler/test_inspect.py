"""Figures and bounds."""

from __future__ import annotations

import numpy as np
import pytest

from compiler.bounds import bounds
from compiler.flatten import flatten
from compiler.inspect import summarize
from compiler.ir import SceneIR
from dsl.scene import (
    Camera,
    Group,
    Instances,
    Mesh,
    Node,
    SceneGraph,
    Shape,
    ShapeKind,
    Sky,
    Step,
    StepKind,
    Sun,
    Transform,
)
from tests.compiler.graphs import ball, placed, step


def flat(root: Node) -> SceneIR:
    ir = flatten(SceneGraph(root), lambda file: (None, [])).ir
    assert ir is not None
    return ir


@pytest.mark.parametrize(
    ("kind", "parameters", "box"),
    [
        (ShapeKind.SPHERE, (2.0,), [[-2, -2, -2], [2, 2, 2]]),
        (ShapeKind.CYLINDER, (2.0, -1.0, 3.0, 0.5), [[-2, -1, -2], [2, 3, 2]]),
        (ShapeKind.CONE, (2.0, 3.0, 0.0), [[-2, 0, -2], [2, 3, 2]]),
        (ShapeKind.TORUS, (2.0, 0.5), [[-2.5, -0.5, -2.5], [2.5, 0.5, 2.5]]),
        (ShapeKind.DISC, (2.0,), [[-2, 0, -2], [2, 0, 2]]),
        (ShapeKind.RECTANGLE, (2.0, 4.0), [[-1, 0, -2], [1, 0, 2]]),
        (ShapeKind.TRIANGLE, (0, 0, 0, 1, 2, 0, 0, 0, 3), [[0, 0, 0], [1, 2, 3]]),
        (ShapeKind.RING, (1.0, 2.0, 0.0, 1.0, 0.0), [[-2, 0, -2], [2, 1, 2]]),
        (ShapeKind.WEDGE, (1.0, 2.0, 0.0, 1.0, 0.0, 90.0, 0.0), [[0, 0, 0], [2, 1, 2]]),
        (ShapeKind.WEDGE, (1.0, 2.0, 0.0, 1.0, -90.0, 180.0, 0.0), [[-2, 0, -2], [2, 1, 2]]),
        (
            ShapeKind.WEDGE,
            (1.0, 2.0, 0.0, 1.0, 330.0, 390.0, 0.0),
            [[-1, 0, 3**0.5 / 2], [1, 1, 2]],
        ),
    ],
)
def test_shapes_have_their_boxes(
    kind: ShapeKind, parameters: tuple[float, ...], box: list[list[float]]
) -> None:
    found = bounds(flat(Shape(kind, parameters)))
    assert found is not None
    assert found == pytest.approx(np.array(box), abs=1e-15)


def test_bounds_follow_transforms_through_kept_groups_and_skip_planes() -> None:
    node: Node = Group((ball(), Shape(ShapeKind.PLANE, ()), Mesh(np.eye(3), np.array([[0, 1, 2]]))))
    for _ in range(3):
        shifts = np.column_stack([np.arange(200.0), np.zeros((200, 2))])
        node = Instances(node, Transform((Step(StepKind.TRANSLATE, shifts),)))
    ir = flat(placed(node, step("scale", 2, 1, 1), step("translate", 0, 5, 0)))
    assert len(ir.group_ranges) > 1
    found = bounds(ir)
    assert found is not None
    assert found.tolist() == [[-2, 4, -1], [2 * 597 + 2, 6, 1]]


def test_nothing_bounded_has_no_bounds() -> None:
    assert bounds(flat(Group(()))) is None
    assert bounds(flat(Shape(ShapeKind.PLANE, ()))) is None


def test_the_summary_counts() -> None:
    items = (ball(), placed(ball(), step("translate", 1, 0, 0)), ball(2.0))
    skies = (Sky((1, 1, 1)), Sky((1, 1, 1), None, "a.exr"))
    appearance = (Sun((1, 0, 0), (1, 1, 1)), *skies, Camera("perspective", 1))
    summary = summarize(flat(Group((*items, Mesh(np.eye(3), np.array([[0, 1, 2]])), *appearance))))
    assert (summary.leaves, summary.instances) == (4, 4)
    assert summary.groups == 1
    assert summary.prototypes == {"sphere": 2, "mesh": 1}
    assert summary.lights == {"sun": 1, "sky": 2}
    assert summary.skies == ("a.exr",)
    assert (summary.mesh_points, summary.mesh_triangles, summary.cameras) == (3, 1, 1)
    assert summary.bounds == ((-2.0, -2.0, -2.0), (2.0, 2.0, 2.0))
    assert summarize(flat(Group(()))).instance_bytes == 0
