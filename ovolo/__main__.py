"""The command line: `ovolo COMMAND …`."""

from __future__ import annotations

import argparse
import io
import os
import sys
from collections.abc import Sequence
from importlib import import_module
from keyword import iskeyword

import ovolo
from dsl.diagnostics import CompileError
from ovolo.exits import Exit, StopError
from ovolo.terminal import print_stop, report

COMMANDS = {
    "render": "make a picture of a scene",
    "watch": "make a picture again whenever the scene changes",
    "check": "say what is wrong with scenes",
    "fmt": "put scene programs into canonical form",
    "compile": "turn a scene into its flat IR",
    "export": "turn a scene into a USD stage",
    "import": "turn a small stage into a program",
    "inspect": "say what a scene consists of",
    "doc": "print the documentation of a program",
    "explain": "say what a diagnostic means, with examples",
    "conformance": "judge an implementation by the language reference",
    "lsp": "answer an editor, over the Language Server Protocol",
    "serve": "answer over HTTP",
    "version": "say which version this is",
}


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command and return its exit code; what a user does wrong never raises."""
    arguments = sys.argv[1:] if argv is None else list(argv)
    if isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(errors="backslashreplace")  # as standard error is
    try:
        code = _run(arguments)
        sys.stdout.flush()
    except StopError as stop:
        print_stop(stop)
        code = stop.code
    except BrokenPipeError:
        # Python flushes standard output once more on its way out: let that go nowhere.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        code = Exit.PIPE_CLOSED
    except KeyboardInterrupt:
        print("interrupted", file=sys.stderr)
        code = Exit.INTERRUPTED
    except Exception:
        import traceback

        traceback.print_exc()
        print("this is a fault of ovolo's own: please report it", file=sys.stderr)
        code = Exit.BUG
    return int(code)


def _run(arguments: list[str]) -> Exit:
    try:
        parsed = _parser(arguments[0] if arguments else "").parse_args(arguments)
    except SystemExit as end:  # after --help, or a message about the arguments
        return Exit.USAGE if end.code else Exit.OK
    try:
        code: Exit = parsed.run(parsed)
    except CompileError as error:
        code = report(error.diagnostics, parsed.json)
    return code


def _parser(chosen: str) -> argparse.ArgumentParser:
    """The parser for the chosen command: the others are named, but not loaded."""
    parser = argparse.ArgumentParser(
        prog="ovolo",
        description="Scenes to pictures, with known accuracy.",
        epilog="exit codes:\n" + "\n".join(f"  {code:<4} {code.meaning}" for code in Exit),
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--version", action="version", version=f"ovolo {ovolo.__version__}")
    commands = parser.add_subparsers(metavar="COMMAND", required=True)
    for name, summary in COMMANDS.items():
        command = commands.add_parser(name, help=summary, description=f"{summary.capitalize()}.")
        if name == chosen:
            # `import` is a word of Python's own, and its module `import_`.
            module = import_module(f"ovolo.commands.{name}{'_' * iskeyword(name)}")
            module.configure(command)
            command.set_defaults(run=module.run, json=False)
    return parser


if __name__ == "__main__":
    sys.exit(main())
