"""Which parameter of which signature an argument is for."""

from __future__ import annotations

from dataclasses import dataclass

from dsl.language_service.cursor import Cursor
from dsl.language_service.describe import Form, forms
from dsl.language_service.program import Program
from dsl.language_service.project import Project


@dataclass(frozen=True, slots=True)
class SignatureHelp:
    """The ways to call what is being called; `parameter` is None beyond the last one."""

    forms: tuple[Form, ...]
    active: int
    parameter: int | None


def signature_help(project: Project, program: Program, offset: int) -> SignatureHelp | None:
    """Help on the innermost call around an offset."""
    cursor = Cursor(project, program, offset)
    call = None if cursor.in_comment else cursor.call()
    if call is None or call.callee.callee is None:
        return None
    listed = forms(call.callee.callee, call.callee.home)
    wanted = {*call.given, *([call.name] if call.name else [])}

    def misfit(form: Form) -> int:
        names = [_name(word) for word, _ in form.parameters]
        surplus = max(0, call.argument + 1 - len(names)) if "…" not in names else 0
        return len(wanted.difference(names)) + surplus

    active = min(range(len(listed)), key=lambda number: misfit(listed[number]))
    names = [_name(word) for word, _ in listed[active].parameters]
    position: int | None = call.argument
    if call.name is not None:
        position = names.index(call.name) if call.name in names else None
    elif call.argument >= len(names):
        position = len(names) - 1 if "…" in names else None
    return SignatureHelp(tuple(listed), active, position)


def _name(word: str) -> str:
    return word.partition(":")[0]
