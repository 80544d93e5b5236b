"""Shapes and meshes as prototypes: what is equal is stored once."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from compiler.compress import Leaf
from compiler.ir import KINDS, MESH
from dsl.scene import FloatArray, Mesh, Node, Shape, ShapeKind, Step, StepKind, Transform
from dsl.sizes import scaled_units, unit_of


class PrototypeArrays(NamedTuple):
    """The prototype tables of an IR."""

    prototype_kind: NDArray[np.uint8]
    prototype_data: NDArray[np.int64]
    shape_parameters: NDArray[np.float64]
    mesh_ranges: NDArray[np.int64]
    mesh_points: NDArray[np.float64]
    mesh_triangles: NDArray[np.int32]


class Prototypes:
    """Distinct shapes (by kind and numbers) and meshes (by their contents), as they come.

    Of the shapes of a scene, `among` its `nodes`, many that differ in size alone are one unit, see
    `dsl.sizes`. `equal` counts nodes that were equal to an earlier one, `empty` meshes without
    triangles.
    """

    def __init__(self, among: Iterable[Node] = ()) -> None:
        self.nodes: list[Shape | Mesh] = []
        self.equal = self.empty = 0
        self._numbers: dict[object, int] = {}
        self._digests: dict[tuple[int, int], bytes] = {}
        self._units = scaled_units([node for node in among if isinstance(node, Shape)])

    def index(self, node: Node) -> Leaf | None:
        """The prototype that `node` is; None where it is none or draws nothing."""
        key: object
        size: Transform | None = None
        if isinstance(node, Shape):
            key = (node.kind, node.parameters)
            if self._units and not node.sized:
                unit = unit_of(node.kind, node.parameters)
                if unit is not None and (node.kind, unit[0]) in self._units:
                    key = (node.kind, unit[0])
                    size = Transform((Step(StepKind.SCALE, np.array(unit[1])),))
                    if key not in self._numbers:
                        node = Shape(node.kind, unit[0])
        elif isinstance(node, Mesh):
            if not len(node.triangles):
                self.empty += 1
                return None
            key = self._contents(node)
        else:
            return None
        number = self._numbers.setdefault(key, len(self.nodes))
        if number == len(self.nodes):
            self.nodes.append(node)
        else:
            self.equal += 1
        return Leaf(number, size)

    def _contents(self, mesh: Mesh) -> tuple[object, ...]:
        """Equal for meshes of the same points and faces, with the very same attributes."""
        arrays = (id(mesh.points), id(mesh.triangles))
        if arrays not in self._digests:
            import hashlib  # which loads a library of its own, and few scenes have meshes

            points = hashlib.blake2b((mesh.points + 0.0).tobytes())  # -0 is 0
            triangles = hashlib.blake2b(mesh.triangles.astype(np.int64).tobytes())
            self._digests[arrays] = points.digest() + triangles.digest()
        return (self._digests[arrays], *map(id, mesh.attributes))

    def sizes(self) -> NDArray[np.float64]:
        """What no coordinate of each prototype exceeds; of a plane, that of its origin."""
        small: list[tuple[int, FloatArray]] = []
        found = np.zeros(len(self.nodes))
        for number, node in enumerate(self.nodes):
            if not isinstance(node, Mesh):
                found[number] = _size(node)
            elif 0 < len(node.points) <= _SMALL:
                small.append((number, node.points))
            else:
                found[number] = np.abs(node.points).max(initial=0.0)
        # NumPy takes microseconds for a call, however few the points.
        for first in range(0, len(small), _SMALL):
            numbers, points = zip(*small[first : first + _SMALL], strict=True)
            firsts = np.cumsum([0, *map(len, points[:-1])])
            found[list(numbers)] = np.maximum.reduceat(
                np.abs(np.concatenate(points)).max(axis=1), firsts
            )
        return found

    def arrays(self, used: Sequence[int]) -> PrototypeArrays:
        """The tables of the prototypes numbered in `used`, in that order."""
        kinds: list[int] = []
        data: list[int] = []
        parameters: list[float] = []
        ranges: list[tuple[int, int, int, int]] = []
        points: list[NDArray[np.float64]] = []
        triangles: list[NDArray[np.int64]] = []
        point_count = triangle_count = 0
        for number in used:
            node = self.nodes[number]
            if isinstance(node, Shape):
                kinds.append(KINDS.index(node.kind))
                data.append(len(parameters))
                parameters += [float(v) + 0.0 for v in node.parameters]
            else:
                kinds.append(MESH)
                data.append(len(ranges))
                ends = point_count + len(node.points), triangle_count + len(node.triangles)
                ranges.append((point_count, ends[0], triangle_count, ends[1]))
                point_count, triangle_count = ends
                points.append(node.points)
                triangles.append(node.triangles)
        return PrototypeArrays(
            np.array(kinds, dtype=np.uint8),
            np.array(data, dtype=np.int64),
            np.array(parameters, dtype=np.float64),
            np.array(ranges, dtype=np.int64).reshape(-1, 4),
            np.concatenate([np.empty((0, 3)), *points]),
            np.concatenate([np.empty((0, 3), dtype=np.int32), *triangles], dtype=np.int32),
        )

    def meshes(self, used: Sequence[int]) -> list[Mesh]:
        """The meshes among the prototypes numbered in `used`, in that order."""
        return [node for node in map(self.nodes.__getitem__, used) if isinstance(node, Mesh)]


_SMALL = 1024
"""Points of a mesh that is measured together with others, and how many meshes are."""


def _size(node: Shape) -> float:
    if node.kind is ShapeKind.TORUS:
        return sum(node.parameters)
    lengths = node.parameters
    if node.kind is ShapeKind.WEDGE:
        lengths = lengths[:4]  # the others are angles, and the bevel
    return max(map(abs, lengths), default=0.0)
