"""`ovolo check`."""

from __future__ import annotations

import argparse
from pathlib import Path

from dsl.diagnostics import CompileError, Diagnostic
from ovolo.commands.reading import add_bounds, add_reading, read_scene
from ovolo.exits import Exit
from ovolo.terminal import report


def configure(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument("scenes", nargs="+", type=Path, metavar="SCENE", help=".ovo or USD file")
    add_reading(parser)
    add_bounds(parser)
    parser.add_argument("--json", action="store_true", help="answer as JSON on standard output")


def run(arguments: argparse.Namespace) -> Exit:
    """Report every fault of every scene; faults of the scene weigh more than missing files."""
    diagnostics: list[Diagnostic] = []
    for path in arguments.scenes:
        try:
            diagnostics += read_scene(arguments, path).warnings
        except CompileError as error:
            diagnostics += error.diagnostics
    return report(diagnostics, arguments.json)
