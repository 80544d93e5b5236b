"""Lights, cameras and settings of the flat scene as prims."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
from pxr import Gf, Sdf

from compiler import ir
from compiler.usd_export.layer import apply_schema, attribute, child, identifier, place
from dsl.scene import FloatArray, Step, StepKind

_FOCAL = 50.0
_ASPECT = 4.0 / 3.0
"""Of the aperture of a camera that takes the picture's."""
_CLIPPING = (0.01, 1e6)
"""What others see of a camera that has no near and far plane."""

_SURFACES = {ir.RECTANGLE: "RectLight", ir.DISC: "DiskLight", ir.CYLINDER: "CylinderLight"}
_SIZES: dict[int, dict[str, float]] = {
    ir.RECTANGLE: {"width": 2.0, "height": 2.0},
    ir.DISC: {"radius": 1.0},
    ir.CYLINDER: {"length": 2.0, "radius": 1.0},
}
"""Those of lights whose axes are the columns of their matrix."""


def write_lights(root: Any, scene: ir.SceneIR, folder: Path) -> None:
    """One light prim each, in order; names of textures start from `folder`."""
    for number, light in enumerate(scene.lights):
        name = ir.LIGHTS[int(light["kind"])]
        scope = root.nameChildren.get("Lights") or child(root, "Lights", "Scope")
        color = [float(c) for c in light["color"]]
        match int(light["kind"]):
            case ir.SUN:
                prim = child(scope, name, "DistantLight")
                place(prim, (_matrix(_facing(light["vector"]), np.zeros(3)),))
                attribute(prim, "inputs:angle", "float", float(light["size"]))
                attribute(prim, "inputs:normalize", "bool", True)
                _emission(prim, color)
            case ir.POINT:
                prim = child(scope, f"{name}_light", "SphereLight")
                if light["w"].any():
                    place(prim, (_matrix(_facing(light["w"]), light["vector"]),))
                else:
                    place(prim, (Step(StepKind.TRANSLATE, np.array(light["vector"])),))
                _shaping(prim, light)
                radius = float(light["size"])
                if radius == 0.0:
                    attribute(prim, "treatAsPoint", "bool", True)
                else:
                    attribute(prim, "inputs:radius", "float", radius)
                # Normalised, a ball's power is spread over its surface: four discs.
                attribute(prim, "inputs:normalize", "bool", True)
                _emission(prim, [4.0 * c for c in color])
            case ir.SKY:
                prim = child(scope, name, "DomeLight")
                _emission(prim, color)
                if texture := scene.sky_texture(number):
                    axes = np.column_stack([light["u"], light["v"], light["w"]])
                    place(prim, (_matrix(axes, np.zeros(3)),))
                    file = Sdf.AssetPath(str(folder / texture))
                    attribute(prim, "inputs:texture:file", "asset", file)
                    attribute(prim, "inputs:texture:format", "token", "latlong")
            case kind:
                prim = child(scope, f"{name}_light", _SURFACES[kind])
                axes = np.column_stack([light["u"], light["v"], -light["w"]])
                place(prim, (_matrix(axes, light["vector"]),))
                for size, length in _SIZES[kind].items():
                    attribute(prim, f"inputs:{size}", "float", length)
                _emission(prim, color)
                _shaping(prim, light)


def _shaping(prim: Any, light: Any) -> None:
    """In which directions a light shines, unless that is everywhere."""
    cone, softness, focus = (float(light[name]) for name in ("cone", "softness", "focus"))
    if cone == 180.0 and focus == 0.0:
        return
    apply_schema(prim, "ShapingAPI")
    for name, number in (("cone:angle", cone), ("cone:softness", softness), ("focus", focus)):
        attribute(prim, f"inputs:shaping:{name}", "float", number)


def _emission(prim: Any, color: list[float]) -> None:
    intensity = max(color)
    attribute(prim, "inputs:intensity", "float", intensity)
    attribute(prim, "inputs:color", "color3f", Gf.Vec3f(*(c / intensity for c in color)))


def _facing(direction: FloatArray) -> FloatArray:
    """A rotation `(3, 3)` that turns -z into a unit direction."""
    back = -np.asarray(direction, dtype=np.float64)
    side = np.cross(np.eye(3)[int(np.argmin(np.abs(back)))], back)
    side /= np.linalg.norm(side)
    return np.stack([side, np.cross(back, side), back], axis=1)


