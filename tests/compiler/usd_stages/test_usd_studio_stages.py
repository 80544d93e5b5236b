"""Stages of the kinds that studios make, judged by rays against usd-core's own matrices."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.compiler.usd_stages.ray_agreement import stage_agrees

HEAD = "#usda 1.0\n"
QUAD = """
    uniform token subdivisionScheme = "none"
    point3f[] points = [(0, 0, 0), (2, 0, 0), (2, 1, 0), (0, 1, 0), (0, 0, 1.5)]
    int[] faceVertexCounts = [4, 3, 3]
    int[] faceVertexIndices = [0, 1, 2, 3, 0, 4, 1, 0, 3, 4]
"""
STAGES = {
    "left-handed and single-sided under mirrors": f"""
def Xform "mirror" {{
    double3 xformOp:scale = (-1, 2, 1)
    double xformOp:rotateZ = 20
    uniform token[] xformOpOrder = ["xformOp:rotateZ", "xformOp:scale"]
    def Mesh "left" {{
{QUAD}
        uniform token orientation = "leftHanded"
        uniform bool doubleSided = 0
    }}
    def Mesh "right" {{
{QUAD}
        float3 xformOp:translate = (4, 0, 0)
        float3 xformOp:scale = (1, -1, -1)
        uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:scale"]
        uniform bool doubleSided = 0
        uniform token orientation = "rightHanded"
    }}
    def Cylinder "quadric" {{
        uniform token orientation = "leftHanded"
        double3 xformOp:translate = (0, 4, 0)
        uniform token[] xformOpOrder = ["xformOp:translate"]
    }}
}}
""",
    "planes of all axes": "".join(
        f"""
def Plane "p{axis}" {{
    uniform token axis = "{axis}"
    double width = 3
    double length = 1
    double3 xformOp:translate = ({4 * n}, 0, 0)
    double3 xformOp:rotateXYZ = (20, 30, 40)
    double3 xformOp:scale = (-1, 2, 0.5)
    uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:rotateXYZ", "xformOp:scale"]
}}
"""
        for n, axis in enumerate("XYZ")
    ),
    "cones, cylinders and capsules of all axes with negative scales": "".join(
        f"""
def {kind} "{kind}{axis}" {{
    uniform token axis = "{axis}"
    double height = 3
    double radius = 0.7
    double3 xformOp:translate = ({5 * n}, {6 * m}, 0)
    double3 xformOp:rotateZXY = (20, 30, 40)
    double3 xformOp:scale = (1, -2, 0.5)
    uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:rotateZXY", "xformOp:scale"]
}}
"""
        for n, axis in enumerate("XYZ")
        for m, kind in enumerate(("Cone", "Cylinder", "Capsule"))
    ),
    "two radii on all axes": "".join(
        f"""
def {kind} "{kind}{axis}" {{
    uniform token axis = "{axis}"
    double height = 3
    double radiusBottom = 0.9
    double radiusTop = 0.4
    double3 xformOp:translate = ({5 * n}, {6 * m}, 0)
    double3 xformOp:rotateZYX = (20, 30, 40)
    double3 xformOp:scale = (1, 1, -1)
    uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:rotateZYX", "xformOp:scale"]
}}
"""
        for n, axis in enumerate("XYZ")
        for m, kind in enumerate(("Cylinder_1",))
    ),
    "references with offsets and scales within each other": """
def Xform "a" (references = @middle.usda@ (offset = 4; scale = 2)) {
}
def Xform "b" (instanceable = true
    references = @middle.usda@ (offset = -3; scale = 0.5)) {
}
""",
    "clips of a pattern with a stretched stage": """
def "moving" (
    clips = {
        dictionary default = {
            string templateAssetPath = "./clip.#.usda"
            double templateStartTime = 1
            double templateEndTime = 3
            double templateStride = 1
            string primPath = "/moving"
            asset manifestAssetPath = @./manifest.usda@
        }
    }
) {
    def Cube "c" {
        uniform token[] xformOpOrder = ["xformOp:translate"]
    }
}
""",
    "operations of all precisions": """
def Cube "c" {
    half3 xformOp:rotateXZY = (10, 20, 30)
    half3 xformOp:scale = (1, 2, 3)
    quath xformOp:orient = (0.5, 0.5, 0.5, 0.5)
    quatd xformOp:orient:b = (0.8, 0, 0.6, 0)
    float3 xformOp:translate = (1, 2, 3)
    half xformOp:rotateX:z = 12
    matrix4d xformOp:transform:m = ((1, 0, 0, 0), (0.5, 1, 0, 0), (0, 0, 1, 0), (2, 0, 0, 1))
    uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:rotateXZY", "xformOp:orient",
        "xformOp:transform:m", "xformOp:scale", "xformOp:orient:b", "xformOp:rotateX:z",
        "!invert!xformOp:transform:m"]
}
""",
    "points of all precisions": "".join(
        f"""
def Mesh "m{n}" {{
    uniform token subdivisionScheme = "none"
    {kind}[] points = [(0, 0, {n}), (2, 0, {n}), (2, 1, {n}), (0, 1, {n})]
    int[] faceVertexCounts = [4]
    int[] faceVertexIndices = [0, 1, 2, 3]
}}
"""
        for n, kind in enumerate(("point3h", "point3d", "vector3f", "float3", "double3", "half3"))
    ),
    "topology in time": """
