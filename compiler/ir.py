"""The flat scene: what the runtime reads.

Arrays only, no Python objects, no pointers: every reference is an index. An IR holds exactly what
its scene requires; tables of what the scene does not use are empty.
"""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dsl.scene import MATERIAL_PARAMETERS, ShapeKind

VERSION = 1

KINDS: tuple[str, ...] = (*(kind.value for kind in ShapeKind), "mesh")
"""`prototype_kind` indexes this."""
MESH = KINDS.index("mesh")

MATERIAL = np.dtype(
    [
        ("diffuse", "<f8", 3),
        ("emission", "<f8", 3),
        ("specular", "<f8", 3),
        ("metallic", "<f8"),
        ("roughness", "<f8"),
        ("clearcoat", "<f8"),
        ("clearcoat_roughness", "<f8"),
        ("opacity", "<f8"),
        ("opacity_threshold", "<f8"),
        ("ior", "<f8"),
        ("specular_workflow", "<i4"),
        ("reserved", "<i4"),
    ]
)
"""One material: `dsl.scene.Material`, flat."""

MESH_ATTRIBUTE = np.dtype(
    [
        ("mesh", "<i4"),  # row of mesh_ranges
        ("name", "<i4"),  # text
        ("width", "<i4"),  # numbers of a value
        ("reserved", "<i4"),
        ("first_value", "<i8"),  # of attribute_values
        ("end_value", "<i8"),
        ("first_corner", "<i8"),  # of attribute_corners, three for each triangle; -1: by point
    ]
)
"""One attribute of a mesh: `dsl.scene.MeshAttribute`."""

TEXTURED = (*MATERIAL_PARAMETERS, "normal", "displacement", "occlusion")
CHANNELS = ("r", "g", "b", "a", "rgb")
WRAPS = ("black", "clamp", "repeat", "mirror", "useMetadata")
COLOR_SPACES = ("auto", "raw", "sRGB")
TEXTURE = np.dtype(
    [
        ("material", "<i4"),
        ("parameter", "<i4"),  # index of TEXTURED
        ("file", "<i4"),  # text
        ("attribute", "<i4"),  # text
        ("channels", "<i4"),  # index of CHANNELS
        ("wrap_s", "<i4"),  # index of WRAPS
        ("wrap_t", "<i4"),
        ("color_space", "<i4"),  # index of COLOR_SPACES
        ("scale", "<f8", 4),
        ("bias", "<f8", 4),
        ("fallback", "<f8", 4),
        ("matrix", "<f8", 6),
    ]
)
"""One texture of a material: `dsl.scene.Texture`, flat."""

SUN, POINT, SKY, RECTANGLE, DISC, CYLINDER = 0, 1, 2, 3, 4, 5
LIGHTS = ("sun", "point", "sky", "rectangle", "disc", "cylinder")
LIGHT = np.dtype(
    [
        ("kind", "<i4"),  # index of LIGHTS
        ("file", "<i4"),  # skies: 1 + text of the texture's name, 0: none
        ("vector", "<f8", 3),  # world space: sun, unit direction of travel; others, position
        ("color", "<f8", 3),  # sun, irradiance; point, intensity; others, radiance
        ("size", "<f8"),  # sun, angular diameter in degrees; point, radius
        ("u", "<f8", 3),  # surfaces, world space: as `dsl.scene.AreaLight`; skies with a texture:
        ("v", "<f8", 3),  # x, y and z of their own space, orthonormal
        ("w", "<f8", 3),  # shaped points: unit direction
        ("cone", "<f8"),  # points and surfaces: as `dsl.scene.Shaping`
        ("softness", "<f8"),
        ("focus", "<f8"),
    ]
)

PERSPECTIVE, ORTHOGRAPHIC = 0, 1
CAMERA = np.dtype(
    [
        ("projection", "<i4"),
        ("name", "<i4"),  # index of a text
        ("world_from_camera", "<f8", (3, 4)),  # columns: right, up, back (unit), position
        ("height", "<f8"),
        ("aspect", "<f8"),  # NaN: the picture's
        ("shift", "<f8", 2),
        ("near", "<f8"),
        ("far", "<f8"),
        ("exposure", "<f8"),
        ("lens_radius", "<f8"),
        ("focus_distance", "<f8"),
        ("shutter", "<f8", 2),
    ]
)
"""One camera: `dsl.scene.Camera`, placed; scales of its transform are in the other fields."""

