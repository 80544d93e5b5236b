"""`ovolo render`."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from decimal import Decimal
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING

from compiler.compilation import Compilation, Time
from compiler.ir import INTEGRATORS, PRECISIONS
from dsl.diagnostics import Diagnostic
from ovolo.commands.reading import add_bounds, add_reading, read_scene
from ovolo.exits import Exit, StopError
from ovolo.frames import numbered, parse_frames
from ovolo.terminal import print_diagnostics, print_json

if TYPE_CHECKING:
    from ovolo.scene import Scene
    from runtime.film import Film

THUMBNAIL = 320
"""Pixels across a picture of a contact sheet, at most."""


def configure(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument("scene", type=Path, metavar="SCENE", help=".ovo or USD file")
    parser.add_argument(
        "-o",
        "--output",
        type=Path,
        action="append",
        metavar="PATH",
        help="picture to write: .png, .jpg or .exr (with depth, normals and instance numbers); "
        "may be given several times; default: what a stage's render product is called if that is "
        "a picture in this folder, or the scene's name with .png, here",
    )
    parser.add_argument("--width", "--imageWidth", type=int, metavar="PIXELS")
    parser.add_argument("--height", type=int, metavar="PIXELS")
    parser.add_argument("--samples", type=int, metavar="N", help="camera rays per pixel")
    parser.add_argument("--camera", metavar="NAME", help="name or number of a camera of the scene")
    parser.add_argument("--integrator", choices=INTEGRATORS, help="what a pixel shows")
    parser.add_argument("--precision", choices=PRECISIONS, help="scalar of the intersectors")
    add_reading(parser)
    add_bounds(parser)
    parser.add_argument(
        "--frames",
        type=_frames,
        metavar="FIRST:LAST[xSTEP]",
        help="a sequence: a picture for each of these times; #### in a picture's name is the frame",
    )
    parser.add_argument(
        "--contact-sheet", type=Path, metavar="PATH", help="all frames as small pictures in one"
    )
    parser.add_argument("--seed", type=int, default=0, help="of the sampling; default 0")
    parser.add_argument("--threads", type=int, default=0, metavar="N", help="default: all cores")
    parser.add_argument("--quiet", action="store_true", help="say nothing but errors")
    parser.add_argument("--json", action="store_true", help="print the statistics as JSON")


def _frames(text: str) -> list[Decimal]:
    try:
        return parse_frames(text)
    except ValueError as error:
        raise argparse.ArgumentTypeError(str(error)) from None


def run(arguments: argparse.Namespace) -> Exit:
    """Render every frame, write every picture asked for, and say what it took."""
    from ovolo.scene import Scene
    from runtime.contact_sheet import contact_sheet, thumbnail
    from runtime.film import ImageError, check_path

    sheet = [] if arguments.contact_sheet is None else [arguments.contact_sheet]
    try:
        for output in [*(arguments.output or []), *sheet]:
            check_path(output)
    except ImageError as error:
        raise StopError(Exit.FILES, str(error)) from None
    told: set[Diagnostic] = set()
    figures: list[dict[str, object]] = []
    small: list[Film] = []
    names: list[Sequence[Path]] = []
    for number, time in enumerate(_times(arguments)):
        start = perf_counter()
        scene = read_scene(arguments, time=time)
        if not names:
            names = _names(arguments, arguments.output or [_output(scene, arguments.scene)])
        film, figure = _render(arguments, Scene(scene), time, names[number], sheet, told, start)
        figures.append(figure)
        if sheet:
            small.append(thumbnail(film, THUMBNAIL))
    if sheet:
        _save(contact_sheet(small), sheet)
    if arguments.json:
        print_json(figures[0] if arguments.frames is None else figures)
    return Exit.OK


def _times(arguments: argparse.Namespace) -> list[Time]:
    """The time of each picture."""
    if arguments.frames is None:
        return [arguments.time]
    if arguments.time is not None:
        raise StopError(Exit.USAGE, "`--time` and `--frames` exclude each other")
    return [float(frame) for frame in arguments.frames]


def _names(arguments: argparse.Namespace, outputs: Sequence[Path]) -> list[Sequence[Path]]:
    """The names of each picture."""
    if arguments.frames is None:
        return [outputs]
    names = zip(*(numbered(output, arguments.frames) for output in outputs), strict=True)
    return [*names]


def _output(scene: Compilation, path: Path) -> Path:
    """Where the picture goes if nobody says: to what a stage calls it, or is called itself.

    A stage may come from a stranger: what it names lies in this folder, and is a picture.
    """
    from runtime.film import ImageError, check_path

    name = Path(scene.product or "")
    if scene.product and not name.is_absolute() and ".." not in name.parts:
        try:
            check_path(name)
        except ImageError:
            pass
        else:
            return name
    return Path(f"{path.stem or 'scene'}.png")


def _render(
    arguments: argparse.Namespace,
    scene: Scene,
    time: Time,
    outputs: Sequence[Path],
    sheet: Sequence[Path],
    told: set[Diagnostic],
    start: float,
) -> tuple[Film, dict[str, object]]:
    """One picture, under all its names, and its figures since `start`; warnings are `told` once.

    What the outputs and a contact sheet do not show is not rendered.
    """
    from ovolo.progress import progress_bar
    from runtime.film import shows_surfaces

    compiled = perf_counter()
    if not arguments.quiet:
        print_diagnostics([warning for warning in scene.warnings if warning not in told])
        told.update(scene.warnings)
    with progress_bar(not arguments.quiet) as progress:
        try:
            film = scene.render(
                width=arguments.width,
                height=arguments.height,
                samples=arguments.samples,
                camera=arguments.camera,
                integrator=arguments.integrator,
                precision=arguments.precision,
                seed=arguments.seed,
                threads=arguments.threads,
                progress=progress,
                surfaces=any(map(shows_surfaces, (*outputs, *sheet))),
            )
        except ValueError as error:
            raise StopError(Exit.USAGE, str(error)) from None
    if not arguments.quiet:
        # What an importer has not found, it has said by the same words, with its prims.
        said = tuple(warning.message for warning in told)
        untold = [w for w in film.warnings if not any(s.startswith(w.message) for s in said)]
        print_diagnostics(untold)
        told.update(film.warnings)
    _save(film, outputs)
    seconds = perf_counter() - start
    if not arguments.quiet and not arguments.json:
        print(
            f"{', '.join(map(str, outputs))}: {film.width} × {film.height} pixels, "
            f"{film.samples} spp, {film.rays / 1e6:.3g} Mrays in {film.seconds:.2f} s "
            f"({film.rays / 1e6 / film.seconds:.3g} Mrays/s), {seconds:.2f} s in all"
        )
    return film, {
        "outputs": [str(output) for output in outputs],
        "time": time,
        "width": film.width,
        "height": film.height,
        "samples": film.samples,
        "integrator": film.integrator,
        "rays": film.rays,
        "compile_seconds": compiled - start,
        "build_seconds": film.build_seconds,
        "render_seconds": film.seconds,
        "seconds": seconds,
        "warnings": len(scene.warnings) + len(film.warnings),
    }


def _save(film: Film, outputs: Sequence[Path]) -> None:
    from runtime.film import ImageError

    try:
        for output in outputs:
            film.save(output)
    except ImageError as error:
        raise StopError(Exit.FILES, str(error)) from None
