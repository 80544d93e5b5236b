"""Materials, lights, cameras and settings of a scene graph as records of the IR."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from compiler import ir
from compiler.affine import Affine
from compiler.double_double import ZERO, DoubleDouble
from compiler.provenance import Texts
from compiler.transforms import with_inverse
from compiler.vectors import Vector3, cross, dot, length, leveling, unit
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


def light_table(lights: Sequence[Light], placed: Affine, texts: Texts) -> NDArray[np.void]:
    """`SceneIR.lights`, each placed by its lane of `placed`, the `world_from_object`.

    The surface of an area light is moved point by point. A point light's radius grows by the cube
    root of the volume's; its intensity, like a sun's irradiance and its angle, and a surface's
    radiance, is not changed by scales. A sky with a texture is turned.
    """
    table = np.zeros(len(lights), dtype=ir.LIGHT)
    for kind, fill in _LIGHTS.items():
        rows = [row for row, light in enumerate(lights) if type(light) is kind]
        if rows:
            some, at = table[rows], np.array(rows)
            fill(some, [lights[row] for row in rows], placed.take(at), texts)
            table[at] = some
    return table


def _suns(table: NDArray[np.void], suns: Sequence[Sun], placed: Affine, _: Texts) -> None:
    table["kind"] = ir.SUN
    directions = _applied(placed.linear, _exact([sun.direction for sun in suns]))
    table["vector"] = _rounded(unit(directions))
    table["color"] = [sun.irradiance for sun in suns]
    table["size"] = [sun.angle for sun in suns]


def _points(
    table: NDArray[np.void], points: Sequence[PointLight], placed: Affine, _: Texts
) -> None:
    table["kind"] = ir.POINT
    table["vector"] = _rounded(_moved(placed, [point.position for point in points]))
    table["color"] = [point.intensity for point in points]
    table["size"] = _product([point.radius for point in points], _growth(placed.linear))
    shaped = _shape(table, [point.shaping for point in points])
    axes = _applied(placed.linear, _exact([point.direction for point in points]))
    table["w"] = np.where(shaped[:, np.newaxis], _rounded(unit(axes)), 0.0)


def _areas(table: NDArray[np.void], areas: Sequence[AreaLight], placed: Affine, _: Texts) -> None:
    table["kind"] = [ir.LIGHTS.index(area.kind) for area in areas]
    table["vector"] = _rounded(_moved(placed, [area.position for area in areas]))
    table["color"] = [area.radiance for area in areas]
    _shape(table, [area.shaping for area in areas])
    for number, name in enumerate(("u", "v", "w")):
        axes = _exact([area.axes[number] for area in areas])
        table[name] = _rounded(_applied(placed.linear, axes))


def _skies(table: NDArray[np.void], skies: Sequence[Sky], placed: Affine, texts: Texts) -> None:
    table["kind"] = ir.SKY
    table["color"] = [sky.radiance for sky in skies]
    for lane, sky in enumerate(skies):
        if sky.texture:
            row = table[lane]
            row["file"] = 1 + texts.index(sky.texture)
            row["u"], row["v"], row["w"] = _turned(placed.take(lane).linear).T


_LIGHTS: dict[type, Callable[[NDArray[np.void], Sequence[Any], Affine, Texts], None]] = {
    Sun: _suns,
    PointLight: _points,
    AreaLight: _areas,
    Sky: _skies,
}
"""What fills the records of lights of one kind, placed by the lanes of a map."""


def camera_table(cameras: Sequence[Camera], placed: Affine, texts: Texts) -> NDArray[np.void]:
    """`SceneIR.cameras`, each placed by its lane of `placed`, the `world_from_object`.

    The axes are made unit, and what the scales along them do to the window goes into `height`,
    `aspect` (if said), `near`, `far` and the lens, each rounded once; a mirrored camera keeps its
    mirrored axes.
    """
    table = np.zeros(len(cameras), dtype=ir.CAMERA)
    if not cameras:
        return table
    axes = list(zip(*placed.linear, strict=True))
    along_x, along_y, along_z = map(length, axes)
    for column, axis in enumerate((*map(unit, axes), placed.translation)):
        table["world_from_camera"][:, :, column] = _rounded(axis)
    orthographic = np.array([camera.projection == "orthographic" for camera in cameras])
    table["projection"] = np.where(orthographic, ir.ORTHOGRAPHIC, ir.PERSPECTIVE)
    table["name"] = [texts.index(camera.name) for camera in cameras]
    heights = [camera.height for camera in cameras]
    table["height"] = np.where(
        orthographic, _product(heights, along_y), _product(heights, along_y / along_z)
    )
    aspects = [math.nan if camera.aspect is None else camera.aspect for camera in cameras]
    table["aspect"] = _product(aspects, along_x / along_y)
    table["shift"] = [camera.shift for camera in cameras]
    table["near"] = _product([camera.near for camera in cameras], along_z)
    table["far"] = _product([camera.far for camera in cameras], along_z)
    table["exposure"] = [camera.exposure for camera in cameras]
    table["shutter"] = [camera.shutter for camera in cameras]
    table["lens_radius"] = _product([camera.lens_radius for camera in cameras], along_y)
    table["focus_distance"] = _product([camera.focus_distance for camera in cameras], along_z)
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


def _exact(vectors: Sequence[Vector]) -> Vector3:
    """Vectors as three columns."""
    x, y, z = map(DoubleDouble, np.array(vectors, dtype=np.float64).T.copy())
    return x, y, z


def _applied(linear: Sequence[Sequence[DoubleDouble]], vector: Vector3) -> Vector3:
    x, y, z = (dot(row, vector) for row in linear)
    return x, y, z


def _moved(placed: Affine, points: Sequence[Vector]) -> Vector3:
    offset = _applied(placed.linear, _exact(points))
    x, y, z = (a + b for a, b in zip(offset, placed.translation, strict=True))
    return x, y, z


def _shape(table: NDArray[np.void], shapings: Sequence[Shaping]) -> NDArray[np.bool_]:
    """Put shapings into records; which are any."""
    for name in ("cone", "softness", "focus"):
        table[name] = [getattr(shaping, name) for shaping in shapings]
    return np.array([shaping != UNSHAPED for shaping in shapings])


def _growth(linear: Sequence[Sequence[DoubleDouble]]) -> DoubleDouble:
    """∛|det|: the root in float64, and one step of Newton's from there."""
    power = leveling([entry for row in linear for entry in row])
    x, y, z = ([entry.scaled(power) for entry in row] for row in linear)
    volume = dot(x, cross(y, z))
    volume = volume.scaled(np.copysign(np.float64(1.0), volume.hi))
    root = DoubleDouble(np.cbrt(volume.hi))
    square = root * root
    step = (square * root - volume) / (square + square + square)
    return (root - step).scaled(1.0 / power)


def _product(numbers: Sequence[float], factor: DoubleDouble) -> FloatArray:
    """The products rounded once; a number that is not finite stays what it is."""
    given = np.array(numbers, dtype=np.float64)
    with np.errstate(invalid="ignore"):
        product = (DoubleDouble(given) * factor).hi
    return np.where(np.isfinite(given), product, given)


def _rounded(vector: Iterable[DoubleDouble]) -> FloatArray:
    """The entries rounded once, `(3,)`, or `(n, 3)` of n lanes; zeros are positive."""
    return np.stack(np.broadcast_arrays(*(entry.hi for entry in vector)), axis=-1) + 0.0
