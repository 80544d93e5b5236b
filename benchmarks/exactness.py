"""Is every hit right, and to how many ulps? `python -m benchmarks.exactness` prints the table.

Random cases of every group are compiled and traced in both precisions and judged by
`benchmarks.truth` at 110 digits, from the numbers of program and rays as they stand in float64.

One *unit* of t is how far rounding alone may move it: with q the ray's origin slid next to the
shape, in object space, and W the inverse of the instance's linear part, the ray is uncertain by
ε (|q| + size) + 2·2⁻⁵³ |W| |W⁻¹ q| and its direction likewise; along the normal, over the cosine of
incidence, that moves the hit; t itself is a float64. ε is 2⁻²⁴ or 2⁻⁵³. One unit of the
normal is how far it turns where the hit moves by a unit of t. Neither the distance of
the origin nor that of the object from the world's counts. A ray is *decidable* if it stays a hit,
or a miss, of the same leaf when everything moves by 16 units; the others are not judged.
"""

from __future__ import annotations

import argparse
import sys
import time
import zlib
from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np

from benchmarks.conditioning import EPSILON
from benchmarks.exact_cases import GROUPS, Case, random_case
from benchmarks.exact_maps import Affine, forward
from benchmarks.exact_roots import Number, along, dot, mp
from benchmarks.rates import compiled
from benchmarks.truth import Hit, Solid, first_hit
from dsl.scene import FloatArray, Group, Instances, SceneGraph, Transform
from runtime.tracer import Hits, Tracer

MARGIN = 16.0
"""Units by which everything may move before a ray is called undecidable."""
LOST = 1000.0
"""An error of more units is no error but another hit."""
AMBIGUOUS = 0.1
"""Normals that differ by more, in radians, within `MARGIN` units of a hit: it is at an edge."""
CORNERS = ((1, 1, 1), (1, -1, -1), (-1, 1, -1), (-1, -1, 1))
PRECISIONS = ("float32", "float64")


@dataclass(slots=True)
class Tally:
    """What came of the rays of one group and precision; `angle` in radians."""

    rays: int = 0
    hits: int = 0
    undecided: int = 0
    wrong: list[str] = field(default_factory=list)
    units: list[float] = field(default_factory=list)
    ulps: list[float] = field(default_factory=list)
    normals: list[float] = field(default_factory=list)
    angle: float = 0.0


@dataclass(frozen=True, slots=True)
class Rounding:
    """How far rounding may move the ray in object space: at `pivot`, and turning about it."""

    moved: FloatArray
    turn: FloatArray
    pivot: float

    def at(self, t: Number) -> FloatArray:
        """Of the point at t, by axis."""
        away = float(abs(t - self.pivot)) if abs(t) < mp.inf else 0.0
        return self.moved + away * self.turn


class Part:
    """One leaf of a case."""

    def __init__(self, solid: Solid, back: Affine) -> None:
        self.solid = solid
        self.back = back
        self.linear = np.array(back[0], dtype=float)
        self.forth = np.array(forward(back)[0], dtype=float)

    def ray(self, o: FloatArray, d: FloatArray) -> tuple[list[Number], list[Number]]:
        """In object space, exactly."""
        linear, offset = self.back
        start, way = ([mp.mpf(float(x)) for x in v] for v in (o, d))
        return (
            [dot(row, start) + w for row, w in zip(linear, offset, strict=True)],
            [dot(row, way) for row in linear],
        )

    def rounding(self, o: list[Number], d: list[Number], precision: str) -> Rounding:
        """Of a ray in object space."""
        epsilon, fine = EPSILON[precision], EPSILON["float64"]
        pivot = max(-dot(o, d) / dot(d, d), mp.zero)
        q = np.array(along(o, d, pivot), dtype=float)
        way = np.array(d, dtype=float)
        size = float(self.solid.size) + float(np.abs(q).max())

        def through(v: FloatArray) -> FloatArray:
            product: FloatArray = np.abs(self.linear) @ np.abs(self.forth @ v)
            return product

        moved = epsilon * (np.abs(q) + size) + 2 * fine * through(q)
        turn = epsilon * np.abs(way) + 2 * fine * through(way)
        return Rounding(moved, turn, float(pivot))


