"""How deep the values of a crate file (.usdc) nest: usd-core reads those by recursion, too.

Only dictionaries and values of unknown types hold others. Each that does is told by 8 bytes: its
kind in the seventh, flags in the eighth, and in the rest where in the file it is. Whatever looks
like that is counted; where there is more of it than may be nested, it is followed. Prims may nest
as deep as they like: usd-core reads them without recursion.
"""

from __future__ import annotations

import mmap
from typing import IO

import numpy as np

from compiler.column import Integers

MAGIC = b"PXR-USDC"

_DICTIONARY, _UNREGISTERED, _UNREGISTERED_LIST = 31, 53, 54
_ELSEWHERE = 0x40
"""Flags from this on say that a value is an array, or no place but the value itself."""

_BLOCK = 1 << 17
_ENTRIES = 1 << 20
"""Entries of dictionaries that are followed; a file with more of them counts as too deep."""


def crate_nests_too_deep(file: IO[bytes], deepest: int) -> bool:
    """Whether values of a crate may nest deeper than `deepest`; never missed where they do."""
    content: bytes | mmap.mmap
    try:
        content = mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ)
    except (OSError, ValueError):  # not a file of its own, or an empty one
        content = file.read()
    places = _holders(content, deepest)
    return len(places) > deepest and _depth(content, places.tolist(), deepest) > deepest


def _holders(content: bytes | mmap.mmap, enough: int) -> Integers:
    """Where in the file there may be a value that holds others."""
    size = len(content)
    found: list[Integers] = []
    for start in range(0, max(size - 7, 0), _BLOCK):
        block = np.frombuffer(content[start : start + _BLOCK + 7], np.uint8)
        kinds, flags = block[6:-1], block[7:]
        holds = (kinds == _DICTIONARY) | (kinds == _UNREGISTERED) | (kinds == _UNREGISTERED_LIST)
        places = np.flatnonzero(holds & (flags < _ELSEWHERE))
        targets = sum(block[places + i].astype(np.int64) << (8 * i) for i in range(6))
        found.append(places[targets < size] + start)
    return np.concatenate(found) if found else np.empty(0, np.int64)


def _depth(content: bytes | mmap.mmap, places: list[int], deepest: int) -> int:
    """How deep what stands at the `places` nests; more than `deepest` where it cannot be told."""
    depths: dict[int, int] = {}
    left = _ENTRIES
    for place in places:
        stack = [(place, False)]
        while stack:
            here, done = stack.pop()
            if here in depths and not done:
                continue
            below = _held(content, here, left)
            if below is None:
                return deepest + 1
            left -= len(below)
            if done:
                depths[here] = 1 + max((depths.get(b, 0) for b in below), default=0)
                continue
            depths[here] = 0  # usd-core ends cycles itself
            stack.append((here, True))
            stack += [(b, False) for b in below if b not in depths]
    return max(depths.values(), default=0)


def _held(content: bytes | mmap.mmap, place: int, most: int) -> list[int] | None:
    """The places of what the value at a place holds; None where that is more than `most`."""
    kind, flags = content[place + 6], content[place + 7]
    if flags >= _ELSEWHERE or kind not in (_DICTIONARY, _UNREGISTERED, _UNREGISTERED_LIST):
        return []
    at = _number(content, place, 6)
    lists = 1
    if kind == _UNREGISTERED_LIST and at < len(content):
        lists, at = (content[at] & 0x7E).bit_count(), at + 1
    key = 4 if kind == _DICTIONARY else 0
    held: list[int] = []
    for _ in range(lists):
        count = 1
        if kind != _UNREGISTERED:
            count, at = _number(content, at, 8), at + 8
        while count > 0:
            at += key
            inner = at + _number(content, at, 8)
            if at > len(content) - 8 or not 0 <= inner <= len(content) - 8:
                return held  # usd-core gives up here, too, or it is no such value
            if len(held) >= most:
                return None
            held.append(inner)
            at, count = inner + 8, count - 1
    return held


def _number(content: bytes | mmap.mmap, at: int, width: int) -> int:
    return int.from_bytes(content[at : at + width], "little", signed=width == 8)
