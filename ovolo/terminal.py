"""What the command prints: diagnostics on standard error, answers on standard output."""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from typing import TextIO

from dsl.diagnostics import Diagnostic
from ovolo.exits import Exit, StopError


def wants_color(stream: TextIO) -> bool:
    """Whether to colour: on a terminal, unless NO_COLOR says no (https://no-color.org)."""
    return stream.isatty() and not os.environ.get("NO_COLOR") and os.environ.get("TERM") != "dumb"


def print_diagnostics(diagnostics: Sequence[Diagnostic]) -> None:
    """Print diagnostics in full, an empty line between two, and how many there were."""
    if not diagnostics:
        return
    from dsl.render_diagnostic import render_diagnostics

    print(render_diagnostics(diagnostics, color=wants_color(sys.stderr)), file=sys.stderr)
    errors = sum(diagnostic.severity == "error" for diagnostic in diagnostics)
    counts = [
        f"{count} {word}{'s' if count > 1 else ''}"
        for count, word in ((errors, "error"), (len(diagnostics) - errors, "warning"))
        if count
    ]
    print(", ".join(counts), file=sys.stderr)


def print_stop(stop: StopError) -> None:
    """Print why the command ends, in the form of a diagnostic without a place."""
    print(f"error: {stop.message}", file=sys.stderr)
    if stop.help:
        print(f"  = help: {stop.help}", file=sys.stderr)


def print_json(value: object) -> None:
    """Print one JSON value on standard output."""
    import json

    print(json.dumps(value, indent=2, allow_nan=False))


def report(diagnostics: Sequence[Diagnostic], as_json: bool = False) -> Exit:
    """Print diagnostics, as text or as JSON, and give the exit code that they call for."""
    errors = [diagnostic for diagnostic in diagnostics if diagnostic.severity == "error"]
    if as_json:
        from dsl.render_diagnostic import to_json

        faults = [to_json(diagnostic) for diagnostic in diagnostics]
        print_json({"ok": not errors, "diagnostics": faults})
    else:
        print_diagnostics(diagnostics)
    if not errors:
        return Exit.OK
    # What has no place in a scene is a file named on the command line.
    files = all(error.code.startswith("file-") and error.primary is None for error in errors)
    return Exit.FILES if files else Exit.FAULTS
