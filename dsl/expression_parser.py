"""Expressions: precedence climbing over flat sequences of operands and of suffixes."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import Any, NoReturn

from dsl import ast
from dsl.diagnostics import Label
from dsl.elsewhere import ELSE_IF
from dsl.spans import Span
from dsl.token_reader import SyntaxFault, TokenReader
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
_NEWLINE = "a newline ends a statement unless a round or square bracket is open"
_LOOP = "write `for i in 0..n { … }`"
_NOT, _COMPARISON, _INTERVAL, _PREFIX = 2, 3, 4, 7


_SINGLE: dict[str, Callable[[Span, Any], ast.Expression]] = {
    "name": ast.Name,
    "reserved": ast.Name,
    "number": ast.Number,
    "angle": ast.AngleLiteral,
    "string": ast.String,
    "color": ast.ColorLiteral,
    "true": lambda span, _: ast.Boolean(span, True),
    "false": lambda span, _: ast.Boolean(span, False),
    "fault": lambda span, _: ast.Missing(span),
}
"""Expressions of one token, by its kind."""


class ExpressionParser(TokenReader, ABC):
    """Reads expressions; blocks, which hold statements, are read by the subclass."""

    @abstractmethod
    def block(self) -> ast.Block:
        """A block, its brace in view."""

    def expression(self, level: int = 0) -> ast.Expression:
        """Operators of that level and above: `operand { operator operand }`."""
        start = self.token
        left = self.prefix(level)
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
        """Refuse a second comparison or interval operator."""
        if first.symbol == "..":
            self.expected("the end of the interval", "an interval has two ends, `a..b`")
        self.report(
            "syntax-chained-comparison",
            "a comparison cannot be compared again",
            self.token,
            secondary=(Label(first.span, "the first comparison"),),
            help="write `a < b and b < c`",
        )
        raise SyntaxFault

    def prefix(self, level: int = 0) -> ast.Expression:
        """`("-" | "not") operand`, or a chain; `level` is that of the operand which it begins."""
        token = self.token
        if token.kind not in ("-", "not"):
            return self.suffixes()
        if token.kind == "not" and level > _NOT:
            self.expected("an operand", "`not` binds more weakly: write `(not …)`")
        self.deeper(token)
        self.advance()
        operand = self.expression(_NOT if token.kind == "not" else _PREFIX)
        self.nesting -= 1
        operator = ast.Operator(self.token_span(token), token.kind)
        return ast.Unary(self.span(token), operator, operand)

    def suffixes(self) -> ast.Expression:
        """`primary { "(" arguments ")" | "[" expression "]" | "." name }`."""
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
                    number = self.tokens[self.position - 2].kind == "number"
                    help = "a number ends with a digit, such as `2.0` or `2`" if number else None
                    self.expected("a name after `.`", help)
                self.advance()
                name = str(member.value or member.kind)
                suffixes.append(ast.Member(self.token_span(member), name))
            else:
                break
        return ast.Chain(self.span(start), base, tuple(suffixes)) if suffixes else base

    def arguments(self, opener: Token) -> tuple[ast.Argument, ...]:
        """`{ expression "," } { name ":" expression "," }` up to the closing bracket."""
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
                raise SyntaxFault
        return tuple(arguments)

    def argument(self) -> ast.Argument:
        """`[ name ":" ] expression`."""
        start, following = self.token, self.next_kind()
        name, name_span = None, None
        if following == ":" and (start.kind in ("name", "reserved") or start.kind in KEYWORDS):
            self.advance()
            self.advance()
            name, name_span = str(start.value or start.kind), self.token_span(start)
        elif following == "=" and start.kind == "name":
            self.advance()
            self.foreign_sign()
            self.report(
                "syntax-expected",
                "expected `:`, found `=`",
                self.token,
                help=f"write `{start.value}: value`",
            )
            self.advance()
            name, name_span = str(start.value), self.token_span(start)
        value = self.expression()
        return ast.Argument(self.span(start), name, name_span, value)

    def primary(self) -> ast.Expression:
        """A literal, a name, or something in brackets."""
        token = self.token
        make = _SINGLE.get(token.kind)
        if make is not None:
            self.advance()
            return make(self.token_span(token), token.value)
        match token.kind:
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
            case "foreign":
                self.foreign_sign()
                return ast.Missing(self.token_span(self.advance()))
            case "newline" if self.tokens[self.position - 1].kind in _LEVELS:
                return self.after_newline()
            case _:
                return self.no_expression()

    def after_newline(self) -> ast.Expression:
        """Refuse a newline after an operator, and take the next line for its operand."""
        token = self.token
        self.report(
            "syntax-expected",
            f"expected an expression, found {describe(token)}",
            Token(token.kind, token.start, token.start),
            help=_NEWLINE,
        )
        if self.next_kind() not in ("let", "fn", "use", "param", "for", "if", "}", "end"):
            self.advance()
            self.prefix()
        return ast.Missing(self.span(token))

    def no_expression(self) -> NoReturn:
        """Refuse what cannot begin an expression."""
        help = None
        before = self.tokens[self.position - 1].kind if self.position else ""
        if self.token.kind in self.refused:
            raise SyntaxFault
        if before == "=" and self.token.kind == "newline":
            help = "the value stands behind the `=`, or in brackets that begin there"
        elif self.token.kind == "<":
            help = "a vector is written `(x, y, z)`"
        elif before == "%":
            help = "`%` is the rest of a division; a half is `0.5`"
        elif before in ("(", "[") and self.token.kind == "end":
            self.close(self.tokens[self.position - 1], ")" if before == "(" else "]")
        elif self.token.kind == "fn":
            help = "a function has a name and a line of its own: `fn name(…) { … }`"
        elif self.token.kind == ".":
            help = "a number begins with a digit: `0.5`"
        elif self.token.kind == "else":
            help = "put `else` on the line of the `}` before it"
        elif self.token.kind in (")", "]") and before in ("", "newline"):
            self.closes_nothing()
        elif self.token.kind in ("*", "/", "%", "+") and before in ("newline", "{", "}"):
            help = _NEWLINE
        self.expected("an expression", help)

    def parenthesised(self) -> ast.Expression:
        """`"(" expression ")"`, or a vector of two to four expressions."""
        opener = self.advance()
        items = self.sequence(opener, ")", "expression", self.expression)
        span = self.span(opener)
        if not items:
            self.report("syntax-expected", "expected an expression between `(` and `)`", span)
            raise SyntaxFault
        if len(items) > 4:
            self.report(
                "syntax-vector-length",
                f"a vector has two, three or four components, not {len(items)}",
                span,
                help="a list is written in square brackets: [a, b, …]",
            )
            raise SyntaxFault
        return items[0] if len(items) == 1 else ast.VectorLiteral(span, tuple(items))

    def conditional(self) -> ast.Expression:
        """`"if" expression block { "else" "if" expression block } [ "else" block ]`."""
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
            if self.token.kind == "name" and self.token.value in ELSE_IF:
                word = f"`{self.token.value}` is no word of the language"
                self.report("syntax-expected", word, self.token, help="write `else if`")
                continue
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
        """`"for" name "in" expression { "," name "in" expression } block`."""
        start = self.advance()
        variables: list[ast.LoopVariable] = []
        if self.token.kind == "(":
            self.expected("a name after `for`", _LOOP)
        while True:
            name = self.binding_name("a name after `for`" if not variables else "a name after `,`")
            self.expect("in", help=_LOOP)
            values = self.expression()
            variables.append(
                ast.LoopVariable(self.span(name), str(name.value), self.token_span(name), values)
            )
            if self.token.kind != ",":
                break
            self.advance()
        if self.token.kind != "{":
            self.expected("`{` and the loop's body", _LOOP)
        body = self.block()
        return ast.For(self.span(start), tuple(variables), body)
