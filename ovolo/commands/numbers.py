"""Numbers as arguments."""

from __future__ import annotations

import argparse
import math
from collections.abc import Callable


def number(text: str, allowed: Callable[[float], bool], words: str) -> float:
    """The number that a text is; one that is not `allowed` is told to be none of `words`."""
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not allowed(value):
        raise argparse.ArgumentTypeError(f"`{text}` is not {words}")
    return value
