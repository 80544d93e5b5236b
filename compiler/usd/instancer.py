"""Point instancers as batches of instances.

A point of instance i is placed by prototype root, scale, orientation, position, instancer, in this
order (UsdGeomPointInstancer). There is one batch per prototype, in the order of the `prototypes`
relationship; its rows are in the order of the instancer's arrays. Instances that their scale
presses flat come after it.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from pxr import UsdGeom

from compiler.column import Integers
from compiler.usd.clock import Clock
from compiler.usd.exact import exact_transforms
from compiler.usd.point_colors import PointColors, by_label, point_colors
from compiler.usd.primvars import inherits
from compiler.usd.report import Report
from compiler.usd.sheets import is_flat, pressed
from compiler.usd.xform import UNIT_SLACK, unit_quaternions
from dsl.scene import Bind, FloatArray, Group, Instances, Node, Origin, Step, StepKind, Transform

if TYPE_CHECKING:
    from compiler.usd.prims import Inherited
    from compiler.usd.traverse import Frame, Traversal

FEW = 8
"""Prototypes that are looked for one by one, in less memory and time than sorting takes."""
BLOCK = 1 << 14
"""Instances looked at together: arrays for all would leave holes in the heap."""


@dataclass(frozen=True, slots=True, eq=False)
class Points:
    """The arrays of an instancer that can be used.

    `prototypes` `(n,)`, `positions` `(n, 3)`, `scales` `(n, 3)` or None, `orientations` `(n, 4)`
    imaginary part first and near unit or None, all in the types that were authored; `usable`
    `(n,)`: neither masked nor faulty; `exact` `(n, 12)` are the matrices of all instances in double
    precision, instead of the rest.
    """

    prototypes: NDArray[np.integer]
    positions: NDArray[Any]
    scales: NDArray[Any] | None
    orientations: NDArray[Any] | None
    usable: NDArray[np.bool_]
    exact: FloatArray | None

    def steps(self, chosen: Integers) -> tuple[Step, ...]:
        """Scale, orientation and position of the chosen instances."""
        if self.exact is not None:
            return (Step(StepKind.MATRIX, self.exact[chosen]),)
        arrays = (
            (StepKind.SCALE, self.scales),
            (StepKind.ORIENT, self.orientations),
            (StepKind.TRANSLATE, self.positions),
        )
        return tuple(Step(kind, _taken(each, chosen)) for kind, each in arrays if each is not None)

    @property
    def flat(self) -> NDArray[np.bool_]:
        """Which instances a scale presses flat `(n,)`."""
        flat = np.zeros(len(self.usable), bool)
        if self.scales is None or self.exact is not None:
            return flat
        for some in _blocks(len(flat)):
            x, y, z = np.abs(self.scales[some]).T
            low, high = (f(f(x, y), z) for f in (np.minimum, np.maximum))
            suspect = np.flatnonzero(low <= np.finfo(np.float32).eps * high)
            stretch = np.sort(np.abs(_doubles(self.scales[some][suspect])), axis=1)
            flat[some][suspect] = is_flat(stretch) & ~is_flat(stretch[:, [1, 1, 2]])
        return flat

    def of_prototypes(self, count: int) -> list[Integers]:
        """The usable instances of each of `count` prototypes, in order."""
        if count <= FEW:
            return [_where(self.usable & (self.prototypes == k)) for k in range(count)]
        numbers = np.where(self.usable, self.prototypes, count)
        order = np.argsort(numbers, kind="stable").astype(np.int32)
        ends = np.cumsum(np.bincount(numbers, minlength=count + 1))
        return np.split(order, ends[:-1])[:count]

    def batch(self, child: Node, chosen: Integers, origin: Origin) -> Instances:
        """The chosen instances of a child."""
        indices = None if len(chosen) == len(self.usable) else chosen
        return Instances(child, Transform(self.steps(chosen)), indices, origin)


def point_batches(
    traversal: Traversal, prim: Any, inherited: Inherited, frame: Frame
) -> list[Node]:
    """The batches of one instancer, in the instancer's space."""
    instancer = UsdGeom.PointInstancer(prim)
    points = _read(instancer, traversal.clock, traversal.report)
    if points is None:
        return []
    origin = traversal.origin(prim.GetPath(), frame, point=True)
    colors = None
    if inherited.colored and traversal.binding(prim, inherited) is None:
        count = len(points.usable)
        colors = point_colors(prim, count, traversal.clock, traversal.report)
        # An opacity from above an instance is that instance's.
        above = colors is not None and inherits(
            prim, ("displayColor", "displayOpacity"), frame.base
        )
        frame.shared = frame.shared and not above
    material = traversal.material(prim, inherited, frame) if colors is None else None
    batches: list[Node] = []
    targets = instancer.GetPrototypesRel().GetForwardedTargets()
    flat_rows = points.flat
    for path, chosen in zip(targets, points.of_prototypes(len(targets)), strict=True):
        if not len(chosen):
            continue
        root = traversal.stage.GetPrimAtPath(path)
        if not root:
            message = f"instances of the missing prototype <{path}> are left out"
            traversal.report.add("usd-instancer", message, prim.GetPath())
            continue
        child, shared = traversal.prototype(root, inherited, frame.base.of_prototype(path))
        frame.shared = frame.shared and shared
        if child is None:
            continue
        if material is not None:
            child = Bind(child, material)
        flat = flat_rows[chosen]
        if not flat.any():
            batches.append(_colored(points, child, chosen, origin, colors))
            continue
        if not flat.all():
            batches.append(_colored(points, child, chosen[~flat], origin, colors))
        for one, some in _kinds(child, chosen[flat], colors):
            sheets = points.batch(one, some, origin)
            batches.append(pressed(sheets) or sheets)
    return batches


