"""One unit sphere at numerical extremes: `python -m benchmarks.extremes` prints the table.

A picture of 256² rays, of the sphere scaled by s and the camera with it, or of both moved to
D·(1, .73, −.41) + .1. The truth is the sphere in its own frame in extended precision, from the
scene's numbers as they stand in float64. A pixel is wrong where hit or miss differs from it.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from benchmarks.rates import prepared
from benchmarks.scenes import SPHERE
from dsl.scene import FloatArray, Instances, Precision, SceneGraph, Step, StepKind, Transform

SIZE = 256
EYE = np.array([2.1, 3.3, 4.7])
SCALES = (1e-30, 1e-20, 1e-10, 1e-5, 1.0, 1e5, 1e10, 1e18, 1e30)
SHIFTS = (1e3, 1e5, 1e7, 1e9, 1e12)


@dataclass(frozen=True, slots=True)
class Extreme:
    """`wrong` of `hits` silhouette pixels, and the largest relative error of t."""

    kind: Literal["scale", "shift"]
    value: float
    precision: Precision
    wrong: int
    hits: int
    error: float


def measure() -> Iterator[Extreme]:
    """Every scale and shift, in both precisions."""
    cases: list[tuple[Literal["scale", "shift"], float]] = [
        *(("scale", value) for value in SCALES),
        *(("shift", value) for value in SHIFTS),
    ]
    for kind, value in cases:
        for precision in ("float32", "float64"):
            yield picture(kind, value, precision)


def picture(kind: Literal["scale", "shift"], value: float, precision: Precision) -> Extreme:
    """One picture of the sphere against the truth."""
    scale = value if kind == "scale" else 1.0
    center = value * np.array([1.0, 0.73, -0.41]) + 0.1 if kind == "shift" else np.zeros(3)
    eye = EYE * scale + center
    steps = (
        Step(StepKind.SCALE, np.full(3, scale)),
        Step(StepKind.TRANSLATE, center),
    )
    tracer = prepared(SceneGraph(Instances(SPHERE, Transform(steps))), precision)
    directions = _directions()
    found = tracer.trace(np.broadcast_to(eye, directions.shape), directions)
    hit, t = _truth(eye, center, scale, directions)
    both = hit & found.hit
    error = np.abs(found.t[both] - t[both]) / t[both]
    return Extreme(
        kind, value, precision, int((hit != found.hit).sum()), int(hit.sum()), float(error.max())
    )


def _directions() -> FloatArray:
    """(n, 3) unit directions of a camera at EYE that looks at the origin, 34° high."""
    forward = -EYE / np.linalg.norm(EYE)
    right = np.cross(forward, [0.0, 1.0, 0.0])
    right /= np.linalg.norm(right)
    above = np.cross(right, forward)
    reach = math.tan(math.radians(17))
    y, x = np.mgrid[0:SIZE, 0:SIZE].reshape(2, -1, 1)
    u, v = ((2 * x + 1) / SIZE - 1) * reach, (1 - (2 * y + 1) / SIZE) * reach
    directions: FloatArray = forward + u * right + v * above
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    return directions


def _truth(
    eye: FloatArray, center: FloatArray, scale: float, directions: FloatArray
) -> tuple[NDArray[np.bool_], NDArray[np.longdouble]]:
    """Hit or miss, and t, in the sphere's own frame."""
    wide = np.longdouble
    origin = (eye.astype(wide) - center.astype(wide)) / wide(scale)
    d = directions.astype(wide)
    dd = (d * d).sum(1)
    middle = -(d @ origin) / dd
    nearest = origin + middle[:, None] * d
    room = 1 - (nearest * nearest).sum(1)
    with np.errstate(invalid="ignore"):
        t = (middle - np.sqrt(room / dd)) * wide(scale)
    return room >= 0, t


if __name__ == "__main__":
    for found in measure():
        print(
            f"{found.kind} {found.value:7.0e} {found.precision}: {found.wrong} wrong of "
            f"{found.hits}, t within {found.error:.1e}"
        )
