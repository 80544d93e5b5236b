"""Many balls and tubes: batches of instances of one of each, and meshes of tapered tubes."""

from __future__ import annotations

import numpy as np

from dsl.scene import (
    FloatArray,
    Instances,
    IntArray,
    Mesh,
    Node,
    Shape,
    ShapeKind,
    Step,
    StepKind,
    Transform,
)

TOLERANCE = 0.05
"""By how much tubes may miss a surface, in the larger one of its radii at their ends."""

STRAIGHT = 1e-6
"""Radii that differ by less, in parts of them, are the same."""

TRIANGLES = 1 << 19
SIDES = (32, 1024)
"""Triangles of the tapered tubes of a prim, and corners of their circles: as many as fit, in these
bounds. Tubes that do not fit become steps of straight ones."""


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

        Tapered ones are the walls of a mesh, or, if they are too many, steps of straight ones
        within the tolerance. What has no length or no radius is left out.
        """
        even = np.isclose(radii[:, 0], radii[:, 1], rtol=STRAIGHT, atol=0.0)
        tapered = ~even & (starts != ends).any(axis=1)
        sides = TRIANGLES // (2 * max(int(np.count_nonzero(tapered)), 1))
        if tapered.any() and sides >= SIDES[0]:
            cones = _cones(starts[tapered], ends[tapered], radii[tapered], min(sides, SIDES[1]))
            straight = ~tapered
            return [cones, *self.tubes(starts[straight], ends[straight], radii[straight])]
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


def _cones(starts: FloatArray, ends: FloatArray, radii: FloatArray, sides: int) -> Mesh:
    """The walls of truncated cones; chords of their circles miss by as much on either side."""
    axes = ends - starts
    axes /= np.linalg.norm(axes, axis=1, keepdims=True)
    side = _across(axes)
    other = np.cross(axes, side)
    turns = 2.0 * np.pi * np.arange(sides) / sides
    around = np.cos(turns)[:, None] * side[:, None] + np.sin(turns)[:, None] * other[:, None]
    reach = 2.0 / (1.0 + np.cos(np.pi / sides))
    rings = np.stack((starts, ends), axis=1)[:, :, None] + (
        reach * radii[:, :, None, None] * around[:, None]
    )
    here = 2 * sides * np.arange(len(starts))[:, None] + np.arange(sides)
    following = np.roll(here, -1, axis=1)
    low = np.stack((here, following, here + sides), axis=-1)[radii[:, 0] > 0.0]
    high = np.stack((following, following + sides, here + sides), axis=-1)[radii[:, 1] > 0.0]
    return Mesh(rings.reshape(-1, 3), np.concatenate((low.reshape(-1, 3), high.reshape(-1, 3))))


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
