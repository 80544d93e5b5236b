"""What a stage asks of its picture: its RenderSettings prim."""

from __future__ import annotations

import math
from typing import Any, get_args

from pxr import Usd, UsdRender, Vt

from compiler.usd.clock import Clock
from compiler.usd.framing import Framing
from compiler.usd.options import KNOWN_PURPOSES
from compiler.usd.report import Report
from dsl.scene import Integrator, Precision, Settings

_MOST = {"width": 65_536, "height": 65_536, "samples": 1_000_000}


def render_settings(stage: Any, report: Report) -> Any | None:
    """The prim that the stage's `renderSettingsPrimPath` names, or the only one below `/Render`."""
    if not stage.HasAuthoredMetadata("renderSettingsPrimPath"):
        below = stage.GetPrimAtPath("/Render")
        found = [p for p in Usd.PrimRange(below) if p.IsA(UsdRender.Settings)] if below else []
        if len(found) > 1:
            message = "of several RenderSettings prims, none is used"
            help = "name one by the stage's `renderSettingsPrimPath`"
            report.add("usd-attribute", message, found[0].GetPath(), help)
        return found[0] if len(found) == 1 else None
    settings = UsdRender.Settings.GetStageRenderSettings(stage)
    if settings:
        return settings.GetPrim()
    path = stage.GetMetadata("renderSettingsPrimPath")
    report.add("usd-attribute", f"`renderSettingsPrimPath = {path}` is no RenderSettings prim")
    return None


def included_purposes(prim: Any, clock: Clock, report: Report) -> frozenset[str] | None:
    """The purposes that the settings include, if they say so; others than USD's are reported."""
    attribute = UsdRender.Settings(prim).GetIncludedPurposesAttr()
    said = clock.value(attribute) if attribute.HasAuthoredValue() else None
    if not isinstance(said, Vt.TokenArray):
        return None
    purposes = frozenset(map(str, said))
    for purpose in sorted(purposes.difference(KNOWN_PURPOSES)):
        message = f"the purpose {purpose!r} of `includedPurposes` is not known"
        report.add("usd-attribute", message, prim.GetPath())
    return purposes.intersection(KNOWN_PURPOSES)


def read_settings(prim: Any, framing: Framing, clock: Clock, report: Report) -> Settings:
    """The settings of a RenderSettings prim; what is out of range is reported and not said."""
    said: dict[str, Any] = {"product": framing.product}
    if framing.size is not None:
        said["width"], said["height"] = (n or None for n in framing.size)
    said["samples"] = int(clock.number(prim.GetAttribute("ovolo:samples"), 0.0)) or None
    for name, most in _MOST.items():
        if said.get(name) is not None and not 1 <= said[name] <= most:
            message = f"{name} = {said[name]} of the picture is not in 1 … {most}"
            report.add("usd-attribute", message, prim.GetPath())
            said[name] = None
    for name, choices in (("integrator", get_args(Integrator)), ("precision", get_args(Precision))):
        word = clock.token(prim.GetAttribute(f"ovolo:{name}"))
        if word in choices:
            said[name] = word
        elif word:
            message = f"`ovolo:{name} = {word!r}` is none of {', '.join(choices)}"
            report.add("usd-attribute", message, prim.GetPath())
    distance = clock.number(prim.GetAttribute("ovolo:occlusionDistance"), math.nan)
    exposure = clock.number(prim.GetAttribute("ovolo:exposure"), math.nan)
    said["occlusion_distance"] = distance if distance > 0.0 else None
    said["exposure"] = None if math.isnan(exposure) else exposure
    return Settings(**said)
