"""What a SceneIR holds, in figures."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from compiler.bounds import bounds
from compiler.ir import KINDS, LIGHTS, SceneIR, leaf_counts


@dataclass(frozen=True, slots=True)
class Summary:
    """Counts, memory and extent of a scene.

    `leaves` are the instances with every group expanded, `instances` the rows of the table;
    `bounds` is the world-space box of all bounded leaves as ((x, y, z), (x, y, z)), None where
    there are none; `skies` are their textures; `instance_bytes` is all memory but that of
    prototypes, per row.
    """

    leaves: int
    instances: int
    groups: int
    prototypes: dict[str, int]
    mesh_points: int
    mesh_triangles: int
    materials: int
    lights: dict[str, int]
    skies: tuple[str, ...]
    cameras: int
    bytes: int
    instance_bytes: float
    bounds: tuple[tuple[float, ...], tuple[float, ...]] | None


def summarize(scene: SceneIR) -> Summary:
    """The figures of a sound scene."""
    box = bounds(scene)
    prototype_bytes = sum(
        array.nbytes
        for array in (
            scene.prototype_kind,
            scene.prototype_data,
            scene.shape_parameters,
            scene.mesh_ranges,
            scene.mesh_points,
            scene.mesh_triangles,
        )
    )
    rows = len(scene.instance_target)
    return Summary(
        leaves=int(leaf_counts(scene)[0]),
        instances=rows,
        groups=len(scene.group_ranges),
        prototypes=_tally(scene.prototype_kind, KINDS),
        mesh_points=len(scene.mesh_points),
        mesh_triangles=len(scene.mesh_triangles),
        materials=len(scene.materials),
        lights=_tally(scene.lights["kind"], LIGHTS),
        skies=tuple(filter(None, map(scene.sky_texture, range(len(scene.lights))))),
        cameras=len(scene.cameras),
        bytes=scene.nbytes,
        instance_bytes=(scene.nbytes - prototype_bytes) / rows if rows else 0.0,
        bounds=None if box is None else (tuple(box[0].tolist()), tuple(box[1].tolist())),
    )


def _tally(kinds: NDArray[np.integer], names: tuple[str, ...]) -> dict[str, int]:
    """How many there are of each kind, those that there are."""
    counts = np.bincount(kinds, minlength=len(names))
    return {name: int(n) for name, n in zip(names, counts, strict=True) if n}
