"""Tokens to syntax tree; never raises.

Recursive descent with precedence climbing. A fault ends its statement only: reading goes on after
the next newline, names that a faulty `let`, `fn` or `use` introduces stay defined, and what
could not be read is `Missing`, so one fault does not cause others.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NoReturn, TypeVar

from dsl import ast
from dsl.budget import DEFAULT_LIMITS, Limits
from dsl.codes import diagnostic
from dsl.diagnostics import Diagnostic, Label
from dsl.lexer import tokenize
from dsl.spans import Source, Span
from dsl.tokens import KEYWORDS, Token, describe

_LEVELS = {
    "or": 0,
    "and": 1,
    "==": 3,
    "!=": 3,
    "<": 3,
    "<=": 3,
    ">": 3,
    ">=": 3,
    "..": 4,
    "+": 5,
    "-": 5,
    "*": 6,
    "/": 6,
    "%": 6,
}
"""Binding strength of the binary operators; `not` stands at 2, unary `-` above all."""
_NOT, _COMPARISON, _INTERVAL, _PREFIX = 2, 3, 4, 7

_Item = TypeVar("_Item")


def parse(source: Source, limits: Limits = DEFAULT_LIMITS) -> tuple[ast.Module, list[Diagnostic]]:
    """The syntax tree of a source, complete but for what the diagnostics are about."""
    tokens, diagnostics = tokenize(source, limits)
    parser = _Parser(source, tokens, diagnostics, limits)
    return parser.module(), diagnostics


class _Fault(Exception):
    """The statement being read cannot be completed; its fault has been reported."""


class _Abandon(Exception):
    """The rest of the source is not worth reading."""


class _Parser:
    def __init__(
        self,
        source: Source,
        tokens: list[Token],
        diagnostics: list[Diagnostic],
        limits: Limits,
    ) -> None:
        self.source = source
        self.tokens = tokens
        self.diagnostics = diagnostics
        self.limits = limits
        self.position = 0
        self.token = tokens[0]
        self.nesting = 0
        self.tainted = False  # a fault in this statement has been reported
        self.unclosed = False  # so has a block that reaches the end of the file

    # Tokens

    def advance(self) -> Token:
        token = self.token
        self.tainted |= token.kind == "fault"
        if token.kind != "end":
            self.position += 1
            self.token = self.tokens[self.position]
        return token

    def next_kind(self) -> str:
        return self.tokens[min(self.position + 1, len(self.tokens) - 1)].kind

    def span(self, start: Token) -> Span:
        """From a token to the one before the current."""
        end = self.tokens[self.position - 1].end if self.position else start.end
        return Span(self.source, start.start, max(end, start.start))

    def token_span(self, token: Token) -> Span:
        return Span(self.source, token.start, token.end)

    def skip_newlines(self) -> None:
        while self.token.kind == "newline":
            self.advance()

    # Faults

    def report(
        self,
        code: str,
        message: str,
        place: Token | Span,
        text: str = "",
        *,
        help: str | None = None,
        secondary: tuple[Label, ...] = (),
    ) -> None:
        if not self.tainted:
            span = place if isinstance(place, Span) else self.token_span(place)
            self.diagnostics.append(
                diagnostic(code, message, span, text, help=help, secondary=secondary)
            )
        self.tainted = True
        if len(self.diagnostics) >= self.limits.diagnostics:
            raise _Abandon

    def expected(
        self, what: str, help: str | None = None, secondary: tuple[Label, ...] = ()
    ) -> NoReturn:
        if self.token.kind == "fault":
            self.tainted = True
        place = self.token
        if place.kind == "newline":
            place = Token("newline", place.start, place.start)
        self.report(
            "syntax-expected",
            f"expected {what}, found {describe(self.token)}",
            place,
            help=help,
            secondary=secondary,
        )
        raise _Fault

    def expect(self, kind: str, help: str | None = None) -> Token:
        if self.token.kind != kind:
            self.expected(f"`{kind}`", help)
        return self.advance()

    def recover(self) -> None:
        """Skip to the end of the statement: a newline or the brace that closes the block."""
        depth = 0
        while self.token.kind != "end":
            kind = self.token.kind
            if depth == 0 and kind in ("newline", "}"):
                return
            if kind in ("(", "[", "{"):
                depth += 1
            elif kind in (")", "]", "}"):
                depth = max(0, depth - 1)
            self.advance()

    def deeper(self, token: Token) -> None:
        self.nesting += 1
        if self.nesting > self.limits.nesting:
            self.report(
                "limit-nesting",
                f"more than {self.limits.nesting} brackets, blocks or prefixes within one another",
                token,
                help="name the inner parts with `let`",
            )
            raise _Abandon

    # Statements

    def module(self) -> ast.Module:
        statements: list[ast.Statement] = []
        complete = True
        try:
            while self.token.kind != "end":
                self.statements(statements)
                if self.token.kind == "}":
                    self.tainted = False
                    self.report("syntax-unmatched", "this `}` closes nothing", self.token)
                    self.advance()
        except _Abandon:
            complete = False
        whole = Span(self.source, 0, self.tokens[-1].end)
        return ast.Module(self.source, ast.Block(whole, tuple(statements)), complete)

    def statements(self, into: list[ast.Statement]) -> None:
        """Read statements up to a closing brace or the end."""
        while True:
            self.skip_newlines()
            if self.token.kind in ("end", "}"):
                return
            self.tainted = False
            nesting = self.nesting
            try:
                statement = self.statement()
                ended = self.token.kind in ("newline", "end", "}")
                if ended or isinstance(statement, ast.Definition):
                    into.append(statement)
                if not ended:
                    self.end_of_statement_expected()
            except _Fault:
                self.nesting = nesting
                self.recover()

    def end_of_statement_expected(self) -> NoReturn:
        help = None
        if self.token.kind == "=":
            help = "`==` compares; `let name = value` names a value"
        elif self.token.kind == "{":
            help = "a function is defined with `fn name(…) { … }`"
        elif self.token.kind == "else":
            help = "put `else` on the line of the `}` before it"
        elif self.token.kind in (")", "]"):
            self.report("syntax-unmatched", f"this `{self.token.kind}` closes nothing", self.token)
            raise _Fault
        self.expected("the end of the statement", help)

    def statement(self) -> ast.Statement:
        match self.token.kind:
            case "let":
                return self.let()
            case "fn":
                return self.function()
            case "use":
                return self.use()
            case _:
                return self.expression()

    def binding_name(self, what: str) -> Token:
        token = self.token
        if token.kind == "name":
            return self.advance()
        if token.kind == "reserved" or token.kind in KEYWORDS:
            self.report(
                "syntax-reserved-word",
                f"`{token.value or token.kind}` is a word of the language and cannot be a name",
                token,
                help="choose another name",
            )
            raise _Fault
        return self.expected(what)

    def let(self) -> ast.Statement:
        start = self.advance()
        name = self.binding_name("a name after `let`")
        try:
            self.expect("=", help="write `let name = value`")
            value = self.expression()
        except _Fault:
            self.recover()
            value = ast.Missing(self.span(start))
        return ast.Let(self.span(start), str(name.value), self.token_span(name), value)

    def function(self) -> ast.Statement:
        start = self.advance()
        name = self.binding_name("a name after `fn`")
        parameters: list[ast.Parameter] = []
        body: ast.Block | None = None
        try:
            opener = self.expect("(", help="write `fn name(parameters) { … }`")
            parameters = self.sequence(opener, ")", "parameter", self.parameter)
            if self.token.kind != "{":
                self.expected("`{` and the function's body", "write `fn name(parameters) { … }`")
            body = self.block()
        except _Fault:
            self.recover()
        return ast.Function(
            self.span(start), str(name.value), self.token_span(name), tuple(parameters), body
        )

    def parameter(self) -> ast.Parameter:
        name = self.binding_name("a parameter's name")
        default = None
        if self.token.kind == "=":
            self.advance()
            default = self.expression()
        elif self.token.kind == ":":
            self.expected("`,` or `)`", "parameters have no types; a default is `name = value`")
        return ast.Parameter(self.span(name), str(name.value), self.token_span(name), default)

    def use(self) -> ast.Statement:
        start = self.advance()
        path: ast.String | None = None
        if self.token.kind == "string":
            token = self.advance()
            path = ast.String(self.token_span(token), str(token.value))
        elif self.token.kind == "fault":
            self.advance()
        else:
            self.expected("a file's name", 'write `use "file.ovo" as name`')
        if self.token.kind != "as":
            self.expected("`as` and a name", 'write `use "file.ovo" as name`')
        self.advance()
        name = self.binding_name("a name after `as`")
        return ast.Use(self.span(start), path, str(name.value), self.token_span(name))

    def block(self) -> ast.Block:
        start = self.advance()
        self.deeper(start)
        statements: list[ast.Statement] = []
        self.statements(statements)
        if self.token.kind == "}":
            self.advance()
        elif not self.unclosed:
            self.tainted = False
            self.unclosed = True  # the blocks around it lack the same brace
            self.report(
                "syntax-unclosed", "this `{` is never closed", start, help="add a `}` for it"
            )
        self.nesting -= 1
        return ast.Block(self.span(start), tuple(statements))

    # Expressions

    def expression(self, level: int = 0) -> ast.Expression:
        start = self.token
        left = self.prefix()
        while (binary := _LEVELS.get(self.token.kind, -1)) >= level:
            operands = [left]
            operators: list[ast.Operator] = []
            while _LEVELS.get(self.token.kind) == binary:
                if operators and binary in (_COMPARISON, _INTERVAL):
                    self.chained(operators[0])
                token = self.advance()
                operators.append(ast.Operator(self.token_span(token), token.kind))
                operands.append(self.expression(binary + 1))
            left = ast.Operation(self.span(start), tuple(operands), tuple(operators))
        return left

    def chained(self, first: ast.Operator) -> NoReturn:
        if first.symbol == "..":
            self.expected("the end of the interval", "an interval has two ends, `a..b`")
        self.report(
            "syntax-chained-comparison",
            "a comparison cannot be compared again",
            self.token,
            secondary=(Label(first.span, "the first comparison"),),
            help="write `a < b and b < c`",
        )
        raise _Fault

    def prefix(self) -> ast.Expression:
        token = self.token
        if token.kind not in ("-", "not"):
            return self.suffixes()
        self.deeper(token)
        self.advance()
        operand = self.expression(_NOT if token.kind == "not" else _PREFIX)
        self.nesting -= 1
        operator = ast.Operator(self.token_span(token), token.kind)
        return ast.Unary(self.span(token), operator, operand)

    def suffixes(self) -> ast.Expression:
        start = self.token
        base = self.primary()
        suffixes: list[ast.Suffix] = []
        while True:
            opener = self.token
            if opener.kind == "(":
                self.advance()
                arguments = self.arguments(opener)
                suffixes.append(ast.Call(self.span(opener), arguments))
            elif opener.kind == "[":
                self.deeper(self.advance())
                index = self.expression()
                self.close(opener, "]")
                suffixes.append(ast.Index(self.span(opener), index))
            elif opener.kind == ".":
                self.advance()
                member = self.token
                if member.kind not in ("name", "reserved") and member.kind not in KEYWORDS:
                    self.expected("a name after `.`")
                self.advance()
                name = str(member.value or member.kind)
                suffixes.append(ast.Member(self.token_span(member), name))
            else:
                break
        return ast.Chain(self.span(start), base, tuple(suffixes)) if suffixes else base

    def arguments(self, opener: Token) -> tuple[ast.Argument, ...]:
        arguments = self.sequence(opener, ")", "argument", self.argument)
        named: ast.Argument | None = None
        for argument in arguments:
            if argument.name is not None:
                named = argument
            elif named is not None:
                self.report(
                    "syntax-positional-after-named",
                    "an argument without a name after one with a name",
                    argument.span,
                    secondary=(Label(named.span, "this one has a name"),),
                    help="name it too, or move it to the front",
                )
                raise _Fault
        return tuple(arguments)

    def argument(self) -> ast.Argument:
        start = self.token
        named = self.next_kind() == ":" and (
            start.kind in ("name", "reserved") or start.kind in KEYWORDS
        )
        if named:
            self.advance()
            self.advance()
        elif self.next_kind() == "=" and start.kind == "name":
            self.advance()
            self.expected("`:`", f"write `{start.value}: value`")
        value = self.expression()
        return ast.Argument(
            self.span(start),
            str(start.value or start.kind) if named else None,
            self.token_span(start) if named else None,
            value,
        )

    def sequence(
        self, opener: Token, closer: str, what: str, item: Callable[[], _Item]
    ) -> list[_Item]:
        """Items between brackets, separated by commas; the last may be followed by one."""
        self.deeper(opener)
        items: list[_Item] = []
        while self.token.kind != closer:
            if self.token.kind == ",":
                self.expected(f"an {what}" if what[0] in "aeiou" else f"a {what}")
            items.append(item())
            if self.token.kind != ",":
                break
            self.advance()
        self.close(opener, closer, f"`,` or `{closer}`")
        return items

    def close(self, opener: Token, closer: str, expected: str = "") -> None:
        kind = self.token.kind
        if kind != closer:
            label = Label(self.token_span(opener), f"this `{opener.kind}` is open")
            if kind in ("newline", "end", "let", "fn", "use", "}"):
                self.report(
                    "syntax-unclosed",
                    f"this `{opener.kind}` is never closed",
                    opener,
                    help=f"add a `{closer}` for it",
                )
                raise _Fault
            self.expected(expected or f"`{closer}`", secondary=(label,))
        self.advance()
        self.nesting -= 1

    def primary(self) -> ast.Expression:
        token = self.token
        span = self.token_span(token)
        match token.kind:
            case "number":
                self.advance()
                return ast.Number(span, _as_float(token))
            case "angle":
                self.advance()
                return ast.AngleLiteral(span, _as_float(token))
            case "string":
                self.advance()
                return ast.String(span, str(token.value))
            case "color":
                self.advance()
                assert isinstance(token.value, tuple)
                return ast.ColorLiteral(span, token.value)
            case "true" | "false":
                self.advance()
                return ast.Boolean(span, token.kind == "true")
            case "name":
                self.advance()
                return ast.Name(span, str(token.value))
            case "(":
                return self.parenthesised()
            case "[":
                self.advance()
                items = self.sequence(token, "]", "item", self.expression)
                return ast.ListLiteral(self.span(token), tuple(items))
            case "{":
                return self.block()
            case "if":
                return self.conditional()
            case "for":
                return self.loop()
            case "fault":
                self.advance()
                return ast.Missing(span)
            case "reserved":
                self.report(
                    "syntax-reserved-word",
                    f"`{token.value}` is reserved",
                    token,
                    help="it will have a meaning in a later version",
                )
                raise _Fault
            case _:
                return self.no_expression()

    def no_expression(self) -> NoReturn:
        help = None
        before = self.tokens[self.position - 1].kind if self.position else ""
        if self.token.kind == "newline" and before in _LEVELS:
            help = "a newline ends a statement unless a round or square bracket is open"
        elif self.token.kind == ".":
            help = "a number begins with a digit: `0.5`"
        elif self.token.kind == "else":
            help = "put `else` on the line of the `}` before it"
        elif self.token.kind in (")", "]") and before in ("", "newline"):
            self.report("syntax-unmatched", f"this `{self.token.kind}` closes nothing", self.token)
            raise _Fault
        elif self.token.kind in ("*", "/", "%", "+") and before in ("newline", "{", "}"):
            help = "a newline ends a statement unless a round or square bracket is open"
        self.expected("an expression", help)

    def parenthesised(self) -> ast.Expression:
        opener = self.advance()
        items = self.sequence(opener, ")", "expression", self.expression)
        span = self.span(opener)
        if not items:
            self.report("syntax-expected", "expected an expression between `(` and `)`", span)
            raise _Fault
        if len(items) > 4:
            self.report(
                "syntax-vector-length",
                f"a vector has two, three or four components, not {len(items)}",
                span,
                help="a list is written in square brackets: [a, b, …]",
            )
            raise _Fault
        return items[0] if len(items) == 1 else ast.VectorLiteral(span, tuple(items))

    def conditional(self) -> ast.Expression:
        start = self.token
        branches: list[tuple[ast.Expression, ast.Block]] = []
        otherwise: ast.Block | None = None
        while True:
            self.advance()
            condition = self.expression()
            if self.token.kind != "{":
                help = "`==` compares" if self.token.kind == "=" else "write `if condition { … }`"
                self.expected("`{`", help)
            branches.append((condition, self.block()))
            if self.token.kind != "else":
                break
            self.advance()
            if self.token.kind == "{":
                otherwise = self.block()
                break
            if self.token.kind != "if":
                self.expected("`{` or `if` after `else`")
        return ast.If(self.span(start), tuple(branches), otherwise)

    def loop(self) -> ast.Expression:
        start = self.advance()
        variables: list[ast.LoopVariable] = []
        while True:
            name = self.binding_name("a name after `for`" if not variables else "a name after `,`")
            self.expect("in", help="write `for i in 0..n { … }`")
            values = self.expression()
            variables.append(
                ast.LoopVariable(self.span(name), str(name.value), self.token_span(name), values)
            )
            if self.token.kind != ",":
                break
            self.advance()
        if self.token.kind != "{":
            self.expected("`{` and the loop's body", "write `for i in 0..n { … }`")
        return ast.For(self.span(start), tuple(variables), self.block())


def _as_float(token: Token) -> float:
    assert isinstance(token.value, float)
    return token.value
