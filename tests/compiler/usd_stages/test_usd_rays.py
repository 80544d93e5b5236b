"""Rays against stages: hits agree with world-space geometry made by usd-core alone."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import ovolo
from compiler.flatten import flatten
from compiler.provenance import object_path
from compiler.usd import StageOptions, import_stage
from dsl.diagnostics import Diagnostic
from dsl.scene import File, Node
from runtime.tracer import Tracer

ASSETS = Path(__file__).parents[3].parent / "shared" / "usd-assets"
EXAMPLE = Path(__file__).parents[3] / "examples" / "orchard.usda"
PRECISIONS = ["float64", "float32"]


@dataclass(frozen=True)
class Soup:
    """World-space triangles `(m, 3, 3)`, and the path of the prim of each."""

    triangles: np.ndarray
    paths: list[str]

    @property
    def bounds(self) -> np.ndarray:
        points = self.triangles.reshape(-1, 3)
        return np.array([points.min(axis=0), points.max(axis=0)])

    def nearest(self, origins: np.ndarray, directions: np.ndarray) -> tuple[np.ndarray, ...]:
        """Distance, triangle and cosine of incidence of the nearest hit (Möller, Trumbore)."""
        a, b, c = (self.triangles[:, i] for i in range(3))
        e1, e2 = b - a, c - a
        t, index, cosine = np.full(len(origins), np.inf), np.zeros(len(origins), int), []
        for i, (o, d) in enumerate(zip(origins, directions, strict=True)):
            p = np.cross(d, e2)
            with np.errstate(all="ignore"):
                inverse = 1.0 / np.einsum("ij,ij->i", e1, p)
                s = o - a
                u = np.einsum("ij,ij->i", s, p) * inverse
                q = np.cross(s, e1)
                v = q @ d * inverse
                found = np.einsum("ij,ij->i", e2, q) * inverse
                found[~((u >= 0) & (v >= 0) & (u + v <= 1) & (found > 0))] = np.inf
            index[i] = np.argmin(found)
            t[i] = found[index[i]]
            normal = np.cross(e1[index[i]], e2[index[i]])
            cosine.append(normal @ d / max(np.linalg.norm(normal), 1e-300))
        return t, index, np.array(cosine)


def soup(path: Path, time: Any = None) -> Soup:
    """Meshes through instance proxies and point instances, fanned, in world space."""
    from pxr import Usd, UsdGeom

    stage = Usd.Stage.Open(str(path))
    code = Usd.TimeCode.EarliestTime() if time is None else Usd.TimeCode(time)
    cache = UsdGeom.XformCache(code)
    triangles, paths = [], []

    def add(prim: Any, world: np.ndarray, suffix: str = "") -> None:
        mesh = UsdGeom.Mesh(prim)
        points = np.array(mesh.GetPointsAttr().Get(code), dtype=float)
        points = points @ world[:3, :3] + world[3, :3]
        corners = iter(mesh.GetFaceVertexIndicesAttr().Get(code))
        # A mirror turns the winding over, and what was outside stays outside.
        left_handed = mesh.GetOrientationAttr().Get() == "leftHanded"
        flip = left_handed != (np.linalg.det(world[:3, :3]) < 0)
        for count in mesh.GetFaceVertexCountsAttr().Get(code):
            face = [next(corners) for _ in range(count)]
            for i in range(1, count - 1):
                corner = points[[face[0], face[i], face[i + 1]]]
                triangles.append(corner[::-1] if flip else corner)
                paths.append(str(prim.GetPath()) + suffix)

    def meshes(root: Any) -> Iterator[Any]:
        prims = iter(Usd.PrimRange(root, Usd.TraverseInstanceProxies(Usd.PrimDefaultPredicate)))
        for prim in prims:
            if prim.IsA(UsdGeom.PointInstancer):
                prims.PruneChildren()
                yield prim
            elif prim.IsA(UsdGeom.Mesh):
                purpose = UsdGeom.Imageable(prim).ComputePurpose()
                if purpose in ("default", "render"):
                    yield prim

    for prim in meshes(stage.GetPseudoRoot()):
        world = cache.GetLocalToWorldTransform(prim)
        if not prim.IsA(UsdGeom.PointInstancer):
            add(prim, np.array(world))
            continue
        instancer = UsdGeom.PointInstancer(prim)
        placed = instancer.ComputeInstanceTransformsAtTime(0, 0)
        roots = [stage.GetPrimAtPath(p) for p in instancer.GetPrototypesRel().GetTargets()]
        for row, number in enumerate(instancer.GetProtoIndicesAttr().Get()):
            for part in meshes(roots[number]):
                local, _ = cache.ComputeRelativeTransform(part, roots[number])
                add(part, np.array(local * placed[row] * world), f"@{prim.GetPath()}[{row}]")
    return Soup(np.array(triangles), paths)


def rays(bounds: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray]:
    """From around a box towards points in it; directions are not unit."""
    random = np.random.default_rng(7)
    center, size = bounds.mean(axis=0), np.ptp(bounds, axis=0).max()
    around = random.normal(size=(count, 3))
    origins = center + 2.0 * size * around / np.linalg.norm(around, axis=1, keepdims=True)
    targets = random.uniform(bounds[0], bounds[1], (count, 3))
    return origins, (targets - origins) * random.uniform(0.1, 10.0, (count, 1))


def no_files(_: File) -> tuple[Node | None, list[Diagnostic]]:
    raise AssertionError


def agree(path: Path, precision: Any, count: int = 300) -> None:
    """Rays against cages: subdivision has tests of its own."""
    expected = soup(path)
    options = StageOptions(complexity="low")
    graph, _ = import_stage(path, time="earliest", options=options)
    ir, _, _ = flatten(graph, no_files)
    assert ir is not None
    origins, directions = rays(expected.bounds, count)
    hits = Tracer(ir, precision=precision).trace(origins, directions)
    t, triangle, cosine = expected.nearest(origins, directions)
    size = np.ptp(expected.bounds, axis=0).max() / np.linalg.norm(directions, axis=1)
    assert (np.isfinite(t) == np.isfinite(hits.t)).all()
    hit = np.isfinite(t)
    assert hit.sum() > count / 20
    assert (np.abs(hits.t[hit] - t[hit]) <= 1e-5 * size[hit]).all()
    found = np.einsum("ij,ij->i", hits.normal, directions)[hit]
    np.testing.assert_allclose(found, cosine[hit], atol=1e-3 * np.abs(cosine[hit]).max())
    paths = [object_path(ir, int(i)) for i in hits.instance[hit]]
    assert paths == [expected.paths[i] for i in triangle[hit]]


PRISM = """
        point3f[] points = [(0, 0, 0), (1, 0, 0), (1.3, 0.9, 0), (0.5, 1.5, 0), (-0.3, 0.9, 0),
                            (0, 0, 2), (1, 0, 2), (1.3, 0.9, 2), (0.5, 1.5, 2), (-0.3, 0.9, 2)]
        int[] faceVertexCounts = [5, 5, 4, 4, 4, 4, 4]
        int[] faceVertexIndices = [4, 3, 2, 1, 0, 5, 6, 7, 8, 9, 0, 1, 6, 5, 1, 2, 7, 6,
                                   2, 3, 8, 7, 3, 4, 9, 8, 4, 0, 5, 9]
        uniform token subdivisionScheme = "none"
