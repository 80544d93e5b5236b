"""Stages that mix what is judged one by one elsewhere, by rays against usd-core's own matrices."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.compiler.usd_stages.ray_agreement import stage_agrees

STAGES = {
    "masks by time in instancers of instances, with mirrors and prototypes of every specifier": """
class Xform "_rock" {
    float3 xformOp:scale = (1, 0.5, 2)
    uniform token[] xformOpOrder = ["xformOp:scale"]
    def PointInstancer "bits" (inactiveIds = [12]) {
        int64[] ids = [10, 11, 12, 13, 14]
        int64[] invisibleIds.timeSamples = { 0: [11], 5: [14], 10: [] }
        int[] protoIndices = [0, 1, 0, 1, 0]
        point3f[] positions.timeSamples = {
            0: [(0, 0, 0), (3, 0, 0), (6, 0, 0), (9, 0, 0), (12, 0, 0)],
            10: [(0, 1, 0), (3, 2, 0), (6, 3, 0), (9, 4, 0), (12, 5, 0)],
        }
        float3[] scales = [(1, 1, 1), (-1, 1, 1), (1, 1, 1), (1, -1, -2), (1, 0.5, 1)]
        quath[] orientations = [(1, 0, 0, 0), (0.5, 0.5, 0.5, 0.5), (1, 0, 0, 0),
            (0.7071, 0, 0.7071, 0), (1, 0, 0, 0)]
        rel prototypes = [</_rock/bits/P/tri>, </lib/cone>]
        over "P" {
            def Mesh "tri" {
                int[] faceVertexCounts = [3, 3]
                int[] faceVertexIndices = [0,1,2, 0,2,3]
                point3f[] points = [(0, 0, 0), (1, 0, 0.3), (1, 1, 0), (0, 1, 0.2)]
                uniform token orientation = "leftHanded"
                uniform token subdivisionScheme = "none"
                double xformOp:rotateX = 20
                uniform token[] xformOpOrder = ["xformOp:rotateX"]
            }
        }
    }
}
over "lib" {
    def Cone "cone" {
        double height = 1.5
        double radius = 0.6
        token axis = "X"
        double3 xformOp:translate = (0.1, 0.2, 0.3)
        uniform token[] xformOpOrder = ["xformOp:translate"]
    }
}
def PointInstancer "outer" {
    int[] protoIndices = [0, 0, 1]
    point3f[] positions = [(0, 0, 0), (0, 20, 0), (0, -15, 3)]
    float3[] scales = [(1, 1, 1), (-1, 1, 1), (2, 2, 2)]
    rel prototypes = [</outer/a>, </outer/b>]
    def Xform "a" (instanceable = true
        inherits = </_rock>) {
        float3 xformOp:scale = (-1, 1, 1)
        uniform token[] xformOpOrder = ["xformOp:scale"]
    }
    def Xform "b" {
        def Xform "c" (instanceable = true
            inherits = </_rock>) {
            double xformOp:rotateZ = 33
            uniform token[] xformOpOrder = ["xformOp:rotateZ"]
        }
        def Sphere "s" {
            double radius = 0.8
            double3 xformOp:translate = (-3, 0, 0)
            uniform token[] xformOpOrder = ["xformOp:translate"]
        }
    }
}
""",
    "prototypes that change by time, of which some are classes and overs": """
def PointInstancer "pi" {
    int[] protoIndices.timeSamples = { 0: [0,1,2,3,0], 4: [3,2,1,0,0] }
    point3f[] positions = [(0, 0, 0), (5, 0, 0), (10, 0, 0), (15, 0, 0), (20, 0, 0)]
    float angularVelocity = 3
    rel prototypes = [</pi/x>, </cls>, </ov>, </def/in>]
    def Xform "x" {
        token visibility.timeSamples = { 0: "invisible", 2: "inherited" }
        def Cube "k" {
            double size.timeSamples = { 0: 1, 4: 2 }
        }
        def Cube "off" (active = false) {
            double size = 9
        }
    }
    def Sphere "notproto" {
        double radius = 3
        double3 xformOp:translate = (0, 0, 7)
        uniform token[] xformOpOrder = ["xformOp:translate"]
    }
}
class Xform "cls" {
    def Capsule "cap" {
        token axis = "X"
        double height.timeSamples = { 0: 1, 4: 3 }
        double radius = 0.5
        uniform token purpose = "render"
    }
    def Capsule "g" {
        uniform token purpose = "guide"
        double radius = 2
    }
}
over "ov" {
    def Cylinder "cy" {
        token axis = "X"
        double radius = 0.7
        double height = 1
    }
}
def Xform "def" {
    double3 xformOp:translate = (0, 10, 0)
    uniform token[] xformOpOrder = ["xformOp:translate"]
    def Xform "in" {
        double xformOp:rotateZ.timeSamples = { 0: 0, 4: 90 }
        uniform token[] xformOpOrder = ["xformOp:rotateZ"]
        def Cone "co" {
            token axis = "Y"
        }
    }
}
""",
    "instancers that are each other's prototypes, at times": """
