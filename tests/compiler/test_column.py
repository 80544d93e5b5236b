"""Columns of integers against lists."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from compiler.column import Column

NUMBERS = st.integers(-(2**31), 2**31 - 1)


@given(st.integers(0, 20), st.lists(st.one_of(NUMBERS, st.lists(NUMBERS, max_size=20))))
def test_columns_hold_what_was_put_into_them(room: int, additions: list[int | list[int]]) -> None:
    column, expected = Column(room), list[int]()
    for addition in additions:
        if isinstance(addition, int):
            column.append(addition)
            column.extend(addition, 3)
            expected += [addition] * 4
        else:
            column.extend(np.array(addition, dtype=np.int64), len(addition))
            expected += addition
        assert len(column) == len(expected)
    assert column.numbers.tolist() == expected
