"""Cameras of a stage. Apertures, offsets and focal length are in tenths of a stage unit."""

from __future__ import annotations

import math
from typing import Any

from compiler.usd.clock import Clock
from compiler.usd.report import Report
from dsl.scene import Camera, Origin

_TENTH = 0.1


def read_camera(prim: Any, clock: Clock, report: Report, origin: Origin) -> Camera | None:
    """A Camera prim in its own space, named by its path, or None (reported) without a window."""

    def number(name: str, fallback: float) -> float:
        return clock.number(prim.GetAttribute(name), fallback)

    path = prim.GetPath()
    width = number("horizontalAperture", 20.955)
    height = number("verticalAperture", 15.2908)
    focal = number("focalLength", 50.0)
    orthographic = clock.token(prim.GetAttribute("projection")) == "orthographic"
    if min(width, height) <= 0.0 or (focal <= 0.0 and not orthographic):
        message = "a camera whose aperture or focal length is not positive is left out"
        report.add("usd-camera", message, path)
        return None
    if number("fStop", 0.0) > 0.0:
        report.add("usd-camera", "cameras are pinholes: `fStop` is not used", path)
    if clock.value(prim.GetAttribute("clippingPlanes")):
        report.add("usd-camera", "`clippingPlanes` of cameras are not used", path)
    near, far = 1.0, 1e6
    value = clock.value(prim.GetAttribute("clippingRange"))
    if value is not None:
        near, far = (float(x) for x in value)
    exact = clock.value(prim.GetAttribute("ovolo:clippingRange"))
    if exact is not None:
        near, far = (float(x) for x in exact)
    free = bool(clock.value(prim.GetAttribute("ovolo:freeAspect")))
    return Camera(
        projection="orthographic" if orthographic else "perspective",
        height=height * _TENTH if orthographic else height / focal,
        aspect=None if free else width / height,
        shift=(
            number("horizontalApertureOffset", 0.0) / width,
            number("verticalApertureOffset", 0.0) / height,
        ),
        near=max(near, 0.0) if math.isfinite(near) else 0.0,
        far=far if far > near else math.inf,
        name=str(path),
        origin=origin,
    )
