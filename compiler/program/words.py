"""Shapes, steps, materials and views in the words of the language."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from compiler import ir
from compiler.transforms import elementary
from dsl.scene import (
    DEFAULT_MATERIAL,
    MATERIAL_PARAMETERS,
    Color,
    Material,
    Shape,
    ShapeKind,
    Step,
    StepKind,
)
from dsl.values import format_number


def number(value: float) -> str:
    """A number, exactly; as an argument or an item."""
    return format_number(float(value) + 0.0)


def vector(values: Iterable[float]) -> str:
    """A vector."""
    return f"({', '.join(map(number, values))})"


def short(value: float) -> str:
    """A number to the digits that a float has, which is all that USD knows of it."""
    rounded = float(f"{value:.8g}")
    return number(float(str(np.float32(value))) if np.float32(value) == value else rounded)


def color(values: Color | Sequence[float]) -> str:
    """A linear color, to the digits of floats."""
    return f"rgb({', '.join(map(short, values))})"


def call(function: str, /, *arguments: str, **named: str) -> str:
    """A call; arguments named `from_` are `from`."""
    words = [*arguments, *(f"{key.rstrip('_')}: {text}" for key, text in named.items())]
    return f"{function}({', '.join(words)})"


def _interval(low: float, high: float, unit: str = "") -> str:
    return f"{number(low)}{unit}..{number(high)}{unit}"


def shape(node: Shape) -> str:
    """The call that makes a shape."""
    p = node.parameters
    match node.kind:
        case ShapeKind.BOX:
            named = {"min": vector(p[:3]), "max": vector(p[3:6])}
        case ShapeKind.CYLINDER:
            named = {"radius": number(p[0]), "y": _interval(p[1], p[2])}
        case ShapeKind.CONE:
            named = {"radius": number(p[0]), "height": number(p[1])}
        case ShapeKind.TORUS:
            named = {"major": number(p[0]), "minor": number(p[1])}
        case ShapeKind.SPHERE | ShapeKind.DISC:
            named = {"radius": number(p[0])}
        case ShapeKind.RECTANGLE:
            named = {"size": vector(p)}
        case ShapeKind.PLANE:
            named = {}
        case ShapeKind.TRIANGLE:
            named = {"a": vector(p[:3]), "b": vector(p[3:6]), "c": vector(p[6:])}
        case ShapeKind.RING | ShapeKind.WEDGE:
            named = {"r": _interval(p[0], p[1]), "y": _interval(p[2], p[3])}
    if node.kind is ShapeKind.WEDGE:
        named["phi"] = _interval(p[4], p[5], "deg")
    if _BEVELLED.get(node.kind) and p[-1] != 0.0:
        named["bevel"] = number(p[-1])
    return call(node.kind.value, **named)


_BEVELLED = dict.fromkeys(
    (ShapeKind.BOX, ShapeKind.CYLINDER, ShapeKind.CONE, ShapeKind.RING, ShapeKind.WEDGE), True
)


def step(one: Step, lane: int = 0) -> str:
    """A suffix call that places an object by one step, of a batch by that of one lane."""
    values = one.values if one.values.ndim == 1 else one.values[lane]
    words = _map(one.kind, [float(v) for v in values])
    return f".transform({words}.inverse())" if one.inverse else f".{words}"


def _map(kind: StepKind, v: list[float]) -> str:
    match kind:
        case StepKind.TRANSLATE:
            return call("translate", *map(number, v))
        case StepKind.SCALE if v[0] == v[1] == v[2]:
            return call("scale", number(v[0]))
        case StepKind.SCALE:
            return call("scale", *map(number, v))
        case StepKind.ROTATE if sorted(v[:3]) == [0.0, 0.0, 1.0]:
            return call(f"rotate_{'xyz'[v.index(1.0)]}", f"{number(v[3])}deg")
        case StepKind.ROTATE:
            return call("rotate", axis=vector(v[:3]), angle=f"{number(v[3])}deg")
        case StepKind.ORIENT:
            rows = np.empty((3, 4))
            elementary(kind, np.array(v)).forward.round_into(rows[None])
            return _matrix(rows.ravel().tolist())
        case StepKind.SHEAR:
            names = ("xy", "xz", "yx", "yz", "zx", "zy")
            named = {n: number(x) for n, x in zip(names, v, strict=True) if x != 0.0}
            return call("shear", **named)
        case StepKind.REFLECT:
            return call("reflect", axis=vector(v))
        case StepKind.MATRIX:
            return _matrix(v)
        case StepKind.LOOK_AT:
            return call("look_at", from_=vector(v[:3]), at=vector(v[3:6]), up=vector(v[6:]))


def matrix(rows: Any) -> str:
    """A suffix call that places an object by a 3x4 matrix."""
    return "." + _matrix(np.asarray(rows).ravel().tolist())


def _matrix(v: list[float]) -> str:
    text = call("matrix", *map(number, v))
    if len(text) <= _LINE:
        return text
    rows = [", ".join(map(number, v[k : k + 4])) for k in (0, 4, 8)]
    return "matrix(\n" + ",\n".join(rows) + ",\n)"


_LINE = 70
"""Characters up to which a matrix is written on one line; else each row has its own."""


def material(node: Material) -> str:
    """The call that makes a material: what differs from the default."""
    named = {}
    for name in MATERIAL_PARAMETERS:
        value = getattr(node, name)
        if value == getattr(DEFAULT_MATERIAL, name):
            continue
        if isinstance(value, bool):
            named[name] = "true" if value else "false"
        elif isinstance(value, tuple):
            named[name] = color(value)
        else:
            named[name] = short(value)
    return call("material", **named)


def light(record: Any, texture: str) -> str:
    """The call that makes a light of the flat scene; `texture` is a sky's, or ""."""
    shine = color([float(c) for c in record["color"]])
    place = vector([float(x) for x in record["vector"]])
    size = float(record["size"])
    match int(record["kind"]):
        case ir.SUN:
            named = {"direction": place, "color": shine}
            if size:
                named["angle"] = f"{short(size)}deg"
            return call("sun", **named)
        case ir.POINT:
            named = {"position": place, "color": shine}
            if size:
                named["radius"] = short(size)
            shaping = _shaping(record)
            if shaping:
                named["direction"] = vector([float(x) for x in record["w"]])
            return call("point_light", **named, **shaping)
        case ir.SKY:
            if not texture:
                return call("sky", color=shine)
            made = call("sky", color=shine, texture=f'"{texture}"')
            axes = np.column_stack([record["u"], record["v"], record["w"], np.zeros(3)])
            return made if (axes == np.eye(3, 4)).all() else made + matrix(axes)
        case kind:
            u, v, w = (np.asarray(record[name]) for name in "uvw")
            if kind == ir.CYLINDER:
                # Along y, with z where its shaping points.
                name, named = "cylinder_light", {"radius": "1", "height": "2"}
                columns = v, u, w
            else:
                # In x and z, towards -y.
                rectangle = kind == ir.RECTANGLE
                name = "rectangle_light" if rectangle else "disc_light"
                named = {"size": "(2, 2)"} if rectangle else {"radius": "1"}
                columns = u, -w, v
            made = call(name, color=shine, **named, **_shaping(record))
            return made + matrix(np.column_stack([*columns, record["vector"]]))


