"""Pictures from the IR on, the first call included; and whole processes."""

from __future__ import annotations

import math
import resource
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmarks import embree, scenes
from benchmarks.process import ovolo
from benchmarks.rates import compiled, timed
from benchmarks.rays import SUN
from benchmarks.record import Figure
from compiler.ir import SceneIR
from dsl.scene import Bind, Group, Material, Precision, SceneGraph, Sun
from runtime.film import Film
from runtime.render import render

MATTE = Material(diffuse=(0.8, 0.8, 0.8), specular_workflow=True)
"""What Embree's driver shades with."""


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
        """The scene, matte, with camera and sun."""
        sun = Sun(tuple(-SUN), (1.0, 1.0, 1.0))
        root = Bind(self.scene.root, MATTE)
        parts = (root, self.view.camera(), *(() if self.occlusion else (sun,)))
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
    """Seconds per picture, ours and Embree's: the best of `repeat` rounds, by turns.

    Embree's driver takes one camera sample per pixel: of 16 samples it makes four times the columns
    and rows, of occlusion rays one sample with all of them where ours takes 16.
    """
    for frame in frames():
        ir = frame.ir()
        peer = None if embree.driver() is None else embree.Embree(compiled(frame.peer))
        finer = math.isqrt(frame.samples)
        view = frame.view.resized(frame.view.width * finer, frame.view.height * finer)
        ours = theirs = np.inf
        for _ in range(repeat):
            seconds, film = timed(_picture, frame, ir, precision, threads)
            ours = min(ours, seconds / threads)
            if peer is not None:
                seconds, mean = peer.frame(view, SUN, frame.occlusion, threads, 1)
                theirs = min(theirs, seconds + peer.build / threads)
                if frame.occlusion:
                    bright = film.color[..., 0] + (1 - film.color[..., 3])
                    assert abs(float(bright.mean()) - mean) < 5e-3, "the pictures differ"
        work = f"{frame.occlusion} occlusion" if frame.occlusion else f"{frame.samples} sample(s)"
        ratio = None if peer is None else theirs / ours
        yield Figure(frame.name, work, f"ovolo {precision}", threads, ours, "s", ratio)
        if peer is not None:
            yield Figure(frame.name, work, "embree", threads, theirs, "s")


def processes(repeat: int) -> Iterator[Figure]:
    """CPU seconds from start to exit: a program becomes a PNG on one thread, Embree's nothing."""
    turn = "sphere().scale(1, 4, 1).translate(0, 10, 0).rotate_z(22.5deg * i).rotate_x(22.5deg * j)"
    view = scenes.S1_VIEW
    program = (
        f"settings(width: {view.width}, height: {view.height}, samples: 1)\n"
        f"camera(from: {view.eye}, at: {view.at}, fov: {view.fov}deg)\n"
        f"sun(direction: {tuple(-float(x) for x in SUN)})\n"
        f"for i in 0..16, j in 0..16 {{ {turn} }}.material(matte(rgb(0.8, 0.8, 0.8)))\n"
    )
    with tempfile.TemporaryDirectory() as folder:
        source = Path(folder) / "ellipsoids.ovo"
        source.write_text(program)
        words = ["--quiet", "--threads", "1", "-o", str(source.with_suffix(".png"))]
        ours = min(ovolo("render", str(source), *words).cpu for _ in range(max(2, repeat)))
    ratio = None
    theirs: list[Figure] = []
    if embree.driver() is not None:
        peer = embree.Embree(compiled(scenes.ellipsoids()))
        seconds = _child_seconds(lambda: peer.process(view, SUN), repeat)
        ratio = seconds / ours
        theirs = [Figure("ellipsoids", "whole process", "embree", 1, seconds, "s")]
    yield Figure("ellipsoids", "whole process", "ovolo float32", 1, ours, "s", ratio)
    yield from theirs


def _child_seconds(run: Callable[[], object], repeat: int) -> float:
    """The least CPU seconds of the processes that `run` starts and waits for."""
    best = math.inf
    for _ in range(repeat):
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        run()
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        used = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
        best = min(best, used)
    return best


def _picture(frame: Frame, ir: SceneIR, precision: Precision, threads: int) -> Film:
    return render(
        ir,
        width=frame.view.width,
        height=frame.view.height,
        samples=frame.occlusion or frame.samples,
        integrator="ambient_occlusion" if frame.occlusion else "direct",
        precision=precision,
        threads=threads,
        surfaces=False,
    )
