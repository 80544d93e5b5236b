"""Advice: given where it is due, and nowhere in our examples."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import ovolo
from compiler.advice import MOST_ADVICE, advise
from compiler.flatten import flatten
from dsl.scene import Mesh, Origin, SceneGraph
from dsl.spans import Source, Span

EXAMPLES = Path(__file__).parent.parent.parent / "examples"
CAMERA = "camera(from: (0, 0, 10), at: (0, 0, 0), fov: 20deg)\n"


def advice(text: str) -> list[str]:
    return [f"{w.code}: {w.message}" for w in ovolo.compile(text).warnings]


@pytest.mark.parametrize("path", sorted(EXAMPLES.glob("*.ovo")), ids=lambda path: path.name)
def test_examples_need_none(path: Path) -> None:
    assert ovolo.compile_file(path).warnings == ()


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("let a = 1\nsphere()", "advice-unused: nothing uses `a`"),
        ("fn f(a) { sphere() }\nf(1)", "advice-unused: nothing uses `a`"),
        ("param a = 1", "advice-unused: nothing uses `a`"),
        ("let a = 1\n{\n let a = 2\n sphere(a)\n}\nsphere(a)", "`a` hides another `a`"),
        ("for i in 0..2 { for i in 0..1 { sphere().translate(i, 0, 0) } }", "`i` hides another"),
        ("let s = sphere()\ns\ns", "advice-coincident: this stands exactly"),
        ("for i in 0..40 { sphere().translate(i % 20, 0, 0) }", "advice-coincident: 20 instances"),
        ("let g = { box().translate(3, 0, 0)\nsphere() }\ng\ng", "advice-coincident"),
        ("sphere().scale(1, 1e-9, 1)", "advice-condition"),
        (CAMERA + "sphere().translate(0, 0, 20)", "advice-outside: no camera sees this"),
        (CAMERA + "for i in 0..3 { sphere().translate(90 + i, 0, 0) }", "any of the 3 instances"),
    ],
)
def test_advice_is_given(text: str, expected: str) -> None:
    assert any(expected in each for each in advice(text)), advice(text)


@pytest.mark.parametrize(
    "text",
    [
        "",
        "let _a = 1\nsphere()",
        "for i in 0..2, j in 0..2 { sphere().translate(i, j, 0) }",
        "let r = 1\n{\n let r = r + 1\n sphere(r)\n}\nsphere(r)",
        "let box = box()\nbox",
        "fn f(n) { if n > 0 { f(n - 1).translate(1, 0, 0) } else { sphere() } }\nf(3)",
        "sphere()\nbox()",
        "sphere().scale(1e-20)\nsphere().scale(1e20).rotate_x(30deg)",
        CAMERA + "plane()\nsphere().scale(1000)\nbox().translate(3, 2, 0)",
        CAMERA + "for i in 0..40 { sphere().translate(4 * i, 0, 0) }",
        "camera(from: (0, 0, 10), height: 2)\nsphere().translate(0, 0, -90)",
    ],
)
def test_no_advice_without_need(text: str) -> None:
    assert advice(text) == []


def test_advice_is_limited() -> None:
    assert len(advice("".join(f"let a{i} = {i}\n" for i in range(100)))) == MOST_ADVICE


def test_the_names_of_used_files_are_for_others(tmp_path: Path) -> None:
    (tmp_path / "parts.ovo").write_text("let ball = sphere()\nlet cube = box()\n")
    (tmp_path / "scene.ovo").write_text('use "parts.ovo" as parts\nparts.ball\n')
    assert ovolo.compile_file(tmp_path / "scene.ovo").warnings == ()


@pytest.mark.parametrize(("height", "codes"), [(0.0, ["advice-no-area"]), (1.0, [])])
def test_meshes_without_area(height: float, codes: list[str]) -> None:
    points = np.array([[0.0, 0, 0], [1, 0, 0], [2, height, 0]])
    origin = Origin(Span(Source("a.ovo", "mesh()"), 0, 6))
    ir = flatten(
        SceneGraph(Mesh(points, np.array([[0, 1, 2]]), origin)), lambda file: (None, [])
    ).ir
    assert ir is not None
    assert [found.code for found in advise(ir, {})] == codes
