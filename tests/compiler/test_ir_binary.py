"""The binary form: mapped, checked, and never trusted."""

from __future__ import annotations

import struct
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from compiler.flatten import flatten
from compiler.ir import COLUMNS, SceneIR
from compiler.ir_binary import content_hash, read_ir, write_ir
from compiler.validate import validate
from dsl.diagnostics import CompileError
from dsl.scene import Bind, Camera, Group, Material, Mesh, Node, SceneGraph, Settings, Sun
from tests.compiler.graphs import ball, graphs, placed, step


def flat(root: Node) -> SceneIR:
    ir = flatten(SceneGraph(root), lambda file: (None, [])).ir
    assert ir is not None
    return ir


def scene() -> SceneIR:
    return flat(
        Group(
            (
                placed(ball(), step("translate", 0.1, 2, 3), label="b"),
                Bind(Mesh(np.eye(3), np.array([[0, 1, 2]])), Material(ior=2)),
                Sun((1, 0, 0), (1, 1, 1)),
                Camera("perspective", 1, name="eye"),
            )
        )
    )


@given(graphs())
@settings(max_examples=20, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_what_is_written_is_read(tmp_path: Path, root: Node) -> None:
    ir = flat(root)
    write_ir(ir, tmp_path / "a.ovoir")
    again = read_ir(tmp_path / "a.ovoir")
    for name in COLUMNS:
        one, other = getattr(ir, name), getattr(again, name)
        assert one.tobytes() == other.tobytes()
        assert one.shape == other.shape
        assert other.ctypes.data % 64 == 0 or not other.size
    assert [p.name for p in tmp_path.iterdir()] == ["a.ovoir"]


def test_arrays_are_mapped_not_copied(tmp_path: Path) -> None:
    write_ir(scene(), tmp_path / "a.ovoir")
    array = read_ir(tmp_path / "a.ovoir").world_from_object
    assert not array.flags.writeable
    while isinstance(array.base, np.ndarray):
        array = array.base
    assert isinstance(array, np.memmap)


@given(st.integers(0, 10**6), st.binary(min_size=1, max_size=16))
@settings(max_examples=200, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_a_damaged_file_is_refused_or_read_but_never_worse(
    tmp_path: Path, place: int, damage: bytes
) -> None:
    path = tmp_path / "a.ovoir"
    write_ir(scene(), path)
    data = bytearray(path.read_bytes())
    place %= len(data)
    data[place : place + len(damage)] = damage
    path.write_bytes(bytes(data))
    with suppress(CompileError):
        assert validate(read_ir(path)) == []


@given(st.integers(0, 10**6))
@settings(max_examples=50, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_a_truncated_file_is_refused(tmp_path: Path, length: int) -> None:
    path = tmp_path / "a.ovoir"
    write_ir(scene(), path)
    data = path.read_bytes()
    # What lies beyond the last array is padding.
    path.write_bytes(data[: length % (len(data) - 64)])
    with pytest.raises(CompileError):
        read_ir(path)


ENTRY = 16  # the first entry of the table: name, dtype, rows, offset


@pytest.mark.parametrize(
    ("at", "value", "message"),
    [
        (0, b"PNG", "is not a compiled scene"),
        (8, struct.pack("<I", 99), "has version 99, not 1"),
        (12, struct.pack("<I", 7), "lists 7 arrays"),
        (ENTRY, b"other_name\0", "has something else in place of `prototype_kind`"),
        (ENTRY + 24, b"<f8", "has something else in place of `prototype_kind`"),
        (ENTRY + 32, struct.pack("<Q", 2**63), "ends before the end of `prototype_kind`"),
        (ENTRY + 40, struct.pack("<Q", 2**64 - 64), "ends before the end of `prototype_kind`"),
        (ENTRY + 40, struct.pack("<Q", 3), "ends before the end of `prototype_kind`"),
    ],
)
def test_a_wrong_header_is_named(tmp_path: Path, at: int, value: bytes, message: str) -> None:
    path = tmp_path / "a.ovoir"
    write_ir(scene(), path)
    data = bytearray(path.read_bytes())
    data[at : at + len(value)] = value
    path.write_bytes(bytes(data))
    with pytest.raises(CompileError, match=message):
        read_ir(path)


@pytest.mark.parametrize("content", [b"", b"O", b"OVOLO-IR", b"\0" * 5000])
def test_what_is_no_scene_is_refused(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "a.ovoir"
    path.write_bytes(content)
    with pytest.raises(CompileError) as caught:
        read_ir(path)
    assert caught.value.diagnostics[0].code == "ir-damaged"


def test_a_missing_file_and_a_folder_are_diagnostics(tmp_path: Path) -> None:
    for path in (tmp_path / "no.ovoir", tmp_path):
        with pytest.raises(CompileError) as caught:
            read_ir(path)
        assert caught.value.diagnostics[0].code == "file-unreadable"


def test_the_hash_is_of_the_picture() -> None:
    assert content_hash(scene()) == content_hash(scene())
    here, there = (placed(ball(), label=label) for label in ("here", "there"))
    assert content_hash(flat(here)) == content_hash(flat(there))
    hashes = {
        content_hash(flat(root))
        for root in (
            ball(),
            ball(2.0),
            placed(ball(), step("translate", 1, 0, 0)),
            Bind(ball(), Material(ior=2)),
            Group((ball(), Sun((1, 0, 0), (1, 1, 1)))),
            Group((ball(), Settings(width=3))),
            Group((ball(), Camera("perspective", 1, name="a"))),
            Group((ball(), Camera("perspective", 1, name="b"))),
        )
    }
    assert len(hashes) == 8


def test_the_faults_of_a_damaged_file_are_not_told_without_end() -> None:
    ranges = np.full((1000, 4), -1, dtype=np.int64)
    assert 1 < len(validate(replace(scene(), mesh_ranges=ranges))) <= 50
