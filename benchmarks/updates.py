"""The price of an edit: `python -m benchmarks.updates` prints it.

10 000 instances of a mesh of 20 172 triangles. What is timed is from the compiled scene to a tracer
that has answered its first ray: a new one, and updates after all instances, one, or no more than
the materials have changed. Each answers as the new one before its time counts.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np

from benchmarks.rates import compiled
from benchmarks.scenes import block_mesh
from compiler.ir import SceneIR
from dsl.scene import FloatArray, Instances, SceneGraph, Step, StepKind, Transform
from runtime.tracer import Tracer

INSTANCES = 10_000
REPEAT = 5


def scene(shift: FloatArray) -> SceneIR:
    """A grid of instances, each moved by a row of `shift`, or all by the only one."""
    x, z = np.mgrid[0:100, 0:100].reshape(2, -1)
    places = np.stack([x, 0 * x, z], 1) * 1.5 + shift
    child = Instances(block_mesh(), Transform((Step(StepKind.TRANSLATE, places),)))
    return compiled(SceneGraph(child))


def measure() -> Iterator[tuple[str, float]]:
    """What was done, and the CPU seconds of the fastest of `REPEAT`."""
    before, after = scene(np.zeros(3)), scene(np.array([0.1, 0.2, 0.3]))
    one = np.zeros((INSTANCES, 3))
    one[5000] = 0.5
    painted = before.materials.copy()
    painted["diffuse"] = 0.5
    tracer = Tracer(before, "float32")
    edits = {
        "all instances moved": after,
        "one instance moved": scene(one),
        "materials changed": replace(before, materials=painted),
    }
    yield "new", _seconds(lambda: Tracer(after, "float32"))
    for name, ir in edits.items():
        rays = np.random.default_rng(0).uniform(0, 150, (1000, 3)), (0.3, -1, 0.2)
        updated, fresh = tracer.updated(ir).trace(*rays), Tracer(ir, "float32").trace(*rays)
        assert np.array_equal(updated.t, fresh.t)
        assert np.array_equal(updated.instance, fresh.instance)
        yield name, _seconds(lambda ir=ir: tracer.updated(ir))  # type: ignore[misc]


def _seconds(prepare: Callable[[], Tracer]) -> float:
    times = []
    for _ in range(REPEAT):
        start = time.process_time()
        prepare().trace((0, 9, 0), (0, -1, 0))
        times.append(time.process_time() - start)
    return min(times)


if __name__ == "__main__":
    for what, seconds in measure():
        print(f"{what:20} {seconds * 1e3:8.2f} ms")
