"""Frames of a sequence: which times, and how the picture of each is called."""

from __future__ import annotations

import re
from collections.abc import Sequence
from decimal import Decimal
from pathlib import Path

MAX_FRAMES = 100_000


def parse_frames(text: str) -> list[Decimal]:
    """`1:24`, `1:24x2`, `7`, or several of these between commas. Raises ValueError.

    The last frame belongs to them if a step meets it; steps may have fractions, and be negative
    where frames run backwards.
    """
    frames: list[Decimal] = []
    for part in text.split(","):
        ends, by, step = part.partition("x")
        first, colon, last = ends.partition(":")
        start = _number(first)
        stop = _number(last) if colon else start
        stride = _number(step) if by else Decimal(1 if stop >= start else -1)
        if not stride or (by and not colon) or (stop - start) * stride < 0:
            raise ValueError(f"`{part}` are no frames")
        count = int((stop - start) / stride) + 1
        if len(frames) + count > MAX_FRAMES:
            raise ValueError(f"more than {MAX_FRAMES} frames")
        frames += (start + number * stride for number in range(count))
    return frames


def _number(text: str) -> Decimal:
    if not re.fullmatch(r"\s*[+-]?(\d{1,9}(\.\d{0,9})?|\.\d{1,9})\s*", text, re.ASCII):
        raise ValueError(f"`{text}` is no frame")
    return Decimal(text.strip())


def numbered(path: Path, frames: Sequence[Decimal]) -> list[Path]:
    """The picture of each frame: `####` in the name is its number with at least so many digits.

    A name without `#` gets `.####` before its suffix. If some frame has decimals, all have as many.
    """
    name = path.name
    if "#" not in name:
        name = f"{path.stem}.####{path.suffix}"
    decimals = max((max(0, _decimals(frame)) for frame in frames), default=0)

    def named(frame: Decimal) -> Path:
        def digits(run: re.Match[str]) -> str:
            width = len(run[0]) + (decimals + 1 if decimals else 0)
            return f"{'-' if frame < 0 else ''}{abs(frame):0{width}.{decimals}f}"

        return path.with_name(re.sub("#+", digits, name))

    return [named(frame) for frame in frames]


def _decimals(frame: Decimal) -> int:
    exponent = frame.normalize().as_tuple().exponent
    return -exponent if isinstance(exponent, int) else 0
