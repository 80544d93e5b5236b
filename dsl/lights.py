"""Lights, cameras and settings."""

from __future__ import annotations

import math
from pathlib import PurePath
from typing import Any, get_args

from dsl.angles import tangent
from dsl.calls import Site
from dsl.files import FileFault
from dsl.kinds import ANGLE, COLOR, NUMBER, STRING, VECTOR2, VECTOR3
from dsl.materials import check_color, check_range
from dsl.scene import (
    AreaKind,
    AreaLight,
    Camera,
    Instances,
    Integrator,
    Origin,
    PointLight,
    Precision,
    Settings,
    Shaping,
    Sky,
    Sun,
    Vector,
)
from dsl.suggest import did_you_mean
from dsl.transforms import LOOK_AT, look_at
from dsl.values import Builtin, Parameter, Signature, format_number

_Rgb = tuple[float, float, float]


def _sun(site: Site, direction: Vector, irradiance: float, color: _Rgb, angle: float) -> Sun:
    if not any(direction):
        raise site.fault("value-degenerate", "`direction` is (0, 0, 0)", "direction")
    check_range(site, "irradiance", irradiance, 0.0, None)
    check_range(site, "angle", angle, 0.0, 180.0, "°")
    return Sun(direction, _times(site, color, irradiance), angle, Origin(site.span))


def _sky(site: Site, color: _Rgb, texture: str | None) -> Sky:
    radiance, origin = _times(site, color, 1.0), Origin(site.span)
    if texture is None:
        return Sky(radiance, origin)
    try:
        site.files.resolve(texture, site.folder)
    except FileFault as fault:
        raise site.fault(fault.code, fault.message, "texture", fault.help) from None
    return Sky(radiance, origin, str(PurePath(site.folder) / texture))


def _point_light(
    site: Site,
    position: Vector,
    intensity: float,
    color: _Rgb,
    radius: float,
    direction: Vector,
    *shaping: float,
) -> PointLight:
    check_range(site, "intensity", intensity, 0.0, None)
    check_range(site, "radius", radius, 0.0, None)
    if not any(direction):
        raise site.fault("value-degenerate", "`direction` is (0, 0, 0)", "direction")
    emitted, shaped = _times(site, color, intensity), _shaping(site, *shaping)
    return PointLight(position, emitted, radius, Origin(site.span), direction, shaped)


def _rectangle_light(
    site: Site, size: tuple[float, float], radiance: float, color: _Rgb, *shaping: float
) -> AreaLight:
    if min(size) <= 0.0:
        raise site.fault("value-out-of-range", "both parts of `size` must be above 0", "size")
    x, z = size
    axes = ((0.5 * x, 0.0, 0.0), (0.0, 0.0, 0.5 * z), (0.0, -1.0, 0.0))
    return _area_light(site, "rectangle", axes, radiance, color, *shaping)


def _disc_light(
    site: Site, radius: float, radiance: float, color: _Rgb, *shaping: float
) -> AreaLight:
    _check_positive(site, "radius", radius)
    axes = ((radius, 0.0, 0.0), (0.0, 0.0, radius), (0.0, -1.0, 0.0))
    return _area_light(site, "disc", axes, radiance, color, *shaping)


def _cylinder_light(
    site: Site, radius: float, height: float, radiance: float, color: _Rgb, *shaping: float
) -> AreaLight:
    _check_positive(site, "radius", radius)
    _check_positive(site, "height", height)
    axes = ((0.0, 0.5 * height, 0.0), (radius, 0.0, 0.0), (0.0, 0.0, radius))
    return _area_light(site, "cylinder", axes, radiance, color, *shaping)


def _area_light(
    site: Site,
    kind: AreaKind,
    axes: tuple[Vector, Vector, Vector],
    radiance: float,
    color: _Rgb,
    *shaping: float,
) -> AreaLight:
    check_range(site, "radiance", radiance, 0.0, None)
    emitted, shaped = _times(site, color, radiance), _shaping(site, *shaping)
    return AreaLight(kind, emitted, axes, shaping=shaped, origin=Origin(site.span))