SETTINGS = np.dtype(
    [
        ("width", "<i4"),  # 0: not said
        ("height", "<i4"),
        ("samples", "<i4"),
        ("integrator", "<i4"),  # index of INTEGRATORS, -1: not said
        ("precision", "<i4"),  # index of PRECISIONS, -1: not said
        ("up", "<i4"),  # index of UP_AXES: what is up for a camera that has to be made up
        ("occlusion_distance", "<f8"),  # NaN: not said
        ("exposure", "<f8"),
    ]
)
INTEGRATORS = ("direct", "ambient_occlusion", "normals", "ids")
PRECISIONS = ("float32", "float64")
UP_AXES = ("y", "z")

ORIGIN = np.dtype(
    [
        ("file", "<i4"),  # text: the source's or the stage's name
        ("prim", "<i4"),  # text: the prim path, or -1 for a span of source text
        ("start", "<i8"),  # UTF-8 byte offsets of the span
        ("end", "<i8"),
        ("label", "<i4"),  # text: the path segment
        ("point", "<i4"),  # 1: a point instancer's segment, see dsl.scene.Origin
    ]
)

MAX_LEAVES = 10**12

COUNTED = -2
"""The `source_index` of a batch numbered 0, 1, 2, …: the instance's place among the instances
that have the same `instance_source`, which are contiguous."""


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class SceneIR:
    """A scene as flat arrays. Shapes and dtypes as noted, all C-contiguous, little endian.

    Group 0 is the root; others are numbered as they are first referred to, and so are prototypes
    and materials, but material 0 is DEFAULT_MATERIAL wherever an instance may come to need it.
    Instances of one group are contiguous and in order of emission.
    An instance's *leaf number*, which hits report, counts the leaves before it in that order
    with every group expanded (`leaf_counts`); without kept groups it is the row of the table.
    """

    # Prototypes
    prototype_kind: NDArray[np.uint8]  # (p,) index of KINDS
    prototype_data: NDArray[np.int64]  # (p,) first of its shape_parameters, or its mesh
    shape_parameters: NDArray[np.float64]  # (k,) as dsl.scene.SHAPE_PARAMETERS
    mesh_ranges: NDArray[np.int64]  # (q, 4) first and end point, first and end triangle
    mesh_points: NDArray[np.float64]  # (v, 3) object space
    mesh_triangles: NDArray[np.int32]  # (m, 3) indices into the mesh's own points

    # Groups and instances
    group_ranges: NDArray[np.int64]  # (g, 2) first and end instance
    instance_target: NDArray[np.int32]  # (n,) a prototype, or ~group
    world_from_object: NDArray[np.float64]  # (n, 3, 4) "world" is the enclosing group's space
    object_from_world: NDArray[np.float64]  # (n, 3, 4) its inverse, composed beside it
    translation_low: NDArray[np.float32]  # (n, 3) exact translation minus the rounded one in
    #   world_from_object, or (0, 3) where all of them are zero
    instance_material: NDArray[np.int32]  # (n,) m: bound; -1: none of its own, inherits from
    #   the instance above, at last DEFAULT_MATERIAL (index 0); -2 - m: overrides all below
    instance_source: NDArray[np.int32]  # (n,) index of the source_* tables

    # Appearance
    materials: NDArray[np.void]  # (m,) MATERIAL
    lights: NDArray[np.void]  # (l,) LIGHT
    cameras: NDArray[np.void]  # (c,) CAMERA
    settings: NDArray[np.void]  # (1,) SETTINGS

    # Where it came from: one chain of segments per instance, from its own up to its group's
    source_parent: NDArray[np.int32]  # (s,) the segment above, -1 at the top
    source_origin: NDArray[np.int32]  # (s,) index of origins
    source_index: NDArray[np.int32]  # (s,) index among siblings, -1: none, or COUNTED
    origins: NDArray[np.void]  # (o,) ORIGIN
    text_ends: NDArray[np.int64]  # (x,) end of each text in text_bytes
    text_bytes: NDArray[np.uint8]  # UTF-8

    # What varies over surfaces
    mesh_attributes: NDArray[np.void] = field(default_factory=lambda: np.zeros(0, MESH_ATTRIBUTE))
    attribute_values: NDArray[np.float32] = field(default_factory=lambda: np.zeros(0, np.float32))
    attribute_corners: NDArray[np.int32] = field(default_factory=lambda: np.zeros(0, np.int32))
    textures: NDArray[np.void] = field(default_factory=lambda: np.zeros(0, TEXTURE))  # by material

    @property
    def nbytes(self) -> int:
        """Bytes of all arrays."""
        return sum(int(getattr(self, column.name).nbytes) for column in fields(self))

    def __repr__(self) -> str:
        return (
            f"SceneIR({len(self.instance_target):,} instances, "
            f"{len(self.prototype_kind):,} prototypes, {self.nbytes:,} bytes)"
        )

    def text(self, index: int) -> str:
        """The text of that index."""
        start = int(self.text_ends[index - 1]) if index else 0
        return self.text_bytes[start : int(self.text_ends[index])].tobytes().decode()

    def sky_texture(self, light: int) -> str:
        """The name of the texture of that row of `lights`; "" where it has none."""
        number = int(self.lights["file"][light])
        return self.text(number - 1) if number else ""


