"""Shapes that differ in size alone: each is one of unit size, scaled.

A sphere of radius r is the sphere of radius 1 scaled by r, a sharp box about the origin the cube
from -1 to 1 scaled by its half lengths. A scene with more than `MOST` different shapes of one unit
has that unit for its only prototype of them, and the scales among its placements: memory and time
then go with the instances, and a loop can make all its shapes at once.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from dsl.scene import Shape, ShapeKind

MOST = 64
"""So many different shapes of one unit are prototypes of their own."""

Unit = tuple[tuple[float, ...], tuple[Any, Any, Any]]
"""The parameters of the shape of unit size, and the scales along the axes."""


def unit_of(kind: ShapeKind, parameters: Sequence[Any]) -> Unit | None:
    """The unit of a valid shape; None for one that has none.

    Parameters may be arrays of one for each lane: then all lanes have the same unit, or None. Valid
    are the shapes whose scales are within `dsl.limits.SIZES`.
    """
    match kind, parameters:
        case ShapeKind.SPHERE | ShapeKind.DISC, (r,):
            return (1.0,), (r, r, r)
        case ShapeKind.BOX, (x0, y0, z0, x1, y1, z1, bevel):
            if _same(bevel, 0.0) and _same(x0, -x1) and _same(y0, -y1) and _same(z0, -z1):
                return (-1.0, -1.0, -1.0, 1.0, 1.0, 1.0, 0.0), (x1, y1, z1)
        case ShapeKind.CYLINDER, (r, y0, y1, bevel):
            if _same(bevel, 0.0) and _same(y0, -y1):
                return (1.0, -1.0, 1.0, 0.0), (r, y1, r)
            if _same(bevel, 0.0) and _same(y0, 0.0):
                return (1.0, 0.0, 1.0, 0.0), (r, y1, r)
        case ShapeKind.CONE, (r, h, bevel):
            if _same(bevel, 0.0):
                return (1.0, 1.0, 0.0), (r, h, r)
    return None


def scaled(kind: ShapeKind, unit: Sequence[float], scale: Sequence[float]) -> tuple[float, ...]:
    """The parameters of the shape that is a unit, scaled."""
    return tuple([a * scale[axis] for a, axis in zip(unit, _AXES[kind], strict=True)])


_AXES = {
    ShapeKind.SPHERE: (0,),
    ShapeKind.DISC: (0,),
    ShapeKind.BOX: (0, 1, 2, 0, 1, 2, 0),
    ShapeKind.CYLINDER: (0, 1, 1, 0),
    ShapeKind.CONE: (0, 1, 0),
}
"""The axis along which each parameter of a shape with a unit lies."""


def _same(a: Any, b: Any) -> bool:
    return bool(np.all(a == b))


def scaled_units(shapes: Sequence[Shape]) -> set[tuple[ShapeKind, tuple[float, ...]]]:
    """The units, by kind and parameters, of which the shapes of a scene are scales."""
    different = {(shape.kind, shape.parameters) for shape in shapes if not shape.sized}
    counts: dict[tuple[ShapeKind, tuple[float, ...]], int] = {}
    if len(different) > MOST:
        for kind, parameters in different:
            if (unit := unit_of(kind, parameters)) is not None:
                key = kind, unit[0]
                counts[key] = counts.get(key, 0) + 1
    units = {key for key, count in counts.items() if count > MOST}
    return units.union((shape.kind, shape.parameters) for shape in shapes if shape.sized)