def _shaping(site: Site, cone: float, softness: float, focus: float) -> Shaping:
    check_range(site, "cone", cone, 0.0, 180.0, "°")
    check_range(site, "softness", softness, 0.0, 1.0)
    check_range(site, "focus", focus, 0.0, None)
    return Shaping(cone, softness, focus)


def _check_positive(site: Site, name: str, value: float) -> None:
    if value <= 0.0:
        message = f"{name} = {format_number(value)} is not above 0"
        raise site.fault("value-out-of-range", message, name)


def _times(site: Site, color: _Rgb, factor: float) -> _Rgb:
    check_color(site, "color", color)
    red, green, blue = (factor * component for component in color)
    if not math.isfinite(max(red, green, blue)):
        raise site.fault("value-not-finite", "the light is too bright for a number")
    return red, green, blue


def _perspective(
    site: Site, origin: Vector, at: Vector, up: Vector, fov: float, *rest: Any
) -> Instances:
    if not 0.0 < fov < 180.0:
        raise site.fault(
            "value-out-of-range",
            f"fov = {format_number(fov)}° is not between 0° and 180°",
            "fov",
        )
    camera = _camera(site, "perspective", 2.0 * tangent(0.5 * fov), *rest)
    return Instances(camera, look_at(site, origin, at, up), origin=Origin(site.span))


def _orthographic(
    site: Site, origin: Vector, at: Vector, up: Vector, height: float, *rest: Any
) -> Instances:
    if height <= 0.0:
        raise site.fault(
            "value-out-of-range", f"height = {format_number(height)} is not above 0", "height"
        )
    camera = _camera(site, "orthographic", height, *rest)
    return Instances(camera, look_at(site, origin, at, up), origin=Origin(site.span))


def _camera(
    site: Site, projection: Any, height: float, name: str, near: float, far: float | None
) -> Camera:
    check_range(site, "near", near, 0.0, None)
    far = math.inf if far is None else far
    if far <= near:
        raise site.fault(
            "value-order",
            f"near = {format_number(near)} is not below far = {format_number(far)}",
            "far",
        )
    return Camera(projection, height, near=near, far=far, name=name, origin=Origin(site.span))


def _settings(site: Site, *values: Any) -> Settings:
    given = {p.name: v for p, v in zip(_SETTINGS, values, strict=True) if v is not None}
    for name, largest in (("width", 65_536), ("height", 65_536), ("samples", 1_000_000)):
        if name in given:
            given[name] = _whole(site, name, given[name], largest)
    _check_choice(site, "integrator", given.get("integrator"), get_args(Integrator))
    _check_choice(site, "precision", given.get("precision"), get_args(Precision))
    if (distance := given.get("occlusion_distance", 1.0)) <= 0.0:
        message = f"occlusion_distance = {format_number(distance)} is not above 0"
        raise site.fault("value-out-of-range", message, "occlusion_distance")
    return Settings(**given, origin=Origin(site.span))


def _whole(site: Site, name: str, value: float, largest: int) -> int:
    if value != int(value):
        raise site.fault(
            "value-not-an-integer", f"{name} = {format_number(value)} is not a whole number", name
        )
    check_range(site, name, value, 1.0, float(largest))
    return int(value)


def _check_choice(site: Site, name: str, value: str | None, choices: tuple[str, ...]) -> None:
    if value is not None and value not in choices:
        listed = ", ".join(f'"{choice}"' for choice in choices)
        raise site.fault(
            "value-choice",
            f'"{value}" is no {name}',
            name,
            did_you_mean(value, choices) or f"the choices are {listed}",
        )


