"""The word that was meant."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from dsl.builtins import BUILTINS
from dsl.suggest import did_you_mean

LONG = [name for name in BUILTINS if len(name) > 5 and not name.startswith("rotate")]
KNOWN = [*BUILTINS, "deg", "rad", "turn", "Radius"]


@pytest.mark.parametrize(
    ("word", "meant"),
    [
        ("spere", "sphere"),
        ("shpere", "sphere"),
        ("Sphere", "sphere"),
        ("rotateX", "rotate_x"),
        ("pointLight", "point_light"),
        ("raduis", "Radius"),
        ("degrees", "deg"),
        ("cube", "box"),
        ("sqr", "sqrt"),
        ("colr", None),
        ("missing", None),
        ("undefined", None),
        ("teapot", None),
        ("q", None),
    ],
)
def test_the_word_that_was_meant(word: str, meant: str | None) -> None:
    assert did_you_mean(word, KNOWN) == (meant and f"did you mean `{meant}`?")


def test_what_others_call_it_is_named_only_where_it_is_known() -> None:
    assert did_you_mean("cube", ["sphere"]) is None


@given(st.sampled_from(LONG), st.data())
def test_one_wrong_letter_is_forgiven(name: str, data: st.DataObject) -> None:
    place = data.draw(st.integers(0, len(name) - 1))
    letter = data.draw(st.sampled_from("qjz"))
    for typed in (
        name[:place] + letter + name[place + 1 :],
        name[:place] + name[place + 1 :],
        name[:place] + letter + name[place:],
    ):
        assert did_you_mean(typed, BUILTINS) == f"did you mean `{name}`?" or typed in BUILTINS
