"""Our own schema: exact solids in stages, and bevels on USD's own."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from compiler.compilation import compile_text
from compiler.usd.schema import FALLBACKS, FOLDER, KINDS, SOLIDS, type_name
from dsl.scene import SHAPE_PARAMETERS, Group, Shape, ShapeKind

Load = Callable[..., Any]

LANGUAGE = {
    "OvoloBox": ("box(min: (-1, 0, -2), max: (1, 1, 3), bevel: 0.25)",
                 "double3 min = (-1, 0, -2)\ndouble3 max = (1, 1, 3)\ndouble bevel = 0.25"),
    "OvoloCylinder": ("cylinder(radius: 2, y: 0..3, bevel: 0.5)",
                      "double radius = 2\ndouble2 y = (0, 3)\ndouble bevel = 0.5"),
    "OvoloCone": ("cone(radius: 3, height: 4, bevel: 0.1)",
                  "double radius = 3\ndouble height = 4\ndouble bevel = 0.1"),
    "OvoloTorus": ("torus(major: 2, minor: 0.5)", "double major = 2\ndouble minor = 0.5"),
    "OvoloDisc": ("disc(radius: 3)", "double radius = 3"),
    "OvoloPlane": ("plane()", ""),
    "OvoloTriangle": ("triangle(a: (1, 0, 0), b: (0, 2, 0), c: (0, 0, 3))",
                      "double3 a = (1, 0, 0)\ndouble3 b = (0, 2, 0)\ndouble3 c = (0, 0, 3)"),
    "OvoloRing": ("ring(r: 1..2, y: 0..1, bevel: 0.1)",
                  "double2 r = (1, 2)\ndouble2 y = (0, 1)\ndouble bevel = 0.1"),
    "OvoloWedge": ("wedge(r: 1..2, y: 0..1, phi: -30deg..60deg, bevel: 0.1)",
                   "double2 r = (1, 2)\ndouble2 y = (0, 1)\ndouble2 phi = (-30, 60)\n"
                   "double bevel = 0.1"),
}  # fmt: skip


def shape_of(program: str) -> Shape:
    """The shape that a program of one call makes."""
    node = compile_text(program).graph.root
    while isinstance(node, Group):
        (node,) = node.items
    assert isinstance(node, Shape)
    return node


@pytest.mark.parametrize("kind", LANGUAGE)
def test_typed_prims_are_what_the_language_makes(load: Load, kind: str) -> None:
    program, attributes = LANGUAGE[kind]
    imported = load(f'def {kind} "s" {{\n{attributes}\n}}\n')
    assert imported.diagnostics == []
    (leaf,) = imported.leaves
    shape = shape_of(program)
    assert (leaf.node.kind, leaf.node.parameters) == (shape.kind, shape.parameters)
    np.testing.assert_array_equal(leaf.world, np.eye(4))


def test_every_typed_prim_has_the_parameters_of_the_language() -> None:
    assert set(LANGUAGE) == set(KINDS)
    for kind, parameters in SOLIDS.items():
        count = sum(len(parameter.default) for parameter in parameters)
        assert count == len(SHAPE_PARAMETERS[kind])


def test_typed_prims_without_a_word_exist(load: Load) -> None:
    imported = load("".join(f'def {kind} "{kind}" {{\n}}\n' for kind in KINDS))
    assert imported.diagnostics == []
    assert {leaf.node.kind for leaf in imported.leaves} == set(SOLIDS)


@pytest.mark.parametrize(
    ("kind", "attributes", "expected"),
    [
        ("Cube", "double size = 2", (-1, -1, -1, 1, 1, 1, 0.25)),
        ("Cylinder", "double radius = 2\ndouble height = 3", (2, -1.5, 1.5, 0.25)),
        ("Cone", "double radius = 3\ndouble height = 4", (3, 4, 0.25)),
    ],
)
def test_an_applied_schema_bevels_the_solids_of_usd(
    load: Load, kind: str, attributes: str, expected: tuple[float, ...]
) -> None:
    imported = load(
        f'def {kind} "s" (prepend apiSchemas = ["OvoloBevelAPI"]) {{\n{attributes}\n'
        "double ovolo:bevel = 0.25\n}\n"
    )
    assert imported.diagnostics == []
    assert imported.leaf("/s").node.parameters == expected


@pytest.mark.parametrize(
    ("text", "code", "words"),
    [
        ('def OvoloRing "s" {\ndouble2 r = (1, 2)\ndouble bevel = 0.6\n}',
         "value-bevel", "2·bevel = 1.2 exceeds r1 − r0 = 1"),
        ('def Cube "s" (prepend apiSchemas = ["OvoloBevelAPI"]) {\ndouble ovolo:bevel = 1.5\n}',
         "value-bevel", "2·bevel = 3 exceeds x1 − x0 = 2"),
        ('def OvoloWedge "s" {\ndouble2 phi = (90, 0)\n}',
         "value-order", "phi0 = 90° is not below"),
        ('def OvoloDisc "s" {\ndouble radius = nan\n}', "value-not-finite", "radius = nan"),
    ],
)  # fmt: skip
def test_limits_are_those_of_the_language(load: Load, text: str, code: str, words: str) -> None:
    imported = load(text)
    (fault,) = imported.diagnostics
    assert (fault.code, fault.severity) == (code, "error")
    assert words in fault.message
    assert fault.primary.place.prim == "/s"


def test_a_bevel_where_none_can_be_is_reported(load: Load) -> None:
    imported = load(
        'def Sphere "s" (prepend apiSchemas = ["OvoloBevelAPI"]) {\ndouble ovolo:bevel = 0.1\n}\n'
    )
    assert imported.said("`ovolo:bevel` of `Sphere`").primary.place.prim == "/s"


def test_exact_transforms_hold_until_positions_are_edited(load: Load) -> None:
    stage = """
