"""Lights of UsdLux as suns, points, surfaces and the sky.

Emission is colour · intensity · 2^exposure, times the colour of the temperature if enabled:
radiance, at intensity 1 one unit. A sun's irradiance is its radiance times the solid angle of its
disc; a ball's intensity is its radiance times the area of its disc. `normalize` divides by that
solid angle, or by the light's surface, after the light's scale. Rectangles, discs and cylinders
keep their shape under every transform.
"""

from __future__ import annotations

import math
from typing import Any, get_args

import numpy as np
from pxr import Gf, Sdf, UsdGeom, UsdLux

from compiler.usd.clock import Clock
from compiler.usd.report import Report
from compiler.usd.schema import type_of
from compiler.usd.textures import asset_file
from compiler.usd.xform import rotation
from dsl.scene import (
    UNSHAPED,
    AreaKind,
    AreaLight,
    Color,
    FloatArray,
    Light,
    Origin,
    PointLight,
    Shaping,
    Sky,
    Step,
    Sun,
    Vector,
)

_SURFACES: dict[str, AreaKind] = dict(
    zip(("RectLight", "DiskLight", "CylinderLight"), get_args(AreaKind), strict=True)
)

_THIN = 1000.0
"""How many times as long as thick a cylinder is that is a line."""


def read_light(
    prim: Any, world_from_light: Any, clock: Clock, report: Report, origin: Origin
) -> Light | None:
    """One light in world space, or None (reported) for a kind that is not handled.

    `world_from_light` is a Gf.Matrix4d (row vectors). A sky with a texture is in the space of its
    `pole`.
    """
    path = prim.GetPath()
    kind = type_of(prim)
    emission = _emission(prim, clock, report)
    for name in ("light:filters", "light:link"):
        relationship = prim.GetRelationship(name)
        if relationship and relationship.HasAuthoredTargets():
            report.add("usd-light", f"`{name}` of lights is not used", path)
    if kind == "DistantLight":
        return _sun(prim, emission, world_from_light, clock, origin)
    if kind == "SphereLight":
        return _ball(prim, emission, world_from_light, clock, origin)
    if kind in ("DomeLight", "DomeLight_1"):
        return Sky(emission, origin, _dome_texture(prim, clock, report))
    if kind in _SURFACES:
        light = _surface(prim, _SURFACES[kind], emission, world_from_light, clock, origin)
        if light is None:
            report.add("usd-light", "a light without a surface is dark", path)
        return light
    report.add("usd-light", f"`{kind}` lights are not handled", path)
    return None


def pole(prim: Any, clock: Clock, report: Report) -> tuple[Step, ...]:
    """What turns a sky, whose pole is +y, into a dome's own space.

    By `poleAxis` of DomeLight_1 the pole is +Y and the middle of the picture +Z, or the pole is +Z
    and the middle -Y (its schema's documentation); the pole of a DomeLight is always +Y.
    """
    axis = clock.value(prim.GetAttribute("poleAxis"))
    if axis is not None and axis not in ("scene", "Y", "Z"):
        message = f"`poleAxis = {axis!r}` is none of scene, Y and Z; the scene's is used"
        report.add("usd-light", message, prim.GetPath())
        axis = "scene"
    if axis == "scene":
        axis = UsdGeom.GetStageUpAxis(prim.GetStage())
    return (rotation("X", 90.0),) if axis == "Z" else ()


def _dome_texture(prim: Any, clock: Clock, report: Report) -> str:
    """The file of a dome's picture; "" where there is none, or none that can be used (reported)."""
    attribute = prim.GetAttribute("inputs:texture:file")
    asset = clock.value(attribute)
    if not isinstance(asset, Sdf.AssetPath) or not asset.path:
        return ""
    layout = clock.token(prim.GetAttribute("inputs:texture:format"))
    if layout not in ("", "automatic", "latlong"):
        message = f"the texture of a dome in the format `{layout}` is not used; its colour is"
        report.add("usd-light", message, prim.GetPath(), "convert it to `latlong`")
        return ""
    if not asset.resolvedPath:
        file = asset_file(attribute, asset, clock)
        message = f"the texture `{file}` cannot be found: the dome has its colour alone"
        help = "mend the path, or set `inputs:color` to the mean of the texture"
        report.add("usd-light", message, prim.GetPath(), help)
    return str(asset.resolvedPath)


def _emission(prim: Any, clock: Clock, report: Report) -> Color:
    color = np.array(clock.vector(_input(prim, "color"), 3, report) or (1.0, 1.0, 1.0))
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
    intensity, shaping = _scaled(emission, factor), _shaping(prim, clock)
    back = axes[2] if shaping != UNSHAPED and axes[2].any() else np.array((0.0, 1.0, 0.0))
    size = 0.0 if point else radius
    return PointLight((x, y, z), intensity, size, origin, _vector(-back), shaping)


def _surface(
    prim: Any, kind: AreaKind, emission: Color, world: Any, clock: Clock, origin: Origin
) -> AreaLight | None:
    """The light whose shape USD has in the xy plane, shining to -z, or around the x axis."""
    x, y, z = np.array(world)[:3, :3]

    def size(name: str, otherwise: float) -> float:
        return abs(clock.number(_input(prim, name), otherwise))

    if kind == "rectangle":
        u, v, w = x * size("width", 1.0) / 2.0, y * size("height", 1.0) / 2.0, -z
        area = 4.0 * float(np.linalg.norm(np.cross(u, v)))
    elif kind == "disc":
        u, v, w = x * size("radius", 0.5), y * size("radius", 0.5), -z
        area = math.pi * float(np.linalg.norm(np.cross(u, v)))
    else:
        length, radius = size("length", 1.0), size("radius", 0.5)
        if radius == 0.0 and clock.value(prim.GetAttribute("treatAsLine")):
            radius = length / _THIN
        u, v, w = x * length / 2.0, y * radius, -z * radius
        area = _wall(u, v, w)
    if not (0.0 < area < math.inf and np.linalg.det((u, v, w))):
        return None
    normalized = bool(clock.value(_input(prim, "normalize")))
    radiance = _scaled(emission, 1.0 / area if normalized else 1.0)
    if not np.isfinite(radiance).all():
        return None
    axes = (_vector(u), _vector(v), _vector(w))
    place = _vector(np.array(world)[3, :3])
    return AreaLight(kind, radiance, axes, place, _shaping(prim, clock), origin)


def _wall(u: FloatArray, v: FloatArray, w: FloatArray) -> float:
    """The area of the wall of a cylinder s u + cos φ v + sin φ w, s in -1 … 1."""
    angles = np.linspace(0.0, 2.0 * math.pi, 256, endpoint=False)[:, None]
    around = np.cos(angles) * w - np.sin(angles) * v
    return 4.0 * math.pi * float(np.linalg.norm(np.cross(u, around), axis=1).mean())


def _shaping(prim: Any, clock: Clock) -> Shaping:
    if not prim.HasAPI(UsdLux.ShapingAPI):
        return UNSHAPED

    def said(name: str, otherwise: float) -> float:
        return clock.number(prim.GetAttribute(f"inputs:shaping:{name}"), otherwise)

    return Shaping(
        min(max(said("cone:angle", 90.0), 0.0), 180.0),
        min(max(said("cone:softness", 0.0), 0.0), 1.0),
        max(said("focus", 0.0), 0.0),
    )


def _vector(numbers: FloatArray) -> Vector:
    x, y, z = (float(n) + 0.0 for n in numbers)
    return x, y, z