def _colored(
    points: Points, child: Node, chosen: Integers, origin: Origin, colors: PointColors | None
) -> Node:
    """The chosen instances of a child, each in its colour, in their order."""
    batches = [points.batch(one, some, origin) for one, some in _kinds(child, chosen, colors)]
    if colors is None or len(batches) == 1:
        return batches[0]
    return Group(tuple(batches), order=by_label(colors.labels[chosen])[1])


def _kinds(
    child: Node, chosen: Integers, colors: PointColors | None
) -> list[tuple[Node, Integers]]:
    """A child in each of the colours of the chosen instances, and those of that colour."""
    if colors is None:
        return [(child, chosen)]
    labels = colors.labels[chosen]
    return [
        (Bind(child, colors.materials[labels[some[0]]]), chosen[some])
        for some in by_label(labels)[0]
    ]


def _read(instancer: Any, clock: Clock, report: Report) -> Points | None:
    path = instancer.GetPath()
    prototypes = clock.integers_as_authored(instancer.GetProtoIndicesAttr())
    positions = clock.as_authored(instancer.GetPositionsAttr(), 3)
    if prototypes is None or positions is None:
        report.add("usd-instancer", "an instancer without indices or positions is empty", path)
        return None
    count = len(prototypes)
    usable = np.ones(count, bool)
    exact = instancer.GetOrientationsfAttr()
    halfs = instancer.GetOrientationsAttr()
    scales = clock.as_authored(instancer.GetScalesAttr(), 3)
    orientations = clock.as_authored(exact if exact.HasAuthoredValue() else halfs, 4)
    arrays: dict[str, NDArray[Any]] = {"positions": positions}
    if scales is not None and len(scales):
        arrays["scales"] = scales
    if orientations is not None and len(orientations):
        arrays["orientations"] = _near_unit(orientations)
    for name, array in arrays.items():
        if len(array) != count:
            message = f"{len(array)} `{name}` for {count} instances: those without are left out"
            report.add("usd-instancer", message, path)
        usable[len(array) :] = False
        arrays[name] = _padded(array, count)
        _leave_out(usable, _unsound(arrays[name]), f"`{name}` are not finite", report, path)
    targets = len(instancer.GetPrototypesRel().GetForwardedTargets())
    outside = (prototypes < 0) | (prototypes >= targets)
    _leave_out(usable, outside, "prototype index is out of range", report, path)
    usable &= ~_masked(instancer, clock, count, report)
    return Points(
        prototypes,
        arrays["positions"],
        arrays.get("scales"),
        arrays.get("orientations"),
        usable,
        exact_transforms(instancer.GetPrim(), positions, clock, report)
        if len(positions) == count
        else None,
    )


