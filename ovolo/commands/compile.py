"""`ovolo compile`."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from ovolo.commands.reading import add_reading
from ovolo.exits import Exit, StopError
from ovolo.terminal import print_diagnostics, print_json


def configure(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument("scene", type=Path, metavar="SCENE", help=".ovo or USD file")
    parser.add_argument(
        "--emit",
        choices=("ir", "binary"),
        default="ir",
        help="the canonical text (default), or the form that is mapped into memory",
    )
    parser.add_argument(
        "-o", "--output", type=Path, metavar="PATH", help="default for the text: standard output"
    )
    add_reading(parser)
    parser.add_argument("--json", action="store_true", help="print figures as JSON, not the text")


def run(arguments: argparse.Namespace) -> Exit:
    """Compile, and write the form asked for."""
    from compiler.compilation import compile_path
    from compiler.ir_binary import write_ir
    from compiler.ir_text import print_ir

    output: Path | None = arguments.output
    if output is None and arguments.emit == "binary":
        raise StopError(Exit.USAGE, "there is no file for the binary form", "add `--output PATH`")
    if output is not None and output.is_dir():
        raise StopError(Exit.FILES, f"`{output}` cannot be written: it is a folder")
    compilation = compile_path(arguments.scene, arguments.time, arguments.complexity)
    if arguments.json:
        print_json(compilation.figures())
    else:
        print_diagnostics(compilation.warnings)
    if output is None:
        if not arguments.json:
            sys.stdout.write(print_ir(compilation.ir))
        return Exit.OK
    try:
        if arguments.emit == "binary":
            write_ir(compilation.ir, output)
        else:
            output.write_text(print_ir(compilation.ir), encoding="utf-8")
    except OSError as error:
        raise StopError(Exit.FILES, f"`{output}` cannot be written: {error.strerror}") from None
    return Exit.OK
