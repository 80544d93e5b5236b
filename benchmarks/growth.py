"""How the cost of build and rays grows with the number of instances: 10² to 10⁷ spheres."""

from __future__ import annotations

from collections.abc import Iterator

from benchmarks import scenes
from benchmarks.rates import compiled, timed
from benchmarks.rays import batches
from benchmarks.record import Figure
from dsl.scene import Precision
from runtime._kernel import Kernel
from runtime.tracer import Tracer

RAYS = 1 << 17


def measure(precision: Precision, threads: int, largest: int) -> Iterator[Figure]:
    """Seconds to build, bytes an instance beyond the IR, rates of camera and bounce rays.

    The cube grows with the number, so that about as many spheres lie on a ray's way.
    """
    who = f"ovolo {precision}"
    for exponent in range(2, largest + 1):
        count = 10**exponent
        name = f"10^{exponent} spheres"
        ir = compiled(scenes.cloud(count, triangles=False, extent=count ** (1 / 3)))
        seconds, kernel = timed(Kernel, ir, precision)
        yield Figure(name, "build", who, threads, seconds, "s")
        yield Figure(name, "beyond the IR", who, threads, kernel.nbytes / count, "bytes")
        tracer = Tracer(ir, precision, threads=threads)
        side = 3.3 * count ** (1 / 3)
        view = scenes.View((side, 0.6 * side, side), (0, 0, 0), (0, 1, 0), 36, 1024, 1024)
        for kind, rays in batches(tracer, view, RAYS, ("camera", "bounce")):
            seconds, _ = timed(tracer.trace, *rays, copy=False)
            rate = len(rays.origins) / seconds * threads * 1e-6
            yield Figure(name, f"{kind} closest", who, threads, rate, "Mrays/s")
