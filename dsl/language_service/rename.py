"""New names for what programs define, without any program changing its meaning."""

from __future__ import annotations

from dsl import ast
from dsl.budget import DEFAULT_LIMITS
from dsl.language_service.navigation import references
from dsl.language_service.occurrences import Occurrence, index
from dsl.language_service.program import Defined, Program
from dsl.language_service.project import Project
from dsl.lexer import tokenize
from dsl.spans import Source, Span

Edits = dict[str, list[tuple[Span, str]]]
"""By path: places and their new text."""


class RefusedError(Exception):
    """The name cannot be that; the message says why."""


def renamable(project: Project, program: Program, offset: int) -> Occurrence | None:
    """The word at an offset, if the program, or a file that it uses, defines it."""
    found = index(project, program).at(offset)
    return found if found is not None and isinstance(found.target, Defined) else None


def rename(project: Project, program: Program, offset: int, name: str) -> Edits:
    """The edits that give what stands at an offset another name, in all programs.

    Raises RefusedError where `name` is no name, or where a program would then mean something
    else: an inner definition would capture a use, or a definition would exist already.
    """
    occurrence = renamable(project, program, offset)
    if occurrence is None:
        raise RefusedError("there is no name here that a program defines")
    tokens, _ = tokenize(Source("", name), DEFAULT_LIMITS)
    if [token.kind for token in tokens] != ["name", "end"] or tokens[0].value != name:
        raise RefusedError(f"`{name}` cannot be a name")
    found = references(project, program, offset)
    _check_all_known(project, occurrence)
    edits: Edits = {}
    for each in found:
        edits.setdefault(each.span.source.name, []).append((each.span, name))
    for path, changes in edits.items():
        before = program if path == program.path else project.program(path)
        assert before is not None
        _check_same_meaning(before, changes, name)
    return edits


def _check_all_known(project: Project, occurrence: Occurrence) -> None:
    """Refuse what a value that is handed on may be asked for: not all uses can be found.

    That is a parameter of a function that is also used as a value, and a top-level name of a file
    that is.
    """
    target, home = occurrence.target, occurrence.home
    assert home is not None
    owner = next((f for f in _functions(home) if target in f.parameters), None)
    if owner is not None:
        uses = references(project, home, owner.name_span.start)
        if any(each.escapes for each in uses):
            raise RefusedError(
                f"`{owner.name}` is also used as a value, so not all its calls are known"
            )
    if target not in home.top_level.values():
        return
    for program in project.programs():
        for each in index(project, program).found:
            if each.escapes and _is_use_of(project, each, home):
                raise RefusedError(
                    f"the file is used as a value in `{program.path}`, so not all uses are known"
                )


def _functions(program: Program) -> list[ast.Function]:
    return [node for node in program.resolution.definitions if isinstance(node, ast.Function)]


def _is_use_of(project: Project, found: Occurrence, home: Program) -> bool:
    target = found.target
    return (
        isinstance(target, ast.Use)
        and found.home is not None
        and project.used(found.home, target) is home
    )


def _check_same_meaning(before: Program, changes: list[tuple[Span, str]], name: str) -> None:
    """Refuse edits after which a name in the file refers to another definition than before."""
    text, end = b"", 0
    for span, new in sorted(changes, key=lambda change: change[0].start):
        text += before.encoded[end : span.start] + new.encode()
        end = span.end
    text += before.encoded[end:]
    after = Program(before.path, text.decode("utf-8", "surrogatepass"))
    if _shape(before) != _shape(after):
        raise RefusedError(f"`{name}` has another meaning in `{before.path}`, or would get one")


def _shape(program: Program) -> list[object]:
    """What every name in a file refers to, however it is called; and its faults of naming."""
    resolution = program.resolution
    numbers = {binding: n for n, binding in enumerate(resolution.definitions.values())}
    uses = sorted(resolution.uses.items(), key=lambda use: use[0].span.start)
    faults: list[object] = [
        d.code for d in (*program.faults, *resolution.diagnostics) if d.severity == "error"
    ]
    return faults + [numbers.get(b, -1 if b.span is not None else b.name) for _, b in uses]
