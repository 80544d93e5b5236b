"""Geometric primitives as analytic shapes; those of two radii as meshes.

USD centres its cylinders, cones and capsules on the origin and lets them name their axis (Z by
default); ours stand on the y axis. The steps given with a shape bring it there.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from compiler.usd.clock import Clock
from compiler.usd.report import Report
from compiler.usd.schema import KINDS
from compiler.usd.solids import checked, read_bevel, read_solid
from compiler.usd.tapered import capsule, frustum
from compiler.usd.xform import rotation
from dsl.limits import SIZES
from dsl.scene import Mesh, Shape, ShapeKind, Step, StepKind

_FROM_Y: dict[str, tuple[Step, ...]] = {
    "X": (rotation("Z", -90.0),),
    "Y": (),
    "Z": (rotation("X", 90.0),),
}
"""Turns +y into the axis, and never mirrors."""

_UPSIDE_DOWN = (rotation("X", 180.0),)

Placed = tuple[Shape | Mesh, tuple[Step, ...]]


class Gprims:
    """Makes the shapes of a stage; equal shapes are one node, so equal prims are instances."""

    def __init__(self, clock: Clock, report: Report) -> None:
        self._clock = clock
        self._report = report
        self._shapes: dict[tuple[ShapeKind, tuple[float, ...]], Shape] = {}
        self._tapered: dict[tuple[Callable[..., Mesh], tuple[float, ...]], Mesh] = {}
        self._readers = {
            "Cube": self._cube,
            "Sphere": self._sphere,
            "Cylinder": self._cylinder,
            "Cylinder_1": self._cylinder_1,
            "Cone": self._cone,
            "Capsule": self._capsule,
            "Capsule_1": self._capsule_1,
            "Plane": self._plane,
        }

    def __contains__(self, type_name: str) -> bool:
        return type_name in self._readers or type_name in KINDS

    def read(self, type_name: str, prim: Any) -> Placed | None:
        """The shape of a prim, or None (reported) for one that has no extent that can be traced."""
        placed: Placed | None
        if type_name in KINDS:
            solid = read_solid(prim, type_name, self._clock, self._report)
            placed = None if solid is None else (self._shape(*solid), ())
        else:
            placed = self._readers[type_name](prim)
        if placed is None or _is_traceable(placed[0]):
            return placed
        message = f"a prim with sizes below {SIZES[0]:g} or above {SIZES[1]:g} draws nothing"
        self._report.add("usd-shape", message, prim.GetPath())
        return None

    def _shape(self, kind: ShapeKind, parameters: tuple[float, ...]) -> Shape:
        key = (kind, parameters)
        return self._shapes.setdefault(key, Shape(kind, parameters))

    def _bevelled(self, prim: Any, kind: ShapeKind, *parameters: float) -> Shape | None:
        """A solid with the bevel that the prim's applied schema gives it."""
        bevel = read_bevel(prim, self._clock)
        if bevel == 0.0:
            return self._shape(kind, (*parameters, 0.0))
        solid = checked(kind, (*parameters, bevel), prim, self._report)
        return None if solid is None else self._shape(*solid)

    def _size(self, prim: Any, name: str, fallback: float) -> float:
        """A length; its sign says nothing about a symmetric solid."""
        attribute = prim.GetAttribute(name)
        number = self._clock.number(attribute, math.nan)
        if not math.isnan(number):
            return abs(number)
        if self._clock.value(attribute) is not None:
            message = f"`{name}` is no finite number: {fallback:g} is used"
            self._report.add("usd-attribute", message, prim.GetPath())
        return fallback

    def _is_upside_down(self, prim: Any) -> bool:
        """Whether a height below zero exchanges top and bottom, as it does in Hydra's meshes."""
        return self._clock.number(prim.GetAttribute("height"), 1.0) < 0.0

    def _radii(self, prim: Any, fallback: float) -> tuple[float, float]:
        """The radii at the bottom and at the top."""
        bottom, top = (self._size(prim, f"radius{end}", fallback) for end in ("Bottom", "Top"))
        return (top, bottom) if self._is_upside_down(prim) else (bottom, top)

    def _empty(self, prim: Any, name: str) -> None:
        message = f"a prim whose `{name}` is zero draws nothing"
        self._report.add("usd-shape", message, prim.GetPath())

    def _axis(self, prim: Any, fallback: str = "Z") -> str:
        axis = self._clock.token(prim.GetAttribute("axis")) or fallback
        if axis in _FROM_Y:
            return axis
        message = f"`axis = {axis!r}` is none of X, Y, Z; {fallback} is used"
        self._report.add("usd-attribute", message, prim.GetPath())
        return fallback

    def _cube(self, prim: Any) -> Placed | None:
        half = self._size(prim, "size", 2.0) / 2.0
        if half == 0.0:
            self._empty(prim, "size")
            return None
        shape = self._bevelled(prim, ShapeKind.BOX, -half, -half, -half, half, half, half)
        return None if shape is None else (shape, ())

    def _sphere(self, prim: Any) -> Placed | None:
        radius = self._size(prim, "radius", 1.0)
        if radius == 0.0:
            self._empty(prim, "radius")
            return None
        return self._ball(radius)

    def _ball(self, radius: float) -> Placed:
        return self._shape(ShapeKind.SPHERE, (radius,)), ()

    def _cylinder(self, prim: Any) -> Placed | None:
        radius, height = self._size(prim, "radius", 1.0), self._size(prim, "height", 2.0)
        return self._tube(prim, radius, height)

    def _tube(self, prim: Any, radius: float, height: float, cap: float = 0.0) -> Placed | None:
        """A cylinder, with caps that are balls of the radius `cap` (0 or that of the tube)."""
        if radius == 0.0:
            self._empty(prim, "radius")
            return None
        half = height / 2.0 + cap
        if half == 0.0:
            self._empty(prim, "height")
            return None
        if cap > 0.0:
            shape: Shape | None = self._shape(ShapeKind.CYLINDER, (radius, -half, half, cap))
        else:
            shape = self._bevelled(prim, ShapeKind.CYLINDER, radius, -half, half)
        return None if shape is None else (shape, _FROM_Y[self._axis(prim)])

    def _cylinder_1(self, prim: Any) -> Placed | None:
        bottom, top = self._radii(prim, 1.0)
        height = self._size(prim, "height", 2.0)
        if top == bottom:
            return self._tube(prim, top, height)
        if bottom == 0.0:
            return self._spike(prim, top, height, _UPSIDE_DOWN)
        if top == 0.0:
            return self._spike(prim, bottom, height)
        if height == 0.0:
            self._empty(prim, "height")
            return None
        return self._mesh(prim, frustum, bottom, top, height)

    def _cone(self, prim: Any) -> Placed | None:
        turned = _UPSIDE_DOWN if self._is_upside_down(prim) else ()
        radius, height = self._size(prim, "radius", 1.0), self._size(prim, "height", 2.0)
        return self._spike(prim, radius, height, turned)

    def _spike(
        self, prim: Any, radius: float, height: float, turned: tuple[Step, ...] = ()
    ) -> Placed | None:
        if radius == 0.0:
            self._empty(prim, "radius")
            return None
        if height == 0.0:
            self._empty(prim, "height")
            return None
        centred = Step(StepKind.TRANSLATE, np.array([0.0, -height / 2.0, 0.0]))
        shape = self._bevelled(prim, ShapeKind.CONE, radius, height)
        return None if shape is None else (shape, (centred, *turned, *_FROM_Y[self._axis(prim)]))

    def _capsule(self, prim: Any) -> Placed | None:
        radius, height = self._size(prim, "radius", 0.5), self._size(prim, "height", 1.0)
        return self._round_tube(prim, radius, height)

    def _round_tube(self, prim: Any, radius: float, height: float) -> Placed | None:
        """Place the cylinder whose rims are bevelled by its whole radius."""
        if height == 0.0 and radius > 0.0:
            return self._ball(radius)
        return self._tube(prim, radius, height, radius)

    def _capsule_1(self, prim: Any) -> Placed | None:
        bottom, top = self._radii(prim, 0.5)
        if top == bottom:
            return self._round_tube(prim, top, self._size(prim, "height", 1.0))
        return self._mesh(prim, capsule, bottom, top, self._size(prim, "height", 1.0))

    def _mesh(self, prim: Any, make: Callable[..., Mesh], *sizes: float) -> Placed:
        """Place a solid of two radii."""
        if (make, sizes) not in self._tapered:
            self._tapered[make, sizes] = make(*sizes)
        return self._tapered[make, sizes], _FROM_Y[self._axis(prim)]

    def _plane(self, prim: Any) -> Placed | None:
        width, length = self._size(prim, "width", 2.0), self._size(prim, "length", 2.0)
        if width == 0.0:
            self._empty(prim, "width")
            return None
        if length == 0.0:
            self._empty(prim, "length")
            return None
        axis = self._axis(prim)
        # The rectangle's x comes from y for a plane that faces X: there the length runs along y.
        sizes = (length, width) if axis == "X" else (width, length)
        return self._shape(ShapeKind.RECTANGLE, sizes), _FROM_Y[axis]


def _is_traceable(shape: Shape | Mesh) -> bool:
    """Whether the squares and cubes of a shape's sizes are numbers still."""
    low, high = SIZES
    if isinstance(shape, Mesh):
        return bool(low <= np.abs(shape.points).max() <= high)
    sizes = np.abs(shape.parameters)
    return bool(((sizes == 0.0) | (low <= sizes) & (sizes <= high)).all())
