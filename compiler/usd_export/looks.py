"""Materials as UsdPreviewSurface, and their bindings."""

from __future__ import annotations

from typing import Any

from pxr import Gf, Sdf

from compiler.compress import NO_MATERIAL, overriding
from compiler.usd_export.layer import apply_schema, attribute, child, relationship
from compiler.usd_export.textures import connect
from dsl.scene import Material

_COLORS = {"diffuse": "diffuseColor", "emission": "emissiveColor", "specular": "specularColor"}
_NUMBERS = {
    "metallic": "metallic",
    "roughness": "roughness",
    "clearcoat": "clearcoat",
    "clearcoat_roughness": "clearcoatRoughness",
    "opacity": "opacity",
    "opacity_threshold": "opacityThreshold",
    "ior": "ior",
}


class Looks:
    """The materials of a scene, each written when it is first bound."""

    def __init__(self, root: Any, materials: list[Material]) -> None:
        self._root = root
        self._materials = materials
        self._scope: Any | None = None
        self._paths: dict[int, Any] = {}

    def bind(self, prim: Any, code: int) -> None:
        """Bind the material of a code of `compiler.compress`, if it is one."""
        if code == NO_MATERIAL:
            return
        overrides = code < NO_MATERIAL
        apply_schema(prim, "MaterialBindingAPI")
        path = self._path(overriding(code) if overrides else code)
        binding = relationship(prim, "material:binding", path)
        if overrides:
            binding.SetInfo("bindMaterialAs", "strongerThanDescendants")

    def _path(self, number: int) -> Any:
        if number not in self._paths:
            if self._scope is None:
                self._scope = child(self._root, "Looks", "Scope")
            prim = child(self._scope, f"material_{len(self._paths) + 1}", "Material")
            _write(prim, self._materials[number])
            self._paths[number] = prim.path
        return self._paths[number]


def _write(prim: Any, material: Material) -> None:
    shader = child(prim, "surface", "Shader")
    attribute(shader, "info:id", "token", "UsdPreviewSurface", uniform=True)
    for field, name in _COLORS.items():
        color = Gf.Vec3f(*getattr(material, field))
        attribute(shader, f"inputs:{name}", "color3f", color)
    for field, name in _NUMBERS.items():
        attribute(shader, f"inputs:{name}", "float", getattr(material, field))
    ports = {**_COLORS, **_NUMBERS}
    for texture in material.textures:
        connect(prim, shader, ports.get(texture.parameter, texture.parameter), texture)
    workflow = int(material.specular_workflow)
    attribute(shader, "inputs:useSpecularWorkflow", "int", workflow)
    output = Sdf.AttributeSpec(shader, "outputs:surface", Sdf.ValueTypeNames.Token)
    surface = Sdf.AttributeSpec(prim, "outputs:surface", Sdf.ValueTypeNames.Token)
    surface.connectionPathList.explicitItems = [output.path]
