"""What varies over surfaces as tables of the IR: attributes of meshes, textures of materials."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from compiler import ir
from compiler.ir import SceneIR
from compiler.provenance import Texts
from dsl.scene import Material, Mesh, MeshAttribute


class AttributeArrays(NamedTuple):
    """The attribute tables of an IR."""

    mesh_attributes: NDArray[np.void]
    attribute_values: NDArray[np.float32]
    attribute_corners: NDArray[np.int32]


def attribute_arrays(meshes: Iterable[Mesh], texts: Texts) -> AttributeArrays:
    """The tables of the attributes of meshes, which are numbered as they come."""
    rows: list[tuple[int, int, int, int, int, int, int]] = []
    values: list[NDArray[np.float32]] = [np.empty(0, np.float32)]
    corners: list[NDArray[np.int32]] = [np.empty(0, np.int32)]
    value_count = corner_count = 0
    for mesh, node in enumerate(meshes):
        for attribute in node.attributes:
            own = np.ascontiguousarray(attribute.values, dtype=np.float32)
            first_corner = -1 if attribute.corners is None else corner_count
            end = value_count + own.size
            width = own.shape[1]
            rows.append(
                (mesh, texts.index(attribute.name), width, 0, value_count, end, first_corner)
            )
            values.append(own.reshape(-1))
            value_count = end
            if attribute.corners is not None:
                corners.append(attribute.corners.astype(np.int32).reshape(-1))
                corner_count += attribute.corners.size
    return AttributeArrays(
        np.array(rows, dtype=ir.MESH_ATTRIBUTE), np.concatenate(values), np.concatenate(corners)
    )


def mesh_attributes(scene: SceneIR, mesh: int) -> Iterator[MeshAttribute]:
    """The attributes of one mesh of an IR, as views."""
    _, _, first, end = scene.mesh_ranges[mesh].tolist()
    for record in scene.mesh_attributes[scene.mesh_attributes["mesh"] == mesh]:
        values = scene.attribute_values[record["first_value"] : record["end_value"]]
        corners = None
        if record["first_corner"] >= 0:
            at = int(record["first_corner"])
            corners = scene.attribute_corners[at : at + 3 * (end - first)].reshape(-1, 3)
        yield MeshAttribute(
            scene.text(int(record["name"])), values.reshape(-1, int(record["width"])), corners
        )


def texture_table(materials: Sequence[Material], texts: Texts) -> NDArray[np.void]:
    """`SceneIR.textures`."""
    rows = [
        (
            number,
            ir.TEXTURED.index(texture.parameter),
            texts.index(texture.file),
            texts.index(texture.attribute),
            ir.CHANNELS.index(texture.channels),
            *(ir.WRAPS.index(wrap) for wrap in texture.wrap),
            ir.COLOR_SPACES.index(texture.color_space),
            texture.scale,
            texture.bias,
            texture.fallback,
            texture.matrix,
        )
        for number, material in enumerate(materials)
        for texture in material.textures
    ]
    return np.array(rows, dtype=ir.TEXTURE)


def faults(scene: SceneIR) -> Iterator[str]:
    """What is wrong with the tables, in words; texts and meshes are known to be sound."""
    for record in scene.mesh_attributes:
        mesh, width = int(record["mesh"]), int(record["width"])
        first, end, corner = (int(record[n]) for n in ("first_value", "end_value", "first_corner"))
        if not 0 <= mesh < len(scene.mesh_ranges) or not 0 <= record["name"] < len(scene.text_ends):
            yield "an attribute has a mesh or name that is not there"
            continue
        if (
            width < 1
            or not 0 <= first <= end <= len(scene.attribute_values)
            or (end - first) % width
        ):
            yield "an attribute lies outside of the values"
            continue
        first_point, end_point, first_triangle, end_triangle = scene.mesh_ranges[mesh].tolist()
        count = (end - first) // width
        if corner < 0:
            if corner != -1 or count != end_point - first_point:
                yield "an attribute does not have a value for each point"
            continue
        rows = scene.attribute_corners[corner : corner + 3 * (end_triangle - first_triangle)]
        inside = len(rows) == 3 * (end_triangle - first_triangle)
        if not inside or ((rows < 0) | (rows >= count)).any():
            yield "an attribute has corners without a value"
    if not np.isfinite(scene.attribute_values).all():
        yield "an attribute has values that are not finite"
    for name, count in (
        ("material", len(scene.materials)),
        ("parameter", len(ir.TEXTURED)),
        ("file", len(scene.text_ends)),
        ("attribute", len(scene.text_ends)),
        ("channels", len(ir.CHANNELS)),
        ("wrap_s", len(ir.WRAPS)),
        ("wrap_t", len(ir.WRAPS)),
        ("color_space", len(ir.COLOR_SPACES)),
    ):
        column = scene.textures[name]
        if ((column < 0) | (column >= count)).any():
            yield f"a texture has a {name} that is not there"
    for name in ("scale", "bias", "fallback", "matrix"):
        if not np.isfinite(scene.textures[name]).all():
            yield f"a texture's {name} is not finite"
