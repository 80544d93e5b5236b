"""Options and fixtures of the whole suite."""

from __future__ import annotations

import signal
from collections.abc import Callable

import numpy as np
import pytest

from compiler.ir import ORTHOGRAPHIC, SceneIR

COLUMNS, ROWS = 48, 24  # characters of a picture, each twice as high as wide
LETTERS = np.array([*"abcdefghijklmnopqrstuvwxyz", "."])


def pytest_addoption(parser: pytest.Parser) -> None:
    group = parser.getgroup("reference", "the language reference, dsl/reference/*.md")
    group.addoption("--update", action="store_true", help="rewrite the outcomes of its examples")


def pytest_configure() -> None:
    """Let Ctrl-C be heard, here and in the processes that tests start.

    A shell that starts a job in the background has it ignore that signal, and so its children.
    """
    signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.fixture
def draw() -> Callable[[SceneIR], str]:
    """Draws what the first camera sees as text.

    A character is what the ray through its middle hits: `a` for prototype 0, `b` for 1, and so
    on, `.` for nothing.
    """
    return _draw


def _draw(ir: SceneIR) -> str:
    kernel = pytest.importorskip("runtime._kernel").Kernel(ir, "float64")
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
    found = kernel.trace(origins, directions, np.array([0.0]), np.array([np.inf]))
    _, _, prototype, _ = kernel.surface(origins, directions, *found)
    rows = LETTERS[prototype].reshape(ROWS, COLUMNS)
    return "".join("".join(row) + "\n" for row in rows)
