"""Transform stacks against usd-core's own composition."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

OPS = [
    "translate",
    "scale",
    "rotateX",
    "rotateY",
    "rotateZ",
    *("rotate" + axes for axes in ("XYZ", "XZY", "YXZ", "YZX", "ZXY", "ZYX")),
    "orient",
    "transform",
    "translateX",
    "translateZ",
    "scaleY",
]
PRECISIONS = ["double", "float", "half"]
NUMBERS = st.floats(0.25, 4.0).map(lambda x: round(x, 3))


@st.composite
def stacks(draw: Any) -> list[tuple[str, str, list[float], bool, bool]]:
    """Operations as (name, precision, numbers, whether inverted too, whether listed twice)."""
    stack = []
    for number in range(draw(st.integers(0, 4))):
        kind = draw(st.sampled_from(OPS))
        numbers = [
            draw(NUMBERS) * draw(st.sampled_from([-1.0, 1.0, 10.0]))
            for _ in range(16 if kind == "transform" else 4)
        ]
        precision = "double" if kind == "transform" else draw(st.sampled_from(PRECISIONS))
        # usd-core 26.11 takes -2 for the inverse of a single-axis scale by 2.
        inverted = draw(st.booleans()) and kind != "scaleY"
        stack.append((f"{kind}:op{number}", precision, numbers, inverted, draw(st.booleans())))
    return stack


def author(prim: Any, stack: list[tuple[str, str, list[float], bool, bool]], reset: bool) -> None:
    """Write a stack onto a prim, inverses of `inverted` operations at its end."""
    from pxr import Gf, Sdf, Vt

    order = ["!resetXformStack!"] if reset else []
    inverted: list[str] = []
    for name, precision, numbers, inverse, twice in stack:
        kind = name.split(":")[0]
        suffix = {"double": "d", "float": "f", "half": "h"}[precision]
        value: Any
        if kind == "orient":
            type_name = f"quat{suffix}"
            quaternion = Gf.Quatd(numbers[0], *numbers[1:]).GetNormalized()
            value = getattr(Gf, f"Quat{suffix}")(quaternion)
        elif kind == "transform":
            type_name = "matrix4d"
            rows = np.array(numbers).reshape(4, 4) + 8.0 * np.eye(4)
            rows[:, 3] = (0.0, 0.0, 0.0, 1.0)
            value = Gf.Matrix4d(rows.tolist())
        elif kind in ("translate", "scale") or len(kind) == len("rotateXYZ"):
            type_name = f"{precision}3"
            value = getattr(Gf, f"Vec3{suffix}")(*numbers[:3])
        else:
            type_name = precision
            value = numbers[0]
        attribute = prim.CreateAttribute(f"xformOp:{name}", getattr(Sdf.ValueTypeNames, {
            "double3": "Double3", "float3": "Float3", "half3": "Half3", "matrix4d": "Matrix4d",
            "quatd": "Quatd", "quatf": "Quatf", "quath": "Quath",
            "double": "Double", "float": "Float", "half": "Half",
        }[type_name]))  # fmt: skip
        attribute.Set(value)
        order += [f"xformOp:{name}"] * (2 if twice else 1)
        if inverse:
            inverted.insert(0, f"!invert!xformOp:{name}")
    prim.CreateAttribute("xformOpOrder", Sdf.ValueTypeNames.TokenArray).Set(
        Vt.TokenArray(order + inverted)
    )


@settings(max_examples=40, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.lists(st.tuples(stacks(), st.booleans()), min_size=1, max_size=4))
def test_any_stack_composes_as_usd_core_composes_it(
    load: Callable[..., Any], tmp_path: Path, levels: list[tuple[Any, bool]]
) -> None:
    from pxr import Usd, UsdGeom

    stage = Usd.Stage.CreateInMemory()
    path = ""
    for number, (stack, reset) in enumerate(levels):
        path += f"/level{number}"
        author(UsdGeom.Xform.Define(stage, path).GetPrim(), stack, reset and number > 0)
        # Whatever is typeless or a Scope passes transforms through.
        path += "/pass"
        stage.DefinePrim(path, "Scope" if number % 2 else "")
    prim = UsdGeom.Cube.Define(stage, path + "/cube").GetPrim()
    file = tmp_path / "stack.usda"
    stage.Export(str(file))

    (leaf,) = load(file).leaves
    expected = np.array(UsdGeom.XformCache().GetLocalToWorldTransform(prim)).T
    scale = np.abs(expected[:3]).max()
    assert leaf.path == path + "/cube"
    np.testing.assert_allclose(leaf.world, expected, atol=1e-11 * scale)


def test_only_the_order_counts(load: Callable[..., Any]) -> None:
    (leaf,) = load("""
