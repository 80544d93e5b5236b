"""Crate files (.usdc, version 0.4.0) written byte by byte, as usd-core would not."""

from __future__ import annotations

import struct

DICTIONARY, UNREGISTERED, INTEGER = 31, 53, 3


def nested_values(kind: int, depth: int, *, cycle: bool = False) -> bytes:
    """A layer whose `fallbackPrimTypes` is a value that holds one, and so on to a depth."""
    entry = struct.pack("<QIq", 1, 0, 8) if kind == DICTIONARY else struct.pack("<q", 8)
    first, stride = 88, len(entry) + 8
    values = bytearray()
    for level in range(1, depth + 1):
        if level < depth or cycle:
            values += entry + _place(kind, first + stride * (level % depth))
        else:
            values += entry + _place(INTEGER, 7, inlined=True)
    tokens = b";-)\0fallbackPrimTypes\0k\0"
    places = _packed(_place(kind, first))
    sections = {
        b"TOKENS": struct.pack("<QQ", 3, len(tokens)) + _sized(_packed(tokens)),
        b"STRINGS": struct.pack("<QI", 1, 2),
        b"FIELDS": struct.pack("<Q", 1) + _integers([1]) + _sized(places),
        b"FIELDSETS": struct.pack("<Q", 2) + _integers([0, -1]),
        b"PATHS": struct.pack("<QQ", 1, 1) + _integers([0]) + _integers([0]) + _integers([-2]),
        b"SPECS": struct.pack("<Q", 1) + _integers([0]) + _integers([0]) + _integers([7]),
    }
    content = bytes(first) + bytes(values)
    listed = b""
    for name, data in sections.items():
        listed += struct.pack("<16sqq", name, len(content), len(data))
        content += data
    head = struct.pack("<8s8Bq64s", b"PXR-USDC", 0, 4, 0, 0, 0, 0, 0, 0, len(content), b"")
    return head + content[88:] + struct.pack("<Q", len(sections)) + listed


def _place(kind: int, payload: int, *, inlined: bool = False) -> bytes:
    return struct.pack("<Q", inlined << 62 | kind << 48 | payload)


def _sized(data: bytes) -> bytes:
    return struct.pack("<Q", len(data)) + data


def _packed(data: bytes) -> bytes:
    """A block of LZ4 that holds literals only."""
    count = len(data)
    if count < 15:
        return bytes([0, count << 4]) + data
    more, rest = divmod(count - 15, 255)
    return b"\x00\xf0" + b"\xff" * more + bytes([rest]) + data


def _integers(values: list[int]) -> bytes:
    """Differences as 32 bits each, after one that none of them is."""
    differences = [b - a for a, b in zip([0, *values], values, strict=False)]
    codes = (1 << 2 * len(values)) - 1
    head = struct.pack("<i", 99) + codes.to_bytes((2 * len(values) + 7) // 8, "little")
    return _sized(_packed(head + struct.pack(f"<{len(values)}i", *differences)))
