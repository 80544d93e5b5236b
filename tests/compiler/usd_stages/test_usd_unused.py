"""Nothing is dropped in silence: one stage of every type and attribute that usd-core knows."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

SHAPES = {"Capsule", "Capsule_1", "Cone", "Cube", "Cylinder", "Cylinder_1", "Plane", "Sphere"}
LIGHTS = {"DistantLight", "SphereLight", "DomeLight", "DomeLight_1"}
DRAWN = {
    *SHAPES,
    *LIGHTS,
    "Mesh",
    "SkelAnimation",
    "BasisCurves",
    "Points",
    "PointInstancer",
    "Camera",
}
PLACES = {
    "Skeleton",
    "Xform",
    "Scope",
    "SkelRoot",
    "Material",
    "Shader",
    "NodeGraph",
    "GeomSubset",
    "Backdrop",
}
"""Types that are there for others, and show nothing themselves."""

OF_ALL = {
    "visibility", "purpose", "proxyPrim", "extent", "doubleSided", "orientation", "xformOpOrder",
    "primvars:displayColor", "primvars:displayOpacity",
}  # fmt: skip
LIGHTING = {
    "inputs:color", "inputs:colorTemperature", "inputs:enableColorTemperature", "inputs:exposure",
    "inputs:intensity", "inputs:normalize", "light:shaderId",
}  # fmt: skip
DRAWN_FROM = {
    "Camera": {
        "clippingRange", "focalLength", "focusDistance", "horizontalAperture",
        "horizontalApertureOffset", "projection", "verticalAperture", "verticalApertureOffset",
    },
    "Mesh": {
        "cornerIndices", "cornerSharpnesses", "creaseIndices", "creaseLengths", "holeIndices",
        "creaseSharpnesses", "faceVertexCounts", "faceVertexIndices", "interpolateBoundary",
        "points", "subdivisionScheme", "triangleSubdivisionRule",
    },
    "PointInstancer": {
        "ids", "invisibleIds", "orientations", "orientationsf", "positions", "protoIndices",
        "prototypes", "scales",
    },
    "SkelAnimation": {"joints", "rotations", "scales", "translations"},
    "BasisCurves": {"basis", "curveVertexCounts", "points", "type", "widths", "wrap"},
    "Points": {"ids", "points", "widths"},
    "DistantLight": {*LIGHTING, "inputs:angle"},
    "SphereLight": {*LIGHTING, "inputs:radius", "treatAsPoint"},
    "DomeLight": {*LIGHTING, "guideRadius"},
    "DomeLight_1": {*LIGHTING, "guideRadius"},
}  # fmt: skip
SOUND = {
    "points": [(0, 0, 0), (1, 0, 0), (0, 1, 0)],
    "faceVertexCounts": [3],
    "faceVertexIndices": [0, 1, 2],
    "subdivisionScheme": "none",
    "clippingRange": (1, 10),
}


def other(attribute: Any, name: str) -> Any:
    """A value that is not the fallback."""
    if name in SOUND:
        return SOUND[name]
    value_type = attribute.GetTypeName()
    value = attribute.Get() if attribute.Get() is not None else value_type.defaultValue
    if value_type.isArray:
        return [value_type.scalarType.defaultValue]
    if isinstance(value, bool):
        return not value
    if isinstance(value, (int, float)):
        return value + 1
    if isinstance(value, str):
        return "X" if name == "axis" else "other"
    if value_type.scalarType.type.typeName == "SdfAssetPath":
        return "other.exr"
    return type(value)(*[1] * len(value)) if hasattr(value, "__len__") else value


def everything(path: Path) -> dict[str, set[str]]:
    """A stage with a prim of every type, and on each whatever its schema has; by type."""
    from pxr import Tf, Usd

    stage = Usd.Stage.CreateNew(str(path))
    registry = Usd.SchemaRegistry()
    authored: dict[str, set[str]] = {}
    for schema in sorted(Tf.Type(Usd.Typed).GetAllDerivedTypes(), key=str):
        kind = registry.GetConcreteSchemaTypeName(schema)
        if not kind:
            continue
        prim = stage.DefinePrim(f"/{kind}", kind)
        names = set()
        for name in registry.FindConcretePrimDefinition(kind).GetPropertyNames():
            if name in OF_ALL or name.startswith(("collection:", "physics:")):
                continue
            attribute = prim.GetAttribute(name)
            if attribute:
                attribute.Set(other(attribute, name))
            else:
                prim.GetRelationship(name).SetTargets(["/Sphere"])
            names.add(name)
        authored[kind] = names
    stage.Save()
    return authored


def test_every_type_and_attribute_is_drawn_or_reported(
    load: Callable[..., Any], tmp_path: Path
) -> None:
    path = tmp_path / "everything.usda"
    authored = everything(path)
    assert len(authored) > 50
    imported = load(path)
    said: dict[str, str] = {}
    for diagnostic in imported.diagnostics:
        for label in (diagnostic.primary, *diagnostic.secondary):
            said[label.place.prim] = said.get(label.place.prim, "") + diagnostic.message + "\n"
    silent = []
    for kind, names in authored.items():
        words = said.get(f"/{kind}", "")
        if kind not in DRAWN | PLACES:
            if f"`{kind}`" not in words:
                silent.append(kind)
            continue
        for name in names:
            read = kind in SHAPES or name in DRAWN_FROM.get(kind, ())
            if kind not in PLACES and not read and name not in words:
                silent.append(f"{kind}.{name}")
    assert silent == []
    assert {"Capsule_1", "Cylinder_1"} & {p[1:] for p in imported.paths()} or said["/Capsule_1"]


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("normal3f[] normals = [(0, 0, 1)]", "`normals` of `Mesh` prims"),
        ("vector3f[] velocities = [(0, 0, 1)]", "`velocities` of `Mesh` prims"),
        ("texCoord2f[] primvars:st = [(0, 1)]", "primvar `st`"),
        ("normal3f[] primvars:normals = [(0, 0, 1)]", "primvar `normals`"),
    ],
)
def test_equal_attributes_of_many_prims_are_one_line(
    load: Callable[..., Any], line: str, words: str
) -> None:
    mesh = f"""{{
    point3f[] points = [(0, 0, 0), (1, 0, 0), (0, 1, 0)]
    int[] faceVertexCounts = [3]
    int[] faceVertexIndices = [0, 1, 2]
    uniform token subdivisionScheme = "none"
    {line}
}}
"""
    imported = load(f'def Mesh "a" {mesh}def Mesh "b" {mesh}')
    (found,) = imported.diagnostics
    assert (found.code, found.message) == ("usd-unused", f"{words} is not used (2 prims)")


def test_what_says_nothing_is_not_reported(load: Callable[..., Any]) -> None:
    imported = load("""
def Mesh "smooth" {
    point3f[] points = [(0, 0, 0), (1, 0, 0), (0, 1, 0)]
    int[] faceVertexCounts = [3]
    int[] faceVertexIndices = [0, 1, 2]
    normal3f[] normals = [(0, 0, 1)]
    vector3f[] velocities = []
    uniform bool doubleSided = 1
    custom float studio:note = 3
    float3[] extent = [(0, 0, 0), (1, 1, 0)]
}
def Camera "camera" {
    double shutter:open = 0
    token stereoRole = "mono"
}
def Xform "hidden" {
    token visibility = "invisible"
    def Mesh "ghost" {
        texCoord2f[] primvars:st = [(0, 0)]
    }
}
""")
    assert imported.diagnostics == []
