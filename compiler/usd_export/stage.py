"""From a compiled scene to a file of USD."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

from pxr import Sdf, Tf, UsdUtils, Vt

from compiler.appearance import Materials
from compiler.compilation import Compilation
from compiler.compress import compress
from compiler.ir import UP_AXES
from compiler.prototypes import Prototypes
from compiler.provenance import Origins
from compiler.usd.schema import FALLBACKS, KINDS, register
from compiler.usd_export import SUFFIXES, ExportError, ExportOptions
from compiler.usd_export.layer import child
from compiler.usd_export.looks import Looks
from compiler.usd_export.prims import Writer
from compiler.usd_export.views import write_cameras, write_lights, write_settings
from compiler.walk import walk
from dsl.diagnostics import Diagnostic
from dsl.scene import File, Node
from dsl.whole_files import replacing


def write_stage(compilation: Compilation, path: Path, options: ExportOptions) -> None:
    """See `compiler.usd_export.export_stage`."""
    if path.suffix.lower() not in SUFFIXES:
        known = ", ".join(SUFFIXES)
        raise ExportError(f"`{path}` is no stage: its ending is none of {known}")
    if not path.parent.is_dir():
        raise ExportError(f"`{path}` cannot be written: there is no folder `{path.parent}`")
    register()
    layer = Sdf.Layer.CreateAnonymous(path.stem + ".usda")
    with Sdf.ChangeBlock():
        _write(layer, compilation, options)
    _save(layer, path)


def _write(layer: Any, compilation: Compilation, options: ExportOptions) -> None:
    def load(file: File) -> tuple[Node | None, list[Diagnostic]]:
        return compilation.load(file), []

    walked = walk(compilation.graph.root, load)
    prototypes, origins, materials = Prototypes(), Origins(), Materials()
    branches = compress(walked, prototypes.index, materials.index, origins)
    scene = compilation.ir
    root = child(layer.pseudoRoot, "World", "Xform")
    root.SetInfo("kind", "group")
    layer.defaultPrim = root.name
    layer.pseudoRoot.SetInfo("upAxis", UP_AXES[int(scene.settings[0]["up"])].upper())
    layer.pseudoRoot.SetInfo("metersPerUnit", 1.0)
    cameras = write_cameras(root, scene)
    write_lights(root, scene, Path(compilation.reader.files.root or "").resolve())
    looks = Looks(root, materials.nodes)
    Writer(root, branches, prototypes.nodes, origins, looks, options).write()
    write_settings(layer, scene, cameras)
    used = _used_types(root)
    if used:
        fallbacks = {name: Vt.TokenArray(FALLBACKS[name]) for name in sorted(used)}
        layer.pseudoRoot.SetInfo("fallbackPrimTypes", fallbacks)


def _used_types(root: Any) -> set[str]:
    used, stack = set[str](), [root]
    while stack:
        prim = stack.pop()
        used.add(prim.typeName)
        stack += prim.nameChildren.values()
    return used & set(KINDS)


def _save(layer: Any, path: Path) -> None:
    try:
        with replacing(path) as unfinished:
            if path.suffix.lower() != ".usdz":
                if not layer.Export(str(unfinished)):
                    raise ExportError(f"`{path}` cannot be written")
                return
            with tempfile.TemporaryDirectory() as folder:
                inside = Path(folder) / f"{path.stem}.usdc"
                layer.Export(str(inside))
                if not UsdUtils.CreateNewUsdzPackage(str(inside), str(unfinished)):
                    raise ExportError(f"`{path}` cannot be written")
    except Tf.ErrorException:
        raise ExportError(f"`{path}` cannot be written") from None
