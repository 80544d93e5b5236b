"""Scenes to USD and back: what differs. `python -m benchmarks.round_trip` prints a table.

Random scenes of every shape and step, and all examples, are exported and imported again. Compared
are the flat scenes, leaf by leaf, and what rays hit, many of which graze or start inside.
"""

from __future__ import annotations

import argparse
import tempfile
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.random_scenes import Rays, random_rays, random_scene
from compiler.bounds import bounds
from compiler.compilation import Compilation, Reader, compile_path
from compiler.flatten import flatten
from compiler.ir import MATERIAL, MESH, SceneIR
from compiler.usd_export import ExportOptions, export_stage
from dsl.files import Files
from dsl.scene import SceneGraph
from runtime.tracer import Hits, Tracer

EXAMPLES = Path(__file__).parent.parent / "examples"
FLOAT32 = 2.0**-23
"""What USD keeps in floats is right to this fraction."""
WAYS = 64
"""Directions in which a ray is moved to see whether it was decided."""
TOGETHER = 20
"""Random scenes of one row."""


@dataclass(frozen=True, slots=True)
class Difference:
    """How a scene and what came back from USD differ.

    `leaves` counts those of another prototype or material, or a difference in the number of
    leaves; `matrices` is the largest error of an entry against its matrix; `rays` counts those
    that hit something else, or at a distance that differs by more than 1e-7 of it. Rays that
    1e-12 decides, because they start on a surface or run along it, are not counted.
    """

    leaves: int
    matrices: float
    rays: int
    hits: int

    def and_of(self, other: Difference) -> Difference:
        """Those of two scenes."""
        return Difference(
            self.leaves + other.leaves,
            max(self.matrices, other.matrices),
            self.rays + other.rays,
            self.hits + other.hits,
        )


def compiled(graph: SceneGraph) -> Compilation:
    """A scene graph without files, compiled."""
    ir, diagnostics, pruned = flatten(graph, lambda _: (None, []))
    assert ir is not None, diagnostics
    return Compilation(graph, ir, pruned, (), Reader(Files()))


