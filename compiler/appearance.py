"""Materials, lights, cameras and settings of a scene graph as records of the IR."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import fields

import numpy as np
from numpy.typing import NDArray

from compiler import ir
from compiler.affine import Affine
from compiler.double_double import ZERO, DoubleDouble, Part
from compiler.provenance import Texts
from compiler.transforms import with_inverse
from compiler.vectors import cross, dot, length, leveling, unit
from dsl.scene import (
    MATERIAL_PARAMETERS,
    UNSHAPED,
    AreaLight,
    Camera,
    FloatArray,
    Light,
    Material,
    PointLight,
    Settings,
    Shaping,
    Sky,
    Sun,
    Vector,
)

_MOST_STEPS = 60
"""Of an iteration that takes about ten."""
_SETTLED = 2.0**-50
"""A step of so little has squared it."""
_NOISE = 2.0**-90


class Materials:
    """Distinct materials, numbered as they come."""

    def __init__(self) -> None:
        self.nodes: list[Material] = []
        self._numbers: dict[Material, int] = {}

    def index(self, material: Material) -> int:
        """The number of a material."""
        number = self._numbers.setdefault(material, len(self.nodes))
        if number == len(self.nodes):
            self.nodes.append(material)
        return number


def material_table(materials: Iterable[Material]) -> NDArray[np.void]:
    """`SceneIR.materials`."""
    rows = list(materials)
    table = np.zeros(len(rows), dtype=ir.MATERIAL)
    for name in MATERIAL_PARAMETERS:
        if rows:
            table[name] = [getattr(material, name) for material in rows]
    return table


def settings_record(settings: Iterable[Settings]) -> NDArray[np.void]:
    """`SceneIR.settings`: what is said last holds, field by field."""
    said: dict[str, object] = {}
    for part in settings:
        for field in fields(Settings):
            value = getattr(part, field.name)
            if value is not None:
                said[field.name] = value
    record = np.zeros(1, dtype=ir.SETTINGS)
    for name in ("width", "height", "samples"):
        record[name] = said.get(name, 0)
    for name, choices in (("integrator", ir.INTEGRATORS), ("precision", ir.PRECISIONS)):
        record[name] = choices.index(str(said[name])) if name in said else -1
    record["up"] = ir.UP_AXES.index(str(said.get("up", "y")))
    for name in ("occlusion_distance", "exposure"):
        record[name] = said.get(name, math.nan)
    return record


def contributes(light: Light) -> bool:
    """Whether anything can be lit by it."""
    match light:
        case Sun(direction=direction, irradiance=color):
            return any(color) and any(direction)
        case PointLight(intensity=color):
            return any(color)
        case AreaLight(radiance=color):
            return any(color)
        case Sky(radiance=color):
            return any(color)


def light_table(lights: Sequence[tuple[Light, Affine]], texts: Texts) -> NDArray[np.void]:
    """`SceneIR.lights`, each placed by its `world_from_object` of one lane.

    The surface of an area light is moved point by point. A point light's radius grows by the cube
    root of the volume's; its intensity, like a sun's irradiance and its angle, and a surface's
    radiance, is not changed by scales. A sky with a texture is turned.
    """
    table = np.zeros(len(lights), dtype=ir.LIGHT)
    for row, (light, placement) in zip(table, lights, strict=True):
        match light:
            case Sun():
                direction = _applied(placement.linear, _exact(light.direction))
                vector, color, size = unit(direction), light.irradiance, light.angle
                row["kind"] = ir.SUN
            case PointLight():
                vector, color = _placed(placement, light.position), light.intensity
                size = _product(light.radius, _growth(placement.linear)) if light.radius else 0.0
                row["kind"] = ir.POINT
                if _shape(row, light.shaping):
                    row["w"] = _rounded(unit(_applied(placement.linear, _exact(light.direction))))
            case AreaLight():
                vector, color, size = _placed(placement, light.position), light.radiance, 0.0
                row["kind"] = ir.LIGHTS.index(light.kind)
                _shape(row, light.shaping)
                for name, axis in zip(("u", "v", "w"), light.axes, strict=True):
                    row[name] = _rounded(_applied(placement.linear, _exact(axis)))
            case Sky():
                row["kind"], row["color"] = ir.SKY, light.radiance
                if light.texture:
                    row["file"] = 1 + texts.index(light.texture)
                    row["u"], row["v"], row["w"] = _turned(placement.linear).T
                continue
        row["vector"], row["color"], row["size"] = _rounded(vector), color, size
    return table


def camera_table(cameras: Sequence[tuple[Camera, Affine]], texts: Texts) -> NDArray[np.void]:
    """`SceneIR.cameras`, each placed by its `world_from_object` of one lane.

    The axes are made unit, and what the scales along them do to the window goes into `height`,
    `aspect` (if said), `near`, `far` and the lens, each rounded once; a mirrored camera keeps its
    mirrored axes.
    """
    table = np.zeros(len(cameras), dtype=ir.CAMERA)
    for row, (camera, placement) in zip(table, cameras, strict=True):
        axes = list(zip(*placement.linear, strict=True))
        along_x, along_y, along_z = map(length, axes)
        orthographic = camera.projection == "orthographic"
        row["projection"] = ir.ORTHOGRAPHIC if orthographic else ir.PERSPECTIVE
        row["name"] = texts.index(camera.name)
        for column, axis in enumerate(axes):
            row["world_from_camera"][:, column] = _rounded(unit(axis))
        row["world_from_camera"][:, 3] = _rounded(placement.translation)
        row["height"] = _product(camera.height, along_y if orthographic else along_y / along_z)
        aspect = math.nan if camera.aspect is None else camera.aspect
        row["aspect"] = _product(aspect, along_x / along_y)
        row["shift"] = camera.shift
        row["near"] = _product(camera.near, along_z)
        row["far"] = _product(camera.far, along_z)
        row["exposure"], row["shutter"] = camera.exposure, camera.shutter
        row["lens_radius"] = _product(camera.lens_radius, along_y)
        row["focus_distance"] = _product(camera.focus_distance, along_z)
    return table


def _turned(linear: Sequence[Sequence[DoubleDouble]]) -> FloatArray:
    """The nearest orthogonal matrix `(3, 3)`: the polar factor, rounded once; 0 what is noise.

    Newton's iteration X ← (γX + X⁻ᵀ/γ)/2, with γ = (‖X⁻¹‖/‖X‖)^½ rounded to a power of two (Higham,
    "Computing the polar decomposition", 1986). Of a matrix that is singular to 98 bits the
    identity.
    """
    power = leveling([entry for row in linear for entry in row])
    turned = [[entry.scaled(power) for entry in row] for row in linear]
    last = np.zeros((3, 3))
    with np.errstate(all="ignore"):
        for _ in range(_MOST_STEPS):
            inverse = with_inverse(turned, (ZERO, ZERO, ZERO)).inverse.linear
            there, back = (np.array([_rounded(row) for row in m]) for m in (turned, inverse))
            if np.abs(there - last).max() < _SETTLED:
                return np.where(np.abs(there) < _NOISE, 0.0, there)
            if not np.isfinite(back).all():
                break
            last = there
            ratio = np.frexp(np.abs(back).max())[1] - np.frexp(np.abs(there).max())[1]
            exponent = int(ratio / 2)
            half, rest = np.ldexp(0.5, exponent), np.ldexp(0.5, -exponent)
            turned = [
                [turned[i][j].scaled(half) + inverse[j][i].scaled(rest) for j in range(3)]
                for i in range(3)
            ]
    return np.eye(3)


def _exact(vector: Sequence[float]) -> list[DoubleDouble]:
    return [DoubleDouble.of(v) for v in vector]


def _applied(
    linear: Sequence[Sequence[DoubleDouble]], vector: Sequence[DoubleDouble]
) -> list[DoubleDouble]:
    return [dot(row, vector) for row in linear]


def _placed(placement: Affine, point: Vector) -> tuple[DoubleDouble, DoubleDouble, DoubleDouble]:
    offset = _applied(placement.linear, _exact(point))
    x, y, z = (a + b for a, b in zip(offset, placement.translation, strict=True))
    return x, y, z


def _shape(row: np.void, shaping: Shaping) -> bool:
    """Put a shaping into a record; whether it is one."""
    row["cone"], row["softness"], row["focus"] = shaping.cone, shaping.softness, shaping.focus
    return shaping != UNSHAPED


def _growth(linear: Sequence[Sequence[DoubleDouble]]) -> DoubleDouble:
    """∛|det|: the root in float64, and one step of Newton's from there."""
    power = leveling([entry for row in linear for entry in row])
    x, y, z = ([entry.scaled(power) for entry in row] for row in linear)
    volume = dot(x, cross(y, z))
    if _scalar(volume.hi) < 0.0:
        volume = -volume
    root = DoubleDouble.of(float(np.cbrt(_scalar(volume.hi))))
    square = root * root
    step = (square * root - volume) / (square + square + square)
    return (root - step).scaled(1.0 / power)


def _product(number: float, factor: DoubleDouble) -> float:
    """The product rounded once; a number that is not finite stays what it is."""
    if not math.isfinite(number):
        return number
    return float(_scalar((DoubleDouble.of(number) * factor).hi))


def _rounded(vector: Iterable[DoubleDouble]) -> list[float]:
    return [float(_scalar(entry.hi)) + 0.0 for entry in vector]


def _scalar(part: Part) -> np.float64:
    return np.float64(part.reshape(-1)[0])
