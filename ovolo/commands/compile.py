"""`ovolo compile`."""

from __future__ import annotations

import argparse
import sys
from dataclasses import asdict
from pathlib import Path
from typing import Any

from compiler.ir import SceneIR
from dsl.whole_files import replacing
from ovolo.commands.reading import add_bounds, add_reading, read_scene
from ovolo.exits import Exit, StopError
from ovolo.terminal import print_diagnostics, print_json


def configure(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument(
        "scene", type=Path, metavar="SCENE", help=".ovo or USD file, or .ir: an IR in either form"
    )
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
    add_bounds(parser)
    parser.add_argument("--json", action="store_true", help="print figures as JSON, not the text")


def run(arguments: argparse.Namespace) -> Exit:
    """Compile, and write the form asked for."""
    from compiler.ir_binary import write_ir
    from compiler.ir_file import read_ir_file
    from compiler.ir_text import print_ir

    output: Path | None = arguments.output
    if output is None and arguments.emit == "binary":
        raise StopError(Exit.USAGE, "there is no file for the binary form", "add `--output PATH`")
    if output is not None and output.is_dir():
        raise StopError(Exit.FILES, f"`{output}` cannot be written: it is a folder")
    if arguments.scene.suffix == ".ir":
        ir = read_ir_file(arguments.scene)
        if arguments.json:
            print_json(_figures(ir))
    else:
        compilation = read_scene(arguments)
        ir = compilation.ir
        if arguments.json:
            print_json(compilation.figures())
        else:
            print_diagnostics(compilation.warnings)
    if output is None:
        if not arguments.json:
            sys.stdout.write(print_ir(ir))
        return Exit.OK
    try:
        if arguments.emit == "binary":
            write_ir(ir, output)
        else:
            with replacing(output) as unfinished:
                unfinished.write_text(print_ir(ir), encoding="utf-8")
    except OSError as error:
        raise StopError(Exit.FILES, f"`{output}` cannot be written: {error.strerror}") from None
    return Exit.OK


def _figures(ir: SceneIR) -> dict[str, Any]:
    from compiler.inspect import summarize
    from compiler.ir_binary import content_hash

    return {**asdict(summarize(ir)), "hash": content_hash(ir)}
