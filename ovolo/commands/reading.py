"""How a scene is read: arguments of several commands."""

from __future__ import annotations

import argparse
import math
from typing import get_args

from compiler.usd.options import Complexity


def add_reading(parser: argparse.ArgumentParser) -> None:
    """Declare `--time` and `--complexity`."""
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
