"""Cylinder_1 and Capsule_1 with two radii, as meshes about the y axis.

The kernel has no frustum. A chord that spans the angle a dips below its circle by r·(1 - cos(a/2));
radii are enlarged so that the mesh misses the surface by half of that on either side.
"""

from __future__ import annotations

import numpy as np

from dsl.scene import FloatArray, Mesh

FRUSTUM_SIDES = 1024
"""Corners of a circle: surfaces are right to 2.4e-6 of the radius."""

CAPSULE_SIDES = 512
"""Corners of a circle, and of a great circle of the caps: right to 2e-5 of the radius."""


def frustum(bottom: float, top: float, height: float) -> Mesh:
    """A solid of two positive radii at ±height/2, closed by discs."""
    half = height / 2.0
    ring = np.array([(bottom, -half), (top, half)]) * (_enlarged(FRUSTUM_SIDES), 1.0)
    return _revolved(ring, -half, half, FRUSTUM_SIDES)


def capsule(bottom: float, top: float, height: float) -> Mesh:
    """The same closed by half balls."""
    half = height / 2.0
    turns = np.linspace(0.0, np.pi / 2.0, CAPSULE_SIDES // 4 + 1)[1:]
    quarter = np.stack((np.sin(turns), np.cos(turns)), axis=1) * _enlarged(CAPSULE_SIDES)
    below = bottom * quarter * (1.0, -1.0) + (0.0, -half)
    above = top * quarter[::-1] + (0.0, half)
    profile = np.concatenate((below, above)) * (_enlarged(CAPSULE_SIDES), 1.0)
    reach = _enlarged(CAPSULE_SIDES)
    return _revolved(profile, -half - bottom * reach, half + top * reach, CAPSULE_SIDES)


def _enlarged(sides: int) -> float:
    return float(2.0 / (1.0 + np.cos(np.pi / sides)))


def _revolved(profile: FloatArray, low: float, high: float, sides: int) -> Mesh:
    """Rings of `profile` `(k, 2)`, radius and height from below, closed by points at both ends."""
    turns = 2.0 * np.pi * np.arange(sides) / sides
    around = np.stack((np.cos(turns), np.sin(turns)), axis=1)
    rings = np.empty((len(profile), sides, 3))
    rings[:, :, 0::2] = profile[:, None, :1] * around
    rings[:, :, 1] = profile[:, 1:]
    ends = np.array([(0.0, low, 0.0), (0.0, high, 0.0)])
    points = np.concatenate((rings.reshape(-1, 3), ends))
    here = np.arange(sides)
    following = np.roll(here, -1)
    first = (np.arange(len(profile) - 1) * sides)[:, None]
    a, b = (first + here).ravel(), (first + following).ravel()
    last = (len(profile) - 1) * sides
    count = len(points)
    triangles = np.concatenate(
        (
            np.stack((a, a + sides, b), axis=1),
            np.stack((b, a + sides, b + sides), axis=1),
            np.stack((here, following, np.full(sides, count - 2)), axis=1),
            np.stack((last + following, last + here, np.full(sides, count - 1)), axis=1),
        )
    )
    return Mesh(points, triangles)
