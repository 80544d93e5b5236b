"""Materials and colours.

The parameters are those of UsdPreviewSurface; the shorthands set several of them at once.
"""

from __future__ import annotations

import math
from typing import Any

from dsl.calls import Site
from dsl.kinds import BOOLEAN, COLOR, MATERIAL, NUMBER
from dsl.scene import DEFAULT_MATERIAL, MATERIAL_FRACTIONS, MATERIAL_PARAMETERS, Material
from dsl.values import Builtin, Color, Kind, Parameter, Signature, format_number

_COLORS = ("diffuse", "emission", "specular")
_BLACK = (0.0, 0.0, 0.0)
_Rgb = tuple[float, float, float]


def check_range(
    site: Site,
    name: str,
    value: float,
    low: float = 0.0,
    high: float | None = 1.0,
    unit: str = "",
) -> None:
    """A fault unless low <= value <= high."""
    if value < low or (high is not None and value > high):
        where, bound = ("below", low) if high is None or value < low else ("above", high)
        message = f"{name} = {format_number(value)}{unit} is {where} {format_number(bound)}{unit}"
        raise site.fault("value-out-of-range", message, name)


def check_color(site: Site, name: str, color: _Rgb) -> None:
    """A fault if a component is negative."""
    for component, value in zip("rgb", color, strict=True):
        if value < 0.0:
            raise site.fault(
                "value-out-of-range",
                f"`{name}` has a negative component, {component} = {format_number(value)}",
                name,
            )


def _checked(site: Site, **values: Any) -> Material:
    for name, value in values.items():
        argument = name if name in site.expressions else "color"
        if name in _COLORS:
            check_color(site, argument, value)
        elif name in MATERIAL_FRACTIONS:
            check_range(site, name, value)
        elif name == "ior":
            check_range(site, name, value, 1.0, None)
    return Material(**values)


def _rgb(site: Site, r: float, g: float, b: float) -> Color:
    return Color((r, g, b))


def _material(site: Site, *values: Any) -> Material:
    return _checked(site, **dict(zip(_NAMES, values, strict=True)))


def _matte(site: Site, color: _Rgb) -> Material:
    return _checked(site, diffuse=color, specular_workflow=True, specular=_BLACK, roughness=1.0)


def _plastic(site: Site, color: _Rgb, roughness: float) -> Material:
    return _checked(site, diffuse=color, roughness=roughness)


def _metal(site: Site, color: _Rgb, roughness: float) -> Material:
    return _checked(site, diffuse=color, metallic=1.0, roughness=roughness)


def _glass(site: Site, color: _Rgb, ior: float, roughness: float, opacity: float) -> Material:
    return _checked(site, diffuse=color, ior=ior, roughness=roughness, opacity=opacity)


def _glow(site: Site, color: _Rgb, strength: float) -> Material:
    check_range(site, "strength", strength, 0.0, None)
    red, green, blue = (strength * component for component in color)
    if math.isinf(max(red, green, blue)):
        raise site.fault("value-not-finite", "the glow is too bright for a number")
    return _checked(
        site,
        emission=(red, green, blue),
        diffuse=_BLACK,
        specular_workflow=True,
        specular=_BLACK,
        roughness=1.0,
    )


def _kind(name: str) -> Kind:
    if name in _COLORS:
        return COLOR
    return BOOLEAN if name == "specular_workflow" else NUMBER


_NAMES = MATERIAL_PARAMETERS
_PARAMETERS = tuple(
    Parameter(name, _kind(name), getattr(DEFAULT_MATERIAL, name)) for name in _NAMES
)
_WHITE = Parameter("color", COLOR, (1.0, 1.0, 1.0))


def _number(name: str, default: float, doc: str) -> Parameter:
    return Parameter(name, NUMBER, default, doc=doc)


def _roughness(default: float) -> Parameter:
    return _number("roughness", default, "0 is a mirror, 1 is matte")


def _shorthand(name: str, doc: str, parameters: tuple[Parameter, ...], function: Any) -> Builtin:
    return Builtin(name, (Signature(parameters, function),), "a material", doc)


_COLOR = Parameter("color", COLOR, required=True)

MATERIALS = (
    Builtin(
        "rgb",
        (Signature(tuple(Parameter(n, NUMBER, required=True) for n in "rgb"), _rgb),),
        "a color",
        "A color by its linear Rec. 709 components; `#d2b48c` is sRGB-encoded.",
    ),
    _shorthand(
        "material", "A material by the parameters of UsdPreviewSurface.", _PARAMETERS, _material
    ),
    _shorthand("matte", "A material without any gloss.", (_COLOR,), _matte),
    _shorthand(
        "plastic", "A coloured material with a white gloss.", (_COLOR, _roughness(0.4)), _plastic
    ),
    _shorthand("metal", "A metal of that color.", (_COLOR, _roughness(0.3)), _metal),
    _shorthand(
        "glass",
        "A material that lets light through.",
        (
            _WHITE,
            _number("ior", 1.5, "index of refraction, at least 1"),
            _roughness(0.0),
            _number("opacity", 0.1, "1 lets nothing through"),
        ),
        _glass,
    ),
    _shorthand(
        "glow",
        "A material that shines.",
        (_COLOR, _number("strength", 1.0, "what the color is multiplied by")),
        _glow,
    ),
)


def _binding(name: str, doc: str) -> Builtin:
    parameter = Parameter("m", MATERIAL, required=True)
    signature = Signature((parameter,), lambda site, m: m, lanes=True)
    return Builtin(name, (signature,), "an object", doc)


BIND = _binding("material", "Binds a material to all below that has none of its own.")
OVERRIDE = _binding("override", "Binds a material to all below, whatever it has.")
"""The suffix calls that bind a material: what is below and has its own keeps it, or not."""
