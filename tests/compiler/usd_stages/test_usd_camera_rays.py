"""What a stage's cameras see, against usd-core's own frustum."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import ovolo

Array = NDArray[np.float64]
WIDTH, HEIGHT = 24, 16
BALLS = 40


def _stage(seed: int, path: Path) -> tuple[Any, Array]:
    """Random balls `(n, 4)`, position and radius, before a random camera, and its frustum."""
    from pxr import Gf, Usd, UsdGeom

    random = np.random.default_rng(seed)
    stage = Usd.Stage.CreateNew(str(path))
    rig = UsdGeom.Xform.Define(stage, "/rig")
    rig.AddRotateXYZOp().Set(Gf.Vec3f(*random.uniform(-180.0, 180.0, 3).tolist()))
    camera = UsdGeom.Camera.Define(stage, "/rig/camera")
    camera.AddTranslateOp().Set(Gf.Vec3d(*random.uniform(-5.0, 5.0, 3).tolist()))
    camera.AddRotateYOp().Set(float(random.uniform(-180.0, 180.0)))
    flat = seed % 3 == 0
    camera.CreateProjectionAttr("orthographic" if flat else "perspective")
    aperture = float(random.uniform(100.0, 300.0) if flat else random.uniform(20.0, 60.0))
    camera.CreateHorizontalApertureAttr(aperture)
    camera.CreateVerticalApertureAttr(aperture * HEIGHT / WIDTH)
    camera.CreateHorizontalApertureOffsetAttr(float(random.uniform(-0.3, 0.3)) * aperture)
    camera.CreateVerticalApertureOffsetAttr(float(random.uniform(-0.3, 0.3)) * aperture)
    camera.CreateFocalLengthAttr(float(random.uniform(15.0, 80.0)))
    camera.CreateClippingRangeAttr(Gf.Vec2f(float(random.uniform(1.0, 8.0)), 25.0))
    frustum = camera.GetCamera(0).frustum
    balls = np.empty((BALLS, 4))
    for number in range(BALLS):
        ray = frustum.ComputePickRay(Gf.Vec2d(*random.uniform(-1.1, 1.1, 2).tolist()))
        place = ray.startPoint + ray.direction * float(random.uniform(-3.0, 30.0))
        ball = UsdGeom.Sphere.Define(stage, f"/ball{number}")
        ball.AddTranslateOp().Set(place)
        ball.CreateRadiusAttr(float(random.uniform(0.3, 2.0)))
        balls[number] = *place, ball.GetRadiusAttr().Get()
    stage.Save()
    return frustum, balls


def _seen(frustum: Any, balls: Array, x: float, y: float) -> tuple[str, float]:
    """The ball that a point of the window shows, and how deep it is, by usd-core's ray."""
    from pxr import Gf

    ray = frustum.ComputePickRay(Gf.Vec2d(x, y))
    start, along = np.array(ray.startPoint), np.array(ray.direction)
    view = np.array(frustum.ComputeViewDirection())
    near, far = frustum.nearFar.min, frustum.nearFar.max
    found = [("", np.inf)]
    for number, (*place, radius) in enumerate(balls):
        o = start - place
        b, c = o @ along, o @ o - radius**2
        if (square := b * b - c) > 0.0:
            for t in (-b - square**0.5, -b + square**0.5):
                depth = (start + t * along - np.array(frustum.position)) @ view
                if near < depth < far:
                    found.append((f"/ball{number}", depth))
    return min(found, key=lambda one: one[1])


@pytest.mark.parametrize("seed", range(6))
def test_pixels_show_what_usd_cores_rays_meet(seed: int, tmp_path: Path) -> None:
    path = tmp_path / "stage.usda"
    frustum, balls = _stage(seed, path)
    scene = ovolo.compile_file(path)
    film = scene.render(width=WIDTH, height=HEIGHT, samples=1, precision="float64")
    same = shown = 0
    for row in range(HEIGHT):
        for column in range(WIDTH):
            x, y = 2.0 * (column + 0.5) / WIDTH - 1.0, 1.0 - 2.0 * (row + 0.5) / HEIGHT
            name, depth = _seen(frustum, balls, x, y)
            instance = int(film.instance[row, column])
            own = scene.object_path(instance) if instance >= 0 else ""
            same += own == name
            if own == name != "":
                shown += 1
                assert abs(film.depth[row, column] - depth) < 2.0
    # Samples lie anywhere in their pixels, so outlines may differ.
    assert same > 0.75 * WIDTH * HEIGHT
    assert shown > 0.05 * WIDTH * HEIGHT