def _padded(array: NDArray[Any], count: int) -> NDArray[Any]:
    if len(array) >= count:
        return array[:count]
    return np.concatenate((array, np.zeros((count - len(array), array.shape[1]), array.dtype)))


def _leave_out(
    usable: NDArray[np.bool_], wrong: NDArray[np.bool_], reason: str, report: Report, path: Any
) -> None:
    number = int(np.count_nonzero(usable & wrong))
    usable &= ~wrong
    if number:
        message = f"{number} instances whose {reason} are left out"
        report.add("usd-instancer", message, path)


def _masked(instancer: Any, clock: Clock, count: int, report: Report) -> NDArray[np.bool_]:
    """Which instances are invisible or inactive: listed by id, or by index if there are no ids."""
    ids = clock.integers(instancer.GetIdsAttr())
    if ids is not None and len(ids) != count:
        message = f"{len(ids)} `ids` for {count} instances: positions in the arrays are the ids"
        report.add("usd-instancer", message, instancer.GetPath())
        ids = None
    invisible = clock.integers(instancer.GetInvisibleIdsAttr())
    inactive = instancer.GetPrim().GetMetadata("inactiveIds")
    hidden = np.empty(0, np.int64) if invisible is None else invisible
    if inactive is not None:
        listed = np.array(inactive.ApplyOperations([]), dtype=np.int64)
        hidden = np.concatenate((hidden, listed))
    if not len(hidden):
        return np.zeros(count, bool)
    return np.isin(np.arange(count) if ids is None else ids, hidden)


def _blocks(count: int) -> Iterator[slice]:
    return (slice(start, start + BLOCK) for start in range(0, count, BLOCK))


def _unsound(array: NDArray[Any]) -> NDArray[np.bool_]:
    """Which rows are not finite."""
    unsound = np.empty(len(array), bool)
    for some in _blocks(len(array)):
        unsound[some] = ~np.isfinite(array[some]).all(axis=1)
    return unsound


def _where(mask: NDArray[np.bool_]) -> Integers:
    found = np.empty(np.count_nonzero(mask), np.int32)
    end = 0
    for some in _blocks(len(mask)):
        rows = np.flatnonzero(mask[some])
        found[end : end + len(rows)] = rows + some.start
        end += len(rows)
    return found


def _taken(array: NDArray[Any], rows: Integers) -> NDArray[Any]:
    taken = np.empty((len(rows), *array.shape[1:]), array.dtype)
    for some in _blocks(len(rows)):
        taken[some] = array[rows[some]]
    return taken


def _doubles(array: NDArray[Any]) -> FloatArray:
    return array.astype(np.float64)


def _near_unit(quaternions: NDArray[Any]) -> NDArray[Any]:
    """The same where all are near unit, else doubles of which those that are not are made so."""
    for some in _blocks(len(quaternions)):
        part = quaternions[some]
        squared = np.einsum("ij,ij->i", part, part, dtype=np.float64)
        if not (np.abs(squared - 1.0) <= UNIT_SLACK).all():
            break
    else:
        return quaternions
    with np.errstate(over="ignore", invalid="ignore"):  # those that are not finite are left out
        return unit_quaternions(_doubles(quaternions))
