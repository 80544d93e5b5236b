"""What is drawn at all, when, and what is said about the rest."""

from __future__ import annotations

import math
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from dsl.scene import Settings


def test_importing_the_package_does_not_import_usd_core() -> None:
    check = "import compiler.usd, sys; sys.exit(any(m.startswith('pxr') for m in sys.modules))"
    assert subprocess.run([sys.executable, "-c", check], check=False).returncode == 0


def test_invisible_prunes_and_the_nearest_purpose_wins(load: Callable[..., Any]) -> None:
    text = """
def Xform "hidden" {
    token visibility = "invisible"
    def Cube "c" {
        token visibility = "inherited"
    }
}
def Scope "guide" {
    uniform token purpose = "guide"
    def Cube "guide" {
    }
    def Cube "render" {
        uniform token purpose = "render"
    }
}
def Cube "proxy" {
    uniform token purpose = "proxy"
}
def Cube "other" {
    uniform token purpose = "other"
}
def Cube "inactive" (active = false) {
}
class Cube "class" {
}
over "over" {
    def Cube "c" {
    }
}
def Cube "plain" {
    def Sphere "below" {
    }
}
"""
    imported = load(text)
    assert imported.paths() == ["/guide/render", "/plain", "/plain/below"]
    assert imported.said("unknown purpose `other`").primary.place.prim == "/other"
    shown = load(text, purposes=frozenset({"default", "proxy"}))
    assert shown.paths() == ["/proxy", "/plain", "/plain/below"]


def test_purpose_and_visibility_reach_into_instances(load: Callable[..., Any]) -> None:
    imported = load("""
class Xform "_x" {
    def Cube "c" {
    }
}
def Xform "shown" (instanceable = true
    inherits = </_x>
) {
}
def Xform "hidden" (instanceable = true
    inherits = </_x>
) {
    token visibility = "invisible"
}
def Xform "proxy" (instanceable = true
    inherits = </_x>
) {
    uniform token purpose = "proxy"
}
""")
    assert imported.paths() == ["/shown/c"]


MOVING = """
(
    timeCodesPerSecond = 24
)
def Cube "sampled" {
    double3 xformOp:translate.timeSamples = { 10: (1, 0, 0), 20: (2, 0, 0) }
    uniform token[] xformOpOrder = ["xformOp:translate"]
}
def Cube "both" {
    double3 xformOp:translate = (5, 0, 0)
    double3 xformOp:translate.timeSamples = { 10: (1, 0, 0), 20: (2, 0, 0) }
    uniform token[] xformOpOrder = ["xformOp:translate"]
}
"""


@pytest.mark.parametrize(
    ("time", "expected"),
    [(None, [1, 5]), ("earliest", [1, 1]), (15, [1.5, 1.5]), (0, [1, 1]), (99.0, [2, 2])],
)
def test_time_codes(load: Callable[..., Any], time: Any, expected: list[float]) -> None:
    imported = load(MOVING, time=time)
    assert [leaf.world[0, 3] for leaf in imported.leaves] == expected


@pytest.mark.parametrize("rate", ["0", "-24"])
@pytest.mark.parametrize("where", ["root", "sublayer"])
def test_rates_on_which_usd_core_hangs_are_refused(
    load: Callable[..., Any], tmp_path: Path, rate: str, where: str
) -> None:
    (tmp_path / "sub.usda").write_text(
        f"#usda 1.0\n(\ntimeCodesPerSecond = {rate if where == 'sublayer' else 48}\n)\n"
        + MOVING[MOVING.index("def") :]
    )
    root = f"(\ntimeCodesPerSecond = {rate if where == 'root' else 24}\nsubLayers = [@sub.usda@]\n)"
    imported = load(root)
    assert imported.leaves == []
    assert [(d.code, d.severity) for d in imported.diagnostics] == [("usd-time", "error")]


def test_a_time_that_is_not_finite_is_refused(load: Callable[..., Any]) -> None:
    assert load(MOVING, time=math.nan).codes() == ["usd-time"]


