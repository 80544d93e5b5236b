"""The shared stages: what is drawn and where, against usd-core read on its own."""

from __future__ import annotations

import itertools
import re
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from dsl.scene import Mesh, ShapeKind
from tests.compiler.usd_stages.ray_agreement import stage_agrees

ASSETS = Path(__file__).parents[3].parent / "shared" / "usd-assets"
GEOMETRY = "test_assets/schemaTests/usdGeom"
FOUNDATION = "test_assets/foundation"
VEHICLES = "full_assets/Vehicles/USD_Mini_Car_Kit/assets"
STAGES = [
    *(f"{GEOMETRY}/primitives/{name}.usda" for name in ("cube", "sphere", "cylinder")),
    f"{GEOMETRY}/transforms/simple_transform.usda",
    f"{GEOMETRY}/transforms/xforms_nested.usda",
    f"{GEOMETRY}/extent/regular_extent.usda",
    f"{GEOMETRY}/extent/no_extent.usda",
    f"{GEOMETRY}/meshes/quad_mesh/quads.usda",
    f"{GEOMETRY}/meshes/triangled_mesh/triangles.usda",
    f"{GEOMETRY}/meshes/doubleSided/doubleSided_quad.usda",
    f"{GEOMETRY}/meshes/subdiv_catmullClark/subdiv_catmullClark.usda",
    f"{GEOMETRY}/meshes/normals_types/normalsTypes.usda",
    f"{FOUNDATION}/stage_composition/active.usda",
    f"{FOUNDATION}/stage_composition/class_inherit.usda",
    f"{FOUNDATION}/stage_composition/payload/payload_same_folder.usda",
    f"{FOUNDATION}/stage_composition/references/reference_child_folder.usda",
    f"{FOUNDATION}/stage_composition/subLayer/sublayer_same_folder.usda",
    f"{FOUNDATION}/stage_configuration/upAxis/upAxis_Y.usda",
    f"{FOUNDATION}/stage_configuration/upAxis/upAxis_Z.usda",
    f"{FOUNDATION}/stage_configuration/metersPerUnit/metersPerUnit_1.usda",
    f"{FOUNDATION}/stage_configuration/framesPerSecond/framesPerSecond_24.usda",
    f"{FOUNDATION}/stage_configuration/timeCodesPerSecond/timeCodesPerSecond_24.usda",
    f"{FOUNDATION}/stage_configuration/start_end_timeCode/start_end_timeCodes_subset.usda",
    f"{FOUNDATION}/stage_configuration/multiple_root_prims/"
    "multiple_root_prims_with_defaultPrim.usda",
    "docs/PrimvarInterpolation/primvar_interpolation.usda",
    "docs/CompositionPuzzles/VariantSetAndLocal1/puzzle_1.usda",
    "test_assets/TextureCoordinateTest/TextureCoordinateTest.usda",
    "test_assets/AlphaBlendSortTest/AlphaBlendSortTest.usda",
    *(
        f"test_assets/TextureFileFormatTests/{name}.usda"
        for name in ("png_rgb_8-bit", "jpeg_rgb_8-bit", "png_grayscale_8-bit")
    ),
    "test_assets/MaterialXTest/basic_flatten.usda",
    "test_assets/USDZ/BoxAnimated/BoxAnimated.usdz",
    "test_assets/USDZ/AnimatedTriangle/AnimatedTriangle.usdz",
    f"{VEHICLES}/vehicles/sedan/asset/sedanFullAsset.usda",
    f"{VEHICLES}/wheels/wheelVariants.usda",
    "full_assets/OpenChessSet/assets/Pawn/Pawn.usd",
    "intent-vfx/assets/simpleAsset/simpleAsset.usd",
    "intent-vfx/assets/teapot/teapot.usd",
]

MANY_FACES = re.compile("sedan|wheel|Pawn|teapot")
"""Too many for the oracle; `test_usd_rays` has some of these."""

pytestmark = pytest.mark.skipif(not ASSETS.is_dir(), reason=f"no shared stages at {ASSETS}")


