"""Arrays over HTTP as NumPy's .npz: hostile archives cost no more than their own length."""

from __future__ import annotations

import io
import zipfile
import zlib
from collections.abc import Mapping
from tokenize import TokenError

import numpy as np
from numpy.typing import NDArray

from server.problems import Problem

_DAMAGE = (
    zipfile.BadZipFile,
    zlib.error,
    ValueError,
    TypeError,
    RuntimeError,
    EOFError,
    TokenError,
)
"""Whatever zipfile and NumPy raise for damaged, encrypted, or unknown content."""

_MEMBER = b"PK\x01\x02"
"""What begins the entry of a member in an archive's directory."""

_NUMPY_WRITES = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)

_MOST_MEMBERS = 64
"""An archive of many empty members takes ten times its length to open."""


def read_npz(body: bytes, max_bytes: int) -> dict[str, NDArray[np.generic]]:
    """The arrays of an archive that unpacks to no more than `max_bytes`.

    Raises the problem 422 for anything else: no archive, pickled objects, headers that promise
    more than the archive holds.
    """
    if body.count(_MEMBER) > _MOST_MEMBERS:
        raise Problem(422, "invalid-body", f"an archive has at most {_MOST_MEMBERS} members")
    try:
        with zipfile.ZipFile(io.BytesIO(body)) as archive:
            members = archive.infolist()
            if sum(member.file_size for member in members) > max_bytes:
                raise Problem(
                    413, "body-too-large", f"the arrays take more than {max_bytes} bytes unpacked"
                )
            if any(member.compress_type not in _NUMPY_WRITES for member in members):
                raise ValueError("it is compressed by another method than NumPy's")
            # A member is never read past its stated size, so the sum above holds.
            return {
                member.filename.removesuffix(".npy"): _array(archive.read(member))
                for member in members
            }
    except _DAMAGE as error:
        raise Problem(
            422, "invalid-body", f"this is not an .npz of plain arrays: {error}"
        ) from None


def _array(content: bytes) -> NDArray[np.generic]:
    stream = io.BytesIO(content)
    version = np.lib.format.read_magic(stream)
    read_header = {
        (1, 0): np.lib.format.read_array_header_1_0,
        (2, 0): np.lib.format.read_array_header_2_0,
    }.get(version)
    if read_header is None:
        raise ValueError(f"unknown version {version} of the .npy format")
    shape, fortran_order, dtype = read_header(stream)
    if dtype.hasobject:
        raise ValueError("it holds pickled objects")
    if not dtype.itemsize:
        raise ValueError("its elements have no size")
    count = 1
    for length in shape:
        count *= length
    values = np.frombuffer(content, np.uint8, offset=stream.tell())
    if count < 0 or count * dtype.itemsize != len(values):
        raise ValueError(f"an array of shape {shape} and type {dtype} has not {len(values)} bytes")
    return values.view(dtype).reshape(shape, order="F" if fortran_order else "C")


def write_npz(arrays: Mapping[str, NDArray[np.generic]]) -> bytes:
    """The archive of some arrays, uncompressed."""
    stream = io.BytesIO()
    np.savez(stream, **arrays)  # type: ignore[arg-type]  # the stub takes names for allow_pickle
    return stream.getvalue()
