"""The lights and cameras of a scene graph, placed in the world."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import get_args

import numpy as np

from compiler.affine import Affine, Placement
from compiler.appearance import contributes
from compiler.compress import Leaf, compress
from compiler.expand import expand, plan
from compiler.place import Frames
from compiler.provenance import Origins
from compiler.reach import Reason, extent, left_out, reasons
from compiler.rows import Sources
from compiler.walk import Walk
from dsl.codes import diagnostic
from dsl.diagnostics import Diagnostic
from dsl.scene import AreaLight, Camera, Light, Node, PointLight, Sky

MAX_LIGHTS = 100_000
_PLACED = frozenset((*get_args(Light), Camera))


@dataclass(slots=True)
class PlacedLights:
    """Lights and cameras with their `world_from_object` (of one lane), in order of emission.

    `dark` counts the lights that are left out because they cannot contribute.
    """

    lights: list[tuple[Light, Affine]] = field(default_factory=list)
    cameras: list[tuple[Camera, Affine]] = field(default_factory=list)
    dark: int = 0
    diagnostics: list[Diagnostic] = field(default_factory=list)


def place_lights(walk: Walk) -> PlacedLights:
    """Place all lights and cameras; for them no group is kept, and their number is limited."""
    nodes: list[Light | Camera] = []
    placed = PlacedLights()
    if _PLACED.isdisjoint(map(type, walk.order)):
        return placed

    def index(node: Node) -> Leaf | None:
        if isinstance(node, Light) and not contributes(node):
            placed.dark += 1
        elif isinstance(node, Light | Camera):
            nodes.append(node)
            return Leaf(len(nodes) - 1)
        return None

    origins = Origins()
    branches = compress(walk, index, lambda _: 0, origins)
    planned = plan(branches)
    if planned.leaves[-1] > MAX_LIGHTS:
        message = f"{planned.leaves[-1]} lights and cameras exceed the limit of {MAX_LIGHTS}"
        place = nodes[0].origin.place if nodes[0].origin else None
        mend = "place lights outside of repeated objects"
        placed.diagnostics.append(diagnostic("scene-too-many-lights", message, place, help=mend))
        return placed
    (table,) = expand(branches, planned).values()
    targets = table.leaf_target.numbers
    found = np.zeros(len(targets), dtype=np.uint8)
    placements: dict[int, Placement] = {}
    frames = Frames(branches.chains, table)
    for chunk in frames.chunks():
        numbers = np.arange(len(targets))[chunk.leaves].tolist()
        placement = frames.placements(chunk)
        placements.update((leaf, placement.take(lane)) for lane, leaf in enumerate(numbers))
    for leaf, number in enumerate(targets.tolist()):
        node, placement = nodes[number], placements[leaf]
        found[leaf] = reason = _reason(node, placement)
        if reason != Reason.NONE:
            continue
        if isinstance(node, Camera):
            placed.cameras.append((node, placement.forward))
        else:
            placed.lights.append((node, placement.forward))
    sources = Sources(
        table.source_parent.numbers, table.source_origin.numbers, table.source_index.numbers
    )
    placed.diagnostics += left_out(found, table.leaf_source.numbers, sources, origins)
    return placed


def _reason(node: Light | Camera, placement: Placement) -> int:
    """The `Reason` why a light or camera is left out, if it is."""
    forward, inverse = np.empty((2, 1, 3, 4))
    placement.forward.round_into(forward)
    placement.inverse.round_into(inverse)
    if isinstance(node, Sky):
        # A sky is as far away whatever moves it.
        forward[..., 3] = inverse[..., 3] = 0.0
    size = np.array([_size(node)])
    (reason,) = reasons(extent(forward, inverse), size, np.ones(1)).tolist()
    return Reason.NONE if isinstance(node, Sky) and not node.texture else int(reason)


def _size(node: Light | Camera) -> float:
    """What no coordinate of a light or camera in its own space exceeds."""
    match node:
        case PointLight():
            return max(*map(abs, node.position), node.radius)
        case AreaLight():
            return max(abs(x) for vector in (node.position, *node.axes) for x in vector)
        case _:
            return 0.0
