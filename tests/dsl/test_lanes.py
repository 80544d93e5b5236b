"""Loops evaluated in all iterations at once, judged by evaluating them one by one."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from compiler.flatten import flatten
from compiler.ir import SceneIR
from compiler.ir_text import print_ir
from compiler.provenance import object_path, source_place
from dsl import lanes
from dsl.diagnostics import Diagnostic
from dsl.evaluate import evaluate_source
from dsl.files import Files
from dsl.scene import SceneGraph
from dsl.spans import Source

EXAMPLES = Path(__file__).parent.parent.parent / "examples"


def compiled(text: str, fewest: int) -> tuple[SceneGraph | None, SceneIR | None, list[Diagnostic]]:
    """The scene of a program whose loops of so many iterations are evaluated at once."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(lanes, "FEWEST", fewest)
        graph, found = evaluate_source(Source("scene.ovo", text), Files(EXAMPLES))
    if graph is None:
        return None, None, found
    ir, more, _ = flatten(graph, lambda file: (None, []))
    return graph, ir, found + more


def compare(text: str) -> None:
    """Both ways give one scene to the last bit, with the same paths and places, or one fault."""
    judge, expected, faults = compiled(text, 10**9)
    graph, ir, found = compiled(text, 1)
    assert found == faults
    if expected is None or ir is None or judge is None or graph is None:
        assert ir is expected
        return
    assert print_ir(ir) == print_ir(expected)
    for column in ("world_from_object", "object_from_world", "translation_low"):
        np.testing.assert_array_equal(getattr(ir, column), getattr(expected, column))
    for leaf in range(len(expected.instance_target)):
        assert object_path(ir, leaf) == object_path(expected, leaf)
        assert source_place(ir, leaf, graph.sources) == source_place(expected, leaf, judge.sources)


NUMBERS = st.recursive(
    st.sampled_from(["i", "j", "k", "1", "2.5", "-3", "0.1", "r[1]", "v.y"]),
    lambda inner: st.one_of(
        st.tuples(inner, st.sampled_from(["+", "-", "*", "/", "%"]), inner).map(
            lambda t: f"({t[0]} {t[1]} {t[2]})"
        ),
        inner.map(lambda x: f"(-{x})"),
        inner.map(lambda x: f"abs({x})"),
        inner.map(lambda x: f"sin({x} * 10deg)"),
        inner.map(lambda x: f"floor({x})"),
        st.tuples(inner, inner).map(lambda t: f"min({t[0]}, {t[1]})"),
        st.tuples(inner, inner).map(lambda t: f"random({t[0]}, {t[1]})"),
        inner.map(lambda x: f"w[floor(abs({x})) % 3]"),
        inner.map(lambda x: f"({x}, 1, k).x"),
        st.tuples(inner, inner).map(lambda t: f"(if {t[0]} < 1.5 {{ {t[1]} }} else {{ i }})"),
    ),
    max_leaves=4,
)
CONDITIONS = st.recursive(
    st.tuples(NUMBERS, st.sampled_from(["<", "<=", ">", ">=", "==", "!="]), NUMBERS).map(" ".join),
    lambda inner: st.one_of(
        st.tuples(inner, st.sampled_from(["and", "or"]), inner).map(
            lambda t: f"({t[0]}) {t[1]} ({t[2]})"
        ),
        inner.map(lambda x: f"not ({x})"),
    ),
    max_leaves=3,
)
MAPS = st.one_of(
    st.tuples(NUMBERS, NUMBERS).map(lambda t: f".translate({t[0]}, {t[1]}, 1)"),
    NUMBERS.map(lambda x: f".translate(({x}, 2, 3))"),
    NUMBERS.map(lambda x: f".scale(1 + abs({x}))"),
    NUMBERS.map(lambda x: f".rotate_y({x} * 7deg)"),
    NUMBERS.map(lambda x: f".rotate(axis: (1, 2, abs({x})), angle: 30deg)"),
    NUMBERS.map(lambda x: f".transform(rotate_x(10deg * {x}) * translate(1, {x}, 0))"),
    NUMBERS.map(lambda x: f".transform(translate({x}, 1, 0).inverse())"),
    st.sampled_from([".shear(xy: 0.5)", ".reflect((0, 1, 0))", ".material(clay)"]),
    NUMBERS.map(lambda x: f".override(matte(rgb(abs({x}) % 1, 0.5, 0.5)))"),
    NUMBERS.map(lambda x: f".material(if {x} > 1 {{ clay }} else {{ gold }})"),
)
BASES = st.one_of(
    st.sampled_from(
        ["sphere()", "pair", "leaf", "box(bevel: 0.1)", "one(i)", "two(j)", "three(k)"]
    ),
    NUMBERS.map(lambda x: f"sphere(radius: 1 + abs(floor({x})) % 3)"),
    NUMBERS.map(lambda x: f"one({x})"),
)
OBJECTS = st.tuples(BASES, st.lists(MAPS, max_size=4).map("".join)).map("".join)
STATEMENTS = st.recursive(
    OBJECTS,
    lambda inner: st.one_of(
        st.tuples(CONDITIONS, inner).map(lambda t: f"if {t[0]} {{\n{t[1]}\n}}"),
        st.tuples(CONDITIONS, inner, inner).map(
            lambda t: f"if {t[0]} {{\n{t[1]}\n}} else {{\n{t[2]}\n}}"
        ),
        st.tuples(inner, inner).map(lambda t: f"{{\n{t[0]}\n{t[1]}\n}}"),
        st.tuples(NUMBERS, inner).map(lambda t: f"{{\nlet k = {t[0]}\n{t[1]}\n}}"),
        inner.map(lambda x: f"for k in 0..3 {{\n{x}\n}}"),
        st.tuples(OBJECTS, inner).map(lambda t: f"let leaf = {t[0]}\n{t[1]}"),
    ),
    max_leaves=4,
)
HEAD = """
let clay = matte(rgb(0.8, 0.5, 0.4))
let gold = metal(rgb(1, 0.8, 0.3))
let r = [1, 2, 3]
let w = [0.5, 2, 4]
let v = (1, 2, 3)
let k = 2
let leaf = cone().rotate_z(20deg)
let pair = {
  sphere()
  box().translate(0, 2, 0)
}
fn one(x) { torus().translate(x, 0, 0) }
fn two(x, y = x * 2) {
  cylinder().scale(1, 1 + abs(y), 1)
  pair.translate(0, 0, x)
}
fn three(x) { if x > 1 { three(x - 1).translate(1, 0, 0) } else { disc() } }
"""


@settings(max_examples=150, deadline=None)
@given(st.lists(STATEMENTS, min_size=1, max_size=3))
def test_random_programs(body: list[str]) -> None:
    compare(f"{HEAD}for i in 0..4, j in [1, 3, 2] {{\n" + "\n".join(body) + "\n}")


@pytest.mark.parametrize("path", sorted(EXAMPLES.glob("*.ovo")), ids=lambda path: path.name)
def test_examples(path: Path) -> None:
    compare(path.read_text())
