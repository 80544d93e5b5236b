"""Batches of rays against a scene: NumPy arrays in, NumPy arrays out."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, partial
from typing import TYPE_CHECKING, Literal, NamedTuple, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from compiler.ir import SceneIR

if TYPE_CHECKING:
    from runtime._kernel import Kernel

MAX_THREADS = 1 << 10

FloatArray = NDArray[np.float64]

Answer = tuple[
    FloatArray,
    FloatArray,
    FloatArray,
    NDArray[np.int64],
    NDArray[np.int32],
    NDArray[np.int32],
]


class Backend(Protocol):
    """Whatever answers checked rays at once and in full, such as the reference interpreter."""

    def trace(
        self,
        origins: FloatArray,
        directions: FloatArray,
        t_min: FloatArray,
        t_max: FloatArray,
    ) -> Answer:
        """Closest hits: t, normal, position, instance, prototype, material, as in `Hits`."""

    def occluded(
        self,
        origins: FloatArray,
        directions: FloatArray,
        t_min: FloatArray,
        t_max: FloatArray,
    ) -> NDArray[np.bool_]:
        """Whether anything is hit, as `runtime._kernel.Kernel.occluded`."""


class Surface(NamedTuple):
    """What is known of n hits beyond where along the ray they are; see `Hits`."""

    normal: FloatArray
    position: FloatArray
    prototype: NDArray[np.int32]
    material: NDArray[np.int32]
    offset: FloatArray


@dataclass(frozen=True, eq=False)
class Hits:
    """The closest hits of n rays, row i for ray i.

    A miss has t = inf, position and normal NaN, and -1 for every number. What `Surface` has is
    computed when one of it is first asked for, from the rays as they were when traced.
    """

    t: FloatArray
    """(n,) ray parameter, in units of the ray's direction as given."""
    instance: NDArray[np.int64]
    """(n,) number of the instance in order of emission; see `object_path`."""
    compute_surface: Callable[[], Surface]

    @cached_property
    def _surface(self) -> Surface:
        return self.compute_surface()

    @property
    def normal(self) -> FloatArray:
        """(n, 3) world space, unit, outward; not flipped towards the ray.

        Geometric, whatever normals a mesh is shaded with in pictures.
        """
        return self._surface.normal

    @property
    def position(self) -> FloatArray:
        """(n, 3) world space, on the surface."""
        return self._surface.position

    @property
    def prototype(self) -> NDArray[np.int32]:
        """(n,) prototype of the scene's IR that the instance places."""
        return self._surface.prototype

    @property
    def material(self) -> NDArray[np.int32]:
        """(n,) row of the IR's materials."""
        return self._surface.material

    @property
    def offset(self) -> FloatArray:
        """(n,) how far off `position`, along the normal, rounding cannot reach: see `spawn`."""
        return self._surface.offset

    def spawn(self, directions: ArrayLike) -> FloatArray:
        """(n, 3) origins for rays that leave the surfaces in these directions, (n, 3) or (3,).

        Each is `position`, moved by `offset` along the normal to the side that the ray goes to, so
        that it neither meets its own surface falsely nor slips through it: at any scale, through
        any instance transforms. Rounding bounds the offset, no constant does. A miss has NaN.
        Raises ValueError as `Tracer.trace`.
        """
        vectors = np.broadcast_to(_vectors("directions", directions, False), self.normal.shape)
        outward = np.einsum("ij,ij->i", vectors, self.normal)
        origins: FloatArray = (
            self.position + np.copysign(self.offset, outward)[:, None] * self.normal
        )
        return origins

    def __reduce__(self) -> tuple[type[Hits], tuple[object, ...]]:
        return Hits, (self.t, self.instance, partial(Surface, *self._surface))

    def __len__(self) -> int:
        return len(self.t)

    @property
    def hit(self) -> NDArray[np.bool_]:
        """(n,) whether the ray hit anything."""
        return self.instance >= 0

    def __repr__(self) -> str:
        hit = self.hit
        count = int(np.count_nonzero(hit))
        if not count:
            return f"Hits({len(self)} rays, all missed)"
        nearest, farthest = self.t[hit].min(), self.t[hit].max()
        return f"Hits({len(self)} rays, {count} hit, t from {nearest:.6g} to {farthest:.6g})"