_COLOR = Parameter("color", COLOR, (1.0, 1.0, 1.0))
_SHAPING = (
    Parameter("cone", ANGLE, 180.0, doc="how far from its axis it shines"),
    Parameter("softness", NUMBER, 0.0, doc="part of the cone in which it fades"),
    Parameter("focus", NUMBER, 0.0, doc="power of the cosine to the axis"),
)
_SURFACE = (Parameter("radiance", NUMBER, 1.0), _COLOR, *_SHAPING)
_CAMERA = (
    Parameter("name", STRING, "", doc="what `--camera` chooses it by"),
    Parameter("near", NUMBER, 0.0, doc="distance before which nothing is seen"),
    Parameter("far", NUMBER, doc="distance beyond which nothing is seen"),
)
_SETTINGS = (
    Parameter("width", NUMBER, doc="pixels"),
    Parameter("height", NUMBER, doc="pixels"),
    Parameter("samples", NUMBER, doc="camera rays per pixel"),
    Parameter("integrator", STRING, doc=f"one of {', '.join(get_args(Integrator))}"),
    Parameter("precision", STRING, doc=f"one of {', '.join(get_args(Precision))}"),
    Parameter("occlusion_distance", NUMBER, doc="how far ambient occlusion looks"),
    Parameter("exposure", NUMBER, doc="stops by which the picture is brighter"),
)

LIGHTS = (
    Builtin(
        "sun",
        (
            Signature(
                (
                    Parameter("direction", VECTOR3, required=True, doc="where the light travels"),
                    Parameter("irradiance", NUMBER, 1.0, doc="on a surface that faces it"),
                    _COLOR,
                    Parameter("angle", ANGLE, 0.0, doc="diameter in the sky; 0 casts hard shadows"),
                ),
                _sun,
            ),
        ),
        "a light",
        "Parallel light.",
    ),
    Builtin(
        "sky",
        (
            Signature(
                (
                    _COLOR,
                    Parameter("texture", STRING, doc="a picture by latitude and longitude"),
                ),
                _sky,
            ),
        ),
        "a light",
        "Light from every direction, which is also the background.",
    ),
    Builtin(
        "point_light",
        (
            Signature(
                (
                    Parameter("position", VECTOR3, (0.0, 0.0, 0.0)),
                    Parameter("intensity", NUMBER, 1.0, doc="irradiance at distance 1"),
                    _COLOR,
                    Parameter("radius", NUMBER, 0.0, doc="above 0, shadows are soft"),
                    Parameter("direction", VECTOR3, (0.0, -1.0, 0.0), doc="of the cone's axis"),
                    *_SHAPING,
                ),
                _point_light,
            ),
        ),
        "a light",
        "Light from a point, or from a ball; with a cone, a spotlight.",
    ),
    Builtin(
        "rectangle_light",
        (Signature((Parameter("size", VECTOR2, (1.0, 1.0)), *_SURFACE), _rectangle_light),),
        "a light",
        "Light from a rectangle in x and z, towards -y.",
    ),
    Builtin(
        "disc_light",
        (Signature((Parameter("radius", NUMBER, 1.0), *_SURFACE), _disc_light),),
        "a light",
        "Light from a disc in x and z, towards -y.",
    ),
    Builtin(
        "cylinder_light",
        (
            Signature(
                (
                    Parameter("radius", NUMBER, 1.0),
                    Parameter("height", NUMBER, 2.0),
                    *_SURFACE,
                ),
                _cylinder_light,
            ),
        ),
        "a light",
        "Light from the wall of a cylinder along y, around the origin.",
    ),
    Builtin(
        "camera",
        (
            Signature(
                (
                    *LOOK_AT,
                    Parameter("fov", ANGLE, 45.0, doc="vertical angle of view"),
                    *_CAMERA,
                ),
                _perspective,
            ),
            Signature(
                (
                    *LOOK_AT,
                    Parameter("height", NUMBER, required=True, doc="of what is seen"),
                    *_CAMERA,
                ),
                _orthographic,
            ),
        ),
        "a camera",
        "A camera: in perspective, or orthographic if it has a `height`.",
    ),
    Builtin(
        "settings",
        (Signature(_SETTINGS, _settings),),
        "settings",
        "How the picture is made, unless the command line says otherwise.",
    ),
)
