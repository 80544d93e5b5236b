"""Nothing is dropped in silence: one stage of every type and attribute that usd-core knows."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import pytest

READ_OF_ALL = {
    "visibility", "purpose", "proxyPrim", "extent", "doubleSided", "orientation", "xformOpOrder",
    "primvars:displayColor", "primvars:displayOpacity",
}  # fmt: skip
"""Read of every prim, or of no consequence to what is hit."""

LIGHTING = {
    "inputs:color", "inputs:colorTemperature", "inputs:enableColorTemperature", "inputs:exposure",
    "inputs:intensity", "inputs:normalize", "light:shaderId",
}  # fmt: skip
MESH = {
    "cornerIndices", "cornerSharpnesses", "creaseIndices", "creaseLengths", "holeIndices",
    "creaseSharpnesses", "faceVertexCounts", "faceVertexIndices", "interpolateBoundary",
    "normals", "points", "subdivisionScheme", "triangleSubdivisionRule",
}  # fmt: skip
FALLBACK_MESH = {"faceVertexCounts", "faceVertexIndices", "points", "subdivisionScheme"}
FRAME = {
    "aspectRatioConformPolicy", "camera", "dataWindowNDC", "disableDepthOfField",
    "disableMotionBlur", "instantaneousShutter", "pixelAspectRatio", "resolution",
}  # fmt: skip
READ = {
    "Backdrop": {"ui:description"},
    "BasisCurves": {"basis", "curveVertexCounts", "points", "type", "widths", "wrap"},
    "Camera": {
        "clippingRange", "exposure", "exposure:fStop", "exposure:iso", "exposure:responsivity",
        "exposure:time", "shutter:close", "shutter:open", "focalLength", "focusDistance",
        "horizontalAperture", "horizontalApertureOffset", "projection",
        "verticalAperture", "verticalApertureOffset",
    },
    "Capsule": {"axis", "height", "radius"},
    "Capsule_1": {"axis", "height", "radiusBottom", "radiusTop"},
    "Cone": {"axis", "height", "radius"},
    "Cube": {"size"},
    "CylinderLight": {*LIGHTING, "inputs:length", "inputs:radius", "treatAsLine"},
    "DiskLight": {*LIGHTING, "inputs:radius"},
    "RectLight": {*LIGHTING, "inputs:height", "inputs:width"},
    "BlendShape": {"offsets", "pointIndices"},
    "HermiteCurves": {"curveVertexCounts", "points", "tangents", "widths"},
    "TetMesh": {"points", "surfaceFaceVertexIndices", "tetVertexIndices"},
    "Cylinder": {"axis", "height", "radius"},
    "Cylinder_1": {"axis", "height", "radiusBottom", "radiusTop"},
    "DistantLight": {*LIGHTING, "inputs:angle"},
    "DomeLight": {*LIGHTING, "guideRadius", "inputs:texture:file", "inputs:texture:format"},
    "DomeLight_1": {
        *LIGHTING, "guideRadius", "inputs:texture:file", "inputs:texture:format", "poleAxis",
    },
    "GeomSubset": {"elementType", "familyName", "indices"},
    "Material": {"outputs:surface"},
    "Mesh": MESH,
    "NodeGraph": set(),
    "OvoloBox": {"bevel", "max", "min", *FALLBACK_MESH},
    "OvoloCone": {"bevel", "height", "radius", *FALLBACK_MESH},
    "OvoloCylinder": {"bevel", "radius", "y", *FALLBACK_MESH},
    "OvoloDisc": {"radius", *FALLBACK_MESH},
    "OvoloPlane": FALLBACK_MESH,
    "OvoloRing": {"bevel", "r", "y", *FALLBACK_MESH},
    "OvoloTorus": {"major", "minor", *FALLBACK_MESH},
    "OvoloTriangle": {"a", "b", "c", *FALLBACK_MESH},
    "OvoloWedge": {"bevel", "phi", "r", "y", *FALLBACK_MESH},
    "Plane": {"axis", "length", "width"},
    "PointInstancer": {
        "ids", "invisibleIds", "orientations", "orientationsf", "positions", "protoIndices",
        "prototypes", "scales",
    },
    "Points": {"ids", "points", "widths"},
    "RenderProduct": {*FRAME, "orderedVars", "productName", "productType"},
    "RenderSettings": {*FRAME, "includedPurposes", "products"},
    "Scope": set(),
    "Shader": {"info:id", "info:implementationSource"},
    "SkelAnimation": {
        "blendShapeWeights", "blendShapes", "joints", "rotations", "scales", "translations"},
    "SkelRoot": set(),
    "Skeleton": {"bindTransforms", "jointNames", "joints", "restTransforms"},
    "Sphere": {"radius"},
    "SphereLight": {*LIGHTING, "inputs:radius", "treatAsPoint"},
    "Xform": set(),
}  # fmt: skip
"""What is honoured of each type that is; all else must have a line in the report."""

READ_OF_SCHEMAS = {
    "GeomModelAPI": {
        "model:applyDrawMode", "model:cardGeometry", "model:drawMode", "model:drawModeColor",
    },
    "ShapingAPI": {
        "inputs:shaping:cone:angle", "inputs:shaping:cone:softness", "inputs:shaping:focus",
    },
    "OvoloBevelAPI": {"ovolo:bevel"},
    "OvoloCameraAPI": {"ovolo:clippingRange", "ovolo:freeAspect"},
    "OvoloInstancerAPI": {"ovolo:transforms"},
    "OvoloMeshAPI": {"ovolo:points"},
    "OvoloSettingsAPI": {
        "ovolo:exposure", "ovolo:integrator", "ovolo:occlusionDistance", "ovolo:precision",
        "ovolo:samples",
    },
}  # fmt: skip
HOSTS = {
    "LightAPI": "Mesh", "MeshLightAPI": "Mesh", "VolumeLightAPI": "Volume",
    "ShapingAPI": "SphereLight", "ShadowAPI": "SphereLight", "LightListAPI": "SphereLight",
    "BackPlateAPI": "Camera", "OvoloBevelAPI": "Cube", "OvoloCameraAPI": "Camera",
    "OvoloSettingsAPI": "RenderSettings", "OvoloInstancerAPI": "PointInstancer",
}  # fmt: skip
"""What a schema is applied to, where not to a mesh."""

NO_PICTURE = ("collection:inst", "physics:", "ui:", "drive:", "limit:", "semantics:", "coordSys:")
"""Namespaces that no picture depends on, or that say nothing on their own."""

IN_OTHER_WORDS = {
    "skel:": "skeleton",
    "primvars:skel:": "skeleton",
}
SOUND = {
    "points": [(0, 0, 0), (1, 0, 0), (0, 1, 0)],
    "faceVertexCounts": [3],
    "faceVertexIndices": [0, 1, 2],
    "subdivisionScheme": "none",
    "clippingRange": (1.0, 10.0),
    "model:drawMode": "cards",
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
    if value_type == "matrix4d":
        return type(value)(2)
    return type(value)(*(x + 1 for x in value)) if hasattr(value, "__len__") else value


def author(prim: Any, names: Iterable[str]) -> set[str]:
    """Give a prim values for what it has of these names; returns those it has."""
    done = set()
    for name in names:
        if name in READ_OF_ALL or name.startswith(NO_PICTURE):
            continue
        attribute = prim.GetAttribute(name)
        if attribute and attribute.GetTypeName() == "opaque":
            continue
        if attribute:
            attribute.Set(other(attribute, name))
        else:
            prim.GetRelationship(name).SetTargets(["/Sphere"])
        done.add(name)
    return done


def everything(path: Path) -> dict[str, tuple[str, set[str]]]:
    """A stage with a prim of every type and one for every applied schema, with all they can say.

    Returns, by the name of the prim, its type and what was authored.
    """
    from pxr import Tf, Usd

    stage = Usd.Stage.CreateNew(str(path))
    registry = Usd.SchemaRegistry()
    authored: dict[str, tuple[str, set[str]]] = {}
    for schema in sorted(Tf.Type(Usd.Typed).GetAllDerivedTypes(), key=str):
        kind = registry.GetConcreteSchemaTypeName(schema)
        if kind:
            prim = stage.DefinePrim(f"/{kind}", kind)
            authored[kind] = (kind, author(prim, prim.GetPrimDefinition().GetPropertyNames()))
    for schema in sorted(Tf.Type(Usd.APISchemaBase).GetAllDerivedTypes(), key=str):
        name = registry.GetSchemaTypeName(schema)
        if not name or not registry.IsAppliedAPISchema(schema):
            continue
        host = HOSTS.get(name, "Mesh")
        prim = stage.DefinePrim(f"/{name}", host)
        before = set(prim.GetPrimDefinition().GetPropertyNames())
        author(prim, before & READ.get(host, set()))
        multiple = registry.IsMultipleApplyAPISchema(schema)
        prim.AddAppliedSchema(f"{name}:inst" if multiple else name)
        own = set(prim.GetPrimDefinition().GetPropertyNames()) - before
        authored[name] = (host, author(prim, sorted(own)))
    stage.Save()
    return authored


def test_every_type_and_attribute_is_honoured_or_reported(
    load: Callable[..., Any], tmp_path: Path
) -> None:
    path = tmp_path / "everything.usda"
    authored = everything(path)
    assert len(authored) > 100
    imported = load(path)
    said: dict[str, str] = {}
    for diagnostic in imported.diagnostics:
        for label in (diagnostic.primary, *diagnostic.secondary):
            said[label.place.prim] = said.get(label.place.prim, "") + diagnostic.message + "\n"
    silent = []
    for prim, (kind, names) in authored.items():
        words = said.get(f"/{prim}", "")
        if kind not in READ:
            silent += [] if f"`{kind}`" in words else [kind]
            continue
        for name in sorted(names - READ[kind] - READ_OF_SCHEMAS.get(prim, set())):
            elsewhere = [w for start, w in IN_OTHER_WORDS.items() if name.startswith(start)]
            known = [name.removeprefix("primvars:"), *elsewhere]
            silent += [] if any(w in words for w in known) else [f"{prim}.{name}"]
    assert silent == []


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("vector3f[] accelerations = [(0, 0, 1)]", "`accelerations` of `Mesh` prims"),
        ("vector3f[] velocities = [(0, 0, 1)]", "`velocities` of `Mesh` prims"),
        ("texCoord2f[] primvars:st = [(0, 1)]", "primvar `st`"),
        ("float[] primvars:wear = [1]", "primvar `wear`"),
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


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("float inputs:displacement = 0.25", "`inputs:displacement` of surfaces is not used"),
        ("float inputs:occlusion = 0.25", "`inputs:occlusion` of surfaces is not used"),
        ('token inputs:opacityMode = "presence"', "`inputs:opacityMode` of surfaces is not used"),
        ("normal3f inputs:normal = (1, 0, 0)", "`inputs:normal` of surfaces is not used"),
        ("normal3f inputs:normal.connect = </m/x.outputs:n>", "`inputs:normal` of surfaces"),
        ("float inputs:roughness.connect = </m/x.outputs:n>", "`inputs:roughness` comes from"),
        ("float inputs:roughness.connect = </m/t.outputs:r>", "`inputs:bias` of a texture comes"),
        ("float inputs:occlusion.connect = </m/t.outputs:r>", "`inputs:occlusion` of surfaces"),
        ("float inputs:displacement = 0", ""),
        ("float inputs:occlusion = 1", ""),
        ('token inputs:opacityMode = "transparent"', ""),
        ("normal3f inputs:normal = (0, 0, 1)", ""),
    ],
)
def test_every_input_of_surfaces_is_honoured_or_reported(
    load: Callable[..., Any], line: str, words: str
) -> None:
    imported = load(f"""
