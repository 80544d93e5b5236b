"""Syntax tree to scene graph."""

from __future__ import annotations

from contextlib import suppress

from dsl import ast, chains, expressions, statements
from dsl.budget import DEFAULT_LIMITS, Limits
from dsl.codes import diagnostic
from dsl.diagnostics import Diagnostic
from dsl.faults import Exhausted
from dsl.files import FileFault, Files
from dsl.garbage import seldom_collecting
from dsl.observation import stage
from dsl.parameters import Settings, unknown_settings
from dsl.parser import read
from dsl.run import Handler, Run
from dsl.scene import Node, SceneGraph
from dsl.spans import Source, Span
from dsl.values import POISON, Scope

_HANDLERS: dict[type, Handler] = {
    ast.Missing: expressions.missing,
    ast.Number: expressions.plain,
    ast.Boolean: expressions.plain,
    ast.AngleLiteral: expressions.angle,
    ast.String: expressions.string,
    ast.ColorLiteral: expressions.color,
    ast.Name: expressions.name,
    ast.VectorLiteral: expressions.vector,
    ast.ListLiteral: expressions.listed,
    ast.Unary: expressions.unary,
    ast.Operation: expressions.operation,
    ast.If: expressions.conditional,
    ast.For: statements.loop,
    ast.Block: statements.block,
    ast.Chain: chains.chain,
}


def evaluate(
    module: ast.Module,
    files: Files,
    limits: Limits = DEFAULT_LIMITS,
    time: float = 0.0,
    settings: Settings | None = None,
    scope: Scope | None = None,
) -> tuple[SceneGraph | None, list[Diagnostic]]:
    """The scene that a module denotes, or None with the faults that it has; never raises.

    `time`, a finite number, is what the program calls so; `settings` are values of its
    parameters, see `dsl.parameters`. Relative file names start from the
    folder of the module's source name. Faults of parsing are not repeated, but a module with
    `Missing` parts gives no scene. `scope` receives the values of the top-level names.
    """
    run = Run(files, limits, _HANDLERS)
    run.time = time
    run.source, run.settings = module.source, settings or {}
    if not module.complete:
        return None, []
    run.report(*unknown_settings(module, run.settings)[: limits.diagnostics])
    own = ""  # for a program that is no file
    with suppress(FileFault):
        own = str(files.resolve(module.source.name))
    run.loaded[own] = None
    try:
        root = run.drive(statements.module(run, module, scope or Scope()))
        if isinstance(root, Node) and not run.faulty:
            name, params, advice = module.source.name, tuple(run.params), tuple(run.advice)
            return SceneGraph(root, name, run.sources, params, advice), run.diagnostics
        if root is not POISON and not isinstance(root, Node):
            run.record(statements.no_scene_value(root, statements.only(module.body)))
    except Exhausted as exhausted:
        if exhausted.diagnostic is not None:
            run.diagnostics.append(exhausted.diagnostic)
    return None, run.diagnostics


def evaluate_source(
    source: Source,
    files: Files,
    limits: Limits = DEFAULT_LIMITS,
    time: float = 0.0,
    settings: Settings | None = None,
) -> tuple[SceneGraph | None, list[Diagnostic]]:
    """Parse and evaluate: the scene, unless there are errors, and all diagnostics in order."""
    with seldom_collecting():
        with stage("parse"):
            module, faults = read(source, limits)
        with stage("evaluate"):
            graph, more = evaluate(module, files, limits, time, settings)
    diagnostics = in_order([*faults, *more])
    if len(diagnostics) > limits.diagnostics:
        message = f"only the first {limits.diagnostics} faults are shown"
        diagnostics = [*diagnostics[: limits.diagnostics], diagnostic("limit-diagnostics", message)]
    return (None if faults else graph), diagnostics


def in_order(diagnostics: list[Diagnostic]) -> list[Diagnostic]:
    """Sorted by file, in order of first mention, then by place; those without a span last."""
    files: dict[str, int] = {}

    def key(found: Diagnostic) -> tuple[int, int]:
        place = found.primary.place if found.primary is not None else None
        if not isinstance(place, Span):
            return len(diagnostics), 0
        return files.setdefault(place.source.name, len(files)), place.start

    return sorted(diagnostics, key=key)
