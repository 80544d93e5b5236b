"""Rays per second on batches given as arrays, beside the peers in the same run.

Every answer is checked before its time counts: ours against the reference interpreter on some of
the rays (or, where that is too slow, against our float64), the peers' against ours.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from itertools import product
from typing import ParamSpec, TypeVar

import numpy as np
from numpy.typing import NDArray

from benchmarks import embree, scenes
from benchmarks.rays import RAY_KINDS, Batch, RayKind, batches
from benchmarks.record import Figure
from compiler.flatten import flatten
from compiler.ir import SceneIR
from dsl.scene import FloatArray, Precision, SceneGraph
from runtime.reference import ReferenceTracer
from runtime.tracer import Tracer

P = ParamSpec("P")
T = TypeVar("T")

RAYS = 1 << 20
"""Rays of a batch: large enough that start-up does not count."""
ROUND = 3
"""Times that each does the same in a round, before the next one's turn: the first fills caches."""
CHECKED = 32
"""Rays that the interpreter, which takes milliseconds for each and leaf, has to answer."""
DECIDABLE = 2e-4
"""The part of the rays that may hit by one arithmetic and miss by another."""
PEER_DECIDABLE = 2e-3
"""The same for who rounds in world space, or has triangles in place of bevelled wedges."""


@dataclass(frozen=True, slots=True)
class Workload:
    """A scene with a view; `peer` is the same for who has only spheres and triangles."""

    name: str
    make: Callable[[], SceneGraph]
    view: scenes.View
    peer: Callable[[], SceneGraph] | None = None
    kinds: tuple[RayKind, ...] = RAY_KINDS
    interpreted: bool = False
    """Whether the interpreter can trace it within seconds."""


def _igloo(triangles: bool) -> Callable[[], SceneGraph]:
    return lambda: scenes.igloo(triangles=triangles)


_MESHES = _igloo(True)


def _cloud(count: int, triangles: bool) -> Callable[[], SceneGraph]:
    return lambda: scenes.cloud(count, triangles=triangles)


_SPHERES, _CLOUD_OF_MESHES = _cloud(10**6, False), _cloud(10**6, True)


def _large(view: scenes.View) -> scenes.View:
    return view.resized(3200, 3128)


WORKLOADS = (
    Workload("ellipsoids", scenes.ellipsoids, _large(scenes.S1_VIEW), scenes.ellipsoids,
             interpreted=True),
    Workload("igloo wedges", _igloo(False), _large(scenes.S2_VIEW), _MESHES),
    Workload("igloo meshes", _MESHES, _large(scenes.S2_VIEW), _MESHES),
    Workload("10⁶ spheres", _SPHERES, scenes.S4_VIEW, _SPHERES,
             ("camera", "bounce")),
    Workload("10⁶ meshes", _CLOUD_OF_MESHES, scenes.S4_VIEW, _CLOUD_OF_MESHES,
             ("camera", "bounce")),
    Workload("10⁹ nested", scenes.nested, scenes.S5_VIEW, kinds=("camera", "bounce")),
    Workload("rough ball", scenes.rough_ball, _large(scenes.BALL_VIEW), scenes.rough_ball),
    Workload("soup", scenes.soup, scenes.SOUP_VIEW, interpreted=True),
)  # fmt: skip


