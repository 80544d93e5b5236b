"""Pictures: what a render makes, and how it is written."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dsl.diagnostics import Diagnostic
from dsl.observation import stage
from dsl.scene import Integrator

FORMATS = {"png": "png", "jpg": "jpeg", "jpeg": "jpeg", "exr": "exr"}
"""Formats by extension."""

JPEG_QUALITY = 95
PNG_LEVEL = 4
"""Of zlib: half the time of its default, 6, for a tenth more bytes."""


class ImageError(ValueError):
    """A picture that cannot be written; the message says why and names the mend."""


@dataclass(frozen=True, eq=False, repr=False)
class Film:
    """A rendered picture: arrays of `(h, w)` pixels, row 0 at the top."""

    color: NDArray[np.float32]  # (h, w, 4) linear Rec. 709, premultiplied by its fourth: coverage
    error: NDArray[np.float32]  # (h, w) standard error of the luminance; NaN of a single sample
    depth: NDArray[np.float32]  # (h, w) along the viewing axis, inf where nothing is
    normal: NDArray[np.float32]  # (h, w, 3) world space, unit, outward, 0 where nothing is
    instance: NDArray[np.int64]  # (h, w) leaf number or -1
    # depth, normal and instance are those of the sample nearest to the pixel's centre
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
    def pixels(self) -> NDArray[np.uint8]:
        """The picture for a screen: `(h, w, 4)` red, green, blue, coverage, 0 … 255.

        Not premultiplied. Light is exposed, clipped to 1 and encoded by the sRGB curve; the
        integrators "normals" and "ids" show data, which is neither exposed nor encoded.
        """
        alpha = np.clip(self.color[..., 3:], 0, 1)
        color = self.color[..., :3]
        rgb = np.divide(color, alpha, where=alpha > 0, out=np.zeros_like(color))
        return _bytes(np.concatenate([self._screen(rgb), alpha], axis=2))

    def aov(self, name: str) -> NDArray[Any]:
        """An image by name: "color", "alpha", "error", "depth", "normal" or "instance"."""
        images: dict[str, NDArray[Any]] = {
            "color": self.color,
            "alpha": self.color[..., 3],
            "error": self.error,
            "depth": self.depth,
            "normal": self.normal,
            "instance": self.instance,
        }
        if name not in images:
            raise ValueError(f"there is no image {name!r}, but {', '.join(images)}")
        return images[name]

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the picture; the extension chooses the format.

        - .png: as `pixels`; without the fourth channel where everything is covered
        - .jpg: the same, over black
        - .exr: linear, float32; first part R G B A, Z (depth), N.X N.Y N.Z (normal); second part
          the 32-bit unsigned integers `instance` (all ones: nothing) and, only if there are
          numbers beyond 2³² - 2, `instance.high`, the bits above

        Raises ImageError for another extension, or a path that cannot be written.
        """
        check_path(path)
        with stage("write"):
            self._write(Path(path))

    def encode(self, format: str) -> bytes:
        """The bytes of a file of that format: "png", "jpeg" or "exr". Raises ImageError."""
        if format not in FORMATS:
            raise ImageError(f"unknown picture format {format!r}: use png, jpeg or exr")
        # The writer for Python has no memory to write to, only files.
        with TemporaryDirectory(prefix="ovolo-") as folder:
            path = Path(folder) / f"picture.{format}"
            self._write(path)
            return path.read_bytes()

    def _repr_png_(self) -> bytes:
        return self.encode("png")

    def __repr__(self) -> str:
        return (
            f"Film({self.width} × {self.height}, {self.integrator}, {self.samples} samples, "
            f"{self.rays:,} rays in {self.seconds:.3g} s)"
        )

    def _screen(self, rgb: NDArray[np.float32]) -> NDArray[np.float32]:
        """What a screen is to show of linear colours, 0 … 1."""
        if self.integrator in ("normals", "ids"):
            return np.clip(rgb, 0, 1)
        factor = np.float32(2.0 ** min(max(self.exposure, -100.0), 100.0))
        with np.errstate(over="ignore"):
            exposed = np.clip(rgb * factor, 0, 1)
        curve = 1.055 * exposed ** np.float32(1 / 2.4) - 0.055
        screen: NDArray[np.float32] = np.where(exposed <= 0.0031308, 12.92 * exposed, curve)
        return screen

    def _write(self, path: Path) -> None:
        match FORMATS[_extension(path)]:
            case "png":
                pixels = self.pixels
                covered = bool((pixels[..., 3] == 255).all())
                part = _Part("RGB", pixels[..., :3]) if covered else _Part("RGBA", pixels)
                compression = {"png:compressionLevel": PNG_LEVEL}
                _write_parts(path, [part], {"oiio:UnassociatedAlpha": 1, **compression})
            case "jpeg":
                pixels = _bytes(self._screen(self.color[..., :3]))
                _write_parts(path, [_Part("RGB", pixels)], {"compression": f"jpeg:{JPEG_QUALITY}"})
            case _:
                names = ("R", "G", "B", "A", "Z", "N.X", "N.Y", "N.Z")
                floats = np.dstack([self.color, self.depth, self.normal])
                parts = [_Part(names, floats, "picture"), self._instance_part()]
                _write_parts(path, parts, {"compression": "zip"})

    def _instance_part(self) -> _Part:
        low = self.instance.astype(np.uint32)
        high = (self.instance >> 32).astype(np.uint32)
        if self.instance.max() < NO_INSTANCE:
            return _Part(("instance",), low[..., None], "instance")
        return _Part(("instance", "instance.high"), np.dstack([low, high]), "instance")