def PointInstancer "p" (prepend apiSchemas = ["OvoloInstancerAPI"]) {
    rel prototypes = </p/ball>
    int[] protoIndices = [0]
    point3f[] positions = [(%s, 0, 0)]
    matrix4d[] ovolo:transforms = [((1,0,0,0), (0,2,0,0), (0,0,1,0), (0.1,0,0,1))]
    def Sphere "ball" {
    }
}
"""
    exact = load(stage % "0.1")
    np.testing.assert_array_equal(exact.leaves[0].world[:3, 3], (0.1, 0, 0))
    assert exact.leaves[0].world[1, 1] == 2
    edited = load(stage % "5")
    np.testing.assert_array_equal(edited.leaves[0].world[:3, 3], (5, 0, 0))
    assert edited.said("no longer are the `positions`").primary.place.prim == "/p"


def test_exact_points_hold_until_points_are_edited(load: Load) -> None:
    stage = """
def Mesh "m" (prepend apiSchemas = ["OvoloMeshAPI"]) {
    uniform token subdivisionScheme = "none"
    int[] faceVertexCounts = [3]
    int[] faceVertexIndices = [0, 1, 2]
    point3f[] points = [(0, 0, 0), (1, 0, 0), (0, %s, 0)]
    double3[] ovolo:points = [(0, 0, 0), (1, 0, 0), (0, 0.1, 0)]
}
"""
    assert load(stage % "0.1").leaves[0].node.points[2, 1] == 0.1
    edited = load(stage % "3")
    assert edited.leaves[0].node.points[2, 1] == 3
    assert edited.said("no longer are the `points`").primary.place.prim == "/m"


JUDGE = """
import json, sys
from pxr import Usd, UsdGeom
stage = Usd.Stage.CreateInMemory()
prim = stage.DefinePrim("/w", "OvoloWedge")
print(json.dumps([prim.IsA(UsdGeom.Mesh), sorted(prim.GetPropertyNames())]))
"""


def test_other_programs_find_the_schema_by_its_folder() -> None:
    environment = {**os.environ, "PXR_PLUGINPATH_NAME": str(FOLDER)}
    answer = subprocess.run(
        [sys.executable, "-c", JUDGE], env=environment, capture_output=True, text=True, check=True
    )
    is_mesh, names = json.loads(answer.stdout)
    assert is_mesh
    assert {"r", "y", "phi", "bevel", "points", "visibility", "xformOpOrder"} <= set(names)


LATE = """
import sys
from pxr import Usd
Usd.Stage.CreateInMemory()  # from here on usd-core takes no more schemas
from compiler.usd import import_stage
graph, faults = import_stage(sys.argv[1])
assert not faults, faults
"""


def test_a_process_that_opened_stages_before_reads_typed_prims_too(tmp_path: Path) -> None:
    stage = tmp_path / "late.usda"
    fallbacks = "".join(f'token[] {name} = ["{word}"]\n' for name, (word,) in FALLBACKS.items())
    prims = "".join(f'def {name} "{name}" {{\n}}\n' for name in KINDS)
    stage.write_text(f"#usda 1.0\n(fallbackPrimTypes = {{\n{fallbacks}}})\n{prims}")
    root = Path(__file__).parents[3]
    subprocess.run([sys.executable, "-c", LATE, str(stage)], cwd=root, check=True)


def test_type_names_are_those_of_the_language() -> None:
    assert type_name(ShapeKind.WEDGE) == "OvoloWedge"
