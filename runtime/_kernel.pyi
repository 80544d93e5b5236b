"""The native kernel: a flat scene in, hits and films out. Built from `runtime/kernel`."""

from collections.abc import Callable, Sequence
from typing import Any, final

import numpy as np
from numpy.typing import NDArray

from compiler.ir import SceneIR

__all__ = ["Kernel", "__version__", "instruction_sets", "jpeg", "png", "screen"]

__version__: str

_Image = NDArray[np.uint8] | NDArray[np.float32]

def instruction_sets() -> list[str]:
    """Names of the instruction sets this CPU can run, best first; the last is "portable"."""

def screen(color: NDArray[np.float32], factor: float | None) -> NDArray[np.uint8]:
    """What a screen shows of linear colours: `(n, 4)` red, green, blue, coverage, 0 … 255.

    `color` is (n, 4), C-contiguous, premultiplied by its fourth, the coverage; the answer is not.
    Light is multiplied by the factor, clipped to 1 and encoded by the sRGB curve, rounded
    correctly; with None the colours are data, and only clipped.
    """

def png(pixels: NDArray[np.uint8], width: int) -> bytes:
    """A PNG file of `screen`'s pixels (n, 4), in rows of `width`, marked as sRGB.

    Without the fourth channel where everything is covered. Raises ValueError where there are no
    pixels, or more in a row or column than 2³¹ - 1.
    """

def jpeg(pixels: NDArray[np.uint8], width: int) -> bytes:
    """A JPEG file of `screen`'s pixels (n, 4), in rows of `width`, without their coverage.

    Raises ValueError where there are no pixels, or more in a row or column than 65535.
    """

@final
class Kernel:
    """A scene prepared for tracing; immutable and safe to share between threads.

    `precision` is "float32" or "float64" (the scalar of the intersectors); `isa` one of
    `instruction_sets()`, None for the best: all give the same answers.
    `images` are the pictures of the IR's `textures`, row by row: `(h, w, c)` from the top, of 1
    (grey), 2 (grey, alpha), 3 or 4 channels; uint8, which the texture's colour space decodes, or
    float32, linear; of a picture in tiles a dict of them by (column, row). None, or what is beyond
    the end, is missing: the texture's fallback is drawn. `skies` are the pictures of skies by their
    row of the IR's `lights`, decoded as "auto" says. Read-only arrays are not copied.
    Raises ValueError for an IR whose indices or shapes are wrong.
    """

    def __new__(
        cls,
        ir: SceneIR,
        precision: str,
        isa: str | None = None,
        images: Sequence[_Image | dict[tuple[int, int], _Image] | None] | None = None,
        skies: dict[int, _Image] | None = None,
    ) -> Kernel: ...
    def updated(self, ir: SceneIR) -> Kernel:
        """The kernel for another scene, with the precision and instruction set of this one.

        The same as a new one but for the time it takes: meshes of equal content, and groups whose
        instances stand where they stood, keep their trees, which both kernels share. It has no
        images.
        """
    @property
    def isa(self) -> str: ...
    @property
    def nbytes(self) -> int:
        """Bytes the kernel holds beyond the IR."""
    @property
    def bounds(self) -> NDArray[np.float64]:
        """(2, 3) world-space box of all bounded leaves; lower > upper when there are none."""

    def trace(
        self,
        origins: NDArray[np.float64],
        directions: NDArray[np.float64],
        t_min: NDArray[np.float64],
        t_max: NDArray[np.float64],
        threads: int = 0,
    ) -> tuple[
        NDArray[np.float64],
        NDArray[np.int64],
        NDArray[np.uint32],
    ]:
        """Closest hits with t_min < t < t_max.

        Returns t, instance and primitive (the triangle of a mesh, else 0), each (n,): what
        `surface` wants. Rays `(n, 3)`, bounds `(n,)` or `(1,)`, C-contiguous. `threads` 0 takes
        all cores. A miss has t = inf and instance -1. A ray that is not finite, or has a zero
        direction, misses. Ties in t go to the lowest leaf number. Releases the GIL;
        KeyboardInterrupt ends it.
        """

    def surface(
        self,
        origins: NDArray[np.float64],
        directions: NDArray[np.float64],
        t: NDArray[np.float64],
        instance: NDArray[np.int64],
        primitive: NDArray[np.uint32],
        threads: int = 0,
    ) -> tuple[
        NDArray[np.float64],
        NDArray[np.float64],
        NDArray[np.int32],
        NDArray[np.int32],
        NDArray[np.float64],
    ]:
        """The surfaces where `trace` has found these rays to hit.

        Returns normal (n, 3), position (n, 3), prototype (n,), material (n,), offset (n,): rays
        that leave `position` start that far along, or against, the normal. A miss, or an
        instance or primitive that there is not, has NaN, -1 and 0.
        """

    def occluded(
        self,
        origins: NDArray[np.float64],
        directions: NDArray[np.float64],
        t_min: NDArray[np.float64],
        t_max: NDArray[np.float64],
        threads: int = 0,
    ) -> NDArray[np.bool_]:
        """Whether anything is hit with t_min < t < t_max, (n,)."""

    def render(
        self,
        camera: NDArray[np.void],
        width: int,
        height: int,
        samples: int,
        integrator: str,
        occlusion_distance: float,
        seed: int = 0,
        threads: int = 0,
        progress: Callable[[float, int], object] | None = None,
        surfaces: bool = True,
    ) -> dict[str, NDArray[Any]]:
        """A picture: linear float32 arrays by name.

        `camera` is one `compiler.ir.CAMERA` record, shape (). Returns color (h, w, 4)
        premultiplied, error (h, w) (standard error of the luminance, NaN of a single sample) and
        rays () uint64, the number traced; with `surfaces` also depth (h, w) (along the viewing
        axis, inf: nothing), normal (h, w, 3) world space (0: nothing) and instance (h, w) int64
        leaf number or -1, of the sample nearest the pixel's centre. Row 0 is the top.
        `progress(done, rays)` is called now and then with the fraction done; what it raises ends
        the render and is raised again. The same picture for any `threads` and instruction set.
        """
