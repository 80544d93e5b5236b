"""Advice: what a scene says that is no fault, and is probably not meant.

Looked for among up to `MOST` instances, told of a place once, and `MOST_ADVICE` times in all.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from compiler.bounds import prototype_bounds
from compiler.ir import MESH, PERSPECTIVE, SceneIR
from dsl.codes import diagnostic
from dsl.diagnostics import Diagnostic, Label
from dsl.scene import FloatArray, IntArray
from dsl.spans import Source, Span

MOST = 200_000
MOST_ADVICE = 20
WORST_CONDITION = 1e8
"""The largest condition number of a transform that nothing is said about."""
_ODD = 0x9E3779B97F4A7C15
"""The golden ratio in 64 bits: its powers hash rows."""
_MARGIN = 2.0
"""How many times as wide as its window a camera is taken to see: pictures have many shapes."""


class _Finding(NamedTuple):
    """Rows of the instance table to which one remark applies; `beside` names others."""

    code: str
    rows: IntArray
    one: str
    many: str
    help: str
    beside: IntArray | None = None
    whole: bool = False  # said only where it holds for all that a place has made


def advise(scene: SceneIR, sources: Mapping[str, str]) -> list[Diagnostic]:
    """Advice on the objects of a program; `sources` are the texts of its files by name."""
    if not 0 < len(scene.instance_target) <= MOST:
        return []
    origin = _origins(scene)
    told: list[Diagnostic] = []
    with np.errstate(all="ignore"):
        for finding in _findings(scene):
            for found in _told(scene, sources, origin, finding):
                told.append(found)
                if len(told) == MOST_ADVICE:
                    return told
    return told


def _findings(scene: SceneIR) -> Iterator[_Finding]:
    earlier, later = _coincident(scene)
    yield _Finding(
        "advice-coincident",
        later,
        "this stands exactly where the same object stands already",
        "{} instances of this stand exactly where the same object stands already",
        "remove it, or move it",
        earlier,
    )
    yield _Finding(
        "advice-condition",
        _ill_conditioned(scene),
        "the transform stretches more than 10⁸ times as much in one direction as in another",
        "the transforms of {} instances stretch more than 10⁸ times as much in one direction as in "
        "another",
        "make its scales more alike, or render with `--precision float64`",
    )
    yield _Finding(
        "advice-no-area",
        _without_area(scene),
        "no triangle of this mesh has an area",
        "no triangle of this mesh has an area ({} instances)",
        "look at the points of the mesh, or leave it out",
        whole=True,
    )
    yield _Finding(
        "advice-outside",
        _outside(scene),
        "no camera sees this",
        "no camera sees any of the {} instances of this",
        "move it or a camera, or leave it out",
        whole=True,
    )


def _told(
    scene: SceneIR, sources: Mapping[str, str], origin: IntArray, finding: _Finding
) -> Iterator[Diagnostic]:
    """One diagnostic for each place that has made some of the rows."""
    of_rows = origin[finding.rows]
    for number, first, count in zip(
        *np.unique(of_rows, return_index=True, return_counts=True), strict=True
    ):
        if number < 0 or (finding.whole and count < int((origin == number).sum())):
            continue
        beside: tuple[Label, ...] = ()
        if finding.beside is not None:
            other = int(origin[finding.beside[first]])
            if other >= 0 and other != number:
                beside = (Label(_place(scene, sources, other), "the other one"),)
        message = finding.one if count == 1 else finding.many.format(count)
        place = _place(scene, sources, int(number))
        yield diagnostic(finding.code, message, place, help=finding.help, secondary=beside)


def _origins(scene: SceneIR) -> IntArray:
    """What made each row: an index of `origins`, or -1."""
    origin = np.append(scene.source_origin, -1)[scene.instance_source]
    return origin.astype(np.int64)


def _place(scene: SceneIR, sources: Mapping[str, str], number: int) -> Span:
    row = scene.origins[number]
    name = scene.text(int(row["file"]))
    return Span(Source(name, sources.get(name, "")), int(row["start"]), int(row["end"]))


def _coincident(scene: SceneIR) -> tuple[IntArray, IntArray]:
    """Rows of a group with the same target and placement: the earlier ones and the later ones."""
    matrices = scene.world_from_object.reshape(-1, 12)
    group = np.repeat(
        np.arange(len(scene.group_ranges)), np.diff(scene.group_ranges, axis=1).ravel()
    )
    factors = np.array([pow(_ODD, n, 1 << 64) for n in range(1, 15)], np.uint64).view(np.int64)
    hashed = matrices.view(np.int64) @ factors[:12]
    hashed += scene.instance_target * factors[12] + group * factors[13]
    order = np.argsort(hashed, kind="stable")
    a, b = order[:-1], order[1:]
    alike = hashed[a] == hashed[b]
    a, b = a[alike], b[alike]
    same = (matrices[a] == matrices[b]).all(axis=1) & (group[a] == group[b])
    same &= scene.instance_target[a] == scene.instance_target[b]
    return a[same], b[same]


def _ill_conditioned(scene: SceneIR) -> IntArray:
    """Rows whose matrices have Frobenius norms with too large a product; 3 for a rotation."""
    squares = [
        np.einsum("nij,nij->n", matrix[:, :, :3], matrix[:, :, :3])
        for matrix in (scene.world_from_object, scene.object_from_world)
    ]
    return np.flatnonzero(squares[0] * squares[1] > (3.0 * WORST_CONDITION) ** 2)


def _without_area(scene: SceneIR) -> IntArray:
    """Rows of meshes all of whose triangles have corners on one line."""
    flat = np.zeros(len(scene.prototype_kind) + 1, dtype=bool)
    for prototype in np.flatnonzero(scene.prototype_kind == MESH):
        first_point, _, first, end = scene.mesh_ranges[scene.prototype_data[prototype]]
        if end - first <= MOST:
            a, b, c = scene.mesh_points[first_point + scene.mesh_triangles[first:end].T]
            flat[prototype] = not np.cross(b - a, c - a).any()
    return np.flatnonzero(flat[np.maximum(scene.instance_target, -1)])


def _outside(scene: SceneIR) -> IntArray:
    """Rows of a scene without groups whose bounding balls no camera has in its widened view."""
    if not len(scene.cameras) or len(scene.group_ranges) > 1:
        return np.empty(0, dtype=np.int64)
    boxes = np.array([prototype_bounds(scene, p) for p in range(len(scene.prototype_kind))])
    boxes = boxes[scene.instance_target]
    matrices = scene.world_from_object
    size = np.sqrt(np.einsum("nij,nij->n", matrices[:, :, :3], matrices[:, :, :3]))
    radius = size * np.linalg.norm(boxes[:, 1] - boxes[:, 0], axis=1) / 2
    middle = boxes.mean(axis=1)
    center = np.einsum("nij,nj->ni", matrices[:, :, :3], middle) + matrices[:, :, 3]
    seen = ~np.isfinite(radius)  # planes
    for camera in scene.cameras:
        seen |= _in_view(camera, center, radius)
    return np.flatnonzero(~seen)


def _in_view(camera: np.void, center: FloatArray, radius: FloatArray) -> NDArray[np.bool_]:
    frame = camera["world_from_camera"]
    x, y, back = ((center - frame[:, 3]) @ frame[:, :3]).T
    depth = -back
    half = _MARGIN * camera["height"] / 2
    aspect = camera["aspect"] if camera["aspect"] > 0 else 2.0
    in_view: NDArray[np.bool_] = (depth + radius > camera["near"]) & (
        depth - radius < camera["far"]
    )
    shifts = 1.0 + 2.0 * np.abs(camera["shift"])
    for across, reach in ((x, half * max(1.0, aspect) * shifts[0]), (y, half * shifts[1])):
        if camera["projection"] == PERSPECTIVE:
            in_view &= np.abs(across) <= reach * (depth + radius) + radius * np.hypot(1.0, reach)
        else:
            in_view &= np.abs(across) <= reach + radius
    return in_view
