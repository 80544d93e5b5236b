"""Tokens to syntax tree; never raises.

Recursive descent. A fault ends its statement only: reading goes on after the next newline, the
names that a faulty `let`, `fn` or `use` introduces stay defined, and what could not be read is
`Missing`, so one fault does not cause others.
"""

from __future__ import annotations

from contextlib import suppress
from dataclasses import replace
from typing import NoReturn

import numpy as np

from dsl import ast
from dsl.alike import Lines, lines_alike, without
from dsl.budget import DEFAULT_LIMITS, Limits
from dsl.diagnostics import Diagnostic
from dsl.elsewhere import DEFINING, LOOP, NEVER, POINT, WORDS
from dsl.expression_parser import ExpressionParser
from dsl.lexer import tokenize
from dsl.spans import Source, Span
from dsl.suggest import did_you_mean
from dsl.token_reader import Abandon, SyntaxFault
from dsl.tokens import KEYWORDS, Token, Tokens, TokenValue

_LET = "write `let name = value`"
_ENDS = ("newline", "end", "}")


def parse(source: Source, limits: Limits = DEFAULT_LIMITS) -> tuple[ast.Module, list[Diagnostic]]:
    """The syntax tree of a source, complete but for what the diagnostics are about."""
    tokens, diagnostics = tokenize(source, limits)
    return parse_tokens(source, tokens, diagnostics, limits), diagnostics


def read(source: Source, limits: Limits = DEFAULT_LIMITS) -> tuple[ast.Module, list[Diagnostic]]:
    """What evaluation needs of the syntax tree: lines of one form are read once, see `ast.Alike`.

    A source with any fault is read as `parse` reads it.
    """
    if alike := lines_alike(source.text):
        short = Source(source.name, without(source.text, alike))
        tokens, diagnostics = tokenize(short, limits)
        if not diagnostics:
            parser = _Parser(source, tokens, diagnostics, limits)
            parser.alike = {int(lines.starts[0]): lines for lines in alike}
            module = parser.module()
            if not diagnostics and not parser.alike:
                return module, diagnostics
    return parse(source, limits)


def one_by_one(alike: ast.Alike, limits: Limits = DEFAULT_LIMITS) -> tuple[ast.Statement, ...]:
    """The statements of one form as `parse` reads them."""
    source, lines = alike.span.source, alike.lines
    tokens, diagnostics = tokenize(Source(source.name, "\n".join(lines.texts)), limits)
    place = line = 0
    for start, text in zip(lines.starts.tolist(), lines.texts, strict=True):
        end = line + len(text)
        while place < len(tokens) and tokens.starts[place] <= end:
            tokens.starts[place] += start - line
            tokens.ends[place] += start - line
            place += 1
        line = end + 1
    return parse_tokens(source, tokens, diagnostics, limits).body.statements


def parse_tokens(
    source: Source, tokens: Tokens, diagnostics: list[Diagnostic], limits: Limits
) -> ast.Module:
    """The syntax tree of a source in words; `diagnostics` receives the faults."""
    return _Parser(source, tokens, diagnostics, limits).module()


