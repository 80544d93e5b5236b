"""Instances as studios make them, judged by rays against usd-core's own matrices."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.compiler.usd_stages.ray_agreement import stage_agrees

STAGES = {
    "prototype roots with pivots, in instancers within instancers": """
def Xform "w" {
    double3 xformOp:translate = (1, 2, 3)
    double xformOp:rotateY = 30
    uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:rotateY"]
    def PointInstancer "outer" (
        inactiveIds = [70]
    ) {
        int64[] ids = [50, 60, 70, 80]
        int64[] invisibleIds = [60]
        rel prototypes = [</w/outer/b>, </w/outer/a>, </other>]
        int[] protoIndices = [2, 0, 1, 1]
        point3f[] positions = [(0, 0, 0), (20, 0, 0), (40, 0, 0), (60, 0, 0)]
        quatf[] orientationsf = [(0.8, 0.6, 0, 0), (1, 0, 0, 0), (1, 0, 0, 0), (0, 0, 1, 0)]
        float3[] scales = [(1, 1, 1), (1, 1, 1), (1, 1, 1), (-1, 2, 1)]
        def PointInstancer "a" {
            double3 xformOp:translate:pivot = (1, 1, 0)
            double xformOp:rotateZ = 90
            uniform token[] xformOpOrder = ["xformOp:translate:pivot", "xformOp:rotateZ",
                "!invert!xformOp:translate:pivot"]
            int64[] ids = [9, 8, 7]
            int64[] invisibleIds = [8, 100]
            rel prototypes = [</w/outer/a/c>, </other>]
            int[] protoIndices = [0, 0, 1]
            point3f[] positions = [(0, 5, 0), (4, 5, 0), (8, 5, 0)]
            def Xform "c" {
                double3 xformOp:scale = (2, 1, 1)
                uniform token[] xformOpOrder = ["xformOp:scale"]
                def Cube "k" {
                    double3 xformOp:translate = (0, 0, 1)
                    uniform token[] xformOpOrder = ["xformOp:translate"]
                }
            }
        }
        def Cube "b" {
        }
    }
}
def Cone "other" {
    double3 xformOp:translate = (-5, 0, 0)
    uniform token[] xformOpOrder = ["xformOp:translate"]
}
""",
    "instanceable below variants": """
class Xform "_a" {
    def Cube "body" {
    }
}
class Xform "_b" {
    def Cone "body" {
        double height = 4
    }
}
def Xform "x" (
    variants = { string kind = "b" }
    prepend variantSets = "kind"
) {
    variantSet "kind" = {
        "a" {
            def Xform "inst" (instanceable = true
                inherits = </_a>) {
            }
        }
        "b" {
            def Xform "inst" (instanceable = true
                inherits = </_b>) {
                double3 xformOp:translate = (4, 0, 0)
                uniform token[] xformOpOrder = ["xformOp:translate"]
            }
            def Xform "second" (instanceable = true
                inherits = [</_b>, </_a>]) {
                double3 xformOp:translate = (9, 0, 0)
                uniform token[] xformOpOrder = ["xformOp:translate"]
            }
        }
    }
}
""",
    "purposes inside instances": """
class Xform "_a" {
    def Cube "guide" {
        uniform token purpose = "guide"
    }
    def Xform "render" {
        uniform token purpose = "render"
        def Sphere "s" {
            double3 xformOp:translate = (0, 3, 0)
            uniform token[] xformOpOrder = ["xformOp:translate"]
        }
        def Sphere "proxy" {
            uniform token purpose = "proxy"
            double3 xformOp:translate = (0, 6, 0)
            uniform token[] xformOpOrder = ["xformOp:translate"]
        }
    }
    def Cone "plain" {
        double3 xformOp:translate = (0, 9, 0)
        uniform token[] xformOpOrder = ["xformOp:translate"]
    }
}
def Xform "one" (instanceable = true
    inherits = </_a>) {
}
def Xform "two" (instanceable = true
    inherits = </_a>) {
    uniform token purpose = "proxy"
    double3 xformOp:translate = (5, 0, 0)
    uniform token[] xformOpOrder = ["xformOp:translate"]
}
def Xform "three" (instanceable = true
    inherits = </_a>) {
    token visibility.timeSamples = { 0: "inherited", 6: "invisible", 9: "inherited" }
    double3 xformOp:translate = (10, 0, 0)
    uniform token[] xformOpOrder = ["xformOp:translate"]
}
""",
    "resets inside instances": """