def there_and_back(
    scene: Compilation, options: ExportOptions, suffix: str = ".usda"
) -> Compilation:
    """The scene, exported and imported."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"scene{suffix}"
        export_stage(scene, path, options)
        return compile_path(path)


def difference(first: SceneIR, second: SceneIR, rays: Rays) -> Difference:
    """Compare two scenes of kept order."""
    tracers = [Tracer(ir, "float64") for ir in (first, second)]
    hits, others = (tracer.trace(*rays) for tracer in tracers)
    hit = int(np.isfinite(hits.t).sum())
    differ = np.flatnonzero(~_same(hits, others, 1e-7))
    for way, tracer in product(range(WAYS if len(differ) else 0), tracers):
        some = rays.at(differ)
        differ = differ[_same(tracer.trace(*some), tracer.trace(*_moved(some, way)), 1e-6)]
    count = len(first.instance_target)
    if count != len(second.instance_target):
        return Difference(abs(count - len(second.instance_target)), np.inf, len(differ), hit)
    leaves = sum(not same_leaf(first, second, row) for row in range(count))
    a, b = first.world_from_object, second.world_from_object
    size = np.abs(a).max(axis=(1, 2), keepdims=True)
    matrices = float((np.abs(a - b) / size).max(initial=0.0))
    return Difference(leaves, matrices, len(differ), hit)


def _moved(rays: Rays, way: int) -> Rays:
    """The rays, from origins and in directions that are 1e-12 of their length beside.

    Ways 2k and 2k + 1 are opposite.
    """
    rng = np.random.default_rng(way // 2)
    distance = 1e-12 if way % 2 else -1e-12
    length = np.abs(rays.directions).max(axis=1, keepdims=True)
    reach = np.abs(rays.origins).max(axis=1, keepdims=True) + length
    beside, aside = distance * rng.normal(size=(2, *rays.origins.shape))
    return Rays(
        rays.origins + reach * beside, rays.directions + length * aside, rays.t_min, rays.t_max
    )


def _same(hits: Hits, others: Hits, tolerance: float) -> NDArray[np.bool_]:
    near = np.isclose(hits.t, others.t, rtol=tolerance, atol=0.0)
    return np.asarray(near & (hits.instance == others.instance))


def same_leaf(first: SceneIR, second: SceneIR, row: int) -> bool:
    """Whether an instance is of the same prototype and material, to what floats can say."""
    a, b = _prototype(first, row), _prototype(second, row)
    if len(a) != len(b) or not all(map(np.array_equal, a, b)):
        return False
    one, other = _material(first, row), _material(second, row)
    return all(
        np.allclose(one[name], other[name], rtol=FLOAT32, atol=0.0) for name in MATERIAL.names or ()
    )


def _prototype(ir: SceneIR, row: int) -> list[Any]:
    number = int(ir.instance_target[row])
    kind, data = int(ir.prototype_kind[number]), int(ir.prototype_data[number])
    if kind != MESH:
        end = next(
            (
                int(ir.prototype_data[k])
                for k in range(number + 1, len(ir.prototype_kind))
                if ir.prototype_kind[k] != MESH
            ),
            len(ir.shape_parameters),
        )
        return [kind, ir.shape_parameters[data:end]]
    p0, p1, t0, t1 = ir.mesh_ranges[data]
    return [kind, ir.mesh_points[p0:p1], ir.mesh_triangles[t0:t1]]


def _material(ir: SceneIR, row: int) -> np.void:
    code = int(ir.instance_material[row])
    number = -2 - code if code < -1 else max(code, 0)
    return np.void(ir.materials[number])


def rays_through(ir: SceneIR, count: int, seed: int) -> Rays:
    """Rays from around a scene to points in its bounds."""
    rng = np.random.default_rng(seed)
    box = bounds(ir)
    low, high = box if box is not None else (-np.ones(3), np.ones(3))
    targets = rng.uniform(low, high, (count, 3))
    away = rng.normal(size=(count, 3))
    away[:, 1] = np.abs(away[:, 1])
    origins = targets + away * float(np.linalg.norm(high - low))
    return Rays(origins, targets - origins, np.zeros(count), np.full(count, np.inf))


def main() -> None:
    """Print the differences of all examples, and of random scenes."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--scenes", type=int, default=200)
    parser.add_argument("--rays", type=int, default=2000)
    arguments = parser.parse_args()
    print(
        f"{'scene':<24}{'leaves':>8}{'differ':>8}{'matrices':>10}{'rays':>8}{'hits':>8}{'differ':>8}"
    )
    for path in sorted(p for p in EXAMPLES.iterdir() if p.suffix in (".ovo", ".usda")):
        scene = compile_path(path)
        back = there_and_back(scene, ExportOptions())
        found = difference(scene.ir, back.ir, rays_through(scene.ir, arguments.rays, 1))
        _print(path.name, len(scene.ir.instance_target), found, arguments.rays)
    total, leaves = Difference(0, 0.0, 0, 0), 0
    for first in range(0, arguments.scenes, TOGETHER):
        seeds = range(first, min(first + TOGETHER, arguments.scenes))
        some, found = _random(seeds, arguments.rays)
        _print(f"random {seeds[0]}-{seeds[-1]}", some, found, arguments.rays * len(seeds))
        total, leaves = total.and_of(found), leaves + some
    _print(f"{arguments.scenes} random", leaves, total, arguments.rays * arguments.scenes)


def _random(seeds: range, rays: int) -> tuple[int, Difference]:
    """The leaves of some random scenes, and their differences; each that differs has a row."""
    total, leaves = Difference(0, 0.0, 0, 0), 0
    for seed in seeds:
        scene = compiled(random_scene(seed))
        back = there_and_back(scene, ExportOptions(many=3 if seed % 2 else 16))
        found = difference(scene.ir, back.ir, random_rays(scene.graph, rays, seed))
        if found.leaves or found.rays:
            _print(f"random {seed}", len(scene.ir.instance_target), found, rays)
        total, leaves = total.and_of(found), leaves + len(scene.ir.instance_target)
    return leaves, total


def _print(name: str, leaves: int, found: Difference, rays: int) -> None:
    print(
        f"{name:<24}{leaves:>8}{found.leaves:>8}{found.matrices:>10.1e}"
        f"{rays:>8}{found.hits:>8}{found.rays:>8}",
        flush=True,
    )


if __name__ == "__main__":
    main()
