"""The text of a crate file (.usdc): its tokens, and so all the layers that it names.

A crate keeps every name, token, string and asset path once, in its section TOKENS, from version 0.4
on as a block of LZ4.
"""

from __future__ import annotations

from typing import IO

MOST = 1 << 28
"""Bytes of text that are read."""

_NAME, _ENTRY = 16, 32


def crate_text(file: IO[bytes]) -> bytes:
    """The tokens of a crate, a zero byte after each; as far as they can be read."""
    head = _read(file, 0, 24)
    listed = int.from_bytes(head[16:24], "little")
    count = int.from_bytes(_read(file, listed, 8), "little")
    for number in range(min(count, 64)):
        entry = _read(file, listed + 8 + _ENTRY * number, _ENTRY)
        if entry[:_NAME].rstrip(b"\0") == b"TOKENS":
            start, size = (int.from_bytes(entry[at : at + 8], "little") for at in (16, 24))
            return _tokens(_read(file, start, size), head[8:11] >= bytes((0, 4, 0)))
    return b""


def _read(file: IO[bytes], start: int, size: int) -> bytes:
    if start >= 1 << 62:
        return b""
    file.seek(start)
    return file.read(min(size, MOST))


def _tokens(section: bytes, packed: bool) -> bytes:
    """The text of the section; none where it is broken, which usd-core refuses too."""
    if not packed:
        return section[16:]
    import lz4.block

    size, blocks = int.from_bytes(section[8:16], "little"), section[24:]
    if size > MOST or blocks[:1] != b"\0":  # text beyond 2 GB is in several blocks
        return b""
    try:
        return bytes(lz4.block.decompress(blocks[1:], uncompressed_size=size))
    except lz4.block.LZ4BlockError:
        return b""
