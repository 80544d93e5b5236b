"""Ways to compose and to animate that are seldom seen, against usd-core's own matrices by rays."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.compiler.usd_stages.ray_agreement import stage_agrees

HEAD = "#usda 1.0\n"
PART = """#usda 1.0
(
    defaultPrim = "Part"
    timeCodesPerSecond = 24
)
def Xform "Part" (
    variants = {
        string size = "small"
    }
    prepend variantSets = "size"
)
{
    double3 xformOp:translate.timeSamples = { 0: (0, 0, 0), 10: (10, 0, 0) }
    uniform token[] xformOpOrder = ["xformOp:translate"]
    def Cube "Body" (
        kind = "component"
    )
    {
        double size = 1
    }
    def Sphere "Knob"
    {
        double radius = 0.4
        double3 xformOp:translate = (0, 1, 0)
        uniform token[] xformOpOrder = ["xformOp:translate"]
    }
    variantSet "size" = {
        "small" {
            over "Body"
            {
                double size = 1
            }
        }
        "large" (
            variants = {
                string hat = "none"
            }
            prepend variantSets = "hat"
        ) {
            over "Body"
            {
                double size = 2
            }
            variantSet "hat" = {
                "none" {
                }
                "cone" {
                    def Cone "Hat"
                    {
                        double3 xformOp:translate = (0, 3, 0)
                        uniform token[] xformOpOrder = ["xformOp:translate"]
                    }
                }
            }
        }
    }
}
"""
MOVED = """
    double3 xformOp:translate = (5, 0, 0)
    uniform token[] xformOpOrder = ["xformOp:translate"]
"""

LAYER = """#usda 1.0
(
    timeCodesPerSecond = 24
)
def Xform "moved"
{
    double3 xformOp:translate.timeSamples = { 0: (0, 6, 0), 10: (20, 6, 0) }
    uniform token[] xformOpOrder = ["xformOp:translate"]
    def Cube "c"
    {
    }
}
"""

STAGES = {
    "specializes": f"""
def Xform "base" {{
    def Cube "c" {{
        double size = 1
    }}
}}
def Xform "a" (specializes = </base>) {{{MOVED}
    over "c" {{
        double size = 3
    }}
}}
""",
    "variants in variants": f"""
def "a" (references = @part.usda@
    variants = {{ string size = "large"
        string hat = "cone" }}
) {{
}}
def Xform "b" {{{MOVED}
    def "c" (references = @part.usda@) {{
    }}
}}
""",
    "a reference whose time is stretched": """
def "a" (references = @part.usda@ (offset = 5; scale = 2)) {
}
""",
    "a payload whose time runs backwards": """
def "a" (payload = @part.usda@ (offset = 10; scale = -1)) {
}
""",
    "instances with time offsets of their own": """
def "a" (instanceable = true
    references = @part.usda@ (offset = 0)) {
}
def Xform "b" {
    double3 xformOp:translate = (0, 5, 0)
    uniform token[] xformOpOrder = ["xformOp:translate"]
    def "c" (instanceable = true
        references = @part.usda@ (offset = 4)) {
    }
}
""",
    "instances of two variants": """
def Xform "rack" {
    double3 xformOp:translate = (0, 0, 4)
    uniform token[] xformOpOrder = ["xformOp:translate"]
    def "a" (instanceable = true
        references = @part.usda@
        variants = { string size = "large" }) {
        double3 xformOp:scale = (1, -2, 1)
        uniform token[] xformOpOrder = ["xformOp:scale"]
    }
    def "b" (instanceable = true
        references = @part.usda@) {
    }
}
""",
    "references into the middle": f"""
def Xform "a" {{{MOVED}
    def Xform "b" {{{MOVED}
        def Sphere "s" {{
        }}
    }}
}}
def "copy" (references = </a/b>) {{
}}
def "deeper" (references = </a/b/s>) {{
    double radius = 0.5
}}
""",
    "overs of other types": """
def Sphere "s" {
}
over Cube "o" {
}
over "t" (references = </s>) {
    double radius = 2
}
""",
    "a deactivated child of a reference": """
def "a" (references = @part.usda@) {
    over "Knob" (active = false) {
    }
}
""",
    "an instanceable prim below an inactive one and beside": """
def Xform "x" (active = false) {
    def "a" (instanceable = true
        references = @part.usda@) {
    }
}
def "y" (instanceable = true
    references = @part.usda@) {
    over "Knob" (active = false) {
    }
}
""",
    "blocked samples": """