@pytest.mark.parametrize("text", ["def Cube {", "(\nframesPerSecond = \n)", "\0\0"])
def test_what_cannot_be_read_is_an_error(load: Callable[..., Any], text: str) -> None:
    imported = load(text)
    assert [(d.code, d.severity) for d in imported.diagnostics] == [("usd-open", "error")]
    assert "\n" not in imported.diagnostics[0].message


def test_a_missing_file_is_an_error(load: Callable[..., Any], tmp_path: Path) -> None:
    assert load(tmp_path / "none.usda").codes() == ["usd-open"]


def test_composition_faults_are_reported_and_not_printed(
    load: Callable[..., Any], capfd: pytest.CaptureFixture[str]
) -> None:
    imported = load("""
def Xform "missing" (references = @none.usda@) {
    def Cube "c" {
    }
}
def Xform "cycle" (references = </cycle>) {
}
def Xform "payload" (payload = @none.abc@) {
}
""")
    assert imported.paths() == ["/missing/c"]
    places = {d.primary.place.prim for d in imported.diagnostics}
    assert places == {"/missing", "/cycle", "/payload"}
    assert all(d.code == "usd-composition" for d in imported.diagnostics)
    assert not any("0x" in d.message or "\n" in d.message for d in imported.diagnostics)
    assert capfd.readouterr() == ("", "")


def test_one_prim_keeps_its_place_and_what_it_inherits(load: Callable[..., Any]) -> None:
    text = """
def Xform "world" {
    double3 xformOp:translate = (0, 7, 0)
    uniform token[] xformOpOrder = ["xformOp:translate"]
    color3f[] primvars:displayColor = [(1, 0, 0)]
    def Xform "chair" {
        def Cube "seat" {
        }
    }
    def Xform "table" {
        def Cube "top" {
        }
    }
    def Xform "hidden" {
        token visibility = "invisible"
        def Cube "c" {
        }
    }
}
"""
    (leaf,) = load(text, prim="/world/chair").leaves
    assert leaf.path == "/world/chair/seat"
    assert leaf.world[1, 3] == 7.0
    assert leaf.material.diffuse == (1.0, 0.0, 0.0)
    assert load(text, prim="/world/hidden/c").leaves == []
    (fault,) = load(text, prim="/world/chiar").diagnostics
    assert (fault.code, fault.help) == ("usd-prim", "did you mean `/world/chair`?")
    assert load(text, prim="not a path").codes() == ["usd-prim"]


def test_a_prim_within_an_instance_can_be_chosen(load: Callable[..., Any]) -> None:
    (leaf,) = load("""
class Xform "_x" {
    def Cube "c" {
    }
    def Cube "d" {
    }
}
def Xform "i" (instanceable = true
    inherits = </_x>
) {
    double3 xformOp:translate = (0, 7, 0)
    uniform token[] xformOpOrder = ["xformOp:translate"]
}
""", prim="/i/c").leaves  # fmt: skip
    assert (leaf.path, leaf.world[1, 3]) == ("/i/c", 7.0)


def test_the_up_axis_is_said_and_moves_nothing(load: Callable[..., Any]) -> None:
    imported = load('(\nupAxis = "Z"\nmetersPerUnit = 0.01\n)\ndef Cube "c" {\n}')
    (settings,) = [node for _, node in imported.others if isinstance(node, Settings)]
    assert settings.up == "z"
    assert (imported.leaves[0].world == np.eye(4)).all()
    assert load('(\nupAxis = "Y"\n)\ndef Cube "c" {\n}').others == []


def test_unknown_types_are_read_as_what_their_stage_falls_back_to(
    load: Callable[..., Any],
) -> None:
    imported = load("""
(
    fallbackPrimTypes = {
        token[] OtherBall = ["OtherSolid", "Sphere"]
    }
)
def OtherBall "b" {
    double radius = 2
}
""")
    assert imported.diagnostics == []
    assert imported.leaf("/b").node.parameters == (2.0,)


