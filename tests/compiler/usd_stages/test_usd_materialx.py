"""Surfaces of MaterialX in a stage are drawn as the preview surfaces they are nearest to."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

STAGE = """
def Material "m" {
    float inputs:rough = 0.25
    token outputs:mtlx:surface.connect = </m/s.outputs:surface>
    def Shader "s" {
        uniform token info:id = "%s"
        %s
        token outputs:surface
    }
}
def Sphere "ball" (apiSchemas = ["MaterialBindingAPI"]) {
    rel material:binding = </m>
}
"""


def test_preview_surfaces_have_their_inputs(load: Callable[..., Any]) -> None:
    imported = load(
        STAGE
        % (
            "ND_UsdPreviewSurface_surfaceshader",
            """color3f inputs:diffuseColor = (1, 0.5, 0)
        float inputs:roughness.connect = </m.inputs:rough>""",
        )
    )
    assert imported.diagnostics == []
    material = imported.leaf("/ball").material
    assert (material.diffuse, material.roughness) == ((1.0, 0.5, 0.0), 0.25)


def test_standard_surfaces_are_read_by_a_table(load: Callable[..., Any]) -> None:
    imported = load(
        STAGE
        % (
            "ND_standard_surface_surfaceshader",
            """float inputs:base = 0.5
        color3f inputs:base_color = (1, 0.5, 0)
        float inputs:metalness = 1
        float inputs:specular_roughness.connect = </m.inputs:rough>
        float inputs:emission = 2
        color3f inputs:emission_color = (0, 1, 0)
        color3f inputs:opacity = (0.25, 0.5, 0.75)
        float inputs:transmission = 0.5""",
        )
    )
    material = imported.leaf("/ball").material
    assert (material.diffuse, material.metallic) == ((0.5, 0.25, 0.0), 1.0)
    assert (material.roughness, material.emission) == (0.25, (0.0, 2.0, 0.0))
    assert (material.opacity, material.clearcoat_roughness) == (0.5, 0.1)
    assert "`transmission`" in imported.said("standard_surface").message


def test_other_surfaces_are_the_default_one(load: Callable[..., Any]) -> None:
    imported = load(STAGE % ("ND_disney_bsdf_2015_surfaceshader", ""))
    assert imported.leaf("/ball").material.diffuse == (0.18, 0.18, 0.18)
    assert imported.said("ND_disney").code == "usd-material"
