"""The command line: `ovolo COMMAND …`."""

from __future__ import annotations

import argparse
import errno
import gc
import io
import os
import sys
from collections.abc import Sequence
from importlib import import_module
from keyword import iskeyword
from typing import NoReturn

import ovolo
from dsl.diagnostics import CompileError
from dsl.garbage import seldom_collecting
from dsl.suggest import did_you_mean
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
    # No command multiplies large matrices: threads for it would cost half of NumPy's import.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    # A stream that was closed before is None: what is written there is for nobody.
    sys.stdout = sys.stdout or io.StringIO()
    sys.stderr = sys.stderr or io.StringIO()
    if isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(errors="backslashreplace")  # as standard error is
    try:
        code = _run(arguments)
        sys.stdout.flush()
    except (Exception, KeyboardInterrupt) as error:
        code = _ended_by(error)
    return int(code)


def _run(arguments: list[str]) -> Exit:
    if not arguments:
        _parser("").print_help(sys.stderr)
        return Exit.USAGE
    name = arguments[0]
    if name not in COMMANDS and not name.startswith("-"):
        help = did_you_mean(name, COMMANDS) or "`ovolo --help` lists the commands"
        raise StopError(Exit.USAGE, f"there is no command `{name}`", help)
    try:
        parsed, unknown = _parser(name).parse_known_args(arguments)
    except SystemExit:  # --help or --version has been answered
        return Exit.OK
    if unknown:
        help = f"`ovolo {name} --help` lists the arguments"
        raise StopError(Exit.USAGE, f"there is no argument `{unknown[0]}`", help)
    try:
        code: Exit = parsed.run(parsed)
    except CompileError as error:
        code = report(error.diagnostics, parsed.json)
    return code


def _ended_by(error: BaseException) -> Exit:
    """Say why the command ends before its time, and give the code for it."""
    match error:
        case StopError():
            print_stop(error)
            return error.code
        case KeyboardInterrupt():
            print("interrupted", file=sys.stderr)
            return Exit.INTERRUPTED
        case MemoryError():
            print("error: there is not enough memory for that", file=sys.stderr)
            return Exit.USAGE
        case BrokenPipeError():
            _discard_output()
            return Exit.PIPE_CLOSED
        case OSError(errno=errno.ENOSPC | errno.EDQUOT | errno.EIO):
            _discard_output()
            print(f"error: the output cannot be written: {error.strerror}", file=sys.stderr)
            return Exit.FILES
    import traceback

    traceback.print_exception(error)
    print("this is a fault of ovolo's own: please report it", file=sys.stderr)
    return Exit.BUG


def _discard_output() -> None:
    """Let what Python still flushes on its way out go nowhere."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


class _Parser(argparse.ArgumentParser):
    """A parser whose errors are told like all others, without the list of all arguments."""

    def error(self, message: str) -> NoReturn:
        raise StopError(Exit.USAGE, message, f"`{self.prog} --help` lists the arguments")


def _parser(chosen: str) -> argparse.ArgumentParser:
    """The parser for the chosen command alone; for none, one that names them all."""
    parser = _Parser(
        prog="ovolo",
        description="Scenes to pictures, with known accuracy.",
        epilog="exit codes:\n" + "\n".join(f"  {code:<4} {code.meaning}" for code in Exit),
        formatter_class=argparse.RawDescriptionHelpFormatter,
        allow_abbrev=False,
    )
    parser.add_argument("--version", action="version", version=f"ovolo {ovolo.__version__}")
    # With `prog` given, the usage so far is not written for it, which takes terminal and locale.
    commands = parser.add_subparsers(metavar="COMMAND", required=True, prog=parser.prog)
    for name in [chosen] if chosen in COMMANDS else COMMANDS:
        summary = COMMANDS[name]
        command = commands.add_parser(
            name,
            help=summary,
            description=f"{summary[0].upper()}{summary[1:]}.",
            allow_abbrev=False,
        )
        if name == chosen:
            # `import` is a word of Python's own, and its module `import_`.
            with seldom_collecting():
                module = import_module(f"ovolo.commands.{name}{'_' * iskeyword(name)}")
            module.configure(command)
            command.set_defaults(run=module.run, json=False)
    return parser


def process() -> NoReturn:
    """A process that runs one command."""
    code = main()
    # Else the collector looks at all objects once more, before the system takes all memory back. It
    # has to where OpenImageIO is, whose bindings call what is left at the end leaked, on stderr.
    if "OpenImageIO" not in sys.modules:
        gc.freeze()
    sys.exit(code)


if __name__ == "__main__":
    process()
