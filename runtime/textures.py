"""The pictures that a scene's materials and skies name, as arrays for the kernel."""

from __future__ import annotations

import re
import zipfile
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from tempfile import NamedTemporaryFile
from typing import NamedTuple, cast

import numpy as np
from numpy.typing import NDArray

from compiler.ir import COLOR_SPACES, TEXTURED, SceneIR
from dsl.codes import diagnostic
from dsl.diagnostics import Diagnostic

MAX_TEXELS = 1 << 26
"""Of one picture."""
MAX_BYTES = 1 << 32
"""Of all pictures of a scene, as arrays."""
MAX_PACKED = 1 << 30
"""Bytes of a picture in a package, before it is read."""

UDIM = "<UDIM>"
UDIM_FIRST, UDIM_COLUMNS = 1001, 10

UNUSED = tuple(TEXTURED.index(name) for name in ("displacement", "occlusion"))
"""Parameters that shading does not know."""

_PACKAGED = re.compile(r"(?P<package>[^\[\]]+)\[(?P<entry>.+)\]")

Picture = NDArray[np.uint8] | NDArray[np.float32]
Pictures = Sequence[Picture | dict[tuple[int, int], Picture] | None]


class Images(NamedTuple):
    """The pictures of each row of `SceneIR.textures`, and of the rows of its lights that have one.

    As `runtime._kernel.Kernel` takes them; `warnings` say what could not be read.
    """

    textures: Pictures
    skies: dict[int, Picture]
    warnings: list[Diagnostic]


class TextureError(Exception):
    """A picture that is not read; the message says why."""


def load_images(ir: SceneIR, root: Path | None = None) -> Images:
    """The pictures of a scene's textures and skies.

    Names of files start from `root`, None: the current folder. A file is read once, however many
    materials and skies name it. Of one that cannot be read there is no picture, and a warning says
    why. Files in packages (`asset.usdz[cloth.png]`) and sets of tiles (`skin.<UDIM>.png`) are read
    like others; a sky has no tiles.
    """
    folder = _Folder(root or Path())
    faults: dict[str, Diagnostic] = {}
    pictures: list[Picture | dict[tuple[int, int], Picture] | None] = []
    for row in ir.textures:
        file = ir.text(int(row["file"]))
        if not file or int(row["parameter"]) in UNUSED:
            pictures.append(None)
            continue
        srgb = COLOR_SPACES[row["color_space"]] == "sRGB"
        try:
            read = folder.tiles if UDIM in file else folder.picture
            pictures.append(read(file, srgb))
        except TextureError as error:
            pictures.append(None)
            message = f"the texture `{file}` {error}: its fallback is drawn"
            faults[file] = diagnostic("texture-unreadable", message)
    skies = {}
    for light in range(len(ir.lights)):
        if file := ir.sky_texture(light):
            try:
                skies[light] = folder.picture(file, srgb=False)
            except TextureError as error:
                message = f"the texture `{file}` {error}: the sky has its color alone"
                faults[file] = diagnostic("texture-unreadable", message)
    return Images(pictures, skies, list(faults.values()))


@dataclass(slots=True)
class _Folder:
    """Reads pictures, named from `root` on, as long as they do not take too much memory.

    Each is read once, by its name and encoding.
    """

    root: Path
    left: int = field(default_factory=lambda: MAX_BYTES)
    _found: dict[tuple[str, bool], Picture | TextureError] = field(default_factory=dict)

    def tiles(self, file: str, srgb: bool) -> dict[tuple[int, int], Picture]:
        """All pictures of a set, by column and row."""
        file = str(self.root / file)
        packaged = _PACKAGED.fullmatch(file)
        names = _entries(packaged["package"]) if packaged else _beside(file)
        pattern = re.compile(
            re.escape(packaged["entry"] if packaged else file).replace(re.escape(UDIM), r"(\d{4})")
        )
        pictures = {}
        for name in sorted(names):
            match = pattern.fullmatch(name)
            if match is None or int(match[1]) < UDIM_FIRST:
                continue
            row, column = divmod(int(match[1]) - UDIM_FIRST, UDIM_COLUMNS)
            tile = f"{packaged['package']}[{name}]" if packaged else name
            pictures[column, row] = self.picture(tile, srgb)
        if not pictures:
            raise TextureError("has no tiles")
        return pictures

    def picture(self, file: str, srgb: bool) -> Picture:
        """One picture; `srgb` says that its numbers are encoded so, if they are not bytes."""
        key = file, srgb
        if key not in self._found:
            try:
                self._found[key] = self._picture(file, srgb)
            except TextureError as error:
                self._found[key] = error
        found = self._found[key]
        if isinstance(found, TextureError):
            raise found
        return found

    def _picture(self, file: str, srgb: bool) -> Picture:
        with _unpacked(str(self.root / file)) as path:
            if not Path(path).is_file():
                raise TextureError("cannot be found")
            picture = _read(path, self._take)
        if picture.dtype == np.float32 and srgb:
            color = picture[..., : 3 if picture.shape[2] >= 3 else 1]
            color[...] = _decoded(cast("NDArray[np.float32]", color))
        # What is read-only is shared with the kernel, not copied.
        picture.flags.writeable = False
        return picture

    def _take(self, nbytes: int) -> None:
        if nbytes > self.left:
            raise TextureError(f"does not fit into the {MAX_BYTES >> 30} GiB for all textures")
        self.left -= nbytes


