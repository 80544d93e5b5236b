"""Reading attributes at one time."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from pxr import Usd

from compiler.usd.report import Report
from dsl.scene import FloatArray, IntArray

_UNAUTHORED = (Usd.ResolveInfoSourceNone, Usd.ResolveInfoSourceFallback)


@dataclass(frozen=True, slots=True)
class Clock:
    """The time at which a stage is read.

    Never asks an attribute for its list of samples: with `timeCodesPerSecond = 0` in a layer
    usd-core does not return from that.
    """

    time: float | Literal["earliest"] | None = None

    def value(self, attribute: Any) -> Any:
        """The attribute's value, None where there is neither an opinion nor a fallback."""
        if not attribute:
            return None
        if self.time is None and not attribute.HasFallbackValue():
            return self.plain(attribute)
        return attribute.Get(self.code(attribute))

    def plain(self, attribute: Any) -> Any:
        """The same of an attribute that there is, and that no schema gives a fallback."""
        if self.time is None:
            value = attribute.Get()
            return attribute.Get(Usd.TimeCode.EarliestTime()) if value is None else value
        return attribute.Get(self.code(attribute))

    def beside(self, attribute: Any, fallback: str) -> Any:
        """The same of an attribute whose schema has that fallback, which is asked for less."""
        if attribute and self.time is None:
            value = attribute.Get()
            if value is not None and value != fallback:
                return value
        return self.value(attribute)

    def code(self, attribute: Any) -> Any:
        """The Usd.TimeCode at which this attribute is read."""
        if self.time == "earliest":
            return Usd.TimeCode.EarliestTime()
        if self.time is not None:
            return Usd.TimeCode(self.time)
        default = Usd.TimeCode.Default()
        if attribute.GetResolveInfo(default).GetSource() in _UNAUTHORED:
            return Usd.TimeCode.EarliestTime()
        return default

    def number(self, attribute: Any, fallback: float) -> float:
        """A finite number, or the fallback."""
        try:
            number = float(self.value(attribute))
        except (TypeError, ValueError):
            return fallback
        return number if math.isfinite(number) else fallback

    def token(self, attribute: Any) -> str:
        """A token or string; empty where there is none."""
        value = self.value(attribute)
        return value if isinstance(value, str) else ""

    def vector(self, attribute: Any, width: int, report: Report) -> tuple[float, ...] | None:
        """`width` numbers, or None for whatever is not that (reported) or not there."""
        value = self.value(attribute)
        array = numbers(value)
        if array is not None and array.shape == (width,):
            return tuple(float(number) for number in array)
        if value is not None:
            message = f"`{attribute.GetName()}` is not of its type, and is not used"
            report.add("usd-attribute", message, attribute.GetPrim().GetPath())
        return None

    def vectors(self, attribute: Any, width: int) -> FloatArray | None:
        """`(n, width)` float64, or None for whatever is not an array of such vectors."""
        array = self.as_authored(attribute, width)
        return None if array is None else np.ascontiguousarray(array, dtype=np.float64)

    def as_authored(self, attribute: Any, width: int) -> NDArray[Any] | None:
        """The same in the type that was authored, which is shared with usd-core: not copied."""
        return rows(self.value(attribute), width)

    def integers(self, attribute: Any) -> IntArray | None:
        """`(n,)` int64, or None for whatever is not an array of integers."""
        array = self.integers_as_authored(attribute)
        return None if array is None else array.astype(np.int64)

    def integers_as_authored(self, attribute: Any) -> NDArray[np.integer] | None:
        """The same in the type that was authored, which is shared with usd-core: not copied."""
        return integers(self.value(attribute))


def rows(value: Any, width: int) -> NDArray[Any] | None:
    """A value of USD as numbers `(n, width)`; None for what is not that."""
    array = numbers(value)
    return None if array is None or array.ndim != 2 or array.shape[1] != width else array


def integers(value: Any) -> NDArray[np.integer] | None:
    """A value of USD as integers `(n,)`; None for what is not that."""
    array = numbers(value)
    return None if array is None or array.ndim != 1 or array.dtype.kind not in "iu" else array


def numbers(value: Any) -> NDArray[Any] | None:
    """A value of USD as an array of integers or floats; None for what is neither."""
    if value is None or isinstance(value, str):
        return None
    try:
        array = np.asarray(value)
    except (TypeError, ValueError):
        return None
    return array if array.dtype.kind in "iuf" else None
