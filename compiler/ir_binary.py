"""SceneIR ↔ a binary file that is mapped into memory, not parsed.

    8 bytes    b"OVOLO-IR"
    uint32     version, number of arrays
    per array  24 bytes name, 8 bytes dtype, uint64 rows, uint64 offset
    …          the arrays, C-contiguous and little endian, each at a multiple of 64 bytes

`dtype` is NumPy's short form (`<f8`; `|V144` for records); what the rows look like is fixed by
`compiler.ir.COLUMNS`.
"""

from __future__ import annotations

import hashlib
import struct
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from compiler.ir import COLUMNS, VERSION, SceneIR
from compiler.validate import validate
from dsl.codes import diagnostic
from dsl.diagnostics import CompileError
from dsl.whole_files import replacing

_MAGIC = b"OVOLO-IR"
_HEADER = struct.Struct("<8sII")
_ENTRY = struct.Struct("<24s8sQQ")
_ALIGNMENT = 64


def write_ir(scene: SceneIR, path: str | Path) -> None:
    """Write `scene` to `path`, at once: readers see the old file or the new one.

    Raises OSError where that cannot be done.
    """
    arrays = {name: np.ascontiguousarray(getattr(scene, name)) for name in COLUMNS}
    offset = _aligned(_HEADER.size + _ENTRY.size * len(arrays))
    entries, offsets = [], []
    for name, array in arrays.items():
        entries.append(_ENTRY.pack(name.encode(), array.dtype.str.encode(), len(array), offset))
        offsets.append(offset)
        offset = _aligned(offset + array.nbytes)
    with replacing(Path(path)) as unfinished, unfinished.open("wb") as file:
        file.write(_HEADER.pack(_MAGIC, VERSION, len(arrays)) + b"".join(entries))
        for array, start in zip(arrays.values(), offsets, strict=True):
            file.seek(start)
            file.write(array.reshape(-1).view(np.uint8).data)
        file.truncate(offset)


def is_binary(path: Path) -> bool:
    """Whether the file at `path` begins as the binary form does; raises OSError."""
    with path.open("rb") as file:
        return file.read(len(_MAGIC)) == _MAGIC


def read_ir(path: str | Path) -> SceneIR:
    """Map the file at `path`; every number in it is checked (`validate`), none is copied.

    Raises CompileError where the file cannot be read or is damaged. The file must not be cut short
    while it is mapped; `write_ir` replaces it whole.
    """
    try:
        with Path(path).open("rb") as file:
            header = file.read(_HEADER.size + _ENTRY.size * len(COLUMNS))
            empty = np.empty(0, dtype=np.uint8)
            mapped = np.memmap(file, np.uint8, "r").view(np.ndarray) if header else empty
    except OSError as error:
        reason = error.strerror or str(error)
        raise CompileError(
            [diagnostic("file-unreadable", f"cannot read `{path}`: {reason}")]
        ) from None
    scene = SceneIR(**_arrays(header, mapped, path))
    if faults := validate(scene):
        raise CompileError(faults)
    return scene


def content_hash(scene: SceneIR) -> str:
    """SHA-256, in hex, of what the picture depends on: all but the sources.

    Numbers of texts do not count, the texts that cameras, lights, attributes and textures name do.
    """
    names = []
    for table, columns in (
        ("cameras", ("name",)),
        ("mesh_attributes", ("name",)),
        ("textures", ("file", "attribute")),
    ):
        unnamed = getattr(scene, table).copy()
        for column in columns:
            names += [scene.text(int(index)) for index in unnamed[column]]
            unnamed[column] = 0
        scene = replace(scene, **{table: unnamed})
    names += [scene.sky_texture(light) for light in range(len(scene.lights))]
    lights = scene.lights.copy()
    lights["file"] = 0
    scene = replace(scene, lights=lights)
    digest = hashlib.sha256(f"ovolo ir {VERSION} {names!r}".encode(errors="replace"))
    for name in COLUMNS:
        if not name.startswith(("source_", "origins", "text_", "instance_source")):
            array = np.ascontiguousarray(getattr(scene, name))
            digest.update(f" {name} {array.shape} ".encode())
            digest.update(array.reshape(-1).view(np.uint8).data)
    return digest.hexdigest()


def _arrays(header: bytes, mapped: NDArray[np.uint8], path: str | Path) -> dict[str, NDArray[Any]]:
    def damaged(what: str) -> CompileError:
        return CompileError([diagnostic("ir-damaged", f"`{path}` {what}")])

    if not header.startswith(_MAGIC):
        raise damaged("is not a compiled scene")
    if len(header) < _HEADER.size + _ENTRY.size * len(COLUMNS):
        raise damaged("ends within its header")
    _, version, count = _HEADER.unpack_from(header)
    if version != VERSION:
        raise damaged(f"has version {version}, not {VERSION}: compile the scene again")
    if count != len(COLUMNS):
        raise damaged(f"lists {count} arrays, not {len(COLUMNS)}")
    arrays: dict[str, NDArray[Any]] = {}
    for index, (name, (dtype, row)) in enumerate(COLUMNS.items()):
        entry = _ENTRY.unpack_from(header, _HEADER.size + index * _ENTRY.size)
        called, kind, rows, offset = entry[0].rstrip(b"\0"), entry[1].rstrip(b"\0"), *entry[2:]
        if called != name.encode() or kind != dtype.str.encode():
            raise damaged(f"has something else in place of `{name}`")
        nbytes = rows * dtype.itemsize * int(np.prod(row, dtype=np.int64))
        if offset % _ALIGNMENT or offset + nbytes > len(mapped):
            raise damaged(f"ends before the end of `{name}`")
        arrays[name] = mapped[offset : offset + nbytes].view(dtype).reshape(rows, *row)
    return arrays


def _aligned(offset: int) -> int:
    return -(-offset // _ALIGNMENT) * _ALIGNMENT
