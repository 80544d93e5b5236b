"""Which camera a picture is taken with; one that shows the whole scene where there is none."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from compiler.ir import CAMERA, PERSPECTIVE, SceneIR

FIELD_OF_VIEW = 30.0
"""Vertical field of view of the default camera, in degrees."""
MARGIN = 1.05
"""How much farther away than necessary the default camera stands."""


def choose_camera(ir: SceneIR, camera: str | int | None) -> NDArray[np.void] | None:
    """The camera of that name or number; None: the scene's first one, or None if it has none.

    Returns one `compiler.ir.CAMERA` record, shape (). A name that no camera has may be the
    last part of one's path, or a number in digits. Raises ValueError naming the cameras.
    """
    if camera is None:
        return _record(ir, 0) if len(ir.cameras) else None
    names = [ir.text(int(record["name"])) for record in ir.cameras]
    if isinstance(camera, str):
        if camera in names:
            return _record(ir, names.index(camera))
        ends = [name.rpartition("/")[2] for name in names]
        if ends.count(camera) == 1:
            return _record(ir, ends.index(camera))
        if not camera.isdecimal():
            raise ValueError(f"no camera is named {camera!r}; {_cameras(names)}")
        camera = int(camera)
    if not 0 <= camera < len(names):
        raise ValueError(f"there is no camera number {camera}; {_cameras(names)}")
    return _record(ir, camera)


def default_camera(bounds: NDArray[np.float64], up: str, aspect: float) -> NDArray[np.void]:
    """A camera that looks at `bounds` `(2, 3)` from the front, a little from the right and above.

    `up` is "y" (front is +z) or "z" (front is -y). All of the box is seen in a picture of that
    `aspect`, width over height. Where there are no bounds the box is [-1, 1]³.
    """
    lower, upper = np.asarray(bounds, np.float64)
    if not (np.isfinite(bounds).all() and (lower <= upper).all()):
        lower, upper = np.full(3, -1.0), np.full(3, 1.0)
    center = lower / 2 + upper / 2
    half = upper / 2 - lower / 2
    size = float(half.max())
    if size == 0:
        size = 1.0

    back = np.array([0.5, 0.45, 1.0])
    right = np.cross([0.0, 1.0, 0.0], back)
    if up == "z":
        # (x, y, z) of a y-up world is (x, -z, y) of a z-up one.
        back, right = (vector[[0, 2, 1]] * (1, -1, 1) for vector in (back, right))
    back /= np.linalg.norm(back)
    right /= np.linalg.norm(right)
    axes = np.stack([right, np.cross(back, right), back])

    # A corner at (x, y, z) from the centre, z towards the eye at distance d, is seen if |y| is
    # at most (d - z) tan(fov / 2), and |x| at most that times the aspect.
    signs = np.array(np.meshgrid([-1, 1], [-1, 1], [-1, 1])).reshape(3, 8)
    x, y, z = axes @ (signs * (half / size)[:, None])
    tangent = math.tan(math.radians(FIELD_OF_VIEW / 2))
    distance = float(np.max(z + np.maximum(np.abs(y), np.abs(x) / aspect) / tangent))

    record = np.zeros((), CAMERA)
    record["projection"] = PERSPECTIVE
    record["name"] = -1
    record["world_from_camera"][:, :3] = axes.T
    record["world_from_camera"][:, 3] = center + back * (distance * MARGIN * size)
    record["height"] = 2 * tangent
    record["aspect"] = math.nan
    record["far"] = math.inf
    return record


def _record(ir: SceneIR, index: int) -> NDArray[np.void]:
    return ir.cameras[index : index + 1].reshape(())


def _cameras(names: list[str]) -> str:
    if not names:
        return "the scene has none"
    listed = ", ".join(f"{i} {name!r}" if name else str(i) for i, name in enumerate(names[:20]))
    return f"the scene has {listed}" + (" …" if len(names) > 20 else "")
