"""How a scene is read: arguments of several commands."""

from __future__ import annotations

import argparse
import math
from pathlib import Path
from typing import get_args

from compiler import compilation
from compiler.compilation import STAGE_SUFFIXES, Compilation, Time
from compiler.usd.options import KNOWN_PURPOSES, Complexity, Isolation, StageOptions
from dsl.budget import Limits
from dsl.files import Files
from ovolo.commands.numbers import number
from ovolo.exits import Exit, StopError


def add_reading(parser: argparse.ArgumentParser) -> None:
    """Declare how scenes are read, and what of stages."""
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
    parser.add_argument("--strict", action="store_true", help="take warnings for errors")
    stage = parser.add_argument_group("USD stages")
    stage.add_argument(
        "--complexity",
        choices=get_args(Complexity),
        default="low",
        help="of subdivision meshes: low is their cage; medium, high and veryhigh are "
        "1, 2 and 3 refinements of their limit surface; limit as many as suit their faces",
    )
    stage.add_argument(
        "--purposes",
        type=_purposes,
        default=None,
        metavar="NAMES",
        help="drawn beside default, separated by commas: render, proxy, guide; "
        "default: what the stage's render settings include, or render",
    )
    stage.add_argument("--prim", metavar="PATH", help="draw this prim and those below, in place")
    stage.add_argument(
        "--mask",
        action="append",
        default=[],
        metavar="PATHS",
        help="read only these prims, separated by commas, and those above and below",
    )
    stage.add_argument(
        "--variant",
        action="append",
        default=[],
        metavar="PATH{SET=NAME}",
        help="select a variant, such as /World/Car{color=red}; may be given several times",
    )
    stage.add_argument("--no-payloads", action="store_true", help="do not load payloads")
    stage.add_argument(
        "--deadline",
        type=_positive,
        metavar="SECONDS",
        help="import stages in a child process, and for no longer",
    )
    stage.add_argument(
        "--memory",
        type=_positive,
        metavar="MEGABYTES",
        help="import stages in a child process, with no more memory than that",
    )


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


def read_scene(
    arguments: argparse.Namespace, path: Path | None = None, time: Time = None
) -> Compilation:
    """Compile a scene, in the way that the command line says; raises CompileError.

    `path` and `time` are those of the command line unless given.
    """
    path = arguments.scene if path is None else path
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
    scene = compilation.compile_path(
        path,
        arguments.time if time is None else time,
        _options(arguments, path),
        files,
        allowed,
        params(arguments),
        prim=arguments.prim,
        isolation=_isolation(arguments),
    )
    return compilation.strictly(scene) if arguments.strict else scene


def _options(arguments: argparse.Namespace, path: Path) -> StageOptions:
    mask = tuple(word for words in arguments.mask for word in words.replace(",", " ").split())
    if path.suffix.lower() not in STAGE_SUFFIXES:
        for name, given in (
            ("--mask", mask),
            ("--variant", arguments.variant),
            ("--prim", arguments.prim),
        ):
            if given:
                raise StopError(Exit.USAGE, f"`{name}` is for stages, and `{path}` is a program")
    return StageOptions(
        purposes=arguments.purposes,
        payloads=not arguments.no_payloads,
        complexity=arguments.complexity,
        mask=mask,
        variants=tuple(arguments.variant),
    )


def _isolation(arguments: argparse.Namespace) -> Isolation | None:
    if arguments.deadline is None and arguments.memory is None:
        return None
    memory = None if arguments.memory is None else int(arguments.memory * (1 << 20))
    return Isolation(arguments.deadline, memory)


def _time(text: str) -> float | str:
    if text == "earliest":
        return text
    return number(text, math.isfinite, 'a time code, nor "earliest"')


def _purposes(text: str) -> frozenset[str]:
    chosen = frozenset(text.replace(",", " ").split())
    if not chosen <= set(KNOWN_PURPOSES):
        raise argparse.ArgumentTypeError(f"purposes are {', '.join(KNOWN_PURPOSES)}, not `{text}`")
    return chosen | {"default"}


def _positive(text: str) -> float:
    return number(text, lambda value: 0.0 < value < math.inf, "a number above 0")


def _limit(text: str) -> tuple[str, int]:
    name, equals, amount = text.partition("=")
    if not equals or not amount.isascii() or not amount.isdigit():
        raise StopError(Exit.USAGE, f"`--limit {text}` is no limit", "write `--limit steps=1000`")
    return name, int(amount)
