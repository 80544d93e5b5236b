"""Files that a scene names → nodes: meshes by trimesh, stages by the USD importer."""

from __future__ import annotations

import io
import warnings
from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path, PurePath
from typing import Any, Literal

import numpy as np

from compiler.usd.options import Isolation, StageOptions
from dsl.budget import DEFAULT_LIMITS
from dsl.codes import diagnostic
from dsl.diagnostics import Diagnostic
from dsl.files import FileFault, Files
from dsl.limits import SIZES
from dsl.scene import File, FloatArray, IntArray, Mesh, Node, Origin
from dsl.spans import Place

FORMATS = ("glb", "gltf", "obj", "off", "ply", "stl")


def load_file(
    file: File,
    files: Files,
    *,
    time: float | Literal["earliest"] | None = None,
    options: StageOptions = StageOptions(),  # noqa: B008  (frozen)
    isolation: Isolation | None = None,
    max_triangles: int = DEFAULT_LIMITS.mesh_triangles,
) -> tuple[Node | None, list[Diagnostic]]:
    """The object of a file, read through `files`, and what its reader has to say.

    `time` is the time code at which stages are read, `options` and `isolation` say how (see
    `compiler.usd`); of stages only objects come in, for their cameras, lights and up axis are of
    their own scene. None, and an error, where the file cannot be read.
    """
    place = file.origin.place if file.origin else None
    try:
        if file.kind == "mesh":
            return load_mesh(
                file.path,
                files,
                folder=file.folder or "",
                origin=file.origin,
                max_triangles=max_triangles,
            )
        path = files.resolve(file.path, file.folder or "")
    except FileFault as fault:
        return None, [fault.diagnostic(place)]
    from compiler.usd import import_stage

    # Masks and variants are of the stage that the command line names.
    options = replace(
        options,
        surroundings=False,
        mask=(),
        variants=(),
        root=files.root,
        name=str(PurePath(file.folder or "") / file.path),
    )
    graph, diagnostics = import_stage(
        path, time=time, prim=file.prim, options=options, isolation=isolation
    )
    return graph.root, diagnostics


def load_mesh(
    path: str,
    files: Files,
    *,
    folder: str = "",
    origin: Origin | None = None,
    max_triangles: int = DEFAULT_LIMITS.mesh_triangles,
) -> tuple[Mesh | None, list[Diagnostic]]:
    """The triangles of a mesh file, in the order and with the points of the file.

    Formats as in `FORMATS`; polygons are cut into fans. Of a file that holds several meshes, each
    is placed as the file says and all become one. Faces of points that are missing or not finite
    are dropped with a warning. What the file refers to is read through `files` too. Raises
    FileFault where the file cannot be had.
    """
    place = origin.place if origin else None
    ending = Path(path).suffix.lower().removeprefix(".")
    if ending not in FORMATS:
        known = ", ".join(FORMATS)
        message = f"`{path}` is of no known mesh format"
        return None, [diagnostic("mesh-format", message, place, help=f"formats are {known}")]
    data = files.read_bytes(path, folder)
    beside = _Beside(files, str(Path(folder) / Path(path).parent))
    try:
        points, triangles = _read(data, ending, beside)
    except FileFault as fault:
        return None, [fault.diagnostic(place)]
    except Exception as error:
        # trimesh raises whatever its parsers stumble over; the user's file is at fault.
        reason = str(error).split("\n")[0] or type(error).__name__
        return None, [diagnostic("mesh-unreadable", f"`{path}` cannot be read: {reason}", place)]
    if len(triangles) > max_triangles:
        message = f"`{path}` has {len(triangles)} triangles, more than {max_triangles}"
        return None, [diagnostic("mesh-too-large", message, place)]
    return _checked(path, points, triangles, origin, place)


def _read(data: bytes, ending: str, beside: Mapping[str, bytes]) -> tuple[FloatArray, IntArray]:
    """Points and triangles of all meshes of a file, each placed as the file says."""
    import trimesh

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        scene: Any = trimesh.load_scene(
            io.BytesIO(data),
            file_type=ending,
            resolver=beside,
            process=False,
            maintain_order=True,
            skip_materials=True,
        )
    points: list[FloatArray] = [np.empty((0, 3))]
    triangles: list[IntArray] = [np.empty((0, 3), dtype=np.int64)]
    count = 0
    for node in scene.graph.nodes_geometry:
        matrix, name = scene.graph[node]
        mesh = scene.geometry[name]
        if not isinstance(mesh, trimesh.Trimesh):
            continue
        placed = np.asarray(mesh.vertices, dtype=np.float64)
        if not np.array_equal(matrix, np.eye(4)):
            placed = placed @ matrix[:3, :3].T + matrix[:3, 3]
        faces = np.asarray(mesh.faces, dtype=np.int64)
        # Indices that are out of range must not come to mean points of the next mesh.
        outside = np.asarray(((faces < 0) | (faces >= len(placed))).any(axis=1))
        triangles.append(np.where(outside[:, None], -1, faces + count))
        points.append(placed)
        count += len(placed)
    return np.concatenate(points), np.concatenate(triangles)


def _checked(
    path: str, points: FloatArray, triangles: IntArray, origin: Origin | None, place: Place | None
) -> tuple[Mesh | None, list[Diagnostic]]:
    finite = np.append((np.abs(points) <= SIZES[1]).all(axis=1), False)
    sound = np.asarray(finite[triangles].all(axis=1))
    dropped = len(triangles) - int(sound.sum())
    diagnostics = []
    if dropped:
        triangles = triangles[sound]
        # Points that are not finite stay in place, so that indices do.
        points = np.where(finite[:-1, None], points, 0.0)
        message = f"`{path}`: {dropped} faces of points that are missing or not finite are left out"
        diagnostics.append(diagnostic("mesh-bad-faces", message, place))
    if not len(triangles):
        message = f"`{path}` has no triangles"
        return None, [*diagnostics, diagnostic("mesh-empty", message, place)]
    return Mesh(points, triangles, origin), diagnostics


class _Beside(Mapping[str, bytes]):
    """The files that a mesh file may refer to, by the names it uses."""

    def __init__(self, files: Files, folder: str) -> None:
        self._files, self._folder = files, folder

    def __getitem__(self, name: str) -> bytes:
        return self._files.read_bytes(name, self._folder)

    def __iter__(self) -> Iterator[str]:
        return iter(())

    def __len__(self) -> int:
        return 0


def write_obj(mesh: Mesh, path: Path) -> None:
    """Write a mesh as an OBJ file, its points exactly. Raises OSError."""
    lines = [f"v {x!r} {y!r} {z!r}" for x, y, z in mesh.points.tolist()]
    lines += [f"f {a} {b} {c}" for a, b, c in (mesh.triangles + 1).tolist()]
    path.write_text("\n".join(lines) + "\n", encoding="ascii")
