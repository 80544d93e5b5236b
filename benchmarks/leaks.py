"""Closed scenes that no ray may leave: `python -m benchmarks.leaks` prints what did.

Rays bounce about in a closed space, each new one from where `Hits.spawn` puts it, in a random
direction on the side it came from. A ray *escapes* if it hits nothing. It is *crossed* if what it
hits faces it the wrong way: from the space between solids every solid is met from outside, and
the shell around it from inside, so such a ray has slipped through a surface, or has hit its own
falsely. Rays that only graze it are not judged, since at which of two sides they are cannot be
told: within an angle of √(32 eps/r), where r is the least radius that its surface curves with, they
are at most 16 eps inside.
"""

from __future__ import annotations

import argparse
import math
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from benchmarks.conditioning import EPSILON
from benchmarks.rates import prepared
from benchmarks.scenes import SPHERE, icosphere
from dsl.scene import (
    FloatArray,
    Group,
    Instances,
    Mesh,
    Node,
    Precision,
    SceneGraph,
    Shape,
    ShapeKind,
    Step,
    StepKind,
    Transform,
)

BUNCH = 100_000
"""Rays that bounce together."""


@dataclass(frozen=True, slots=True)
class Closed:
    """A closed scene of about unit size; leaves from `inner` on are met from outside.

    Rays start at `start`, in the closed space.
    """

    name: str
    root: Callable[[], Node]
    start: tuple[float, float, float]
    inner: int
    radius: float = 1.0
    """The least that a surface is curved with."""


def _place(node: Node, *steps: tuple[StepKind, tuple[float, ...]]) -> Instances:
    chain = tuple(Step(kind, np.array(values)) for kind, values in steps)
    return Instances(node, Transform(chain))


def _shape(kind: ShapeKind, *parameters: float) -> Shape:
    return Shape(kind, parameters)


def _cube() -> Mesh:
    corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], float)
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    triangles = [[q[0], q[i], q[i + 1]] for q in quads for i in (1, 2)]
    return Mesh(corners, np.array(triangles, np.int64))


def _nested() -> Node:
    """A turned, squeezed shell around turned groups of turned shapes, three levels deep."""
    turn, scale, move = StepKind.ROTATE, StepKind.SCALE, StepKind.TRANSLATE
    pair = Group(
        (
            _place(_shape(ShapeKind.BOX, -1, -1, -1, 1, 1, 1, 0.1), (move, (1.5, 0, 0))),
            _place(_shape(ShapeKind.TORUS, 1, 0.3), (turn, (1, 2, 3, 40)), (move, (-1.5, 0, 0))),
        )
    )
    four = Group(
        (
            _place(pair, (scale, (0.5, 0.4, 0.6)), (turn, (1, 0, 1, 70)), (move, (0, 2, 0))),
            _place(pair, (scale, (0.6, -0.4, 0.5)), (turn, (0, 1, 1, 10)), (move, (0, -2, 0))),
        )
    )
    inner = Group(
        (
            _place(four, (scale, (0.1, 0.1, 0.1)), (turn, (0, 0, 1, 33)), (move, (0.4, 0, 0))),
            _place(four, (scale, (0.1, 0.2, 0.1)), (turn, (1, 0, 0, 77)), (move, (-0.4, 0, 0))),
        )
    )
    return Group((_place(SPHERE, (scale, (1.1, 1, 1.2)), (turn, (3, 1, 2, 25))), inner))


def _coincident() -> Node:
    """Two shells in the same place, by different transforms, around two balls in the same place."""
    turn, scale = StepKind.ROTATE, StepKind.SCALE
    ball = _place(SPHERE, (scale, (0.25, 0.25, 0.25)))
    return Group((SPHERE, _place(SPHERE, (turn, (1, 2, 3, 40))), ball, ball))


def _igloo() -> Node:
    """Two courses of eight bevelled wedges between a floor and a lid, in a shell of wedges."""

    def course(bevel: float, turned: float, low: float) -> Node:
        block = _shape(ShapeKind.WEDGE, 0.6, 0.8, low, low + 0.4, 0, 45, bevel)
        turns = np.array([[0, 1, 0, 45.0 * i + turned] for i in range(8)])
        return Instances(block, Transform((Step(StepKind.ROTATE, turns),)))

    caps = tuple(_shape(ShapeKind.CYLINDER, 0.9, y, y + 0.1, 0) for y in (-0.1, 0.8))
    plain = Group((course(0, 0, 0), course(0, 22.5, 0.4)))
    return Group((*caps, course(0.02, 0, 0), course(0.02, 22.5, 0.4), plain))


