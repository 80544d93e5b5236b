"""Expressions: precedence climbing over flat sequences of operands and of suffixes."""

from __future__ import annotations

import re
from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import Any, NoReturn

from dsl import ast
from dsl.diagnostics import Label
from dsl.elsewhere import ELSE_IF, POINT, WORDS
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
_CONDITIONS = {
    "=": "`==` compares",
    "is": "`==` compares",
    "in": "write `a == b or a == c`",
}
"""What to write in the place of a word after a condition."""
_NOT, _COMPARISON, _INTERVAL, _PREFIX = 2, 3, 4, 7


_DECIMAL_COMMA = re.compile(rb"[0-9],[0-9]\Z")

_SINGLE: dict[str, Callable[[Span, Any], ast.Expression]] = {
    "name": ast.Name,
    "reserved": ast.Name,
    "number": ast.Number,
    "angle": ast.AngleLiteral,
    "string": ast.String,
    "color": ast.ColorLiteral,
    "true": lambda span, _: ast.Boolean(span, True),
    "false": lambda span, _: ast.Boolean(span, False),
}
"""Expressions of one token, by its kind."""
_SUFFIXES = ("(", "[", ".")
_DEFINING = frozenset(("let", "fn", "for", "param", "as"))
_GOING_ON = frozenset((*_LEVELS, *_SUFFIXES))
"""Words with which an expression that could end before them goes on."""


