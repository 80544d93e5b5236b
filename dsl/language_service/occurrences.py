"""Where a program speaks of something: definitions, uses, members of files, named arguments."""

from __future__ import annotations

from bisect import bisect_right
from dataclasses import dataclass
from itertools import islice

from dsl import ast
from dsl.garbage import seldom_collecting
from dsl.language_service.meaning import METHODS, Meaning, Reader
from dsl.language_service.program import Defined, Program, walk
from dsl.language_service.project import Project
from dsl.spans import Span
from dsl.values import Binding, Builtin, Parameter


@dataclass(frozen=True, slots=True)
class BuiltinParameter:
    """A parameter of a builtin, at a call that names it."""

    builtin: Builtin
    parameter: Parameter


Target = Defined | Builtin | BuiltinParameter | Binding
"""What is spoken of; a `Binding` is a builtin that is no function."""


@dataclass(frozen=True, slots=True)
class Occurrence:
    """A word and what it speaks of; `home` has the definition, if a program has it.

    `escapes` says that the value of a function or a file is taken without a call or a member.
    """

    span: Span
    target: Target
    home: Program | None
    is_definition: bool = False
    escapes: bool = False


def index(project: Project, program: Program) -> Index:
    """The index of a program, made anew when it or a file that it uses has changed."""
    sources = tuple(project.reachable(program))
    if program.remembered is None or program.remembered[0] != sources:
        program.remembered = (sources, Index(project, program))
    found: Index = program.remembered[1]
    return found


class Index:
    """All occurrences in a program, in order of their places."""

    @seldom_collecting()
    def __init__(self, project: Project, program: Program) -> None:
        self.reader = Reader(project, program)
        self.program = program
        self.found: list[Occurrence] = []
        followed: set[ast.Name] = set()  # names that a call or a member follows
        for node in walk(program.module.body):
            if isinstance(node, ast.Chain):
                if isinstance(node.base, ast.Name) and not isinstance(node.suffixes[0], ast.Index):
                    followed.add(node.base)
                self._chain(node)
            elif isinstance(node, Defined):
                self._add(node.name_span, node, program, is_definition=True)
            elif isinstance(node, ast.Name):
                self._name(node, node not in followed)
        self.found.sort(key=lambda occurrence: occurrence.span.start)
        self._starts = [occurrence.span.start for occurrence in self.found]

    def at(self, offset: int) -> Occurrence | None:
        """The occurrence whose word an offset is in, or at the end of."""
        position = bisect_right(self._starts, offset) - 1
        found = self.found[position] if position >= 0 else None
        return found if found is not None and offset <= found.span.end else None

    def _add(
        self,
        span: Span,
        target: Target,
        home: Program | None,
        is_definition: bool = False,
        escapes: bool = False,
    ) -> None:
        self.found.append(Occurrence(span, target, home, is_definition, escapes))

    def _name(self, node: ast.Name, escapes: bool) -> None:
        binding = self.program.resolution.uses.get(node)
        if binding is None:
            return
        if binding.value is not None:
            builtin = isinstance(binding.value, Builtin)
            self._add(node.span, binding.value if builtin else binding, None)  # type: ignore[arg-type]
        elif (definition := self.program.definitions.get(binding)) is not None:
            self._add(node.span, definition, self.program, escapes=escapes)

    def _chain(self, node: ast.Chain) -> None:
        for position, suffix in enumerate(node.suffixes):
            following = node.suffixes[position + 1] if position + 1 < len(node.suffixes) else None
            if isinstance(suffix, ast.Member):
                self._member(node, position, suffix, following)
            elif isinstance(suffix, ast.Call) and any(a.name for a in suffix.arguments):
                self._arguments(self._callee(node, position), suffix)

    def _member(
        self, node: ast.Chain, position: int, member: ast.Member, following: ast.Suffix | None
    ) -> None:
        # Only the first suffixes can be members of files.
        before = self._files(node, position)
        if before is not None and before.file is not None:
            target = before.file.top_level.get(member.name)
            if target is not None:
                escapes = not isinstance(following, ast.Call | ast.Member)
                self._add(member.span, target, before.file, escapes=escapes)
        elif before is None and isinstance(following, ast.Call) and member.name in METHODS:
            self._add(member.span, METHODS[member.name], None)

    def _files(self, node: ast.Chain, position: int) -> Meaning | None:
        """What is before a suffix, if it can be a file; None for other values."""
        if not isinstance(node.base, ast.Name):
            return None
        if not all(isinstance(suffix, ast.Member) for suffix in islice(node.suffixes, position)):
            return None
        before = self.reader.chain(node, position)
        return before if before.kind == "a file" else None

    def _callee(self, node: ast.Chain, position: int) -> Meaning:
        before = node.suffixes[position - 1] if position else None
        if isinstance(before, ast.Member) and self._files(node, position - 1) is None:
            return Meaning(callee=METHODS.get(before.name))
        return self.reader.chain(node, position)

    def _arguments(self, callee: Meaning, call: ast.Call) -> None:
        for argument in call.arguments:
            if argument.name is None or argument.name_span is None:
                continue
            if isinstance(callee.callee, Builtin):
                for signature in callee.callee.signatures:
                    named = [p for p in signature.parameters if p.name == argument.name]
                    if named:
                        target = BuiltinParameter(callee.callee, named[0])
                        self._add(argument.name_span, target, None)
                        break
            elif callee.callee is not None:
                for parameter in callee.callee.parameters:
                    if parameter.name == argument.name:
                        self._add(argument.name_span, parameter, callee.home)
