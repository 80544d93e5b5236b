"""What a caller may choose about the import of a stage."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class StageOptions:
    """Choices that are not in the stage.

    `purposes` are the computed purposes that are drawn; `payloads` says whether payloads are
    loaded.
    """

    purposes: frozenset[str] = frozenset({"default", "render"})
    payloads: bool = True