class _Parser(ExpressionParser):
    semicolon = False  # one has been reported
    alike: dict[int, Lines] | None = None  # by where the first of them begins

    def module(self) -> ast.Module:
        statements: list[ast.Statement] = []
        complete = True
        try:
            while self.kind != "end":
                self.statements(statements)
                if self.kind == "}":
                    self.tainted = False
                    with suppress(SyntaxFault):
                        self.closes_nothing()
                    self.advance()
        except Abandon:
            complete = False
        whole = Span(self.source, 0, self.ends[-1])
        return ast.Module(self.source, ast.Block(whole, tuple(statements)), complete)

    def statements(self, into: list[ast.Statement]) -> None:
        """Read statements up to a closing brace or the end."""
        kinds = self.kinds
        while True:
            while (kind := kinds[self.position]) == "newline" or self.is_semicolon():
                self.position += 1
            if kind in ("end", "}"):
                return
            self.tainted = False
            nesting = self.nesting
            if self.alike and self.starts[self.position] in self.alike:
                into.append(self.of_one_form(self.alike))
            else:
                into.append(self.whole_statement())
            self.nesting = nesting

    def of_one_form(self, alike: dict[int, Lines]) -> ast.Statement:
        """A line for which others are left out: all of them, unless it is no statement."""
        place = self.position
        start = self.starts[place]
        lines = alike[start]
        for value in lines.values():
            while self.kinds[place] not in ("number", "angle"):
                place += 1
            if not np.isfinite(value).all():
                return self.whole_statement()
            self.values[place] = value
            place += 1
        statement = self.whole_statement()
        if isinstance(statement, ast.Chain) and statement.span.end == lines.end:
            del alike[start]
            return ast.Alike(statement.span, statement, lines)
        return statement

    def whole_statement(self) -> ast.Statement:
        """A statement, faulty or not, up to its end."""
        start = self.position
        statement: ast.Statement | None = None
        try:
            statement = self.statement()
            if self.kinds[self.position] not in _ENDS and not self.is_semicolon():
                self.end_of_statement_expected(statement)
        except SyntaxFault:
            self.recover(start)
            missing = ast.Missing(self.span(start))
            if isinstance(statement, ast.Let):
                return replace(statement, value=missing)
            if isinstance(statement, ast.Param):
                return replace(statement, default=missing, allowed=None)
            if not isinstance(statement, ast.Definition):
                name = self.introduced(start)
                if name is None:
                    return missing
                return ast.Let(missing.span, self.name(name), self.token_span(name), missing)
        return statement

    def is_semicolon(self) -> bool:
        """Whether the current token ends a statement elsewhere; the first in a file is reported."""
        if self.kinds[self.position] != "foreign" or self.token.value != ";":
            return False
        if not self.semicolon:
            self.semicolon = True
            self.foreign_sign()
        return True

    def introduced(self, first: int) -> int | None:
        """The place of the name that a statement of another language defines."""
        tokens, position = [*self.tokens[first : first + 5], self.tokens[-1]], 0
        while self.words(tokens[position]).removeprefix("#") in DEFINING:
            position += 1
        token, following = tokens[position], tokens[min(position + 1, len(tokens) - 1)]
        if token.kind != "name":
            return None
        if position > 0 or following.kind == "=":
            return first + position
        if following.kind == "name" and tokens[position + 2].kind == "=":
            return first + position + 1
        return None

    def words(self, token: Token) -> str:
        """The text of a token."""
        return self.encoded[token.start : token.end].decode("utf-8", "surrogatepass")

    def end_of_statement_expected(self, statement: ast.Statement) -> NoReturn:
        help = "each statement has a line of its own"
        before = self.before
        word = statement.base if isinstance(statement, ast.Chain) else statement
        for node in (word, statement.value if isinstance(statement, ast.Let) else None):
            self.refuse_foreign(node)
        near = before.kind == "name" and did_you_mean(str(before.value), KEYWORDS)
        if near and self.kind == "name":
            help = near
        elif self.kind == "=":
            help = "`==` compares; `let name = value` names a value"
            if isinstance(statement, ast.Chain) or self.comes_again(before.value):
                help = NEVER
        elif self.kind == "for":
            help = LOOP
        elif self.kind == "name" and str(self.token.value) in WORDS:
            help = WORDS[str(self.token.value)]
        elif self.kind == "string" and before.kind == "name":
            help = self.string_after(before)
        elif self.kind in ("{", "name") and before.kind == ")":
            help = "each statement has its own line; a map follows its object: `sphere().scale(2)`"
        elif self.kind == "{":
            help = "a call is written `name(…)`, and a function defined by `fn name(…) { … }`"
        elif self.kind == "if":
            help = "write `if condition { a } else { b }`"
        elif self.kind == ":":
            help = "an argument is named in round brackets: `call(name: value)`"
        elif self.kind == "else":
            help = "put `else` on the line of the `}` before it"
        elif self.kind == "," and self.next_kind() in _ENDS:
            help = "each statement has a line of its own: leave the `,` out"
        elif self.kind == "," and self.is_decimal_comma(self.ends[self.position]):
            help = POINT
        elif self.kind == ",":
            help = "items stand in brackets: `[a, b]` is a list, `(x, y, z)` a vector"
        elif isinstance(statement, ast.Unary) and isinstance(statement.operand, ast.Unary):
            help = "comments begin with `//`"
        elif self.kind in (")", "]"):
            self.closes_nothing()
        self.expected("the end of the statement", help)

    def comes_again(self, word: TokenValue) -> bool:
        """Whether a name stands in the rest of the line."""
        place = self.position
        while self.kinds[place] not in _ENDS and self.values[place] != word:
            place += 1
        return self.kinds[place] == "name"

    def statement(self) -> ast.Statement:
        match self.kind:
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
            if self.kind == "-":
                self.expected("`=`", "a name has letters, digits and `_`, and no `-`")
            if self.kind == "name" and self.next_kind() == "=" and self.name(name) not in WORDS:
                words = f"{self.name(name)}_{self.name(self.position)}"
                self.expected("`=`", f"a name is one word: `{words[:40]}`")
            self.expect("=", help=WORDS["function"] if self.kind == "(" else _LET)
            value = self.expression()
        except SyntaxFault:
            self.recover(start)
            value = ast.Missing(self.span(start))
        return ast.Let(self.span(start), self.name(name), self.token_span(name), value, doc)

    def function(self) -> ast.Statement:
        doc = self.documentation()
        start = self.advance()
        if self.kind == "(":
            self.expected("a name after `fn`", "write `fn name(parameters) { … }`")
        name = self.binding_name("a name after `fn`")
        parameters: list[ast.Parameter] = []
        body: ast.Block | None = None
        try:
            opener = self.expect("(", help="write `fn name(parameters) { … }`")
            parameters = self.sequence(opener, ")", "parameter", self.parameter)
            if self.kind != "{":
                self.expected("`{` and the function's body", "write `fn name(parameters) { … }`")
            body = self.block()
        except SyntaxFault:
            self.recover(start)
        return ast.Function(
            self.span(start), self.name(name), self.token_span(name), tuple(parameters), body, doc
        )

    def parameter(self) -> ast.Parameter:
        doc = self.documentation()
        name = self.binding_name("a parameter's name")
        default = None
        if self.kind == "=":
            self.advance()
            default = self.expression()
        elif self.kind == ":":
            self.expected("`,` or `)`", "parameters have no types; a default is `name = value`")
        return ast.Parameter(self.span(name), self.name(name), self.token_span(name), default, doc)

    def use(self) -> ast.Statement:
        doc = self.documentation()
        start = self.advance()
        path: ast.String | None = None
        if self.kind == "string":
            place = self.advance()
            path = ast.String(self.token_span(place), str(self.values[place]))
        elif self.kind == "fault":
            self.advance()
        else:
            with suppress(SyntaxFault):
                self.expected("a file's name", 'write `use "file.ovo" as name`')
            while self.kind not in ("as", *_ENDS):
                self.advance()
        if self.kind != "as":
            self.expected("`as` and a name", 'write `use "file.ovo" as name`')
        self.advance()
        name = self.binding_name("a name after `as`")
        return ast.Use(self.span(start), path, self.name(name), self.token_span(name), doc)

    def param(self) -> ast.Statement:
        doc = self.documentation()
        start = self.advance()
        if self.nesting:
            self.report(
                "syntax-param-place",
                "a `param` stands at the top of a file, not in a block",
                self.token_span(start),
                help="move it out of the block, or write `let`",
            )
        name = self.binding_name("a name after `param`")
        default: ast.Expression = ast.Missing(self.span(start))
        allowed: ast.Expression | None = None
        try:
            self.expect("=", help="write `param name = default` or `param name = default in 0..1`")
            default = self.expression()
            if self.kind == "in":
                self.advance()
                allowed = self.expression()
        except SyntaxFault:
            self.recover(start)
        return ast.Param(
            self.span(start), self.name(name), self.token_span(name), default, allowed, doc
        )

    def block(self) -> ast.Block:
        start = self.advance()
        self.deeper(start)
        statements: list[ast.Statement] = []
        self.statements(statements)
        closed = self.kind == "}"
        if closed:
            self.advance()
        elif not self.unclosed:
            self.tainted = False
            self.unclosed = True  # the blocks around it lack the same brace
            self.report(
                "syntax-unclosed",
                "this `{` is never closed",
                self.token_span(start),
                help="add a `}` for it",
            )
        self.nesting -= 1
        return ast.Block(self.span(start), tuple(statements), closed)
