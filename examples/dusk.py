"""Writes `dusk.exr`, the sky of `dusk.ovo`: radiance by latitude and longitude, as OpenEXR has it.

A clear evening by rough formulas: blue above, a warm glow around a low sun, thin clouds, and dull
ground. Run it as `python examples/dusk.py`.
"""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

Numbers = NDArray[np.float64]

WIDTH, HEIGHT = 1024, 512
SUN_LONGITUDE, SUN_LATITUDE = math.radians(128.0), math.radians(11.0)
SUN_RADIUS = math.radians(1.2)
"""Larger than the real one, so that it has a few texels."""


def sky() -> Numbers:
    """Texels `(HEIGHT, WIDTH, 3)`, linear Rec. 709."""
    latitude = math.pi * (0.5 - (np.arange(HEIGHT) + 0.5) / HEIGHT)[:, None]
    longitude = math.pi * (1.0 - 2.0 * (np.arange(WIDTH) + 0.5) / WIDTH)[None, :]
    up = np.sin(latitude) + 0.0 * longitude
    to_sun = np.sin(latitude) * math.sin(SUN_LATITUDE) + np.cos(latitude) * math.cos(
        SUN_LATITUDE
    ) * np.cos(longitude - SUN_LONGITUDE)
    apart = np.arccos(np.clip(to_sun, -1.0, 1.0))
    low = np.exp(-4.0 * np.maximum(up, 0.0))[..., None]
    glow = np.exp(-2.2 * apart)[..., None]
    blue, pale, warm = ((0.10, 0.20, 0.45), (0.55, 0.55, 0.55), (2.6, 1.15, 0.35))
    radiance = np.array(blue) * (1.0 - low) + np.array(pale) * low
    radiance = radiance + np.array(warm) * glow * (0.25 + 0.75 * low)
    cover = _clouds(up, longitude)[..., None]
    lit = np.array((0.55, 0.5, 0.55)) + np.array((3.2, 1.5, 0.7)) * glow
    radiance = radiance * (1.0 - cover) + lit * cover
    disc = np.clip((SUN_RADIUS - apart) / (0.2 * SUN_RADIUS) + 0.5, 0.0, 1.0)[..., None]
    radiance = radiance + np.array((2400.0, 1250.0, 480.0)) * disc * (1.0 - 0.7 * cover)
    ground = np.array((0.11, 0.09, 0.075)) * (1.0 + 1.5 * glow)
    above = np.clip(0.5 + up * HEIGHT / math.pi, 0.0, 1.0)[..., None]
    return ground * (1.0 - above) + radiance * above


def _clouds(up: Numbers, longitude: Numbers) -> Numbers:
    """How much of a flat layer of clouds covers each texel."""
    height = np.maximum(up, 0.03)
    across = np.sqrt(1.0 - up**2) / height
    x, z = across * np.sin(longitude), across * np.cos(longitude)
    noise = sum(0.5**k * _noise(0.35 * 2.0**k * x, 0.9 * 2.0**k * z, k) for k in range(6))
    cover = np.clip(1.6 * (noise - 0.98), 0.0, 1.0)
    return 0.8 * cover * np.clip((up - 0.03) / 0.12, 0.0, 1.0)


def _noise(x: Numbers, y: Numbers, seed: int) -> Numbers:
    """Smooth noise in 0 … 1, from random numbers at whole coordinates."""
    table = np.random.default_rng(seed).uniform(size=(64, 64))
    column, row = np.floor(x), np.floor(y)
    u, v = (t * t * (3.0 - 2.0 * t) for t in (x - column, y - row))
    i, j = (np.mod(c.astype(np.int64), 64) for c in (column, row))
    i1, j1 = (i + 1) % 64, (j + 1) % 64
    upper = table[j, i] * (1.0 - u) + table[j, i1] * u
    lower = table[j1, i] * (1.0 - u) + table[j1, i1] * u
    result: Numbers = upper * (1.0 - v) + lower * v
    return result


def main() -> None:
    """Write the picture beside this file."""
    import OpenImageIO as oiio  # noqa: N813

    path = str(Path(__file__).with_suffix(".exr"))
    spec = oiio.ImageSpec(WIDTH, HEIGHT, 3, "half")
    spec.attribute("compression", "dwaa:60")
    output = oiio.ImageOutput.create(path)
    assert output is not None
    output.open(path, spec)
    output.write_image(sky().astype(np.float32))
    output.close()


if __name__ == "__main__":
    main()
