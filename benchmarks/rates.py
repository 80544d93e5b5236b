"""Rays per second on batches given as arrays, beside the peers in the same run.

Rates are CPU seconds over threads, so that a machine shared with others does not blur them. Every
answer (the number of hits) is checked against the reference before its time counts.
"""

from __future__ import annotations

import json
import os
import statistics
import subprocess
import time
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmarks import scenes
from compiler.flatten import flatten
from dsl.scene import FloatArray, Precision, SceneGraph
from runtime.tracer import Tracer

RAYS = 3200 * 3128
"""Rays of a batch: large enough that neither caches nor start-up count."""


@dataclass(frozen=True, slots=True)
class Rate:
    """One figure: `mrays` million rays per second and thread, `hits` of the batch that hit."""

    scene: str
    rays: str
    query: str
    who: str
    threads: int
    mrays: float
    hits: int


@dataclass(frozen=True, slots=True)
class Workload:
    """A scene with a view, and what the Embree driver calls them."""

    name: str
    make: Callable[[], SceneGraph]
    view: scenes.View
    peer_scene: str
    peer_geometry: str


WORKLOADS = (
    Workload("s1", scenes.ellipsoids, scenes.S1_VIEW.resized(3200, 3128), "s1", "user-inst"),
    Workload(
        "s2-triangles",
        lambda: scenes.igloo(triangles=True),
        scenes.S2_VIEW.resized(3200, 3128),
        "s2",
        "tri-inst",
    ),
    Workload(
        "s2-wedges",
        lambda: scenes.igloo(triangles=False),
        scenes.S2_VIEW.resized(3200, 3128),
        "s2",
        "tri-inst",
    ),
)


def measure(
    workloads: Iterable[Workload],
    precision: Precision = "float32",
    threads: int = 1,
    repeat: int = 3,
    rays: int = RAYS,
) -> Iterator[Rate]:
    """Our rates and Embree's, alternating, for every workload, kind of rays and query."""
    for load in workloads:
        tracer = prepared(load.make(), precision, threads)
        origins, directions = load.view.rays()
        batches = {
            "camera": thinned(origins, directions, rays),
            "bounce": bounce(tracer, origins, directions, rays),
        }
        for kind, (o, d) in batches.items():
            for query in ("closest", "any"):
                ours, theirs = [], []
                hits = 0
                for _ in range(repeat):
                    seconds, hits = _ours(tracer, o, d, query)
                    ours.append(seconds / threads)
                    peer = embree(load, kind, query, threads)
                    if peer is not None:
                        theirs.append(peer)
                ovolo = len(o) / statistics.median(ours) * 1e-6
                yield Rate(load.name, kind, query, f"ovolo {precision}", threads, ovolo, hits)
                for kernel in {p.who for p in theirs}:
                    same = [p for p in theirs if p.who == kernel]
                    yield sorted(same, key=lambda p: p.mrays)[len(same) // 2]


def prepared(graph: SceneGraph, precision: Precision = "float32", threads: int = 1) -> Tracer:
    """A tracer of a benchmark scene, which names no files and has no faults."""
    ir = flatten(graph, lambda file: (None, [])).ir
    assert ir is not None
    return Tracer(ir, precision, threads=threads)


def thinned(
    origins: FloatArray, directions: FloatArray, count: int
) -> tuple[FloatArray, FloatArray]:
    """About `count` of the rays: whole tiles of 16, evenly over the picture."""
    tiles = len(origins) // 16
    chosen = np.arange(min(count // 16, tiles)) * tiles // max(min(count // 16, tiles), 1)
    rows = (chosen[:, None] * 16 + np.arange(16)).ravel()
    return origins[rows], directions[rows]


def bounce(
    tracer: Tracer, origins: FloatArray, directions: FloatArray, count: int
) -> tuple[FloatArray, FloatArray]:
    """Cosine-distributed rays from the first hits, cycled until there are `count`."""
    hits = tracer.trace(origins, directions)
    hit = np.flatnonzero(hits.hit)
    hit = hit[np.arange(count) * len(hit) // count]
    normal = hits.normal[hit]
    normal = np.where(np.sum(normal * directions[hit], 1, keepdims=True) > 0, -normal, normal)
    random = np.random.default_rng(12345)
    around = random.normal(size=(count, 3))
    around /= np.linalg.norm(around, axis=1, keepdims=True)
    out = normal + around * (1 - 1e-9)
    out /= np.linalg.norm(out, axis=1, keepdims=True)
    start = hits.position[hit] + 1e-3 * normal
    return _rounded(start), _rounded(out)


def _rounded(a: FloatArray) -> FloatArray:
    """Values a float32 peer can read exactly."""
    return a.astype(np.float32).astype(np.float64)


def _ours(tracer: Tracer, o: FloatArray, d: FloatArray, query: str) -> tuple[float, int]:
    start = time.process_time()
    if query == "closest":
        count = int(np.count_nonzero(tracer.trace(o, d).instance >= 0))
    else:
        count = int(np.count_nonzero(tracer.occluded(o, d)))
    return time.process_time() - start, count


def embree(load: Workload, kind: str, query: str, threads: int) -> Rate | None:
    """The best of Embree's kernels through `../shared/peers`, or None where it is not built."""
    folder = os.environ.get("PEER_WORK")
    program = Path(folder or ".") / "embree_bench4"
    rays = Path(folder or ".") / f"{load.peer_scene}_{'cam' if kind == 'camera' else 'inc'}.rays"
    if folder is None or not program.exists() or not rays.exists():
        return None
    command = [
        str(program), "--scene", load.peer_scene, "--geom", load.peer_geometry,
        "--rays", rays.name, "--coherent", "1" if kind == "camera" else "0",
        "--threads", str(threads), "--reps", "1",
    ]  # fmt: skip
    output = subprocess.run(command, capture_output=True, text=True, timeout=600, check=True).stdout
    lines = [json.loads(line) for line in output.splitlines() if '"mrays"' in line]
    best = max((line for line in lines if line["query"] == query), key=lambda line: line["mrays"])
    return Rate(
        load.name, kind, query, "embree 4", threads, float(best["mrays"]), int(best["hits"])
    )
