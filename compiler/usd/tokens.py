"""The text of a crate file (.usdc): its tokens, and so all the layers that it names.

A crate keeps every name, token, string and asset path once, in its section TOKENS, from version 0.4
on as a block of LZ4: runs of bytes, each followed by a copy of what came some bytes before.
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
    if not packed:
        return section[16:]
    blocks, text = section[24:], b""
    if not blocks or not blocks[0]:
        return _unpacked(blocks[1:])
    at = 1
    for _ in range(blocks[0]):  # text beyond 2 GB is in several
        size = int.from_bytes(blocks[at : at + 4], "little")
        text += _unpacked(blocks[at + 4 : at + 4 + size])
        at += 4 + size
    return text


def _unpacked(block: bytes) -> bytes:
    """A block of LZ4, unpacked up to where it breaks off."""
    text = bytearray()
    at, end = 0, len(block)
    while at < end and len(text) < MOST:
        lengths = block[at]
        literal, at = _length(block, lengths >> 4, at + 1)
        text += block[at : at + literal]
        at += literal
        if at + 2 > end:
            break
        back = block[at] | block[at + 1] << 8
        copied, at = _length(block, lengths & 15, at + 2)
        first = len(text) - back
        if back == 0 or first < 0:
            break
        copied = min(copied + 4, MOST)
        if copied <= back:
            text += text[first : first + copied]
        else:
            text += (text[first:] * (copied // back + 1))[:copied]
    return bytes(text)


def _length(block: bytes, length: int, at: int) -> tuple[int, int]:
    """A length that begins with four bits, and where what follows it begins."""
    if length == 15:
        while at < len(block):
            more = block[at]
            length, at = length + more, at + 1
            if more != 255:
                break
    return length, at
