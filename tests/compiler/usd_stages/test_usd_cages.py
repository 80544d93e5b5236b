"""Meshes whose faces are cut together are what each is by itself."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from compiler.compilation import compile_path
from compiler.usd import cages

FAULTS = ("none", "index", "short", "few", "nan", "huge", "empty", "absent", "spare", "large")


def _define(stage: Any, number: int, random: np.random.Generator) -> None:
    """Define a mesh of a few polygons, concave ones among them, that may have a fault."""
    from pxr import UsdGeom, Vt

    mesh = UsdGeom.Mesh.Define(stage, f"/m{number}")
    fault = FAULTS[number % len(FAULTS)]
    faces = 400 if fault == "large" else int(random.integers(1, 6))
    counts = random.integers(3, 8, faces).astype(np.int32)
    angles = np.concatenate([np.arange(n) * (2 * np.pi / n) for n in counts])
    radii = random.uniform(0.2, 1.0, len(angles))
    face = np.repeat(np.arange(faces), counts)
    points = np.stack((radii * np.cos(angles) + 3 * face, radii * np.sin(angles), face), axis=1)
    points = np.asarray(points, np.float32)
    indices = np.arange(len(points), dtype=np.int32)
    if fault == "index":
        indices[1] = len(points)
    elif fault == "short":
        indices = indices[:-1]
    elif fault == "few":
        counts[0] = 2
    elif fault == "nan":
        points[0] = np.nan
    elif fault == "huge":
        points *= np.float32(1e35)
    elif fault == "empty":
        counts = counts[:0]
    elif fault == "spare":
        points = np.concatenate((points, points[:1]))
    mesh.CreateFaceVertexCountsAttr(Vt.IntArray.FromNumpy(counts))
    mesh.CreateFaceVertexIndicesAttr(Vt.IntArray.FromNumpy(indices))
    if fault != "absent":
        mesh.CreatePointsAttr(Vt.Vec3fArray.FromNumpy(points))
    mesh.CreateOrientationAttr(random.choice(("leftHanded", "rightHanded")).item())
    mesh.CreateSubdivisionSchemeAttr(random.choice(("none", "catmullClark")).item())
    mesh.CreateHoleIndicesAttr([0] if random.random() < 0.2 else [])


@pytest.mark.parametrize("batch", [1, 100, cages.BATCH])
def test_meshes_are_the_same_cut_together_and_alone(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, batch: int
) -> None:
    from pxr import Usd

    path = tmp_path / "stage.usdc"
    stage = Usd.Stage.CreateNew(str(path))
    random = np.random.default_rng(batch)
    for number in range(200):
        _define(stage, number, random)
    stage.Save()
    monkeypatch.setattr(cages, "SMALL", 0)
    alone = compile_path(path)
    monkeypatch.setattr(cages, "SMALL", 1024)
    monkeypatch.setattr(cages, "BATCH", batch)
    together = compile_path(path)
    assert len(alone.ir.mesh_points) > 500
    np.testing.assert_array_equal(together.ir.mesh_points, alone.ir.mesh_points)
    np.testing.assert_array_equal(together.ir.mesh_triangles, alone.ir.mesh_triangles)
    np.testing.assert_array_equal(together.ir.prototype_data, alone.ir.prototype_data)
    assert together.warnings == alone.warnings
    assert len(alone.warnings) >= 5
