"""How a scene is read: arguments of several commands."""

from __future__ import annotations

import argparse
import math
from pathlib import Path
from typing import get_args

from compiler.compilation import Compilation, compile_path
from compiler.usd.options import Complexity
from dsl.budget import Limits
from dsl.files import Files
from ovolo.exits import Exit, StopError


def add_reading(parser: argparse.ArgumentParser) -> None:
    """Declare `--set`, `--time` and `--complexity`."""
    parser.add_argument(
        "--set",
        action="append",
        default=[],
        metavar="NAME=VALUE",
        help="a value for a `param` of a program, such as count=12 or tilt=30deg; may be given "
        "several times",
    )
    parser.add_argument(
        "--time",
        type=_time,
        metavar="TIME",
        help="the `time` of a program, default 0; the time code at which a USD stage is read, or "
        '"earliest", default: default values',
    )
    parser.add_argument(
        "--complexity",
        choices=get_args(Complexity),
        default="low",
        help="of a stage's subdivision meshes: low is their cage; medium, high and veryhigh are "
        "1, 2 and 3 refinements of their limit surface; limit as many as suit their faces",
    )


def _time(text: str) -> float | str:
    if text == "earliest":
        return text
    value = float(text)
    if not math.isfinite(value):
        raise ValueError
    return value


def params(arguments: argparse.Namespace) -> dict[str, str]:
    """What `--set` says."""
    settings = {}
    for text in arguments.set:
        name, equals, value = text.partition("=")
        if not equals or not name.strip():
            raise StopError(Exit.USAGE, f"`--set {text}` sets nothing", "write `--set count=12`")
        settings[name.strip()] = value.strip()
    return settings


def add_bounds(parser: argparse.ArgumentParser) -> None:
    """Declare `--root` and `--limit`."""
    parser.add_argument(
        "--root",
        type=Path,
        metavar="FOLDER",
        help="read nothing outside of it; the scene lies in it, and messages name files from there",
    )
    parser.add_argument(
        "--limit",
        action="append",
        default=[],
        metavar="NAME=N",
        help="what a program may spend, such as steps=1000 (dsl/reference/limits.md), or "
        "file_bytes=N, the size of one file; may be given several times",
    )


def read_scene(arguments: argparse.Namespace) -> Compilation:
    """Compile the scene that the command line names, in the way it says; raises CompileError."""
    root: Path | None = arguments.root
    if root is not None and not root.is_dir():
        raise StopError(Exit.FILES, f"`{root}` is no folder")
    limits = dict(map(_limit, arguments.limit))
    size = limits.pop("file_bytes", None)
    files = Files(root) if size is None else Files(root, size)
    try:
        allowed = Limits(**limits)
    except TypeError:
        known = ", ".join([*Limits.__dataclass_fields__, "file_bytes"])
        raise StopError(Exit.USAGE, "there is no such limit", f"limits are {known}") from None
    return compile_path(
        arguments.scene,
        arguments.time,
        arguments.complexity,
        files,
        allowed,
        params(arguments),
    )


def _limit(text: str) -> tuple[str, int]:
    name, equals, number = text.partition("=")
    if not equals or not number.isascii() or not number.isdigit():
        raise StopError(Exit.USAGE, f"`--limit {text}` is no limit", "write `--limit steps=1000`")
    return name, int(number)
