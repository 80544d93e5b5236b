"""From a flat scene and a few wishes to a picture."""

from __future__ import annotations

import math
from collections.abc import Callable
from time import perf_counter
from typing import TYPE_CHECKING, TypeVar, get_args

import numpy as np

from compiler.ir import UP_AXES, SceneIR
from dsl.observation import stage
from dsl.scene import Integrator, Precision
from runtime._kernel import Kernel
from runtime.camera import choose_camera, default_camera
from runtime.film import Film, SurfaceImages
from runtime.tracer import MAX_THREADS

if TYPE_CHECKING:
    from pathlib import Path

    from runtime.textures import Images

DEFAULT_WIDTH, DEFAULT_HEIGHT = 640, 480
DEFAULT_SAMPLES = 16
DEFAULT_INTEGRATOR: Integrator = "direct"
DEFAULT_PRECISION: Precision = "float32"

MAX_SIDE = 1 << 16
MAX_PIXELS = 1 << 26
MAX_CAMERA_RAYS = 1 << 40
MAX_SAMPLES = 1 << 16

_COLOR_BYTES = 20
"""Of a pixel's color and error."""
_SURFACE_BYTES = 24
"""Of a pixel's depth, normal and instance."""

Name = TypeVar("Name", bound=str)


def render(
    ir: SceneIR,
    *,
    width: int | None = None,
    height: int | None = None,
    samples: int | None = None,
    camera: str | int | None = None,
    integrator: Integrator | None = None,
    precision: Precision | None = None,
    threads: int = 0,
    seed: int = 0,
    progress: Callable[[float, int], object] | None = None,
    isa: str | None = None,
    max_pixels: int = MAX_PIXELS,
    max_camera_rays: int = MAX_CAMERA_RAYS,
    root: Path | None = None,
    surfaces: bool = True,
) -> Film:
    """A picture of the scene.

    What is None is as the scene's settings say, or else as the defaults above; if only one of
    `width` and `height` is given, the other keeps the proportions. `camera` is a name or a
    number; None takes the first camera, or `runtime.camera.default_camera` where the scene has
    none. `integrator`:

    - "direct": light from suns, points, surfaces and the sky with shadows, and highlights, on
      surfaces with their textures and shading normals; a scene where nothing shines or glows is
      lit by a sun over the camera's left shoulder and a dim, invisible sky
    - "ambient_occlusion": how much of the hemisphere above a surface is open, up to the scene's
      `occlusion_distance`; white is open. `samples` counts occlusion rays per pixel; at most 16
      camera rays share them
    - "normals": 0.5 + 0.5 n of the outward normal n
    - "ids": a colour for each instance

    `threads` 0 takes all cores; `seed` chooses the sample points; `isa` is one of
    `runtime._kernel.instruction_sets()`. Neither threads nor isa change the picture. Names of
    textures start from the folder `root`, None: the current one. Without `surfaces` the film has
    no depth, normal and instance images, and takes less time and memory.

    `progress(done, rays)` is called some 20 times a second with the fraction done and the rays
    traced; what it raises, or KeyboardInterrupt, ends the render at once.
    Raises ValueError for settings out of range, naming the limit; so for more than `max_pixels`,
    or pixels × samples than `max_camera_rays`, wherever they come from. Raises MemoryError where
    there is none for the picture.
    """
    settings = ir.settings[0]
    record = choose_camera(ir, camera)
    aspect = math.nan if record is None else float(record["aspect"])
    width, height = _size(width, height, (int(settings["width"]), int(settings["height"])), aspect)
    samples = samples if samples is not None else int(settings["samples"]) or DEFAULT_SAMPLES
    _check("samples", samples, 1, MAX_SAMPLES)
    _at_most(f"{width} × {height} pixels", width * height, max_pixels)
    _at_most(
        f"{width} × {height} pixels × {samples} samples",
        width * height * samples,
        max_camera_rays,
    )
    _check("threads", threads, 0, MAX_THREADS)
    _check("seed", seed, 0, (1 << 64) - 1)
    said = int(settings["integrator"])
    integrator = _choice("integrator", integrator, get_args(Integrator), said, DEFAULT_INTEGRATOR)
    said = int(settings["precision"])
    precision = _choice("precision", precision, get_args(Precision), said, DEFAULT_PRECISION)
    reach = float(settings["occlusion_distance"])
    exposure = float(np.nan_to_num(settings["exposure"]))
    exposure += 0.0 if record is None else float(record["exposure"])

    start = perf_counter()
    with stage("build"):
        images = _images(ir, root) if integrator == "direct" else None
        kernel = Kernel(ir, precision, isa, *(images[:2] if images else ()))
        if record is None:
            record = default_camera(kernel.bounds, UP_AXES[settings["up"]], width / height)
    built = perf_counter()
    with stage("render"):
        # The kernel ends the process where memory is refused: whether it is, is found out here.
        pixel_bytes = _COLOR_BYTES + (_SURFACE_BYTES if surfaces else 0)
        np.empty(width * height * pixel_bytes, np.uint8)
        layers = kernel.render(
            record,
            width,
            height,
            samples,
            integrator,
            math.inf if math.isnan(reach) else reach,
            seed,
            threads,
            progress,
            surfaces,
        )
    return Film(
        color=layers["color"],
        error=layers["error"],
        surfaces=SurfaceImages(layers["depth"], layers["normal"], layers["instance"])
        if surfaces
        else None,
        integrator=integrator,
        exposure=exposure,
        samples=samples,
        rays=int(layers["rays"]),
        seconds=perf_counter() - built,
        build_seconds=built - start,
        warnings=tuple(images.warnings) if images else (),
    )


def _images(ir: SceneIR, root: Path | None) -> Images | None:
    """The pictures that the scene names, if it names any."""
    if not len(ir.textures) and not ir.lights["file"].any():
        return None
    from runtime.textures import load_images

    return load_images(ir, root)


def _size(
    width: int | None, height: int | None, said: tuple[int, int], aspect: float
) -> tuple[int, int]:
    """Width and height, from what is given, what the scene says and the camera's aspect."""
    natural_width = said[0] or DEFAULT_WIDTH
    natural_height = said[1] or DEFAULT_HEIGHT
    if not said[0] and not said[1] and aspect > 0:
        natural_height = max(1, round(min(natural_width / aspect, MAX_SIDE)))
    if width is None and height is None:
        width, height = natural_width, natural_height
    elif height is None:
        assert width is not None
        height = max(1, round(min(width, MAX_SIDE) * natural_height / natural_width))
    elif width is None:
        width = max(1, round(min(height, MAX_SIDE) * natural_width / natural_height))
    assert width is not None
    _check("width", width, 1, MAX_SIDE)
    _check("height", height, 1, MAX_SIDE)
    return width, height


def _check(name: str, value: int, lower: int, upper: int) -> None:
    if not lower <= value <= upper:
        raise ValueError(f"{name} is {value}, which is not in {lower} … {upper}")


def _at_most(words: str, amount: int, limit: int) -> None:
    if amount > limit:
        raise ValueError(f"{words} are more than the limit of {limit:,}")


def _choice(
    name: str, given: Name | None, choices: tuple[Name, ...], said: int, default: Name
) -> Name:
    """What is given, or what the scene says (an index, -1: nothing), or the default."""
    if given is None:
        return choices[said] if said >= 0 else default
    if given not in choices:
        raise ValueError(f"{name} {given!r} is none of {', '.join(choices)}")
    return given