def judge(case: Case, tallies: dict[str, Tally], name: str) -> None:
    """Trace and judge one case."""
    shapes = (shape for shape, _ in case.parts)
    parts = [Part(Solid(shape), back) for shape, back in zip(shapes, case.backs, strict=True)]
    placed = tuple(Instances(shape, Transform(steps)) for shape, steps in case.parts)
    ir = compiled(SceneGraph(Group(placed)))
    found = {
        precision: Tracer(ir, precision).trace(case.origins, case.directions)
        for precision in ("float32", "float64")
    }
    for ray in range(len(case.origins)):
        rays = [part.ray(case.origins[ray], case.directions[ray]) for part in parts]
        truths = [first_hit(p.solid, *r) for p, r in zip(parts, rays, strict=True)]
        for precision, hits in found.items():
            judged = Judged(parts, rays, truths, precision)
            judged.judge(hits, ray, tallies[precision], f"{name} ray {ray} {precision}")


class Judged:
    """One ray in one precision."""

    def __init__(
        self,
        parts: list[Part],
        rays: list[tuple[list[Number], list[Number]]],
        truths: list[Hit],
        precision: str,
    ) -> None:
        self.parts, self.rays, self.truths = parts, rays, truths
        self.roundings = [p.rounding(*r, precision) for p, r in zip(parts, rays, strict=True)]
        self.precision = precision
        met = [i for i, truth in enumerate(truths) if truth.t is not None]
        self.leaf = min(met, key=lambda i: truths[i].t) if met else -1

    def decidable(self) -> bool:
        """Whether nothing else can be hit when everything moves by `MARGIN` units."""
        first = mp.inf if self.leaf < 0 else self.truths[self.leaf].t
        for i, (truth, rounding) in enumerate(zip(self.truths, self.roundings, strict=True)):
            near = truth.where <= first or i == self.leaf
            if near and truth.clearance <= MARGIN * np.linalg.norm(rounding.at(truth.where)):
                return False
            if i == self.leaf or truth.t is None:
                continue
            if truth.t - first <= MARGIN * (self.unit(i) + self.unit(self.leaf)):
                return False
        return self.leaf < 0 or self.truths[self.leaf].t > MARGIN * self.unit(self.leaf)

    def unit(self, i: int) -> float:
        """Of t, for the hit of part i."""
        (o, d), truth, rounding = self.rays[i], self.truths[i], self.roundings[i]
        n = np.array(self.parts[i].solid.normal(along(o, d, truth.t)), dtype=float)
        facing = abs(float(n @ np.array(d, dtype=float)))
        if not facing:
            return np.inf
        moved = float(np.abs(n) @ rounding.at(truth.t))
        return moved / facing + EPSILON["float64"] * float(truth.t)

    def judge(self, hits: Hits, ray: int, tally: Tally, name: str) -> None:
        """Add to the tally."""
        if not self.decidable():
            tally.undecided += 1
            return
        tally.rays += 1
        told = int(hits.instance[ray])
        if told != self.leaf:
            tally.wrong.append(f"{name}: leaf {told} at {hits.t[ray]:.17g}, {self.said()}")
            return
        if told < 0:
            return
        tally.hits += 1
        t = self.truths[told].t
        off = float(abs(mp.mpf(float(hits.t[ray])) - t))
        units = off / self.unit(told)
        if units > LOST:
            tally.wrong.append(f"{name}: leaf {told} at {hits.t[ray]:.17g}, {self.said()}")
            return
        tally.units.append(units)
        tally.ulps.append(off / float(t) / EPSILON[self.precision])
        self.judge_normal(hits.normal[ray], tally)

    def judge_normal(self, told: FloatArray, tally: Tally) -> None:
        """The angle between normals, where a point that moves by `MARGIN` units has but one."""
        part, truth = self.parts[self.leaf], self.truths[self.leaf]
        (o, d), rounding = self.rays[self.leaf], self.roundings[self.leaf]
        way = float(mp.sqrt(dot(d, d)))
        slip = float(np.linalg.norm(rounding.at(truth.t))) + way * self.unit(self.leaf)
        p = along(o, d, truth.t)
        true = self.in_world(part, part.solid.normal(p))
        bend = 0.0
        for corner in CORNERS:
            moved = along(p, [mp.mpf(x) for x in corner], mp.mpf(MARGIN * slip))
            bend = max(bend, _angle(true, self.in_world(part, part.solid.normal(moved))))
        if bend > AMBIGUOUS:
            return
        angle = _angle(told, true)
        stretched = np.abs(part.linear).T @ np.abs(part.forth.T @ true)
        unit = EPSILON["float64"] * (2 + float(np.linalg.norm(stretched))) + bend / MARGIN
        tally.normals.append(angle / unit)
        tally.angle = max(tally.angle, angle)

    @staticmethod
    def in_world(part: Part, normal: list[Number]) -> FloatArray:
        """A unit normal, by the transpose of the inverse."""
        columns = zip(*part.back[0], strict=True)
        turned = [dot(column, normal) for column in columns]
        length = mp.sqrt(dot(turned, turned))
        return np.array([x / length for x in turned], dtype=float)

    def said(self) -> str:
        """The truth."""
        if self.leaf < 0:
            return "but it misses"
        solid, t = self.parts[self.leaf].solid, self.truths[self.leaf].t
        return f"but it hits leaf {self.leaf} ({solid.kind}) at {mp.nstr(t, 20)}"