def Cube "c" {
    double3 xformOp:translate = (1, 2, 3)
    double3 xformOp:translate:unlisted = (100, 0, 0)
    uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:missing"]
}
def Cube "none" (active = false) {
    double3 xformOp:translate = (1, 2, 3)
}
""").leaves
    assert leaf.world[:3, 3].tolist() == [1.0, 2.0, 3.0]


def test_places_stay_in_double_far_from_the_origin(load: Callable[..., Any]) -> None:
    (leaf,) = load("""
def Xform "far" {
    double3 xformOp:translate = (123456789.123456789, 0, 0)
    uniform token[] xformOpOrder = ["xformOp:translate"]
    def Cube "c" {
        double3 xformOp:translate = (0.1, 0, 0)
        uniform token[] xformOpOrder = ["xformOp:translate"]
    }
}
""").leaves
    assert leaf.world[0, 3] == pytest.approx(123456789.223456789, rel=1e-16)


@pytest.mark.parametrize(
    "order",
    [
        '"!resetXformStack!", "xformOp:translate"',
        '"xformOp:scale", "!resetXformStack!", "xformOp:translate"',
    ],
)
@pytest.mark.parametrize("instanced", [False, True])
def test_a_reset_drops_all_parents_even_out_of_an_instance(
    load: Callable[..., Any], order: str, instanced: bool
) -> None:
    imported = load(f"""
class Xform "car" {{
    def Cube "wheel" {{
        double3 xformOp:scale = (7, 7, 7)
        double3 xformOp:translate = (0, 5, 0)
        uniform token[] xformOpOrder = [{order}]
    }}
    def Cube "body" {{
    }}
}}
def Xform "a" (instanceable = {str(instanced).lower()}
    inherits = </car>
) {{
    double3 xformOp:translate = (100, 0, 0)
    uniform token[] xformOpOrder = ["xformOp:translate"]
}}
""")
    assert imported.leaf("/a/wheel").world[:3, 3].tolist() == [0.0, 5.0, 0.0]
    assert imported.leaf("/a/wheel").world[0, 0] == 1.0
    assert imported.leaf("/a/body").world[:3, 3].tolist() == [100.0, 0.0, 0.0]


def test_quaternions_far_from_unit_are_normalised(load: Callable[..., Any]) -> None:
    (leaf,) = load("""
def Cube "c" {
    quatf xformOp:orient = (3, 0, 0, 3)
    uniform token[] xformOpOrder = ["xformOp:orient"]
}
""").leaves
    np.testing.assert_allclose(leaf.world[:3, :3] @ [1, 0, 0], [0, 1, 0], atol=1e-15)


def test_zero_scales_and_values_without_sense_do_not_stop_anything(
    load: Callable[..., Any],
) -> None:
    imported = load("""
def Cube "flat" {
    double3 xformOp:scale = (1, 0, 1)
    uniform token[] xformOpOrder = ["xformOp:scale"]
}
def Cube "nan" {
    double3 xformOp:translate = (nan, 0, 0)
    double3 xformOp:translate:good = (0, 1, 0)
    uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:translate:good"]
}
""")
    assert np.ptp(imported.leaf("/flat").node.points[:, 1]) == 0.0
    assert imported.leaf("/nan").world[:3, 3].tolist() == [0.0, 1.0, 0.0]
    assert imported.said("no finite value").primary.place.prim == "/nan"


def test_a_single_axis_scale_inverts_to_its_reciprocal(load: Callable[..., Any]) -> None:
    (leaf,) = load("""
def Cube "c" {
    double xformOp:scaleY = 4
    uniform token[] xformOpOrder = ["!invert!xformOp:scaleY"]
}
""").leaves
    assert np.diag(leaf.world).tolist() == [1.0, 0.25, 1.0, 1.0]


@pytest.mark.parametrize("name", ["xformOp:shear:x", "translate", "", "xformOp:translate:", "é"])
def test_names_that_cannot_be_in_an_order_leave_the_others(
    load: Callable[..., Any], name: str
) -> None:
    imported = load(f"""
def Xform "above" {{
    double3 xformOp:translate = (9, 9, 9)
    uniform token[] xformOpOrder = ["xformOp:translate"]
    def Cube "c" {{
        double3 xformOp:translate = (0, 5, 0)
        double3 xformOp:scale = (2, 2, 2)
        double3 xformOp:shear:x = (1, 1, 1)
        uniform token[] xformOpOrder = ["xformOp:scale", "!resetXformStack!", "{name}",
            "xformOp:translate", "!invert!xformOp:scale"]
    }}
}}
""")
    (leaf,) = imported.leaves
    assert leaf.world[:3].tolist() == [[0.5, 0, 0, 0], [0, 0.5, 0, 5], [0, 0, 0.5, 0]]
    assert {d.primary.place.prim for d in imported.diagnostics} == {"/above/c"}
