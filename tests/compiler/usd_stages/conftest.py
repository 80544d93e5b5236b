"""Stages written inline, and a naive reading of the graphs they become."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from compiler.usd import StageOptions, import_stage
from compiler.usd.schema import register
from dsl.diagnostics import Diagnostic
from dsl.scene import (
    DEFAULT_MATERIAL,
    AreaLight,
    Bind,
    Camera,
    Group,
    Instances,
    Material,
    Mesh,
    Node,
    PointLight,
    SceneGraph,
    Settings,
    Shape,
    Sky,
    Step,
    StepKind,
    Sun,
)

Matrix = NDArray[np.float64]


@dataclass(frozen=True)
class Leaf:
    """One drawn leaf: its path, `world_from_object` `(4, 4)`, what it is, its material."""

    path: str
    world: Matrix
    node: Shape | Mesh
    material: Material


@dataclass(frozen=True)
class Imported:
    """An imported stage, expanded."""

    graph: SceneGraph
    diagnostics: list[Diagnostic]
    leaves: list[Leaf]
    others: list[tuple[Matrix, Node]]

    def paths(self) -> list[str]:
        return [leaf.path for leaf in self.leaves]

    def leaf(self, path: str) -> Leaf:
        (found,) = [leaf for leaf in self.leaves if leaf.path == path]
        return found

    def codes(self) -> list[str]:
        return [diagnostic.code for diagnostic in self.diagnostics]

    def said(self, words: str) -> Diagnostic:
        """The diagnostic whose message holds these words."""
        (found,) = [d for d in self.diagnostics if words in d.message]
        return found


@pytest.fixture(scope="session", autouse=True)
def schema() -> None:
    """Known to usd-core before the first stage, which a test may open by itself."""
    register()


@pytest.fixture
def load(tmp_path: Path) -> Callable[..., Imported]:
    """Import the text of a .usda stage, or a path, with subdivision surfaces at their limit.

    Other keywords are `StageOptions`.
    """

    def load(stage: str | Path, **choices: Any) -> Imported:
        path = stage
        choices.setdefault("complexity", "limit")
        if isinstance(stage, str):
            path = tmp_path / "stage.usda"
            path.write_text("#usda 1.0\n" + stage)
        arguments = {name: choices.pop(name) for name in ("time", "prim") if name in choices}
        graph, diagnostics = import_stage(path, **arguments, options=StageOptions(**choices))
        expanded = list(_expand(graph.root))
        leaves = [item for item in expanded if isinstance(item, Leaf)]
        others = [item for item in expanded if not isinstance(item, Leaf)]
        return Imported(graph, diagnostics, leaves, others)

    return load


def _expand(root: Node) -> Iterator[Leaf | tuple[Matrix, Node]]:
    """Every leaf in order of emission, by the contract of `dsl.scene` taken literally."""
    stack: list[tuple[Node, Matrix, str, str, Material | None]] = [(root, np.eye(4), "", "", None)]
    while stack:
        node, world, path, points, material = stack.pop()
        origin = getattr(node, "origin", None)
        label = origin.label if origin is not None else ""
        if isinstance(node, Instances):
            below = []
            for row in range(node.transform.count or 1):
                own = world
                for step in reversed(node.transform.steps):
                    own = own @ _matrix(step, row)
                if origin is not None and origin.point:
                    index = row if node.indices is None else node.indices[row]
                    below.append(
                        (node.child, own, path, f"@{path}{label}[{index}]{points}", material)
                    )
                else:
                    below.append((node.child, own, path + label, points, material))
            stack += reversed(below)
        elif isinstance(node, Group):
            stack += [(item, world, path + label, points, material) for item in node.items[::-1]]
        elif isinstance(node, Bind):
            assert not node.override
            stack.append((node.child, world, path + label, points, node.material))
        elif isinstance(node, (Shape, Mesh)):
            yield Leaf(path + label + points, world, node, material or DEFAULT_MATERIAL)
        else:
            assert isinstance(node, (AreaLight, Camera, Sun, PointLight, Sky, Settings))
            yield world, node


def _matrix(step: Step, row: int) -> Matrix:
    values = step.values if step.values.ndim == 1 else step.values[row]
    matrix = np.eye(4)
    if step.kind is StepKind.TRANSLATE:
        matrix[:3, 3] = values
    elif step.kind is StepKind.SCALE:
        matrix[:3, :3] = np.diag(values)
    elif step.kind is StepKind.MATRIX:
        matrix[:3] = values.reshape(3, 4)
    elif step.kind is StepKind.ORIENT:
        (x, y, z), w = values[:3].astype(float), float(values[3])
        cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
        matrix[:3, :3] += 2.0 * w * cross + 2.0 * cross @ cross
    else:
        assert step.kind is StepKind.ROTATE
        x, y, z = values[:3] / np.linalg.norm(values[:3])
        cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
        angle = np.radians(values[3])
        matrix[:3, :3] += np.sin(angle) * cross + (1.0 - np.cos(angle)) * cross @ cross
    return np.asarray(np.linalg.inv(matrix) if step.inverse else matrix)
