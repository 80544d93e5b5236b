"""What an expression gives, as far as its text alone tells.

Nothing is evaluated: the kind of a value follows from literals, from what builtins say that they
give, and from the definitions of names. What is not known is "".
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from dsl import ast
from dsl.language_service.program import NAMES, Defined, Program
from dsl.language_service.project import Project
from dsl.materials import BIND, OVERRIDE
from dsl.transforms import PLACE
from dsl.values import Builtin

METHODS: dict[str, Builtin] = {**PLACE, "material": BIND, "override": OVERRIDE}
"""The suffix calls of objects; lights and cameras have those of `PLACE`."""

Lookup = Callable[[str], "Defined | Builtin | None"]
_DEEPEST = 40  # definitions that are followed to find a kind


@dataclass(frozen=True, slots=True)
class Meaning:
    """What is known of a value.

    `kind` is as `dsl.values.type_name` says it; `callee` is what a call of it calls, `home` the
    file in which that is defined; `file` is the program that a `use` names.
    """

    kind: str = ""
    callee: ast.Function | Builtin | None = None
    home: Program | None = None
    file: Program | None = None


_UNKNOWN = Meaning()


class Reader:
    """Finds meanings in one program; `lookup` says what a name is where an expression stands."""

    def __init__(
        self, project: Project, program: Program, lookup: Lookup | None = None, depth: int = 0
    ) -> None:
        self.project = project
        self.program = program
        self.lookup = lookup
        self.depth = depth

    def kind(self, node: ast.Expression) -> str:
        """The kind of an expression's value."""
        return self.meaning(node).kind

    def meaning(self, node: ast.Expression) -> Meaning:
        """What is known of an expression's value."""
        match node:
            case ast.Number():
                return Meaning("a number")
            case ast.AngleLiteral():
                return Meaning("an angle")
            case ast.Boolean():
                return Meaning("a truth value")
            case ast.String():
                return Meaning("a string")
            case ast.ColorLiteral():
                return Meaning("a color")
            case ast.VectorLiteral():
                return Meaning(f"a vector of {len(node.components)}")
            case ast.ListLiteral():
                return Meaning("a list")
            case ast.Name():
                return self.named(node)
            case ast.Unary():
                return (
                    Meaning("a truth value")
                    if node.operator.symbol == "not"
                    else self.inner(node.operand)
                )
            case ast.Operation():
                return Meaning(self.operation(node))
            case ast.For():
                return Meaning("an object")
            case ast.Block():
                return self.block(node)
            case ast.If():
                return self.block(node.branches[0][1])
            case ast.Chain():
                return self.chain(node, len(node.suffixes))
            case _:
                return _UNKNOWN

    def inner(self, node: ast.Expression) -> Meaning:
        """The meaning of a part, unless it is too deep to look at."""
        self.depth += 1
        try:
            return self.meaning(node) if self.depth < _DEEPEST else _UNKNOWN
        finally:
            self.depth -= 1

    def block(self, block: ast.Block) -> Meaning:
        """A block's value: its only expression, or the group of them."""
        found = [s for s in block.statements if not isinstance(s, ast.Definition)]
        return self.inner(found[0]) if len(found) == 1 else Meaning("an object")

    def operation(self, node: ast.Operation) -> str:
        """The kind of what operators give."""
        symbol = node.operators[0].symbol
        if symbol in ("==", "!=", "<", "<=", ">", ">=", "and", "or"):
            return "a truth value"
        kinds = [self.inner(operand).kind for operand in node.operands[:4]]
        if symbol == "..":
            return f"an interval of {'angles' if 'an angle' in kinds else 'numbers'}"
        if symbol == "/" and kinds == ["an angle", "an angle"]:
            return "a number"
        return next((kind for kind in kinds if kind != "a number"), "a number")

    def named(self, node: ast.Name) -> Meaning:
        """The meaning of a name where it stands."""
        if self.lookup is not None:
            found = self.lookup(node.name)
            return _UNKNOWN if found is None else self.defined(found, self.program)
        binding = self.program.resolution.uses.get(node)
        if binding is None:
            return _UNKNOWN
        if isinstance(binding.value, Builtin):
            return Meaning("a function", binding.value)
        if binding.value is not None:
            return Meaning("a number")
        definition = self.program.definitions.get(binding)
        return _UNKNOWN if definition is None else self.defined(definition, self.program)

    def defined(self, definition: Defined | Builtin, home: Program) -> Meaning:
        """The meaning of what is defined in a program."""
        if isinstance(definition, Builtin):
            return Meaning("a function", definition)
        reader = Reader(self.project, home, depth=self.depth + 1)
        if reader.depth >= _DEEPEST:
            return _UNKNOWN
        match definition:
            case ast.Function():
                return Meaning("a function", definition, home)
            case ast.Use():
                return Meaning("a file", file=self.project.used(home, definition))
            case ast.LoopVariable():
                return reader.item(definition.range)
            case ast.Let():
                return reader.meaning(definition.value)
            case _:
                default = getattr(definition, "default", None)
                return _UNKNOWN if default is None else reader.meaning(default)

    def item(self, node: ast.Expression) -> Meaning:
        """One of what a loop or an index goes over."""
        if isinstance(node, ast.ListLiteral):
            return self.inner(node.items[0]) if node.items else _UNKNOWN
        kind = self.inner(node).kind
        return Meaning("a number" if kind.startswith(("an interval", "a vector")) else "")

    def chain(self, node: ast.Chain, count: int) -> Meaning:
        """The base of a chain with so many of its suffixes."""
        found = self.inner(node.base)
        suffixes = node.suffixes[:count]
        position = 0
        while position < count:
            suffix = suffixes[position]
            following = suffixes[position + 1] if position + 1 < count else None
            position += 1
            match suffix:
                case ast.Member() if found.file is not None:
                    member = found.file.top_level.get(suffix.name)
                    found = self.defined(member, found.file) if member is not None else _UNKNOWN
                case ast.Member() if isinstance(following, ast.Call):
                    position += 1
                    if suffix.name not in METHODS and suffix.name != "inverse":
                        found = _UNKNOWN
                    elif suffix.name == "inverse":
                        found = Meaning("a transform")
                    elif found.kind not in ("a light", "a camera"):
                        found = Meaning("an object")
                case ast.Member():
                    angle = found.kind == "an interval of angles"
                    known = "an angle" if angle else "a number"
                    found = Meaning(known if suffix.name in members(found.kind) else "")
                case ast.Call():
                    found = self.called(found)
                case ast.Index():
                    found = self.item(node.base) if position == 1 else _UNKNOWN
        return found

    def called(self, found: Meaning) -> Meaning:
        """What a call of it gives."""
        if isinstance(found.callee, Builtin):
            return Meaning(found.callee.result)
        if found.callee is None or found.callee.body is None or found.home is None:
            return _UNKNOWN
        reader = Reader(self.project, found.home, depth=self.depth + 1)
        return reader.block(found.callee.body) if reader.depth < _DEEPEST else _UNKNOWN


def members(kind: str) -> tuple[str, ...]:
    """The members that are no calls of a value of that kind."""
    if kind.startswith("a vector"):
        count = kind.removeprefix("a vector of ")
        return tuple("xyzw"[: int(count)] if count.isdigit() else "xyz")
    if kind == "a color":
        return ("r", "g", "b")
    return ("start", "end") if kind.startswith("an interval") else ()


def methods(kind: str) -> dict[str, Builtin]:
    """The suffix calls of a value of that kind; of one of unknown kind, those of objects."""
    if kind in ("", "an object"):
        return METHODS
    return PLACE if kind in ("a light", "a camera") else {}


def builtin_named(name: str) -> Builtin | None:
    """The builtin function of that name."""
    binding = NAMES.get(name)
    return binding.value if binding is not None and isinstance(binding.value, Builtin) else None
