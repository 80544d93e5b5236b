"""Places in source text, and in USD stages, that nodes and diagnostics point to."""

from __future__ import annotations

from dataclasses import field
from pathlib import PurePath

from dsl.records import value


@value
class Source:
    """One file of source text.

    `name` is what diagnostics print (a path, or the name given to `compile`); `text` is the
    decoded text without a byte-order mark.
    """

    name: str
    text: str = field(repr=False)

    @property
    def folder(self) -> str:
        """The folder from which file names in the text start."""
        return str(PurePath(self.name).parent)

    def encoded(self) -> bytes:
        """The bytes that offsets count; a lone surrogate has three."""
        return self.text.encode("utf-8", "surrogatepass")


@value
class Span:
    """A half-open range `[start, end)` of UTF-8 byte offsets in one source.

    Lines and columns are derived only when a span is shown.
    """

    source: Source
    start: int
    end: int


@value
class PrimPlace:
    """A prim of a USD stage: what a span is for a scene program."""

    stage: str
    prim: str


Place = Span | PrimPlace
