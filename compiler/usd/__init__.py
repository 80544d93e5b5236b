"""USD stages to the scene graph.

What is drawn, and where, is what usd-core says of the composed stage:

- Geometry stays in stage space and units: `upAxis` and `metersPerUnit` move nothing.
- Purposes `default` and `render` are drawn; the nearest authored purpose of a prim wins.
- Subdivision meshes are drawn as their cages, or, by `StageOptions.complexity`, at their limit.
- Time None reads an attribute's default value where one is authored, else its earliest sample.
- Leaves are numbered in namespace order, depth first; within a point instancer prototype by
  prototype in the order of its relationship, and within a prototype by position in the instancer's
  arrays. What resets its transform stack comes after everything else.

This package imports usd-core only when a stage is imported.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any, Literal

from compiler.usd.options import Isolation, StageOptions
from dsl.diagnostics import Diagnostic
from dsl.scene import SceneGraph

__all__ = ["Isolation", "StageOptions", "describe_stage", "import_stage"]


def import_stage(
    path: str | Path,
    *,
    time: float | Literal["earliest"] | None = None,
    prim: str | None = None,
    options: StageOptions = StageOptions(),  # noqa: B008  (frozen)
    isolation: Isolation | None = None,
) -> tuple[SceneGraph, list[Diagnostic]]:
    """Read a stage (.usd, .usda, .usdc, .usdz) as a scene graph, and report all it dropped.

    `time` is a time code, "earliest" (each attribute's first sample), or None (above). `prim`
    restricts the stage to what is at and below that prim, which keeps its place in the stage and
    all that it inherits. Never raises for a stage's faults: those that forbid any picture are
    diagnostics of severity "error" beside an empty scene, all others warnings with a prim path.
    Not reentrant across threads: imports wait for each other. With `isolation` they run in a
    child process, and do not.
    """
    if isolation is not None:
        from compiler.usd.isolated import import_isolated

        return import_isolated(str(path), time, prim, options, isolation)
    from compiler.usd.stage import read_stage

    return read_stage(str(path), time, prim, options)


def describe_stage(
    path: str | Path,
    *,
    drawn: list[str],
    time: float | Literal["earliest"] | None = None,
    options: StageOptions = StageOptions(),  # noqa: B008  (frozen)
    isolation: Isolation | None = None,
) -> dict[str, Any]:
    """What a stage holds, beside the prims that were `drawn` (`compiler.usd.summary`)."""
    if isolation is not None:
        from compiler.usd.isolated import summarize_isolated

        return summarize_isolated(str(path), time, options, drawn, isolation)
    from compiler.usd.summary import summarize_stage

    return summarize_stage(str(path), time, options, drawn)
