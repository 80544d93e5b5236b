"""Networks of UsdUVTexture, UsdTransform2d and primvar readers as textures of a material.

A network is followed from a surface's input: a texture, whose `st` comes from a primvar reader,
perhaps through transforms; or a primvar reader itself. Everything else is not understood.
"""

from __future__ import annotations

import math
from typing import Any, get_args

import numpy as np
from pxr import Sdf, UsdShade

from compiler.usd.clock import Clock
from compiler.usd.report import Report
from dsl.scene import FloatArray, Texture, Wrap

TRANSFORMS = 16
"""UsdTransform2d one behind another that are followed."""

_CHANNELS = ("r", "g", "b", "a", "rgb")
_SPACES = ("auto", "raw", "sRGB")


def asset_file(attribute: Any, asset: Any, clock: Clock) -> str:
    """Where the file of an attribute would be that is not there: beside the layer that names it.

    A path that begins with neither `/` nor `.` is a search path, which usd-core gives back as it
    is where it leads to no file, as that of tiles does.
    """
    stack = attribute.GetPropertyStack(clock.code(attribute))
    layer = stack[0].layer if stack else attribute.GetStage().GetRootLayer()
    searched = not (asset.path.startswith(("/", ".")) or ":" in asset.path)
    path = f"./{asset.path}" if searched else asset.path
    return str(Sdf.ComputeAssetPathRelativeToLayer(layer, path))


class Textures:
    """Reads the textures of a stage's materials."""

    def __init__(self, clock: Clock, report: Report) -> None:
        self._clock = clock
        self._report = report

    def read(self, output: Any, parameter: str) -> Texture | None:
        """The texture whose `output` gives a material's parameter, or None if it is not one."""
        shader = UsdShade.Shader(output.GetPrim())
        kind = shader.GetShaderId() or ""
        if kind.startswith("UsdPrimvarReader_"):
            return Texture(parameter, "", self._text(shader, "varname"))
        if kind != "UsdUVTexture":
            return None
        coordinates, file = self._coordinates(shader), self._file(shader)
        if coordinates is None or not file:
            return None
        attribute, matrix = coordinates
        a, b, c, d, e, f = matrix[:2].ravel().tolist()
        channels = UsdShade.Output(output).GetBaseName()
        return Texture(
            parameter,
            file,
            attribute,
            channels if channels in _CHANNELS else "rgb",
            (self._wrap(shader, "wrapS"), self._wrap(shader, "wrapT")),
            self._choice(shader, "sourceColorSpace", _SPACES),
            self._four(shader, "scale", (1.0, 1.0, 1.0, 1.0)),
            self._four(shader, "bias", (0.0, 0.0, 0.0, 0.0)),
            self._four(shader, "fallback", (0.0, 0.0, 0.0, 1.0)),
            (a, b, c, d, e, f),
        )

    def _file(self, shader: Any) -> str:
        """Where a texture's picture is, or would be: tiles are found by whoever reads them."""
        port = shader.GetInput("file")
        for source in port.GetValueProducingAttributes() if port else ():
            asset = self._clock.value(source)
            if not isinstance(asset, Sdf.AssetPath) or not asset.path:
                continue
            if asset.resolvedPath:
                return str(asset.resolvedPath)
            file = asset_file(source, asset, self._clock)
            if not UsdShade.UdimUtils.IsUdimIdentifier(asset.path):
                message = f"the texture `{file}` cannot be found: its fallback is drawn"
                self._report.add("usd-material", message, shader.GetPath())
            return file
        return ""

    def _coordinates(self, shader: Any) -> tuple[str, FloatArray] | None:
        """The attribute of the texture coordinates, and what they are multiplied by, `(3, 3)`.

        Coordinates that are the same everywhere have no attribute: they are a translation.
        """
        matrix = np.eye(3)
        name = "st"
        for _ in range(TRANSFORMS):
            port = shader.GetInput(name)
            sources = port.GetValueProducingAttributes() if port else ()
            if not sources or UsdShade.Input.IsInput(sources[0]):
                u, v = self._numbers(shader, name, (0.0, 0.0))
                return "", matrix @ np.array([(1.0, 0.0, u), (0.0, 1.0, v), (0.0, 0.0, 1.0)])
            shader, name = UsdShade.Shader(sources[0].GetPrim()), "in"
            kind = shader.GetShaderId() or ""
            if kind.startswith("UsdPrimvarReader_"):
                return self._text(shader, "varname"), matrix
            if kind != "UsdTransform2d":
                return None
            matrix = matrix @ self._transform(shader)
        return None

    def _transform(self, shader: Any) -> FloatArray:
        """Scale, then a counter-clockwise turn, then translation."""
        scale = self._numbers(shader, "scale", (1.0, 1.0))
        offset = self._numbers(shader, "translation", (0.0, 0.0))
        (degrees,) = self._numbers(shader, "rotation", (0.0,))
        angle = math.radians(degrees)
        cos, sin = math.cos(angle), math.sin(angle)
        return np.array(
            [
                (cos * scale[0], -sin * scale[1], offset[0]),
                (sin * scale[0], cos * scale[1], offset[1]),
                (0.0, 0.0, 1.0),
            ]
        )

    def _value(self, shader: Any, name: str) -> Any:
        port = shader.GetInput(name)
        for source in port.GetValueProducingAttributes() if port else ():
            if UsdShade.Input.IsInput(source):
                return self._clock.value(source)
            message = f"`inputs:{name}` of a texture comes from a network, and is not used"
            self._report.add("usd-material", message, shader.GetPath())
        return None

    def _text(self, shader: Any, name: str) -> str:
        value = self._value(shader, name)
        return value if isinstance(value, str) else ""

    def _wrap(self, shader: Any, name: str) -> Wrap:
        wrap: Wrap = self._choice(shader, name, get_args(Wrap), "useMetadata")
        return wrap

    def _choice(
        self, shader: Any, name: str, choices: tuple[str, ...], otherwise: str = "auto"
    ) -> Any:
        value = self._text(shader, name)
        return value if value in choices else otherwise

    def _numbers(self, shader: Any, name: str, otherwise: tuple[float, ...]) -> tuple[float, ...]:
        value = self._value(shader, name)
        try:
            numbers = tuple(np.array(value, dtype=np.float64).ravel().tolist())
        except (TypeError, ValueError):
            return otherwise
        sound = len(numbers) == len(otherwise) and all(map(math.isfinite, numbers))
        return numbers if sound else otherwise

    def _four(
        self, shader: Any, name: str, otherwise: tuple[float, float, float, float]
    ) -> tuple[float, float, float, float]:
        r, g, b, a = self._numbers(shader, name, otherwise)
        return (r, g, b, a)
