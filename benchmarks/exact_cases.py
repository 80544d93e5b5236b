"""Random scenes and rays of every group of difficulty (design: numerics.md § 7)."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.random import Generator

from benchmarks.exact_maps import Affine, forward, inverse
from benchmarks.exact_roots import along, dot, mp
from benchmarks.random_scenes import random_shape
from benchmarks.truth import Solid, first_hit
from dsl.limits import broken_limit, largest_bevel
from dsl.scene import SHAPE_PARAMETERS, FloatArray, Shape, ShapeKind, Step, StepKind

Steps = tuple[Step, ...]
BEVELLED = tuple(kind for kind in ShapeKind if "bevel" in SHAPE_PARAMETERS[kind])


@dataclass(frozen=True, slots=True)
class Case:
    """Shapes, each by its chain of steps, with its inverse, and rays `(n, 3)` in the world."""

    parts: tuple[tuple[Shape, Steps], ...]
    backs: tuple[Affine, ...]
    origins: FloatArray
    directions: FloatArray


def random_case(group: str, rng: Generator, rays: int) -> Case:
    """One case of a group."""
    shape, steps = GROUPS[group](rng)
    if group == "scene":
        parts = tuple((_shape(rng), _chain(rng, 3)) for _ in range(5))
    else:
        parts = ((shape, steps),)
    backs = tuple(inverse(steps) for _, steps in parts)
    forths = [forward(back) for back in backs]
    origins, directions = np.empty((2, rays, 3))
    for i in range(rays):
        shape, _ = parts[i % len(parts)]
        start, end = _local_ray(group, shape, rng)
        origins[i], directions[i] = _in_world(forths[i % len(parts)], start, end)
    if group == "axial":
        targets = origins + directions
        directions = np.eye(3)[rng.integers(3, size=rays)] * rng.choice([-1.0, 1.0], (rays, 1))
        origins = targets - 8 * float(Solid(shape).size) * directions
    return Case(parts, backs, origins, directions)


def _local_ray(group: str, shape: Shape, rng: Generator) -> tuple[list[float], list[float]]:
    """Origin and target in object space."""
    size = float(Solid(shape).size)
    target = _seam(shape, rng) if group == "seam" else _inside(shape, rng)
    away = rng.normal(size=3)
    away *= size * rng.choice([1.0, 3.0, 3.0]) / np.linalg.norm(away)
    if group == "far":
        away *= 10.0 ** rng.uniform(1, 9)
    if "grazing" in group or group == "on surface":
        return _beside(group, shape, (target + away, target), size, rng)
    return list(target + away), list(target)


def _beside(
    group: str, shape: Shape, ray: tuple[FloatArray, FloatArray], size: float, rng: Generator
) -> tuple[list[float], list[float]]:
    """A ray past the point where another hits: along the surface, or from next to it."""
    solid = Solid(shape)
    o = [mp.mpf(float(x)) for x in ray[0]]
    d = [mp.mpf(float(y - x)) for x, y in zip(*ray, strict=True)]
    hit = first_hit(solid, o, d)
    if hit.t is None:
        return list(ray[0]), list(ray[1])
    p = along(o, d, hit.t)
    n = solid.normal(p)
    side = rng.choice([-1.0, 1.0]) * size
    if group == "on surface":
        start = along(p, n, mp.mpf(float(side * 10.0 ** rng.uniform(-9, -3))))
        end = along(start, list(rng.normal(size=3)), mp.one)
        return [float(x) for x in start], [float(x) for x in end]
    depth = mp.mpf(float(side * 10.0 ** rng.uniform(-12, -3)))
    tangent = [mp.mpf(float(x)) for x in rng.normal(size=3)]
    tangent = along(tangent, n, -dot(tangent, n))
    length = mp.sqrt(dot(tangent, tangent))
    past = along(p, n, depth)
    start = along(past, tangent, -2 * size / length)
    return [float(x) for x in start], [float(x) for x in past]


def _in_world(
    forth: Affine, start: list[float], end: list[float]
) -> tuple[list[float], list[float]]:
    linear, offset = forth
    ends = [
        [dot(row, [mp.mpf(float(x)) for x in p]) + t for row, t in zip(linear, offset, strict=True)]
        for p in (start, end)
    ]
    origin = [float(x) for x in ends[0]]
    return origin, [float(x - mp.mpf(y)) for x, y in zip(ends[1], origin, strict=True)]


# Targets.


def _polar(rho: float, phi: float, y: float) -> FloatArray:
    turn = math.radians(phi)
    return np.array([rho * math.sin(turn), y, rho * math.cos(turn)])


def _inside(shape: Shape, rng: Generator) -> FloatArray:
    """A point in the shape or near it."""
    p = dict(zip(SHAPE_PARAMETERS[shape.kind], shape.parameters, strict=True))
    u = rng.uniform(-1, 1, 3)
    match shape.kind:
        case ShapeKind.BOX:
            low, high = np.array(shape.parameters[:3]), np.array(shape.parameters[3:6])
            return np.asarray((low + high) / 2 + 0.55 * u * (high - low))
        case ShapeKind.CYLINDER | ShapeKind.RING | ShapeKind.WEDGE:
            inner, outer = p.get("r0", 0.0), p.get("r1", p.get("radius", 1.0))
            phi = rng.uniform(p.get("phi0", 0.0), p.get("phi1", 360.0))
            return _polar(rng.uniform(inner, outer), phi, rng.uniform(p["y0"], p["y1"]))
        case ShapeKind.TORUS:
            around = p["major"] + 1.2 * p["minor"] * u[0]
            return _polar(around, rng.uniform(0, 360), 1.2 * p["minor"] * u[1])
        case ShapeKind.CONE:
            y = p["height"] * abs(u[1])
            return _polar(p["radius"] * u[0] * (1 - y / p["height"]), rng.uniform(0, 360), y)
        case ShapeKind.TRIANGLE:
            weights = rng.dirichlet([1.0, 1.0, 1.0]) * 1.2 - 0.0667
            return np.asarray(weights @ np.reshape(shape.parameters, (3, 3)))
        case ShapeKind.DISC | ShapeKind.RECTANGLE | ShapeKind.PLANE:
            half = [p.get("radius", p.get(name, 2.0) / 2) for name in ("size_x", "size_z")]
            return np.array([1.1 * u[0] * half[0], 0.0, 1.1 * u[2] * half[1]])
    return np.asarray(u * p["radius"])


def _seam(shape: Shape, rng: Generator) -> FloatArray:
    """A point where patches meet, or edges."""
    p = dict(zip(SHAPE_PARAMETERS[shape.kind], shape.parameters, strict=True))
    b = p.get("bevel", 0.0)
    if shape.kind is ShapeKind.BOX:
        low, high = np.array(shape.parameters[:3]), np.array(shape.parameters[3:6])
        ends = np.stack([low, high, low + b, high - b, rng.uniform(low, high)])
        return np.asarray(ends[rng.integers([4, 4, 5]), [0, 1, 2]])
    if "y0" not in p:
        return _inside(shape, rng)
    radii = [p[name] + sign * b for name in ("r1", "radius") if name in p for sign in (0, -1)]
    radii += [p["r0"] + sign * b for sign in (0, 1) if "r0" in p]
    levels = [p["y0"], p["y1"], p["y0"] + b, p["y1"] - b]
    rho, y = float(rng.choice(radii)), float(rng.choice(levels))
    phi = rng.uniform(p.get("phi0", 0.0), p.get("phi1", 360.0))
    if "phi0" in p and rng.random() < 0.6:
        inset = math.degrees(math.asin(min(b / rho, 1.0))) * rng.integers(2)
        phi = float(rng.choice([p["phi0"] + inset, p["phi1"] - inset]))
        if rng.random() < 0.5:
            rho = rng.uniform(p["r0"], p["r1"])
    return _polar(rho, phi, y)


# Shapes and chains.


def _shape(rng: Generator) -> Shape:
    kinds = list(ShapeKind)
    return random_shape(kinds[rng.integers(len(kinds))], rng)


def _bevelled(rng: Generator) -> Shape:
    """With a bevel of 1e-9, 1e-6, 1e-3, some share of the limit, or the limit."""
    kind = BEVELLED[rng.integers(len(BEVELLED))]
    plain = random_shape(kind, rng).parameters[:-1]
    limit = largest_bevel(kind, (*plain, 0.0))
    bevel = float(rng.choice([1e-9, 1e-6, 1e-3, rng.uniform(0.01, 1), 1.0]) * limit)
    while broken_limit(kind, (*plain, bevel)):
        bevel = float(np.nextafter(bevel, 0))
    return Shape(kind, (*plain, bevel))


def _torus(rng: Generator) -> Shape:
    minor = float(rng.choice([0.025, 1e-3, 1e-5]))
    return Shape(ShapeKind.TORUS, (1.0, minor))


def _step(kind: StepKind, *values: float) -> Step:
    return Step(kind, np.array(values, float))


def _mild(rng: Generator) -> Step:
    match rng.integers(5):
        case 0:
            return _step(StepKind.TRANSLATE, *rng.normal(size=3))
        case 1:
            return _step(StepKind.SCALE, *rng.choice([-1.0, 1.0], 3) * rng.uniform(0.5, 2, 3))
        case 2:
            return _step(StepKind.SHEAR, *rng.uniform(-0.3, 0.3, 6))
        case 3:
            return _step(StepKind.REFLECT, *rng.normal(size=3))
    return _step(StepKind.ROTATE, *rng.normal(size=3), rng.uniform(-360, 360))


def _chain(rng: Generator, most: int = 8) -> Steps:
    return tuple(_mild(rng) for _ in range(rng.integers(1, most + 1)))


def _turns(rng: Generator) -> Steps:
    angles = rng.choice([90.0, 180.0, -270.0, 36_000_090.0, 30.0, 3.6e9 + 60.0], 3)
    axes = rng.choice([0, 1, 2], 3)
    return tuple(
        _step(StepKind.ROTATE, *np.eye(3)[axis], angle)
        for axis, angle in zip(axes, angles, strict=True)
    )


def _scales(rng: Generator) -> Steps:
    factor = float(10.0 ** rng.choice([-30, -20, -10, 10, 20, 30]))
    return (*_chain(rng, 2), _step(StepKind.SCALE, factor, factor, factor))


def _anisotropic(rng: Generator) -> Steps:
    return (
        _step(StepKind.SCALE, *10.0 ** rng.uniform(-6, 6, 3)),
        _step(StepKind.ROTATE, *rng.normal(size=3), rng.uniform(-360, 360)),
    )


def _shears(rng: Generator) -> Steps:
    values = np.zeros(6)
    values[rng.integers(6)] = 10.0 ** rng.uniform(2, 6)
    return (_step(StepKind.SHEAR, *values),)


def _translations(rng: Generator) -> Steps:
    away = rng.normal(size=3) * 10.0 ** rng.uniform(3, 12)
    steps = (*_chain(rng, 2), _step(StepKind.TRANSLATE, *away))
    if rng.random() < 0.5:
        return (*steps, _step(StepKind.TRANSLATE, *(-away + rng.normal(size=3))))
    return steps


def _nest(rng: Generator) -> Steps:
    few = [
        _step(StepKind.ROTATE, *rng.normal(size=3), 0.036),
        _step(StepKind.TRANSLATE, *rng.normal(size=3) * 1e-3),
        _step(StepKind.SCALE, *(1 + rng.uniform(-1e-4, 1e-4, 3))),
        _step(StepKind.ROTATE, *rng.normal(size=3), 90.0),
    ]
    return tuple(few[i] for i in rng.integers(4, size=10_000))


def _wedge(rng: Generator) -> Shape:
    return random_shape(ShapeKind.WEDGE, rng)


def _solid(rng: Generator) -> Shape:
    kinds = [ShapeKind.SPHERE, ShapeKind.CYLINDER, ShapeKind.CONE, ShapeKind.TORUS, ShapeKind.BOX]
    return random_shape(kinds[rng.integers(len(kinds))], rng)


GROUPS: dict[str, Callable[[Generator], tuple[Shape, Steps]]] = {
    "identity": lambda rng: (_shape(rng), ()),
    "chain": lambda rng: (_shape(rng), _chain(rng)),
    "axial": lambda rng: (_shape(rng), ()),
    "wedge": lambda rng: (_wedge(rng), _chain(rng)),
    "seam": lambda rng: (_bevelled(rng), _chain(rng, 2)),
    "turn": lambda rng: (_shape(rng), _turns(rng)),
    "scene": lambda rng: (_shape(rng), ()),
    "on surface": lambda rng: (_shape(rng), _chain(rng, 2)),
    "scale 1e±30": lambda rng: (_shape(rng), _scales(rng)),
    "anisotropic 1e±6": lambda rng: (_shape(rng), _anisotropic(rng)),
    "shear to 1e6": lambda rng: (_shape(rng), _shears(rng)),
    "far to 1e9": lambda rng: (_shape(rng), _chain(rng, 2)),
    "translation to 1e12": lambda rng: (_shape(rng), _translations(rng)),
    "nesting 1e4": lambda rng: (_shape(rng), _nest(rng)),
    "bevel 1e-9 to limit": lambda rng: (_bevelled(rng), _chain(rng, 2)),
    "grazing 1e-3 to 1e-12": lambda rng: (_solid(rng), _chain(rng, 2)),
    "thin torus": lambda rng: (_torus(rng), _chain(rng, 2)),
    "thin torus grazing": lambda rng: (_torus(rng), _chain(rng, 2)),
}