class Xform "_a" {
    double3 xformOp:translate = (1, 1, 1)
    uniform token[] xformOpOrder = ["xformOp:translate"]
    def Xform "x" {
        double3 xformOp:translate = (100, 0, 0)
        uniform token[] xformOpOrder = ["xformOp:translate"]
        def Cube "far" {
            double3 xformOp:translate = (0, 7, 0)
            uniform token[] xformOpOrder = ["!resetXformStack!", "xformOp:translate"]
        }
    }
    def Sphere "near" {
    }
}
def Xform "one" (instanceable = true
    inherits = </_a>) {
    double3 xformOp:translate = (20, 0, 0)
    uniform token[] xformOpOrder = ["!resetXformStack!", "xformOp:translate"]
}
def Xform "two" (instanceable = true
    inherits = </_a>) {
}
""",
    "instances of instances, with arcs that differ": """
class Xform "_leaf" {
    def Cube "c" {
    }
}
class Xform "_branch" (
    variants = { string n = "one" }
    prepend variantSets = "n"
) {
    variantSet "n" = {
        "one" {
            def Xform "l0" (instanceable = true
                inherits = </_leaf>) {
            }
        }
        "two" {
            def Xform "l0" (instanceable = true
                inherits = </_leaf>) {
                double3 xformOp:translate = (0, 0, 5)
                uniform token[] xformOpOrder = ["xformOp:translate"]
            }
            def Xform "l1" (instanceable = true
                specializes = </_leaf>) {
            }
        }
    }
}
def Xform "t0" (instanceable = true
    inherits = </_branch>) {
}
def Xform "t1" (instanceable = true
    variants = { string n = "two" }
    inherits = </_branch>) {
    double3 xformOp:translate = (8, 0, 0)
    double3 xformOp:scale = (1, 1, -2)
    uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:scale"]
}
def Xform "t2" (instanceable = false
    inherits = </_branch>) {
    double3 xformOp:translate = (16, 0, 0)
    uniform token[] xformOpOrder = ["xformOp:translate"]
}
""",
    "a matrix in time above an instancer in time": """
def Xform "x" {
    matrix4d xformOp:transform.timeSamples = {
        0: ((1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 1, 0), (0, 0, 0, 1)),
        10: ((0, 1, 0, 0), (-1, 0, 0, 0), (0, 0, 2, 0), (5, 0, 0, 1)),
    }
    uniform token[] xformOpOrder = ["xformOp:transform"]
    def PointInstancer "p" {
        rel prototypes = [</x/p/a>]
        int[] protoIndices.timeSamples = { 0: [0, 0], 6: [0, 0, 0] }
        point3f[] positions.timeSamples = { 0: [(0, 0, 0), (5, 0, 0)],
            6: [(0, 1, 0), (5, 1, 0), (10, 1, 0)] }
        float3[] scales.timeSamples = { 0: [(1, 1, 1), (2, 1, 1)],
            6: [(1, 1, 1), (1, 1, 1), (1, 2, 1)] }
        int64[] invisibleIds.timeSamples = { 0: [1], 6: [] }
        def Cube "a" {
        }
    }
}
""",
    "a mirrored instancer of native instances": """
class Xform "_a" {
    def Cone "c" {
        double3 xformOp:translate = (0, 0, 2)
        uniform token[] xformOpOrder = ["xformOp:translate"]
    }
}
def PointInstancer "p" {
    double3 xformOp:scale = (-1, 1, 1)
    uniform token[] xformOpOrder = ["xformOp:scale"]
    rel prototypes = </p/i>
    int[] protoIndices = [0, 0]
    point3f[] positions = [(0, 0, 0), (5, 0, 0)]
    float3[] scales = [(1, 1, -1), (1, -2, 1)]
    quath[] orientations = [(0.5, 0.5, 0.5, 0.5), (1, 0, 0, 0)]
    def Xform "i" (instanceable = true
        inherits = </_a>) {
        double xformOp:rotateX = 30
        uniform token[] xformOpOrder = ["xformOp:rotateX"]
    }
}
""",
}


@pytest.mark.parametrize("name", STAGES)
def test_studio_instances_are_what_usd_core_says(name: str, tmp_path: Path) -> None:
    path = tmp_path / "stage.usda"
    path.write_text("#usda 1.0\n" + STAGES[name])
    for time in (None, 1.0, 2.5, 7.0):
        stage_agrees(path, time=time, count=150, least=0.01)
