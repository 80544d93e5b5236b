"""Scenes built by hand as flat arrays, and rays through the kernel's Python face."""

from __future__ import annotations

import dataclasses
import itertools
from typing import Any

import numpy as np
from numpy.typing import NDArray

from compiler.ir import CAMERA, KINDS, LIGHT, MATERIAL, MESH, ORIGIN, SETTINGS, SceneIR
from runtime import _kernel

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

PRECISIONS = ("float32", "float64")
TOLERANCE = {"float32": 2e-6, "float64": 4e-15}


@dataclasses.dataclass
class Builder:
    """Flat arrays, appended to. Groups are laid out when the scene is built."""

    prototypes: list[tuple[int, int]] = dataclasses.field(default_factory=list)
    parameters: list[float] = dataclasses.field(default_factory=list)
    meshes: list[tuple[FloatArray, NDArray[np.int32]]] = dataclasses.field(default_factory=list)
    groups: list[list[tuple[int, FloatArray, FloatArray, int]]] = dataclasses.field(
        default_factory=lambda: [[]]
    )

    def shape(self, kind: str, *parameters: float) -> int:
        """A new analytic prototype."""
        self.prototypes.append((KINDS.index(kind), len(self.parameters)))
        self.parameters.extend(parameters)
        return len(self.prototypes) - 1

    def mesh(self, points: Any, triangles: Any) -> int:
        """A new mesh prototype."""
        self.prototypes.append((MESH, len(self.meshes)))
        self.meshes.append((np.asarray(points, float), np.asarray(triangles, np.int32)))
        return len(self.prototypes) - 1

    def group(self) -> int:
        """A new group; target it with `~group`."""
        self.groups.append([])
        return len(self.groups) - 1

    def place(
        self,
        target: int,
        matrix: Any = None,
        *,
        group: int = 0,
        inverse: Any = None,
        material: int = -1,
    ) -> None:
        """An instance with a 4x4 transform."""
        forward = np.eye(4) if matrix is None else np.asarray(matrix, float)
        back = np.linalg.inv(forward) if inverse is None else np.asarray(inverse, float)
        self.groups[group].append((target, forward[:3], back[:3], material))

    def build(self, materials: int = 8) -> SceneIR:
        """The scene."""
        instances = [instance for group in self.groups for instance in group]
        ends = list(itertools.accumulate(len(group) for group in self.groups))
        points = [len(points) for points, _ in self.meshes]
        triangles = [len(triangles) for _, triangles in self.meshes]
        first_points = [0, *itertools.accumulate(points)][:-1]
        first_triangles = [0, *itertools.accumulate(triangles)][:-1]
        n = len(instances)
        return SceneIR(
            prototype_kind=np.array([kind for kind, _ in self.prototypes], np.uint8),
            prototype_data=np.array([data for _, data in self.prototypes], np.int64),
            shape_parameters=np.array(self.parameters, np.float64),
            mesh_ranges=np.array(
                [
                    (p, p + np_, t, t + nt)
                    for p, np_, t, nt in zip(
                        first_points, points, first_triangles, triangles, strict=True
                    )
                ],
                np.int64,
            ).reshape(-1, 4),
            mesh_points=np.concatenate([np.zeros((0, 3)), *(p for p, _ in self.meshes)]),
            mesh_triangles=np.concatenate(
                [np.zeros((0, 3), np.int32), *(t for _, t in self.meshes)]
            ),
            group_ranges=np.array(
                [(end - len(group), end) for end, group in zip(ends, self.groups, strict=True)],
                np.int64,
            ),
            instance_target=np.array([target for target, *_ in instances], np.int32),
            world_from_object=np.array([m for _, m, _, _ in instances]).reshape(n, 3, 4),
            object_from_world=np.array([m for _, _, m, _ in instances]).reshape(n, 3, 4),
            translation_low=np.zeros((0, 3), np.float32),
            instance_material=np.array([m for *_, m in instances], np.int32),
            instance_source=np.zeros(n, np.int32),
            materials=np.zeros(materials, MATERIAL),
            lights=np.zeros(0, LIGHT),
            cameras=np.zeros(0, CAMERA),
            settings=np.zeros(1, SETTINGS),
            source_parent=np.full(1, -1, np.int32),
            source_origin=np.zeros(1, np.int32),
            source_index=np.full(1, -1, np.int32),
            origins=np.zeros(1, ORIGIN),
            text_ends=np.zeros(0, np.int64),
            text_bytes=np.zeros(0, np.uint8),
        )


@dataclasses.dataclass
class Hits:
    """What `Kernel.trace` and `Kernel.surface` return, by name."""

    t: FloatArray
    normal: FloatArray
    position: FloatArray
    instance: IntArray
    prototype: NDArray[np.int32]
    material: NDArray[np.int32]


def rays(origins: Any, directions: Any) -> tuple[FloatArray, FloatArray]:
    """C-contiguous (n, 3) float64 arrays."""
    o, d = np.broadcast_arrays(np.asarray(origins, float), np.asarray(directions, float))
    return np.array(o.reshape(-1, 3), order="C"), np.array(d.reshape(-1, 3), order="C")


def bound(value: Any) -> FloatArray:
    """A (1,) or (n,) array."""
    return np.atleast_1d(np.asarray(value, float))


def trace(
    kernel: _kernel.Kernel,
    origins: Any,
    directions: Any,
    t_min: Any = 0.0,
    t_max: Any = np.inf,
    threads: int = 1,
) -> Hits:
    """Closest hits; asserts that `occluded` agrees about which rays hit."""
    o, d = rays(origins, directions)
    t, instance, primitive = kernel.trace(o, d, bound(t_min), bound(t_max), threads)
    normal, position, *numbers, _ = kernel.surface(o, d, t, instance, primitive, threads)
    hits = Hits(t, normal, position, instance, *numbers)
    occluded = kernel.occluded(o, d, bound(t_min), bound(t_max), threads)
    np.testing.assert_array_equal(occluded, hits.instance >= 0)
    return hits


def translation(x: float, y: float, z: float) -> FloatArray:
    matrix = np.eye(4)
    matrix[:3, 3] = x, y, z
    return matrix


def scaling(x: float, y: float, z: float) -> FloatArray:
    return np.diag([x, y, z, 1.0])


def rotation(rng: np.random.Generator) -> FloatArray:
    q, r = np.linalg.qr(rng.normal(size=(3, 3)))
    matrix = np.eye(4)
    matrix[:3, :3] = q * np.sign(np.diag(r))
    return matrix