NO_INSTANCE = (1 << 32) - 1
"""What the `instance` channel of a file holds where nothing is."""


@dataclass(frozen=True, eq=False)
class _Part:
    """One image of a file: channel names and `(h, w, c)` values."""

    channels: tuple[str, ...] | str
    values: NDArray[np.uint8] | NDArray[np.float32] | NDArray[np.uint32]
    name: str = ""


def check_path(path: str | os.PathLike[str]) -> None:
    """Raise ImageError if a picture cannot be written there, without writing anything."""
    path = Path(path)
    _extension(path)
    if path.is_dir():
        raise ImageError(f"{path} is a folder: give the name of a file")
    if not path.parent.is_dir():
        raise ImageError(f"the folder {path.parent} does not exist: make it first")
    if not os.access(path if path.exists() else path.parent, os.W_OK):
        raise ImageError(f"{path} may not be written: choose another place")


def _extension(path: Path) -> str:
    extension = path.suffix.lower().removeprefix(".")
    if extension not in FORMATS:
        raise ImageError(
            f"{path.name!r} does not end in a known picture format: use .png, .jpg or .exr"
        )
    return extension


_TYPES = {"uint8": "uint8", "uint32": "uint", "float32": "float"}
"""OpenImageIO's names of the types of pixels."""


def _bytes(values: NDArray[np.float32]) -> NDArray[np.uint8]:
    return (values * 255 + 0.5).astype(np.uint8)


def _write_parts(path: Path, parts: list[_Part], attributes: dict[str, object]) -> None:
    import OpenImageIO as oiio  # noqa: N813

    specs = []
    for part in parts:
        height, width, channels = part.values.shape
        spec = oiio.ImageSpec(width, height, channels, _TYPES[part.values.dtype.name])
        spec.channelnames = tuple(part.channels)
        if part.name:
            spec.attribute("oiio:subimagename", part.name)
        for key, value in attributes.items():
            spec.attribute(key, value)
        specs.append(spec)
    output = oiio.ImageOutput.create(str(path))
    if output is None:
        raise ImageError(f"{path} cannot be written: {oiio.geterror()}")
    written = output.open(str(path), tuple(specs) if len(specs) > 1 else specs[0])
    for index, (part, spec) in enumerate(zip(parts, specs, strict=True)):
        if index:
            written = written and output.open(str(path), spec, "AppendSubimage")
        written = written and output.write_image(np.ascontiguousarray(part.values))
    # Closing flushes: a full disc shows here.
    if not (output.close() and written):
        raise ImageError(f"{path} cannot be written: {output.geterror()}")
