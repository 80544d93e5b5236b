"""Batches of rays into the benchmark scenes: camera, shadow, bounce and random."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Literal, NamedTuple

import numpy as np

from benchmarks.scenes import View
from dsl.scene import FloatArray
from runtime.tracer import Tracer

RayKind = Literal["camera", "shadow", "bounce", "random"]
RAY_KINDS: tuple[RayKind, ...] = ("camera", "shadow", "bounce", "random")
SUN = np.array([-1.0, 2.0, 1.0]) / np.sqrt(6.0)
"""The unit vector towards the sun where y is up."""


class Batch(NamedTuple):
    """Rays as arrays `(n, 3)`, whose values are exact in float32, so that all trace the same."""

    origins: FloatArray
    directions: FloatArray


def batches(
    tracer: Tracer, view: View, count: int, kinds: Iterable[RayKind] = RAY_KINDS
) -> Iterator[tuple[RayKind, Batch]]:
    """About `count` rays of each kind, 16 consecutive ones for each 4 × 4 tile of the view.

    Shadow rays go from the first hits to the sun, bounce rays from there in cosine-distributed
    directions, random ones from anywhere in the box of these points to anywhere in it.
    """
    camera = Batch(*view.rays(count))
    hits = tracer.trace(*camera)
    hit = np.flatnonzero(hits.hit)
    facing = np.sum(hits.normal * camera.directions, 1, keepdims=True)
    normals = np.where(facing > 0, -hits.normal, hits.normal)
    starts = hits.position + 1e-3 * normals
    for kind in kinds:
        if kind == "camera":
            yield kind, camera
        elif kind == "shadow":
            sun = np.roll(SUN, 1) if view.up[2] == 1 else SUN
            lit = hit[normals[hit] @ sun > 0]
            yield kind, _rounded(starts[lit], np.broadcast_to(sun, (len(lit), 3)))
        elif kind == "bounce":
            chosen = hit[np.arange(count) * len(hit) // count]
            around = np.random.default_rng(12345).normal(size=(count, 3))
            around /= np.linalg.norm(around, axis=1, keepdims=True)
            out = normals[chosen] + around * (1 - 1e-9)
            yield kind, _rounded(starts[chosen], out / np.linalg.norm(out, axis=1, keepdims=True))
        else:
            points = hits.position[hit]
            random = np.random.default_rng(1)
            start, end = random.uniform(points.min(0), points.max(0), (2, count, 3))
            yield kind, _rounded(start, end - start)


def _rounded(*arrays: FloatArray) -> Batch:
    return Batch(*(a.astype(np.float32).astype(np.float64) for a in arrays))
