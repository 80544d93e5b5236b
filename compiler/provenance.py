"""Where instances come from: object paths and places in the source, written and read."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from compiler.ir import COUNTED, ORIGIN, SceneIR, leaf_counts
from dsl.records import value
from dsl.scene import Origin
from dsl.spans import Place, PrimPlace, Source, Span


@dataclass(slots=True)
class Texts:
    """Distinct texts, numbered as they come."""

    numbers: dict[str, int] = field(default_factory=dict)

    def index(self, text: str) -> int:
        """The number of `text`, a new one if need be."""
        return self.numbers.setdefault(text, len(self.numbers))

    def arrays(self) -> tuple[NDArray[np.int64], NDArray[np.uint8]]:
        """`text_ends` and `text_bytes` of an IR."""
        # Surrogates come from file names that are not UTF-8.
        encoded = [text.encode("utf-8", "replace") for text in self.numbers]
        ends = np.cumsum([len(text) for text in encoded], dtype=np.int64)
        return ends, np.frombuffer(b"".join(encoded), dtype=np.uint8)


@dataclass(slots=True)
class Origins:
    """Distinct origins (place, label, kind), numbered as they come."""

    numbers: dict[tuple[str, str | None, int, int, str, bool], int] = field(default_factory=dict)
    places: list[Place] = field(default_factory=list)

    def index(self, origin: Origin) -> int:
        """The number of `origin`, whatever its index among siblings."""
        key: tuple[str, str | None, int, int, str, bool]
        place = origin.place
        if isinstance(place, Span):
            key = (place.source.name, None, place.start, place.end, origin.label, origin.point)
        else:
            key = (place.stage, place.prim, 0, 0, origin.label, origin.point)
        number = self.numbers.setdefault(key, len(self.numbers))
        if number == len(self.places):
            self.places.append(origin.place)
        return number

    def labelled(self) -> list[bool]:
        """Whether each origin has a label."""
        return [bool(label) for *_, label, _ in self.numbers]

    def table(self, used: NDArray[np.int64], texts: Texts) -> NDArray[np.void]:
        """The `origins` of an IR: those numbered in `used`, in that order."""
        keys = list(self.numbers)
        rows = [
            (
                texts.index(name),
                -1 if prim is None else texts.index(prim),
                start,
                end,
                texts.index(label),
                point,
            )
            for name, prim, start, end, label, point in map(keys.__getitem__, used.tolist())
        ]
        return np.array(rows, dtype=ORIGIN)


@value
class _Segment:
    origin: int
    index: int


def object_path(ir: SceneIR, leaf: int) -> str:
    """The path of a leaf by the rules of `dsl.scene.Origin`; IndexError if there is no such leaf.

    From the root: `dome[3]/course/block[7]`; then the point instancers, innermost first:
    `/Forest/Tree/leaf@/World/Trees[12]`.
    """
    path, points, stage = "", "", None
    for segment in _segments(ir, leaf):
        origin = ir.origins[segment.origin]
        label = ir.text(int(origin["label"]))
        if not label:
            continue
        if label.startswith("/") and stage is None:
            stage = path
        if label.startswith("//"):
            path, label = stage or "", label[1:]
        words = label if segment.index < 0 else f"{label}[{segment.index}]"
        if origin["point"]:
            # The instancer's own path is relative to the native instances around it.
            points = f"@{path}{words}{points}"
        else:
            path += words if not path or words.startswith("/") else f"/{words}"
    return path + points


def source_place(ir: SceneIR, leaf: int, sources: Mapping[str, str]) -> Place | None:
    """The place that made a leaf: where the innermost part of its path with a name was emitted.

    A shape that was named first is made where the name is used, not where it is defined.
    `sources` maps the names of source files to their texts (`SceneGraph.sources`).
    """
    segments = list(_segments(ir, leaf))
    if not segments:
        return None
    named = [s for s in segments if ir.text(int(ir.origins[s.origin]["label"]))]
    origin = ir.origins[(named or segments)[-1].origin]
    name = ir.text(int(origin["file"]))
    if origin["prim"] >= 0:
        return PrimPlace(name, ir.text(int(origin["prim"])))
    return Span(Source(name, sources.get(name, "")), int(origin["start"]), int(origin["end"]))


def _segments(ir: SceneIR, leaf: int) -> Iterator[_Segment]:
    """All segments of a leaf's path, from the root."""
    for group, row in _rows(ir, leaf):
        source = int(ir.instance_source[row])
        chain = []
        segment = source
        while segment >= 0:
            index = int(ir.source_index[segment])
            if index == COUNTED:
                first = int(ir.group_ranges[group, 0])
                index = row - first - int(np.argmax(ir.instance_source[first : row + 1] == source))
            chain.append(_Segment(int(ir.source_origin[segment]), index))
            segment = int(ir.source_parent[segment])
        yield from reversed(chain)


def _rows(ir: SceneIR, leaf: int) -> Iterator[tuple[int, int]]:
    """The (group, instance) on the way from the root to a leaf."""
    counts = leaf_counts(ir)
    if not 0 <= leaf < counts[0]:
        raise IndexError(f"the scene has {counts[0]} instances, there is no instance {leaf}")
    group = 0
    while True:
        first, end = (int(v) for v in ir.group_ranges[group])
        target = ir.instance_target[first:end]
        ends = np.cumsum(np.where(target < 0, counts[np.where(target < 0, ~target, 0)], 1))
        row = int(np.searchsorted(ends, leaf, side="right"))
        yield group, first + row
        if target[row] >= 0:
            return
        leaf -= int(ends[row - 1]) if row else 0
        group = int(~target[row])
