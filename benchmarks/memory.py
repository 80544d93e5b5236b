"""Bytes per instance, beside storing transformed copies of the geometry: `docs/memory.md`.

`python -m benchmarks.memory` prints the table. Each scene is flattened in a process of its own, so
that the peak of memory is its own.
"""

from __future__ import annotations

import resource
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass

from benchmarks import scenes
from compiler.flatten import flatten
from compiler.inspect import summarize
from compiler.ir import SceneIR, leaf_counts
from dsl.scene import SceneGraph

SCENES: dict[str, Callable[[], SceneGraph]] = {
    "256 ellipsoids": scenes.ellipsoids,
    "igloo of 311 bevelled blocks": lambda: scenes.igloo(triangles=False),
    "igloo of 311 meshes": lambda: scenes.igloo(triangles=True),
    "10⁶ spheres": lambda: scenes.cloud(10**6, triangles=False),
    "10⁶ meshes of 1 280 triangles": lambda: scenes.cloud(10**6, triangles=True),
    "three levels of 1 000": scenes.nested,
}

SPHERE_MESH = (642, 1_280)
BLOCK_MESH = (10_088, 20_172)
COPIES = {
    "256 ellipsoids": SPHERE_MESH,
    "igloo of 311 bevelled blocks": BLOCK_MESH,
    "igloo of 311 meshes": BLOCK_MESH,
    "10⁶ spheres": SPHERE_MESH,
    "10⁶ meshes of 1 280 triangles": SPHERE_MESH,
    "three levels of 1 000": (42, 80),
}
"""Points and triangles that a copy of each object would store, tessellated where it is analytic."""


@dataclass(frozen=True, slots=True)
class Memory:
    """One row: bytes of the IR and of copies, CPU seconds to flatten, peak bytes meanwhile."""

    scene: str
    leaves: int
    ir: int
    copies: int
    seconds: float
    peak: int


def measure(name: str) -> Memory:
    """Flatten a scene and take its figures; the peak counts from before the scene was made."""
    before = _peak()
    graph = SCENES[name]()
    start = time.process_time()
    ir = flatten(graph, lambda file: (None, [])).ir
    seconds = time.process_time() - start
    assert ir is not None
    return Memory(name, _leaves(ir), ir.nbytes, _copies(ir, name), seconds, _peak() - before)


def _leaves(ir: SceneIR) -> int:
    count = int(leaf_counts(ir)[0])
    assert count == summarize(ir).leaves
    return count


def _copies(ir: SceneIR, name: str) -> int:
    """Float32 points and int32 triangles of every leaf, in world space."""
    points, triangles = COPIES[name]
    return _leaves(ir) * (12 * points + 12 * triangles)


def _peak() -> int:
    return 1024 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss


def _row(memory: Memory) -> str:
    per_leaf = memory.ir / memory.leaves
    copy = memory.copies / memory.leaves
    return (
        f"| {memory.scene} | {memory.leaves:,} | {_size(memory.ir)} | {per_leaf:,.3g} B "
        f"| {copy:,.0f} B | {_size(memory.copies)} | {memory.copies / memory.ir:,.0f} × "
        f"| {memory.seconds:.2f} s | {_size(memory.peak)} |"
    )


def _size(count: float) -> str:
    for unit in ("B", "kB", "MB", "GB"):
        if count < 1000:
            return f"{count:.3g} {unit}"
        count /= 1000
    return f"{count:.3g} TB"


def main() -> None:
    """Print the table, a row for each scene; with the name of a scene its row only."""
    if sys.argv[1:]:
        print(_row(measure(sys.argv[1])))
        return
    print(
        "| scene | leaves | IR | per leaf | a copy | all copies | copies / IR | flatten | peak |\n"
        "|---|---|---|---|---|---|---|---|---|",
        flush=True,
    )
    for name in SCENES:
        subprocess.run([sys.executable, "-m", "benchmarks.memory", name], check=True)


if __name__ == "__main__":
    main()
