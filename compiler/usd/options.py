"""What a caller may choose about the import of a stage."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

Complexity = Literal["low", "medium", "high", "veryhigh", "limit"]


@dataclass(frozen=True, slots=True)
class StageOptions:
    """Choices that are not in the stage.

    `purposes` are the computed purposes that are drawn; `payloads` says whether payloads are
    loaded. `complexity` says how subdivision surfaces are drawn: "low" is their cage (as
    usdrecord draws them unless told otherwise), "medium", "high" and "veryhigh" are their limit
    surface at 1, 2 and 3 refinements, and "limit" at as many as suit the number of faces
    (`compiler.usd.refinement`).
    """

    purposes: frozenset[str] = frozenset({"default", "render"})
    payloads: bool = True
    complexity: Complexity = "low"
    surroundings: bool = True
