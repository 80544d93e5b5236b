"""Colours in the text: where they are, and how one is written."""

from __future__ import annotations

import math
from dataclasses import dataclass

from dsl.language_service.program import Program
from dsl.lexer import srgb_to_linear
from dsl.values import format_number

_Rgb = tuple[float, float, float]
_CALL = ("(", "number", ",", "number", ",", "number", ")")


@dataclass(frozen=True, slots=True)
class ColorPlace:
    """A colour literal, or `rgb(…)` of three numbers, with its sRGB-encoded components."""

    start: int
    end: int
    encoded: _Rgb


def colors(program: Program) -> list[ColorPlace]:
    """All colours that are written out and that a screen can show."""
    found = []
    tokens = program.tokens
    for position, token in enumerate(tokens):
        if token.kind == "color":
            digits = program.encoded[token.start + 1 : token.end].decode()
            red, green, blue = (int(digits[i : i + 2], 16) / 255.0 for i in (0, 2, 4))
            found.append(ColorPlace(token.start, token.end, (red, green, blue)))
        elif token.value == "rgb" and token.kind == "name":
            call = tokens[position + 1 : position + 8]
            if tuple(part.kind for part in call) != _CALL:
                continue
            linear = [part.value for part in call if isinstance(part.value, float)]
            if max(linear) <= 1.0:
                red, green, blue = map(linear_to_srgb, linear)
                found.append(ColorPlace(token.start, call[-1].end, (red, green, blue)))
    return found


def presentations(encoded: _Rgb, now: str) -> list[str]:
    """The ways to write a colour, that of the text which it replaces first."""
    numbers = (format_number(float(f"{srgb_to_linear(c):.4g}")) for c in encoded)
    forms = [
        "#" + "".join(f"{round(255.0 * component):02x}" for component in encoded),
        f"rgb({', '.join(numbers)})",
    ]
    return forms[::-1] if now.startswith("rgb") else forms


def linear_to_srgb(linear: float) -> float:
    """One component in [0, 1], sRGB-encoded (IEC 61966-2-1)."""
    return 12.92 * linear if linear <= 0.0031308 else 1.055 * math.pow(linear, 1 / 2.4) - 0.055
