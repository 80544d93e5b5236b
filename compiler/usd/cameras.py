"""Cameras of a stage. Apertures, offsets and focal length are in tenths of a stage unit.

The exposure of a picture is `exposure` in stops, times what sensitivity, shutter time, aperture and
responsivity of `exposure:…` let through, relative to 1 s at ISO 100 and f/1.
"""

from __future__ import annotations

import math
from collections.abc import Callable
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
    stop = number("fStop", 0.0)
    if stop > 0.0:
        message = "pictures are taken through pinholes: `fStop` of cameras is not used"
        report.add("usd-camera", message, path)
    shutter = (number("shutter:open", 0.0), number("shutter:close", 0.0))
    if shutter[0] != shutter[1]:
        message = "nothing blurs as it moves: the `shutter` of cameras is not used"
        report.add("usd-camera", message, path)
    if clock.value(prim.GetAttribute("clippingPlanes")):
        report.add("usd-camera", "`clippingPlanes` of cameras are not used", path)
    near, far = 1.0, 1e6
    for name in ("clippingRange", "ovolo:clippingRange"):
        near, far = clock.vector(prim.GetAttribute(name), 2, report) or (near, far)
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
        exposure=_exposure(number, report, path),
        lens_radius=_TENTH * focal / (2.0 * stop) if stop > 0.0 else 0.0,
        focus_distance=number("focusDistance", 0.0),
        shutter=shutter,
    )


def _exposure(number: Callable[[str, float], float], report: Report, path: Any) -> float:
    """Stops by which a picture is brighter."""
    factors = [
        number("exposure:time", 1.0),
        number("exposure:iso", 100.0) / 100.0,
        number("exposure:responsivity", 1.0),
        number("exposure:fStop", 1.0),
    ]
    if min(factors) <= 0.0:
        message = "a camera's exposure that is not positive is not used"
        report.add("usd-camera", message, path)
        return 0.0
    time, sensitivity, responsivity, stop = (math.log2(factor) for factor in factors)
    return number("exposure", 0.0) + time + sensitivity + responsivity - 2.0 * stop
