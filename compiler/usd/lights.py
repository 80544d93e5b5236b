"""Lights of UsdLux as suns, point lights and the sky.

Emission is colour · intensity · 2^exposure, times the colour of the temperature if enabled:
radiance, at intensity 1 one unit. A sun's irradiance is its radiance times the solid angle of its
disc; a ball's intensity is its radiance times the area of its disc. `normalize` divides by that
solid angle, or by the light's surface, after the light's scale. Rectangles, discs and cylinders
become balls that send as much to where they send most, and as much everywhere else.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from pxr import Gf, UsdLux

from compiler.usd.clock import Clock
from compiler.usd.report import Report
from compiler.usd.schema import type_of
from dsl.scene import Color, Origin, PointLight, Sky, Sun

Light = Sun | PointLight | Sky

_AREAS = ("RectLight", "DiskLight", "CylinderLight")


def read_light(
    prim: Any, world_from_light: Any, clock: Clock, report: Report, origin: Origin
) -> Light | None:
    """One light in world space, or None (reported) for a kind that is not handled.

    `world_from_light` is a Gf.Matrix4d (row vectors).
    """
    path = prim.GetPath()
    kind = type_of(prim)
    emission = _emission(prim, clock)
    for name in ("light:filters", "light:link"):
        relationship = prim.GetRelationship(name)
        if relationship and relationship.HasAuthoredTargets():
            report.add("usd-light", f"`{name}` of lights is not used", path)
    if prim.HasAPI(UsdLux.ShapingAPI):
        cone = clock.number(prim.GetAttribute("inputs:shaping:cone:angle"), 90.0)
        if cone < 180.0 and kind != "DistantLight":
            message = "`inputs:shaping:cone:angle` is not used: lights shine to all sides"
            report.add("usd-light", message, path)
    if kind == "DistantLight":
        return _sun(prim, emission, world_from_light, clock, origin)
    if kind == "SphereLight":
        return _ball(prim, emission, world_from_light, clock, origin)
    if kind in ("DomeLight", "DomeLight_1"):
        texture = clock.value(prim.GetAttribute("inputs:texture:file"))
        if texture is not None and texture.path:
            message = "`inputs:texture:file` of dome lights is not used; their colour is"
            report.add("usd-light", message, path)
        return Sky(emission, origin)
    if kind in _AREAS:
        message = f"`{kind}`s are drawn as balls of their size, which shine to all sides"
        report.add("usd-light", message, path)
        return _area(prim, kind, emission, world_from_light, clock, origin)
    report.add("usd-light", f"`{kind}` lights are not handled", path)
    return None


def _emission(prim: Any, clock: Clock) -> Color:
    value = clock.value(_input(prim, "color"))
    color = np.array(value if value is not None else (1.0, 1.0, 1.0), dtype=np.float64)
    intensity = clock.number(_input(prim, "intensity"), 1.0)
    # Beyond this the product overflows whatever the intensity.
    exposure = min(max(clock.number(_input(prim, "exposure"), 0.0), -1000.0), 1000.0)
    with np.errstate(invalid="ignore", over="ignore"):
        if clock.value(_input(prim, "enableColorTemperature")):
            kelvin = clock.number(_input(prim, "colorTemperature"), 6500.0)
            color = color * np.array(UsdLux.BlackbodyTemperatureAsRgb(kelvin))
        r, g, b = (float(x) for x in np.nan_to_num(color * intensity * 2.0**exposure))
    return (r, g, b)


def _input(prim: Any, name: str) -> Any:
    """An input's attribute, by its old name in files that have only that."""
    attribute = prim.GetAttribute(f"inputs:{name}")
    if attribute and attribute.HasAuthoredValue():
        return attribute
    old = prim.GetAttribute(name)
    return old if old and old.HasAuthoredValue() else attribute


def _scaled(emission: Color, factor: float) -> Color:
    return (emission[0] * factor, emission[1] * factor, emission[2] * factor)


def _sun(prim: Any, emission: Color, world: Any, clock: Clock, origin: Origin) -> Sun:
    angle = min(abs(clock.number(_input(prim, "angle"), 0.53)), 180.0)
    solid_angle = math.pi * math.sin(math.radians(angle / 2.0)) ** 2
    normalized = angle == 0.0 or bool(clock.value(_input(prim, "normalize")))
    x, y, z = world.TransformDir(Gf.Vec3d(0.0, 0.0, -1.0))
    irradiance = _scaled(emission, 1.0 if normalized else solid_angle)
    return Sun((x, y, z), irradiance, angle, origin)


def _ball(prim: Any, emission: Color, world: Any, clock: Clock, origin: Origin) -> PointLight:
    axes = np.array(world)[:3, :3]
    scale = float(np.linalg.norm(axes, axis=1).mean())
    radius = abs(clock.number(_input(prim, "radius"), 0.5)) * scale
    # Power per solid angle of a ball of radiance 1: its disc; normalised, the disc over the ball.
    factor = 0.25 if clock.value(_input(prim, "normalize")) else math.pi * radius**2
    point = bool(clock.value(prim.GetAttribute("treatAsPoint")))
    x, y, z = world.ExtractTranslation()
    return PointLight((x, y, z), _scaled(emission, factor), 0.0 if point else radius, origin)


def _area(
    prim: Any, kind: str, emission: Color, world: Any, clock: Clock, origin: Origin
) -> PointLight:
    x, y, z = np.array(world)[:3, :3]
    facing = float(np.linalg.norm(np.cross(x, y)))
    surface_by_shadow = 1.0
    if kind == "RectLight":
        width, height = (clock.number(_input(prim, name), 1.0) for name in ("width", "height"))
        shadow = abs(width * height) * facing
    elif kind == "DiskLight":
        shadow = math.pi * clock.number(_input(prim, "radius"), 0.5) ** 2 * facing
    else:
        # Along x; seen from the side it is a rectangle, and its wall is pi times as large.
        length = abs(clock.number(_input(prim, "length"), 1.0)) * float(np.linalg.norm(x))
        thick = math.sqrt(float(np.linalg.norm(y)) * float(np.linalg.norm(z)))
        shadow = 2.0 * abs(clock.number(_input(prim, "radius"), 0.5)) * thick * length
        surface_by_shadow = math.pi
    normalized = bool(clock.value(_input(prim, "normalize")))
    factor = 1.0 / surface_by_shadow if normalized else shadow
    line = bool(clock.value(prim.GetAttribute("treatAsLine")))
    place = world.ExtractTranslation()
    radius = 0.0 if line else math.sqrt(shadow / math.pi)
    return PointLight((place[0], place[1], place[2]), _scaled(emission, factor), radius, origin)
