"""Whether a stage stays within a folder, found before anything of it is composed.

Layers are opened one by one, each after it has been found to lie inside, and asked for every asset
that they name: sublayers, references and payloads of all variants, value clips, and attributes
such as textures. What usd-core would open for the stage is a part of that.
"""

from __future__ import annotations

import os
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from pxr import Ar, Sdf, Tf

from compiler.usd.nesting import nests_too_deep

_URL = re.compile(r"[A-Za-z][A-Za-z0-9+.-]+:")
_CLIP_PATHS = ("assetPaths", "manifestAssetPath", "templateAssetPath")


def outside(path: str, root: Path) -> Iterator[tuple[str, str, str]]:
    """Each asset that the stage may not read: the layer that names it, the asset, and why."""
    folder = root.resolve()
    seen: set[str] = set()
    pending = [("", path, path)]
    while pending:
        namer, words, found = pending.pop()
        why = refusal(words, found, folder)
        if why is not None:
            yield namer or words, words, why
            continue
        if found in seen or not Sdf.FileFormat.FindByExtension(found):
            continue
        seen.add(found)
        if nests_too_deep(found):
            yield namer or words, words, "which nests too deep to be read"
            continue
        try:
            layer = Sdf.Layer.FindOrOpen(found)
        except Tf.ErrorException:
            layer = None  # who opens the stage says so
        if layer is None:
            continue
        for asset in sorted(_assets(layer)):
            pending.append((layer.GetDisplayName(), asset, _located(layer, asset)))


def refusal(words: str, found: str, folder: Path) -> str | None:
    """Why an asset may not be read, or None."""
    if words.startswith("`"):
        return "an expression: what it names cannot be known"
    if _URL.match(words):
        return "a URL"
    # A file in a package is where the package is; a pattern is where its folder is.
    name, _ = Ar.SplitPackageRelativePathOuter(found)
    place = Path(name).parent if re.search(r"[<#]", name) else Path(name)
    try:
        inside = Path(os.path.realpath(place)).is_relative_to(folder)
    except (OSError, ValueError):
        inside = False
    return None if inside else "which is outside of the folder that may be read"


def _located(layer: Any, asset: str) -> str:
    """The file that an asset path of a layer stands for, whether it exists or not."""
    resolver = Ar.GetResolver()
    identifier = resolver.CreateIdentifier(asset, layer.resolvedPath)
    return str(resolver.Resolve(identifier)) or str(layer.ComputeAbsolutePath(asset))


def _assets(layer: Any) -> set[str]:
    """Every asset path that a layer names."""
    found = set(layer.GetCompositionAssetDependencies()) | set(layer.GetExternalAssetDependencies())

    def visit(path: Any) -> None:
        spec = layer.GetObjectAtPath(path)
        if isinstance(spec, Sdf.AttributeSpec):
            if str(spec.typeName).startswith("asset"):
                _collect(spec.default, found)
                for time in layer.ListTimeSamplesForPath(path):
                    _collect(layer.QueryTimeSample(path, time), found)
        elif isinstance(spec, Sdf.PrimSpec) and spec.HasInfo("clips"):
            for clips in dict(spec.GetInfo("clips")).values():
                for name in _CLIP_PATHS:
                    _collect(clips.get(name), found)

    layer.Traverse(Sdf.Path.absoluteRootPath, visit)
    return found - {""}


def _collect(value: Any, found: set[str]) -> None:
    """Add the asset paths in a value."""
    if isinstance(value, Sdf.AssetPath):
        found.add(value.path)
    elif isinstance(value, str):
        found.add(value)
    elif value is not None and not isinstance(value, Sdf.ValueBlock):
        for each in value:
            _collect(each, found)
