"""Names to bindings, before anything is evaluated, so that unused code is checked as well.

Scope is lexical. A `let` or `use` is visible from its end to the end of its block, a `fn` in the
whole of its block, and so functions can call one another. Inner names hide outer ones; a block
defines a name once.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import islice

from dsl import ast
from dsl.codes import diagnostic
from dsl.diagnostics import Diagnostic, Label
from dsl.elsewhere import FILES, WORDS
from dsl.slips import color_of_bytes, descending, hidden_divisor
from dsl.spans import Span
from dsl.suggest import did_you_mean
from dsl.values import Binding

_LITERALS = frozenset(
    (ast.Number, ast.AngleLiteral, ast.Boolean, ast.String, ast.ColorLiteral, ast.Missing)
)
_MOVE_UP = "a `let` is visible only after it: move it up"
_EARLIER = "a default sees only the parameters before it"
_SILENT = ""
_NEST = "all ranges are evaluated before the loop: put a second `for` into its body"


@dataclass(slots=True)
class Resolution:
    """What each use of a name refers to, and what each definition binds.

    A name that nothing defines is not among `uses`. `definitions` has a key for every
    `ast.Definition`, `ast.Parameter` and `ast.LoopVariable`. `advice` is on names that are not used
    or hide others; those of a file that others use are meant for them. `alike` are the names in
    statements of one form.
    """

    uses: dict[ast.Name, Binding] = field(default_factory=dict)
    definitions: dict[object, Binding] = field(default_factory=dict)
    diagnostics: list[Diagnostic] = field(default_factory=list)
    advice: list[Diagnostic] = field(default_factory=list)
    alike: dict[ast.Alike, dict[str, Binding]] = field(default_factory=dict)


@dataclass(slots=True)
class _Frame:
    """Names of one scope; `later` are those it defines further down, with what to do about it."""

    parent: _Frame | None
    names: dict[str, Binding] = field(default_factory=dict)
    later: dict[str, tuple[Span, str]] = field(default_factory=dict)


def resolve(module: ast.Module, builtins: dict[str, Binding], limit: int) -> Resolution:
    """Resolve all names of a module; after `limit` faults, and one more, the rest are silent."""
    resolver = _Resolver(limit, module.source.encoded())
    resolver.block(module.body, _Frame(None, dict(builtins)))
    resolver.advise()
    return resolver.result


class _Resolver:
    def __init__(self, limit: int, text: bytes) -> None:
        self.limit = limit
        self.text = text
        self.result = Resolution()
        self.counts: dict[Binding, int] = {}  # how often each name is used

    def report(
        self, code: str, message: str, span: Span, help: str | None, *secondary: Label
    ) -> None:
        found = diagnostic(code, message, span, help=help, secondary=secondary)
        self.result.diagnostics.append(found)

    def define(self, node: object, name: str, span: Span, frame: _Frame) -> None:
        previous = frame.names.get(name)
        known = previous is not None and previous.span is not None
        if known and isinstance(node, ast.Let) and isinstance(node.value, ast.Missing):
            self.result.definitions.setdefault(node, Binding(name, span))
            return  # the faulty statement may not have been meant to define it
        if previous is not None and previous.span is not None:
            # A function is known before the definitions above it.
            first, second = sorted((previous.span, span), key=lambda place: place.start)
            self.report(
                "name-duplicate",
                f"`{name}` is defined twice here",
                second,
                "choose another name",
                Label(first, "first defined here"),
            )
        binding = self.result.definitions.setdefault(node, Binding(name, span))
        frame.names[name] = binding
        frame.later.pop(name, None)

    def use(self, node: ast.Name, frame: _Frame, member: str = "") -> None:
        """Find what a name refers to; `member` is what is asked of it."""
        scopes: list[_Frame] = []
        later: tuple[Span, str] | None = None
        scope: _Frame | None = frame
        while scope is not None:
            binding = scope.names.get(node.name)
            if binding is not None:
                self.result.uses[node] = binding
                self.counts[binding] = self.counts.get(binding, 0) + 1
                return
            later = later or scope.later.get(node.name)
            scopes.append(scope)
            scope = scope.parent
        if len(self.result.diagnostics) > self.limit or (later and later[1] == _SILENT):
            return
        message = f"nothing here is named `{node.name}`"
        if later is None:
            known = {name for scope in scopes for name in scope.names}
            help = WORDS.get(node.name) or did_you_mean(node.name, known)
            if member in FILES:
                help = f'the name of a file is a string: `"{node.name}.{member}"`'
            self.report("name-unknown", message, node.span, help)
        else:
            place, help = later
            self.report("name-unknown", message, node.span, help, Label(place, "defined only here"))

    def visible(self, name: str, frame: _Frame | None) -> Binding | None:
        """What the program has defined by that name, seen from a frame."""
        while frame is not None:
            binding = frame.names.get(name)
            if binding is not None:
                return binding if binding.span is not None else None
            frame = frame.parent
        return None

    def advise_on(self, slip: Diagnostic | None) -> None:
        if slip is not None:
            self.result.advice.append(slip)

    def hide(self, hidden: Binding, span: Span) -> None:
        """Advise against a definition that hides another and is not made of it."""
        if hidden.span is not None and not hidden.name.startswith("_"):
            label = Label(hidden.span, "this one is hidden")
            message = f"`{hidden.name}` hides another `{hidden.name}`"
            self.result.advice.append(
                diagnostic(
                    "advice-shadowing",
                    message,
                    span,
                    help="choose another name",
                    secondary=(label,),
                )
            )

    def advise(self) -> None:
        """Advise on the names that nothing uses, but for variables of loops."""
        for node, binding in self.result.definitions.items():
            unused = binding not in self.counts and not binding.name.startswith("_")
            if unused and binding.span is not None and not isinstance(node, ast.LoopVariable):
                self.result.advice.append(
                    diagnostic(
                        "advice-unused",
                        f"nothing uses `{binding.name}`",
                        binding.span,
                        help=f"remove it, or call it `_{binding.name}`",
                    )
                )

    def block(self, block: ast.Block, parent: _Frame) -> None:
        frame = _Frame(parent)
        for statement in block.statements:
            if isinstance(statement, ast.Function):
                self.define(statement, statement.name, statement.name_span, frame)
            elif isinstance(statement, ast.Let | ast.Use | ast.Param):
                frame.later.setdefault(statement.name, (statement.name_span, _MOVE_UP))
        for statement in block.statements:
            match statement:
                case ast.Let():
                    hidden = self.visible(statement.name, parent)
                    before = self.counts.get(hidden, 0) if hidden is not None else 0
                    if isinstance(statement.value, ast.Block) and not statement.value.closed:
                        # What is meant to stand after it stands in it.
                        frame.later[statement.name] = statement.name_span, _SILENT
                    self.expression(statement.value, frame)
                    if hidden is not None and self.counts.get(hidden, 0) == before:
                        self.hide(hidden, statement.name_span)
                    self.define(statement, statement.name, statement.name_span, frame)
                    self.advise_on(hidden_divisor(statement, self.text))
                case ast.Param():
                    self.expression(statement.default, frame)
                    if statement.allowed is not None:
                        self.expression(statement.allowed, frame)
                    self.define(statement, statement.name, statement.name_span, frame)
                case ast.Use():
                    self.define(statement, statement.name, statement.name_span, frame)
                case ast.Function():
                    self.function(statement, frame)
                case _:
                    self.expression(statement, frame)

    def function(self, function: ast.Function, parent: _Frame) -> None:
        frame = _Frame(parent)
        for parameter in function.parameters:
            frame.later.setdefault(parameter.name, (parameter.name_span, _EARLIER))
        for parameter in function.parameters:
            if parameter.default is not None:
                self.expression(parameter.default, frame)
            self.define(parameter, parameter.name, parameter.name_span, frame)
        if function.body is not None:
            self.block(function.body, frame)

    def expression(self, node: ast.Expression, frame: _Frame) -> None:
        if type(node) in _LITERALS:
            return
        match node:
            case ast.Name():
                self.use(node, frame)
            case ast.Chain():
                first = node.suffixes[0]
                if isinstance(node.base, ast.Name) and isinstance(first, ast.Member):
                    self.use(node.base, frame, first.name)
                else:
                    self.expression(node.base, frame)
                if isinstance(node.base, ast.Name) and node.base.name == "rgb":
                    binding = self.result.uses.get(node.base)
                    if binding is not None and binding.span is None:
                        self.advise_on(color_of_bytes(node))
                for suffix in node.suffixes:
                    if isinstance(suffix, ast.Call):
                        for argument in suffix.arguments:
                            if type(argument.value) not in _LITERALS:
                                self.expression(argument.value, frame)
                    elif isinstance(suffix, ast.Index):
                        self.expression(suffix.index, frame)
            case ast.Alike():
                known = len(self.result.uses)
                self.expression(node.first, frame)
                new = islice(reversed(self.result.uses.items()), len(self.result.uses) - known)
                self.result.alike[node] = {use.name: binding for use, binding in new}
            case ast.Block():
                self.block(node, frame)
            case ast.VectorLiteral(components=parts) | ast.ListLiteral(items=parts):
                for part in parts:
                    self.expression(part, frame)
            case ast.Operation():
                for operand in node.operands:
                    self.expression(operand, frame)
            case ast.Unary():
                self.expression(node.operand, frame)
            case ast.If():
                for condition, block in node.branches:
                    self.expression(condition, frame)
                    self.block(block, frame)
                if node.otherwise is not None:
                    self.block(node.otherwise, frame)
            case ast.For():
                inner = _Frame(frame)
                variables = {v.name: (v.name_span, _NEST) for v in node.variables}
                for variable in node.variables:
                    self.expression(variable.range, _Frame(frame, later=variables))
                    self.advise_on(descending(variable.range))
                for variable in node.variables:
                    if (hidden := self.visible(variable.name, frame)) is not None:
                        self.hide(hidden, variable.name_span)
                    self.define(variable, variable.name, variable.name_span, inner)
                self.block(node.body, inner)
            case _:
                pass