def _matrix(linear: FloatArray, position: FloatArray) -> Step:
    return Step(StepKind.MATRIX, np.column_stack([linear, position]).ravel())


def write_cameras(root: Any, scene: ir.SceneIR) -> list[Any]:
    """One camera prim each, in order; their paths."""
    paths = []
    for camera in scene.cameras:
        scope = root.nameChildren.get("Cameras") or child(root, "Cameras", "Scope")
        name = scene.text(int(camera["name"]))
        prim = child(scope, identifier(name) if name else "camera", "Camera")
        paths.append(prim.path)
        world = camera["world_from_camera"]
        place(prim, (_matrix(world[:, :3], world[:, 3]),))
        free = math.isnan(float(camera["aspect"]))
        aspect = _aspect(scene) if free else float(camera["aspect"])
        height = float(camera["height"])
        orthographic = int(camera["projection"]) == ir.ORTHOGRAPHIC
        # Apertures and focal length are tenths of a unit.
        aperture = 10.0 * height if orthographic else _FOCAL * height
        projection = "orthographic" if orthographic else "perspective"
        attribute(prim, "projection", "token", projection)
        attribute(prim, "focalLength", "float", _FOCAL)
        shift = [float(s) for s in camera["shift"]]
        for axis, size, moved in (
            ("horizontal", aperture * aspect, shift[0]),
            ("vertical", aperture, shift[1]),
        ):
            attribute(prim, f"{axis}Aperture", "float", size)
            if moved:
                attribute(prim, f"{axis}ApertureOffset", "float", moved * size)
        exposure, focus = float(camera["exposure"]), float(camera["focus_distance"])
        radius = float(camera["lens_radius"])
        opened, closed = (float(t) for t in camera["shutter"])
        for said, type_name, number in (
            ("exposure", "float", exposure),
            ("focusDistance", "float", focus),
            ("fStop", "float", 0.05 * _FOCAL / radius if radius else 0.0),
            ("shutter:open", "double", opened),
            ("shutter:close", "double", closed),
        ):
            if number:
                attribute(prim, said, type_name, number)
        near, far = float(camera["near"]), float(camera["far"])
        seen = (near or _CLIPPING[0], far if math.isfinite(far) else max(_CLIPPING[1], 2.0 * near))
        attribute(prim, "clippingRange", "float2", Gf.Vec2f(*seen))
        if free or seen != (near, far):
            apply_schema(prim, "OvoloCameraAPI")
            attribute(prim, "ovolo:clippingRange", "double2", Gf.Vec2d(near, far))
            attribute(prim, "ovolo:freeAspect", "bool", free)
    return paths


def _aspect(scene: ir.SceneIR) -> float:
    settings = scene.settings[0]
    width, height = int(settings["width"]), int(settings["height"])
    return width / height if width and height else _ASPECT


def write_settings(layer: Any, scene: ir.SceneIR, cameras: list[Any]) -> None:
    """A RenderSettings prim, if the scene says anything about its picture."""
    settings = scene.settings[0]
    said: list[tuple[str, str, Any]] = []
    for name, field, choices in (
        ("ovolo:integrator", "integrator", ir.INTEGRATORS),
        ("ovolo:precision", "precision", ir.PRECISIONS),
    ):
        if int(settings[field]) >= 0:
            said.append((name, "token", choices[int(settings[field])]))
    if int(settings["samples"]):
        said.append(("ovolo:samples", "int", int(settings["samples"])))
    for name, field in (
        ("ovolo:occlusionDistance", "occlusion_distance"),
        ("ovolo:exposure", "exposure"),
    ):
        if not math.isnan(float(settings[field])):
            said.append((name, "double", float(settings[field])))
    width, height = int(settings["width"]), int(settings["height"])
    if not said and not width and not height:
        return
    scope = child(layer.pseudoRoot, "Render", "Scope")
    prim = child(scope, "Settings", "RenderSettings")
    if width or height:
        attribute(prim, "resolution", "int2", Gf.Vec2i(width, height), uniform=True)
    if cameras:
        rel = Sdf.RelationshipSpec(prim, "camera", custom=False)
        rel.targetPathList.explicitItems = [cameras[0]]
    if said:
        apply_schema(prim, "OvoloSettingsAPI")
        for name, type_name, value in said:
            attribute(prim, name, type_name, value)
    layer.pseudoRoot.SetInfo("renderSettingsPrimPath", str(prim.path))
