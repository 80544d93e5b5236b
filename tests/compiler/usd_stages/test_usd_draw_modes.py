"""Draw modes: what is shown of a model instead of its prims, seen by rays."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from compiler.provenance import object_path
from runtime.tracer import Tracer
from tests.compiler.usd_stages.ray_agreement import compiled

SET = """#usda 1.0
def Xform "set" (kind = "assembly"
    apiSchemas = ["GeomModelAPI"]
) {
    uniform token model:drawMode = "bounds"
    def Xform "car" (kind = "component"
        apiSchemas = ["GeomModelAPI"]
    ) {
        double3 xformOp:translate = (5, 0, 0)
        uniform token[] xformOpOrder = ["xformOp:translate"]
        %s
        def Sphere "wheel" {
            double radius = 2
        }
    }
    def Xform "crowd" (kind = "group"
        apiSchemas = ["GeomModelAPI"]
    ) {
        def Sphere "head" {
        }
    }
}
def Xform "plain" (apiSchemas = ["GeomModelAPI"]) {
    uniform token model:drawMode = "origin"
    def Sphere "ball" {
        double3 xformOp:translate = (0, 9, 0)
        uniform token[] xformOpOrder = ["xformOp:translate"]
    }
}
"""


def seen(path: Path, lines: str) -> tuple[list[str], Any, list[str]]:
    """Paths and distances of what three rays along -z hit, and what the report says."""
    path.write_text(SET % lines)
    ir, diagnostics = compiled(path)
    origins = np.array([(6.9, 1.9, 10.0), (0.0, 0.0, 10.0), (0.0, 9.0, 10.0)])
    hits = Tracer(ir, precision="float64").trace(origins, np.tile((0.0, 0.0, -1.0), (3, 1)))
    paths = [
        object_path(ir, int(i)) if hit else ""
        for i, hit in zip(hits.instance, hits.hit, strict=True)
    ]
    return paths, hits.t, [d.message for d in diagnostics]


@pytest.mark.parametrize(
    ("lines", "path", "distance", "said"),
    [
        # The mode is inherited, and holds for components: groups must apply it.
        ("", "/set/car", 8.0, ["the draw mode `bounds` is drawn as a box"]),
        (
            "float3[] extentsHint = [(-3, -3, -3), (3, 3, 3)]",
            "/set/car", 7.0, ["the draw mode `bounds` is drawn as a box"],
        ),
        (
            'uniform token model:drawMode = "cards"',
            "/set/car", 10.0, ["the draw mode `cards` is drawn as crossed rectangles"],
        ),
        (
            'uniform token model:drawMode = "cards"\nuniform token model:cardGeometry = "box"',
            "/set/car", 8.0, ["the draw mode `cards` is drawn as a box"],
        ),
        (
            'uniform token model:drawMode = "origin"',
            "", np.inf, ["the draw mode `origin` draws nothing"],
        ),
        ('uniform token model:drawMode = "default"', "", np.inf, []),
    ],
)  # fmt: skip
def test_models_are_shown_as_their_draw_modes_say(
    tmp_path: Path, lines: str, path: str, distance: float, said: list[str]
) -> None:
    paths, t, messages = seen(tmp_path / "stage.usda", lines)
    assert paths == [path, "/set/crowd/head", "/plain/ball"]
    np.testing.assert_allclose(t, [distance, 9.0, 9.0], rtol=1e-12)
    assert messages == said


def test_stand_ins_have_their_colour_and_hide_with_their_model(load: Callable[..., Any]) -> None:
    imported = load("""
def Xform "a" (kind = "component"
    apiSchemas = ["GeomModelAPI"]
) {
    uniform token model:drawMode = "bounds"
    color3f model:drawModeColor = (1, 0.5, 0)
    def Sphere "s" {
    }
}
def Xform "b" (kind = "component"
    apiSchemas = ["GeomModelAPI"]
) {
    uniform token model:drawMode = "bounds"
    token visibility = "invisible"
    def Sphere "s" {
    }
}
def Xform "empty" (kind = "component"
    apiSchemas = ["GeomModelAPI"]
) {
    uniform token model:drawMode = "bounds"
}
""")
    assert imported.paths() == ["/a"]
    assert imported.leaf("/a").material.diffuse == (1.0, 0.5, 0.0)
    assert imported.said("without bounds").primary.place.prim == "/empty"


def test_components_in_instances_take_the_mode_above_each(load: Callable[..., Any]) -> None:
    """Which holds for models only: those all of whose parents are groups."""
    above = {
        "default": "",
        "bounds": 'uniform token model:drawMode = "bounds"',
        "cards": 'uniform token model:drawMode = "cards"',
    }
    stage = """
class Xform "_asset" (kind = "group") {
    def Xform "part" (kind = "component"
        apiSchemas = ["GeomModelAPI"]
    ) {
        def Sphere "s" {
        }
    }
}
"""
    for kind in ("group", ""):
        for name, line in above.items():
            stage += f"""
def Xform "{name}{kind}" (kind = "{kind}"
    apiSchemas = ["GeomModelAPI"]
) {{
    {line}
    def Xform "i" (kind = "group"
        instanceable = true
        inherits = </_asset>
    ) {{
    }}
}}
"""
    assert load(stage).paths() == [
        "/defaultgroup/i/part/s",
        "/boundsgroup/i/part",
        "/cardsgroup/i/part",
        "/default/i/part/s",
        "/bounds/i/part/s",
        "/cards/i/part/s",
    ]
