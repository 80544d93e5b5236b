"""The traps of USD that importers fall into, each as a small stage that `oracle` judges by rays.

Numbers are those of the list of gotchas in the project's notes on USD. Those that usd-core and
plain formulas cannot judge, or not by rays alone, are in `test_usd_gotchas_one_by_one`.
"""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.compiler.usd_stages.ray_agreement import agree, stage_agrees

WEDGE = """
        point3f[] points = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1)]
        int[] faceVertexCounts = [4, 4, 3, 4, 3]
        int[] faceVertexIndices = [3, 2, 1, 0, 0, 1, 5, 4, 0, 4, 3, 3, 4, 5, 2, 1, 2, 5]
        uniform token subdivisionScheme = "none"
"""
MAYA = """
    double3 xformOp:translate = (1, 2, 3)
    double3 xformOp:translate:rotatePivotTranslate = (0.1, 0.2, 0.3)
    double3 xformOp:translate:rotatePivot = (1, -1, 0.5)
    float3 xformOp:rotateXYZ = (20, 35, -50)
    double3 xformOp:translate:scalePivotTranslate = (-0.2, 0.4, 0.1)
    double3 xformOp:translate:scalePivot = (0.5, 0.5, -0.5)
    matrix4d xformOp:transform:shear = ((1, 0, 0, 0), (0.4, 1, 0, 0), (0.2, -0.3, 1, 0), (0, 0, 0, 1))
    float3 xformOp:scale = (1.5, -0.75, 1)
    uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:translate:rotatePivotTranslate",
        "xformOp:translate:rotatePivot", "xformOp:rotateXYZ",
        "!invert!xformOp:translate:rotatePivot", "xformOp:translate:scalePivotTranslate",
        "xformOp:translate:scalePivot", "xformOp:transform:shear", "xformOp:scale",
        "!invert!xformOp:translate:scalePivot"]
"""  # noqa: E501
JUDGED = {
    "1-the-order-is-the-truth": f"""
def Mesh "unlisted" {{{WEDGE}
    double3 xformOp:translate = (50, 0, 0)
}}
def Mesh "twice" {{{WEDGE}
    double3 xformOp:translate = (3, 0, 0)
    double xformOp:rotateZ = 30
    uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:rotateZ", "xformOp:translate"]
}}
def Mesh "suffixes" {{{WEDGE}
    double3 xformOp:translate = (50, 0, 0)
    double3 xformOp:translate:a = (0, 3, 0)
    double3 xformOp:translate:b = (0, 0, 3)
    float3 xformOp:rotateZYX:a = (10, 20, 30)
    uniform token[] xformOpOrder = ["xformOp:translate:a", "xformOp:rotateZYX:a",
        "xformOp:translate:b"]
}}
""",
    "2-pivots-and-shear": f"""
def Xform "outer" {{{MAYA}
    def Mesh "m" {{{WEDGE}{MAYA}
    }}
    def Cone "c" {{{MAYA}
    }}
}}
""",
    "3-resets": f"""
class Xform "_thing" {{
    double3 xformOp:translate = (0, 9, 0)
    uniform token[] xformOpOrder = ["xformOp:translate"]
    def Mesh "m" {{{WEDGE}
        double3 xformOp:translate = (2, 0, 0)
        uniform token[] xformOpOrder = ["!resetXformStack!", "xformOp:translate"]
        def Sphere "below" {{
            double radius = 0.3
            double3 xformOp:translate = (0, 0, 2)
            uniform token[] xformOpOrder = ["xformOp:translate"]
        }}
    }}
}}
def Xform "turned" {{
    double xformOp:rotateX = 90
    double3 xformOp:translate = (0, 5, 0)
    uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:rotateX"]
    def "instance" (instanceable = true
        inherits = </_thing>
    ) {{
        double3 xformOp:translate = (0, 5, 0)
        uniform token[] xformOpOrder = ["xformOp:translate"]
    }}
    def Mesh "late" {{{WEDGE}
        double3 xformOp:translate = (5, 0, 0)
        uniform token[] xformOpOrder = ["xformOp:translate", "!resetXformStack!"]
    }}
}}
def PointInstancer "many" {{
    double3 xformOp:translate = (0, -8, 0)
    uniform token[] xformOpOrder = ["xformOp:translate"]
    rel prototypes = </many/p>
    int[] protoIndices = [0, 0]
    point3f[] positions = [(0, 0, 0), (6, 0, 0)]
    def Xform "p" {{
        double3 xformOp:translate = (0, 0, 3)
        uniform token[] xformOpOrder = ["xformOp:translate"]
        def Mesh "m" {{{WEDGE}
            double xformOp:rotateZ = 45
            uniform token[] xformOpOrder = ["!resetXformStack!", "xformOp:rotateZ"]
        }}
        def Mesh "n" {{{WEDGE}
        }}
    }}
}}
""",
    "4-precision": "".join(
        f"""
def Mesh "{name}" {{{WEDGE}
    double3 xformOp:translate = ({x}, 0, 0)
    {quat} xformOp:orient = (0.8, 0.36, 0, 0.48)
    half3 xformOp:scale = (1, 2, 1)
    uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:orient", "xformOp:scale"]
}}
"""
        for name, x, quat in (
            ("a", 20000000, "quath"),
            ("b", 20000004, "quatf"),
            ("c", 20000008.25, "quatd"),
        )
    ),
    "5-parents-without-a-transform": f"""
class "_plain" {{
    def Mesh "m" {{{WEDGE}
    }}
    def Cylinder "c" {{
        double3 xformOp:translate = (0, 0, 3)
        uniform token[] xformOpOrder = ["xformOp:translate"]
    }}
}}
def Xform "moved" {{
    double3 xformOp:translate = (4, 0, 0)
    double xformOp:rotateZ = 20
    uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:rotateZ"]
    def "typeless" {{
        double3 xformOp:translate = (70, 0, 0)
        uniform token[] xformOpOrder = ["xformOp:translate"]
        def Scope "scope" {{
            def "instance" (instanceable = true
                inherits = </_plain>
            ) {{
            }}
        }}
    }}
}}
def "instance" (instanceable = true
    inherits = </_plain>
) {{
}}
""",
    "6-mirrors-and-left-hands": "".join(
        f"""
def Mesh "m{number}" {{{WEDGE}
    double3 xformOp:translate = ({3 * number}, 0, 0)
    float3 xformOp:scale = {scale}
    uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:scale"]
    uniform token orientation = "{orientation}"
}}
"""
        for number, (scale, orientation) in enumerate(
            (s, o)
            for s in ("(1, 1, 1)", "(-1, 1, 2)", "(-1, -1, -1)")
            for o in ("rightHanded", "leftHanded")
        )
    ),
    "8-native-instances": f"""
class Xform "_wheel" {{
    def Mesh "tyre" {{{WEDGE}
    }}
    def Xform "hub" (instanceable = true
        inherits = </_hub>
    ) {{
        double3 xformOp:translate = (0, 2, 0)
        uniform token[] xformOpOrder = ["xformOp:translate"]
    }}
}}
class Xform "_hub" {{
    def Capsule "c" {{
    }}
}}
def Xform "a" (instanceable = true
    inherits = </_wheel>
) {{
    over "tyre" {{
        uniform token visibility = "invisible"
        double3 xformOp:translate = (99, 0, 0)
        uniform token[] xformOpOrder = ["xformOp:translate"]
    }}
}}
def Xform "b" (instanceable = true
    inherits = </_wheel>
) {{
    double3 xformOp:translate = (5, 0, 0)
    float3 xformOp:scale = (1, -1, 2)
    uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:scale"]
}}
""",
    "9-nested-instancers": f"""
class Xform "_bush" {{
    def PointInstancer "leaves" {{
        rel prototypes = [</_bush/leaves/leaf>, </_far/stem>]
        int[] protoIndices = [0, 1, 0]
        point3f[] positions = [(0, 0, 0), (0, 2, 0), (0, 4, 0)]
        quath[] orientations = [(1, 0, 0, 0), (0.7071, 0, 0.7071, 0), (0.5, 0.5, 0.5, 0.5)]
        float3[] scales = [(1, 1, 1), (1, 2, 1), (1, 1, -1)]
        def Mesh "leaf" {{{WEDGE}
            double3 xformOp:translate = (0.5, 0, 0)
            uniform token[] xformOpOrder = ["xformOp:translate"]
        }}
    }}
}}
def Xform "_far" {{
    def Cone "stem" {{
        double xformOp:rotateX = 45
        uniform token[] xformOpOrder = ["xformOp:rotateX"]
    }}
}}
def PointInstancer "garden" {{
    double xformOp:rotateY = 30
    uniform token[] xformOpOrder = ["xformOp:rotateY"]
    rel prototypes = [</garden/bush>, </garden/plain>]
    int[] protoIndices = [0, 1, 0]
    point3f[] positions = [(0, 0, 0), (8, 0, 0), (16, 0, 0)]
    def "bush" (instanceable = true
        inherits = </_bush>
    ) {{
    }}
    def Xform "plain" (inherits = </_bush>) {{
        double3 xformOp:translate = (0, 0, 7)
        uniform token[] xformOpOrder = ["xformOp:translate"]
    }}
}}
""",
    "10-masks-are-ids": """
def PointInstancer "by_id" (
    inactiveIds = [40]
) {
    rel prototypes = </by_id/s>
    int[] protoIndices = [0, 0, 0, 0]
    int64[] ids = [10, 20, 30, 40]
    int64[] invisibleIds = [20, 1]
    point3f[] positions = [(0, 0, 0), (3, 0, 0), (6, 0, 0), (9, 0, 0)]
    float3[] scales = [(1, 1, 1), (2, 2, 2), (1, 2, 1), (1, 1, 1)]
    def Sphere "s" {
    }
}
def PointInstancer "by_place" {
    rel prototypes = </by_place/s>
    int[] protoIndices = [0, 0, 0, 0]
    int64[] invisibleIds = [1]
    point3f[] positions = [(0, 5, 0), (3, 5, 0), (6, 5, 0), (9, 5, 0)]
    def Cube "s" {
    }
}
""",
    "13-topology": """
def Mesh "concave" {
    point3f[] points = [(0, 0, 0), (4, 0, 0), (4, 3, 0), (2, 1, 0), (0, 3, 0), (6, 0, 0), (8, 0, 0),
        (7, 0.5, 0), (7, 3, 0), (nan, 0, 0)]
    int[] faceVertexCounts = [5, 4, 3, 2, 3, 3, 3]
    int[] faceVertexIndices = [0, 1, 2, 3, 4, 5, 7, 6, 8, 0, 1, 77, 0, 1, 1, 2, 9, 4, 3, 2, 0, 1]
    int[] holeIndices = [5]
}
def Mesh "empty" {
}
def Mesh "no_faces" {
    point3f[] points = [(0, 0, 0)]
    int[] faceVertexCounts = []
    int[] faceVertexIndices = []
}
""",
    "17-18-19-purposes-and-units": f"""
def Xform "guides" {{
    uniform token purpose = "guide"
    def Mesh "drawn" {{{WEDGE}
        uniform token purpose = "render"
    }}
    def Mesh "not" {{{WEDGE}
        double3 xformOp:translate = (3, 0, 0)
        uniform token[] xformOpOrder = ["xformOp:translate"]
    }}
}}
def Xform "hidden" {{
    token visibility = "invisible"
    def Cube "still_hidden" {{
        token visibility = "inherited"
    }}
}}
def Cube "odd" {{
    uniform token purpose = "other"
}}
def Cube "shown" {{
    double3 xformOp:translate = (0, 4, 0)
    uniform token[] xformOpOrder = ["xformOp:translate"]
}}
""",
}
MISSING = {"17-18-19-purposes-and-units": 2, "13-topology": 1}


@pytest.mark.parametrize("name", JUDGED)
def test_rays_hit_what_usd_core_and_formulas_say(tmp_path: Path, name: str) -> None:
    path = tmp_path / "stage.usda"
    path.write_text("#usda 1.0\n(\n    metersPerUnit = 0.3048\n)\n" + JUDGED[name])
    shown = stage_agrees(path, count=400)
    assert len(shown) == MISSING.get(name, len(shown))
    agree(path, shown, time=None, precision="float32", count=100)
