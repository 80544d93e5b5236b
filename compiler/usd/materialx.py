"""Surfaces of MaterialX that are written into a stage, as parameters of UsdPreviewSurface.

ND_UsdPreviewSurface has its very inputs. Of standard_surface (Autodesk's "Standard Surface", 1.0.1)
the base, metal, specular roughness, coat, emission and opacity are understood, and nothing is
textured. Files of MaterialX are usd-core's to read, and the one of PyPI cannot.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from dsl.scene import Color

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
READ = frozenset(_DEFAULTS)
"""The inputs of standard_surface that are understood."""


def standard_surface(value: Callable[[str], Any]) -> dict[str, Any]:
    """Parameters of a `dsl.scene.Material` from what `value` says of the inputs by name."""

    def read(name: str) -> np.ndarray[Any, np.dtype[np.float64]]:
        default = np.asarray(_DEFAULTS[name], dtype=np.float64)
        try:
            found = np.asarray(value(name), dtype=np.float64)
        except (TypeError, ValueError):
            return default
        return found if found.shape == default.shape and np.isfinite(found).all() else default

    def color(weight: str, name: str) -> Color:
        r, g, b = (float(x) for x in read(weight) * read(name))
        return (r, g, b)

    return {
        "diffuse": color("base", "base_color"),
        "metallic": float(read("metalness")),
        "roughness": float(read("specular_roughness")),
        "ior": float(read("specular_IOR")),
        "clearcoat": float(read("coat")),
        "clearcoat_roughness": float(read("coat_roughness")),
        "emission": color("emission", "emission_color"),
        "opacity": float(read("opacity").mean()),
    }
