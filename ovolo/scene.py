"""Scenes: compiled once, then traced and rendered."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from operator import index
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Literal, SupportsIndex

from compiler.compilation import Compilation, Time, compile_path, compile_text, strictly
from compiler.ir import SceneIR
from compiler.usd.options import Complexity, Isolation, StageOptions
from dsl.diagnostics import Diagnostic
from dsl.files import Files
from dsl.parameters import Settings
from dsl.scene import FloatArray, Integrator, Param, Precision
from dsl.spans import Place

if TYPE_CHECKING:
    from runtime.film import Film
    from runtime.tracer import Tracer


class Scene:
    """A scene without faults, made by `compile` or `compile_file`."""

    def __init__(self, compilation: Compilation) -> None:
        self._compilation = compilation

    @property
    def ir(self) -> SceneIR:
        """The flat arrays that the runtime reads."""
        return self._compilation.ir

    @property
    def warnings(self) -> tuple[Diagnostic, ...]:
        """What is worth a word, though it is no fault; for stages, also what was dropped."""
        return self._compilation.warnings

    @property
    def params(self) -> tuple[Param, ...]:
        """The parameters of a program, with their values and what they may be."""
        return self._compilation.graph.params

    @property
    def bounds(self) -> FloatArray | None:
        """(2, 3) world-space box of all that is bounded, lower corner first; None if nothing is."""
        from compiler.bounds import bounds

        return bounds(self.ir)

    def tracer(
        self,
        precision: Literal["float32", "float64", "reference"] = "float64",
        isa: str | None = None,
        threads: int = 0,
    ) -> Tracer:
        """The scene prepared for tracing batches of rays.

        `precision` "reference" is the interpreter that walks the nested scene: slow, and the
        judge of the other two. `isa` and `threads`: see `runtime.tracer.Tracer`.
        """
        from runtime.tracer import Tracer

        if precision == "reference":
            from runtime.reference import ReferenceTracer

            return Tracer.over(ReferenceTracer(self._compilation.graph, self._compilation.load))
        return Tracer(self.ir, precision, isa, threads)

    def object_path(self, instance: SupportsIndex) -> str:
        """What made an instance: `dome[3]/course/block[7]`, or the prim path in a stage.

        Raises IndexError where the scene has no such instance (a miss has -1), and TypeError for
        what is no integer.
        """
        from compiler.provenance import object_path

        return object_path(self.ir, index(instance))

    def source_span(self, instance: SupportsIndex) -> Place | None:
        """Which words, or which prim, made an instance; None if nobody said.

        Raises IndexError and TypeError, as `object_path`.
        """
        from compiler.provenance import source_place

        return source_place(self.ir, index(instance), self._compilation.graph.sources)

    def render(
        self,
        *,
        width: int | None = None,
        height: int | None = None,
        samples: int | None = None,
        camera: str | int | None = None,
        integrator: Integrator | None = None,
        precision: Precision | None = None,
        seed: int = 0,
        threads: int = 0,
        progress: Callable[[float, int], object] | None = None,
        surfaces: bool = True,
    ) -> Film:
        """A picture; None takes the scene's own setting, or else the default.

        `camera` is a name or a number. `progress(done, rays)` is called now and then; what it
        raises ends the render. Without `surfaces` the film has no depth, normal and instance
        images, and takes less time and memory. Raises ValueError for settings out of range.
        """
        from runtime.render import render

        return render(
            self.ir,
            width=width,
            height=height,
            samples=samples,
            camera=camera,
            integrator=integrator,
            precision=precision,
            seed=seed,
            threads=threads,
            progress=progress,
            surfaces=surfaces,
            root=self._compilation.reader.files.root,
        )

    def export(self, path: str | PathLike[str], *, tolerance: float | None = 1e-3) -> None:
        """Write the scene as a USD stage (.usd, .usda, .usdc, .usdz), which compiles to the same.

        `tolerance` is how far the mesh of a solid that USD does not know may be from the solid,
        in parts of its diameter; None writes no meshes, and other programs do not see those
        solids (see `docs/usd.md`). Raises OSError where the file cannot be written.
        """
        from compiler.usd_export import ExportOptions, export_stage

        export_stage(self._compilation, Path(path), ExportOptions(tolerance=tolerance))

    def __repr__(self) -> str:
        ir = self.ir
        return (
            f"Scene({self._compilation.graph.name!r}, {len(ir.instance_target)} instances of "
            f"{len(ir.prototype_kind)} prototypes)"
        )


def compile_file(
    path: str | PathLike[str],
    time: Time = None,
    *,
    complexity: Complexity = "low",
    params: Settings | None = None,
    purposes: Iterable[str] | None = None,
    payloads: bool = True,
    prim: str | None = None,
    mask: Iterable[str] = (),
    variants: Iterable[str] = (),
    strict: bool = False,
    root: str | PathLike[str] | None = None,
    isolate: bool = False,
    deadline: float | None = None,
    memory_limit: int | None = None,
) -> Scene:
    """Compile a scene program (.ovo) or a USD stage (.usd, .usda, .usdc, .usdz).

    `time` is what the program calls `time`, or a time code of the stage, or "earliest"; None is 0
    for a program and default values for a stage. `params` are values for a program's parameters,
    by name: numbers, truth values, text, tuples for vectors and colors, and for angles text with a
    unit ("30deg"). With a `root`, the file lies in that folder and
    nothing outside of it is read. `strict` makes warnings errors: a scene is drawn whole or not
    at all. Raises CompileError, whose `diagnostics` tell what is wrong and where, also for files
    that cannot be read.

    The rest is about stages (`docs/usd.md`), also those that a program uses. `complexity` says
    how subdivision meshes are drawn: "low" is their cage, "limit" their limit surface. `purposes`
    are drawn beside "default"; None: what the stage's render settings include, or else "render".
    `mask` are paths of prims outside of which nothing of the stage is read, `prim` the only one
    that is drawn, in place. `variants` are selected in the stage, each written as
    `/World/Car{color=red}`. With `isolate` stages are imported in a child process, so that a
    hostile one cannot take this process with it; `deadline` (seconds) and `memory_limit`
    (bytes) end it, and imply `isolate`.
    """
    options = StageOptions(
        purposes=None if purposes is None else frozenset({"default", *purposes}),
        payloads=payloads,
        complexity=complexity,
        mask=tuple(mask),
        variants=tuple(variants),
    )
    isolated = isolate or deadline is not None or memory_limit is not None
    compilation = compile_path(
        Path(path),
        time,
        options,
        Files(None if root is None else Path(root)),
        params=params,
        prim=prim,
        isolation=Isolation(deadline, memory_limit) if isolated else None,
    )
    return Scene(strictly(compilation) if strict else compilation)


def compile(
    text: str,
    name: str = "scene.ovo",
    root: str | PathLike[str] | None = None,
    time: float | None = None,
    params: Settings | None = None,
) -> Scene:
    """Compile the text of a scene program.

    `name` stands for the text in diagnostics. With a `root`, the files that the program names
    must lie in that folder; without, they are found relative to `name`. `time` and
    `params`: see `compile_file`. Raises CompileError.
    """
    if not isinstance(text, str):
        raise TypeError(f"a program is a str, not {type(text).__name__}")
    files = Files(None if root is None else Path(root))
    return Scene(compile_text(text, name, files, time, params=params))
