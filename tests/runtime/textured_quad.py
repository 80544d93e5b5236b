"""A square whose picture is its texture: it only glows, and the camera frames it exactly."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import ovolo
from runtime.film import Film

QUAD = """
    point3f[] points = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]
    int[] faceVertexCounts = [4]
    int[] faceVertexIndices = [0, 1, 2, 3]
    uniform token subdivisionScheme = "none"
"""
ST = 'texCoord2f[] primvars:st = [(0, 0), (1, 0), (1, 1), (0, 1)] (interpolation = "vertex")'
BOUND = "rel material:binding = </m>"


def write_image(path: Path, values: NDArray[Any]) -> None:
    """Write `(h, w, c)` as they are, in their own type."""
    import OpenImageIO as oiio  # noqa: N813

    kind = {"uint8": "uint8", "uint16": "uint16", "float32": "float"}[values.dtype.name]
    spec = oiio.ImageSpec(values.shape[1], values.shape[0], values.shape[2], kind)
    spec.attribute("oiio:UnassociatedAlpha", 1)
    output = oiio.ImageOutput.create(str(path))
    assert output is not None
    assert output.open(str(path), spec)
    assert output.write_image(np.ascontiguousarray(values))
    assert output.close()


def material(inputs: str, texture: str = "", more: str = "") -> str:
    """A material that reflects nothing but what `inputs` say, of a texture at `st`."""
    return f"""
def Material "m" {{
    token outputs:surface.connect = </m/s.outputs:surface>
    def Shader "s" {{
        uniform token info:id = "UsdPreviewSurface"
        float inputs:ior = 1
        {inputs}
        token outputs:surface
    }}
    def Shader "t" {{
        uniform token info:id = "UsdUVTexture"
        float2 inputs:st.connect = </m/r.outputs:result>
        {texture}
        float3 outputs:rgb
        float outputs:r
        float outputs:g
        float outputs:b
        float outputs:a
    }}
    def Shader "r" {{
        uniform token info:id = "UsdPrimvarReader_float2"
        string inputs:varname = "st"
        float2 outputs:result
    }}
    {more}
}}
"""


def glow(texture: str, output: str = "rgb", more: str = "") -> str:
    """A material that glows in the colours of a texture, and reflects nothing."""
    inputs = f"""color3f inputs:diffuseColor = (0, 0, 0)
        color3f inputs:emissiveColor.connect = </m/t.outputs:{output}>"""
    return material(inputs, texture, more)


def mesh(body: str = ST, geometry: str = QUAD, binding: str = BOUND) -> str:
    """A mesh prim."""
    return f"""
def Mesh "q" (prepend apiSchemas = ["MaterialBindingAPI"]) {{
    {geometry}
    {binding}
    {body}
}}
"""


def camera(side: float = 1.0, at: float = 0.5) -> str:
    """An orthographic camera along -z, its window a square."""
    return f"""
def Camera "c" {{
    token projection = "orthographic"
    float horizontalAperture = {10 * side}
    float verticalAperture = {10 * side}
    double3 xformOp:translate = ({at}, {at}, 5)
    uniform token[] xformOpOrder = ["xformOp:translate"]
}}
"""


def compiled(folder: Path, *prims: str, **choices: Any) -> ovolo.Scene:
    """The scene of a stage of these prims."""
    path = folder / "stage.usda"
    path.write_text("#usda 1.0\n" + "".join(prims))
    return ovolo.compile_file(path, **choices)


def shown(folder: Path, *prims: str, size: int = 4, **choices: Any) -> Film:
    """The picture of a stage of these prims, one sample in the middle of each pixel."""
    scene = compiled(folder, camera(), *prims, **choices)
    return scene.render(width=size, height=size, samples=1)
