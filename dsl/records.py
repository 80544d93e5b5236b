"""Classes of records that are made in great numbers: syntax trees, places, values, scene graphs."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeVar, dataclass_transform

_Class = TypeVar("_Class")


@dataclass_transform(frozen_default=True, eq_default=False)
def node(cls: type[_Class]) -> type[_Class]:
    """A record with identity.

    The type checker holds it frozen; at run time that would make each of them three times as slow.
    """
    return dataclass(slots=True, eq=False)(cls)


@dataclass_transform(frozen_default=True)
def value(cls: type[_Class]) -> type[_Class]:
    """A record that equals others with equal fields, frozen as a `node` is."""
    make: Callable[[type[_Class]], type[_Class]] = dataclass(slots=True, unsafe_hash=True)
    return make(cls)
