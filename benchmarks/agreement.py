"""Does the compiled path say what the interpreter says? `python -m benchmarks.agreement`.

Random nested scenes go through both: flattened and traced by the kernel, and interpreted as they
are, with 64-bit mantissas. A hit agrees if it is of the same leaf, and t, point and normal are
within `LIMIT` units of `benchmarks.conditioning`. Where it does not, the ray is interpreted again,
moved by as many units to all sides: if that changes the truth, and the kernel's answer is a miss
or a point of some surface, nobody could decide the ray; else the kernel, the compiler or the
interpreter is wrong.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Iterable
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from benchmarks.conditioning import Leaves, Units, leaves, units
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
    position: FloatArray
    leaf: IntArray
    material: IntArray

    def at(self, index: NDArray[np.intp]) -> Answer:
        """Some of them."""
        return Answer(
            self.t[index],
            self.normal[index],
            self.position[index],
            self.leaf[index],
            self.material[index],
        )


@dataclass(slots=True)
class Tally:
    """What came of the rays of one precision."""

    rays: int = 0
    hits: int = 0
    undecided: int = 0
    wrong: list[str] = field(default_factory=list)
    kinds: list[NDArray[np.uint8]] = field(default_factory=list)
    errors: list[FloatArray] = field(default_factory=list)


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
        normal = found.normal.T.astype(np.float64)
        length = np.where(found.leaf >= 0, np.linalg.norm(normal, axis=1), np.nan)
        position = found.point.T.astype(np.float64)
        return Answer(found.t, normal / length[:, None], position, found.leaf, found.material)

    def compare(self, rays: Rays, precision: str, tally: Tally) -> None:
        """Trace and judge the rays."""
        truth = self.interpreted(rays)
        t, normal, position, leaf, prototype, material = Kernel(self.ir, precision).trace(*rays)
        traced = Answer(t, normal, position, leaf, material.astype(np.int64))
        hit = np.flatnonzero((leaf >= 0) & (leaf == truth.leaf))
        doubtful = leaf != truth.leaf
        doubtful[hit] = self.wrong(rays, truth, traced, hit, precision)
        agreed = hit[~doubtful[hit]]
        tally.rays += len(t)
        tally.hits += int((truth.leaf >= 0).sum())
        tally.kinds.append(self.ir.prototype_kind[prototype[agreed]])
        tally.errors.append(self.errors(rays, truth, traced, agreed, precision))
        for ray in np.flatnonzero(doubtful).tolist():
            if self.undecidable(rays, ray, truth, traced, precision):
                tally.undecided += 1
            else:
                tally.wrong.append(self.describe(rays, ray, truth, traced, precision))
        bound = [self.interpreter.materials[m].diffuse for m in truth.material[hit]]
        if bound and not np.array_equal(bound, self.ir.materials["diffuse"][material[hit]]):
            tally.wrong.append(f"{self.name}: materials differ")

    def errors(
        self, rays: Rays, truth: Answer, answer: Answer, hit: NDArray[np.intp], precision: str
    ) -> FloatArray:
        """Errors `(3, k)` of t, position and normal, in units, where both hit the same leaf."""
        rays, truth, answer = rays.at(hit), truth.at(hit), answer.at(hit)
        unit = units(
            self.leaves,
            truth.leaf,
            rays.origins,
            rays.directions,
            truth.t.astype(np.float64),
            truth.normal,
            precision,
        )
        off = (answer.t - truth.t).astype(np.float64)
        inverse = self.leaves.object_from_world[truth.leaf, :, :3]
        away = np.einsum("nij,nj->ni", inverse, answer.position - truth.position)
        turned = np.linalg.norm(answer.normal - truth.normal, axis=1)
        return np.stack(
            [
                np.abs(off) / unit.t,
                np.linalg.norm(away, axis=1) / unit.position,
                turned / unit.normal,
            ]
        )

    def wrong(
        self, rays: Rays, truth: Answer, answer: Answer, hit: NDArray[np.intp], precision: str
    ) -> NDArray[np.bool_]:
        """Where `errors` are not within `LIMIT`."""
        errors = self.errors(rays, truth, answer, hit, precision)
        return np.asarray(~(errors <= LIMIT).all(axis=0))

    def undecidable(
        self, rays: Rays, ray: int, truth: Answer, traced: Answer, precision: str
    ) -> bool:
        """Whether the truth changes when the ray moves by `LIMIT` units, and the answer may be so.

        A ray that runs along a surface within rounding, or meets an edge, may be said to miss, or
        to hit anything that is there. It may be so parallel to a flat shape that no try finds the
        change: then the unit of its point exceeds the shape.
        """
        rng = np.random.default_rng(ray)
        moved, lost = [], False
        for answer in (truth, traced):
            leaf = answer.leaf[ray]
            if leaf >= 0:
                unit, to_world = self.unit(rays, ray, answer, precision)
                moved.append(self.moved(rays, ray, unit, to_world, rng))
                lost |= bool(LIMIT * unit.position[0] > self.leaves.size[leaf])
        tries = Rays(*(np.concatenate(values) for values in zip(*moved, strict=True)))
        found = self.interpreted(tries)
        changed = found.leaf != truth.leaf[ray]
        if truth.leaf[ray] >= 0:
            same = np.flatnonzero(~changed)
            before = truth.at(np.full(len(changed), ray))
            changed[same] = self.wrong(tries, found, before, same, precision)
        if traced.leaf[ray] < 0 or not (lost or changed.any()):
            return lost or bool(changed.any())
        after = traced.at(np.full(len(changed), ray))
        same = np.flatnonzero(found.leaf == traced.leaf[ray])
        return not self.wrong(tries, found, after, same, precision).all() or self.on_surface(
            rays, ray, traced, precision, rng
        )

    def moved(
        self, rays: Rays, ray: int, unit: Units, to_world: FloatArray, rng: np.random.Generator
    ) -> Rays:
        """`TRIES` rays around one, within `LIMIT` units of it as its hit there counts them.

        Half of them much nearer: a parallel ray that clears a plane is turned into it more easily.
        """
        nearness = rng.uniform(-12, 0, (2, TRIES, 1)) * (np.arange(TRIES) % 2)[:, None]
        shift, turn = rng.uniform(-LIMIT, LIMIT, (2, TRIES, 3)) * 10.0**nearness
        turn = turn * unit.turn @ to_world
        shift = shift * unit.displacement @ to_world - unit.pivot * turn
        tries = rays.at(np.full(TRIES, ray))
        return Rays(tries.origins + shift, tries.directions + turn, tries.t_min, tries.t_max)

    def on_surface(
        self, rays: Rays, ray: int, traced: Answer, precision: str, rng: np.random.Generator
    ) -> bool:
        """Whether the point of a hit is on a surface, with its normal, within `LIMIT` units.

        Tried by rays that come down on it along the normal; what they meet may be a leaf that is
        in the same place. A point that rounding may move beyond its own distance is anywhere.
        """
        hit = traced.at(np.full(1, ray))
        unit, to_world = self.unit(rays, ray, traced, precision)
        if LIMIT * unit.position[0] > np.linalg.norm(hit.position @ np.linalg.inv(to_world)):
            return True
        shift = rng.uniform(-LIMIT, LIMIT, (TRIES, 3)) * unit.displacement @ to_world
        height = np.full(TRIES, 4 * LIMIT * np.linalg.norm(unit.displacement @ np.abs(to_world)))
        down = -np.repeat(hit.normal, TRIES, axis=0)
        probes = Rays(hit.position + shift - down * height[:, None], down, 0 * height, 2 * height)
        found = self.interpreted(probes)
        met = np.flatnonzero(found.leaf >= 0)
        facing = np.where((found.normal * down).sum(axis=1) > 0, 1, -1)
        claimed = replace(found, normal=facing[:, None] * down)
        return bool((~self.wrong(probes, found, claimed, met, precision)).any())

    def unit(
        self, rays: Rays, ray: int, answer: Answer, precision: str
    ) -> tuple[Units, FloatArray]:
        """The unit of one ray's hit, and what takes rows from object to world space."""
        one, hit = rays.at(np.full(1, ray)), answer.at(np.full(1, ray))
        t = hit.t.astype(np.float64)
        unit = units(self.leaves, hit.leaf, one.origins, one.directions, t, hit.normal, precision)
        return unit, self.leaves.world_from_object[hit.leaf[0], :, :3].T

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
    columns = [f"{precision} {what}" for precision in tallies for what in ("t", "point", "normal")]
    lines += ["", "median / worst units", " " * 10 + "".join(f"{c:>16s}" for c in columns)]
    for number, kind in enumerate(KINDS):
        line = f"{kind:10s}"
        for tally in tallies.values():
            errors = np.concatenate(tally.errors, axis=1)[:, np.concatenate(tally.kinds) == number]
            for some in errors:
                shown = f"{np.median(some):.2f} / {some.max():.2f}" if some.size else "-"
                line += f"{shown:>16s}"
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
