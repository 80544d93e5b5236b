"""Files of MaterialX that a stage refers to, as layers that usd-core can compose.

usd-core from PyPI has no reader for them. Where such a reference failed, the file is read by the
`materialx` package into a layer laid out as usdMtlx does, `/MaterialX/Materials/NAME`, and while
the stage is imported the reference names that layer instead.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from pxr import Ar, Pcp

from compiler.usd.materialx_layers import material_layer
from compiler.usd.report import Report

SUFFIX = ".mtlx"
LARGEST = 64 << 20
"""Bytes of a file of MaterialX that is read."""


class _Failed(Exception):
    """Why a file cannot be read."""


@contextmanager
def composed_materialx(stage: Any, root: Path | None, report: Report) -> Iterator[None]:
    """With the materials of the files that the stage could not open, until it is left."""
    replaced: list[tuple[Any, str, Any]] = []
    if any(_is_missing(error) for error in stage.GetCompositionErrors()):
        for layer in stage.GetUsedLayers():
            for asset in sorted(layer.GetCompositionAssetDependencies()):
                if asset.lower().endswith(SUFFIX):
                    try:
                        made = _read(layer, asset, root, report)
                    except _Failed as why:
                        message = f"the MaterialX file `{asset}` is not read: {why}"
                        report.add("usd-material", message)
                    else:
                        if made is not None:
                            replaced.append((layer, asset, made))
    try:
        # In memory only; with what is here every stage of this process would compose.
        for layer, asset, made in replaced:
            layer.UpdateCompositionAssetDependency(asset, made.identifier)
        yield
    finally:
        for layer, asset, made in replaced:
            layer.UpdateCompositionAssetDependency(made.identifier, asset)


def is_about_materialx(words: str) -> bool:
    """Whether a warning of usd-core is about a file that is read, or reported, here."""
    return "Could not open asset @" in words and f"{SUFFIX}@" in words.lower()


def _is_missing(error: Any) -> bool:
    return isinstance(error, Pcp.ErrorInvalidAssetPath) and is_about_materialx(str(error))


def _read(layer: Any, asset: str, root: Path | None, report: Report) -> Any | None:
    """The layer of a file that another refers to; None (reported) without the package."""
    try:
        import MaterialX
    except ImportError:
        message = "files of MaterialX cannot be read, and what refers to them has no materials"
        help = "install the package that reads them: pip install 'ovolo[materialx]'"
        report.add("usd-material", message, help=help)
        return None
    resolver = Ar.GetResolver()
    where = resolver.Resolve(resolver.CreateIdentifier(asset, layer.resolvedPath))
    if not where:
        raise _Failed("it cannot be found")
    text = _text(where)
    document = MaterialX.createDocument()
    options = MaterialX.XmlReadOptions()
    options.readXIncludeFunction = None  # a file of a stranger opens no others
    try:
        MaterialX.readFromXmlString(document, text, MaterialX.FileSearchPath(), options)
    except Exception as error:
        raise _Failed(f"{error}".split("\n")[0]) from None
    if "<xi:include" in text:
        message = f"`{asset}` includes other files, which are not read"
        report.add("usd-material", message, help="put what they hold into the file")
    return material_layer(document, where, root, report)


def _text(where: Any) -> str:
    content = Ar.GetResolver().OpenAsset(where)
    if content is None:
        raise _Failed("it cannot be opened")
    if content.GetSize() > LARGEST:
        raise _Failed(f"it is larger than {LARGEST:,} bytes")
    try:
        return bytes(content.GetBuffer()).decode()
    except UnicodeDecodeError:
        raise _Failed("its text is not UTF-8") from None