COLUMNS: dict[str, tuple[np.dtype[Any], tuple[int, ...]]] = {
    "prototype_kind": (np.dtype("u1"), ()),
    "prototype_data": (np.dtype("<i8"), ()),
    "shape_parameters": (np.dtype("<f8"), ()),
    "mesh_ranges": (np.dtype("<i8"), (4,)),
    "mesh_points": (np.dtype("<f8"), (3,)),
    "mesh_triangles": (np.dtype("<i4"), (3,)),
    "group_ranges": (np.dtype("<i8"), (2,)),
    "instance_target": (np.dtype("<i4"), ()),
    "world_from_object": (np.dtype("<f8"), (3, 4)),
    "object_from_world": (np.dtype("<f8"), (3, 4)),
    "translation_low": (np.dtype("<f4"), (3,)),
    "instance_material": (np.dtype("<i4"), ()),
    "instance_source": (np.dtype("<i4"), ()),
    "materials": (MATERIAL, ()),
    "lights": (LIGHT, ()),
    "cameras": (CAMERA, ()),
    "settings": (SETTINGS, ()),
    "source_parent": (np.dtype("<i4"), ()),
    "source_origin": (np.dtype("<i4"), ()),
    "source_index": (np.dtype("<i4"), ()),
    "origins": (ORIGIN, ()),
    "text_ends": (np.dtype("<i8"), ()),
    "text_bytes": (np.dtype("u1"), ()),
    "mesh_attributes": (MESH_ATTRIBUTE, ()),
    "attribute_values": (np.dtype("<f4"), ()),
    "attribute_corners": (np.dtype("<i4"), ()),
    "textures": (TEXTURE, ()),
}
"""Each array's dtype and the shape of its rows."""


def groups_children_first(ir: SceneIR) -> list[int]:
    """All groups, each after those that its instances refer to; ValueError if one holds itself."""
    order: list[int] = []
    entered, done = set[int](), set[int]()
    stack = list(reversed(range(len(ir.group_ranges))))
    while stack:
        group = stack[-1]
        missing = [int(g) for g in np.unique(_groups_in(ir, group)) if g not in done]
        if group in done or not missing:
            stack.pop()
            if group not in done:
                done.add(group)
                order.append(group)
        elif group in entered:
            raise ValueError(f"group {group} contains itself")
        else:
            entered.add(group)
            stack += missing
    return order


def leaf_counts(ir: SceneIR) -> NDArray[np.int64]:
    """Leaves of each group with all groups in it expanded, `(g,)`.

    Raises ValueError where groups contain themselves or a count exceeds `MAX_LEAVES`.
    """
    counts = np.zeros(len(ir.group_ranges), dtype=np.int64)
    for group in groups_children_first(ir):
        first, end = ir.group_ranges[group]
        below, times = np.unique(_groups_in(ir, group), return_counts=True)
        total = int(end - first - times.sum())
        total += sum(int(counts[g]) * int(n) for g, n in zip(below, times, strict=True))
        if total > MAX_LEAVES:
            raise ValueError(f"group {group} has more than {MAX_LEAVES} leaves")
        counts[group] = total
    return counts


def _groups_in(ir: SceneIR, group: int) -> NDArray[np.int32]:
    first, end = ir.group_ranges[group]
    target = ir.instance_target[first:end]
    return ~target[target < 0]
