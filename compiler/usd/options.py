"""What a caller may choose about the import of a stage."""

from __future__ import annotations

from pathlib import Path
from typing import Literal, get_args

from dsl.records import value

Complexity = Literal["low", "medium", "high", "veryhigh", "limit"]
KNOWN_PURPOSES = ("default", "render", "proxy", "guide")

PURPOSES = frozenset({"default", "render"})
"""What is drawn unless a stage or a caller says otherwise."""


@value
class StageOptions:
    """Choices that are not in the stage.

    `purposes` are the computed purposes that are drawn, None: those that the stage's RenderSettings
    include, or else `PURPOSES`; `payloads` says whether payloads are loaded. `complexity` says how
    subdivision surfaces are drawn: "low" is their cage (as usdrecord draws them unless told
    otherwise), "medium", "high" and "veryhigh" are their limit surface at 1, 2 and 3 refinements,
    and "limit" at as many as suit the number of faces (`compiler.usd.refinement`). `mask` are paths
    of prims outside of which the stage is not populated, none: it is as a whole. `variants` are
    selected instead of what the stage says, written as USD's paths: `/World/Car{color=red}`. With a
    `root`, no layer, texture or other asset outside of that folder is read. `name` is what
    diagnostics call the stage, if not its path. Raises ValueError for other purposes and
    complexities than there are.
    """

    purposes: frozenset[str] | None = None
    payloads: bool = True
    complexity: Complexity = "low"
    surroundings: bool = True
    mask: tuple[str, ...] = ()
    variants: tuple[str, ...] = ()
    root: Path | None = None
    name: str | None = None

    def __post_init__(self) -> None:
        for purpose in self.purposes or ():
            if purpose not in KNOWN_PURPOSES:
                raise ValueError(f"purposes are {', '.join(KNOWN_PURPOSES)}, not {purpose!r}")
        if self.complexity not in get_args(Complexity):
            choices = ", ".join(get_args(Complexity))
            raise ValueError(f"complexity is one of {choices}, not {self.complexity!r}")


@value
class Isolation:
    """An import in a child process.

    It ends after `seconds`, and where it takes more than `memory` bytes beyond what usd-core
    itself needs; None sets no limit. Whatever happens to the child, the caller gets a diagnostic.
    """

    seconds: float | None = None
    memory: int | None = None
