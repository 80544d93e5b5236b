"""The report of an import: everything that was not drawn as the stage has it."""

from __future__ import annotations

from dataclasses import dataclass, field

from dsl.diagnostics import Diagnostic, Label, Severity
from dsl.spans import PrimPlace

LISTED = 100
"""Prims that one diagnostic names; what is beyond is only counted."""


@dataclass(slots=True)
class Report:
    """Collects drops; equal ones become one diagnostic that names every prim."""

    stage: str
    _drops: dict[tuple[str, Severity, str, str | None], dict[str, None]] = field(
        default_factory=dict
    )

    def warn(self, code: str, message: str, prim: object, help: str | None = None) -> None:
        """Say that something at `prim` (a path) is not drawn, or not as it says."""
        self._drops.setdefault((code, "warning", message, help), {})[str(prim)] = None

    def fail(self, code: str, message: str, prim: object = "/", help: str | None = None) -> None:
        """Say that the stage cannot be drawn at all."""
        self._drops.setdefault((code, "error", message, help), {})[str(prim)] = None

    @property
    def failed(self) -> bool:
        """Whether the stage cannot be drawn."""
        return any(severity == "error" for _, severity, _, _ in self._drops)

    def diagnostics(self) -> list[Diagnostic]:
        """One diagnostic per reason, in the order of first appearance."""
        found = []
        for (code, severity, message, help), prims in self._drops.items():
            places = [Label(PrimPlace(self.stage, prim)) for prim in list(prims)[:LISTED]]
            count = f" ({len(prims)} prims)" if len(prims) > 1 else ""
            found.append(
                Diagnostic(code, severity, message + count, places[0], tuple(places[1:]), help)
            )
        return found