class ExpressionParser(TokenReader, ABC):
    """Reads expressions; blocks, which hold statements, are read by the subclass."""

    @abstractmethod
    def block(self) -> ast.Block:
        """A block, its brace in view."""

    def expression(self, level: int = 0) -> ast.Expression:
        """Operators of that level and above: `operand { operator operand }`."""
        start, kinds = self.position, self.kinds
        make = _SINGLE.get(kinds[start])
        if make is not None and kinds[start + 1] not in _GOING_ON:
            self.position += 1
            return make(Span(self.source, self.starts[start], self.ends[start]), self.values[start])
        left = self.prefix(level)
        while (binary := _LEVELS.get(kinds[self.position], -1)) >= level:
            operands = [left]
            operators: list[ast.Operator] = []
            while _LEVELS.get(kinds[self.position]) == binary:
                if operators and binary in (_COMPARISON, _INTERVAL):
                    self.refuse_foreign(left)
                    self.chained(operators[0])
                place = self.advance()
                operators.append(ast.Operator(self.token_span(place), kinds[place]))
                operands.append(self.expression(binary + 1))
            left = ast.Operation(self.span(start), tuple(operands), tuple(operators))
        return left

    def refuse_foreign(self, node: ast.Expression | ast.Statement | None) -> None:
        """Refuse a word of another language that is a name here and has made no sense."""
        if isinstance(node, ast.Name) and node.name in WORDS and not self.defines(node.name):
            message = f"`{node.name}` is no word of the language"
            what = str(self.token.value) if self.kind == "name" else ""
            help = WORDS.get(what, WORDS[node.name])
            if node.name == "def" and "string" in (self.kind, self.next_kind()):
                help = WORDS["usda"]
            self.report("syntax-expected", message, node.span, help=help)
            raise SyntaxFault

    def defines(self, name: str) -> bool:
        """Whether a definition of a name has been read."""
        return any(
            kind in _DEFINING and self.values[place + 1] == name
            for place, kind in enumerate(self.kinds[: self.position])
        )

    def chained(self, first: ast.Operator) -> NoReturn:
        """Refuse a second comparison or interval operator."""
        if first.symbol == "..":
            self.expected(
                "the end of the interval",
                "an interval has two ends, `a..b`; for steps of 2 write `2 * i`",
            )
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
        kind = self.kinds[self.position]
        if kind not in ("-", "not"):
            return self.suffixes()
        if kind == "not" and level > _NOT:
            self.expected("an operand", "`not` binds more weakly: write `(not …)`")
        self.deeper(self.position)
        start = self.advance()
        operand = self.expression(_NOT if kind == "not" else _PREFIX)
        self.nesting -= 1
        operator = ast.Operator(self.token_span(start), kind)
        return ast.Unary(self.span(start), operator, operand)

    def suffixes(self) -> ast.Expression:
        """`primary { "(" arguments ")" | "[" expression "]" | "." name }`."""
        start = self.position
        base = self.primary()
        suffixes: list[ast.Suffix] = []
        while (kind := self.kinds[self.position]) in _SUFFIXES:
            opener = self.position
            self.position += 1
            if kind == "(":
                arguments = self.arguments(opener)
                suffixes.append(ast.Call(self.span(opener), arguments))
            elif kind == "[":
                self.deeper(opener)
                index = self.expression()
                if self.kind == ",":
                    self.expected("`]`", "an item is `list[i]`, of a list in it `list[i][j]`")
                self.close(opener, "]")
                suffixes.append(ast.Index(self.span(opener), index))
            else:
                member = self.position
                if self.kinds[member] != "name" and not self.is_word(member):
                    self.expected("a name after `.`", self.instead_of_member(opener))
                self.position += 1
                span = Span(self.source, self.starts[member], self.ends[member])
                suffixes.append(ast.Member(span, self.name(member)))
        return ast.Chain(self.span(start), base, tuple(suffixes)) if suffixes else base

    def instead_of_member(self, dot: int) -> str | None:
        """Help where no name follows a dot."""
        if self.kinds[dot - 1] == "number":
            return "a number ends with a digit, such as `2.0` or `2`"
        if self.kind == "number":
            return "an item is written `list[0]`"
        if self.kind in ("newline", "end"):
            return "leave the `.` out, or go on with a map: `.translate(x, y, z)`"
        return None

    def is_word(self, place: int) -> bool:
        """Whether a token is a word of the language or a name."""
        kind = self.kinds[place]
        return kind in ("name", "reserved") or kind in KEYWORDS

    def arguments(self, opener: int) -> tuple[ast.Argument, ...]:
        """`{ expression "," } { name ":" expression "," }` up to the closing bracket."""
        arguments = self.sequence(opener, ")", "argument", self.argument)
        named: ast.Argument | None = None
        for place, argument in enumerate(arguments):
            if argument.name is not None:
                named = argument
            elif named is not None:
                others = [given.value for given in (named, *arguments[place:])]
                help = "name it too, or move it to the front"
                if len(others) > 2 and all(isinstance(value, ast.Number) for value in others):
                    help = f"a vector has brackets of its own: `{named.name}: (…)`"
                elif self.is_decimal_comma(argument.span.start):
                    help = POINT
                self.report(
                    "syntax-positional-after-named",
                    "an argument without a name after one with a name",
                    argument.value.span,
                    secondary=(Label(named.span, "this one has a name"),),
                    help=help,
                )
                raise SyntaxFault
        return tuple(arguments)

    def is_decimal_comma(self, place: int) -> bool:
        """Whether the number that begins at a byte follows another with nothing but a comma."""
        return _DECIMAL_COMMA.search(self.encoded, max(0, place - 20), place + 1) is not None

    def argument(self) -> ast.Argument:
        """`[ name ":" ] expression`."""
        start = self.position
        kind = self.kinds[start]
        following = self.kinds[start + 1] if kind != "end" else kind
        make = _SINGLE.get(kind)
        if make is not None and (following == "," or following == ")"):
            self.position += 1
            span = Span(self.source, self.starts[start], self.ends[start])
            return ast.Argument(span, None, None, make(span, self.values[start]))
        name, name_span = None, None
        if following == ":" and self.is_word(start):
            self.position += 2
            name = self.name(start)
            name_span = Span(self.source, self.starts[start], self.ends[start])
        elif following == "=" and kind == "name":
            self.advance()
            self.foreign_sign()
            self.report(
                "syntax-expected",
                "expected `:`, found `=`",
                self.token,
                help=f"write `{self.name(start)}: value`",
            )
            self.advance()
            name, name_span = self.name(start), self.token_span(start)
        value = self.expression()
        span, first, last = value.span, self.starts[start], self.ends[self.position - 1]
        if span.start != first or span.end != last:
            span = Span(self.source, first, last)
        return ast.Argument(span, name, name_span, value)

    def primary(self) -> ast.Expression:
        """A literal, a name, or something in brackets."""
        place = self.position
        kind = self.kinds[place]
        make = _SINGLE.get(kind)
        if make is not None:
            self.position += 1
            return make(Span(self.source, self.starts[place], self.ends[place]), self.values[place])
        match kind:
            case "(":
                return self.parenthesised()
            case "[":
                self.advance()
                items = self.sequence(place, "]", "item", self.expression)
                return ast.ListLiteral(self.span(place), tuple(items))
            case "{":
                return self.block()
            case "if":
                return self.conditional()
            case "for":
                return self.loop()
            case "foreign":
                self.foreign_sign()
                return ast.Missing(self.token_span(self.advance()))
            case "fault":
                return ast.Missing(self.token_span(self.advance()))
            case "newline" if self.kinds[place - 1] in _LEVELS:
                return self.after_newline()
            case _:
                return self.no_expression()

    def after_newline(self) -> ast.Expression:
        """Refuse a newline after an operator, and take the next line for its operand."""
        place, token = self.position, self.token
        self.report(
            "syntax-expected",
            f"expected an expression, found {describe(token)}",
            Token(token.kind, token.start, token.start),
            help=_NEWLINE,
        )
        if self.next_kind() not in ("let", "fn", "use", "param", "for", "if", "}", "end"):
            self.advance()
            self.prefix()
        return ast.Missing(self.span(place))

    def no_expression(self) -> NoReturn:
        """Refuse what cannot begin an expression."""
        help = None
        before = self.before.kind if self.position else ""
        if self.kind in self.refused:
            raise SyntaxFault
        if before == "=" and self.kind == "newline":
            help = "the value stands behind the `=`, or in brackets that begin there"
        elif before in ("and", "or") and _LEVELS.get(self.kind) == _COMPARISON:
            help = "both sides are whole conditions: `a < b and a > c`"
        elif self.kind == "<":
            help = "a vector is written `(x, y, z)`"
        elif before == "%":
            help = "`%` is the rest of a division; a half is `0.5`"
        elif before in ("(", "[") and self.kind in ("end", "newline"):
            self.close(self.position - 1, ")" if before == "(" else "]")
        elif self.kind == "fn":
            help = "a function has a name and a line of its own: `fn name(…) { … }`"
        elif self.kind == "param":
            help = "a parameter has a line of its own: `param name = default`"
        elif self.kind == ".":
            help = "a number begins with a digit: `0.5`"
        elif before == ":" and self.kind in (")", ","):
            help = "a value stands behind the `:`"
        elif self.kind == "else":
            help = "put `else` on the line of the `}` before it"
        elif self.kind in (")", "]") and before in ("", "newline"):
            self.closes_nothing()
        elif self.kind in ("*", "/", "%", "+") and before in ("newline", "{", "}"):
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
        start = self.position
        branches: list[tuple[ast.Expression, ast.Block]] = []
        otherwise: ast.Block | None = None
        while True:
            self.advance()
            condition = self.expression()
            if self.kind != "{":
                word = str(self.token.value or self.kind)
                self.expected("`{`", _CONDITIONS.get(word, "write `if condition { … }`"))
            branches.append((condition, self.block()))
            if self.kind == "name" and self.token.value in ELSE_IF:
                word = f"`{self.token.value}` is no word of the language"
                self.report("syntax-expected", word, self.token, help="write `else if`")
                continue
            if self.kind != "else":
                break
            self.advance()
            if self.kind == "{":
                otherwise = self.block()
                break
            if self.kind != "if":
                self.expected("`{` or `if` after `else`")
        return ast.If(self.span(start), tuple(branches), otherwise)

    def loop(self) -> ast.Expression:
        """`"for" name "in" expression { "," name "in" expression } block`."""
        start = self.advance()
        variables: list[ast.LoopVariable] = []
        if self.kind == "(":
            self.expected("a name after `for`", _LOOP)
        while True:
            name = self.binding_name("a name after `for`" if not variables else "a name after `,`")
            several = "each variable has its own range: `for x in a, y in b { … }`"
            self.expect("in", help=several if self.kind == "," else _LOOP)
            values = self.expression()
            variables.append(
                ast.LoopVariable(self.span(name), self.name(name), self.token_span(name), values)
            )
            if self.kind != ",":
                break
            self.advance()
        if self.kind != "{":
            interval = self.kind == ":" and self.next_kind() in ("number", "name")
            help = "an interval is written `a..b`" if interval else _LOOP
            self.expected("`{` and the loop's body", help)
        body = self.block()
        return ast.For(self.span(start), tuple(variables), body)
