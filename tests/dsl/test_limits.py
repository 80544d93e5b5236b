"""Limits of bevels: the inequalities against the geometry that they come from."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from dsl.limits import broken_limit, largest_bevel
from dsl.scene import SHAPE_PARAMETERS, ShapeKind

LENGTH = st.floats(1e-3, 1e3)


def with_bevel(kind: ShapeKind, parameters: tuple[float, ...], bevel: float) -> tuple[float, ...]:
    assert SHAPE_PARAMETERS[kind][-1] == "bevel"
    return (*parameters[:-1], bevel)


def solids() -> st.SearchStrategy[tuple[ShapeKind, tuple[float, ...]]]:
    return st.one_of(
        st.tuples(LENGTH, LENGTH, LENGTH).map(lambda s: (ShapeKind.BOX, (0.0, 0.0, 0.0, *s, 0.0))),
        st.tuples(LENGTH, LENGTH).map(lambda s: (ShapeKind.CYLINDER, (s[0], 0.0, s[1], 0.0))),
        st.tuples(LENGTH, LENGTH).map(lambda s: (ShapeKind.CONE, (*s, 0.0))),
        st.tuples(LENGTH, LENGTH, LENGTH).map(
            lambda s: (ShapeKind.RING, (s[0], s[0] + s[1], 0.0, s[2], 0.0))
        ),
        st.tuples(LENGTH, LENGTH, LENGTH, st.floats(1.0, 359.0)).map(
            lambda s: (ShapeKind.WEDGE, (s[0], s[0] + s[1], 0.0, s[2], 10.0, 10.0 + s[3], 0.0))
        ),
    )


@given(solids())
def test_the_largest_bevel_is_the_last_that_is_allowed(
    solid: tuple[ShapeKind, tuple[float, ...]],
) -> None:
    kind, plain = solid
    limit = largest_bevel(kind, plain)
    assert limit > 0.0
    assert broken_limit(kind, plain) is None
    assert broken_limit(kind, with_bevel(kind, plain, limit * (1.0 - 1e-12))) is None
    broken = broken_limit(kind, with_bevel(kind, plain, limit * (1.0 + 1e-12)))
    assert broken is not None
    assert broken.code == "value-bevel"
    assert broken.parameters == ("bevel",)


@given(LENGTH, LENGTH)
def test_the_cone_s_limit_is_the_inscribed_circle(r: float, h: float) -> None:
    bevel = largest_bevel(ShapeKind.CONE, (r, h, 0.0))
    # The circle about (0, bevel) touches the side, the line from (r, 0) to (0, h).
    distance = abs(h * r - r * bevel) / math.hypot(r, h)
    assert distance == pytest.approx(bevel, rel=1e-12)


@given(st.floats(0.1, 10.0), st.floats(0.1, 10.0), st.floats(5.0, 175.0))
def test_the_wedge_s_limit_is_where_its_bore_shrinks_to_nothing(
    r0: float, thickness: float, span: float
) -> None:
    parameters = (r0, r0 + thickness, 0.0, 1e9, 0.0, span, 0.0)
    bevel = largest_bevel(ShapeKind.WEDGE, parameters)
    alpha = math.degrees(math.asin(bevel / (r0 + bevel)))
    if 2.0 * bevel < thickness * (1.0 - 1e-9):
        assert 2.0 * alpha == pytest.approx(span, rel=1e-9)
    else:
        assert 2.0 * alpha <= span * (1.0 + 1e-9)


def test_the_message_has_the_values() -> None:
    broken = broken_limit(ShapeKind.RING, (1.0, 2.0, 0.0, 0.2, 0.15))
    assert broken is not None
    assert broken.message == "2·bevel = 0.3 exceeds y1 − y0 = 0.2"


def test_nearly_equal_values_are_shown_to_differ() -> None:
    broken = broken_limit(ShapeKind.CYLINDER, (1.0, 0.0, 4.0, 1.0 + 1e-9))
    assert broken is not None
    assert broken.message == "bevel = 1.000000001 exceeds radius = 1"


@pytest.mark.parametrize("kind", list(ShapeKind))
@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_no_parameter_is_infinite(kind: ShapeKind, value: float) -> None:
    for index in range(len(SHAPE_PARAMETERS[kind])):
        parameters = [1.0] * len(SHAPE_PARAMETERS[kind])
        parameters[index] = value
        broken = broken_limit(kind, parameters)
        assert broken is not None
        assert broken.code == "value-not-finite"


@given(st.sampled_from(list(ShapeKind)), st.data())
def test_any_numbers_give_an_answer(kind: ShapeKind, data: st.DataObject) -> None:
    parameters = data.draw(
        st.lists(st.floats(), min_size=(n := len(SHAPE_PARAMETERS[kind])), max_size=n)
    )
    broken_limit(kind, parameters)