"""
EVERYTHING = f"""#usda 1.0
class Xform "_thing" {{
    def Mesh "prism" {{{PRISM}
        float3 xformOp:rotateXYZ = (10, 20, 30)
        uniform token[] xformOpOrder = ["xformOp:rotateXYZ"]
    }}
    def "inner" (instanceable = true
        inherits = </_inner>
    ) {{
    }}
}}
class Xform "_inner" {{
    double3 xformOp:translate = (0, 3, 0)
    double3 xformOp:translate:pivot = (0.5, 0.5, 0.5)
    half xformOp:rotateZ = 40
    uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:translate:pivot",
        "xformOp:rotateZ", "!invert!xformOp:translate:pivot"]
    def Mesh "left" {{{PRISM}
        uniform token orientation = "leftHanded"
        double3 xformOp:scale = (1, 1, -0.5)
        uniform token[] xformOpOrder = ["xformOp:scale"]
    }}
}}
def Xform "a" (instanceable = true
    inherits = </_thing>
) {{
    matrix4d xformOp:transform = ((1, 0.5, 0, 0), (0, 1, 0.25, 0), (0, 0, 1, 0), (5, 0, 0, 1))
    uniform token[] xformOpOrder = ["xformOp:transform"]
}}
def "b" (instanceable = true
    inherits = </_thing>
) {{
}}
def PointInstancer "points" {{
    double3 xformOp:translate = (0, -5, 0)
    uniform token[] xformOpOrder = ["xformOp:translate"]
    rel prototypes = [</points/car>, </points/prism>]
    int[] protoIndices = [0, 1, 0, 1]
    point3f[] positions = [(0, 0, 0), (4, 0, 0), (8, 0, 0), (-4, 0, 0)]
    quath[] orientations = [(0.7071, 0.7071, 0, 0), (0.5, 0.5, 0.5, 0.5), (1, 0, 0, 0),
                            (0.8, 0, 0.6, 0)]
    float3[] scales = [(1, 1, 1), (1, 2, 1), (0.5, 0.5, 0.5), (-1, 1, 1)]
    def Xform "car" (instanceable = true
        inherits = </_thing>
    ) {{
    }}
    def Mesh "prism" {{{PRISM}
    }}
}}
"""


@pytest.mark.parametrize("precision", PRECISIONS)
def test_rays_hit_what_usd_core_places(tmp_path: Path, precision: str) -> None:
    path = tmp_path / "everything.usda"
    path.write_text(EVERYTHING)
    agree(path, precision, count=600)


@pytest.mark.parametrize("precision", PRECISIONS)
@pytest.mark.parametrize(
    "name",
    [
        "full_assets/Vehicles/USD_Mini_Car_Kit/assets/vehicles/sedan/asset/sedanFullAsset.usda",
        "full_assets/OpenChessSet/assets/Pawn/Pawn.usd",
        "test_assets/schemaTests/usdGeom/meshes/normals_types/normalsTypes.usda",
        "test_assets/USDZ/BoxAnimated/BoxAnimated.usdz",
    ],
)
def test_rays_hit_the_shared_meshes(name: str, precision: str) -> None:
    if not ASSETS.is_dir():
        pytest.skip(f"no shared stages at {ASSETS}")
    agree(ASSETS / name, precision, count=200)


@pytest.mark.parametrize("precision", PRECISIONS)
def test_the_example_is_hit_where_its_prims_are(precision: Any) -> None:
    from pxr import Usd, UsdGeom

    scene = ovolo.compile_file(EXAMPLE)
    assert scene.warnings == ()
    x = np.linspace(-8, 8, 60)
    origins = np.stack(np.broadcast_arrays(x, 1.7, 20.0), axis=1)
    hits = scene.tracer(precision=precision).trace(origins, np.tile((0.0, 0.0, -1.0), (60, 1)))
    stage = Usd.Stage.Open(str(EXAMPLE))
    cache = UsdGeom.XformCache()
    trees = UsdGeom.PointInstancer.Get(stage, "/Orchard/Trees")
    placed = trees.ComputeInstanceTransformsAtTime(0, 0)
    checked = 0
    for number, position in zip(hits.instance, hits.position, strict=True):
        path = scene.object_path(int(number)) if number >= 0 else ""
        part, _, points = path.partition("@")
        if "Crown" not in part:
            continue
        sphere = stage.GetPrimAtPath(part)
        root = stage.GetPrimAtPath("/Orchard/Trees/Apple")
        local, _ = cache.ComputeRelativeTransform(sphere, root)
        world = local * placed[int(points.partition("[")[2][:-1])]
        x, y, z = world.GetInverse().Transform(tuple(position))
        radius = UsdGeom.Sphere(sphere).GetRadiusAttr().Get()
        assert np.hypot(np.hypot(x, y), z) == pytest.approx(radius, rel=1e-5)
        checked += 1
    assert checked > 10
