"""Whether a SceneIR is sound: for those that do not come from `flatten`."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import islice

import numpy as np
from numpy.typing import NDArray

from compiler import ir
from compiler.attributes import faults
from compiler.ir import COLUMNS, COUNTED, KINDS, MESH, SceneIR, leaf_counts
from compiler.rows import needs_default_material
from dsl.codes import diagnostic
from dsl.diagnostics import Diagnostic
from dsl.limits import broken_limit
from dsl.scene import SHAPE_PARAMETERS, ShapeKind

_MOST_FAULTS = 50


def validate(scene: SceneIR) -> list[Diagnostic]:
    """The faults of `scene`: types, indices, ranges, numbers that are not finite; [] if sound.

    At most 50 are told.
    """
    for check in (
        _columns,
        _prototypes,
        _groups,
        _instances,
        _appearance,
        _texts,
        _sources,
        faults,
    ):
        # Each check may rely on what those before it have found sound.
        if found := list(islice(check(scene), _MOST_FAULTS)):
            return [diagnostic("ir-invalid", fault) for fault in found]
    return []


def _columns(scene: SceneIR) -> Iterator[str]:
    for name, (dtype, row) in COLUMNS.items():
        array = getattr(scene, name)
        if array.dtype != dtype or array.shape[1:] != row or array.ndim != 1 + len(row):
            yield f"`{name}` is {array.dtype} {array.shape}, not {dtype} {('n', *row)}"
    if not len(scene.group_ranges):
        yield "there is no root group"
    count = len(scene.instance_target)
    for name in (
        "world_from_object",
        "object_from_world",
        "instance_material",
        "instance_source",
        "translation_low",
    ):
        rows = len(getattr(scene, name))
        if rows != count and not (name == "translation_low" and rows == 0):
            yield f"`{name}` has {rows} rows for {count} instances"
    for names in (
        ("prototype_kind", "prototype_data"),
        ("source_parent", "source_origin", "source_index"),
    ):
        if len({len(getattr(scene, name)) for name in names}) > 1:
            yield f"`{'`, `'.join(names)}` differ in length"
    if len(scene.settings) != 1:
        yield f"there are {len(scene.settings)} settings, not 1"


def _prototypes(scene: SceneIR) -> Iterator[str]:
    points, triangles = len(scene.mesh_points), len(scene.mesh_triangles)
    if not np.isfinite(scene.mesh_points).all():
        yield "a mesh has points that are not finite"
    for mesh, (first_point, end_point, first, end) in enumerate(scene.mesh_ranges.tolist()):
        if not (0 <= first_point <= end_point <= points and 0 <= first <= end <= triangles):
            yield f"mesh {mesh} lies outside of the points or triangles"
        elif end > first and not _within(scene.mesh_triangles[first:end], end_point - first_point):
            yield f"mesh {mesh} has triangles of points that are not there"
    if not _within(scene.prototype_kind, len(KINDS)):
        yield "a prototype is of no known kind"
        return
    columns = scene.prototype_kind.tolist(), scene.prototype_data.tolist()
    for prototype, (kind, data) in enumerate(zip(*columns, strict=True)):
        if kind == MESH:
            sound = 0 <= data < len(scene.mesh_ranges)
        else:
            shape = ShapeKind(KINDS[kind])
            end = data + len(SHAPE_PARAMETERS[shape])
            sound = data >= 0 and end <= len(scene.shape_parameters)
            if sound and (broken := broken_limit(shape, scene.shape_parameters[data:end].tolist())):
                yield f"`{shape} {prototype}` cannot be: {broken.message}"
        if not sound:
            yield f"prototype {prototype} has no data"


def _groups(scene: SceneIR) -> Iterator[str]:
    ranges = scene.group_ranges
    tiled = ranges[0, 0] == 0 and ranges[-1, 1] == len(scene.instance_target)
    if not tiled or (ranges[1:, 0] != ranges[:-1, 1]).any() or (ranges[:, 0] > ranges[:, 1]).any():
        yield "the groups do not follow one another over all instances"
        return
    target = scene.instance_target
    if not _within(target[target >= 0], len(scene.prototype_kind)):
        yield "an instance is of a prototype that is not there"
    if not _within(~target[target < 0], len(ranges)):
        yield "an instance is of a group that is not there"
        return
    try:
        leaf_counts(scene)
    except ValueError as fault:
        yield str(fault)


def _instances(scene: SceneIR) -> Iterator[str]:
    for name in ("world_from_object", "object_from_world", "translation_low"):
        if not np.isfinite(getattr(scene, name)).all():
            yield f"`{name}` has entries that are not finite"
    code = scene.instance_material
    if not _within(np.where(code < -1, -2 - code, code)[code != -1], len(scene.materials)):
        yield "an instance has a material that is not there"
    columns = scene.group_ranges, scene.instance_target, code
    if not len(scene.materials) and needs_default_material(*columns):
        yield "an instance needs the default material, which is not there"
    if not _within(scene.instance_source, len(scene.source_parent), lowest=-1):
        yield "an instance has a source that is not there"


def _appearance(scene: SceneIR) -> Iterator[str]:
    for name in ir.MATERIAL.names or ():
        if not np.isfinite(scene.materials[name]).all():
            yield f"a material's {name} is not finite"
    for name in ("vector", "color", "size", "u", "v", "w", "cone", "softness", "focus"):
        if not np.isfinite(scene.lights[name]).all():
            yield f"a light's {name} is not finite"
    shaped = (scene.lights["cone"] < 180.0) | (scene.lights["focus"] > 0.0)
    if (shaped & (scene.lights["kind"] == ir.POINT) & ~scene.lights["w"].any(axis=1)).any():
        yield "a light's cone has no direction"
    textured = scene.lights[scene.lights["file"] != 0]
    axes = np.stack([textured["u"], textured["v"], textured["w"]], axis=1)
    if (textured["kind"] != ir.SKY).any() or not np.allclose(
        axes @ axes.transpose(0, 2, 1), np.eye(3), rtol=0.0, atol=1e-9
    ):
        yield "a light has a texture, and is no sky with three perpendicular unit axes"
    lens = ("exposure", "lens_radius", "focus_distance", "shutter")
    for name in ("world_from_camera", "height", "shift", "near", *lens):
        if not np.isfinite(scene.cameras[name]).all():
            yield f"a camera's {name} is not finite"
    if not (scene.cameras["height"] > 0).all() or (scene.cameras["aspect"] <= 0).any():
        yield "a camera's window has no extent"
    if not (scene.cameras["far"] > scene.cameras["near"]).all():
        yield "a camera's far is not beyond its near"
    settings = scene.settings[0]
    for column, count, what in (
        (scene.lights["kind"], len(ir.LIGHTS), "a light is of no known kind"),
        (scene.cameras["projection"], ir.ORTHOGRAPHIC + 1, "a camera has no known projection"),
        (int(settings["integrator"]) + 1, len(ir.INTEGRATORS) + 1, "there is no such integrator"),
        (int(settings["precision"]) + 1, len(ir.PRECISIONS) + 1, "there is no such precision"),
        (settings["up"], len(ir.UP_AXES), "there is no such up axis"),
    ):
        if not _within(np.atleast_1d(column), count):
            yield what
    if min(settings["width"], settings["height"], settings["samples"]) < 0:
        yield "a size or number of samples is negative"


def _texts(scene: SceneIR) -> Iterator[str]:
    ends = scene.text_ends
    if (np.diff(ends, prepend=0) < 0).any() or (ends[-1:] != len(scene.text_bytes)).any():
        yield "the texts do not follow one another over all bytes"
        return
    try:
        for index in range(len(ends)):
            scene.text(index)
    except UnicodeDecodeError:
        yield "a text is not UTF-8"
    if not _within(scene.cameras["name"], len(ends)):
        yield "a camera has a name that is not there"
    if not _within(scene.lights["file"], len(ends) + 1):
        yield "a light has a texture that is not there"


def _sources(scene: SceneIR) -> Iterator[str]:
    texts = len(scene.text_ends)
    for name, lowest in (("file", 0), ("label", 0), ("prim", -1)):
        if not _within(scene.origins[name], texts, lowest=lowest):
            yield f"an origin has a {name} that is not there"
    if not _within(scene.source_origin, len(scene.origins)):
        yield "a source has an origin that is not there"
    if (scene.source_parent < -1).any() or (
        scene.source_parent >= np.arange(len(scene.source_parent))
    ).any():
        yield "a source does not follow the one it is below"
    if (scene.source_index < COUNTED).any():
        yield "a source has a negative index"


def _within(values: NDArray[np.integer], count: int, lowest: int = 0) -> bool:
    return bool(((values >= lowest) & (values < count)).all())
