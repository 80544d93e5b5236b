"""Shapes and meshes as prototypes: what is equal is stored once."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from compiler.ir import KINDS, MESH
from dsl.scene import Mesh, Node, Shape


class PrototypeArrays(NamedTuple):
    """The prototype tables of an IR."""

    prototype_kind: NDArray[np.uint8]
    prototype_data: NDArray[np.int64]
    shape_parameters: NDArray[np.float64]
    mesh_ranges: NDArray[np.int64]
    mesh_points: NDArray[np.float64]
    mesh_triangles: NDArray[np.int32]


class Prototypes:
    """Distinct shapes (by kind and numbers) and meshes (by their arrays), as they come.

    `equal` counts nodes that were equal to an earlier one, `empty` meshes without triangles.
    """

    def __init__(self) -> None:
        self.nodes: list[Shape | Mesh] = []
        self.equal = self.empty = 0
        self._numbers: dict[object, int] = {}

    def index(self, node: Node) -> int | None:
        """The number of the prototype that `node` is; None where it is none or draws nothing."""
        key: object
        if isinstance(node, Shape):
            key = (node.kind, node.parameters)
        elif isinstance(node, Mesh):
            if not len(node.triangles):
                self.empty += 1
                return None
            key = (id(node.points), id(node.triangles), *map(id, node.attributes))
        else:
            return None
        number = self._numbers.setdefault(key, len(self.nodes))
        if number == len(self.nodes):
            self.nodes.append(node)
        else:
            self.equal += 1
        return number

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
