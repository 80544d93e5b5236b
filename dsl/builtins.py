"""The names that every program starts with."""

from __future__ import annotations

import math

from dsl.lights import LIGHTS
from dsl.materials import MATERIALS
from dsl.maths import MATHS
from dsl.shapes import SHAPES
from dsl.transforms import TRANSFORMS
from dsl.values import Binding

BUILTINS: dict[str, Binding] = {
    **{
        builtin.name: Binding(builtin.name, value=builtin)
        for builtin in (*SHAPES, *TRANSFORMS, *MATERIALS, *LIGHTS, *MATHS)
    },
    "pi": Binding("pi", value=math.pi),
}
"""Bindings by name; a program's own definitions may hide them."""
