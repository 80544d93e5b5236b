"""Embree on our benchmark scenes, through `driver.cpp`, which this builds where it can.

Needs a C++ compiler and Debian's `libembree-dev` (3.13). That has one level of instancing, and
spheres under instances are user geometry there, intersected in object space as packets: which is
faster than its own sphere primitive.
"""

from __future__ import annotations

import json
import subprocess
import tempfile
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.rays import Batch
from benchmarks.scenes import View
from compiler.ir import KINDS, MESH, SceneIR
from dsl.scene import FloatArray

SPHERE = KINDS.index("sphere")
COMPILE = ("g++", "-std=c++17", "-O3", "-march=native", "-fno-math-errno", "-pthread")


@cache
def driver() -> Path | None:
    """The compiled driver, or None where Embree or a compiler is missing."""
    sources = sorted(Path(__file__).parent.glob("*.[ch]*"))
    changed = max(source.stat().st_mtime_ns for source in sources)
    program = Path(__file__).parents[2] / "out" / f"embree-{changed}"
    if program.exists():
        return program
    program.parent.mkdir(exist_ok=True)
    source = Path(__file__).with_name("driver.cpp")
    command = [*COMPILE, str(source), "-o", str(program), "-lembree3"]
    try:
        subprocess.run(command, check=True, capture_output=True)
    except (OSError, subprocess.CalledProcessError):
        return None
    return program


class Embree:
    """A scene of spheres and meshes, one level deep, as Embree sees it."""

    def __init__(self, ir: SceneIR) -> None:
        """Writes the scene down for the driver. Raises ValueError for what the driver cannot do."""
        if len(ir.group_ranges) != 1 or not set(ir.prototype_kind) <= {SPHERE, MESH}:
            raise ValueError("the driver has spheres and meshes, one level deep")
        self._folder = tempfile.TemporaryDirectory(prefix="ovolo-embree-")
        self._path = Path(self._folder.name)
        lines, places = [], []
        for number, kind in enumerate(ir.prototype_kind):
            data = int(ir.prototype_data[number])
            radius = 1.0
            if kind == SPHERE:
                lines.append("sphere")
                radius = float(ir.shape_parameters[data])
            else:
                p0, p1, t0, t1 = ir.mesh_ranges[data]
                self._write(f"{number}.points", ir.mesh_points[p0:p1], np.float32)
                self._write(f"{number}.triangles", ir.mesh_triangles[t0:t1], np.uint32)
                lines.append(f"mesh {number}.points {number}.triangles")
            matrices = ir.world_from_object[ir.instance_target == number].copy()
            matrices[:, :, :3] *= radius
            self._write(f"{number}.matrices", matrices, np.float32)
            places.append(f"place {number} {number}.matrices")
        (self._path / "scene").write_text("\n".join(lines + places) + "\n")
        self.build = 0.0
        """CPU seconds of all threads that the last build took; every measurement builds."""

    def rates(self, rays: Batch, threads: int, repeat: int) -> dict[str, tuple[float, int]]:
        """By query, seconds per thread of the fastest packet width, and how many rays hit."""
        self._write("rays", np.concatenate([rays.origins.T, rays.directions.T]), np.float32)
        best: dict[str, tuple[float, int]] = {}
        for line in self._run("rays", threads, repeat):
            query = str(line["query"])
            found = float(line["seconds"]), int(line["hits"])
            best[query] = min(best.get(query, found), found)
        return best

    def frame(
        self, view: View, sun: FloatArray, occlusion: int, threads: int, repeat: int
    ) -> tuple[float, float]:
        """Seconds per thread of a picture by the fastest packet width, and the mean of its pixels.

        The build does not count. `occlusion` rays per pixel, or a shadow ray to the sun if 0.
        """
        self._write_view(view, sun, occlusion)
        lines = self._run("frame", threads, repeat)
        best = min(lines, key=lambda line: float(line["seconds"]))
        return float(best["seconds"]), float(best["sum"]) / (view.width * view.height)

    def process(self, view: View, sun: FloatArray) -> None:
        """Makes a picture with shadow rays, 16 pixels wide, in a process that does nothing else."""
        self._write_view(view, sun, 0)
        self._run("once", 1, 1)

    def _write_view(self, view: View, sun: FloatArray, occlusion: int) -> None:
        middle, right, up = view.frame()
        numbers = [view.eye, middle, right, up, sun, (view.width, view.height, occlusion)]
        self._write("rays", np.concatenate([np.array(n, float) for n in numbers]), np.float32)

    def _write(self, name: str, array: NDArray[Any], dtype: type[np.generic]) -> None:
        (self._path / name).write_bytes(np.ascontiguousarray(array, dtype).tobytes())

    def _run(self, what: str, threads: int, repeat: int) -> list[dict[str, float | str]]:
        program = driver()
        assert program is not None
        command = [str(program), str(self._path / "scene"), str(threads), str(repeat), what, "rays"]
        output = subprocess.run(command, capture_output=True, text=True, timeout=900, check=True)
        build, *lines = map(json.loads, output.stdout.splitlines())
        self.build = float(build["build"])
        return lines
