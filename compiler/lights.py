"""The lights and cameras of a scene graph, placed in the world."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import get_args

import numpy as np
from numpy.typing import NDArray

from compiler.affine import IDENTITY, Affine, Placement, scatter_placements
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
    """Lights and cameras, in order of emission, with their `world_from_object`, a lane for each.

    `dark` counts the lights that are left out because they cannot contribute.
    """

    lights: list[Light] = field(default_factory=list)
    cameras: list[Camera] = field(default_factory=list)
    of_lights: Affine = IDENTITY
    of_cameras: Affine = IDENTITY
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
    if not planned.leaves[-1]:
        return placed
    (table,) = expand(branches, planned).values()
    targets = table.leaf_target.numbers
    frames = Frames(branches.chains, table)
    leaves = np.arange(len(targets))
    parts = [(frames.placements(chunk), leaves[chunk.leaves]) for chunk in frames.chunks()]
    placement = scatter_placements(parts, len(leaves))
    found = _reasons([nodes[number] for number in targets.tolist()], placement)
    drawn = leaves[found == Reason.NONE]
    is_camera = np.array([isinstance(node, Camera) for node in nodes])[targets[drawn]]
    for leaf in drawn.tolist():
        node = nodes[targets[leaf]]
        if isinstance(node, Camera):
            placed.cameras.append(node)
        else:
            placed.lights.append(node)
    placed.of_cameras = placement.forward.take(drawn[is_camera])
    placed.of_lights = placement.forward.take(drawn[~is_camera])
    sources = Sources(
        table.source_parent.numbers, table.source_origin.numbers, table.source_index.numbers
    )
    placed.diagnostics += left_out(found, table.leaf_source.numbers, sources, origins)
    return placed


def _reasons(nodes: Sequence[Light | Camera], placement: Placement) -> NDArray[np.uint8]:
    """The `Reason` why each light or camera is left out, if it is."""
    forward, inverse = np.empty((2, len(nodes), 3, 4))
    placement.forward.round_into(forward)
    placement.inverse.round_into(inverse)
    # A sky is as far away whatever moves it.
    skies = np.array([isinstance(node, Sky) for node in nodes])
    forward[skies, :, 3] = inverse[skies, :, 3] = 0.0
    sizes = np.array([_size(node) for node in nodes])
    found = reasons(extent(forward, inverse), sizes, np.ones(len(nodes)))
    found[[isinstance(node, Sky) and not node.texture for node in nodes]] = Reason.NONE
    return found


def _size(node: Light | Camera) -> float:
    """What no coordinate of a light or camera in its own space exceeds."""
    match node:
        case PointLight():
            return max(*map(abs, node.position), node.radius)
        case AreaLight():
            return max(abs(x) for vector in (node.position, *node.axes) for x in vector)
        case _:
            return 0.0
