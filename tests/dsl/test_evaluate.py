"""The evaluator: sharing, origins, limits, and nothing but diagnostics."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dsl import scene
from dsl.budget import Limits
from dsl.diagnostics import Diagnostic
from dsl.evaluate import evaluate_source
from dsl.files import Files
from dsl.scene import Bind, Group, Instances, Node, Origin, SceneGraph, Shape
from dsl.spans import Source, Span

NO_FILES = Files(Path(__file__).parent)
SMALL = Limits(steps=5_000, call_depth=50, iterations=100, nodes=2_000, list_length=100)

WORDS = """
1 0 2.5 40deg true "s" #ff8000 x f sphere sphere() pi point_light() settings() [] {} matte(#ffffff)
+ - * / % < == .. and or
translate scale rotate_y rotate shear reflect matrix look_at transform material override inverse x
box cylinder wedge torus triangle glass camera sun sqrt min mix clamp random f length mesh count
"""
ATOMS, OPERATORS, MEMBERS, FUNCTIONS = (line.split() for line in WORDS.strip().split("\n"))

EXPRESSIONS = st.recursive(
    st.sampled_from(ATOMS),
    lambda inner: st.one_of(
        st.tuples(inner, st.sampled_from(OPERATORS), inner).map(lambda t: f"({' '.join(t)})"),
        st.tuples(inner, inner, inner).map(lambda t: f"({', '.join(t)})"),
        st.lists(inner, max_size=3).map(lambda items: f"[{', '.join(items)}]"),
        st.tuples(
            inner,
            st.sampled_from(MEMBERS),
            st.lists(inner, max_size=3),
        ).map(lambda t: f"{t[0]}.{t[1]}({', '.join(t[2])})"),
        st.tuples(
            st.sampled_from(FUNCTIONS),
            st.lists(inner, max_size=3),
        ).map(lambda t: f"{t[0]}({', '.join(t[1])})"),
        st.tuples(inner, inner).map(lambda t: f"{t[0]}[{t[1]}]"),
        st.tuples(inner, inner, inner).map(lambda t: f"if {t[0]} {{ {t[1]} }} else {{ {t[2]} }}"),
        st.tuples(inner, inner).map(lambda t: f"for i in {t[0]} {{ {t[1]} }}"),
        inner.map(lambda text: f"-{text}"),
    ),
    max_leaves=12,
)


def evaluate(text: str, limits: Limits = SMALL) -> tuple[SceneGraph | None, list[Diagnostic]]:
    return evaluate_source(Source("scene.ovo", text), NO_FILES, limits)


def root(text: str) -> Node:
    graph, diagnostics = evaluate(text, Limits())
    assert not diagnostics
    assert graph is not None
    return graph.root


@given(st.lists(EXPRESSIONS, min_size=1, max_size=4))
def test_any_program_gives_a_scene_or_diagnostics(expressions: list[str]) -> None:
    lines = ["let x = 3", "fn f(a, b = 2) { a + b }", *expressions]
    text = "\n".join(lines)
    graph, diagnostics = evaluate(text)
    assert (graph is None) == any(found.severity == "error" for found in diagnostics)
    for found in diagnostics:
        assert found.primary is not None
        assert isinstance(found.primary.place, Span)
        assert found.primary.place.end <= len(text.encode())


@given(st.lists(EXPRESSIONS, min_size=1, max_size=3))
def test_evaluation_is_deterministic(expressions: list[str]) -> None:
    text = "\n".join(["let x = 3", "fn f(a, b = 2) { a + b }", *expressions])
    assert evaluate(text)[1] == evaluate(text)[1]


@given(EXPRESSIONS)
def test_what_depends_on_a_fault_is_silent(expression: str) -> None:
    # `x` is faulty: whatever is made of it, the fault at its definition is the only one that
    # is due to it.
    silent = "let x = sphere(radius: -1)\nlet y = x.translate(x).material(x)\nlet z = [x, { x }]"
    _, alone = evaluate(silent)
    assert [found.code for found in alone] == ["value-out-of-range"]
    _, found = evaluate(f"{silent}\nlet w = y.scale(z[0]) + sqrt(x)\n{{ {expression} }}.scale(w)")
    assert sum(d.primary is not None and _line(d) < 4 for d in found) == 1


def _line(found: Diagnostic) -> int:
    assert found.primary is not None
    place = found.primary.place
    assert isinstance(place, Span)
    return place.source.text.count("\n", 0, place.start) + 1


def test_naming_is_sharing() -> None:
    group = root("let ball = sphere()\nball.translate(1, 0, 0)\nball.translate(2, 0, 0)")
    assert isinstance(group, Group)
    first, second = group.items
    assert isinstance(first, Instances)
    assert isinstance(second, Instances)
    assert first.child is second.child


def test_neighbouring_maps_are_one_node() -> None:
    instances = root("sphere().translate(1, 2, 3).rotate_y(90deg).scale(2)")
    assert isinstance(instances, Instances)
    assert isinstance(instances.child, Shape)
    steps = instances.transform.steps
    assert [step.kind for step in steps] == ["translate", "rotate", "scale"]
    np.testing.assert_array_equal(steps[1].values, [0.0, 1.0, 0.0, 90.0])


def test_a_chain_of_many_maps() -> None:
    instances = root("sphere()" + ".translate(1, 0, 0)" * 15_000)
    assert isinstance(instances, Instances)
    assert len(instances.transform.steps) == 15_000


def test_recursion_makes_deep_graphs_without_machine_recursion() -> None:
    node = root("fn f(o, n) { if n == 0 { o } else { f(o.scale(1), n - 1) } }\nf(sphere(), 900)")
    depth = 0
    while isinstance(node, Instances):
        node, depth = node.child, depth + 1
    assert isinstance(node, Shape)
    assert depth >= 900


def paths(node: Node) -> list[str]:
    """Object paths of the leaves, joined as `dsl.scene.Origin` says."""
    found: list[str] = []

    def walk(node: Node, path: tuple[str, ...]) -> None:
        origin = node.origin
        if isinstance(origin, Origin) and origin.label:
            index = "" if origin.index is None else f"[{origin.index}]"
            path = (*path, f"{origin.label}{index}")
        match node:
            case Group(items=items):
                for item in items:
                    walk(item, path)
            case Instances(child=child) | Bind(child=child):
                walk(child, path)
            case Shape():
                found.append("/".join(path))

    walk(node, ())
    return found


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("sphere()", ["sphere"]),
        ("let a = sphere()\na\na.scale(2).material(glass())", ["a", "a"]),
        ("let b = { sphere()\nbox() }\nb", ["b/sphere", "b/box"]),
        ("fn f() { sphere() }\nf()", ["f/sphere"]),
        ("let a = sphere()\nfor i in 4..6 { a.translate(i, 0, 0) }", ["a[0]", "a[1]"]),
        ("for i in 0..2 { if i == 1 { sphere() } else { box() } }", ["box[0]", "sphere[1]"]),
        ("for i in 0..1 { for j in 0..2 { sphere() } }", ["for[0]/sphere[0]", "for[0]/sphere[1]"]),
        ("for i in 0..2, j in 0..2 { plane() }", [f"plane[{i}]" for i in range(4)]),
        ("(if true { sphere() } else { box() }).scale(2)", ["sphere"]),
        (
            "for i in 0..2 { (if i < 1 { sphere() } else { box() }).translate(i, 0, 0) }",
            ["if[0]/sphere", "if[1]/box"],
        ),
        ("for i in 0..2 { { sphere() }.scale(2) }", ["block[0]/sphere", "block[1]/sphere"]),
        ("[sphere(), box()][1].scale(2)", ["list"]),
        ("for i in 0..2 { [sphere(), box()][i] }", ["list[0]", "list[1]"]),
        ("for i in 0..2 { for j in 0..1 { box() }.scale(2) }", ["for[0]/box[0]", "for[1]/box[0]"]),
        ("fn f(n) { if n > 0 { sphere()\nf(n - 1) } }\nf(2)", ["f/sphere", "f/f/sphere"]),
        (
            "let block = box()\nfn course() { for i in 0..8 { block.scale(i + 1) } }\n"
            "let dome = course()\nfor k in 0..4 { dome.translate(0, k, 0) }",
            [f"dome[{k}]/block[{i}]" for k in range(4) for i in range(8)],
        ),
        (
            "let block = box()\nfn course() { for i in 0..8 { block.scale(i + 1) } }\n"
            "let dome = { course() }\nfor k in 0..4 { dome.translate(0, k, 0) }",
            [f"dome[{k}]/course/block[{i}]" for k in range(4) for i in range(8)],
        ),
    ],
)
def test_object_paths(text: str, expected: list[str]) -> None:
    assert paths(root(text)) == expected


def test_the_results_of_a_loop_come_statement_by_statement() -> None:
    leaves = paths(root("for i in 0..2 { sphere()\nlet a = box()\na\nfor j in 0..2 { plane() } }"))
    assert leaves == [
        *["sphere[0]", "sphere[1]", "a[0]", "a[1]"],
        *[f"for[{i}]/plane[{j}]" for i in range(2) for j in range(2)],
    ]


@pytest.mark.parametrize(
    ("text", "limit"),
    [
        ("fn f() { f() }\nf()", "limit-call-depth"),
        ("fn f(n) { f(n - 1) + f(n - 1) }\nlet a = f(1)", "limit-call-depth"),
        ("for i in 0..1e300 { sphere() }", "limit-iterations"),
        ("for i in 0..1e300, j in 0..1e300 { sphere() }", "limit-iterations"),
        ("for i in 0..30 { for j in 0..30 { for k in 0..30 {} } }", "limit-steps"),
        ("for i in 0..99 { for j in 0..99 { let a = unknown + 1 } }", "name-unknown"),
        ("for i in 0..99 { let a = sphere(raduis: 1)\n{} }", "limit-steps"),
        ("let t = scale(1)" + " * scale(1)" * 50 + "\nsphere()" + ".transform(t)" * 99, "limit"),
        (
            "fn f(n) { for i in 0..30 { f2(n) } }\n"
            "fn f2(n) { for i in 0..30 { for j in 0..30 { {} } } }\nf(1)",
            "limit",
        ),
        ("for i in 0..99 { for j in 0..99 { sphere() } }", "limit"),
        ("fn f(l) { f(l + l) }\nlet a = f([1])", "limit-list-length"),
        ("fn f(t) { f(t * t) }\nlet a = f(scale(1))", "limit-list-length"),
    ],
)
def test_a_hostile_program_wastes_its_budget_only(text: str, limit: str) -> None:
    graph, diagnostics = evaluate(text)
    assert graph is None
    assert any(found.code.startswith(limit) for found in diagnostics)
    assert len(diagnostics) <= 2


@pytest.mark.parametrize(
    "text",
    [
        "camera(from: (1e308, 0, 0), at: (-1e308, 0, 0))",
        "sphere().look_at(from: (1e-320, 0, 0))",
        "triangle((-1e100, 0, 0), (1e100, 0, 0), (0, 1e100, 0))",
        "box(min: (-1e100, 0, 0), max: (1e100, 1, 1), bevel: 0.5)",
        "cone(radius: 1e100, height: 1e100)",
        "cone(radius: 1e-100, height: 1e100, bevel: 1e-101)",
        "for i in 0..1e300, j in 0..0 { sphere() }",
        "sphere(radius: 1e-100).scale(1e-300).translate(1e300, 0, 0).rotate_x(1e300deg)",
        "wedge(r: 1e-9..1, y: 0..1, phi: -1e9deg..(-1e9deg + 359.999deg))",
    ],
)
def test_extremes_are_ordinary(text: str) -> None:
    root(text)


@pytest.mark.parametrize(
    ("text", "code"),
    [
        ("let a = dot((1e300, 1e300), (1e300, -1e300))", "value-not-finite"),
        ("let a = length((1.5e308, 1.5e308))", "value-not-finite"),
        ("let a = glow(rgb(1e300, 0, 0), strength: 1e300)", "value-not-finite"),
        ("let a = mix(-1e308, 1e308, 1e308)", "value-not-finite"),
        ("let a = 1e300deg * 1e300", "value-not-finite"),
        ("let a = exp(1000)", "value-not-finite"),
        ("let a = mod(1, 0)", "value-division-by-zero"),
        ("let a = 1 % 0", "value-division-by-zero"),
        ("let a = (1, 2) / 0", "value-division-by-zero"),
        ("let a = pow(0, -1)", "value-domain"),
    ],
)
def test_no_value_is_infinite(text: str, code: str) -> None:
    graph, diagnostics = evaluate(text)
    assert graph is None
    assert [found.code for found in diagnostics] == [code]


def test_nested_sharing_costs_nothing() -> None:
    lets = [f"let a{i + 1} = {{ a{i}\na{i} }}" for i in range(200)]
    graph, diagnostics = evaluate("\n".join(["let a0 = sphere()", *lets, "a200"]))
    assert not diagnostics
    assert graph is not None


@given(st.floats(-1e6, 1e6), st.floats(-1e6, 1e6))
def test_random_depends_on_its_arguments_alone(a: float, b: float) -> None:
    text = f"sphere(radius: 1 + random({a!r}, {b!r}))"
    first, again = root(text), root("\n".join(["let n = random(7)", text]))
    assert isinstance(first, Shape)
    assert isinstance(again, Shape)
    assert first.parameters == again.parameters
    assert 1.0 <= first.parameters[0] < 2.0


def test_random_is_spread_evenly() -> None:
    group = root("for i in 0..2000 { sphere().translate(random(1, i), 0, 0) }")
    assert isinstance(group, Group)
    (batch,) = group.items
    assert isinstance(batch, Instances)
    values = batch.transform.steps[0].values[:, 0]
    counts, _ = np.histogram(values, bins=16, range=(0.0, 1.0))
    # Chi square with 15 degrees of freedom: above 38 once in a thousand seeds; this one is fixed.
    assert np.sum((counts - 125.0) ** 2 / 125.0) < 38.0
    assert abs(np.corrcoef(values[1:], values[:-1])[0, 1]) < 3.3 / math.sqrt(2000)


def test_an_empty_file_is_an_empty_scene() -> None:
    node = root("")
    assert isinstance(node, Group)
    assert node.items == ()


def test_settings_keep_what_is_not_said() -> None:
    node = root("settings(width: 64)")
    assert isinstance(node, scene.Settings)
    assert (node.width, node.height, node.precision) == (64, None, None)


def test_a_file_that_was_given_up_is_reported_once(tmp_path: Path) -> None:
    (tmp_path / "deep.ovo").write_text("let a = " + "(" * 1_000)
    (tmp_path / "mid.ovo").write_text('use "deep.ovo" as deep\nlet b = deep.a')
    text = 'use "deep.ovo" as deep\nuse "mid.ovo" as mid\nsphere(radius: deep.a + mid.b)'
    graph, diagnostics = evaluate_source(Source("scene.ovo", text), Files(tmp_path))
    assert graph is None
    assert [found.code for found in diagnostics] == ["limit-nesting"]


def test_a_file_is_evaluated_once(tmp_path: Path) -> None:
    (tmp_path / "ball.ovo").write_text("let ball = sphere()")
    text = 'use "ball.ovo" as a\nuse "./ball.ovo" as b\na.ball\nb.ball'
    graph, diagnostics = evaluate_source(Source("scene.ovo", text), Files(tmp_path))
    assert not diagnostics
    assert graph is not None
    assert isinstance(graph.root, Group)
    first, second = graph.root.items
    assert isinstance(first, Instances)
    assert isinstance(second, Instances)
    assert first.child is second.child
    assert set(graph.sources) == {"scene.ovo", "ball.ovo"}