def _shaping(record: Any) -> dict[str, str]:
    """The arguments of a light that say in which directions it shines."""
    named = {}
    if float(record["cone"]) != 180.0:
        named["cone"] = f"{short(float(record['cone']))}deg"
    for name in ("softness", "focus"):
        if float(record[name]):
            named[name] = short(float(record[name]))
    return named


def camera(record: Any, name: str) -> str:
    """The call that makes a camera of the flat scene; one that is mirrored cannot be said."""
    world = np.asarray(record["world_from_camera"])
    at = world[:, 3] - world[:, 2] * max(1.0, float(np.abs(world[:, 3]).max()))
    height = float(record["height"])
    named = {"from_": vector(world[:, 3]), "at": vector(at), "up": vector(world[:, 1])}
    if int(record["projection"]) == ir.ORTHOGRAPHIC:
        named["height"] = short(height)
    else:
        named["fov"] = f"{short(2.0 * math.degrees(math.atan(0.5 * height)))}deg"
    if name:
        named["name"] = f'"{name}"'
    if float(record["near"]) != 0.0:
        named["near"] = short(float(record["near"]))
    if math.isfinite(float(record["far"])):
        named["far"] = short(float(record["far"]))
    return call("camera", **named)


def settings(record: Any) -> dict[str, str]:
    """The arguments of `settings` that the flat scene's settings give."""
    named = {}
    for name in ("width", "height", "samples"):
        if int(record[name]):
            named[name] = number(int(record[name]))
    for name, choices in (("integrator", ir.INTEGRATORS), ("precision", ir.PRECISIONS)):
        if int(record[name]) >= 0:
            named[name] = f'"{choices[int(record[name])]}"'
    for name in ("occlusion_distance", "exposure"):
        if not math.isnan(float(record[name])):
            named[name] = number(float(record[name]))
    return named
