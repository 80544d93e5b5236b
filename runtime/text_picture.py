"""A picture that is text: what the first camera sees, for the reference and for terminals."""

from __future__ import annotations

import numpy as np

from compiler.ir import ORTHOGRAPHIC, SceneIR

COLUMNS, ROWS = 48, 24
"""Characters, each twice as high as wide."""
_LETTERS = np.array([*"abcdefghijklmnopqrstuvwxyz", "."])


def text_picture(ir: SceneIR) -> str:
    """`ROWS` lines of `COLUMNS` characters; the scene must have a camera.

    A character is what the ray through its middle hits first: `a` for prototype 0, `b` for 1, and
    so on, `z` from 25 on, `.` for nothing. The window is as high as the camera says, and
    square.
    """
    from runtime._kernel import Kernel

    kernel = Kernel(ir, "float64")
    camera = ir.cameras[0]
    x, y = np.meshgrid(
        (np.arange(COLUMNS) + 0.5) / COLUMNS - 0.5, 0.5 - (np.arange(ROWS) + 0.5) / ROWS
    )
    window = camera["height"] * np.stack([x.ravel(), y.ravel(), np.zeros(x.size)], axis=1)
    axis = np.broadcast_to([0.0, 0.0, -1.0], window.shape)
    orthographic = camera["projection"] == ORTHOGRAPHIC
    turn, place = np.split(camera["world_from_camera"], [3], axis=1)
    origins = (window if orthographic else 0.0 * window) @ turn.T + place.T
    directions = (axis if orthographic else window + axis) @ turn.T
    found = kernel.trace(origins, directions, camera["near"][None], camera["far"][None])
    _, _, prototype, *_ = kernel.surface(origins, directions, *found)
    rows = _LETTERS[np.minimum(prototype, 25)].reshape(ROWS, COLUMNS)
    return "".join("".join(row) + "\n" for row in rows)
