"""The report of an import: everything that was not drawn as the stage has it."""

from __future__ import annotations

from dataclasses import dataclass, field

from dsl.codes import CODES
from dsl.diagnostics import Diagnostic, Label
from dsl.spans import PrimPlace

LISTED = 100
"""Prims that one diagnostic names; what is beyond is only counted."""


@dataclass(slots=True)
class Report:
    """Collects faults; equal ones become one diagnostic that names every prim.

    `failed` says that the stage cannot be drawn at all.
    """

    stage: str
    failed: bool = False
    _found: dict[tuple[str, str, str | None], dict[str, None]] = field(default_factory=dict)

    def add(self, code: str, message: str, prim: object = "/", help: str | None = None) -> None:
        """Say that something at `prim` (a path) is not drawn, or not as it says.

        The code's severity says whether the rest of the stage can be; KeyError for a code that
        the catalogue does not list.
        """
        self.failed = self.failed or CODES[code].severity == "error"
        self._found.setdefault((code, message, help), {})[str(prim)] = None

    def diagnostics(self) -> list[Diagnostic]:
        """One diagnostic per reason, in the order of first appearance."""
        found = []
        for (code, message, help), prims in self._found.items():
            places = [Label(PrimPlace(self.stage, prim)) for prim in list(prims)[:LISTED]]
            count = f" ({len(prims)} prims)" if len(prims) > 1 else ""
            found.append(
                Diagnostic(
                    code,
                    CODES[code].severity,
                    message + count,
                    places[0],
                    tuple(places[1:]),
                    help,
                )
            )
        return found