SCENES = (
    Closed("sphere", lambda: SPHERE, (0.3, 0.2, 0.1), 1),
    Closed("box", lambda: _shape(ShapeKind.BOX, -1, -0.8, -0.6, 1, 0.8, 0.6, 0), (0, 0, 0), 1),
    Closed(
        "bevelled box",
        lambda: _shape(ShapeKind.BOX, -1, -0.8, -0.6, 1, 0.8, 0.6, 0.2),
        (0, 0, 0),
        1,
    ),
    Closed("cylinder", lambda: _shape(ShapeKind.CYLINDER, 1, -0.7, 0.8, 0), (0, 0, 0), 1),
    Closed("cone", lambda: _shape(ShapeKind.CONE, 1, 1.5, 0), (0, 0.3, 0), 1),
    Closed("torus tube", lambda: _shape(ShapeKind.TORUS, 1, 0.2), (1, 0, 0), 1),
    Closed("ring", lambda: _shape(ShapeKind.RING, 0.6, 1, -0.3, 0.4, 0), (0.8, 0, 0), 1),
    Closed("bevelled ring", lambda: _shape(ShapeKind.RING, 0.6, 1, -0.3, 0.4, 0.1), (0.8, 0, 0), 1),
    Closed("wedge", lambda: _shape(ShapeKind.WEDGE, 0.4, 1, -0.3, 0.4, 0, 250, 0), (0.7, 0, 0), 1),
    Closed(
        "bevelled wedge",
        lambda: _shape(ShapeKind.WEDGE, 0.4, 1, -0.3, 0.4, 0, 250, 0.1),
        (0.7, 0, 0),
        1,
    ),
    Closed("cube mesh", _cube, (0.3, 0.2, 0.1), 1),
    Closed("sphere mesh", lambda: icosphere(4), (0.3, 0.2, 0.1), 1),
    Closed("nested", _nested, (0, 0, 0), 1),
    Closed("coincident", _coincident, (0.5, 0, 0), 2),
    Closed("igloo", _igloo, (0, 0.4, 0), 0, 0.02),
)

TILT = Step(StepKind.ROTATE, np.array([1.0, 2.0, -1.0, 37.0]))
PLACES = {
    "scale 1": (1.0, 0.0),
    "scale 1e-18": (1e-18, 0.0),
    "scale 1e-9": (1e-9, 0.0),
    "scale 1e9": (1e9, 0.0),
    "scale 1e18": (1e18, 0.0),
    "1e9 away": (1.0, 1e9),
}
"""Scale, and distance from the origin."""


@dataclass(frozen=True, slots=True)
class Leaks:
    """What became of `rays` bounced rays."""

    scene: str
    place: str
    precision: Precision
    rays: int
    escaped: int
    crossed: int


def bounce(
    closed: Closed,
    place: str,
    precision: Precision,
    rays: int,
    seed: int = 0,
) -> Leaks:
    """Bounce that many rays in one scene; those that are lost start again."""
    scale, far = PLACES[place]
    away = far * np.array([1.0, 0.73, -0.41])
    steps = (TILT, Step(StepKind.SCALE, np.full(3, scale)), Step(StepKind.TRANSLATE, away))
    tracer = prepared(SceneGraph(Instances(closed.root(), Transform(steps))), precision)
    random = np.random.default_rng(seed)
    begin = _tilted(np.array(closed.start)) * scale + away
    count = min(BUNCH, rays)
    origins = np.broadcast_to(begin, (count, 3)).copy()
    directions = _sphere(random, count)
    grazing = math.sqrt(32 * EPSILON[precision] / closed.radius)
    escaped = crossed = done = 0
    while done < rays:
        hits = tracer.trace(origins, directions)
        done += count
        outward = np.einsum("ij,ij->i", directions, hits.normal)
        met_from_outside = hits.instance >= closed.inner
        lost = ~hits.hit
        inward = np.where(met_from_outside, -1.0, 1.0)
        wrong = hits.hit & (outward * inward < -grazing)
        escaped += int(lost.sum())
        crossed += int(wrong.sum())
        side = -inward[:, None] * hits.normal
        directions = _sphere(random, count)
        directions *= np.where(np.einsum("ij,ij->i", directions, side) < 0, -1.0, 1.0)[:, None]
        origins = hits.spawn(directions)
        again = lost | wrong
        origins[again] = begin
    return Leaks(closed.name, place, precision, done, escaped, crossed)


def _tilted(point: FloatArray) -> FloatArray:
    axis, angle = TILT.values[:3], math.radians(TILT.values[3])
    axis = axis / np.linalg.norm(axis)
    turned: FloatArray = (
        point * math.cos(angle)
        + np.cross(axis, point) * math.sin(angle)
        + axis * (axis @ point) * (1 - math.cos(angle))
    )
    return turned


def _sphere(random: np.random.Generator, count: int) -> NDArray[np.float64]:
    """Uniform unit vectors."""
    z, turn = random.uniform(-1, 1, count), random.uniform(0, 2 * math.pi, count)
    around = np.sqrt(1 - z * z)
    return np.stack([around * np.cos(turn), around * np.sin(turn), z], 1)


def measure(rays: int, names: list[str], places: list[str]) -> Iterator[Leaks]:
    """Every scene in every place, in both precisions."""
    for place in places:
        for closed in SCENES:
            if names and closed.name not in names:
                continue
            for precision in ("float32", "float64"):
                yield bounce(closed, place, precision, rays)


def main() -> int:
    """Print what leaked; fail if anything did."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.leaks", description=__doc__)
    parser.add_argument("scenes", nargs="*", help="of " + ", ".join(s.name for s in SCENES))
    parser.add_argument("--rays", type=int, default=1_000_000, help="to bounce in each")
    parser.add_argument("--place", choices=PLACES, action="append")
    given = parser.parse_args()
    start, bad = time.perf_counter(), 0
    for leaks in measure(given.rays, given.scenes, given.place or list(PLACES)):
        bad += leaks.escaped + leaks.crossed
        print(
            f"{leaks.scene:15} {leaks.place:12} {leaks.precision}: {leaks.rays} rays, "
            f"{leaks.escaped} escaped, {leaks.crossed} crossed",
            flush=True,
        )
    print(f"{time.perf_counter() - start:.0f} s")
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
