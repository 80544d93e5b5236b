"""Prims of our own schema as the exact solids that they say (`compiler.usd.schema`)."""

from __future__ import annotations

from typing import Any

import numpy as np

from compiler.usd.clock import Clock
from compiler.usd.report import Report
from compiler.usd.schema import BEVEL, KINDS, SOLIDS, Parameter
from dsl.limits import broken_limit, within_rounding
from dsl.scene import ShapeKind


def read_solid(
    prim: Any, type_name: str, clock: Clock, report: Report
) -> tuple[ShapeKind, tuple[float, ...]] | None:
    """Kind and parameters of a typed prim, or None (reported) where it has none."""
    kind = KINDS[type_name]
    parameters: list[float] = []
    for parameter in SOLIDS[kind]:
        values = _values(prim, parameter, clock, report)
        if values is None:
            return None
        parameters += values
    return checked(kind, tuple(parameters), prim, report)


def read_bevel(prim: Any, clock: Clock) -> float:
    """The radius that OvoloBevelAPI gives a prim, 0 without it."""
    return clock.number(prim.GetAttribute(BEVEL), 0.0)


def checked(
    kind: ShapeKind, parameters: tuple[float, ...], prim: Any, report: Report
) -> tuple[ShapeKind, tuple[float, ...]] | None:
    """A shape whose parameters satisfy the inequalities of the language, or None (reported)."""
    parameters = within_rounding(kind, parameters)
    broken = broken_limit(kind, parameters)
    if broken is None:
        return kind, parameters
    report.add(broken.code, broken.message, prim.GetPath(), broken.help)
    return None


def _values(prim: Any, parameter: Parameter, clock: Clock, report: Report) -> list[float] | None:
    value = clock.value(prim.GetAttribute(parameter.name))
    if value is None:
        return list(parameter.default)
    try:
        values = np.asarray(value, dtype=np.float64).ravel()
    except (TypeError, ValueError):
        values = np.empty(0)
    if len(values) == len(parameter.default):
        return [float(v) for v in values]
    message = f"`{parameter.name}` is not of type {parameter.type_name}"
    report.add("usd-attribute", message, prim.GetPath())
    return None
