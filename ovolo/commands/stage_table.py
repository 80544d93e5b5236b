"""What a USD stage holds, for people to read."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any


def print_stage(stage: dict[str, Any]) -> None:
    """Print a stage's metadata, then its prims by type: there, drawn, and why not."""
    for title, words in _lines(stage):
        print(f"{title:<12}{words}")
    types = stage["types"]
    width = max(12, *(len(kind) + 2 for kind in types)) if types else 12
    print(f"\n{'type':<{width}}{'there':>9}{'drawn':>9}  not drawn")
    for kind, counts in types.items():
        why = [
            f"{count:,} {reason}"
            for reason, count in sorted(counts.items())
            if reason not in ("there", "drawn")
        ]
        # What has no shape is neither drawn nor not.
        shown = f"{counts.get('drawn', 0):,}" if why or "drawn" in counts else ""
        print(f"{kind:<{width}}{counts['there']:>9,}{shown:>9}  {', '.join(why)}".rstrip())


def _lines(stage: dict[str, Any]) -> Iterator[tuple[str, str]]:
    words = [f"{stage['up']} up", f"{stage['meters_per_unit']:g} m per unit"]
    if stage["time_codes"]:
        first, last = stage["time_codes"]
        rate = stage["time_codes_per_second"]
        words.append(f"time codes {first:g} … {last:g}, {rate:g} per second")
    if stage["default_prim"]:
        words.append(f"default prim {stage['default_prim']}")
    yield "stage", ", ".join(words)
    yield "layers", _listed(stage["layers"], stage["layer_names"])
    yield "prims", f"{stage['prims']:,}"
    if stage["native_instances"]:
        prototypes = stage["native_prototypes"]
        yield "native", f"{stage['native_instances']:,} instances of {prototypes:,} prototypes"
    if stage["cameras"]:
        yield "cameras", _listed(stage["cameras"], stage["camera_paths"])
    for selection, names in stage["variants"].items():
        yield "variant", f"{selection} of {', '.join(names)}"


def _listed(count: int, names: list[str]) -> str:
    more = ["…"] if count > len(names) else []
    return f"{count:,}: {', '.join([*names, *more])}"
