"""How deep layers nest: usd-core reads their text by recursion, and crashes where that ends.

Brackets are counted wherever they stand, in strings and comments too: what counts as too deep is
far more than any text needs. Of crate files (`compiler.usd.crates`) values are looked at.
"""

from __future__ import annotations

import os
import re
import zipfile
from collections.abc import Iterator
from glob import escape
from itertools import islice
from pathlib import Path
from typing import IO

import numpy as np

from compiler.usd import crates
from compiler.usd.tokens import crate_text

DEEPEST = 5000
"""Levels of brackets that are read; usd-core crashes at some tens of thousands."""

LAYERS = 10_000
"""Layers that are looked at; a stage that names more, of those that there are, is refused."""

_MAGIC = b"#usda"
_SUFFIXES = (".usd", ".usda", ".usdc", ".usdz")
_BLOCK = 1 << 22
_ASSET = re.compile(rb"@([^@\r\n]{1,4096})@")
_PATTERN = re.compile(rb"[\"']([^\"'\r\n\0]{0,4096}#[^\"'\r\n\0]{0,4096})[\"']")
_LAYER = re.compile(rb"\.usd[acz]?(:|$)", re.IGNORECASE)
_TEXT = re.compile(rb"([\"'])(.{1,4096}?)\1")
"""The texts of an expression."""
_VARIABLE = re.compile(r"\$\{[^}]*\}")
_NAME = re.compile(r"#+")
_NUMBER = re.compile(r"#+(\.#+)?")
"""Where the paths of value clips have the time."""

_STEPS = np.zeros(256, dtype=np.int8)
_STEPS[list(b"([{")] = 1
_STEPS[list(b")]}")] = -1


class TooManyLayersError(Exception):
    """A stage names more layers than are looked at."""


def too_deep(path: str) -> str | None:
    """The first layer that is too deep to be read: a file, those its text names, and so on.

    All that a layer names, of other variants and value clips too, and all of a package. Of an
    expression every text in it counts as a name, with anything in place of variables. Raises
    TooManyLayersError.
    """
    pending, seen = [path], {path}
    for file in pending:
        named: set[bytes] = set()
        if _nests_too_deep(file, named):
            return file
        for asset in sorted(named):
            for found in _files(file, asset):
                if found not in seen and Path(found).is_file():
                    if len(seen) >= LAYERS:
                        raise TooManyLayersError
                    seen.add(found)
                    pending.append(found)
    return None


def _files(layer: str, asset: bytes) -> list[str]:
    """The layers that an asset path of a layer may stand for."""
    if asset.startswith(b"`"):
        texts = {os.fsdecode(text) for _, text in _TEXT.findall(asset)}
        return [
            str(found)
            for text in sorted(texts)
            for found in _alike(Path(layer).parent / _VARIABLE.sub("#", text), _NAME)
        ]
    return _named(layer, os.fsdecode(asset.split(b":SDF_FORMAT_ARGS:")[0]))


def _alike(pattern: Path, variable: re.Pattern[str]) -> list[str]:
    """The files beside a pattern that it may stand for."""
    name = variable.sub("*", escape(pattern.name))
    found = islice(Path(os.path.normpath(pattern.parent)).glob(name), LAYERS)
    return sorted(str(file) for file in found if file.suffix.lower() in _SUFFIXES)


def _named(layer: str, asset: str) -> list[str]:
    """The layers that a plain asset path stands for; of a pattern of clips, all there are."""
    found = os.path.normpath(Path(layer).parent / asset)
    if not found.lower().endswith(_SUFFIXES):
        return []
    name = Path(found).name
    if "#" not in name:
        return [found]
    return _alike(Path(found), _NUMBER)


def nests_too_deep(path: str) -> bool:
    """Whether a file is a layer, or holds one, that nests deeper than `DEEPEST`."""
    return _nests_too_deep(path, set())


def _nests_too_deep(path: str, named: set[bytes]) -> bool:
    """The same; adds the assets that its layers name."""
    try:
        if path.lower().endswith(".usdz"):
            with zipfile.ZipFile(path) as package:
                return any(_is_deep(layer, named) for layer in _layers(package))
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
        named.update(
            name
            for name in crate_text(file).split(b"\0")
            if _LAYER.search(name) or name.startswith(b"`")
        )
        file.seek(0)
        return crates.crate_nests_too_deep(file, DEEPEST)
    if not block.startswith(_MAGIC):
        return False
    level = 0
    while block := file.read(_BLOCK):
        named.update(_ASSET.findall(block))
        named.update(_PATTERN.findall(block))
        # Most blocks cannot get that deep, and need no sum.
        opened = sum(block.count(bracket) for bracket in (b"(", b"[", b"{"))
        closed = sum(block.count(bracket) for bracket in (b")", b"]", b"}"))
        if level + opened > DEEPEST:
            steps = _STEPS[np.frombuffer(block, dtype=np.uint8)]
            if level + int(np.cumsum(steps, dtype=np.int32).max()) > DEEPEST:
                return True
        level += opened - closed
    return False
