"""How long USD stages take to import, and how much memory: `python -m benchmarks.usd_import`.

Stages of 10³ to 10⁶ point instances (positions, scales and orientations of two prototypes), native
instances, distinct prims, and faces of one mesh, polygons and cages, are written, read by usd-core
alone, and compiled, each in a process of its own. Memory counts from where usd-core has the stage
open and every attribute read. `--plot FILE` draws the growth.
"""

from __future__ import annotations

import argparse
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import astuple, dataclass
from pathlib import Path
from typing import Any

import numpy as np

SIZES = (1_000, 10_000, 100_000, 1_000_000)


@dataclass(frozen=True, slots=True)
class Import:
    """Seconds to compile, and of the CPU, for the graph, to open; bytes of each at the peak."""

    kind: str
    size: int
    wall: float
    cpu: float
    graph: float
    opening: float
    bytes_each: float
    prototypes: int


def _points(stage: Any, size: int) -> None:
    from pxr import UsdGeom, Vt

    random = np.random.default_rng(0)
    instancer = UsdGeom.PointInstancer.Define(stage, "/many")
    for kind in (UsdGeom.Sphere, UsdGeom.Cube):
        kind.Define(stage, f"/many/{kind.__name__}")
    instancer.GetPrototypesRel().SetTargets(["/many/Sphere", "/many/Cube"])
    numbers = random.integers(0, 2, size).astype(np.int32)
    instancer.CreateProtoIndicesAttr(Vt.IntArray.FromNumpy(numbers))
    places = random.uniform(0.0, 100.0, (size, 3)).astype(np.float32)
    instancer.CreatePositionsAttr(Vt.Vec3fArray.FromNumpy(places))
    turns = random.normal(size=(size, 4))
    turns /= np.linalg.norm(turns, axis=1, keepdims=True)
    instancer.CreateOrientationsAttr(Vt.QuathArray.FromNumpy(turns.astype(np.float16)))
    scales = random.uniform(0.5, 1.5, (size, 3)).astype(np.float32)
    instancer.CreateScalesAttr(Vt.Vec3fArray.FromNumpy(scales))