def Xform "root" {
    double xformOp:rotateY.timeSamples = { 1: 0, 10: 90 }
    uniform token[] xformOpOrder = ["xformOp:rotateY"]
    def PointInstancer "o" {
        rel prototypes = [</root/o/mid>, </root/o/mid/leaf>, </root/o/mid/deep>]
        int[] protoIndices = [0, 1, 2, 0]
        point3f[] positions.timeSamples = {
            1: [(0, 0, 0), (12, 0, 0), (0, 12, 0), (0, 0, 25)],
            10: [(1, 0, 0), (13, 0, 0), (0, 13, 0), (0, 0, 26)],
        }
        quath[] orientations.timeSamples = {
            1: [(1, 0, 0, 0), (1, 0, 0, 0), (1, 0, 0, 0), (1, 0, 0, 0)],
            10: [(0.7071, 0.7071, 0, 0), (0.7071, 0, 0.7071, 0), (0, 0, 0, 1),
                (0.5, 0.5, 0.5, 0.5)],
        }
        def PointInstancer "mid" {
            float3 xformOp:scale = (1, 1.5, 1)
            uniform token[] xformOpOrder = ["xformOp:scale"]
            rel prototypes = [</root/o/mid/leaf>, </root/o/mid/deep>]
            int[] protoIndices = [0, 1, 0]
            point3f[] positions.timeSamples = {
                1: [(0, 0, 0), (3, 0, 0), (6, 0, 0)],
                10: [(0, 0, 3), (3, 0, 3), (6, 0, 3)],
            }
            def Cube "leaf" {
                double size = 1.2
                double xformOp:rotateX.timeSamples = { 1: 0, 10: 45 }
                uniform token[] xformOpOrder = ["xformOp:rotateX"]
            }
            def PointInstancer "deep" {
                rel prototypes = </root/o/mid/leaf>
                int[] protoIndices = [0, 0]
                point3f[] positions = [(0, 0, 1.5), (0, 0, -1.5)]
                float3[] scales = [(1, 1, 1), (0.3, 0.3, 0.3)]
            }
        }
    }
}
""",
    "instances at three levels with instancers and resets at each": """
class Xform "_l1" {
    def Cube "c" {
        double size = 0.6
    }
    def PointInstancer "pi" {
        rel prototypes = </_l1/pi/ball>
        int[] protoIndices = [0,0]
        point3f[] positions = [(0, 1, 0), (0, 2, 0)]
        def Sphere "ball" {
            double radius = 0.4
        }
    }
}
class Xform "_l2" {
    def Xform "a" (
        instanceable = true
        inherits = </_l1>
    ) {
        double xformOp:rotateX = 45
        uniform token[] xformOpOrder = ["xformOp:rotateX"]
    }
    def Xform "b" (
        instanceable = true
        inherits = </_l1>
    ) {
        double3 xformOp:translate = (3, 0, 0)
        uniform token[] xformOpOrder = ["xformOp:translate"]
    }
    def PointInstancer "pi" {
        rel prototypes = [</_l2/b>, </_l2/pi/x>]
        int[] protoIndices = [1,0,1]
        point3f[] positions = [(0, 0, 4), (0, 0, 8), (0, 0, 12)]
        def Xform "x" (
            instanceable = true
            inherits = </_l1>
        ) {
            float3 xformOp:scale = (1, 1, -2)
            uniform token[] xformOpOrder = ["xformOp:scale"]
        }
    }
}
class Xform "_l3" {
    def Xform "p" (
        instanceable = true
        inherits = </_l2>
    ) {
    }
    def Xform "q" (
        instanceable = true
        inherits = </_l2>
    ) {
        double3 xformOp:translate = (0, 20, 0)
        uniform token[] xformOpOrder = ["!resetXformStack!", "xformOp:translate"]
    }
}
def Xform "A" (
    instanceable = true
    inherits = </_l3>
) {
    double3 xformOp:translate = (0, 0, -20)
    uniform token[] xformOpOrder = ["xformOp:translate"]
}
def Xform "B" (
    instanceable = true
    inherits = </_l3>
) {
    double3 xformOp:translate = (30, 0, -20)
    float3 xformOp:scale = (1, -1, 1)
    uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:scale"]
}
def PointInstancer "top" {
    rel prototypes = [</A>, </_l2>]
    int[] protoIndices = [0,1]
    point3f[] positions = [(60, 0, 0), (90, 0, 0)]
    quatf[] orientationsf = [(0.6, 0, 0.8, 0), (0, 0.6, 0.8, 0)]
}
""",
    "prototypes within instances, of two instancers, in an invisible library": """
