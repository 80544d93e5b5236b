"""Textures of a material as UsdUVTexture networks; attributes of meshes as primvars."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from pxr import Gf, Sdf, Vt

from compiler.usd_export.layer import attribute, child
from dsl.scene import MeshAttribute, Texture

_READERS = {1: "float", 2: "float2", 3: "float3", 4: "float4"}


def connect(material: Any, surface: Any, name: str, texture: Texture) -> None:
    """Connect an input of a surface to what gives its value."""
    port = surface.properties.get(f"inputs:{name}")
    if port is None:
        three = texture.parameter == "normal"
        kind = Sdf.ValueTypeNames.Normal3f if three else Sdf.ValueTypeNames.Float
        port = Sdf.AttributeSpec(surface, f"inputs:{name}", kind)
    if not texture.file:
        wide = "float3" if "3f" in str(port.typeName) else "float"
        source = _reader(material, name, texture.attribute, wide)
        port.connectionPathList.explicitItems = [source]
        return
    shader = _shader(material, f"{name}_texture", "UsdUVTexture")
    attribute(shader, "inputs:file", "asset", Sdf.AssetPath(texture.file))
    coordinates = _reader(material, name, texture.attribute, "float2")
    coordinates = _transformed(material, name, texture, coordinates)
    st = Sdf.AttributeSpec(shader, "inputs:st", Sdf.ValueTypeNames.Float2)
    st.connectionPathList.explicitItems = [coordinates]
    for axis, wrap in zip("ST", texture.wrap, strict=True):
        attribute(shader, f"inputs:wrap{axis}", "token", wrap)
    attribute(shader, "inputs:sourceColorSpace", "token", texture.color_space)
    for field in ("scale", "bias", "fallback"):
        attribute(shader, f"inputs:{field}", "float4", Gf.Vec4f(*getattr(texture, field)))
    kind = "float3" if texture.channels == "rgb" else "float"
    port.connectionPathList.explicitItems = [_output(shader, texture.channels, kind)]


def _transformed(material: Any, name: str, texture: Texture, source: Any) -> Any:
    """Coordinates after the texture's matrix: a turn, scales, and another turn (its SVD)."""
    a, b, c, d, e, f = texture.matrix
    if texture.matrix == (1.0, 0.0, 0.0, 0.0, 1.0, 0.0):
        return source
    left, scales, right = np.linalg.svd(np.array([[a, b], [d, e]]))
    # Both turns are proper: what mirrors goes into the scales.
    left_sign, right_sign = np.sign(np.linalg.det(left)), np.sign(np.linalg.det(right))
    left[:, 1] *= left_sign
    right[1] *= right_sign
    scales[1] *= left_sign * right_sign
    steps = [(right, (1.0, 1.0), (0.0, 0.0)), (left, tuple(scales.tolist()), (c, f))]
    for number, (turn, scale, offset) in enumerate(steps):
        shader = _shader(material, f"{name}_place_{number}", "UsdTransform2d")
        entry = Sdf.AttributeSpec(shader, "inputs:in", Sdf.ValueTypeNames.Float2)
        entry.connectionPathList.explicitItems = [source]
        degrees = math.degrees(math.atan2(turn[1, 0], turn[0, 0]))
        attribute(shader, "inputs:rotation", "float", degrees)
        attribute(shader, "inputs:scale", "float2", Gf.Vec2f(*scale))
        attribute(shader, "inputs:translation", "float2", Gf.Vec2f(*offset))
        source = _output(shader, "result", "float2")
    return source


def _reader(material: Any, name: str, primvar: str, kind: str) -> Any:
    shader = _shader(material, f"{name}_reader", f"UsdPrimvarReader_{kind}")
    attribute(shader, "inputs:varname", "string", primvar)
    return _output(shader, "result", kind)


def _shader(material: Any, name: str, kind: str) -> Any:
    shader = child(material, name, "Shader")
    attribute(shader, "info:id", "token", kind, uniform=True)
    return shader


def _output(shader: Any, name: str, kind: str) -> Any:
    return Sdf.AttributeSpec(shader, f"outputs:{name}", Sdf.ValueTypeNames.Find(kind)).path


def write_primvar(prim: Any, given: MeshAttribute) -> None:
    """One attribute of a triangle mesh; those of more than four numbers nothing reads."""
    width = given.values.shape[1]
    if width not in _READERS:
        return
    kind, array = {
        1: ("float[]", Vt.FloatArray),
        2: ("texCoord2f[]", Vt.Vec2fArray),
        3: ("float3[]", Vt.Vec3fArray),
        4: ("float4[]", Vt.Vec4fArray),
    }[width]
    kind = {"normals": "normal3f[]", "displayColor": "color3f[]"}.get(given.name, kind)
    values = np.ascontiguousarray(given.values[:, 0] if width == 1 else given.values)
    spec = attribute(prim, f"primvars:{given.name}", kind, array.FromNumpy(values))
    spec.SetInfo("interpolation", "vertex" if given.corners is None else "faceVarying")
    if given.corners is not None:
        rows = np.ascontiguousarray(given.corners, dtype=np.int32).ravel()
        name = f"primvars:{given.name}:indices"
        attribute(prim, name, "int[]", Vt.IntArray.FromNumpy(rows))
