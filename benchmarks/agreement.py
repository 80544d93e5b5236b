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
from benchmarks.rates import compiled
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


def product(matrices: FloatArray, vectors: FloatArray) -> FloatArray:
    """Matrices `(n, 3, 3)` times vectors `(n, 3)`."""
    products: FloatArray = np.einsum("nij,nj->ni", matrices, vectors)
    return products


class Judge:
    """One scene, both ways."""

    def __init__(self, graph: SceneGraph, name: str) -> None:
        self.name = name
        self.graph = graph
        self.interpreter = ReferenceTracer(graph, number="longdouble")
        self.ir: SceneIR = compiled(graph)
        self.leaves: Leaves = leaves(self.ir)

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
        kernel = Kernel(self.ir, precision)
        t, leaf, primitive = kernel.trace(*rays)
        normal, position, prototype, material, _ = kernel.surface(
            rays.origins, rays.directions, t, leaf, primitive
        )
        traced = Answer(t, normal, position, leaf, material.astype(np.int64))
        doubtful = self.differs(rays, truth, traced, precision)
        agreed = np.flatnonzero((leaf >= 0) & ~doubtful)
        tally.rays += len(t)
        tally.hits += int((truth.leaf >= 0).sum())
        tally.kinds.append(self.ir.prototype_kind[prototype[agreed]])
        tally.errors.append(
            self.errors(rays.at(agreed), truth.at(agreed), traced.at(agreed), precision)
        )
        rays_in_doubt = np.flatnonzero(doubtful)
        excused = self.undecidable(rays, rays_in_doubt, truth, traced, precision)
        tally.undecided += int(excused.sum())
        for ray in rays_in_doubt[~excused].tolist():
            tally.wrong.append(self.describe(ray, truth, traced, precision))
        bound = [self.interpreter.materials[m].diffuse for m in truth.material[agreed]]
        if bound and not np.array_equal(bound, self.ir.materials["diffuse"][material[agreed]]):
            tally.wrong.append(f"{self.name}: materials differ")

    def errors(self, rays: Rays, truth: Answer, answer: Answer, precision: str) -> FloatArray:
        """Errors `(3, n)` of t, position and normal, in units, where both hit the same leaf."""
        unit = self.units(rays, truth, precision)
        off = (answer.t - truth.t).astype(np.float64)
        inverse = self.leaves.object_from_world[truth.leaf, :, :3]
        away = product(inverse, answer.position - truth.position)
        turned = np.linalg.norm(answer.normal - truth.normal, axis=1)
        return np.stack(
            [
                np.abs(off) / unit.t,
                np.linalg.norm(away, axis=1) / unit.position,
                turned / unit.normal,
            ]
        )

    def differs(
        self, rays: Rays, truth: Answer, answer: Answer, precision: str
    ) -> NDArray[np.bool_]:
        """Where the leaves are not the same, or `errors` not within `LIMIT`."""
        different: NDArray[np.bool_] = answer.leaf != truth.leaf
        hit = np.flatnonzero(~different & (truth.leaf >= 0))
        errors = self.errors(rays.at(hit), truth.at(hit), answer.at(hit), precision)
        different[hit] = ~(errors <= LIMIT).all(axis=0)
        return different

    def undecidable(
        self,
        rays: Rays,
        doubtful: NDArray[np.intp],
        truth: Answer,
        traced: Answer,
        precision: str,
    ) -> NDArray[np.bool_]:
        """Whether the truth changes when a ray moves by `LIMIT` units, and the answer may be so.

        A ray that runs along a surface within rounding, or meets an edge, may be said to miss, or
        to hit anything that is there. It may be so parallel to a flat shape that no try finds the
        change: then the unit of its point exceeds the shape.
        """
        changes, may_be = np.zeros((2, len(traced.leaf)), bool)
        may_be[traced.leaf < 0] = True
        for answer in (truth, traced):
            hit = doubtful[answer.leaf[doubtful] >= 0]
            unit = self.units(rays.at(hit), answer.at(hit), precision)
            at_home = self.leaves.size[answer.leaf[hit]]
            changes[hit[LIMIT * unit.position > at_home]] = True

            index = np.repeat(hit, TRIES)
            tries = self.moved(rays.at(index), answer.at(index), precision)
            found = self.interpreted(tries)
            changes[index[self.differs(tries, found, truth.at(index), precision)]] = True
            may_be[index[~self.differs(tries, found, traced.at(index), precision)]] = True
        hit = doubtful[traced.leaf[doubtful] >= 0]
        may_be[hit[self.on_surface(rays.at(hit), traced.at(hit), precision)]] = True
        return np.asarray((changes & may_be)[doubtful])

    def moved(self, rays: Rays, hits: Answer, precision: str) -> Rays:
        """Each ray, moved within `LIMIT` units of its hit.

        Half of them much less: a parallel ray that clears a plane is turned into it more easily.
        """
        n = len(hits.t)
        rng = np.random.default_rng(n)
        unit, to_world = self.units(rays, hits, precision), self.to_world(hits)
        nearness = rng.uniform(-12, 0, (2, n, 1)) * (np.arange(n) % 2)[:, None]
        shift, turn = rng.uniform(-LIMIT, LIMIT, (2, n, 3)) * 10.0**nearness
        turn = product(to_world, turn * unit.turn)
        shift = product(to_world, shift * unit.displacement) - unit.pivot[:, None] * turn
        return replace(rays, origins=rays.origins + shift, directions=rays.directions + turn)

    def on_surface(self, rays: Rays, hits: Answer, precision: str) -> NDArray[np.bool_]:
        """Whether points of hits are on a surface, with its normal, within `LIMIT` units.

        Tried by rays that come down on it along the normal; what they meet may be a leaf that is
        in the same place. A point that rounding may move beyond its own distance is anywhere.
        """
        n = len(hits.t)
        unit = self.units(rays, hits, precision)
        inverse = self.leaves.object_from_world[hits.leaf, :, :3]
        distance = np.linalg.norm(product(inverse, hits.position), axis=1)
        index = np.repeat(np.arange(n), TRIES)
        hits, to_world = hits.at(index), self.to_world(hits)[index]
        reach = LIMIT * unit.displacement[index]
        shift = product(to_world, np.random.default_rng(n).uniform(-1, 1, reach.shape) * reach)
        height = 4 * np.linalg.norm(product(np.abs(to_world), reach), axis=1)
        down = -hits.normal
        probes = Rays(hits.position + shift - down * height[:, None], down, 0 * height, 2 * height)
        found = self.interpreted(probes)
        facing = np.where((found.normal * down).sum(axis=1) > 0, 1, -1)
        claimed = replace(found, normal=facing[:, None] * down)
        met = (found.leaf >= 0) & ~self.differs(probes, found, claimed, precision)
        return np.asarray((LIMIT * unit.position > distance) | met.reshape(n, TRIES).any(axis=1))

    def units(self, rays: Rays, hits: Answer, precision: str) -> Units:
        """The units of hits."""
        t = hits.t.astype(np.float64)
        return units(
            self.leaves, hits.leaf, rays.origins, rays.directions, t, hits.normal, precision
        )

    def to_world(self, hits: Answer) -> FloatArray:
        """The linear part of `world_from_object` of the leaves hit, `(n, 3, 3)`."""
        return self.leaves.world_from_object[hits.leaf, :, :3]

    def describe(self, ray: int, truth: Answer, traced: Answer, precision: str) -> str:
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
