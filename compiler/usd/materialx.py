"""Surfaces of MaterialX that are written into a stage, as parameters of UsdPreviewSurface.

ND_UsdPreviewSurface has its very inputs. Of standard_surface (Autodesk's "Standard Surface", 1.0.1)
the base, metal, specular roughness, coat, emission, opacity and normal are understood, and may be
textured.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from dsl.scene import Color, Material, Texture

PREVIEW = "ND_UsdPreviewSurface_surfaceshader"
STANDARD = "ND_standard_surface_surfaceshader"

_DEFAULTS: dict[str, float | Color] = {
    "base": 1.0,
    "base_color": (0.8, 0.8, 0.8),
    "metalness": 0.0,
    "specular_roughness": 0.2,
    "specular_IOR": 1.5,
    "coat": 0.0,
    "coat_roughness": 0.1,
    "emission": 0.0,
    "emission_color": (1.0, 1.0, 1.0),
    "opacity": (1.0, 1.0, 1.0),
}
_TEXTURED = {
    "base_color": "diffuse",
    "metalness": "metallic",
    "specular_roughness": "roughness",
    "specular_IOR": "ior",
    "coat": "clearcoat",
    "coat_roughness": "clearcoat_roughness",
    "emission_color": "emission",
    "opacity": "opacity",
    "normal": "normal",
}
_WEIGHTS = {"base_color": "base", "emission_color": "emission"}
READ = frozenset(_DEFAULTS) | {"normal"}
"""The inputs of standard_surface that are understood."""


def standard_surface(
    value: Callable[[str, bool], Any], texture: Callable[[str, str], Texture | None]
) -> Material:
    """The material by the inputs of a standard_surface.

    `value(name, constant)` is what is said of an input, `constant` if no texture gives it;
    `texture(name, parameter)` the texture of one that gives a parameter of the material.
    """
    textures = {name: texture(name, parameter) for name, parameter in _TEXTURED.items()}

    def read(name: str) -> np.ndarray[Any, np.dtype[np.float64]]:
        default = np.asarray(_DEFAULTS[name], dtype=np.float64)
        try:
            found = np.asarray(value(name, textures.get(name) is None), dtype=np.float64)
        except (TypeError, ValueError):
            return default
        return found if found.shape == default.shape and np.isfinite(found).all() else default

    def color(weight: str, name: str) -> Color:
        r, g, b = (float(x) for x in read(weight) * read(name))
        return (r, g, b)

    def weighted(name: str, found: Texture) -> Texture:
        weight = float(read(_WEIGHTS[name])) if name in _WEIGHTS else 1.0
        channels = "r" if name == "opacity" and found.channels == "rgb" else found.channels
        scale, bias = ([weight * x for x in each] for each in (found.scale, found.bias))
        return replace(
            found,
            channels=channels,
            scale=(scale[0], scale[1], scale[2], scale[3]),
            bias=(bias[0], bias[1], bias[2], bias[3]),
        )

    return Material(
        diffuse=color("base", "base_color"),
        metallic=float(read("metalness")),
        roughness=float(read("specular_roughness")),
        ior=float(read("specular_IOR")),
        clearcoat=float(read("coat")),
        clearcoat_roughness=float(read("coat_roughness")),
        emission=color("emission", "emission_color"),
        opacity=float(read("opacity").mean()),
        textures=tuple(weighted(name, found) for name, found in textures.items() if found),
    )