def Mesh "m" {
    uniform token subdivisionScheme = "none"
    point3f[] points.timeSamples = {
        0: [(0, 0, 0), (1, 0, 0), (1, 1, 0)],
        5: [(0, 0, 2), (3, 0, 2), (3, 1, 2), (0, 1, 2)],
        12: [(0, 0, 4), (3, 0, 4), (3, 1, 4), (0, 1, 4)],
    }
    int[] faceVertexCounts.timeSamples = { 0: [3], 5: [4] }
    int[] faceVertexIndices.timeSamples = { 0: [0, 1, 2], 5: [0, 1, 2, 3] }
    int[] holeIndices.timeSamples = { 0: [], 12: [3] }
}
""",
    "z up in centimetres, with extents that are wrong": """
def Xform "w" {
    def Cube "c" {
        float3[] extent = [(0, 0, 0), (0, 0, 0)]
    }
    def Mesh "m" {
        float3[] extent = [(9, 9, 9), (-9, -9, -9)]
        uniform token subdivisionScheme = "none"
        point3f[] points = [(3, 0, 0), (5, 0, 0), (5, 1, 0), (3, 1, 0)]
        int[] faceVertexCounts = [4]
        int[] faceVertexIndices = [0, 1, 2, 3]
    }
}
""",
    "overs between, scopes that hide": """
over "nothing" {
    def Cube "not" {
    }
}
def Scope "s" {
    token visibility = "invisible"
    def Xform "x" {
        token visibility = "inherited"
        def Cube "hidden" {
        }
    }
}
def "typeless" {
    def Cube "seen" {
    }
    over "over" {
        def Cube "too" {
        }
    }
}
def Unknown "u" {
    double3 xformOp:translate = (50, 0, 0)
    uniform token[] xformOpOrder = ["xformOp:translate"]
    def Sphere "below" {
        double3 xformOp:translate = (5, 0, 0)
        uniform token[] xformOpOrder = ["xformOp:translate"]
    }
}
""",
    "points of varying and of one width": """
def Points "varying" {
    point3f[] points = [(0, 0, 0), (4, 0, 0), (8, 0, 0)]
    float[] widths = [1, 2, 3]
    int64[] ids = [5, 3, 1]
}
def Points "one" {
    point3f[] points = [(0, 5, 0), (4, 5, 0), (8, 5, 0)]
    float[] widths = [1.5] (
        interpolation = "constant"
    )
    double3 xformOp:scale = (1, 2, 1)
    uniform token[] xformOpOrder = ["xformOp:scale"]
}
""",
    "components in their default draw mode": """
def Xform "assembly" (kind = "assembly") {
    def Cube "part" (kind = "component"
        prepend apiSchemas = ["GeomModelAPI"]) {
        uniform token model:drawMode = "default"
        uniform bool model:applyDrawMode = 1
    }
    def Sphere "loose" (kind = "subcomponent"
        prepend apiSchemas = ["GeomModelAPI"]) {
        uniform token model:drawMode = "bounds"
        double3 xformOp:translate = (5, 0, 0)
        uniform token[] xformOpOrder = ["xformOp:translate"]
    }
}
""",
    "very large and very small": """
def Xform "far" {
    double3 xformOp:translate = (20000000, 0, 0)
    double3 xformOp:scale = (1e-6, 1e-6, 1e-6)
    uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:scale"]
    def Xform "back" {
        double3 xformOp:scale = (1e6, 1e6, 1e6)
        uniform token[] xformOpOrder = ["xformOp:scale"]
        def Cube "c" {
        }
        def Sphere "s" {
            double3 xformOp:translate = (3, 0, 0)
            uniform token[] xformOpOrder = ["xformOp:translate"]
        }
    }
}
""",
}

FILES = {
    "middle.usda": """#usda 1.0
(
    defaultPrim = "m"
    timeCodesPerSecond = 48
)
def Xform "m" {
    double3 xformOp:translate.timeSamples = { 0: (0, 0, 0), 10: (10, 0, 0) }
    uniform token[] xformOpOrder = ["xformOp:translate"]
    def "inner" (references = @inner.usda@ (offset = 1; scale = 3)) {
    }
}
""",
    "inner.usda": """#usda 1.0
(
    defaultPrim = "i"
)
def Xform "i" {
    double xformOp:rotateZ.timeSamples = { 0: 0, 4: 180 }
    uniform token[] xformOpOrder = ["xformOp:rotateZ"]
    def Cube "c" {
        double size.timeSamples = { 1: 1, 3: 4 }
    }
}
""",
    "manifest.usda": """#usda 1.0
def "moving" {
    def Cube "c" {
        double3 xformOp:translate
        double size
    }
}
""",
    **{
        f"clip.{n}.usda": f"""#usda 1.0
def "moving" {{
    def Cube "c" {{
        double3 xformOp:translate.timeSamples = {{ {n}: ({n}, 0, {n}), {n + 1}: ({3 * n}, 0, 0) }}
        double size.timeSamples = {{ {n}: {n} }}
    }}
}}
"""
        for n in (1, 2, 3)
    },
}
HEADS = {
    "z up in centimetres, with extents that are wrong": """#usda 1.0
(
    upAxis = "Z"
    metersPerUnit = 0.01
    kilogramsPerUnit = 2
)
""",
    "clips of a pattern with a stretched stage": """#usda 1.0
(
    timeCodesPerSecond = 60
    framesPerSecond = 24
)
""",
}


@pytest.mark.parametrize("name", STAGES)
def test_studio_stages_are_what_usd_core_says(name: str, tmp_path: Path) -> None:
    for file, text in FILES.items():
        (tmp_path / file).write_text(text)
    path = tmp_path / "stage.usda"
    path.write_text(HEADS.get(name, HEAD) + STAGES[name])
    for time in (None, 1.0, 2.5, 7.0):
        stage_agrees(path, time=time, count=150, least=0.01)
