"""The way from a file, or a text, to the IR: one front end each for programs and stages."""

from __future__ import annotations

from dataclasses import asdict, replace
from math import isfinite
from pathlib import Path
from typing import Any, Literal

from compiler.advice import MOST_ADVICE, advise
from compiler.flatten import Pruned, flatten
from compiler.ir import SceneIR
from compiler.usd.options import Isolation, StageOptions
from dsl.budget import DEFAULT_LIMITS, Limits
from dsl.diagnostics import CompileError, Diagnostic
from dsl.evaluate import evaluate_source, in_order
from dsl.files import FileFault, Files
from dsl.garbage import seldom_collecting
from dsl.observation import stage
from dsl.parameters import Settings, unknown_settings
from dsl.records import node, value
from dsl.scene import File, Group, Node, SceneGraph
from dsl.scene import Settings as SceneSettings
from dsl.spans import Source

Time = float | Literal["earliest"] | None

AS_IT_IS = StageOptions()
STAGE_SUFFIXES = (".usd", ".usda", ".usdc", ".usdz")


@value
class Reader:
    """How the files that a scene names are read: through `files`, stages at `time`."""

    files: Files
    time: Time = None
    options: StageOptions = AS_IT_IS
    isolation: Isolation | None = None
    limits: Limits = DEFAULT_LIMITS

    def __call__(self, file: File) -> tuple[Node | None, list[Diagnostic]]:
        """The object of a file, or None and an error (see `compiler.mesh.load_file`)."""
        from compiler.mesh import load_file

        return load_file(
            file,
            self.files,
            time=self.time,
            options=self.options,
            isolation=self.isolation,
            max_triangles=self.limits.mesh_triangles,
        )


@node
class Compilation:
    """A scene without errors: its graph, its IR, and what is worth a warning."""

    graph: SceneGraph
    ir: SceneIR
    pruned: Pruned
    warnings: tuple[Diagnostic, ...]
    reader: Reader

    def load(self, file: File) -> Node:
        """What a node of the graph that names a file stands for."""
        node, diagnostics = self.reader(file)
        if node is None:
            raise CompileError(diagnostics)
        return node

    @property
    def product(self) -> str | None:
        """What a stage's render settings call the picture's file."""
        root = self.graph.root
        nodes = root.items if isinstance(root, Group) else (root,)
        return next((n.product for n in nodes if isinstance(n, SceneSettings) and n.product), None)

    def figures(self) -> dict[str, Any]:
        """What the scene consists of, as JSON values.

        The fields of `compiler.inspect.Summary`, `params` with those of `dsl.scene.Param`, `pruned`
        with those of `Pruned`, and `hash`: that of what the picture depends on.
        """
        from compiler.inspect import summarize
        from compiler.ir_binary import content_hash

        return {
            **asdict(summarize(self.ir)),
            "params": [asdict(param) for param in self.graph.params],
            "pruned": asdict(self.pruned),
            "hash": content_hash(self.ir),
        }


@seldom_collecting()
def compile_text(
    text: str,
    name: str = "scene.ovo",
    files: Files | None = None,
    time: Time = None,
    limits: Limits = DEFAULT_LIMITS,
    params: Settings | None = None,
    *,
    options: StageOptions = AS_IT_IS,
    isolation: Isolation | None = None,
) -> Compilation:
    """Compile a scene program.

    `name` is what diagnostics print; the files that the program names are found relative to its
    folder, and read through `files`. `time` is the program's `time`, 0 unless it is a number, and
    the time code of the stages among its files, which are read by `options` and in `isolation` (see
    `compiler.usd`); `params` are values for its parameters by name (`dsl.parameters`). Raises
    CompileError; ValueError for what is no time.
    """
    files = files or Files()
    seconds = 0.0 if time is None or time == "earliest" else float(time)
    if not isfinite(seconds):
        raise ValueError(f"a scene has no time {seconds}")
    source = Source(name, text.removeprefix("\ufeff"))
    graph, diagnostics = evaluate_source(source, files, limits, seconds, params)
    compilation = _compile_graph(
        graph, diagnostics, Reader(files, time, options, isolation, limits)
    )
    return _advised(compilation)


def compile_path(
    path: Path,
    time: Time = None,
    options: StageOptions = AS_IT_IS,
    files: Files | None = None,
    limits: Limits = DEFAULT_LIMITS,
    params: Settings | None = None,
    *,
    prim: str | None = None,
    isolation: Isolation | None = None,
) -> Compilation:
    """Compile a scene program or a USD stage, by the file's suffix.

    `time` is a stage's time code, its "earliest", or None for default values; `options`, `prim`
    and `isolation` are those of `compiler.usd.import_stage`; `params` are values for a program's
    parameters (a stage has none). Where `files` have a root, `path` lies in it and is named from
    there, and so does whatever a stage refers to. Raises CompileError, also when the file cannot
    be read, and ValueError for choices that a program has not.
    """
    files = files or Files()
    try:
        name = files.name(path)
        if path.suffix.lower() not in STAGE_SUFFIXES:
            if prim or options.mask or options.variants:
                raise ValueError(f"prim, mask and variants are for stages, and {path} is none")
            text = Files(files.root).read_text(name, source_bytes=limits.source_bytes)
            return compile_text(
                text, name, files, time, limits, params, options=options, isolation=isolation
            )
        files.resolve(name)
    except FileFault as fault:
        raise CompileError([fault.diagnostic(None)]) from None
    _stop_at_errors(unknown_settings(None, params or {}))
    from compiler.usd import import_stage

    options = replace(options, root=files.root)
    with stage("import"):
        graph, diagnostics = import_stage(
            path, time=time, prim=prim, options=options, isolation=isolation
        )
    return _compile_graph(graph, diagnostics, Reader(files, time, options, isolation))


def _advised(compilation: Compilation) -> Compilation:
    """The compilation of a program with advice among its warnings."""
    graph = compilation.graph
    advice = [*graph.advice, *advise(compilation.ir, graph.sources)][:MOST_ADVICE]
    return replace(compilation, warnings=(*compilation.warnings, *in_order(advice)))


def strictly(compilation: Compilation) -> Compilation:
    """A scene without warnings; others raise CompileError, with their warnings as errors."""
    _stop_at_errors([replace(warning, severity="error") for warning in compilation.warnings])
    return compilation


@seldom_collecting()
def _compile_graph(
    graph: SceneGraph | None, diagnostics: list[Diagnostic], reader: Reader
) -> Compilation:
    _stop_at_errors(diagnostics)
    assert graph is not None, "a front end that finds no errors makes a graph"
    with stage("flatten"):
        ir, faults, pruned = flatten(graph, reader)
    diagnostics = in_order([*diagnostics, *faults])
    _stop_at_errors(diagnostics)
    assert ir is not None, "flattening that finds no errors makes an IR"
    return Compilation(graph, ir, pruned, tuple(diagnostics), reader)


def _stop_at_errors(diagnostics: list[Diagnostic]) -> None:
    if any(diagnostic.severity == "error" for diagnostic in diagnostics):
        raise CompileError(diagnostics)
