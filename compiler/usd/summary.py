"""What a stage holds, beside what is drawn of it."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from typing import Any, Literal

from pxr import Sdf, Usd, UsdGeom, UsdLux

from compiler.usd.clock import Clock
from compiler.usd.opening import open_stage
from compiler.usd.options import PURPOSES, StageOptions
from compiler.usd.report import Report
from compiler.usd.schema import type_of
from compiler.usd.stage import collected_warnings, one_at_a_time

LISTED = 20
"""Cameras, layers and variant sets that are named; all are counted."""


def summarize_stage(
    path: str,
    time: float | Literal["earliest"] | None,
    options: StageOptions,
    drawn: Iterable[str],
) -> dict[str, Any]:
    """Metadata, layers, prims by type, cameras and variants of a stage, as JSON values.

    `drawn` are paths of prims that the import drew. `types` says of each prim type how many
    there are, below instances too, how many are drawn, and why others are not: "invisible",
    "purpose proxy", or "left out", which the report explains. Empty if the stage does not open.
    """
    report = Report(path)
    with one_at_a_time, collected_warnings(report):
        stage = open_stage(path, options, report)
        return {} if stage is None else _summary(stage, Clock(time), options, drawn)


def _summary(
    stage: Any, clock: Clock, options: StageOptions, drawn: Iterable[str]
) -> dict[str, Any]:
    prims = list(Usd.PrimRange.Stage(stage, Usd.TraverseInstanceProxies()))
    found = (stage.GetPrimAtPath(path) for path in drawn)
    known = {type_of(prim) for prim in found if prim}
    layers = [layer.GetDisplayName() for layer in stage.GetUsedLayers() if not layer.anonymous]
    cameras = [str(prim.GetPath()) for prim in prims if prim.IsA(UsdGeom.Camera)]
    ranged = stage.HasAuthoredTimeCodeRange()
    return {
        "up": str(UsdGeom.GetStageUpAxis(stage)),
        "meters_per_unit": UsdGeom.GetStageMetersPerUnit(stage),
        "time_codes_per_second": stage.GetTimeCodesPerSecond(),
        "time_codes": [stage.GetStartTimeCode(), stage.GetEndTimeCode()] if ranged else None,
        "default_prim": str(stage.GetDefaultPrim().GetPath()) if stage.GetDefaultPrim() else None,
        "layers": len(layers),
        "layer_names": layers[:LISTED],
        "prims": len(prims),
        "types": _types(prims, clock, options, known),
        "native_instances": sum(prim.IsInstance() for prim in prims),
        "native_prototypes": len(stage.GetPrototypes()),
        "cameras": len(cameras),
        "camera_paths": cameras[:LISTED],
        "variants": _variants(prims),
    }


def _types(
    prims: list[Any], clock: Clock, options: StageOptions, known: set[str]
) -> dict[str, dict[str, int]]:
    """How many prims of each type are `there`; of what has a shape, how many are `drawn`."""
    counts: dict[str, Counter[str]] = {}
    passed: dict[Any, tuple[bool, str]] = {Sdf.Path.absoluteRootPath: (True, "default")}
    for prim in prims:
        visible, purpose = passed[prim.GetPath().GetParentPath()]
        imageable = UsdGeom.Imageable(prim)
        if imageable:
            attribute = imageable.GetVisibilityAttr()
            visible = visible and clock.token(attribute) != UsdGeom.Tokens.invisible
            if imageable.GetPurposeAttr().HasAuthoredValue():
                purpose = clock.token(imageable.GetPurposeAttr()) or purpose
        passed[prim.GetPath()] = (visible, purpose)
        kind = type_of(prim) or "typeless"
        count = counts.setdefault(kind, Counter())
        count["there"] += 1
        if not prim.IsA(UsdGeom.Boundable) or prim.HasAPI(UsdLux.LightAPI):
            continue
        if not visible:
            count["invisible"] += 1
        elif purpose not in (options.purposes or PURPOSES):
            count[f"purpose {purpose}"] += 1
        else:
            count["drawn" if kind in known else "left out"] += 1
    return {kind: dict(counts[kind]) for kind in sorted(counts)}


def _variants(prims: list[Any]) -> dict[str, list[str]]:
    """The sets of the first prims that have any: `/World/Car{color=red}` and all there are."""
    found: dict[str, list[str]] = {}
    for prim in prims:
        if len(found) >= LISTED:
            break
        if prim.HasVariantSets() and not prim.IsInstanceProxy():
            sets = prim.GetVariantSets()
            for name in sets.GetNames():
                chosen = sets.GetVariantSelection(name)
                found[f"{prim.GetPath()}{{{name}={chosen}}}"] = list(
                    sets.GetVariantSet(name).GetVariantNames()
                )
    return found
