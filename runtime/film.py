"""Pictures: what a render makes, and how it is written."""

from __future__ import annotations

import errno
import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from dsl.diagnostics import Diagnostic
from dsl.observation import stage
from dsl.scene import Integrator
from dsl.whole_files import replacing
from runtime._kernel import jpeg, png, screen

FORMATS = {"png": "png", "jpg": "jpeg", "jpeg": "jpeg", "exr": "exr"}
"""Formats by extension."""
MAX_JPEG_SIDE = (1 << 16) - 1
IMAGES = ("color", "error", "depth", "normal", "instance")


class ImageError(ValueError):
    """An image that is not there or cannot be written; the message says why and names the mend."""


@dataclass(frozen=True, eq=False, repr=False)
class SurfaceImages:
    """What the sample nearest to each pixel's centre sees first."""

    depth: NDArray[np.float32]  # (h, w) along the viewing axis, inf where nothing is
    normal: NDArray[np.float32]  # (h, w, 3) world space, unit, outward, 0 where nothing is
    instance: NDArray[np.int64]  # (h, w) leaf number or -1


@dataclass(frozen=True, eq=False, repr=False)
class Film:
    """A rendered picture: arrays of `(h, w)` pixels, row 0 at the top."""

    color: NDArray[np.float32]  # (h, w, 4) linear Rec. 709, premultiplied by its fourth: coverage
    error: NDArray[np.float32]  # (h, w) standard error of the luminance; NaN of a single sample
    surfaces: SurfaceImages | None  # None: rendered without
    integrator: Integrator
    exposure: float  # stops: PNG and JPEG show color · 2^exposure
    samples: int
    rays: int  # traced
    seconds: float  # of rendering
    build_seconds: float  # of preparing the scene for it
    warnings: tuple[Diagnostic, ...] = ()  # such as textures that cannot be read

    @property
    def width(self) -> int:
        """Columns."""
        return int(self.color.shape[1])

    @property
    def height(self) -> int:
        """Rows."""
        return int(self.color.shape[0])

    @property
    def depth(self) -> NDArray[np.float32]:
        """Of `surfaces`. Raises ImageError where the film has none, as the next two."""
        return self._surfaces("depth").depth

    @property
    def normal(self) -> NDArray[np.float32]:
        """Of `surfaces`."""
        return self._surfaces("normal").normal

    @property
    def instance(self) -> NDArray[np.int64]:
        """Of `surfaces`."""
        return self._surfaces("instance").instance

    def _surfaces(self, wanted: str) -> SurfaceImages:
        if self.surfaces is None:
            raise ImageError(f"the film has no image {wanted!r}: render with surfaces=True")
        return self.surfaces

    @property
    def pixels(self) -> NDArray[np.uint8]:
        """The picture for a screen: `(h, w, 4)` red, green, blue, coverage, 0 … 255.

        Not premultiplied. Light is exposed, clipped to 1 and encoded by the sRGB curve; the
        integrators "normals" and "ids" show data, which is neither exposed nor encoded.
        """
        return self._shown(self.color)

    def aov(self, name: str) -> NDArray[Any]:
        """An image by name: "color", "alpha", "error", "depth", "normal" or "instance"."""
        if name == "alpha":
            return self.color[..., 3]
        if name not in IMAGES:
            raise ValueError(f"there is no image {name!r}, but alpha, {', '.join(IMAGES)}")
        image: NDArray[Any] = getattr(self, name)
        return image

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the picture; the extension chooses the format.

        - .png: as `pixels`; without the fourth channel where everything is covered
        - .jpg: the same, over black
        - .exr: linear, float32; first part R G B A, Z (depth), N.X N.Y N.Z (normal); second part
          the 32-bit unsigned integers `instance` (all ones: nothing) and, only if there are
          numbers beyond 2³² - 2, `instance.high`, the bits above

        What is at the path is replaced once all is written. Raises ImageError for another
        extension, or a path that cannot be written.
        """
        check_path(path)
        format = _format(Path(path))
        try:
            with stage("write"), replacing(Path(path)) as unfinished:
                if format == "exr":
                    self._write_exr(unfinished)
                else:
                    unfinished.write_bytes(self.encode(format))
        except OSError as error:
            raise ImageError(f"{path} cannot be written: {error.strerror}") from None

    def encode(self, format: str) -> bytes:
        """The bytes of a file of that format: "png", "jpeg" or "exr". Raises ImageError."""
        match FORMATS.get(format):
            case "png":
                return png(self.pixels.reshape(-1, 4), self.width)
            case "jpeg":
                if max(self.width, self.height) > MAX_JPEG_SIDE:
                    raise ImageError(
                        f"a JPEG has at most {MAX_JPEG_SIDE} columns and rows: use png or exr"
                    )
                over_black = self.color.copy()
                over_black[..., 3] = 1
                return jpeg(self._shown(over_black).reshape(-1, 4), self.width)
            case None:
                raise ImageError(f"unknown picture format {format!r}: use png, jpeg or exr")
        from tempfile import TemporaryDirectory

        # OpenImageIO has no memory to write to from Python, only files.
        with TemporaryDirectory(prefix="ovolo-") as folder:
            path = Path(folder) / "picture.exr"
            self._write_exr(path)
            return path.read_bytes()

    def _repr_png_(self) -> bytes:
        return self.encode("png")

    def __repr__(self) -> str:
        return (
            f"Film({self.width} × {self.height}, {self.integrator}, {self.samples} samples, "
            f"{self.rays:,} rays in {self.seconds:.3g} s)"
        )

    def _shown(self, color: NDArray[np.float32]) -> NDArray[np.uint8]:
        """What a screen shows of colours (h, w, 4), as `pixels`."""
        factor = 2.0 ** min(max(self.exposure, -100.0), 100.0)
        data = self.integrator in ("normals", "ids")
        rows = np.ascontiguousarray(color, np.float32).reshape(-1, 4)
        return screen(rows, None if data else factor).reshape(color.shape)

    def _write_exr(self, path: Path) -> None:
        """Write the file, or raise OSError."""
        import OpenImageIO as oiio  # noqa: N813

        names = ("R", "G", "B", "A", "Z", "N.X", "N.Y", "N.Z")
        floats = np.dstack([self.color, self.depth, self.normal])
        parts = [_Part("picture", names, floats), self._instance_part()]
        specs = []
        for part in parts:
            count = len(part.channels)
            spec = oiio.ImageSpec(self.width, self.height, count, part.kind)
            spec.channelnames = part.channels
            spec.attribute("oiio:subimagename", part.name)
            spec.attribute("compression", "zip")
            specs.append(spec)
        output = oiio.ImageOutput.create("exr")
        if output is None:
            raise OSError(errno.EIO, oiio.geterror())
        written = output.open(str(path), tuple(specs))
        for index, (part, spec) in enumerate(zip(parts, specs, strict=True)):
            if index:
                written = written and output.open(str(path), spec, "AppendSubimage")
            written = written and output.write_image(part.values)
        # Closing flushes: a full disc shows here.
        if not (output.close() and written):
            raise OSError(errno.EIO, output.geterror())

    def _instance_part(self) -> _Part:
        low = self.instance.astype(np.uint32)
        if self.instance.max() < NO_INSTANCE:
            return _Part("instance", ("instance",), low[..., None])
        high = (self.instance >> 32).astype(np.uint32)
        return _Part("instance", ("instance", "instance.high"), np.dstack([low, high]))


NO_INSTANCE = (1 << 32) - 1
"""What the `instance` channel of a file holds where nothing is."""


class _Part(NamedTuple):
    """One image of an EXR file: its channels' names and `(h, w, c)` values, C-contiguous."""

    name: str
    channels: tuple[str, ...]
    values: NDArray[np.float32] | NDArray[np.uint32]

    @property
    def kind(self) -> str:
        """OpenImageIO's name of the type of the values."""
        return "uint" if self.values.dtype == np.uint32 else "float"


def shows_surfaces(path: str | os.PathLike[str]) -> bool:
    """Whether a file of that name holds depth, normal and instance images."""
    return _format(Path(path)) == "exr"


def check_path(path: str | os.PathLike[str]) -> None:
    """Raise ImageError if a picture cannot be written there, without writing anything."""
    path = Path(path)
    _format(path)
    if path.is_dir():
        raise ImageError(f"{path} is a folder: give the name of a file")
    if not path.parent.is_dir():
        raise ImageError(f"the folder {path.parent} does not exist: make it first")
    if not os.access(path if path.exists() else path.parent, os.W_OK):
        raise ImageError(f"{path} may not be written: choose another place")


def _format(path: Path) -> str:
    extension = path.suffix.lower().removeprefix(".")
    if extension not in FORMATS:
        raise ImageError(
            f"{path.name!r} does not end in a known picture format: use .png, .jpg or .exr"
        )
    return FORMATS[extension]