def Sphere "s" {
    double radius.timeSamples = { 0: 1, 8: 3 }
    double3 xformOp:translate = (0, 0, 0)
    double3 xformOp:translate.timeSamples = { 0: None, 6: (4, 0, 0) }
    uniform token[] xformOpOrder = ["xformOp:translate"]
}
""",
    "a blocked default over a reference": """
def "a" (references = @part.usda@) {
    double3 xformOp:translate = None
    over "Body" {
        double size = None
    }
}
""",
    "visibility in time": """
def Xform "x" {
    token visibility.timeSamples = { 0: "invisible", 5: "inherited" }
    def Cube "c" {
    }
}
def Sphere "s" {
    token visibility.timeSamples = { 0: "inherited", 5: "invisible" }
    double3 xformOp:translate = (4, 0, 0)
    uniform token[] xformOpOrder = ["xformOp:translate"]
}
""",
    "matrices in time": """
def Cube "c" {
    matrix4d xformOp:transform.timeSamples = {
        0: ((1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 1, 0), (0, 0, 0, 1)),
        10: ((0, 1, 0, 0), (-1, 0, 0, 0), (0, 0, 2, 0), (7, 0, 0, 1)),
    }
    uniform token[] xformOpOrder = ["xformOp:transform"]
}
""",
    "quaternions in time": """
def Cube "c" {
    quatf xformOp:orient.timeSamples = { 0: (1, 0, 0, 0), 10: (0, 0, 1, 0) }
    float3 xformOp:scale = (1, 2, 3)
    uniform token[] xformOpOrder = ["xformOp:orient", "xformOp:scale"]
}
""",
    "splines": """
def Xform "x" {
    double xformOp:rotateZ.spline = {
        bezier,
        0: 0; post curve (3, 0),
        10: 90; pre (3, 5),
    }
    uniform token[] xformOpOrder = ["xformOp:rotateZ"]
    def Cube "c" {
        double3 xformOp:translate = (4, 0, 0)
        uniform token[] xformOpOrder = ["xformOp:translate"]
    }
}
""",
    "points whose number changes": """
def Mesh "m" {
    uniform token subdivisionScheme = "none"
    point3f[] points.timeSamples = {
        0: [(0, 0, 0), (2, 0, 0), (0, 2, 0)],
        6: [(0, 0, 0), (3, 0, 0), (3, 3, 0), (0, 3, 0)],
    }
    int[] faceVertexCounts.timeSamples = { 0: [3], 6: [4] }
    int[] faceVertexIndices.timeSamples = { 0: [0, 1, 2], 6: [0, 1, 2, 3] }
}
""",
    "a point instancer in time": """
def PointInstancer "p" {
    rel prototypes = [</p/a>, </p/b>]
    int[] protoIndices.timeSamples = { 0: [0, 1], 5: [1, 0, 1] }
    point3f[] positions.timeSamples = {
        0: [(0, 0, 0), (5, 0, 0)],
        5: [(0, 0, 0), (5, 0, 0), (0, 5, 0)],
        10: [(0, 0, 4), (5, 0, 4), (0, 5, 4)],
    }
    int64[] invisibleIds.timeSamples = { 0: [], 8: [1] }
    def Cube "a" {
        double size = 1
    }
    def Sphere "b" {
        double radius.timeSamples = { 0: 1, 10: 2 }
    }
}
""",
    "prototypes that are references and instances": """
def PointInstancer "p" {
    rel prototypes = [</p/a>, </p/b>]
    int[] protoIndices = [0, 1, 0, 1]
    point3f[] positions = [(0, 0, 0), (6, 0, 0), (0, 6, 0), (6, 6, 0)]
    quath[] orientations = [(1, 0, 0, 0), (0, 1, 0, 0), (0.7071, 0, 0.7071, 0), (0, 0, 0, 1)]
    def "a" (references = @part.usda@
        variants = { string size = "large" }) {
    }
    def "b" (instanceable = true
        references = @part.usda@) {
    }
}
""",
    "sublayers in time": """
def Xform "x" {
    def "a" (references = @part.usda@) {
    }
}
over "moved" {
    over "c" {
        double size = 3
    }
}
""",
    "half a rotation order each": """
def Xform "x" {
    float3 xformOp:rotateZYX = (10, 20, 30)
    half3 xformOp:rotateYXZ:b = (40, 50, 60)
    uniform token[] xformOpOrder = ["xformOp:rotateZYX", "!invert!xformOp:rotateYXZ:b"]
    def Cone "c" {
        double3 xformOp:scale = (1, 0.25, -3)
        uniform token[] xformOpOrder = ["xformOp:scale"]
    }
}
""",
    "relocates": """
