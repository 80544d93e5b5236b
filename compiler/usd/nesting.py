"""How deep layers nest: usd-core reads their text by recursion, and crashes where that ends.

Brackets are counted wherever they stand, in strings and comments too: what counts as too deep is
far more than any text needs. Of crate files (`compiler.usd.crates`) values are looked at; layers
that they name are not.
"""

from __future__ import annotations

import os
import re
import zipfile
from collections.abc import Iterator
from pathlib import Path
from typing import IO

import numpy as np

from compiler.usd import crates

DEEPEST = 5000
"""Levels of brackets that are read; usd-core crashes at some tens of thousands."""

LAYERS = 10_000
"""Layers that are looked at."""

_MAGIC = b"#usda"
_SUFFIXES = (".usd", ".usda", ".usdc", ".usdz")
_BLOCK = 1 << 22
_ASSET = re.compile(rb"@([^@\r\n]{1,4096})@")

_STEPS = np.zeros(256, dtype=np.int8)
_STEPS[list(b"([{")] = 1
_STEPS[list(b")]}")] = -1


def too_deep(path: str) -> str | None:
    """The first layer that is too deep to be read: a file, those its text names, and so on.

    All that a text names in a folder beside it, of other variants too, and all of a package.
    """
    pending, seen = [path], {path}
    for file in pending:
        named: set[bytes] = set()
        if _nests_too_deep(file, named):
            return file
        for asset in sorted(named):
            name = os.fsdecode(asset.split(b":SDF_FORMAT_ARGS:")[0])
            found = os.path.normpath(Path(file).parent / name)
            if found not in seen and found.lower().endswith(_SUFFIXES) and len(seen) < LAYERS:
                seen.add(found)
                pending.append(found)
    return None


def nests_too_deep(path: str) -> bool:
    """Whether a file is a layer, or holds one, that nests deeper than `DEEPEST`."""
    return _nests_too_deep(path, set())


def _nests_too_deep(path: str, named: set[bytes]) -> bool:
    """The same; adds the assets that a text names."""
    try:
        if path.lower().endswith(".usdz"):
            with zipfile.ZipFile(path) as package:
                return any(_is_deep(layer, set()) for layer in _layers(package))
        with Path(path).open("rb") as file:
            return _is_deep(file, named)
    except (OSError, ValueError, zipfile.BadZipFile, NotImplementedError, RuntimeError):
        return False  # who opens it says so


def _layers(package: zipfile.ZipFile) -> Iterator[IO[bytes]]:
    """The layers of a package; what is packed is not USD's, and may be a bomb."""
    for entry in package.infolist():
        if entry.compress_type == zipfile.ZIP_STORED and entry.filename.lower().endswith(_SUFFIXES):
            with package.open(entry) as file:
                yield file


def _is_deep(file: IO[bytes], named: set[bytes]) -> bool:
    block = file.read(len(crates.MAGIC))
    file.seek(0)
    if block == crates.MAGIC:
        return crates.crate_nests_too_deep(file, DEEPEST)
    if not block.startswith(_MAGIC):
        return False
    level = 0
    while block := file.read(_BLOCK):
        named.update(_ASSET.findall(block))
        # Most blocks cannot get that deep, and need no sum.
        opened = sum(block.count(bracket) for bracket in (b"(", b"[", b"{"))
        closed = sum(block.count(bracket) for bracket in (b")", b"]", b"}"))
        if level + opened > DEEPEST:
            steps = _STEPS[np.frombuffer(block, dtype=np.uint8)]
            if level + int(np.cumsum(steps, dtype=np.int32).max()) > DEEPEST:
                return True
        level += opened - closed
    return False