def _angle(a: FloatArray, b: FloatArray) -> float:
    return float(np.linalg.norm(np.cross(a, b)) + (np.dot(a, b) < 0))


def exactness(group: str, cases: int, rays: int, seed: int = 0) -> dict[str, Tally]:
    """Judge that many random cases of a group."""
    tallies = {precision: Tally() for precision in PRECISIONS}
    for number in range(cases):
        rng = np.random.default_rng([zlib.crc32(group.encode()), seed + number])
        judge(random_case(group, rng, rays), tallies, f"{group} case {seed + number}")
    return tallies


def table(groups: Iterable[str], cases: int, rays: int, seed: int) -> Iterable[tuple[str, Tally]]:
    """Rows of the table in docs/accuracy.md, as they come."""
    for group in groups:
        for precision, tally in exactness(group, cases, rays, seed).items():
            units, normals = (np.array(values or [0.0]) for values in (tally.units, tally.normals))
            yield (
                f"| {group} | {precision} | {tally.rays} | {tally.hits} | {tally.undecided} | "
                f"{len(tally.wrong)} | {np.median(units):.2f} / {units.max():.2f} | "
                f"{np.median(tally.ulps or 0.0):.2f} | "
                f"{np.median(normals):.2f} / {normals.max():.2f} | {tally.angle:.1e} |",
                tally,
            )


def main() -> int:
    """Print the table, and every wrong ray."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.exactness", description=__doc__)
    parser.add_argument("groups", nargs="*", help="of " + ", ".join(GROUPS))
    parser.add_argument("--cases", type=int, default=50, help="random cases of a group")
    parser.add_argument("--rays", type=int, default=20, help="rays of a case")
    parser.add_argument("--seed", type=int, default=0, help="number of the first case")
    given = parser.parse_args()
    start, wrong = time.perf_counter(), list[str]()
    columns = "judged", "hits", "undecidable", "wrong", "t, units", "t, ulps", "normal, units"
    print("| group | precision | " + " | ".join(columns) + " | angle |")
    print("|---" * (len(columns) + 3) + "|")
    for row, tally in table(given.groups or GROUPS, given.cases, given.rays, given.seed):
        print(row, flush=True)
        wrong += tally.wrong
    print("\n".join(wrong))
    print(f"{time.perf_counter() - start:.0f} s")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
