"""Does the compiled path say what the interpreter says? `python -m benchmarks.agreement`.

Random nested scenes go through both: flattened and traced by the kernel, and interpreted as they
are, with 64-bit mantissas. A hit agrees if it is of the same leaf, and t and normal are
within `LIMIT` units of `benchmarks.conditioning`. Where it does not, the ray is tried again, moved
by as many units to all sides: if the kernel's answer is then right of one of them, nobody could
have decided the ray; else the kernel, the compiler or the interpreter is wrong.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from benchmarks.conditioning import Leaves, leaves, units
from benchmarks.random_scenes import Rays, random_rays, random_scene
from compiler.flatten import flatten
from compiler.ir import KINDS, SceneIR
from dsl.scene import FloatArray, IntArray, SceneGraph
from runtime._kernel import Kernel
from runtime.reference import ReferenceTracer

LIMIT = 16.0
TRIES = 48
PRECISIONS = ("float32", "float64")


@dataclass(frozen=True, slots=True)
class Answer:
    """Hits as `trace` returns them, t in any precision."""

    t: FloatArray
    normal: FloatArray
    leaf: IntArray
    material: IntArray

    def at(self, index: NDArray[np.intp]) -> Answer:
        """Some of them."""
        return Answer(self.t[index], self.normal[index], self.leaf[index], self.material[index])


@dataclass(slots=True)
class Tally:
    """What came of the rays of one precision."""

    rays: int = 0
    hits: int = 0
    undecided: int = 0
    wrong: list[str] = field(default_factory=list)
    kind: list[NDArray[np.uint8]] = field(default_factory=list)
    t_units: list[FloatArray] = field(default_factory=list)
    normal_units: list[FloatArray] = field(default_factory=list)


class Judge:
    """One scene, both ways."""

    def __init__(self, graph: SceneGraph, name: str) -> None:
        self.name = name
        self.graph = graph
        self.interpreter = ReferenceTracer(graph, number="longdouble")
        ir = flatten(graph, lambda file: (None, [])).ir
        assert ir is not None
        self.ir: SceneIR = ir
        self.leaves: Leaves = leaves(ir)

    def interpreted(self, rays: Rays) -> Answer:
        """The truth; the material as the IR's number of an equal one."""
        found = self.interpreter.closest(*rays)
        t, normal = found.t, found.normal.T.astype(np.float64)
        length = np.where(found.leaf >= 0, np.linalg.norm(normal, axis=1), np.nan)
        return Answer(t, normal / length[:, None], found.leaf, found.material)

    def compare(self, rays: Rays, precision: str, tally: Tally) -> None:
        """Trace and judge the rays."""
        truth = self.interpreted(rays)
        t, normal, _, leaf, prototype, material = Kernel(self.ir, precision).trace(*rays)
        traced = Answer(t, normal, leaf, material.astype(np.int64))
        hit = np.flatnonzero((leaf >= 0) & (leaf == truth.leaf))
        t_units, normal_units = self.errors(rays, truth, traced, hit, precision)

        doubtful = leaf != truth.leaf
        doubtful[hit] = ~((t_units <= LIMIT) & (normal_units <= LIMIT))
        decided = ~doubtful[hit]
        tally.rays += len(t)
        tally.hits += int((truth.leaf >= 0).sum())
        tally.kind.append(self.ir.prototype_kind[prototype[hit[decided]]])
        tally.t_units.append(t_units[decided])
        tally.normal_units.append(normal_units[decided])
        for ray in np.flatnonzero(doubtful).tolist():
            if self.undecidable(rays, ray, truth, traced, precision):
                tally.undecided += 1
            else:
                tally.wrong.append(self.describe(rays, ray, truth, traced, precision))
        bound = [self.interpreter.materials[m].diffuse for m in truth.material[hit]]
        if bound and not np.array_equal(bound, self.ir.materials["diffuse"][material[hit]]):
            tally.wrong.append(f"{self.name}: materials differ")

    def errors(
        self, rays: Rays, truth: Answer, traced: Answer, hit: NDArray[np.intp], precision: str
    ) -> tuple[FloatArray, FloatArray]:
        """Errors of t and of the normal, in units, of rays that both say hit the same leaf."""
        t, normal = truth.t[hit].astype(np.float64), truth.normal[hit]
        unit = units(
            self.leaves,
            truth.leaf[hit],
            rays.origins[hit],
            rays.directions[hit],
            t,
            normal,
            precision,
        )
        off = np.abs((traced.t[hit] - truth.t[hit]).astype(np.float64))
        turned = np.linalg.norm(traced.normal[hit] - normal, axis=1)
        return off / unit.t, turned / unit.normal

    def undecidable(
        self, rays: Rays, ray: int, truth: Answer, traced: Answer, precision: str
    ) -> bool:
        """Whether the kernel's answer is right of a ray moved by `LIMIT` units."""
        rng = np.random.default_rng(ray)
        one = rays.at(np.full(1, ray))
        moved = []
        for answer in (truth, traced):
            leaf = answer.leaf[[ray]]
            if leaf[0] < 0:
                continue
            t = answer.t[[ray]].astype(np.float64)
            unit = units(
                self.leaves, leaf, one.origins, one.directions, t, answer.normal[[ray]], precision
            )
            sides = rng.normal(size=(TRIES, 3))
            sides *= np.geomspace(0.1, 1, TRIES)[:, None] / np.abs(sides).max(axis=1)[:, None]
            shift = LIMIT * sides * unit.displacement
            moved.append(shift @ self.leaves.world_from_object[leaf[0], :, :3].T)
        shifts = np.concatenate(moved)
        tries = rays.at(np.full(len(shifts), ray))
        found = self.interpreted(
            Rays(tries.origins + shifts, tries.directions, tries.t_min, tries.t_max)
        )
        same = found.leaf == traced.leaf[ray]
        if traced.leaf[ray] < 0:
            return bool(same.any())
        again = np.flatnonzero(same)
        repeated = traced.at(np.full(len(shifts), ray))
        off, turned = self.errors(tries, found, repeated, again, precision)
        return bool(((off <= 2 * LIMIT) & (turned <= 2 * LIMIT)).any())

    def describe(self, rays: Rays, ray: int, truth: Answer, traced: Answer, precision: str) -> str:
        """A disagreement, to be reproduced."""

        def said(answer: Answer) -> str:
            leaf = int(answer.leaf[ray])
            if leaf < 0:
                return "miss"
            kind = KINDS[self.ir.prototype_kind[self.leaves.prototype[leaf]]]
            return f"{kind} {leaf} at {answer.t[ray]:.17g} {answer.normal[ray]}"

        return (
            f"{self.name} {precision} ray {ray}: interpreter {said(truth)}, kernel {said(traced)}"
        )