def drawn(stage: Any) -> Iterator[tuple[str, np.ndarray]]:
    """Path and world-space corner points of what usd-core says is there to be drawn."""
    from pxr import Usd, UsdGeom

    earliest = Usd.TimeCode.EarliestTime()
    cache = UsdGeom.XformCache(earliest)
    everything = Usd.TraverseInstanceProxies(Usd.PrimDefaultPredicate)
    for prim in Usd.PrimRange(stage.GetPseudoRoot(), everything):
        imageable = UsdGeom.Imageable(prim)
        if not prim.IsA(UsdGeom.Gprim) or imageable.ComputeVisibility(earliest) == "invisible":
            continue
        if imageable.ComputePurpose() not in ("default", "render"):
            continue
        if prim.IsA(UsdGeom.Mesh):
            points = np.array(UsdGeom.Mesh(prim).GetPointsAttr().Get(earliest), dtype=float)
        else:
            boundable = UsdGeom.Boundable(prim)
            points = corners(*UsdGeom.Boundable.ComputeExtentFromPlugins(boundable, earliest))
        world = np.array(cache.GetLocalToWorldTransform(prim))
        yield str(prim.GetPath()), points @ world[:3, :3] + world[3, :3]


def corners(low: Any, high: Any) -> np.ndarray:
    return np.array(list(itertools.product(*zip(low, high, strict=True))), dtype=float)


def shape_corners(shape: Any) -> np.ndarray:
    values = shape.parameters
    if shape.kind is ShapeKind.BOX:
        return corners(values[:3], values[3:6])
    if shape.kind is ShapeKind.SPHERE:
        return corners((-values[0],) * 3, (values[0],) * 3)
    assert shape.kind is ShapeKind.CYLINDER
    radius, low, high, _ = values
    return corners((-radius, low, -radius), (radius, high, radius))


def box(points: np.ndarray) -> np.ndarray:
    return np.array([points.min(axis=0), points.max(axis=0)])


@pytest.mark.parametrize("name", STAGES)
def test_what_is_drawn_stands_where_usd_core_has_it(load: Callable[..., Any], name: str) -> None:
    from pxr import Usd

    imported = load(ASSETS / name, time="earliest", complexity="low")
    expected = dict(drawn(Usd.Stage.Open(str(ASSETS / name))))
    found: dict[str, list[np.ndarray]] = {}
    for leaf in imported.leaves:
        local = leaf.node.points if isinstance(leaf.node, Mesh) else shape_corners(leaf.node)
        world = local @ leaf.world[:3, :3].T + leaf.world[:3, 3]
        found.setdefault(leaf.path, []).append(world)
    assert found.keys() == expected.keys()
    for path, points in expected.items():
        own = box(np.concatenate(found[path]))
        size = np.abs(points).max()
        np.testing.assert_allclose(own, box(points), atol=1e-6 * size, err_msg=path)
    assert not any(diagnostic.severity == "error" for diagnostic in imported.diagnostics)


@pytest.mark.parametrize("name", [s for s in STAGES if not MANY_FACES.search(s)])
def test_rays_hit_what_usd_core_places(name: str) -> None:
    stage_agrees(ASSETS / name, count=60)


@pytest.mark.parametrize("name", [s for s in STAGES if "Code" in s or "framesPer" in s])
@pytest.mark.parametrize("time", [-5, 0, 13.5, 100, 200])
def test_the_cube_moves_with_the_frame_and_is_held_outside(
    load: Callable[..., Any], name: str, time: float
) -> None:
    (cube,) = [
        leaf for leaf in load(ASSETS / name, time=time).leaves if isinstance(leaf.node, Mesh)
    ]
    assert cube.world[0, 3] == pytest.approx(min(max(time, 0), 100))


@pytest.mark.parametrize(
    ("purpose", "kind"), [("render", ShapeKind.SPHERE), ("proxy", ShapeKind.BOX)]
)
def test_purposes_choose_the_sphere_or_the_cube(
    load: Callable[..., Any], purpose: str, kind: ShapeKind
) -> None:
    purposes = frozenset({"default", purpose})
    path = ASSETS / "intent-vfx/assets/simpleAsset/simpleAsset.usd"
    (leaf,) = load(path, purposes=purposes).leaves
    assert leaf.node.kind is kind


def test_all_17_meshes_with_odd_normals_are_drawn(load: Callable[..., Any]) -> None:
    leaves = load(ASSETS / GEOMETRY / "meshes/normals_types/normalsTypes.usda").leaves
    assert len({leaf.path for leaf in leaves}) == 17


def test_the_pawn_has_the_materials_of_its_file(load: Callable[..., Any]) -> None:
    imported = load(ASSETS / "full_assets/OpenChessSet/assets/Pawn/Pawn.usd")
    assert not [d for d in imported.diagnostics if d.code == "usd-composition"]
    body = imported.leaf("/Pawn/Geom_Body/Render").material
    textures = {texture.parameter: Path(texture.file).name for texture in body.textures}
    assert textures == {
        "diffuse": "pawn_black_base_color.jpg",
        "metallic": "pawn_shared_metallic.jpg",
        "roughness": "pawn_shared_roughness.jpg",
        "normal": "pawn_shared_normal.jpg",
    }
