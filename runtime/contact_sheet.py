"""Several pictures as one."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from runtime.film import Film, SurfaceImages


def thumbnail(film: Film, width: int) -> Film:
    """A picture at most `width` pixels wide: colours are means, the rest is of middle pixels."""
    k = math.ceil(film.width / width)
    if k == 1:
        return film
    height, columns = film.height // k, film.width // k
    if height == 0:
        return film
    color = film.color[: height * k, : columns * k].reshape(height, k, columns, k, 4)
    middle = (slice(k // 2, height * k, k), slice(k // 2, columns * k, k))
    return replace(
        film,
        color=color.mean(axis=(1, 3), dtype=np.float32),
        error=film.error[middle],
        surfaces=film.surfaces
        and SurfaceImages(
            film.depth[middle],
            film.normal[middle],
            film.instance[middle],
        ),
    )


def contact_sheet(films: Sequence[Film]) -> Film:
    """Pictures row by row in one about as wide as high; all take the room of the largest.

    What is not theirs is empty; all have `surfaces`, or the first has none. Raises ValueError where
    there are none.
    """
    if not films:
        raise ValueError("a contact sheet needs a picture")
    height, width = max(f.height for f in films), max(f.width for f in films)
    columns = min(len(films), max(1, round(math.sqrt(len(films) * height / width))))
    rows = math.ceil(len(films) / columns)

    def tiled(name: str, empty: float) -> NDArray[Any]:
        first: NDArray[Any] = getattr(films[0], name)
        sheet = np.full((rows * height, columns * width, *first.shape[2:]), empty, first.dtype)
        for number, film in enumerate(films):
            y, x = number // columns * height, number % columns * width
            sheet[y : y + film.height, x : x + film.width] = getattr(film, name)
        return sheet

    return replace(
        films[0],
        color=tiled("color", 0.0),
        error=tiled("error", math.nan),
        surfaces=films[0].surfaces
        and SurfaceImages(tiled("depth", math.inf), tiled("normal", 0.0), tiled("instance", -1)),
        rays=sum(film.rays for film in films),
        seconds=sum(film.seconds for film in films),
        build_seconds=sum(film.build_seconds for film in films),
    )
