"""`ovolo doc`."""

from __future__ import annotations

import argparse
import sys

from dsl.diagnostics import CompileError
from ovolo.exits import Exit
from ovolo.terminal import print_json, report


def configure(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument("scene", metavar="SCENE", help=".ovo file")
    parser.add_argument("--json", action="store_true", help="answer as JSON, not Markdown")


def run(arguments: argparse.Namespace) -> Exit:
    """Print what the `///` lines of a program say; its syntax must be right."""
    from dsl.budget import DEFAULT_LIMITS
    from dsl.files import FileFault, Files
    from dsl.language_service.manual import manual, markdown
    from dsl.language_service.program import Program

    try:
        text = Files().read_text(arguments.scene, source_bytes=DEFAULT_LIMITS.source_bytes)
    except FileFault as fault:
        raise CompileError([fault.diagnostic(None)]) from None
    program = Program(arguments.scene, text)
    if program.faults:
        return report(program.faults, arguments.json)
    found = manual(program)
    if arguments.json:
        print_json(found)
    else:
        sys.stdout.write(markdown(found))
    return Exit.OK
