"""`ovolo import`."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from dsl.whole_files import replacing
from ovolo.commands.reading import add_bounds, add_reading, read_scene
from ovolo.exits import Exit, StopError
from ovolo.terminal import print_diagnostics


def configure(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument("scene", type=Path, metavar="STAGE", help="a small USD stage, or a program")
    parser.add_argument(
        "-o",
        "--output",
        type=Path,
        metavar="PATH",
        help="the program; its meshes go into a folder beside it; default: standard output, with "
        "every triangle written out",
    )
    add_reading(parser)
    add_bounds(parser)
    parser.add_argument("--quiet", action="store_true", help="say nothing but errors")


def run(arguments: argparse.Namespace) -> Exit:
    """Print a program that denotes the scene; what it cannot say is told."""
    from compiler.mesh import write_obj
    from compiler.program import ProgramError, write_program

    output: Path | None = arguments.output
    compilation = read_scene(arguments)
    try:
        program = write_program(compilation, None if output is None else f"{output.stem}.meshes")
    except ProgramError as error:
        use = f'a program can use the stage: `usd("{arguments.scene.name}")`'
        raise StopError(Exit.FAULTS, str(error), use) from None
    if not arguments.quiet:
        print_diagnostics([*compilation.warnings, *program.unsaid])
    if output is None:
        sys.stdout.write(program.text)
        return Exit.OK
    try:
        for name, mesh in program.meshes.items():
            path = output.parent / name
            path.parent.mkdir(exist_ok=True)
            write_obj(mesh, path)
        with replacing(output) as unfinished:
            unfinished.write_text(program.text, encoding="utf-8")
    except OSError as error:
        raise StopError(Exit.FILES, f"`{output}` cannot be written: {error.strerror}") from None
    return Exit.OK