def _read(path: str, take: Callable[[int], None]) -> Picture:
    import OpenImageIO as oiio  # noqa: N813

    # Colours are wanted as they are in the file, not multiplied by its alpha.
    wishes = oiio.ImageSpec()
    wishes.attribute("oiio:UnassociatedAlpha", 1)
    source = oiio.ImageInput.open(path, wishes)
    if source is None:
        raise TextureError(_reason(oiio.geterror()))
    try:
        spec = source.spec()
        texels = spec.width * spec.height
        if not 0 < texels <= MAX_TEXELS or spec.depth > 1:
            raise TextureError(f"has {spec.width} × {spec.height} texels, more than {MAX_TEXELS:,}")
        kind = "uint8" if str(spec.format) == "uint8" else "float"
        channels = min(spec.nchannels, 4)
        take(texels * channels * (1 if kind == "uint8" else 4))
        picture = source.read_image(0, 0, 0, channels, kind)
        if picture is None:
            raise TextureError(_reason(source.geterror()))
    finally:
        source.close()
    if channels == 2 and spec.alpha_channel < 0:
        # Two colours, not grey and alpha.
        picture = np.concatenate([picture, np.zeros_like(picture[..., :1])], axis=2)
    if kind == "float":
        picture[~np.isfinite(picture)] = 0.0
    return np.ascontiguousarray(picture)


def _reason(words: str) -> str:
    first = words.strip().split("\n")[0]
    return f"cannot be read ({first})" if first else "cannot be read"


def _decoded(color: NDArray[np.float32]) -> NDArray[np.float32]:
    curve = ((np.maximum(color, 0) + np.float32(0.055)) / np.float32(1.055)) ** np.float32(2.4)
    return np.where(color <= 0.04045, color / np.float32(12.92), curve)


def _beside(file: str) -> list[str]:
    """Files in the folder of a set of tiles."""
    try:
        return [str(path) for path in Path(file).parent.iterdir()]
    except OSError:
        return []


def _entries(package: str) -> list[str]:
    with _package(package) as archive:
        return archive.namelist()


@contextmanager
def _package(path: str) -> Iterator[zipfile.ZipFile]:
    try:
        with zipfile.ZipFile(path) as archive:
            yield archive
    except (OSError, zipfile.BadZipFile, KeyError, NotImplementedError, RuntimeError):
        raise TextureError("is in a package that cannot be read, or not there") from None


@contextmanager
def _unpacked(file: str) -> Iterator[str]:
    """The path of a file, made for the time being if it is in a package."""
    packaged = _PACKAGED.fullmatch(file)
    if packaged is None:
        if not Path(file).is_file():
            raise TextureError("does not exist")
        yield file
        return
    with _package(packaged["package"]) as archive:
        info = archive.getinfo(packaged["entry"])
        if info.file_size > MAX_PACKED:
            raise TextureError(f"has more than {MAX_PACKED >> 30} GiB")
        content = archive.read(info)
    with NamedTemporaryFile(prefix="ovolo-", suffix=Path(packaged["entry"]).suffix) as copy:
        copy.write(content)
        copy.flush()
        yield copy.name
