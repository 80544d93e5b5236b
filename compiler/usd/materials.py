"""Materials: UsdPreviewSurface, its constants and its textures."""

from __future__ import annotations

import math
from typing import Any

from pxr import Gf, Sdf, UsdShade

from compiler.usd import materialx
from compiler.usd.clock import Clock
from compiler.usd.report import Report
from compiler.usd.textures import Textures
from dsl.scene import DEFAULT_MATERIAL, Color, Material, Texture

_INPUTS = {
    "emissiveColor": "emission",
    "diffuseColor": "diffuse",
    "specularColor": "specular",
    "metallic": "metallic",
    "roughness": "roughness",
    "clearcoat": "clearcoat",
    "clearcoatRoughness": "clearcoat_roughness",
    "opacity": "opacity",
    "opacityThreshold": "opacity_threshold",
    "ior": "ior",
}
_MAPS = {"normal": "normal", "displacement": "displacement", "occlusion": "occlusion"}
_NOTHING = {"UsdPrimvarReader_float": 0.0, "UsdPrimvarReader_float3": (0.0, 0.0, 0.0)}
"""The fallbacks of primvar readers that say none."""
_COLORS = {"emission", "diffuse", "specular"}
_IGNORED: dict[str, Any] = {
    "displacement": 0.0,
    "normal": Gf.Vec3f(0.0, 0.0, 1.0),  # but for textures of normals
    "occlusion": 1.0,
    "opacityMode": "transparent",
}
"""Inputs that are not used, with the values that say nothing."""


def color(value: Any) -> Color | None:
    """Three finite numbers, or None."""
    try:
        r, g, b = (float(x) for x in value)
    except (TypeError, ValueError):
        return None
    return (r, g, b) if all(map(math.isfinite, (r, g, b))) else None


class Materials:
    """Reads the materials of a stage, each once."""

    def __init__(self, clock: Clock, report: Report) -> None:
        self._clock = clock
        self._report = report
        self._read: dict[Sdf.Path, Material] = {}
        self._textures = Textures(clock, report)

    def read(self, material: Any) -> Material:
        """The parameters of a UsdShade.Material; the default where its surface is unknown."""
        path = material.GetPath()
        if path not in self._read:
            self._read[path] = self._surface(material)
        return self._read[path]

    def _surface(self, material: Any) -> Material:
        shader = material.ComputeSurfaceSource()[0] or material.ComputeSurfaceSource("mtlx")[0]
        if not shader:
            self._report.add(
                "usd-material",
                "a material without a surface that can be read is drawn in the default one",
                material.GetPath(),
            )
            return DEFAULT_MATERIAL
        identifier = shader.GetShaderId() or "without an identifier"
        if identifier == materialx.STANDARD:
            return self._standard_surface(shader)
        if identifier not in ("UsdPreviewSurface", materialx.PREVIEW):
            self._report.add(
                "usd-material",
                f"surface shader `{identifier}` is drawn as the default material",
                shader.GetPath(),
            )
            return DEFAULT_MATERIAL
        names = _INPUTS | _MAPS
        found = {name: self._texture(shader, name, parameter) for name, parameter in names.items()}
        parameters: dict[str, Any] = {}
        for name, parameter in _INPUTS.items():
            value = self._value(shader, name, said=found[name] is None)
            read = color(value) if parameter in _COLORS else _number(value)
            if read is not None:
                parameters[parameter] = read
            elif value is not None:
                message = f"`inputs:{name}` has no finite value of its type"
                self._report.add("usd-material", message, shader.GetPath())
        for name, nothing in _IGNORED.items():
            used = name == "normal" and found[name] is not None
            if not used and self._says_something(shader, name, nothing):
                message = f"`inputs:{name}` of surfaces is not used"
                self._report.add("usd-material", message, shader.GetPath())
        workflow = self._value(shader, "useSpecularWorkflow")
        textures = tuple(texture for texture in found.values() if texture is not None)
        return Material(specular_workflow=bool(workflow), textures=textures, **parameters)

    def _standard_surface(self, shader: Any) -> Material:
        unread = [
            port.GetBaseName()
            for port in shader.GetInputs()
            if port.GetBaseName() not in materialx.READ
        ]
        if unread:
            message = f"of a standard_surface, {', '.join(f'`{n}`' for n in unread)} are not used"
            self._report.add("usd-material", message, shader.GetPath())
        return materialx.standard_surface(
            lambda name, constant: self._value(shader, name, said=constant),
            lambda name, parameter: self._texture(shader, name, parameter),
        )

    def _texture(self, shader: Any, name: str, parameter: str) -> Texture | None:
        port = shader.GetInput(name)
        for source in port.GetValueProducingAttributes() if port else ():
            if not UsdShade.Input.IsInput(source):
                return self._textures.read(source, parameter)
        return None

    def _says_something(self, shader: Any, name: str, nothing: Any) -> bool:
        """Whether an input comes from a network, or has another constant than `nothing`."""
        port = shader.GetInput(name)
        sources = port.GetValueProducingAttributes() if port else ()
        if not all(map(UsdShade.Input.IsInput, sources)):
            return True
        value = self._value(shader, name)
        return value is not None and value != nothing

    def _value(self, shader: Any, name: str, said: bool = True) -> Any:
        """An input's constant, also through a material's interface; None where it has none.

        A constant in place of a network is reported if it is to be `said`.
        """
        port = shader.GetInput(name)
        if not port:
            return None
        for source in port.GetValueProducingAttributes():
            if UsdShade.Input.IsInput(source):
                return self._clock.value(source)
            if said:
                message = f"`inputs:{name}` comes from a network, and is replaced by a constant"
                self._report.add("usd-material", message, shader.GetPath())
            return self._fallback(source)
        return None

    def _fallback(self, output: Any) -> Any:
        """What a texture or primvar reader says to use in its stead."""
        shader = UsdShade.Shader(output.GetPrim())
        port = shader.GetInput("fallback")
        value = self._clock.value(port.GetAttr()) if port else None
        if value is None:
            return _NOTHING.get(shader.GetShaderId() or "")
        channels = {"r": 0, "g": 1, "b": 2, "a": 3}
        name = UsdShade.Output(output).GetBaseName()
        try:
            return value[channels[name]] if name in channels else list(value)[:3]
        except (TypeError, IndexError):
            return value


def _number(value: Any) -> float | None:
    try:
        number = float(value)
    except (TypeError, ValueError):
        return None
    return number if math.isfinite(number) else None
