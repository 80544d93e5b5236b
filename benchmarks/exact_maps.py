"""Chains of steps and their inverses, to 110 digits."""

from __future__ import annotations

from collections.abc import Sequence

from benchmarks.exact_roots import Number, dot, mp
from dsl.scene import Step, StepKind

Affine = tuple[list[list[Number]], list[Number]]
"""A 3x3 matrix by rows, and a translation."""


def inverse(steps: Sequence[Step]) -> Affine:
    """World to object, for steps in reading order: the first is applied to the object first."""
    linear, offset = [[mp.mpf(i == j) for j in range(3)] for i in range(3)], [mp.zero] * 3
    known: dict[int, Affine] = {}
    for step in steps:
        # W = (S_n … S_1)⁻¹: the inverse of each further step comes on the right.
        if id(step) not in known:
            known[id(step)] = _step_inverse(step)
        back, (x, y, z) = known[id(step)]
        if step.kind is StepKind.TRANSLATE:
            offset = [
                a * x + b * y + c * z + w for (a, b, c), w in zip(linear, offset, strict=True)
            ]
            continue
        columns = list(zip(*back, strict=True))
        linear = [[a * p + b * q + c * r for p, q, r in columns] for a, b, c in linear]
    return linear, offset


def forward(back: Affine) -> Affine:
    """Object to world, from world to object."""
    linear = _inverted(back[0])
    return linear, [-dot(row, back[1]) for row in linear]


def _step_inverse(step: Step) -> Affine:
    v = [mp.mpf(float(x)) for x in step.values]
    identity = [[mp.mpf(i == j) for j in range(3)] for i in range(3)]
    none = [mp.zero] * 3
    match step.kind:
        case StepKind.TRANSLATE:
            return identity, [-x for x in v]
        case StepKind.SCALE:
            return [[identity[i][j] / v[i] for j in range(3)] for i in range(3)], none
        case StepKind.ROTATE:
            length = mp.sqrt(dot(v[:3], v[:3]))
            x, y, z = (u / length for u in v[:3])
            reduced = v[3] - 360 * mp.floor(v[3] / 360)
            sin, cos = -mp.sin(reduced * mp.pi / 180), mp.cos(reduced * mp.pi / 180)
            if reduced % 90 == 0:
                sin, cos = mp.nint(sin), mp.nint(cos)
            k = 1 - cos
            return [
                [cos + x * x * k, x * y * k - z * sin, x * z * k + y * sin],
                [y * x * k + z * sin, cos + y * y * k, y * z * k - x * sin],
                [z * x * k - y * sin, z * y * k + x * sin, cos + z * z * k],
            ], none
        case StepKind.SHEAR:
            xy, xz, yx, yz, zx, zy = v
            return _inverted([[mp.one, xy, xz], [yx, mp.one, yz], [zx, zy, mp.one]]), none
        case StepKind.REFLECT:
            square = dot(v, v)
            mirror = [
                [identity[i][j] - 2 * v[i] * v[j] / square for j in range(3)] for i in range(3)
            ]
            return mirror, none
    raise ValueError(f"no {step.kind} here")


def _inverted(m: list[list[Number]]) -> list[list[Number]]:
    cofactors = [
        [m[i - 2][j - 2] * m[i - 1][j - 1] - m[i - 2][j - 1] * m[i - 1][j - 2] for j in range(3)]
        for i in range(3)
    ]
    determinant = dot(m[0], cofactors[0])
    return [[cofactors[j][i] / determinant for j in range(3)] for i in range(3)]