def test_unsupported_prims_are_reported_with_their_paths(load: Callable[..., Any]) -> None:
    imported = load("""
def ParticleField3DGaussianSplat "hair" {
}
def Volume "dust" {
}
def Volume "sand" {
}
def Teapot "pot" {
    def Cube "lid" {
    }
}
def PortalLight "window" {
}
def SkelRoot "body" {
    def Cube "head" {
    }
}
def ParticleField3DGaussianSplat "hidden" {
    token visibility = "invisible"
}
""")
    assert imported.paths() == ["/pot/lid", "/body/head"]
    said = {
        d.message: [label.place.prim for label in (d.primary, *d.secondary)]
        for d in imported.diagnostics
    }
    assert said == {
        "`ParticleField3DGaussianSplat` prims are not drawn": ["/hair"],
        "`Volume` prims are not drawn (2 prims)": ["/dust", "/sand"],
        "prims of the unknown type `Teapot` are not drawn, only those below": ["/pot"],
        "`PortalLight` lights are not handled": ["/window"],
    }


def test_attributes_that_are_not_honoured_are_reported(load: Callable[..., Any]) -> None:
    imported = load("""
def Xform "model" {
    def Cube "c" {
    }
}
def Mesh "skin" {
    point3f[] points = [(0, 0, 0), (1, 0, 0), (0, 1, 0)]
    int[] faceVertexCounts = [3]
    int[] faceVertexIndices = [0, 1, 2]
    uniform token subdivisionScheme = "none"
    int[] primvars:skel:jointIndices = [0, 0, 0] (interpolation = "vertex")
}
def PointInstancer "p" {
    rel prototypes = </model/c>
    int[] protoIndices = [0]
    point3f[] positions = [(0, 0, 0)]
    vector3f[] velocities = [(1, 0, 0)]
}
def DomeLight "dome" {
    asset inputs:texture:file = @sky.exr@
}
def SphereLight "spot" (prepend apiSchemas = ["ShapingAPI"]) {
    asset inputs:shaping:ies:file = @lamp.ies@
}
def Camera "cam" {
    float fStop = 2.8
}
""")
    said = {d.primary.place.prim: d.code for d in imported.diagnostics if d.primary}
    assert said == {
        "/skin": "usd-skinning", "/p": "usd-unused",
        "/dome": "usd-light", "/spot": "usd-unused", "/cam": "usd-camera",
    }  # fmt: skip
    assert imported.paths() == ["/model/c", "/skin", "/model/c@/p[0]"]


def test_instance_roots_may_be_primitives_and_instancers(load: Callable[..., Any]) -> None:
    imported = load("""
class Cube "_c" {
    def Sphere "x" {
    }
}
class PointInstancer "_p" {
    rel prototypes = </_p/a>
    int[] protoIndices = [0, 0]
    point3f[] positions = [(0, 0, 0), (1, 0, 0)]
    def Cube "a" {
    }
}
def Cube "i" (instanceable = true
    inherits = </_c>
) {
}
def PointInstancer "p" (instanceable = true
    inherits = </_p>
) {
}
""")
    assert imported.paths() == ["/i", "/i/x", "/p/a@/p[0]", "/p/a@/p[1]"]


def test_an_empty_stage_is_an_empty_scene(load: Callable[..., Any]) -> None:
    imported = load("")
    assert (imported.leaves, imported.others, imported.diagnostics) == ([], [], [])


@pytest.mark.parametrize(
    "body",
    [
        'def PointInstancer "p" { int[] protoIndices = [0, 3]\npoint3f[] positions = [(0, 0, 0)] }',
        'def Mesh "p" { point3f[] points = [(0, 0, 0)]\nint[] faceVertexCounts = [2]\n'
        "int[] faceVertexIndices = [0, 0] }",
        'def Sphere "p" { uniform token[] xformOpOrder = ["", "a/b"] }',
        'def SphereLight "p" { color3f inputs:color = (inf, nan, 0)\nfloat inputs:intensity = 0 }',
    ],
)
def test_odd_values_end_in_words_and_not_in_exceptions(load: Callable[..., Any], body: str) -> None:
    for complexity in ("low", "limit"):
        found = load(body.replace("{", "{\n").replace("}", "\n}"), complexity=complexity)
        assert all(d.severity != "error" for d in found.diagnostics)
