"""What a stage asks of its picture: its RenderSettings prim."""

from __future__ import annotations

import math
from typing import Any, get_args

from pxr import UsdRender

from compiler.usd.clock import Clock
from compiler.usd.report import Report
from dsl.scene import Integrator, Precision, Settings

_MOST = {"width": 65_536, "height": 65_536, "samples": 1_000_000}


def render_settings(stage: Any, report: Report) -> Any | None:
    """The prim that the stage's `renderSettingsPrimPath` names, or None."""
    if not stage.HasAuthoredMetadata("renderSettingsPrimPath"):
        return None
    settings = UsdRender.Settings.GetStageRenderSettings(stage)
    if settings:
        return settings.GetPrim()
    path = stage.GetMetadata("renderSettingsPrimPath")
    report.add("usd-attribute", f"`renderSettingsPrimPath = {path}` is no RenderSettings prim")
    return None


def first_camera(prim: Any) -> str | None:
    """The path of the camera that the settings name."""
    targets = UsdRender.Settings(prim).GetCameraRel().GetForwardedTargets()
    return str(targets[0]) if targets else None


def read_settings(prim: Any, clock: Clock, report: Report) -> Settings:
    """The settings of a RenderSettings prim; what is out of range is reported and not said."""
    said: dict[str, Any] = {}
    resolution = clock.value(prim.GetAttribute("resolution"))
    if resolution is not None and prim.GetAttribute("resolution").HasAuthoredValue():
        said["width"], said["height"] = (int(n) or None for n in resolution)
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
