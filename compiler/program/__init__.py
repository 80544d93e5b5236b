"""Scenes to programs that people can read and that denote the same scene.

What is used once is written in place, what is used more often is named. Transforms keep their
steps. Lights, cameras and settings are said in the world, wherever the scene has them.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from compiler.compilation import Compilation
from dsl.diagnostics import Diagnostic
from dsl.scene import Mesh

__all__ = ["Program", "ProgramError", "write_program"]


class ProgramError(Exception):
    """A scene that is no matter for a program; the message says why."""


@dataclass(frozen=True, slots=True)
class Program:
    """The text of a program in canonical form, the meshes that it names, and what it lacks.

    `meshes` are by the path that the program calls them; `unsaid` are warnings.
    """

    text: str
    meshes: dict[str, Mesh] = field(default_factory=dict)
    unsaid: tuple[Diagnostic, ...] = ()


def write_program(scene: Compilation, folder: str | None = None) -> Program:
    """A program that compiles to the same leaves in the same order.

    Meshes of more than a few triangles are files in `folder`, as the program writes it; without
    one their triangles are written out. Raises ProgramError for a scene of too many instances or
    triangles.
    """
    from compiler.program.writer import write

    return write(scene, folder)
