"""The kinds of value that builtins take, and how each becomes a Python value."""

from __future__ import annotations

from typing import Any

import numpy as np

from dsl import scene
from dsl.values import Angle, Choice, Color, Interval, Kind, List, Value, Vector


def _of_type(name: str, *kind: type) -> Kind:
    return Kind(name, lambda value: value if isinstance(value, kind) else None)


def _vector(length: int) -> Kind:
    def convert(value: Value) -> tuple[float, ...] | None:
        if isinstance(value, Vector) and len(value.components) == length:
            return value.components
        return None

    return Kind(f"a vector of {length}", convert)


def _interval(value: Value) -> tuple[float, float] | None:
    if isinstance(value, Interval) and not isinstance(value.start, Angle):
        return (value.start, value.end) if not isinstance(value.end, Angle) else None
    return None


def _angle_interval(value: Value) -> tuple[float, float] | None:
    if isinstance(value, Interval) and isinstance(value.start, Angle):
        return (value.start.degrees, value.end.degrees) if isinstance(value.end, Angle) else None
    return None


def _any(value: Value) -> Any:
    return value


def _numbers(value: Value) -> tuple[float, ...] | None:
    return value.components if isinstance(value, Vector) else None


NUMBER = _of_type("a number", float, np.ndarray)
BOOLEAN = _of_type("a truth value", bool)
STRING = _of_type("a string", str)
LIST = _of_type("a list", List)
TRANSFORM = _of_type("a transform", scene.Transform)
MATERIAL = _of_type("a material", scene.Material, Choice)
ANGLE = Kind("an angle", lambda value: value.degrees if isinstance(value, Angle) else None)
COLOR = Kind("a color", lambda value: value.components if isinstance(value, Color) else None)
VECTOR = Kind("a vector", _numbers)
VECTOR2, VECTOR3 = _vector(2), _vector(3)
INTERVAL = Kind("an interval of numbers", _interval)
ANGLES = Kind("an interval of angles", _angle_interval)
ANY = Kind("a value", _any)
QUANTITY = Kind(
    "a number or an angle",
    lambda value: value if isinstance(value, float | Angle | np.ndarray) else None,
)
MIXABLE = Kind(
    "a number, an angle, a vector or a color",
    lambda value: value if isinstance(value, float | Angle | Vector | Color | np.ndarray) else None,
)
