"""Classes of records: syntax trees, places, values, scene graphs, and what compiling passes on.

They are data classes, but for two things that would cost much. Data classes compile a `__repr__`,
`__eq__` and `__hash__` for each class, a quarter of the start of a command: here all classes share
them. And frozen ones take three times as long to make: these are frozen for the type checker only.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from operator import attrgetter
from typing import Any, TypeVar, dataclass_transform

_Class = TypeVar("_Class")


@dataclass_transform(frozen_default=True, eq_default=False)
def node(cls: type[_Class]) -> type[_Class]:
    """A record with identity."""
    return _record(cls)


@dataclass_transform(frozen_default=True)
def value(cls: type[_Class]) -> type[_Class]:
    """A record that equals others with equal fields."""
    made: Any = _record(cls)
    # Records without fields are all equal, as their class is.
    made._fields = attrgetter(*made.__slots__ or ("__class__",))
    made.__eq__, made.__hash__ = _equal, _hash
    record: type[_Class] = made
    return record


def _record(cls: type[_Class]) -> type[_Class]:
    if "__repr__" not in vars(cls):
        cls.__repr__ = _repr  # type: ignore[method-assign]
    return dataclass(slots=True, eq=False, repr=False)(cls)


def _repr(self: Any) -> str:
    values = ", ".join(f"{f.name}={getattr(self, f.name)!r}" for f in fields(self) if f.repr)
    return f"{type(self).__qualname__}({values})"


def _equal(self: Any, other: Any) -> bool:
    return type(other) is type(self) and bool(self._fields(self) == self._fields(other))


def _hash(self: Any) -> int:
    return hash(self._fields(self))
