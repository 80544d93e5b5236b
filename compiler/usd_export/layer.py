"""Writing prims into a layer, spec by spec."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pxr import Gf, Sdf, Vt

from compiler.transforms import compose
from dsl.scene import FloatArray, Step, StepKind

_AXES = {0: "rotateX", 1: "rotateY", 2: "rotateZ"}

MAX_STEPS = 32
"""Steps that a stack of operations keeps; a longer chain becomes one matrix."""


def identifier(words: str) -> str:
    """A prim name from a path segment: its last part, with what USD does not allow replaced."""
    last = words.rstrip("/").rpartition("/")[2]
    name = re.sub(r"\W+", "_", last).strip("_")
    if not name or not Sdf.Path.IsValidIdentifier(name):
        name = f"_{name}"
    return name if Sdf.Path.IsValidIdentifier(name) else "prim"


def child(parent: Any, name: str, type_name: str = "", *, specifier: Any = None) -> Any:
    """A new prim below another (or a layer's pseudo root), renamed if the name is taken."""
    free, number = name, 1
    while parent.nameChildren.get(free) is not None:
        number += 1
        free = f"{name}_{number}"
    return Sdf.PrimSpec(parent, free, specifier or Sdf.SpecifierDef, type_name)


def attribute(prim: Any, name: str, type_name: str, value: Any, *, uniform: bool = False) -> Any:
    """A new attribute with its default value."""
    kind = Sdf.VariabilityUniform if uniform else Sdf.VariabilityVarying
    spec = Sdf.AttributeSpec(prim, name, Sdf.ValueTypeNames.Find(type_name), kind)
    spec.default = value
    return spec


def relationship(prim: Any, name: str, target: Any) -> Any:
    """A new relationship to one prim."""
    spec = Sdf.RelationshipSpec(prim, name, custom=False)
    spec.targetPathList.explicitItems = [target]
    return spec


def apply_schema(prim: Any, name: str) -> None:
    """Add an applied schema."""
    said = prim.GetInfo("apiSchemas") if prim.HasInfo("apiSchemas") else Sdf.TokenListOp()
    said.prependedItems = [*said.prependedItems, name]
    prim.SetInfo("apiSchemas", said)


def place(prim: Any, steps: tuple[Step, ...]) -> None:
    """The transform of a prim: single steps in reading order, first applied first."""
    if not steps:
        return
    names = []
    if len(steps) > MAX_STEPS:
        names.append(_matrix(prim, matrices(steps)[0][0], "xformOp:transform"))
    else:
        for number, step in enumerate(steps):
            names.append(_operation(prim, step, number))
    order = Vt.TokenArray(names[::-1])
    attribute(prim, "xformOpOrder", "token[]", order, uniform=True)


def matrices(steps: tuple[Step, ...]) -> tuple[FloatArray, NDArray[np.bool_]]:
    """The chain's matrices `(n, 3, 4)`, composed in double-double and rounded once.

    With them, which have a finite inverse `(n,)`: what others place is left out of pictures too.
    """
    count = next((len(step.values) for step in steps if step.values.ndim == 2), 1)
    rows, inverse = np.empty((2, count, 3, 4))
    placement = compose(steps)
    placement.forward.round_into(rows)
    placement.inverse.round_into(inverse)
    return rows, np.asarray((np.isfinite(rows) & np.isfinite(inverse)).all(axis=(1, 2)))


def matrix4d(rows: FloatArray) -> Any:
    """USD's matrix (row vectors) of 3x4 rows."""
    return Gf.Matrix4d(np.vstack([rows, (0.0, 0.0, 0.0, 1.0)]).T.tolist())


def _operation(prim: Any, step: Step, number: int) -> str:
    """Write one step as a transform operation and give its name in the order."""
    suffix = f":s{number}" if number else ""
    values = [float(v) for v in step.values]
    inverse = "!invert!" if step.inverse else ""
    match step.kind:
        case StepKind.TRANSLATE | StepKind.SCALE:
            name = f"xformOp:{step.kind.value}{suffix}"
            attribute(prim, name, "double3", Gf.Vec3d(*values))
            return inverse + name
        case StepKind.ROTATE if np.count_nonzero(values[:3]) == 1:
            axis = int(np.flatnonzero(values[:3])[0])
            name = f"xformOp:{_AXES[axis]}{suffix}"
            attribute(prim, name, "double", float(np.copysign(1.0, values[axis]) * values[3]))
            return inverse + name
        case _:
            return _matrix(prim, matrices((step,))[0][0], f"xformOp:transform{suffix}")


def _matrix(prim: Any, rows: FloatArray, name: str) -> str:
    attribute(prim, name, "matrix4d", matrix4d(rows))
    return name
