"""Shapes that differ in size alone: where they are one unit, and that it is the same solid."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from compiler.bounds import bounds
from compiler.compilation import compile_text
from compiler.ir import SceneIR
from dsl import lanes, sizes
from dsl.scene import ShapeKind

SHAPES = (
    "sphere(radius: 1 + i)",
    "disc(radius: 0.1 + i)",
    "box(size: (1, 1 + i, 0.3))",
    "cylinder(radius: 2, y: 0..(1 + i))",
    "cylinder(radius: 1 + i, y: (-0.7)..0.7)",
    "cone(radius: 1 + i, height: 3)",
)


def one_by_one(text: str, monkeypatch: pytest.MonkeyPatch) -> SceneIR:
    with monkeypatch.context() as patch:
        patch.setattr(lanes, "FEWEST", 10**9)
        return compile_text(text).ir


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("count", [sizes.MOST, sizes.MOST + 1])
def test_many_are_one_unit_whichever_way_they_are_made(
    shape: str, count: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    text = f"for i in 0..{count} {{ {shape}.translate(i, 0, 0).rotate_y(7deg * i) }}"
    scene, expected = compile_text(text).ir, one_by_one(text, monkeypatch)
    assert len(scene.prototype_kind) == (1 if count > sizes.MOST else count)
    for name in ("prototype_kind", "shape_parameters", "instance_target", "world_from_object"):
        np.testing.assert_array_equal(getattr(scene, name), getattr(expected, name))
    with monkeypatch.context() as patch:
        patch.setattr(sizes, "MOST", 10**9)
        apart = compile_text(text).ir
    corners, others = bounds(scene), bounds(apart)
    assert corners is not None
    assert others is not None
    np.testing.assert_allclose(corners, others, rtol=1e-15, atol=1e-14)


def test_a_size_that_no_iteration_of_a_branch_has_is_left_out(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    text = """
    let clay = matte(rgb(0.8, 0.5, 0.4))
    let gold = metal(rgb(1, 0.8, 0.3))
    for i in 0..100 {
      let leaf = sphere(radius: 1 + i % 3).shear(xy: 0.2)
      if i % 3 != 1 { leaf.material(if i >= 50 { clay } else { gold }) }
    }
    """
    scene, expected = compile_text(text).ir, one_by_one(text, monkeypatch)
    assert len(scene.prototype_kind) == 2
    for name in ("prototype_kind", "shape_parameters", "instance_target", "instance_material"):
        np.testing.assert_array_equal(getattr(scene, name), getattr(expected, name))


@pytest.mark.parametrize(
    "shape", ["box(size: (2, 2, 1 + i), bevel: 0.1)", "box(min: (0, 0, 0), max: (1, 1, 1 + i))"]
)
def test_others_stay_what_they_are(shape: str, monkeypatch: pytest.MonkeyPatch) -> None:
    text = f"for i in 0..100 {{ {shape} }}"
    scene, expected = compile_text(text).ir, one_by_one(text, monkeypatch)
    assert len(scene.prototype_kind) == len(expected.prototype_kind) == 100


def test_sizes_that_are_no_sizes_are_told_as_one_by_one(monkeypatch: pytest.MonkeyPatch) -> None:
    from dsl.diagnostics import CompileError

    text = "for i in 0..100 { sphere(radius: 50 - i) }"
    told = []
    for make in (compile_text, lambda text: one_by_one(text, monkeypatch)):
        with pytest.raises(CompileError) as caught:
            make(text)
        told.append(caught.value.diagnostics)
    assert told[0] == told[1]
    assert "with i = 50" in str(told[0])


@given(
    st.sampled_from(ShapeKind),
    st.lists(st.floats(1e-3, 1e3), min_size=9, max_size=9),
)
def test_a_scaled_unit_has_the_parameters_to_the_last_bit(
    kind: ShapeKind, numbers: list[float]
) -> None:
    a, b, c = numbers[:3]
    parameters = {
        ShapeKind.SPHERE: (a,),
        ShapeKind.DISC: (a,),
        ShapeKind.BOX: (-a, -b, -c, a, b, c, 0.0),
        ShapeKind.CYLINDER: (a, -b, b, 0.0),
        ShapeKind.CONE: (a, b, 0.0),
    }.get(kind)
    if parameters is None:
        assert sizes.unit_of(kind, numbers) is None
        return
    unit = sizes.unit_of(kind, parameters)
    assert unit is not None
    (x, y, z), axes = unit[1], {"box": "xyzxyz", "cylinder": "xyy", "cone": "xy"}.get(kind, "x")
    scales = {"x": x, "y": y, "z": z}
    assert (
        tuple(scales[axis] * size for axis, size in zip(axes, unit[0], strict=False))
        == parameters[: len(axes)]
    )
