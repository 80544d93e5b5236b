from __future__ import annotations

import io
import zipfile
from contextlib import suppress
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays
from numpy.typing import NDArray

from server.npz import read_npz, write_npz
from server.problems import Problem

LIMIT = 1 << 20


def archive(member: bytes, method: int = zipfile.ZIP_DEFLATED, copies: int = 1) -> bytes:
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", method) as file:
        for number in range(copies):
            file.writestr(f"{number}.npy", member)
    return stream.getvalue()


def header(text: str) -> bytes:
    """An array of that description, which holds nothing."""
    words = text.encode() + b"\n"
    return b"\x93NUMPY\x01\x00" + len(words).to_bytes(2, "little") + words


def npy(array: NDArray[Any], allow_pickle: bool = False) -> bytes:
    stream = io.BytesIO()
    np.save(stream, array, allow_pickle=allow_pickle)
    return stream.getvalue()


@settings(max_examples=50)
@given(
    arrays.arrays(
        arrays.floating_dtypes() | arrays.integer_dtypes() | arrays.unicode_string_dtypes(),
        arrays.array_shapes(min_dims=0, min_side=0),
    ),
    st.booleans(),
)
def test_arrays_go_there_and_back(array: NDArray[Any], fortran: bool) -> None:
    array = np.asfortranarray(array) if fortran and array.ndim else array
    back = read_npz(write_npz({"rays": array}), LIMIT)["rays"]
    np.testing.assert_array_equal(back, array)
    assert back.dtype == array.dtype


@settings(max_examples=100)
@given(st.data())
def test_damaged_archives_are_a_problem_or_arrays(data: st.DataObject) -> None:
    body = bytearray(write_npz({"origins": np.zeros((4, 3)), "source": np.array("sphere()")}))
    for _ in range(data.draw(st.integers(1, 4))):
        body[data.draw(st.integers(0, len(body) - 1))] = data.draw(st.integers(0, 255))
    with suppress(Problem):
        read_npz(bytes(body), LIMIT)


@pytest.mark.parametrize(
    ("body", "status"),
    [
        (b"", 422),
        (b"PK\x03\x04 not really", 422),
        (archive(b"no header"), 422),
        (archive(npy(np.array([{}], object), allow_pickle=True)), 422),
        (archive(npy(np.zeros(3))[:-1]), 422),
        (archive(npy(np.zeros(3)) + b"x"), 422),
        (archive(npy(np.zeros(3)).replace(b"(3,)", b"(9" + b"9" * 40 + b",)")), 422),
        (archive(npy(np.zeros(3)).replace(b"(3,), ", b"(-3,),")), 422),
        (archive(npy(np.zeros(4 * LIMIT, np.uint8))), 413),
        (archive(npy(np.zeros(3)), copies=65), 422),
        (archive(npy(np.zeros(3)), zipfile.ZIP_BZIP2), 422),
        (archive(npy(np.zeros(3)), zipfile.ZIP_LZMA), 422),
        (archive(header("{'descr':'<U0','fortran_order':False,'shape':(1000000000000,)}")), 422),
        (archive(header("{'descr':'|V0','fortran_order':False,'shape':(1000000000000,)}")), 422),
        (archive(header("(" * 900)), 422),
        (archive(header("-" * 5000 + "1")), 422),
    ],
)
def test_hostile_archives_are_problems(body: bytes, status: int) -> None:
    with pytest.raises(Problem) as caught:
        read_npz(body, LIMIT)
    assert caught.value.status == status


class Bomb:
    def __reduce__(self) -> tuple[object, ...]:
        return (pytest.fail, ("unpickled",))


def test_an_array_of_pickles_runs_no_code() -> None:
    with pytest.raises(Problem, match="pickled"):
        read_npz(archive(npy(np.array([Bomb()], object), allow_pickle=True)), LIMIT)
