"""What is out of range: left out of the IR with a warning, so that all that is kept can be hit."""

from __future__ import annotations

from typing import get_args

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import ovolo
from compiler import expand
from compiler.compilation import compile_text
from dsl.diagnostics import Diagnostic
from dsl.scene import Precision
from dsl.spans import Span
from runtime.reference import ReferenceTracer

PRECISIONS: tuple[Precision, ...] = get_args(Precision)


def warnings(text: str) -> list[Diagnostic]:
    return [w for w in compile_text(text).warnings if w.code.startswith("scene-")]


@given(
    st.sampled_from(["sphere", "box", "torus", "disc", "cone"]),
    st.floats(-99, 99),
    st.floats(-130, 130),
    st.floats(-130, 130),
    st.sampled_from(PRECISIONS),
)
@settings(max_examples=25, deadline=None)
def test_what_is_not_left_out_is_hit(
    shape: str, size: float, scale: float, away: float, precision: Precision
) -> None:
    r = repr(10.0**size)
    arguments = {"box": f"({r}, {r}, {r})", "torus": f"{r}, {r} / 4", "cone": f"{r}, {r}"}
    text = f"{shape}({arguments.get(shape, r)})"
    text += f".scale({10.0**scale!r}).translate(0, {10.0**away!r}, 0)"
    # A ball around which nothing is left out, and which an object out of range would hide.
    scene = ovolo.compile(f"sphere()\n{text}")
    kept = len(scene.ir.instance_target)
    assert len(scene.warnings) == 2 - kept
    tracer = scene.tracer(precision=precision)
    y, reach = 10.0**away, 10.0 ** (size + scale)
    assert tracer.trace([[0.0, 0.0, 2.0]], [[0.0, 0.0, -1.0]]).hit[0]
    if kept == 2 and max(reach, 1.0) * 1e-5 < y < reach * 1e5 and shape != "torus":
        above = [[0.1 * reach, y + 3.0 * reach, 0.07 * reach]]
        assert tracer.trace(above, [[0.0, -1.0, 0.0]]).hit[0]


@pytest.mark.parametrize(
    "text",
    [
        "sphere().scale(1e100)",
        "sphere().scale(1e-100)",
        "sphere(1e100)",
        "sphere().translate(0, 0, 9e99)",
        "sphere().translate(1e200, 0, 0).translate(-1e200, 0, 0)",
        "{ { sphere(1e-90).scale(1e30) }.scale(1e30) }.scale(1e30)",
        "plane().scale(1e99)",
        "point_light(position: (9e99, 0, 0))",
        "rectangle_light(size: (1e100, 1))",
        "sky().translate(1e200, 0, 0)",
    ],
)
def test_what_is_just_in_range_is_kept(text: str) -> None:
    assert not warnings(text)


@pytest.mark.parametrize(
    ("text", "place"),
    [
        ("sphere().scale(1.1e100)", "sphere().scale(1.1e100)"),
        ("sphere(1e60).scale(1e60)", "sphere(1e60).scale(1e60)"),
        ("sphere().translate(0, -2e100, 0)", "sphere().translate(0, -2e100, 0)"),
        ("torus(1e100, 1e99)", "torus(1e100, 1e99)"),
        ("box().scale(0.9e-100)", "box().scale(0.9e-100)"),
        ("plane().translate(0, 2e100, 0)", "plane().translate(0, 2e100, 0)"),
        ("triangle((0, 0, 0), (1e60, 0, 0), (0, 1e60, 0)).scale(1e41)", None),
        ("{ sphere().scale(1e60) }.scale(1e60)", "sphere().scale(1e60)"),
        ("for i in 0..100 { sphere().translate(0, i * 1e100, 0) }", None),
        ("point_light(position: (2e100, 0, 0))", None),
        ("point_light().translate(2e100, 0, 0)", None),
        ("camera(from: (0, 0, 2e100))", None),
        ("camera(from: (0, 0, 5)).scale(1e101)", None),
        ("camera(from: (0, 0, 5)).scale(1e-101)", None),
    ],
)
def test_what_is_out_of_range_is_told(text: str, place: str | None) -> None:
    (warning,) = warnings(text)
    assert warning.code == "scene-out-of-range"
    if place is not None:
        assert warning.primary is not None
        start = text.index(place)
        span = warning.primary.place
        assert isinstance(span, Span)
        assert (span.start, span.end) == (start, start + len(place))


