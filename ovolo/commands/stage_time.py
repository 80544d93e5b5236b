"""The time of a scene: an argument of several commands."""

from __future__ import annotations

import argparse
import math


def add_time(parser: argparse.ArgumentParser) -> None:
    """Declare `--time`."""
    parser.add_argument(
        "--time",
        type=_time,
        metavar="TIME",
        help="the `time` of a program, default 0; the time code at which a USD stage is read, or "
        '"earliest", default: default values',
    )


def _time(text: str) -> float | str:
    if text == "earliest":
        return text
    value = float(text)
    if not math.isfinite(value):
        raise ValueError
    return value