def agreement(seeds: Iterable[int], rays: int) -> dict[str, Tally]:
    """Judge one scene per seed, with that many rays each, in both precisions."""
    tallies = {precision: Tally() for precision in PRECISIONS}
    for seed in seeds:
        graph = random_scene(seed)
        judge, some = Judge(graph, f"scene {seed}"), random_rays(graph, rays, seed)
        for precision, tally in tallies.items():
            judge.compare(some, precision, tally)
    return tallies


def table(tallies: dict[str, Tally]) -> str:
    """Counts, and median / worst errors in units by shape."""
    lines = ["precision     rays     hits  undecided  wrong"]
    for precision, tally in tallies.items():
        lines.append(
            f"{precision:9s} {tally.rays:8d} {tally.hits:8d} {tally.undecided:10d} "
            f"{len(tally.wrong):6d}"
        )
    lines += ["", f"{'units of':14s}" + "".join(f"{p + ' t':>19s}{'normal':>16s}" for p in tallies)]
    for number, kind in enumerate(KINDS):
        line = f"{kind:14s}"
        for tally in tallies.values():
            of_kind = np.concatenate(tally.kind) == number
            for errors in (tally.t_units, tally.normal_units):
                some = np.concatenate(errors)[of_kind]
                shown = f"{np.median(some):.2f} / {some.max():.2f}" if some.size else "-"
                line += f"{shown:>{19 if errors is tally.t_units else 16}s}"
        lines.append(line)
    return "\n".join(lines)


def main() -> int:
    """Print the table, and every disagreement."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n", 1)[0])
    parser.add_argument("--scenes", type=int, default=1000)
    parser.add_argument("--rays", type=int, default=100, help="rays per scene")
    parser.add_argument("--seed", type=int, default=0, help="number of the first scene")
    options = parser.parse_args()
    start = time.perf_counter()
    tallies = agreement(range(options.seed, options.seed + options.scenes), options.rays)
    print(table(tallies))
    print(f"{options.scenes} scenes, {time.perf_counter() - start:.0f} s")
    wrong = [text for tally in tallies.values() for text in tally.wrong]
    print("\n".join(wrong))
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
