"""Faults as data: every fault a user can cause is a `Diagnostic`, never a traceback."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal

from dsl.spans import Place

Severity = Literal["error", "warning"]


@dataclass(frozen=True, slots=True)
class Label:
    """A place with a few words about it."""

    place: Place
    text: str = ""


@dataclass(frozen=True, slots=True)
class Diagnostic:
    """One fault: what is wrong, where, and how to mend it.

    `code` is listed in `dsl.codes`; `message` stands alone on one line, lower case, without a
    final full stop; `primary` is the smallest place that shows the fault (None where there is no
    place, such as a file that cannot be read); `help` alone says how to mend it.
    """

    code: str
    severity: Severity
    message: str
    primary: Label | None = None
    secondary: tuple[Label, ...] = ()
    help: str | None = None


class CompileError(Exception):
    """Raised when a scene has faults; `diagnostics` holds all of them, in order of place."""

    def __init__(self, diagnostics: Iterable[Diagnostic]) -> None:
        self.diagnostics: list[Diagnostic] = list(diagnostics)
        first = next((d for d in self.diagnostics if d.severity == "error"), None)
        summary = f"{first.code}: {first.message}" if first else "the scene has faults"
        more = sum(d.severity == "error" for d in self.diagnostics) - 1
        super().__init__(summary + (f" (and {more} more)" if more > 0 else ""))

    @property
    def __notes__(self) -> list[str]:  # type: ignore[override]  # made when it is asked for
        """The faults in full: what Python prints below the summary in a traceback (PEP 678)."""
        from dsl.render_diagnostic import render_diagnostics

        return [render_diagnostics(self.diagnostics)]

    def __reduce__(self) -> tuple[type[CompileError], tuple[list[Diagnostic]]]:
        return CompileError, (self.diagnostics,)
