"""`ovolo export`."""

from __future__ import annotations

import argparse
from pathlib import Path

from ovolo.commands.numbers import number
from ovolo.commands.reading import add_bounds, add_reading, read_scene
from ovolo.exits import Exit, StopError
from ovolo.terminal import print_diagnostics, print_json


def configure(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument("scene", type=Path, metavar="SCENE", help=".ovo or USD file")
    parser.add_argument("stage", type=Path, metavar="STAGE", help=".usd, .usda, .usdc or .usdz")
    parser.add_argument(
        "--tolerance",
        type=_tolerance,
        default=1e-3,
        metavar="FRACTION",
        help="how far the mesh of a solid that USD does not know may be from the solid, in parts "
        "of its diameter; 0 writes no meshes; default 0.001",
    )
    add_reading(parser)
    add_bounds(parser)
    parser.add_argument("--quiet", action="store_true", help="say nothing but errors")
    parser.add_argument("--json", action="store_true", help="print figures as JSON")


def run(arguments: argparse.Namespace) -> Exit:
    """Compile, and write the stage."""
    from ovolo.scene import Scene

    scene = Scene(read_scene(arguments))
    if not arguments.quiet and not arguments.json:
        print_diagnostics(scene.warnings)
    try:
        scene.export(arguments.stage, tolerance=arguments.tolerance or None)
    except OSError as error:
        raise StopError(Exit.FILES, str(error)) from None
    if arguments.json:
        print_json({"output": str(arguments.stage), "bytes": arguments.stage.stat().st_size})
    elif not arguments.quiet:
        print(f"{arguments.stage}: {arguments.stage.stat().st_size:,} bytes")
    return Exit.OK


def _tolerance(text: str) -> float:
    return number(text, lambda value: 0.0 <= value < 1.0, "a fraction, 0 or more and below 1")