@pytest.mark.parametrize("power", [30, 45, -30, -45])
def test_products_of_kept_groups_count(power: int, monkeypatch: pytest.MonkeyPatch) -> None:
    text = f"""\
let a = {{ for i in 0..8 {{ sphere().translate(3 * i, 0, 0) }} }}
let b = {{ for i in 0..8 {{ a.scale(1e{power}).translate(i, 0, 0) }} }}
let c = {{ for i in 0..8 {{ b.scale(1e{power}).translate(i, 0, 0) }} }}
for i in 0..8 {{ c.scale(1e{power}).translate(i, 0, 0) }}
sphere()
"""
    flat = compile_text(text)
    monkeypatch.setattr(expand, "FLATTEN_LEAVES", 10)
    monkeypatch.setattr(expand, "FLATTEN_ROWS", 10)
    kept = compile_text(text)
    assert len(kept.ir.group_ranges) == (4 if abs(power) == 30 else 1)
    assert np.any(kept.ir.instance_target >= 0)
    for compilation in (flat, kept):
        told = [w.code for w in compilation.warnings if w.code.startswith("scene")]
        assert told == ([] if abs(power) == 30 else ["scene-out-of-range"])


def test_what_has_no_inverse_and_what_is_out_of_range_is_counted_apart() -> None:
    pruned = compile_text("sphere().scale(1e101)\nbox().scale(1, 0, 1)\nbox()").pruned
    assert (pruned.singular_instances, pruned.out_of_range_instances) == (1, 1)


def left_out_by_the_interpreter(text: str) -> bool:
    """Whether the reference interpreter has nothing of a program's only object."""
    scene = compile_text(text)
    interpreter = ReferenceTracer(scene.graph, number="mpmath")
    interpreter.trace(np.zeros((1, 3)), np.ones((1, 3)), np.zeros(1), np.full(1, np.inf))
    return not interpreter.materials


POWERS = st.integers(-120, 120).map(lambda power: f"3e{power}")


@given(
    st.sampled_from(
        [
            "sphere(#)",
            "box(size: (1, #, 2))",
            "torus(#, 2e-100)",
            "plane()",
            "both",
            "wedge(r: 1e-99..#, y: 0..1e-99, phi: 0deg..300deg)",
        ]
    ),
    st.lists(
        st.sampled_from(
            (
                *(".scale(#)", ".scale(1, #, -1)", ".translate(1, #, 0)", ".shear(xy: #)"),
                *(
                    ".rotate_x(30deg)",
                    ".transform(scale(#, 2, 1).inverse())",
                    ".reflect((1, 0, 2))",
                ),
                ".matrix(1, 2, 0, #, 0, 1, 0, 0, 0, 0, #, 0)",
            )
        ),
        max_size=4,
    ),
    st.data(),
)
@settings(max_examples=60, deadline=None)
def test_the_interpreter_leaves_out_the_same(
    shape: str, maps: list[str], data: st.DataObject
) -> None:
    words = "".join((shape, *maps)).split("#")
    text = words[0] + "".join(data.draw(POWERS) + word for word in words[1:])
    text = "let both = box().translate(1e20, 0, 0)\n" * ("both" in text) + text
    try:
        leaves = len(compile_text(text).ir.instance_target)
    except ovolo.CompileError:
        return  # the shape itself is too large or too small
    assert left_out_by_the_interpreter(text) is (leaves == 0)


def test_the_interpreter_leaves_out_the_same_of_a_batch() -> None:
    """Of boxes in one another the outermost that is left is hit."""
    scene = compile_text("for i in 0..200 { box().scale(pow(10, i)) }")
    last = len(scene.ir.instance_target) - 1
    assert 95 < last < 101
    rays = np.array([[0.0, 0.0, 1e101]]), np.array([[0.0, 0.0, -1.0]])
    always = np.zeros(1), np.full(1, np.inf)
    _, _, _, instance, _, _ = ReferenceTracer(scene.graph).trace(*rays, *always)
    assert instance[0] == last
