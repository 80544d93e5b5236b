"""Scene graph → SceneIR."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from compiler.appearance import (
    Materials,
    camera_table,
    light_table,
    material_table,
    settings_record,
)
from compiler.attributes import attribute_arrays, texture_table
from compiler.column import Integers
from compiler.compress import NO_MATERIAL, Branches, compress, overriding
from compiler.expand import Plan, plan
from compiler.ir import MAX_LEAVES, SceneIR
from compiler.lights import place_lights
from compiler.merge import merged
from compiler.prototypes import Prototypes
from compiler.provenance import Origins, Texts
from compiler.reach import Reason, left_out, left_out_rows
from compiler.rows import Rows, first_uses, needs_default_material, renumbered, rows, without
from compiler.walk import Load, walk
from dsl.codes import diagnostic
from dsl.diagnostics import Diagnostic
from dsl.limits import SIZES
from dsl.records import value
from dsl.scene import (
    DEFAULT_MATERIAL,
    SceneGraph,
    Settings,
)
from dsl.spans import Place

MAX_LEVELS = 32


@value
class Pruned:
    """What a scene has and its IR does without."""

    equal_shapes: int = 0
    empty_meshes: int = 0
    unused_materials: int = 0
    dark_lights: int = 0
    singular_instances: int = 0
    out_of_range_instances: int = 0


class Flattened(NamedTuple):
    """What `flatten` returns; `ir` is None where the diagnostics hold an error."""

    ir: SceneIR | None
    diagnostics: list[Diagnostic]
    pruned: Pruned


def flatten(graph: SceneGraph, load: Load) -> Flattened:
    """The flat scene that `graph` denotes; `load` reads the files it names.

    Chains are composed in double-double and rounded once. Instances whose transform has no
    inverse, and what is out of range (see `compiler.reach`), are left out with a warning.
    Settings said several times hold as said last.
    """
    walked = walk(graph.root, load)
    prototypes, materials, origins = Prototypes(walked.order), Materials(), Origins()
    materials.index(DEFAULT_MATERIAL)
    branches = compress(walked, prototypes.index, materials.index, origins)
    planned = plan(branches)
    if not planned.all_flat:
        branches = merged(branches)
        planned = plan(branches)
    lights = place_lights(walked)
    diagnostics = [*walked.diagnostics, *_too_much(branches, planned, origins), *lights.diagnostics]
    if any(d.severity == "error" for d in diagnostics):
        return Flattened(None, diagnostics, Pruned())

    sizes = prototypes.sizes()
    table, ordinary = rows(branches, planned, SIZES[1] / (4.0 * sizes.max(initial=1.0)))
    reasons = left_out_rows(table, ordinary, sizes)
    dropped = np.flatnonzero(reasons)
    if len(dropped):
        diagnostics += left_out(reasons[dropped], table.source[dropped], table.sources, origins)
        table = without(table, dropped)
    used_prototypes = first_uses(table.target[table.target >= 0], len(prototypes.nodes))
    used_materials = _used_materials(table, len(materials.nodes))
    used_origins = first_uses(table.sources.origin, len(origins.places))
    texts = Texts()
    cameras = camera_table(lights.cameras, lights.of_cameras, texts)
    light_records = light_table(lights.lights, lights.of_lights, texts)
    origin_table = origins.table(used_origins, texts)
    shown = [materials.nodes[m] for m in used_materials]
    attributes = attribute_arrays(prototypes.meshes(used_prototypes.tolist()), texts)
    textures = texture_table(shown, texts)
    text_ends, text_bytes = texts.arrays()
    ir = SceneIR(
        **prototypes.arrays(used_prototypes.tolist())._asdict(),
        group_ranges=table.ranges,
        instance_target=renumbered(table.target, used_prototypes),
        world_from_object=table.forward,
        object_from_world=table.inverse,
        translation_low=table.low if table.low.any() else np.zeros((0, 3), dtype=np.float32),
        instance_material=_renumbered_materials(table.material, used_materials),
        instance_source=table.source.astype(np.int32, copy=False),
        materials=material_table(shown),
        lights=light_records,
        cameras=cameras,
        settings=settings_record(n for n in walked.order if type(n) is Settings),
        source_parent=table.sources.parent.astype(np.int32, copy=False),
        source_origin=renumbered(table.sources.origin, used_origins),
        source_index=table.sources.number.astype(np.int32, copy=False),
        origins=origin_table,
        text_ends=text_ends,
        text_bytes=text_bytes,
        **attributes._asdict(),
        textures=textures,
    )
    singular = int(np.isin(reasons[dropped], (Reason.NO_INVERSE, Reason.NOT_FINITE)).sum())
    pruned = Pruned(
        equal_shapes=prototypes.equal,
        empty_meshes=prototypes.empty,
        unused_materials=len(materials.nodes) - len(set(used_materials) | {0}),
        dark_lights=lights.dark,
        singular_instances=singular,
        out_of_range_instances=len(dropped) - singular,
    )
    return Flattened(ir, diagnostics, pruned)


def _used_materials(table: Rows, count: int) -> list[int]:
    """Numbers below `count` in order of first use; 0, the default, first where it is needed."""
    codes = table.material[table.material != -1]
    if (codes < 0).any():
        codes = np.where(codes < 0, overriding(codes), codes)
    used = [int(m) for m in first_uses(codes, count)]
    if needs_default_material(table.ranges, table.target, table.material):
        return [0, *(m for m in used if m != 0)]
    return used


def _renumbered_materials(codes: Integers, used: list[int]) -> NDArray[np.int32]:
    overrides = codes < NO_MATERIAL
    if not overrides.any():
        return renumbered(codes, used)
    bound = renumbered(np.where(overrides, overriding(codes), codes), used)
    return np.where(overrides, overriding(bound), bound).astype(np.int32)


def _too_much(branches: Branches, planned: Plan, origins: Origins) -> list[Diagnostic]:
    """Errors for scenes beyond the limits, at the innermost place that exceeds them."""
    for limit, counts, code, words, mend in (
        (
            MAX_LEAVES,
            planned.leaves,
            "scene-too-many-instances",
            "instances exceed the limit of 10^12",
            "repeat fewer objects",
        ),
        (
            MAX_LEVELS,
            planned.levels,
            "scene-too-deep",
            f"levels of instances of groups exceed the limit of {MAX_LEVELS}",
            "place objects in fewer steps",
        ),
    ):
        for branch, count in enumerate(counts):
            if count > limit:
                place = _place(branches, branch, origins)
                return [diagnostic(code, f"{count} {words}", place, help=mend)]
    return []


def _place(branches: Branches, branch: int, origins: Origins) -> Place | None:
    for edge in branches.edges[branch]:
        if edge.batch >= 0:
            return origins.places[edge.batch]
        if edge.segments:
            return origins.places[edge.segments[0][0]]
    return None