def Xform "lib" {
    token visibility = "invisible"
    uniform token purpose = "guide"
    double3 xformOp:translate = (100, 0, 0)
    uniform token[] xformOpOrder = ["xformOp:translate"]
    def Xform "r" {
        def Cube "k" {
            double size = 1
        }
        def Sphere "s" {
            double3 xformOp:translate = (0, 2, 0)
            uniform token[] xformOpOrder = ["xformOp:translate"]
        }
    }
}
def Xform "src" {
    def Cone "c" {
    }
    def Xform "d" {
        double3 xformOp:translate = (0, 0, 3)
        uniform token[] xformOpOrder = ["xformOp:translate"]
        def Cylinder "e" {
            double radius = 0.3
        }
    }
}
def Xform "inst" (
    instanceable = true
    references = </src>
) {
    double3 xformOp:translate = (0, 20, 0)
    double xformOp:rotateX = 45
    uniform token[] xformOpOrder = ["xformOp:translate","xformOp:rotateX"]
}
def Xform "top" {
    def PointInstancer "one" {
        rel prototypes = [</inst/d>, </lib/r>, </inst>, </top/one/own>]
        int[] protoIndices = [0,1,2,3,1]
        point3f[] positions = [(0, 0, 0), (4, 0, 0), (8, 0, 0), (12, 0, 0), (16, 0, 0)]
        def Xform "own" {
            def Capsule "cap" {
            }
            def Xform "in" {
                def Cube "deep" {
                    double size = 3
                }
            }
        }
    }
    def PointInstancer "two" {
        rel prototypes = [</top/one/own/in>, </inst>, </inst/d/e>, </lib/r/s>]
        int[] protoIndices = [0,1,2,3]
        point3f[] positions = [(0, 0, 10), (4, 0, 10), (8, 0, 10), (12, 0, 10)]
        float3[] scales = [(1, 1, 1), (1, -1, 1), (2, 1, 1), (1, 1, 0.3)]
    }
}
""",
    "instancers that are instances": """
class PointInstancer "_pi" {
    rel prototypes = [</_pi/übung>, </_pi/形>]
    int[] protoIndices = [0,1,1]
    point3f[] positions = [(0, 0, 0), (4, 0, 0), (8, 0, 0)]
    quath[] orientations = [(0.7071, 0.7071, 0, 0), (1, 0, 0, 0), (0, 1, 0, 0)]
    def Cone "übung" {
        double height = 1.23456789012345
    }
    def Xform "形" {
        def Cube "κύβος" {
        }
    }
}
def PointInstancer "a" (
    instanceable = true
    inherits = </_pi>
) {
    int64[] invisibleIds = [1]
    double3 xformOp:translate = (0, 7, 0)
    uniform token[] xformOpOrder = ["xformOp:translate"]
}
def PointInstancer "b" (
    instanceable = true
    inherits = </_pi>
) {
    float3[] scales = [(1, 1, 1), (2, 2, 2), (1, 0.5, 1)]
    point3f[] positions = [(0, 0, 0), (4, 1, 0), (8, 2, 0)]
}
def Xform "w" {
    def PointInstancer "c" (
        instanceable = true
        inherits = </_pi>
    ) {
        double3 xformOp:translate = (0, 14, 0)
        uniform token[] xformOpOrder = ["xformOp:translate"]
        rel prototypes = [</w/c/形>, </w/c/übung>]
    }
}
""",
    "prims below primitives, and instances of them": """
def Cube "outer" {
    double size.timeSamples = { 0: 1, 1: 2 }
    def Sphere "inner" {
        double radius = 1.2
        double3 xformOp:translate = (0.5, 0, 0)
        uniform token[] xformOpOrder = ["xformOp:translate"]
        def Cone "tip" {
            double3 xformOp:translate = (0, 0, 1.5)
            uniform token[] xformOpOrder = ["xformOp:translate"]
        }
    }
}
def Cube "k1" (instanceable = true
    references = </outer>) { double size = 0.7
    double3 xformOp:translate = (5, 0, 0)
    uniform token[] xformOpOrder = ["xformOp:translate"]
}
def Cube "k2" (instanceable = true
    references = </outer>) { double3 xformOp:translate = (10, 0, 0)
    uniform token[] xformOpOrder = ["xformOp:translate"]
}
def PointInstancer "pi" {
    rel prototypes = [</outer>, </k2>, </outer/inner>, </pi/self>]
    int[] protoIndices = [0,1,2,3]
    point3f[] positions = [(0, 10, 0), (0, 15, 0), (0, 20, 0), (0, 25, 0)]
    quatf[] orientationsf = [(0.6, 0.8, 0, 0), (0.6, 0, 0.8, 0), (1, 0, 0, 0), (0, 1, 0, 0)]
    def PointInstancer "self" {
        rel prototypes = </pi/self/leaf>
        double3 xformOp:translate = (1, 0, 0)
        uniform token[] xformOpOrder = ["xformOp:translate"]
        int[] protoIndices = [0,0,0]
        int64[] invisibleIds = [1]
        point3f[] positions = [(0, 0, 0), (2, 0, 0), (4, 0, 0)]
        def Capsule "leaf" {
            def Cube "sub" {
                double size = 1.3
            }
        }
    }
}
""",
}


@pytest.mark.parametrize("name", STAGES)
def test_mixed_stages_are_what_usd_core_says(name: str, tmp_path: Path) -> None:
    path = tmp_path / "stage.usda"
    path.write_text("#usda 1.0\n" + STAGES[name])
    for time in (0.0, 1.5, 5.0, 10.0):
        stage_agrees(path, time=time, count=150, least=0.01)
