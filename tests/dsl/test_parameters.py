"""Parameters: what each type can be set to, from Python and as text."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from dsl.evaluate import evaluate_source
from dsl.files import Files
from dsl.parameters import Setting, unknown_settings
from dsl.scene import Param, Plain
from dsl.spans import Source


def params(text: str, **settings: Setting) -> tuple[list[Param], list[str]]:
    """The parameters of a program without faults, or the codes of its faults."""
    graph, found = evaluate_source(Source("scene.ovo", text), Files(), settings=settings)
    return list(graph.params if graph else ()), [each.code for each in found]


def value(default: str, setting: Setting) -> Plain | None:
    """What a parameter with that default is when it is set; None for a fault."""
    found, codes = params(f"param p = {default}", p=setting)
    assert bool(found) is not bool(codes)
    return found[0].value if found else None


@pytest.mark.parametrize(
    ("default", "setting", "expected"),
    [
        ("1", 2, 2.0),
        ("1", "-2.5e3", -2500.0),
        ("1", True, None),
        ("1", "true", None),
        ("1", math.inf, None),
        ("1", "1 + 1", None),
        ("1", "30deg", None),
        ("true", False, False),
        ("true", "false", False),
        ("true", 0, None),
        ('"a"', "12", "12"),
        ('"a"', 12, None),
        ("1deg", "0.25turn", "90deg"),
        ("1deg", "-30deg", "-30deg"),
        ("1deg", 30, None),
        ("(1, 2)", "(3, -4)", (3.0, -4.0)),
        ("(1, 2)", [3, 4], (3.0, 4.0)),
        ("(1, 2)", (1, 2, 3), None),
        ("(1, 2)", (1, math.nan), None),
        ("(1, 2)", "(1, 2, 3)", None),
        ("#ffffff", "#000000", (0.0, 0.0, 0.0)),
        ("#ffffff", "rgb(1, 0.5, 0)", (1.0, 0.5, 0.0)),
        ("#ffffff", (0.5, 0.5, 0.5), (0.5, 0.5, 0.5)),
        ("#ffffff", "(1, 1, 1)", None),
        ("#ffffff", "red", None),
    ],
)
def test_a_setting_has_the_type_of_the_default(
    default: str, setting: Setting, expected: Plain | None
) -> None:
    assert value(default, setting) == expected


def test_tools_are_told_what_a_parameter_may_be() -> None:
    found, _ = params(
        "/// Turns.\nparam a = 1turn in 0deg..2turn\nparam b = 2 in [1, 2, 3]\nlet c = a", a="90deg"
    )
    assert found == [
        Param("a", "90deg", "360deg", "0deg", "720deg", (), "Turns."),
        Param("b", 2.0, 2.0, None, None, (1.0, 2.0, 3.0)),
    ]


def test_the_ends_of_an_interval_are_allowed() -> None:
    for setting, codes in ((3, []), (60, []), (2.9, ["value-out-of-range"])):
        assert params("param n = 24 in 3..60", n=setting)[1] == codes


def test_a_setting_without_a_parameter_is_a_fault() -> None:
    assert params("let n = 24", n=3)[1] == ["name-unknown-setting"]
    assert [found.code for found in unknown_settings(None, {"n": 3})] == ["name-unknown-setting"]


@given(st.text(max_size=30) | st.floats() | st.booleans() | st.lists(st.floats(), max_size=5))
def test_any_setting_is_taken_or_refused(setting: Setting) -> None:
    for default in ("1", "1deg", '"a"', "(1, 2, 3)", "#ffffff", "true"):
        value(default, setting)
