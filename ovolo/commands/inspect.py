"""`ovolo inspect`."""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from compiler.compilation import STAGE_SUFFIXES, Compilation
from ovolo.commands.reading import add_bounds, add_reading, read_scene
from ovolo.commands.stage_table import print_stage
from ovolo.exits import Exit, StopError
from ovolo.terminal import print_diagnostics, print_json


def configure(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument("scene", type=Path, metavar="SCENE", help=".ovo or USD file")
    parser.add_argument(
        "--picture",
        action="store_true",
        help="print what the first camera sees, a letter for each prototype, and nothing else",
    )
    add_reading(parser)
    add_bounds(parser)
    parser.add_argument("--json", action="store_true", help="answer as JSON on standard output")


def run(arguments: argparse.Namespace) -> Exit:
    """Print the figures of a scene; warnings name what a stage has and the scene has not."""
    compilation = read_scene(arguments)
    if arguments.picture:
        return _draw(compilation)
    figures = compilation.figures()
    stage = _stage(arguments, compilation)
    if arguments.json:
        from dsl.render_diagnostic import to_json

        figures = {**figures, **({"stage": stage} if stage else {})}
        print_json({**figures, "diagnostics": [to_json(w) for w in compilation.warnings]})
    else:
        print_diagnostics(compilation.warnings)
        for title, words in _lines(figures):
            print(f"{title:<12}{words}")
        if stage:
            print()
            print_stage(stage)
    return Exit.OK


def _stage(arguments: argparse.Namespace, compilation: Compilation) -> dict[str, Any]:
    """What the stage holds that was drawn; empty for a program."""
    path, reader = arguments.scene, compilation.reader
    if path.suffix.lower() not in STAGE_SUFFIXES:
        return {}
    from compiler.usd import describe_stage

    origins = compilation.ir.origins
    drawn = {compilation.ir.text(int(prim)) for prim in origins["prim"] if prim >= 0}
    return describe_stage(
        path,
        time=reader.time,
        drawn=sorted(drawn),
        options=reader.options,
        isolation=reader.isolation,
    )


def _draw(compilation: Compilation) -> Exit:
    from runtime.text_picture import text_picture

    if not len(compilation.ir.cameras):
        raise StopError(Exit.FAULTS, "the scene has no camera", "add `camera(from: (0, 0, 10))`")
    print_diagnostics(compilation.warnings)
    sys.stdout.write(text_picture(compilation.ir))
    return Exit.OK


def _lines(figures: dict[str, Any]) -> Iterator[tuple[str, str]]:
    """What people read of the figures, line by line."""
    instances = f"{figures['leaves']:,}"
    if figures["instances"] != figures["leaves"]:
        instances += f", kept as {figures['instances']:,} in {figures['groups']:,} groups"
    yield "instances", instances
    yield "prototypes", _tally(figures["prototypes"])
    if figures["mesh_triangles"]:
        triangles, points = figures["mesh_triangles"], figures["mesh_points"]
        yield "meshes", f"{triangles:,} triangles, {points:,} points"
    yield "materials", f"{figures['materials']:,}"
    yield "lights", _tally(figures["lights"])
    if figures["skies"]:
        yield "skies", ", ".join(figures["skies"])
    yield "cameras", f"{figures['cameras']:,}"
    if figures["params"]:
        yield (
            "parameters",
            ", ".join(f"{p['name']} = {_words(p['value'])}" for p in figures["params"]),
        )
    yield "memory", f"{figures['bytes']:,} bytes; {figures['instance_bytes']:.1f} per instance"
    if figures["bounds"] is not None:
        lower, upper = (
            "(" + ", ".join(f"{x:.6g}" for x in corner) + ")" for corner in figures["bounds"]
        )
        yield "bounds", f"{lower} … {upper}"
    left_out = {name.replace("_", " "): n for name, n in figures["pruned"].items()}
    yield "left out", _tally(left_out)
    yield "hash", figures["hash"]


def _tally(counts: dict[str, int]) -> str:
    return ", ".join(f"{count:,} {name}" for name, count in counts.items() if count) or "none"


def _words(value: object) -> str:
    """A parameter's value."""
    return value if isinstance(value, str) else json.dumps(value)
