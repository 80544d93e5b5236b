"""Documents of MaterialX as layers of USD: images as UsdUVTextures, other nodes by their names.

Networks are followed from a surface's input to an image, through normal maps and choices of a
channel. What else there is keeps its name, for whoever reads the material to report.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from pxr import Ar, Gf, Sdf, Tf, Usd, UsdShade

from compiler.usd.confinement import refusal
from compiler.usd.report import Report
from dsl.lexer import srgb_to_linear

CONNECTIONS = 16
"""Nodes one behind another that are followed."""

_TYPES = {
    "float": Sdf.ValueTypeNames.Float,
    "integer": Sdf.ValueTypeNames.Int,
    "boolean": Sdf.ValueTypeNames.Bool,
    "color3": Sdf.ValueTypeNames.Color3f,
    "vector2": Sdf.ValueTypeNames.Float2,
    "vector3": Sdf.ValueTypeNames.Float3,
    "string": Sdf.ValueTypeNames.String,
}
_WRAP = {"constant": "black", "clamp": "clamp", "periodic": "repeat", "mirror": "mirror"}
_CHANNELS = ("r", "g", "b", "a")
_ENCODED = "srgb_texture"


def material_layer(document: Any, where: Any, root: Path | None, report: Report) -> Any:
    """The layer of all materials of a document that was read from `where`, to be kept.

    Asset paths in it are absolute, and lie in the folder `root` if there is one.
    """
    return _Translation(where, root, report).layer(document)


class _Port(NamedTuple):
    """A node that gives a value, and which of its outputs does."""

    node: Any
    output: str


class _Translation:
    """One document as a layer."""

    def __init__(self, where: Any, root: Path | None, report: Report) -> None:
        self._where = where
        self._root = root
        self._report = report
        self._layer = Sdf.Layer.CreateAnonymous(f"{Path(str(where)).stem}.usda")
        self._stage = Usd.Stage.Open(self._layer)

    def layer(self, document: Any) -> Any:
        """The layer of all materials of the document."""
        top = self._stage.DefinePrim("/MaterialX")
        self._stage.SetDefaultPrim(top)
        self._stage.DefinePrim("/MaterialX/Materials")
        for node in document.getMaterialNodes():
            path = f"/MaterialX/Materials/{_name(node)}"
            material = UsdShade.Material.Define(self._stage, path)
            port = node.getInput("surfaceshader")
            surface = port.getConnectedNode() if port else None
            if surface is not None:
                output = self._surface(surface, f"{path}/{_name(surface)}")
                material.CreateSurfaceOutput("mtlx").ConnectToSource(output)
        return self._layer

    def _surface(self, node: Any, path: str) -> Any:
        shader = UsdShade.Shader.Define(self._stage, path)
        shader.CreateIdAttr(f"ND_{node.getCategory()}_surfaceshader")
        for port in node.getInputs():
            kind = _TYPES.get(port.getType())
            if kind is None:
                continue
            given = shader.CreateInput(port.getName(), kind)
            source = _source(port)
            if source is not None:
                given.ConnectToSource(self._network(source, f"{path}/{port.getName()}", port))
            else:
                _set(given, port)
        return shader.CreateOutput("surface", Sdf.ValueTypeNames.Token)

    def _network(self, source: _Port, path: str, port: Any) -> Any:
        """What a surface's input is connected to: a texture, or a node that nobody knows."""
        channel, normal = "", False
        node, output = source
        for _ in range(CONNECTIONS):
            category = node.getCategory()
            if (
                category in ("normalmap", "convert", "dot", "extract")
                or category[:-1] == "separate"
            ):
                normal = normal or category == "normalmap"
                if category == "extract":
                    channel = _CHANNELS[int(_plain(node, "index", "0") or 0) % 4]
                elif category[:-1] == "separate":
                    channel = output.removeprefix("out")[:1]
                below = _source(node.getInput("in"))
                if below is None:
                    break
                node, output = below
            elif category in ("image", "tiledimage", "UsdUVTexture"):
                shader = self._texture(node, path, normal)
                if not channel and category == "UsdUVTexture":
                    channel = output if output in _CHANNELS else ""
                whole = "r" if port.getType() == "float" else "rgb"
                name = channel if channel in _CHANNELS else whole
                kind = Sdf.ValueTypeNames.Float if len(name) == 1 else Sdf.ValueTypeNames.Float3
                return shader.CreateOutput(name, kind)
            else:
                break
        shader = UsdShade.Shader.Define(self._stage, path)
        shader.CreateIdAttr(f"ND_{node.getCategory()}_{node.getType()}")
        return shader.CreateOutput("out", _TYPES[port.getType()])

    def _texture(self, node: Any, path: str, normal: bool) -> Any:
        shader = UsdShade.Shader.Define(self._stage, path)
        shader.CreateIdAttr("UsdUVTexture")
        own = node.getCategory() == "UsdUVTexture"
        file = node.getInput("file")
        if file is not None and file.getValueString():
            asset = file.getActiveFilePrefix() + file.getValueString()
            asset = asset.replace("<UVTILE>", "<UDIM>")
            found = self._located(asset)
            if found:
                given = shader.CreateInput("file", Sdf.ValueTypeNames.Asset)
                given.Set(Sdf.AssetPath(found))
        if own:
            space = _plain(node, "sourceColorSpace", "auto")
            wrap = [_plain(node, name, "useMetadata") for name in ("wrapS", "wrapT")]
        else:
            colors = node.getType() in ("color3", "color4")
            encoded = file is not None and file.getActiveColorSpace() == _ENCODED
            space = "sRGB" if colors and encoded else "raw"
            wrap = [
                _WRAP.get(_plain(node, name, "periodic"), "repeat")
                for name in ("uaddressmode", "vaddressmode")
            ]
        for name, word in zip(("sourceColorSpace", "wrapS", "wrapT"), (space, *wrap), strict=True):
            shader.CreateInput(name, Sdf.ValueTypeNames.Token).Set(word)
        fallback = _numbers(node, "fallback" if own else "default")
        four = Sdf.ValueTypeNames.Float4
        if fallback:
            padded = fallback if len(fallback) > 1 else fallback * 3
            shader.CreateInput("fallback", four).Set(Gf.Vec4f(*(padded + [1.0] * 3)[:4]))
        for name, otherwise in (("scale", 1.0), ("bias", 0.0)):
            given = _numbers(node, name) if own else []
            values = (given + [otherwise] * 4)[:4]
            if normal:
                # A normal map's numbers are 2 x - 1 of its picture's.
                values = [2.0 * v - (name == "bias") for v in values[:3]] + values[3:]
            shader.CreateInput(name, four).Set(Gf.Vec4f(*values))
        self._coordinates(node, shader, path)
        return shader

    def _coordinates(self, node: Any, shader: Any, path: str) -> None:
        """The texture's coordinates, multiplied by what a tiled image is tiled by."""
        port = node.getInput("st") or node.getInput("texcoord")
        source = _source(port) if port else None
        name = "st"
        if source is not None:
            category = source.node.getCategory()
            if category.startswith("UsdPrimvarReader"):
                name = _plain(source.node, "varname", "st")
            elif category == "geompropvalue":
                name = _plain(source.node, "geomprop", "st")
            elif category != "texcoord":
                message = f"coordinates from `{category}` of MaterialX are not followed"
                self._report.add("usd-material", f"{message}: `st` is used")
        reader = UsdShade.Shader.Define(self._stage, f"{path}_coordinates")
        reader.CreateIdAttr("UsdPrimvarReader_float2")
        reader.CreateInput("varname", Sdf.ValueTypeNames.String).Set(name)
        result = reader.CreateOutput("result", Sdf.ValueTypeNames.Float2)
        tiling, offset = _numbers(node, "uvtiling"), _numbers(node, "uvoffset")
        if node.getCategory() == "tiledimage" and (tiling or offset):
            move = UsdShade.Shader.Define(self._stage, f"{path}_tiling")
            move.CreateIdAttr("UsdTransform2d")
            two = Sdf.ValueTypeNames.Float2
            move.CreateInput("in", two).ConnectToSource(result)
            move.CreateInput("scale", two).Set(Gf.Vec2f(*(tiling or [1.0, 1.0])))
            shift = [-x for x in offset] or [0.0, 0.0]
            move.CreateInput("translation", two).Set(Gf.Vec2f(*shift))
            result = move.CreateOutput("result", two)
        shader.CreateInput("st", Sdf.ValueTypeNames.Float2).ConnectToSource(result)

    def _located(self, asset: str) -> str:
        resolver = Ar.GetResolver()
        # Without the dot, what does not exist would stay relative to nothing.
        relative = asset if Path(asset).is_absolute() else f"./{asset}"
        identifier = resolver.CreateIdentifier(relative, self._where)
        found = str(resolver.Resolve(identifier)) or str(identifier)
        why = refusal(asset, found, self._root.resolve()) if self._root is not None else None
        if why is None:
            return found
        name = Path(str(self._where)).name
        self._report.add("usd-outside", f"layer `{name}` refers to `{asset}`, {why}")
        return ""


