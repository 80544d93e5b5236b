"""Programs with a cursor in them, written `‸`."""

from __future__ import annotations

from dsl.language_service.program import Program
from dsl.language_service.project import Project


def at_cursor(text: str, **others: str) -> tuple[Project, Program, int]:
    """A project of `main.ovo` and other files by name, the program, and the cursor's offset."""
    before, _, after = text.partition("‸")
    project = Project()
    for name, other in others.items():
        project.open(f"/scenes/{name}.ovo", other)
    project.open("/scenes/main.ovo", before + after)
    program = project.program("/scenes/main.ovo")
    assert program is not None
    return project, program, len(before.encode())
