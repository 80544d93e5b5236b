"""The way from a file, or a text, to the IR: one front end each for programs and stages."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Literal

from compiler.flatten import Pruned, flatten
from compiler.ir import SceneIR
from dsl.diagnostics import CompileError, Diagnostic
from dsl.evaluate import evaluate_source
from dsl.files import FileFault, Files
from dsl.scene import File, Node, SceneGraph
from dsl.spans import Source

Time = float | Literal["earliest"] | None

STAGE_SUFFIXES = (".usd", ".usda", ".usdc", ".usdz")


@dataclass(frozen=True, slots=True, eq=False)
class Compilation:
    """A scene without errors: its graph, its IR, and what is worth a warning."""

    graph: SceneGraph
    ir: SceneIR
    pruned: Pruned
    warnings: tuple[Diagnostic, ...]
    files: Files

    def load(self, file: File) -> Node:
        """What a node of the graph that names a file stands for."""
        node, diagnostics = _load(file, self.files)
        if node is None:
            raise CompileError(diagnostics)
        return node


def compile_text(text: str, name: str = "scene.ovo", files: Files | None = None) -> Compilation:
    """Compile a scene program.

    `name` is what diagnostics print; the files that the program names are found relative to its
    folder, and read through `files`. Raises CompileError.
    """
    files = files or Files()
    graph, diagnostics = evaluate_source(Source(name, text), files)
    return _compile_graph(graph, diagnostics, files)


def compile_path(path: Path, time: Time = None) -> Compilation:
    """Compile a scene program or a USD stage, by the file's suffix.

    `time` is a stage's time code, its "earliest", or None for default values. Raises
    CompileError, also when the file cannot be read.
    """
    files = Files()
    try:
        if path.suffix.lower() not in STAGE_SUFFIXES:
            return compile_text(files.read_text(str(path)), str(path), files)
        files.resolve(str(path))
    except FileFault as fault:
        raise CompileError([fault.diagnostic(None)]) from None
    from compiler.usd import import_stage

    graph, diagnostics = import_stage(path, time=time)
    return _compile_graph(graph, diagnostics, files)


def _compile_graph(
    graph: SceneGraph | None, diagnostics: list[Diagnostic], files: Files
) -> Compilation:
    _stop_at_errors(diagnostics)
    assert graph is not None, "a front end that finds no errors makes a graph"
    ir, faults, pruned = flatten(graph, partial(_load, files=files))
    diagnostics = [*diagnostics, *faults]
    _stop_at_errors(diagnostics)
    assert ir is not None, "flattening that finds no errors makes an IR"
    return Compilation(graph, ir, pruned, tuple(diagnostics), files)


def _load(file: File, files: Files) -> tuple[Node | None, list[Diagnostic]]:
    from compiler.mesh import load_file

    return load_file(file, files)


def _stop_at_errors(diagnostics: list[Diagnostic]) -> None:
    if any(diagnostic.severity == "error" for diagnostic in diagnostics):
        raise CompileError(diagnostics)
