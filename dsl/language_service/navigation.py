"""From a word to its definition and to everything else that speaks of the same."""

from __future__ import annotations

from dsl import ast
from dsl.language_service.occurrences import Occurrence, index
from dsl.language_service.program import Defined, Program
from dsl.language_service.project import Project
from dsl.spans import Span


def definition(project: Project, program: Program, offset: int) -> Span | None:
    """The name in the definition of what stands at an offset; the start of a used file."""
    for use in program.uses:
        if use.path is not None and use.path.span.start <= offset <= use.path.span.end:
            used = project.used(program, use)
            return None if used is None else Span(used.source, 0, 0)
    found = index(project, program).at(offset)
    if found is None or not isinstance(found.target, Defined):
        return None
    return found.target.name_span


def references(project: Project, program: Program, offset: int) -> list[Occurrence]:
    """All occurrences of what stands at an offset, in all programs that can speak of it.

    Nothing for builtins outside this program.
    """
    own = index(project, program)
    found = own.at(offset)
    if found is None:
        return []
    result = [each for each in own.found if same(each, found)]
    if found.home is None or not _is_visible_outside(found.home, found.target):
        return result
    for other in project.programs():
        if other.path != program.path:
            result += [each for each in index(project, other).found if same(each, found)]
    return result


def same(one: Occurrence, other: Occurrence) -> bool:
    """Whether two occurrences speak of the same thing."""
    return one.target is other.target or (
        not isinstance(one.target, Defined) and one.target == other.target
    )


def _is_visible_outside(home: Program, target: object) -> bool:
    """Whether other files can name it: a top-level name, or a parameter of a function."""
    for statement in home.module.body.statements:
        if statement is target or (
            isinstance(statement, ast.Function) and target in statement.parameters
        ):
            return True
    return False
