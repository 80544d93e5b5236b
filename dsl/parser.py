"""Tokens to syntax tree; never raises.

Recursive descent. A fault ends its statement only: reading goes on after the next newline, the
names that a faulty `let`, `fn` or `use` introduces stay defined, and what could not be read is
`Missing`, so one fault does not cause others.
"""

from __future__ import annotations

from typing import NoReturn

from dsl import ast
from dsl.budget import DEFAULT_LIMITS, Limits
from dsl.diagnostics import Diagnostic
from dsl.expression_parser import ExpressionParser
from dsl.lexer import tokenize
from dsl.spans import Source, Span
from dsl.token_reader import Abandon, SyntaxFault
from dsl.tokens import Token

_FUNCTION = "a function is defined with `fn name(…) { … }`"
_LET = "write `let name = value`"
_USE = 'write `use "file.ovo" as name`'
_ELSEWHERE = {
    "def": _FUNCTION,
    "function": _FUNCTION,
    "module": _FUNCTION,
    "return": "the value of a function is that of its block: leave `return` out",
    "while": "loops run over intervals and lists: `for i in 0..n { … }`",
    "import": _USE,
    "include": _USE,
    "const": _LET,
    "var": _LET,
}
"""Words that begin statements elsewhere, and what is written instead."""


def parse(source: Source, limits: Limits = DEFAULT_LIMITS) -> tuple[ast.Module, list[Diagnostic]]:
    """The syntax tree of a source, complete but for what the diagnostics are about."""
    tokens, diagnostics = tokenize(source, limits)
    return parse_tokens(source, tokens, diagnostics, limits), diagnostics


def parse_tokens(
    source: Source, tokens: list[Token], diagnostics: list[Diagnostic], limits: Limits
) -> ast.Module:
    """The syntax tree of a source in words; `diagnostics` receives the faults."""
    return _Parser(source, tokens, diagnostics, limits).module()


class _Parser(ExpressionParser):
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
        except Abandon:
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
            except SyntaxFault:
                self.recover()
            self.nesting = nesting

    def end_of_statement_expected(self) -> NoReturn:
        help = "each statement has a line of its own"
        before = self.tokens[self.position - 1]
        if before.kind == "name" and before.value in _ELSEWHERE:
            word = str(before.value)
            message = f"`{word}` is no word of the language"
            self.report("syntax-expected", message, before, help=_ELSEWHERE[word])
            raise SyntaxFault
        if self.token.kind == "=":
            help = "`==` compares; `let name = value` names a value"
        elif self.token.kind in ("{", "name") and before.kind == ")":
            help = "each statement has its own line; a map follows its object: `sphere().scale(2)`"
        elif self.token.kind == "{":
            help = "a function is defined with `fn name(…) { … }`"
        elif self.token.kind == "else":
            help = "put `else` on the line of the `}` before it"
        elif self.token.kind in (")", "]"):
            self.report("syntax-unmatched", f"this `{self.token.kind}` closes nothing", self.token)
            raise SyntaxFault
        self.expected("the end of the statement", help)

    def statement(self) -> ast.Statement:
        match self.token.kind:
            case "let":
                return self.let()
            case "fn":
                return self.function()
            case "use":
                return self.use()
            case "param":
                return self.param()
            case _:
                return self.expression()

    def let(self) -> ast.Statement:
        doc = self.documentation()
        start = self.advance()
        name = self.binding_name("a name after `let`")
        try:
            self.expect("=", help="write `let name = value`")
            value = self.expression()
        except SyntaxFault:
            self.recover()
            value = ast.Missing(self.span(start))
        return ast.Let(self.span(start), str(name.value), self.token_span(name), value, doc)

    def function(self) -> ast.Statement:
        doc = self.documentation()
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
        except SyntaxFault:
            self.recover()
        return ast.Function(
            self.span(start), str(name.value), self.token_span(name), tuple(parameters), body, doc
        )

    def parameter(self) -> ast.Parameter:
        doc = self.documentation()
        name = self.binding_name("a parameter's name")
        default = None
        if self.token.kind == "=":
            self.advance()
            default = self.expression()
        elif self.token.kind == ":":
            self.expected("`,` or `)`", "parameters have no types; a default is `name = value`")
        return ast.Parameter(self.span(name), str(name.value), self.token_span(name), default, doc)

    def use(self) -> ast.Statement:
        doc = self.documentation()
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
        return ast.Use(self.span(start), path, str(name.value), self.token_span(name), doc)

    def param(self) -> ast.Statement:
        doc = self.documentation()
        start = self.advance()
        if self.nesting:
            self.report(
                "syntax-param-place",
                "a `param` stands at the top of a file, not in a block",
                start,
                help="move it out of the block, or write `let`",
            )
        name = self.binding_name("a name after `param`")
        default: ast.Expression = ast.Missing(self.span(start))
        allowed: ast.Expression | None = None
        try:
            self.expect("=", help="write `param name = default` or `param name = default in 0..1`")
            default = self.expression()
            if self.token.kind == "in":
                self.advance()
                allowed = self.expression()
        except SyntaxFault:
            self.recover()
        return ast.Param(
            self.span(start), str(name.value), self.token_span(name), default, allowed, doc
        )

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
