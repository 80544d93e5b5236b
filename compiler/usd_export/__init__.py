"""Scenes to USD stages: what `compiler.usd` reads back as the same scene.

- Shapes that USD knows are its own prims; others are typed prims of `compiler.usd.schema`, with
  a mesh for programs that do not know them.
- What is used once is written in place. What is used more often is a class below `Prototypes`,
  and its uses are native instances; many uses in a row are a point instancer.
- Transforms keep their steps where USD has such an operation, and are matrices otherwise. All are
  double precision; point instancers say theirs in floats too.
- Materials are UsdPreviewSurface; one that overrides is bound stronger than its descendants'.
- Lights, cameras and settings are placed in the world, wherever the program has them.

USD keeps the numbers of materials, lights and cameras in floats: those are rounded.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from compiler.compilation import Compilation

__all__ = ["ExportError", "ExportOptions", "export_stage"]

SUFFIXES = (".usd", ".usda", ".usdc", ".usdz")


class ExportError(OSError):
    """A stage that cannot be written; the message says why."""


@dataclass(frozen=True, slots=True)
class ExportOptions:
    """Choices about a stage.

    `tolerance` is the greatest distance of a solid's mesh from the solid, in parts of its
    diameter; None leaves the meshes out, and programs that do not know the solids draw nothing.
    `many` is the number of uses in a row from which one prototype gets a point instancer.
    Raises ValueError for a tolerance that is not above 0 and below 1.
    """

    tolerance: float | None = 1e-3
    many: int = 16

    def __post_init__(self) -> None:
        if self.tolerance is not None and not 0.0 < self.tolerance < 1.0:
            raise ValueError(f"tolerance is {self.tolerance}, which is not between 0 and 1")


def export_stage(
    compilation: Compilation,
    path: str | Path,
    options: ExportOptions = ExportOptions(),
) -> None:
    """Write a compiled scene as a stage (.usd, .usda, .usdc, .usdz).

    Raises ExportError where the file cannot be written.
    """
    from compiler.usd_export.stage import write_stage

    write_stage(compilation, Path(path), options)
