"""Pictures from the IR on, the first call included: build, trace and shade."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from benchmarks import embree, scenes
from benchmarks.rates import compiled, timed
from benchmarks.rays import SUN
from benchmarks.record import Figure
from compiler.ir import SceneIR
from dsl.scene import Group, Precision, SceneGraph, Sun
from runtime.film import Film
from runtime.render import render


@dataclass(frozen=True, slots=True)
class Frame:
    """A picture: `occlusion` rays per pixel, or `samples` with a shadow ray each to a sun."""

    name: str
    scene: SceneGraph
    peer: SceneGraph
    view: scenes.View
    samples: int = 1
    occlusion: int = 0

    def ir(self) -> SceneIR:
        """The scene with camera and sun."""
        sun = Sun(tuple(-SUN), (1.0, 1.0, 1.0))
        parts = (self.scene.root, self.view.camera(), *(() if self.occlusion else (sun,)))
        return compiled(SceneGraph(Group(parts)))


def frames() -> tuple[Frame, ...]:
    """The pictures of `docs/performance.md`."""
    ellipsoids = scenes.ellipsoids()
    meshes, wedges = scenes.igloo(triangles=True), scenes.igloo(triangles=False)
    return (
        Frame("ellipsoids", ellipsoids, ellipsoids, scenes.S1_VIEW),
        Frame("ellipsoids", ellipsoids, ellipsoids, scenes.S1_VIEW, samples=16),
        Frame("igloo meshes", meshes, meshes, scenes.S2_VIEW, occlusion=64),
        Frame("igloo wedges", wedges, meshes, scenes.S2_VIEW, occlusion=64),
    )


def measure(precision: Precision, threads: int, repeat: int) -> Iterator[Figure]:
    """Seconds per picture, ours and Embree's, which takes one camera sample per pixel."""
    for frame in frames():
        ir = frame.ir()
        best = np.inf
        for _ in range(repeat):
            seconds, film = timed(_picture, frame, ir, precision, threads)
            best = min(best, seconds / threads)
        work = f"{frame.occlusion} occlusion" if frame.occlusion else f"{frame.samples} sample(s)"
        ratio = None
        theirs: list[Figure] = []
        if embree.driver() is not None and frame.samples == 1:
            peer = embree.Embree(compiled(frame.peer))
            seconds, mean = peer.frame(frame.view, SUN, frame.occlusion, threads, repeat)
            seconds += peer.build / threads
            if frame.occlusion:
                ours = film.color[..., 0] + (1 - film.color[..., 3])
                assert abs(float(ours.mean()) - mean) < 5e-3, "the pictures differ"
            ratio = seconds / best
            theirs = [Figure(frame.name, work, "embree", threads, seconds, "s")]
        yield Figure(frame.name, work, f"ovolo {precision}", threads, best, "s", ratio)
        yield from theirs


def _picture(frame: Frame, ir: SceneIR, precision: Precision, threads: int) -> Film:
    return render(
        ir,
        width=frame.view.width,
        height=frame.view.height,
        samples=frame.occlusion or frame.samples,
        integrator="ambient_occlusion" if frame.occlusion else "direct",
        precision=precision,
        threads=threads,
    )