def Material "m" {{
    token outputs:surface.connect = </m/s.outputs:surface>
    def Shader "s" {{
        uniform token info:id = "UsdPreviewSurface"
        {line}
        token outputs:surface
    }}
    def Shader "t" {{
        uniform token info:id = "UsdUVTexture"
        asset inputs:file = @none.<UDIM>.png@
        float4 inputs:bias.connect = </m/x.outputs:n>
        float outputs:r
    }}
    def Shader "x" {{
        uniform token info:id = "studio_noise"
        float outputs:n
    }}
}}
def Sphere "ball" (prepend apiSchemas = ["MaterialBindingAPI"]) {{
    rel material:binding = </m>
}}
""")
    said = [diagnostic.message for diagnostic in imported.diagnostics]
    assert any(words in message for message in said) if words else said == []


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


def test_what_is_not_used_names_what_can_be_said_instead(load: Callable[..., Any]) -> None:
    imported = load("""
def RectLight "panel" (prepend apiSchemas = ["ShapingAPI"])
{
    asset inputs:texture:file = @a.png@
    asset inputs:shaping:ies:file = @a.ies@
    color3f inputs:shaping:focusTint = (1, 0, 0)
}
def DomeLight "sky"
{
    asset inputs:texture:file = @sky.exr@
}
def RenderProduct "picture"
{
    rel orderedVars = [</color>, </depth>, </motion>]
}
def RenderVar "color"
{
    string sourceName = "Ci"
}
def RenderVar "depth"
{
    string sourceName = "depth"
}
def RenderVar "motion"
{
    string sourceName = "motion2d"
}
""")
    said = {d.primary.place.prim: d.help for d in imported.diagnostics if "panel" not in d.message}
    helps = [d.help for d in imported.diagnostics if d.primary.place.prim == "/panel"]
    assert len(helps) == 3
    assert all("`inputs:color`" in help or "`shaping:cone:angle`" in help for help in helps)
    assert "`inputs:color`" in said["/sky"]
    assert "`depth`" in said["/motion"]
    assert set(said) == {"/panel", "/sky", "/motion"}
