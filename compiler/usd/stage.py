"""Opening a stage and importing it."""

from __future__ import annotations

import math
import re
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from difflib import get_close_matches
from typing import Any, Literal

from pxr import Sdf, Tf, Usd, UsdGeom, UsdLux, UsdUtils

from compiler.usd.appearance import Base
from compiler.usd.cameras import read_camera
from compiler.usd.clock import Clock
from compiler.usd.framing import Framing, read_framing
from compiler.usd.lights import pole, read_light
from compiler.usd.materialx_files import composed_materialx, is_about_materialx
from compiler.usd.opening import open_stage, sentence
from compiler.usd.options import PURPOSES, StageOptions
from compiler.usd.prims import Inherited
from compiler.usd.refinement import coarsening
from compiler.usd.report import Report
from compiler.usd.schema import type_of
from compiler.usd.settings import included_purposes, read_settings, render_settings
from compiler.usd.traverse import Traversal
from compiler.usd.xform import world_matrix, world_steps
from dsl.diagnostics import Diagnostic
from dsl.scene import Group, Instances, Node, Origin, SceneGraph, Settings, Sky, Transform
from dsl.spans import PrimPlace

one_at_a_time = threading.Lock()
"""usd-core hands its warnings to the process, not to who asked: one import at a time sees them."""

_LOADED = Usd.PrimIsActive & Usd.PrimIsLoaded
_PATH = re.compile(r"<(/[^<>]*)>")


def read_stage(
    path: str, time: float | Literal["earliest"] | None, prim: str | None, options: StageOptions
) -> tuple[SceneGraph, list[Diagnostic]]:
    """See `compiler.usd.import_stage`."""
    name = options.name or path
    report = Report(name)
    items: list[Node] = []
    with one_at_a_time, collected_warnings(report):
        stage = open_stage(path, options, report)
        if stage is not None:
            try:
                with composed_materialx(stage, options.root, report):
                    clock = Clock(_checked(time, report))
                    items = _import(stage, name, clock, prim, options, report)
            except Tf.ErrorException as error:
                report.add("usd-open", f"the stage cannot be read: {sentence(str(error))}")
    root = items[0] if len(items) == 1 else Group(tuple(items))
    return SceneGraph(root, name, {name: ""}), report.diagnostics()


def _checked(
    time: float | Literal["earliest"] | None, report: Report
) -> float | Literal["earliest"] | None:
    if isinstance(time, (int, float)) and not math.isfinite(time):
        report.add("usd-time", f"the time code {time} is not finite")
        return None
    return time


def _import(
    stage: Any,
    name: str,
    clock: Clock,
    only: str | None,
    options: StageOptions,
    report: Report,
) -> list[Node]:
    root = stage.GetPseudoRoot() if only is None else _find(stage, only, report)
    if root is None or report.failed:
        return []
    settings = render_settings(stage, report) if options.surroundings else None
    framing = read_framing(settings, clock, report) if settings else None
    purposes = options.purposes
    if purposes is None:
        purposes = (included_purposes(settings, clock, report) if settings else None) or PURPOSES
        options = replace(options, purposes=purposes)
    coarser = _coarsening(stage, root, clock, report) if options.complexity == "limit" else 0
    traversal = Traversal(stage, name, clock, report, options, coarser)
    parent = root.GetParent() if only is not None else None
    above = traversal.inherited(parent) if parent else Inherited()
    frame = traversal.walk(root, above, Base())
    traversal.check_passed_on()
    items = list(frame.items)
    chain = world_steps(parent, clock, report) if parent else ()
    if chain and items:
        items = [Instances(Group(tuple(items)), Transform(chain))]
    items += frame.hoisted
    first = framing.camera if framing else None
    for path in sorted(frame.placed, key=lambda path: path != first):
        items += _placed(stage.GetPrimAtPath(path), traversal, name, framing)
    up = UsdGeom.GetStageUpAxis(stage)
    if up not in ("Y", "Z"):
        report.add("usd-attribute", f"`upAxis = {up!r}` is neither Y nor Z; Y is up", "/")
    if up == "Z" and options.surroundings:
        items.append(Settings(up="z"))
    if settings and framing:
        items.append(read_settings(settings, framing, traversal.clock, report))
    return items


def _coarsening(stage: Any, root: Any, clock: Clock, report: Report) -> int:
    roots = [root, *stage.GetPrototypes()]
    meshes = [p for r in roots for p in Usd.PrimRange(r, _LOADED) if type_of(p) == "Mesh"]
    coarser = coarsening(meshes, clock)
    if coarser:
        message = f"the stage's {len(meshes)} meshes are refined {coarser} times less, for so many"
        report.add("usd-subdivision", message, root.GetPath())
    return coarser


def _find(stage: Any, only: str, report: Report) -> Any | None:
    found = None
    if Sdf.Path.IsValidPathString(only):
        path = Sdf.Path(only)
        if path.IsAbsoluteRootOrPrimPath():
            found = stage.GetPrimAtPath(path.MakeAbsolutePath(Sdf.Path.absoluteRootPath))
    if found:
        return found
    known = [str(prim.GetPath()) for prim in stage.Traverse()]
    close = get_close_matches(only, known[:10_000], 1)
    help = f"did you mean `{close[0]}`?" if close else None
    report.add("usd-prim", f"the stage has no prim `{only}`", help=help)
    return None


def _placed(prim: Any, traversal: Traversal, name: str, framing: Framing | None) -> list[Node]:
    """A camera or light, in stage space."""
    path = str(prim.GetPath())
    origin = Origin(PrimPlace(name, path), path)
    clock, report = traversal.clock, traversal.report
    if type_of(prim) == "Camera":
        camera = read_camera(prim, clock, report, origin)
        if camera is None:
            return []
        if framing is not None and framing.camera == path:
            camera = framing.framed(camera)
        return [Instances(camera, Transform(world_steps(prim, clock, report)))]
    if not prim.HasAPI(UsdLux.LightAPI) or not traversal.inherited(prim).visible:
        return []
    light = read_light(prim, world_matrix(prim, clock, report), clock, report, origin)
    if isinstance(light, Sky) and light.texture:
        steps = (*pole(prim, clock, report), *world_steps(prim, clock, report))
        return [Instances(light, Transform(steps))]
    return [] if light is None else [light]


@contextmanager
def collected_warnings(report: Report) -> Iterator[None]:
    """Take usd-core's own warnings into the report instead of onto stderr."""
    delegate = UsdUtils.CoalescingDiagnosticDelegate()
    try:
        yield
    finally:
        for found in delegate.TakeUncoalescedDiagnostics():
            text = found.commentary
            if is_about_materialx(text):
                continue
            place = _PATH.search(text)
            prim = place.group(1).split(".")[0] if place else "/"
            report.add("usd-composition", f"usd-core: {sentence(text)}", prim or "/")
        del delegate