def _name(node: Any) -> str:
    return str(Tf.MakeValidIdentifier(node.getName()))


def _source(port: Any) -> _Port | None:
    """The node that an input is connected to, also through the output of a graph."""
    if port is None:
        return None
    node = port.getConnectedNode()
    if node is None:
        return None
    output = port.getConnectedOutput()
    inner = output.getOutputString() if output is not None and output.getConnectedNode() else ""
    return _Port(node, inner or port.getOutputString())


def _numbers(node: Any, name: str) -> list[float]:
    """The numbers of a constant input; none where it has none that are."""
    try:
        numbers = [float(word) for word in _plain(node, name, "").split(",")]
    except ValueError:
        return []
    return numbers if np.isfinite(numbers).all() else []


def _plain(node: Any, name: str, otherwise: str) -> str:
    port = node.getInput(name)
    value = port.getValueString() if port is not None else ""
    return value or otherwise


def _set(given: Any, port: Any) -> None:
    """Give an input a constant, if it is one."""
    kind, words = port.getType(), port.getValueString()
    if kind == "string":
        given.Set(words)
        return
    if kind == "boolean":
        given.Set(words == "true")
        return
    try:
        numbers = np.array([float(word) for word in words.split(",")])
        if kind == "color3" and port.getActiveColorSpace() == _ENCODED:
            numbers = np.array([srgb_to_linear(min(max(x, 0.0), 1.0)) for x in numbers])
        one = int(numbers[0]) if kind == "integer" else float(numbers[0])
        given.Set(one if len(numbers) == 1 else tuple(numbers.tolist()))
    except (ValueError, OverflowError, Tf.ErrorException):
        return  # as if it were not there: the surface's default holds