def "a" (references = @part.usda@) {
    def Xform "in" {
        double3 xformOp:translate = (0, 0, 6)
        uniform token[] xformOpOrder = ["xformOp:translate"]
    }
}
""",
    "expression variables": """
def "a" (references = @`"${WHICH}.usda"`@) {
}
""",
    "inherits through a reference": """
class "_all" {
    over "Body" {
        double size = 0.5
    }
}
def "a" (references = @part.usda@
    inherits = </_all>) {
}
""",
    "the same operation twice": """
def Cube "c" {
    double xformOp:rotateX = 20
    double3 xformOp:translate = (1, 2, 3)
    double3 xformOp:scale:a = (2, 1, 1)
    uniform token[] xformOpOrder = ["xformOp:rotateX", "xformOp:translate", "xformOp:rotateX",
        "xformOp:scale:a", "xformOp:translate", "!invert!xformOp:scale:a"]
}
""",
    "operations of one axis": """
def Cube "c" {
    double xformOp:translateX = 3
    half xformOp:scaleY = 2
    float xformOp:translateZ:up = -2
    uniform token[] xformOpOrder = ["xformOp:translateX", "xformOp:scaleY",
        "xformOp:translateZ:up", "!invert!xformOp:translateX"]
}
""",
    "a reset in the middle of a list": """
def Xform "x" {
    double3 xformOp:translate = (50, 0, 0)
    uniform token[] xformOpOrder = ["xformOp:translate"]
    def Cube "c" {
        double3 xformOp:translate = (0, 3, 0)
        double xformOp:rotateZ = 30
        uniform token[] xformOpOrder = ["xformOp:rotateZ", "!resetXformStack!", "xformOp:translate"]
    }
}
""",
    "purposes from variants": """
def Xform "x" (
    variants = { string show = "proxy" }
    prepend variantSets = "show"
) {
    def Cube "c" {
    }
    def Sphere "s" {
        uniform token purpose = "render"
    }
    variantSet "show" = {
        "proxy" {
            over "c" {
                uniform token purpose = "proxy"
            }
        }
    }
}
""",
    "names of other alphabets": """
def Xform "Größe" {
    def Cube "立方体" {
    }
}
""",
    "gprims of negative and odd sizes in time": """
def Cylinder "c" {
    uniform token axis = "X"
    double height.timeSamples = { 0: 1, 10: 6 }
    double radius.timeSamples = { 0: 2, 10: 0.5 }
}
def Capsule "k" {
    double height = 0
    double3 xformOp:translate = (0, 6, 0)
    uniform token[] xformOpOrder = ["xformOp:translate"]
}
""",
    "an instance that is a mesh of its own": """
class Mesh "_m" {
    uniform token subdivisionScheme = "none"
    point3f[] points = [(0, 0, 0), (4, 0, 0), (4, 4, 0)]
    int[] faceVertexCounts = [3]
    int[] faceVertexIndices = [0, 1, 2]
}
def Mesh "a" (instanceable = true
    inherits = </_m>) {
    double xformOp:rotateX = 40
    uniform token[] xformOpOrder = ["xformOp:rotateX"]
}
def Mesh "b" (instanceable = true
    inherits = </_m>) {
    point3f[] points = [(0, 0, 9), (4, 0, 9), (4, 8, 9)]
}
""",
    "a mesh of a class by reference": """
def Mesh "m" (references = </_flat>) {
}
class Mesh "_flat" {
    uniform token subdivisionScheme = "none"
    point3f[] points = [(0, 0, 0), (2, 0, 0), (2, 2, 0), (0, 2, 0)]
    int[] faceVertexCounts = [4]
    int[] faceVertexIndices = [0, 1, 2, 3]
}
""",
}

HEADS = {
    "sublayers in time": """#usda 1.0
(
    timeCodesPerSecond = 48
    subLayers = [@moved.usda@ (offset = 2; scale = 0.5)]
)
""",
    "relocates": """#usda 1.0
(
    relocates = {
        </a/Knob>: </a/in/Button>
    }
)
""",
    "expression variables": """#usda 1.0
(
    expressionVariables = {
        string WHICH = "part"
    }
)
""",
}


@pytest.mark.parametrize("name", STAGES)
def test_stages_composed_oddly_are_what_usd_core_says(name: str, tmp_path: Path) -> None:
    (tmp_path / "part.usda").write_text(PART)
    (tmp_path / "moved.usda").write_text(LAYER)
    path = tmp_path / "stage.usda"
    path.write_text(HEADS.get(name, HEAD) + STAGES[name], encoding="utf-8")
    for time in (None, 0.0, 5.0, 7.5, 12.0):
        stage_agrees(path, time=time, count=150, least=0.01)