def _natives(stage: Any, size: int) -> None:
    from pxr import Sdf

    layer = stage.GetRootLayer()
    stage.CreateClassPrim("/_kit")
    stage.DefinePrim("/_kit/ball", "Sphere")
    with Sdf.ChangeBlock():
        for number in range(size // 10):
            prim = Sdf.CreatePrimInLayer(layer, f"/i{number}")
            prim.specifier, prim.typeName, prim.instanceable = Sdf.SpecifierDef, "Xform", True
            prim.inheritPathList.Prepend("/_kit")


def _distinct(stage: Any, size: int) -> None:
    """Quads, each with points, two steps and a binding of its own."""
    from pxr import Gf, Sdf, UsdShade, Vt

    layer, names = stage.GetRootLayer(), Sdf.ValueTypeNames
    materials = [UsdShade.Material.Define(stage, f"/m{number}").GetPath() for number in range(10)]
    steps = ("xformOp:translate", "xformOp:rotateY")
    with Sdf.ChangeBlock():
        for number in range(size // 10):
            prim = Sdf.CreatePrimInLayer(layer, f"/g{number // 100}/q{number}")
            prim.specifier, prim.typeName = Sdf.SpecifierDef, "Mesh"
            prim.nameParent.specifier, prim.nameParent.typeName = Sdf.SpecifierDef, "Xform"
            corners = [(0, 0, 0), (1, 0, 0), (1, 1 + number / size, 0), (0, 1, 0)]
            for name, type, value in (
                ("points", names.Point3fArray, Vt.Vec3fArray(corners)),
                ("faceVertexCounts", names.IntArray, Vt.IntArray([4])),
                ("faceVertexIndices", names.IntArray, Vt.IntArray([0, 1, 2, 3])),
                ("subdivisionScheme", names.Token, "none"),
                (steps[0], names.Double3, Gf.Vec3d(number % 300, number // 300, 0)),
                (steps[1], names.Double, number / 10),
                ("xformOpOrder", names.TokenArray, Vt.TokenArray(steps)),
            ):
                uniform = name in ("subdivisionScheme", "xformOpOrder")
                variability = Sdf.VariabilityUniform if uniform else Sdf.VariabilityVarying
                Sdf.AttributeSpec(prim, name, type, variability).default = value
            applied = Sdf.TokenListOp.Create(prependedItems=["MaterialBindingAPI"])
            prim.SetInfo("apiSchemas", applied)
            binding = Sdf.RelationshipSpec(prim, "material:binding", False)
            binding.targetPathList.Prepend(materials[number % 10])


def _mesh(stage: Any, size: int, scheme: str = "none") -> None:
    from pxr import UsdGeom, Vt

    side = round(size**0.5)
    mesh = UsdGeom.Mesh.Define(stage, "/mesh")
    x, y = np.meshgrid(np.arange(side + 1), np.arange(side + 1))
    points = np.stack((x, y, np.sin(x / 9.0) * np.cos(y / 9.0)), axis=-1).reshape(-1, 3)
    first = (np.arange(side)[:, None] * (side + 1) + np.arange(side)).reshape(-1, 1)
    faces = (first + np.array((0, 1, side + 2, side + 1))).astype(np.int32)
    mesh.CreatePointsAttr(Vt.Vec3fArray.FromNumpy(points.astype(np.float32)))
    mesh.CreateFaceVertexCountsAttr(Vt.IntArray.FromNumpy(np.full(len(faces), 4, np.int32)))
    mesh.CreateFaceVertexIndicesAttr(Vt.IntArray.FromNumpy(faces.ravel()))
    mesh.CreateSubdivisionSchemeAttr(scheme)


STAGES: dict[str, Callable[[Any, int], None]] = {
    "point instances": _points,
    "native instances": _natives,
    "distinct prims": _distinct,
    "faces of a mesh": _mesh,
    "faces of a cage": lambda stage, size: _mesh(stage, size, "catmullClark"),
}
"""Native instances and distinct prims are a tenth of the size."""


def measure(kind: str, size: int, path: Path) -> Import:
    """Compile the stage at `path` and take its figures."""
    from pxr import Usd

    import compiler.usd.stage  # noqa: F401  (its modules count as neither time nor memory)
    from compiler.flatten import flatten
    from compiler.usd import import_stage
    from compiler.usd.clock import numbers
    from dsl.garbage import seldom_collecting

    stage = Usd.Stage.Open(str(path))
    for prim in stage.TraverseAll():
        for attribute in prim.GetAttributes():
            # Arrays are mapped from the file, and count as usd-core's once they are looked at.
            value = numbers(attribute.Get())
            if value is not None:
                np.sum(value)
    before, wall, cpu = _resident(), time.perf_counter(), time.process_time()
    with seldom_collecting():  # as whoever compiles does
        graph, _ = import_stage(path)
        of_graph = time.process_time() - cpu
        ir = flatten(graph, lambda file: (None, [])).ir
    wall, cpu, after = time.perf_counter() - wall, time.process_time() - cpu, _peak()
    opening = time.process_time()
    again = Usd.Stage.Open(str(path))
    opening = time.process_time() - opening
    assert again
    assert ir is not None
    each = (after - before) / size
    return Import(kind, size, wall, cpu, of_graph, opening, each, len(ir.prototype_kind))


def _resident() -> int:
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return resource.getpagesize() * pages


def _peak() -> int:
    # `ru_maxrss` of a process begins with what its parent had.
    status = Path("/proc/self/status").read_text()
    return 1024 * int(status.split("VmHWM:")[1].split()[0])


def _plot(rows: list[Import], path: str) -> None:
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots()
    for kind in STAGES:
        own = [row for row in rows if row.kind == kind]
        axes.loglog([r.size for r in own], [r.wall for r in own], marker="o", label=kind)
    axes.set(xlabel="instances, prims or faces", ylabel="seconds to compile")
    axes.legend()
    figure.savefig(path)


def main() -> None:
    """Print a row for each stage as its figures come."""
    from pxr import Usd

    parser = argparse.ArgumentParser(prog="python -m benchmarks.usd_import", description=__doc__)
    parser.add_argument("--plot", help="a picture of the growth")
    parser.add_argument("--one", nargs=3, help=argparse.SUPPRESS)
    given = parser.parse_args()
    if given.one:
        print(*astuple(measure(given.one[0], int(given.one[1]), Path(given.one[2]))), sep="|")
        return
    print("| stage | size | compile | CPU | graph | usd-core opens | peak, each | prototypes |")
    print("|---|---|---|---|---|---|---|---|", flush=True)
    rows = []
    for kind, make in STAGES.items():
        for size in SIZES:
            count = size // 10 if make in (_natives, _distinct) else size
            with tempfile.TemporaryDirectory() as folder:
                path = Path(folder) / "stage.usdc"
                stage = Usd.Stage.CreateNew(str(path))
                make(stage, size)
                stage.Save()
                command = [sys.executable, "-m", "benchmarks.usd_import", "--one"]
                told = subprocess.run(
                    [*command, kind, str(count), str(path)],
                    capture_output=True, text=True, check=True,
                ).stdout.strip().split("|")  # fmt: skip
            wall, cpu, graph, opening, each = (float(n) for n in told[2:7])
            row = Import(kind, count, wall, cpu, graph, opening, each, int(told[7]))
            rows.append(row)
            print(
                f"| {kind} | {count:,} | {row.wall:.2f} s | {row.cpu:.2f} s | {row.graph:.2f} s "
                f"| {row.opening:.2f} s | {row.bytes_each:,.0f} B | {row.prototypes} |",
                flush=True,
            )
    if given.plot:
        _plot(rows, given.plot)


if __name__ == "__main__":
    main()