class Tracer:
    """A scene prepared for tracing; immutable, and safe to share between threads.

    `precision` is the scalar of the intersectors; all else (transforms, t, positions) is float64
    anyway. `isa` is one of `runtime._kernel.instruction_sets()`, None the best of this CPU.
    `threads` 0 takes all cores. Answers depend on `precision` alone.
    Raises ValueError for another precision or instruction set, or threads out of 0 … MAX_THREADS.
    """

    def __init__(
        self,
        ir: SceneIR,
        precision: Literal["float32", "float64"] = "float64",
        isa: str | None = None,
        threads: int = 0,
    ) -> None:
        from runtime._kernel import Kernel

        if precision not in ("float32", "float64"):
            raise ValueError(f'precision is "float32" or "float64", not {precision!r}')
        if not 0 <= threads <= MAX_THREADS:
            raise ValueError(f"threads is {threads}, which is not in 0 … {MAX_THREADS}")
        self._precision: str = precision
        self._prepare(Kernel(ir, precision, isa), threads)

    def _prepare(self, kernel: Kernel, threads: int) -> None:
        self._kernel: Kernel | None = kernel
        self._threads = threads
        self._trace: Callable[..., Hits] = partial(_closest, kernel, threads)
        self._occluded: Callable[..., NDArray[np.bool_]] = partial(kernel.occluded, threads=threads)

    @classmethod
    def over(cls, backend: Backend) -> Tracer:
        """Another backend, such as `runtime.reference.ReferenceTracer`, behind the same face."""
        tracer = cls.__new__(cls)
        tracer._kernel, tracer._threads = None, 0
        tracer._precision = "reference"
        tracer._trace, tracer._occluded = partial(_in_full, backend), backend.occluded
        return tracer

    def updated(self, ir: SceneIR) -> Tracer:
        """A tracer for another scene that is much like this one's: edited, or the next frame.

        It answers as `Tracer(ir, …)` would, and is ready sooner: the trees of meshes and groups
        that both scenes have are shared, and only what moved or is new is built. This tracer stays
        as it is. Raises ValueError for a tracer `over` another backend.
        """
        if self._kernel is None:
            raise ValueError("only tracers of the kernel can be updated")
        tracer = Tracer.__new__(Tracer)
        tracer._precision = self._precision
        tracer._prepare(self._kernel.updated(ir), self._threads)
        return tracer

    def __repr__(self) -> str:
        on = "" if self._kernel is None else f", {self._kernel.isa}"
        return f"Tracer({self._precision}{on})"

    def trace(
        self,
        origins: ArrayLike,
        directions: ArrayLike,
        t_min: ArrayLike = 0.0,
        t_max: ArrayLike = np.inf,
        *,
        copy: bool = True,
    ) -> Hits:
        """Closest hits with t_min < t < t_max.

        `origins` and `directions` are (n, 3), or one of them (3,) for all rays; t_min and t_max
        are scalars or (n,). Directions are not normalised. A ray that is not finite, or whose
        direction is zero, misses. The rays are copied for the surfaces that may be asked for later;
        with `copy` False they are not, and must stay as they are as long as the hits are used.
        Raises ValueError for other shapes or for non-numbers.
        """
        return self._trace(*_rays(origins, directions, t_min, t_max, copy))

    def occluded(
        self,
        origins: ArrayLike,
        directions: ArrayLike,
        t_min: ArrayLike = 0.0,
        t_max: ArrayLike = np.inf,
    ) -> NDArray[np.bool_]:
        """Whether anything is hit with t_min < t < t_max, (n,); rays as for `trace`."""
        return self._occluded(*_rays(origins, directions, t_min, t_max))


def _closest(
    kernel: Kernel,
    threads: int,
    origins: FloatArray,
    directions: FloatArray,
    t_min: FloatArray,
    t_max: FloatArray,
) -> Hits:
    """Hits of the kernel, which computes surfaces when they are asked for."""
    t, instance, primitive = kernel.trace(origins, directions, t_min, t_max, threads)

    def surface() -> Surface:
        return Surface(*kernel.surface(origins, directions, t, instance, primitive, threads))

    return Hits(t, instance, surface)


def _in_full(backend: Backend, *rays: FloatArray) -> Hits:
    t, normal, position, instance, prototype, material = backend.trace(*rays)
    # Such a backend rounds no more than what it is given and its answer.
    size = np.abs(rays[0]).max(axis=1, initial=0) + np.abs(position).max(axis=1, initial=0)
    offset = np.nan_to_num(size) * 2.0**-48
    return Hits(t, instance, partial(Surface, normal, position, prototype, material, offset))


def _rays(
    origins: ArrayLike,
    directions: ArrayLike,
    t_min: ArrayLike,
    t_max: ArrayLike,
    copy: bool = False,
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """The rays as the kernel wants them: (n, 3), (n, 3) and bounds (n,) or (1,), float64.

    Copies are such that the caller cannot change them.
    """
    points = _vectors("origins", origins, copy)
    vectors = _vectors("directions", directions, copy)
    counts = {len(array) for array in (points, vectors) if array.ndim == 2} or {1}
    if len(counts) > 1:
        raise ValueError(
            f"origins {points.shape} and directions {vectors.shape} differ in the number of rays"
        )
    count = counts.pop()
    return (
        np.ascontiguousarray(np.broadcast_to(points, (count, 3))),
        np.ascontiguousarray(np.broadcast_to(vectors, (count, 3))),
        _bound("t_min", t_min, count),
        _bound("t_max", t_max, count),
    )


def _vectors(name: str, values: ArrayLike, copy: bool) -> FloatArray:
    array = _float64(name, values, copy)
    if array.ndim not in (1, 2) or array.shape[-1] != 3:
        raise ValueError(f"{name} must have shape (n, 3) or (3,), not {array.shape}")
    return array


def _bound(name: str, values: ArrayLike, count: int) -> FloatArray:
    array = _float64(name, values)
    if array.shape not in ((), (count,)):
        raise ValueError(f"{name} must be a scalar or have shape ({count},), not {array.shape}")
    return np.ascontiguousarray(array.reshape(-1))


def _float64(name: str, values: ArrayLike, copy: bool = False) -> FloatArray:
    try:
        array = np.asarray(values)
    except ValueError as error:
        raise ValueError(f"{name} must be an array of numbers: {error}") from None
    if array.dtype.kind not in "fiu":
        raise ValueError(f"{name} must hold real numbers, not {array.dtype}")
    return array.astype(np.float64, copy=copy)
