"""Many balls and tubes as batches of instances of one of each."""

from __future__ import annotations

import numpy as np

from dsl.scene import (
    FloatArray,
    Instances,
    IntArray,
    Node,
    Shape,
    ShapeKind,
    Step,
    StepKind,
    Transform,
)

TOLERANCE = 0.05
"""By how much tubes may miss a surface, in the larger one of its radii at their ends."""


class Round:
    """Makes the batches of a stage; all are instances of one ball and one tube."""

    def __init__(self) -> None:
        self._ball = Shape(ShapeKind.SPHERE, (1.0,))
        self._tube = Shape(ShapeKind.CYLINDER, (1.0, 0.0, 1.0, 0.0))

    def balls(self, centers: FloatArray, radii: FloatArray) -> list[Node]:
        """Balls of positive `radii` `(n,)` about `centers` `(n, 3)`."""
        if not len(centers):
            return []
        sizes = np.repeat(radii[:, None], 3, axis=1)
        steps = (Step(StepKind.SCALE, sizes), Step(StepKind.TRANSLATE, centers.copy()))
        return [Instances(self._ball, Transform(steps))]

    def tubes(self, starts: FloatArray, ends: FloatArray, radii: FloatArray) -> list[Node]:
        """Tubes from `starts` to `ends` `(n, 3)` with the `radii` `(n, 2)` of both.

        Tapered ones become steps of straight ones within the tolerance. What has no length or no
        radius is left out.
        """
        starts, ends, radii = _stepped(starts, ends, radii)
        axes = ends - starts
        lengths = np.linalg.norm(axes, axis=1)
        long = (lengths > 0.0) & (radii > 0.0)
        if not long.any():
            return []
        axes, radii = axes[long], radii[long, None]
        side = _across(axes / lengths[long, None])
        other = np.cross(side, axes / lengths[long, None])
        columns = (radii * side, axes, radii * other, starts[long])
        matrices = np.stack(columns, axis=2).reshape(-1, 12)
        return [Instances(self._tube, Transform((Step(StepKind.MATRIX, matrices),)))]


def _stepped(
    starts: FloatArray, ends: FloatArray, radii: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Tapered tubes as tubes of the mean radius over parts that are short enough."""
    taper, widest = np.abs(radii[:, 1] - radii[:, 0]), radii.max(axis=1)
    # A part of n misses its mean radius by taper / 2n at either end.
    share = np.divide(taper, widest, out=np.zeros_like(taper), where=widest > 0.0)
    pieces = np.maximum(np.ceil(share / (2.0 * TOLERANCE)), 1.0).astype(np.int64)
    tube, first = parts(pieces)
    low = (first / pieces[tube])[:, None]
    high = ((first + 1) / pieces[tube])[:, None]
    axes = (ends - starts)[tube]
    middle = (low + high)[:, 0] / 2.0
    widths = radii[tube, 0] + middle * (radii[tube, 1] - radii[tube, 0])
    return starts[tube] + low * axes, starts[tube] + high * axes, widths


def parts(counts: IntArray) -> tuple[IntArray, IntArray]:
    """For each of all parts, what it is a part of, and its number there."""
    whole = np.repeat(np.arange(len(counts)), counts)
    return whole, np.arange(len(whole)) - np.repeat(np.cumsum(counts) - counts, counts)


def _across(axes: FloatArray) -> FloatArray:
    """A unit vector across each unit vector `(n, 3)`."""
    other = np.zeros_like(axes)
    other[np.arange(len(axes)), np.argmin(np.abs(axes), axis=1)] = 1.0
    across = np.cross(axes, other)
    return np.asarray(across / np.linalg.norm(across, axis=1, keepdims=True))
