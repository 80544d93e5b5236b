"""A tracer that is updated answers as a new one, whatever was edited."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from benchmarks.random_scenes import random_rays, random_scene
from compiler.flatten import flatten
from compiler.ir import SceneIR
from dsl.scene import Group, Instances, Mesh, Node, SceneGraph, Step, StepKind, Transform
from runtime._kernel import Kernel
from runtime.reference import ReferenceTracer
from runtime.tracer import Tracer


def compiled(root: Node) -> SceneIR:
    ir = flatten(SceneGraph(root), lambda file: (None, [])).ir
    assert ir is not None
    return ir


def moved(node: Node, *by: float) -> Node:
    return Instances(node, Transform((Step(StepKind.TRANSLATE, np.array(by)),)))


def assert_same(ir: SceneIR, updated: Tracer, precision: str, seed: int) -> None:
    graph = random_scene(seed)
    rays = random_rays(graph, 300, seed)
    assert precision in ("float32", "float64")
    fresh = Tracer(ir, "float32" if precision == "float32" else "float64")
    expected, found = fresh.trace(*rays), updated.trace(*rays)
    for name in ("t", "instance", "position", "normal", "prototype", "material", "offset"):
        np.testing.assert_array_equal(getattr(found, name), getattr(expected, name), name)


@pytest.mark.parametrize("precision", ["float32", "float64"])
@pytest.mark.parametrize("seed", range(12))
def test_an_updated_tracer_answers_as_a_new_one(seed: int, precision: str) -> None:
    """From one scene to: itself, itself moved, parts of it moved, and quite another one."""
    root, other = random_scene(seed).root, random_scene(seed + 1000).root
    tracer = Tracer(compiled(root), "float32" if precision == "float32" else "float64")
    edits = (
        root,
        moved(root, 0.1, -0.2, 0.3),
        Group((root, moved(root, 0.5, 0, 0))),
        Group((other, moved(root, 0, 0.25, 0))),
        other,
    )
    for edited in edits:
        ir = compiled(edited)
        tracer = tracer.updated(ir)
        assert_same(ir, tracer, precision, seed)


def test_meshes_are_shared_and_what_differs_is_not() -> None:
    """A mesh costs its tree once, wherever it stands; one point of it moved makes it another."""
    rng = np.random.default_rng(2)
    points = rng.normal(size=(3000, 3))
    mesh = Mesh(points, rng.integers(3000, size=(20_000, 3)))
    tracer = Tracer(compiled(mesh))
    bent = points.copy()
    bent[7] += 0.5
    target = np.array([[0, 0, 9.0]]), np.array([[0, 0, -1.0]])
    for root in (moved(mesh, 0.1, 0, 0), Group((moved(mesh, 0.1, 0, 0), moved(mesh, 4, 0, 0)))):
        ir = compiled(root)
        found = tracer.updated(ir).trace(*target)
        assert found.t[0] == Tracer(ir).trace(*target).t[0]
    ir = compiled(Mesh(bent, mesh.triangles))
    o = bent[7] + [0, 0, 9.0]
    np.testing.assert_array_equal(
        tracer.updated(ir).trace(o, (0, 0, -1)).t, Tracer(ir).trace(o, (0, 0, -1)).t
    )


def test_materials_alone_change_the_picture_and_nothing_else() -> None:
    ir = compiled(random_scene(3).root)
    kernel = Kernel(ir, "float32")
    materials = ir.materials.copy()
    materials["emission"] = 7.0
    lit = kernel.updated(dataclasses.replace(ir, materials=materials))
    rays = random_rays(random_scene(3), 100, 0)
    for before, after in zip(kernel.trace(*rays), lit.trace(*rays), strict=True):
        np.testing.assert_array_equal(before, after)


def test_hostile_arrays_are_refused_and_the_old_tracer_stays() -> None:
    ir = compiled(random_scene(4).root)
    tracer = Tracer(ir)
    wrong = ir.instance_target.copy()
    wrong[0] = 10_000
    with pytest.raises(ValueError, match="unknown target"):
        tracer.updated(dataclasses.replace(ir, instance_target=wrong))
    tracer.trace((0, 0, 9), (0, 0, -1))


def test_only_tracers_of_the_kernel_are_updated() -> None:
    graph = random_scene(5)
    with pytest.raises(ValueError, match="kernel"):
        Tracer.over(ReferenceTracer(graph)).updated(compiled(graph.root))
