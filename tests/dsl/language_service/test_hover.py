from __future__ import annotations

import pytest

from dsl.language_service.hover import hover
from dsl.language_service.signature import signature_help
from dsl.language_service.values import evaluate_program
from tests.dsl.language_service.editing import at_cursor


def shown(text: str, **others: str) -> str:
    project, program, offset = at_cursor(text, **others)
    found = hover(project, program, offset, evaluate_program(project, program).values)
    return "" if found is None else found.markdown


def test_a_function_with_its_documentation_and_that_of_its_parameters() -> None:
    text = (
        "/// A ring of bricks.\nfn course(\n  /// how many\n  count,\n  tilt = 1deg,\n) { box() }\n"
    )
    assert shown(text + "cou‸rse(3)") == (
        "```ovolo\nfn course(count, tilt: 1deg)\n```\n\nA ring of bricks.\n\n- `count`: how many"
    )
    assert shown(text + "course(cou‸nt: 3)") == "```ovolo\ncount // a parameter\n```\n\nhow many"


def test_a_let_with_its_value() -> None:
    text = "/// half of it\nlet half = (1, 2, 3) * 0.5\nsphere(radius: half‸.x)"
    assert shown(text) == (
        "```ovolo\nlet half = (1, 2, 3) * 0.5\n// = (0.5, 1, 1.5)\n```\n\nhalf of it"
    )


def test_builtins_come_from_the_table_of_the_evaluator() -> None:
    assert shown("sph‸ere()") == (
        "```ovolo\nsphere(radius: 1) → an object\n```\n\nA ball about the origin."
    )
    assert "camera(from, at: (0, 0, 0), up: (0, 1, 0), height," in shown("‸camera()")
    assert "ball that rounds the edges" in shown("box(bev‸el: 0.1)")
    assert "Turns about the y axis" in shown("box().rotate‸_y(1deg)")
    assert "Binds a material" in shown("box().material‸(m)")
    assert "time" in shown("sphere(radius: ti‸me)")


def test_members_of_files() -> None:
    found = shown(
        'use "b.ovo" as b\nbox().material(b.snow‸)', b="/// white\nlet snow = matte(#fff000)"
    )
    assert found == "```ovolo\nlet snow = matte(#fff000)\n// a material\n```\n\nwhite"


@pytest.mark.parametrize("text", ["sphere(‸)", "let a = 1‸2", "// sph‸ere", "un‸known()", "‸"])
def test_nothing_where_there_is_nothing_to_say(text: str) -> None:
    assert shown(text) == ""


@pytest.mark.parametrize(
    ("text", "label", "parameter"),
    [
        ("sphere(‸", "sphere(radius: 1) → an object", 0),
        ("wedge(0..1, ‸)", "wedge(r, y, phi, bevel: 0) → an object", 1),
        ("wedge(0..1, phi: ‸)", "wedge(r, y, phi, bevel: 0) → an object", 2),
        ("box(min: (0, 0, 0), ‸", "box(min, max, bevel: 0) → an object", 1),
        ("box().translate(1, ‸2)", "translate(x: 0, y: 0, z: 0) → a transform", 1),
        ("min(1, 2, 3, ‸)", "min(x, …) → a value of the same kind", 1),
        ("fn f(a, b = [1, 2]) { box() }\nf([1, (2)], ‸", "f(a, b: [1, 2])", 1),
        ("sphere(1, 2, ‸)", "sphere(radius: 1) → an object", None),
        ("for i in 0..3 {\n  sphere(max(1,\n    ‸", "max(x, …) → a value of the same kind", 1),
        ("sphere(max(1, 2), ‸", "sphere(radius: 1) → an object", None),
    ],
)
def test_signature_help(text: str, label: str, parameter: int | None) -> None:
    found = signature_help(*at_cursor(text))
    assert found is not None
    assert found.forms[found.active].text == label
    assert found.parameter == parameter


@pytest.mark.parametrize(
    "text", ["(1 + ‸)", "sphere()‸", "// sphere(‸", "let f = {‸}", "g(‸)", "fn f(‸"]
)
def test_no_signature_outside_calls(text: str) -> None:
    assert signature_help(*at_cursor(text)) is None


def test_parameters_of_the_program() -> None:
    text = "/// how many\nparam count = 2 * 12 in 3..60\n"
    assert shown(text + "sphere(radius: cou‸nt)") == (
        "```ovolo\nparam count = 2 * 12 in 3..60\n// = 24\n```\n\nhow many"
    )
