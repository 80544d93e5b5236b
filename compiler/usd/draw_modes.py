"""Draw modes: models that a stage asks to be shown by something simpler (UsdGeomModelAPI).

A mode holds for a model that applies it, or is a component, and is inherited from those above.
`bounds` is a box, and so are `cards` of the geometry `box`; those of a `cross` are three rectangles
through the middle. Pictures show what is lit, so these are surfaces, in `model:drawModeColor`.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
from pxr import Kind, Tf, Usd, UsdGeom

from compiler.usd.clock import Clock
from compiler.usd.options import KNOWN_PURPOSES
from compiler.usd.report import Report
from dsl.scene import DEFAULT_MATERIAL, Bind, FloatArray, Material, Mesh, Node


def stand_in(prim: Any) -> str:
    """How a model is drawn in its own stead: "bounds", "origin", "cards"; "" if as itself."""
    if prim.IsPseudoRoot():
        return ""
    model = UsdGeom.ModelAPI(prim)
    mode = str(model.ComputeModelDrawMode())
    if mode not in ("bounds", "origin", "cards"):
        return ""
    applied = model.GetModelApplyDrawModeAttr().Get()
    component = Kind.Registry.IsA(Usd.ModelAPI(prim).GetKind(), Kind.Tokens.component)
    return mode if applied or component else ""


def draw_stand_in(
    prim: Any, mode: str, purposes: Iterable[str], clock: Clock, report: Report
) -> Node | None:
    """What is drawn of a model in a mode, in its own space; nothing (reported) of `origin`."""
    path = prim.GetPath()
    if mode == "origin":
        report.add("usd-attribute", "the draw mode `origin` draws nothing", path)
        return None
    bounds = _bounds(prim, purposes, clock)
    if bounds is None:
        message = f"the draw mode `{mode}` of a model without bounds draws nothing"
        report.add("usd-attribute", message, path)
        return None
    shape = clock.token(prim.GetAttribute("model:cardGeometry")) if mode == "cards" else ""
    drawn = "crossed rectangles" if shape in ("cross", "") and mode == "cards" else "a box"
    report.add("usd-attribute", f"the draw mode `{mode}` is drawn as {drawn}", path)
    node = _mesh(_cross(bounds) if drawn != "a box" else _box(bounds))
    color = clock.vector(prim.GetAttribute("model:drawModeColor"), 3, report)
    if color is None or not np.isfinite(color).all():
        return Bind(node, DEFAULT_MATERIAL)
    r, g, b = color
    return Bind(node, Material(diffuse=(r, g, b)))


def _bounds(prim: Any, purposes: Iterable[str], clock: Clock) -> FloatArray | None:
    """Lower and upper corner `(2, 3)`: the model's hint, or what usd-core makes of its prims."""
    shown = [purpose for purpose in KNOWN_PURPOSES if purpose in {"default", *purposes}]
    time = clock.code(prim.GetAttribute("extentsHint"))
    cache = UsdGeom.BBoxCache(time, shown, useExtentsHint=True)
    try:
        found = cache.ComputeUntransformedBound(prim).ComputeAlignedRange()
    except Tf.ErrorException:
        return None
    bounds = np.array((found.GetMin(), found.GetMax()), dtype=np.float64)
    return bounds if np.isfinite(bounds).all() and (bounds[0] <= bounds[1]).all() else None


def _box(bounds: FloatArray) -> FloatArray:
    """Six rectangles `(6, 4, 3)` that face outwards."""
    return np.array(
        [_rectangle(bounds, axis, bounds[side, axis], side) for axis in range(3) for side in (0, 1)]
    )


def _cross(bounds: FloatArray) -> FloatArray:
    middle = bounds.mean(axis=0)
    return np.array([_rectangle(bounds, axis, middle[axis], 1) for axis in range(3)])


def _rectangle(bounds: FloatArray, axis: int, at: float, side: int) -> FloatArray:
    """The corners `(4, 3)` of the bounds' section across an axis; it faces up or down the axis."""
    corners = np.empty((4, 3))
    corners[:, axis] = at
    corners[:, (axis + 1) % 3] = bounds[[0, 1, 1, 0], (axis + 1) % 3]
    corners[:, (axis + 2) % 3] = bounds[[0, 0, 1, 1], (axis + 2) % 3]
    return corners if side else corners[::-1]


def _mesh(rectangles: FloatArray) -> Mesh:
    first = 4 * np.arange(len(rectangles))[:, None, None]
    triangles = first + np.array([(0, 1, 2), (0, 2, 3)])
    return Mesh(rectangles.reshape(-1, 3), triangles.reshape(-1, 3))
