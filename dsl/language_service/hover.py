"""What is shown of the word under the pointer."""

from __future__ import annotations

from dataclasses import dataclass

from dsl.language_service.describe import documentation, headline
from dsl.language_service.meaning import Reader
from dsl.language_service.occurrences import index
from dsl.language_service.program import Program
from dsl.language_service.project import Project
from dsl.language_service.values import Valued, Values, shown_value
from dsl.spans import Span


@dataclass(frozen=True, slots=True)
class Hover:
    """Markdown about the word at a place."""

    span: Span
    markdown: str


def hover(
    project: Project, program: Program, offset: int, values: Values | None = None
) -> Hover | None:
    """The signature, the value or its kind, and the documentation of what stands at an offset."""
    found = index(project, program).at(offset)
    if found is None:
        return None
    target = found.target
    code = headline(target, found.home)
    if isinstance(target, Valued) and found.home is not None:
        known = values.get(target) if values is not None and found.home is program else None
        value = shown_value(known)
        kind = Reader(project, found.home).defined(target, found.home).kind
        if value is not None or kind:
            code += f"\n// {kind if value is None else f'= {value}'}"
    parts = [f"```ovolo\n{code}\n```", documentation(target)]
    return Hover(found.span, "\n\n".join(part for part in parts if part))