def measure(
    workloads: Iterable[Workload],
    precisions: Iterable[Precision],
    threads: int = 1,
    repeat: int = 3,
    rays: int = RAYS,
) -> Iterator[Figure]:
    """Builds and rates of ours and of the peers, by kind of rays and query.

    The best of `repeat` rounds, in which they take turns.
    """
    for load in workloads:
        graph = load.make()
        ir = compiled(graph)
        tracers: dict[Precision, Tracer] = {}
        for precision in precisions:
            seconds, tracers[precision] = timed(Tracer, ir, precision, threads=threads)
            yield Figure(load.name, "build", f"ovolo {precision}", threads, seconds / threads, "s")
        peer = None
        if load.peer is not None and embree.driver() is not None:
            peer = embree.Embree(ir if load.peer is load.make else compiled(load.peer()))
        judge = tracers.get("float64") or Tracer(ir, "float64", threads=threads)
        for kind, batch in batches(judge, load.view, rays, load.kinds):
            expected = judge.trace(*batch)
            if load.interpreted:
                rate = interpreted(graph, batch, expected.t)
                yield Figure(load.name, f"{kind} closest", "interpreter", 1, rate, "Mrays/s")
            yield from _compared(load, kind, batch, expected.hit, tracers, peer, threads, repeat)
        if peer is not None:
            yield Figure(load.name, "build", "embree", threads, peer.build / threads, "s")


def _compared(
    load: Workload,
    kind: RayKind,
    rays: Batch,
    expected: NDArray[np.bool_],
    tracers: dict[Precision, Tracer],
    peer: embree.Embree | None,
    threads: int,
    repeat: int,
) -> Iterator[Figure]:
    count, right = len(rays.origins), int(np.count_nonzero(expected))
    queries: dict[str, Callable[[Tracer], NDArray[np.bool_]]] = {
        "closest": lambda tracer: tracer.trace(*rays, copy=False).hit,
        "any": lambda tracer: tracer.occluded(*rays),
    }
    ours: dict[tuple[str, Precision], float] = {}
    theirs: dict[str, float] = {}
    for _ in range(repeat):
        for query, (seconds, found) in peer.rates(rays, threads, ROUND).items() if peer else ():
            assert abs(found - right) <= PEER_DECIDABLE * count, (
                f"{load.name} {kind}: {found} hits, not {right}"
            )
            theirs[query] = min(theirs.get(query, np.inf), seconds)
        for query, (precision, tracer) in product(queries, tracers.items()):
            for _ in range(ROUND):
                seconds, hit = timed(queries[query], tracer)
                seen = query, precision
                ours[seen] = min(ours.get(seen, np.inf), seconds / threads)
            wrong = np.count_nonzero(hit != expected)
            assert wrong <= DECIDABLE * count, f"{load.name} {kind} {query}: {wrong} wrong answers"
    for query in queries:
        work = f"{kind} {query}"
        for precision in tracers:
            seconds = ours[query, precision]
            ratio = theirs[query] / seconds if theirs else None
            who, rate = f"ovolo {precision}", count / seconds * 1e-6
            yield Figure(load.name, work, who, threads, rate, "Mrays/s", ratio)
        if theirs:
            rate = count / theirs[query] * 1e-6
            yield Figure(load.name, work, "embree", threads, rate, "Mrays/s")


def interpreted(graph: SceneGraph, rays: Batch, t: FloatArray) -> float:
    """The interpreter's rate on some of the rays, for which it must find the same hits."""
    some = np.arange(CHECKED) * (len(t) // CHECKED)
    reference = Tracer.over(ReferenceTracer(graph))
    seconds, found = timed(reference.trace, rays.origins[some], rays.directions[some])
    np.testing.assert_allclose(t[some], found.t, rtol=1e-9)
    return CHECKED / seconds * 1e-6


def compiled(graph: SceneGraph) -> SceneIR:
    """The IR of a benchmark scene, which names no files and has no faults."""
    ir = flatten(graph, lambda file: (None, [])).ir
    assert ir is not None
    return ir


def prepared(graph: SceneGraph, precision: Precision = "float32", threads: int = 1) -> Tracer:
    """A tracer of a benchmark scene."""
    return Tracer(compiled(graph), precision, threads=threads)


def timed(work: Callable[P, T], *given: P.args, **named: P.kwargs) -> tuple[float, T]:
    """CPU seconds of all threads that `work` takes with these arguments, and what comes of it."""
    start = time.process_time()
    result = work(*given, **named)
    return time.process_time() - start, result
