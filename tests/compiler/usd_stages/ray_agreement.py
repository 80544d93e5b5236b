"""Whether rays against an imported stage hit what the oracle says."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from compiler.flatten import flatten
from compiler.ir import SceneIR
from compiler.provenance import object_path
from compiler.usd import StageOptions, import_stage
from dsl.diagnostics import Diagnostic
from dsl.scene import File, Node
from runtime.tracer import Tracer
from tests.compiler.usd_stages.oracle import Array, Piece, pieces

TOLERANCE = 1e-5
"""Of the stage's size."""


def no_files(_: File) -> tuple[Node | None, list[Diagnostic]]:
    raise AssertionError


def compiled(
    path: Path,
    *,
    time: Any = None,
    options: StageOptions = StageOptions(),  # noqa: B008  (frozen)
) -> tuple[SceneIR, list[Diagnostic]]:
    """The flat scene of a stage."""
    graph, diagnostics = import_stage(path, time=time, options=options)
    scene, _, _ = flatten(graph, no_files)
    assert scene is not None
    return scene, diagnostics


def bounds(shown: list[Piece]) -> Array:
    points = np.concatenate([piece.points() for piece in shown])
    return np.array([points.min(axis=0), points.max(axis=0)])


def rays(shown: list[Piece], count: int, seed: int = 7) -> tuple[Array, Array]:
    """From around and within a stage towards its parts; directions are not unit."""
    random = np.random.default_rng(seed)
    low, high = bounds(shown)
    size = max((high - low).max(), 1e-300)
    around = random.normal(size=(count, 3))
    origins = (low + high) / 2.0 + size * around / np.linalg.norm(around, axis=1, keepdims=True)
    inner = random.random(count) < 0.2
    origins[inner] = random.uniform(low, high, (count, 3))[inner]
    boxes = np.array([[p.points().min(axis=0), p.points().max(axis=0)] for p in shown])
    chosen = boxes[random.integers(0, len(shown), count)]
    targets = random.uniform(chosen[:, 0], chosen[:, 1])
    return origins, (targets - origins) * random.uniform(0.1, 10.0, (count, 1))


def agree(
    path: Path,
    shown: list[Piece],
    *,
    time: Any = "earliest",
    precision: Any = "float64",
    count: int = 300,
    least: float = 0.05,
    **choices: Any,
) -> None:
    """Rays hit at the distance, with the normal and path that the oracle says.

    Rays that a shift by 1e-6 of the stage's size lets hit something else, or elsewhere, prove
    nothing and are left out.
    """
    options = StageOptions(**{"complexity": "low", **choices})
    ir, _ = compiled(path, time=time, options=options)
    if not shown:
        assert not len(ir.instance_target)
        return
    origins, directions = rays(shown, count)
    size = np.ptp(bounds(shown), axis=0).max() / np.linalg.norm(directions, axis=1)
    t, normals, own = nearest(shown, origins, directions)
    clear = np.ones(count, bool)
    random = np.random.default_rng(1)
    for _ in range(4):
        shift = random.normal(size=(count, 3))
        shift *= 1e-6 * np.ptp(bounds(shown), axis=0).max()
        near, turned, _ = nearest(shown, origins + shift, directions)
        with np.errstate(invalid="ignore"):
            clear &= (np.isfinite(t) == np.isfinite(near)) & ~(np.abs(t - near) > 2e-5 * size)
            clear &= ~((normals * turned).sum(axis=1) < 1.0 - 1e-6) | ~np.isfinite(t)
    hits = Tracer(ir, precision=precision).trace(origins, directions)
    wrong = clear & (np.isfinite(t) != hits.hit)
    assert not wrong.any(), _told(wrong, t, own, hits, ir, shown)
    hit = clear & hits.hit
    assert hit.sum() >= least * count
    facets = np.array([piece.facets for piece in shown])[np.argmin(own, axis=0)]
    allowed = TOLERANCE * size * np.where(facets, 10.0, 1.0)
    with np.errstate(invalid="ignore"):
        far = hit & ~(np.abs(hits.t - t) <= allowed)
    assert not far.any(), _told(far, t, own, hits, ir, shown)
    for row in np.flatnonzero(hit):
        # Of surfaces at the same place either may be named.
        same = [
            shown[i].path for i in np.flatnonzero(np.abs(own[:, row] - t[row]) <= 2 * allowed[row])
        ]
        found = object_path(ir, int(hits.instance[row]))
        assert found in same, (found, same)
        if len(same) == 1:
            cosine = normals[row] @ hits.normal[row]
            assert cosine > 1.0 - (1e-3 if facets[row] else 1e-5), (same, cosine)


def nearest(shown: list[Piece], origins: Array, directions: Array) -> tuple[Array, Array, Array]:
    """Of each ray the nearest distance `(n,)`, its normal `(n, 3)`, and distances `(p, n)`."""
    found = [piece.hit(origins, directions) for piece in shown]
    own = np.array([t for t, _ in found])
    best = np.argmin(own, axis=0)
    rows = np.arange(len(origins))
    return own[best, rows], np.array([n for _, n in found])[best, rows], own


def _told(
    rows: NDArray[np.bool_], t: Array, own: Array, hits: Any, ir: Any, shown: list[Piece]
) -> str:
    lines = []
    for row in np.flatnonzero(rows)[:5]:
        expected = shown[int(np.argmin(own[:, row]))].path if np.isfinite(t[row]) else "nothing"
        found = object_path(ir, int(hits.instance[row])) if hits.hit[row] else "nothing"
        lines.append(f"{expected} at {t[row]}, but {found} at {hits.t[row]}")
    return "\n".join(lines)


def stage_agrees(path: Path, *, time: Any = None, **choices: Any) -> list[Piece]:
    """Judge a stage at a time code, or at its earliest; returns what it shows."""
    shown = pieces(path, time)
    agree(path, shown, time="earliest" if time is None else time, **choices)
    return shown
