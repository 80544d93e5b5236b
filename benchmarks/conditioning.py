"""How far rounding alone may move a hit: the unit of every error that is reported.

An answer is judged by how much it differs from the true one, divided by how much the true one would
move if the numbers that enter it moved by their own rounding (design: numerics.md § 7). Along the
ray, a surface with normal n that moves by δ moves the hit by |n·δ| / |n·d|: near grazing much, and
no arithmetic can help. Two levels of such numbers are counted:

- *flat*: the ray, the instance's 3x4 inverse, and the ray transformed by it, at 2⁻⁵³;
- *object*: the ray in object space, its origin slid next to the shape, and the shape's size, at
  2⁻⁵³ for float64 and 2⁻²⁴ for float32, which transforms in float64.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from compiler.ir import KINDS, MESH, SceneIR
from dsl.scene import SHAPE_PARAMETERS, FloatArray, IntArray, ShapeKind

EPSILON = {"float32": 2.0**-24, "float64": 2.0**-53}


@dataclass(frozen=True, slots=True)
class Leaves:
    """Every leaf of an IR, by leaf number.

    `world_from_object`, `object_from_world` `(n, 3, 4)`; `prototype`, `material` `(n,)`, as hits
    report them; `size` `(n,)` bounds the object-space coordinates of the shape; `curvature` `(n,)`
    is the greatest of its surface, inf where it grows towards an apex on the axis.
    """

    world_from_object: FloatArray
    object_from_world: FloatArray
    prototype: IntArray
    material: IntArray
    size: FloatArray
    curvature: FloatArray


def leaves(ir: SceneIR) -> Leaves:
    """Expand all groups of an IR."""
    forward, inverse, prototypes, materials = [], [], [], []
    square = np.eye(4)
    stack = [(int(i), square, square, -1) for i in reversed(range(*ir.group_ranges[0]))]
    while stack:
        instance, world, back, above = stack.pop()
        here, there = np.eye(4), np.eye(4)
        here[:3], there[:3] = ir.world_from_object[instance], ir.object_from_world[instance]
        world, back = world @ here, there @ back
        material = int(ir.instance_material[instance])
        material = above if above < -1 or material == -1 else material
        target = int(ir.instance_target[instance])
        if target < 0:
            below = reversed(range(*ir.group_ranges[~target]))
            stack += [(int(i), world, back, material) for i in below]
            continue
        forward.append(world[:3])
        inverse.append(back[:3])
        prototypes.append(target)
        materials.append(0 if material == -1 else -2 - material if material < -1 else material)
    extents = [extent(ir, prototype) for prototype in range(len(ir.prototype_kind))]
    return Leaves(
        np.reshape(forward, (-1, 3, 4)),
        np.reshape(inverse, (-1, 3, 4)),
        np.array(prototypes, np.int64),
        np.array(materials, np.int64),
        np.array([extents[p][0] for p in prototypes]),
        np.array([extents[p][1] for p in prototypes]),
    )


def extent(ir: SceneIR, prototype: int) -> tuple[float, float]:
    """Size and greatest curvature of a prototype."""
    data = ir.prototype_data[prototype]
    if ir.prototype_kind[prototype] == MESH:
        first, last, *_ = ir.mesh_ranges[data]
        return float(np.abs(ir.mesh_points[first:last]).max()), 0.0
    kind = ShapeKind(KINDS[ir.prototype_kind[prototype]])
    names = SHAPE_PARAMETERS[kind]
    values = ir.shape_parameters[data : data + len(names)]
    p = dict(zip(names, map(float, values), strict=True))
    size = max((abs(v) for k, v in p.items() if not k.startswith("phi")), default=0.0)
    radii = [p[name] for name in ("radius", "minor", "r0", "bevel") if p.get(name)]
    if kind is ShapeKind.TORUS:
        size += p["minor"]
        radii.append(p["major"] - p["minor"])
    if kind is ShapeKind.CONE and not p["bevel"]:
        radii.append(0.0)
    if kind in (ShapeKind.DISC, ShapeKind.RECTANGLE, ShapeKind.PLANE, ShapeKind.TRIANGLE):
        radii = []
    return size, max((1 / r if r else np.inf for r in radii), default=0.0)


@dataclass(frozen=True, slots=True)
class Units:
    """What one unit is for each ray, `(n,)`: of t, of the object-space point, of the unit normal.

    In object space a unit is made by moving the ray by `displacement` `(n, 3)`, and by turning it
    about its point at t = `pivot` `(n,)`, which adds `turn` `(n, 3)` to its direction.
    """

    t: FloatArray
    position: FloatArray
    normal: FloatArray
    displacement: FloatArray
    turn: FloatArray
    pivot: FloatArray


def units(
    found: Leaves,
    leaf: NDArray[np.int64],
    origins: FloatArray,
    directions: FloatArray,
    t: FloatArray,
    normal: FloatArray,
    precision: str,
) -> Units:
    """Units for hits on those leaves; rays `(n, 3)`, t `(n,)`, world-space normals `(n, 3)`."""
    epsilon, fine = EPSILON[precision], EPSILON["float64"]
    inverse, size = found.object_from_world[leaf], found.size[leaf, None]
    linear, offset = inverse[:, :, :3], inverse[:, :, 3]
    scale = np.abs(linear)

    def through(matrices: FloatArray, vectors: FloatArray) -> FloatArray:
        products: FloatArray = np.einsum("nij,nj->ni", matrices, vectors)
        return products

    o, d = through(linear, origins) + offset, through(linear, directions)
    at, way = t[:, None], np.linalg.norm(d, axis=1)
    size = size + np.abs(o + at * d).max(axis=1, keepdims=True)  # of a plane, where it is hit
    near = np.clip(-(o * d).sum(axis=1) / way**2, 0, t)[:, None]
    flat = 2 * through(scale, np.abs(origins)) + np.abs(offset) + np.abs(o)
    flat_direction = 2 * through(scale, np.abs(directions)) + np.abs(d)
    displacement = fine * (flat + near * flat_direction)
    displacement += epsilon * (np.abs(o + near * d) + size)
    turn = fine * flat_direction + epsilon * np.abs(d)
    moved = displacement + np.abs(at - near) * turn

    n = through(found.world_from_object[leaf, :, :3].transpose(0, 2, 1), normal)
    n /= np.linalg.norm(n, axis=1, keepdims=True)
    facing = np.abs((n * d).sum(axis=1))
    with np.errstate(divide="ignore", invalid="ignore"):
        unit_t = (np.abs(n) * moved).sum(axis=1) / facing + fine * np.abs(t)
        slip = np.linalg.norm(moved, axis=1) + way * unit_t
        axis_distance = np.hypot(*(o + at * d)[:, [0, 2]].T)
        curvature = np.minimum(found.curvature[leaf], 1 / axis_distance)
        curvature = np.where(np.isinf(found.curvature[leaf]), curvature, found.curvature[leaf])
        bent = np.where(curvature > 0, curvature * slip, 0) + 2 * epsilon
    stretched = np.linalg.norm(linear, axis=(1, 2))
    stretched /= np.linalg.norm(through(linear.transpose(0, 2, 1), n), axis=1)
    return Units(unit_t, slip, stretched * bent, displacement, turn, near[:, 0])
