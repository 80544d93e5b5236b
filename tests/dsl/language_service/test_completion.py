from __future__ import annotations

import pytest

from dsl.language_service.completion import Completion, completions
from tests.dsl.language_service.editing import at_cursor


def offered(text: str, **others: str) -> dict[str, Completion]:
    return {item.label: item for item in completions(*at_cursor(text, **others))}


def best(text: str) -> set[str]:
    found = offered(text)
    first = min(item.order for item in found.values())
    return {label for label, item in found.items() if item.order == first}


def test_names_in_scope_and_no_others() -> None:
    found = offered(
        "let early = 1\n"
        "fn outer(count) {\n  let inner = 2\n  for i in 0..count {\n    ‸\n  }\n}\n"
        "fn late() { sphere() }\nlet after = 3\n"
    )
    assert {"early", "outer", "count", "inner", "i", "late", "sphere", "pi", "time"} <= found.keys()
    assert "after" not in found


def test_what_is_typed_is_replaced() -> None:
    item = offered("let größe = 1\nlet b = grö‸ + 2")["größe"]
    assert (item.start, item.end) == (24, 28)


@pytest.mark.parametrize(
    ("text", "labels"),
    [
        ("sphere().‸", {"translate", "rotate_y", "material", "override", "transform"}),
        ("let a = box().translate(1, 2, 3)\na.tr‸", {"translate", "material"}),
        ("let v = (1, 2)\nlet x = v.‸", {"x", "y"}),
        ("let c = #d2b48c\nc.‸", {"r", "g", "b"}),
        ("let t = rotate_x(10deg) * scale(2)\nlet u = t.‸", {"inverse"}),
        ("(0..3).‸", {"start", "end"}),
        ("camera(from: (0, 0, 5)).‸", {"look_at", "translate"}),
        ("fn f() { box() }\nf().‸\nsphere()", {"material"}),
        ("let a = { sphere()\nbox() }\nfor i in 0..3 { a\n  .‸ }", {"material"}),
        ("fn f(shape) {\n  shape.‸\n}", {"material", "translate"}),
    ],
)
def test_members_and_methods_by_kind(text: str, labels: set[str]) -> None:
    found = offered(text)
    assert labels <= found.keys()
    assert "sphere" not in found


def test_no_methods_of_a_vector_and_no_material_of_a_light() -> None:
    assert offered("let v = (1, 2)\nv.‸").keys() == {"x", "y"}
    assert "material" not in offered("sun(direction: (0, -1, 0)).‸")


def test_names_of_a_used_file() -> None:
    found = offered(
        'use "bricks.ovo" as bricks\nbricks.‸', bricks="/// white\nlet snow = matte(color: #fff0f0)"
    )
    assert found.keys() == {"snow"}
    assert found["snow"].doc == "white"


def test_parameters_of_the_call_that_are_not_given_yet() -> None:
    assert best("camera(from: (0, 1, 2), ‸") >= {"at:", "up:", "fov:", "height:"}
    assert "from:" not in offered("camera(from: (0, 1, 2), ‸)")
    assert best("sphere().rotate_y(‸)") == {"angle:"}
    assert best("fn f(a, b) { sphere() }\nf(1, ‸)") == {"b:"}
    assert "radius:" not in offered("sphere(radius: ‸)")
    assert "radius:" not in offered("sphere(1 + ‸)")


def test_materials_come_first_where_one_is_due() -> None:
    text = "let clay = matte(color: #aa8866)\nlet n = 3\nsphere().material(m: ‸)"
    assert best(text) == {"clay"}
    found = offered(text)
    assert found["plastic"].order < found["sphere"].order


def test_units_behind_a_number() -> None:
    assert offered("sphere().rotate_x(45‸)").keys() == {"deg", "rad", "turn"}
    item = offered("let a = 4.5d‸")["deg"]
    assert (item.start, item.end) == (11, 12)
    assert "deg" not in offered("let a = x45‸")


def test_snippets_ask_for_what_is_needed() -> None:
    found = offered("‸")
    assert found["sphere"].snippet == "sphere($1)"
    assert found["plane"].snippet == "plane()"
    assert found["wedge"].snippet == "wedge(r: ${1:r}, y: ${2:y}, phi: ${3:phi})"
    assert found["for"].snippet.startswith("for ${1:i} in")
    assert offered("sph‸(1)")["sphere"].snippet == "sphere"


@pytest.mark.parametrize(
    "text",
    [
        "// sph‸", "/* sph‸ */", "let a = 1 // ‸", 'let a = "sph‸"', "let ‸", "fn ‸", "for ‸",
        "/* open ‸", "fn f(a, ‸",
    ],
)  # fmt: skip
def test_nothing_in_comments_strings_and_new_names(text: str) -> None:
    assert offered(text) == {}


def test_statements_only_where_one_begins() -> None:
    assert "let" in offered("‸")
    assert "let" in offered("for i in 0..2 {\n  ‸\n}")
    assert "let" not in offered("sphere(‸)")
    assert {"and", "or"} <= offered("let a = b ‸").keys()
