"""Tokens with one in view: reporting what is wrong with them and going on after a fault."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import NoReturn, TypeVar

from dsl.angles import UNITS
from dsl.budget import Limits
from dsl.codes import diagnostic
from dsl.diagnostics import Diagnostic, Label
from dsl.documentation import documentation
from dsl.elsewhere import ELSE_BEGINNINGS, MEANT, SIGNS, instead_of
from dsl.lexer import unexpected
from dsl.slips import DIVISION, begins_division
from dsl.spans import Source, Span
from dsl.tokens import KEYWORDS, Token, describe

_Item = TypeVar("_Item")
_SIGN = re.compile(b"|".join(re.escape(sign.encode()) for sign in sorted(SIGNS, key=len)[::-1]))


class SyntaxFault(Exception):
    """The statement being read cannot be completed; its fault has been reported."""


class Abandon(Exception):
    """The rest of the source is not worth reading."""


class TokenReader:
    """Tokens with a position; a statement reports its first fault only."""

    def __init__(
        self, source: Source, tokens: list[Token], diagnostics: list[Diagnostic], limits: Limits
    ) -> None:
        self.source = source
        self.tokens = tokens
        self.diagnostics = diagnostics
        self.limits = limits
        self.position = 0
        self.token = tokens[0]
        self.encoded = source.encoded()
        self.nesting = 0
        self.tainted = False  # a fault in this statement has been reported
        self.unclosed = False  # so has a block that reaches the end of the file
        self.refused: set[str] = set()  # words that were to be names

    def advance(self) -> Token:
        """The current token; the next one comes into view."""
        token = self.token
        if token.kind == "fault":
            self.tainted = True
        if token.kind != "end":
            self.position += 1
            self.token = self.tokens[self.position]
        return token

    def next_kind(self) -> str:
        """The kind of the token after the current."""
        return "end" if self.token.kind == "end" else self.tokens[self.position + 1].kind

    def span(self, start: Token) -> Span:
        """From a token to the one before the current."""
        first = start.start
        last = self.tokens[self.position - 1].end if self.position else start.end
        return Span(self.source, first, last if last > first else first)

    def token_span(self, token: Token) -> Span:
        """The place of a token."""
        return Span(self.source, token.start, token.end)

    def documentation(self) -> str:
        """The text of the `///` lines directly above the current token."""
        before = self.tokens[self.position - 1] if self.position else None
        begins_line = before is None or before.kind == "newline"
        # The first newline of a file comes after its first comment.
        start = 0 if before is None or (begins_line and self.position == 1) else before.end
        between = self.encoded[start : self.token.start]
        if b"///" not in between:
            return ""
        return documentation(between.decode("utf-8", "surrogatepass"), begins_line)

    def skip_newlines(self) -> None:
        """Go on to the next line with words."""
        while self.token.kind == "newline":
            self.advance()

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
        """Report a fault, unless this statement has had one."""
        if not self.tainted:
            span = place if isinstance(place, Span) else self.token_span(place)
            self.diagnostics.append(
                diagnostic(code, message, span, text, help=help, secondary=secondary)
            )
        self.tainted = True
        if len(self.diagnostics) >= self.limits.diagnostics:
            raise Abandon

    def expected(
        self, what: str, help: str | None = None, secondary: tuple[Label, ...] = ()
    ) -> NoReturn:
        """Give up the statement because something else is due here."""
        if self.token.kind == "fault" or (self.token.kind in MEANT.values() and self.token.value):
            self.tainted = True
        self.foreign_sign()
        place = self.token
        if place.value in UNITS and self.tokens[self.position - 1].kind == "number":
            help = f"write the unit directly after the number, as in `40{place.value}`"
        last = self.tokens[self.position - 1].end if self.position else 0
        if place.kind in ("newline", "end") and begins_division(self.encoded, last):
            help = DIVISION
        if place.kind == "newline":
            place = Token("newline", place.start, place.start)
        self.report(
            "syntax-expected",
            f"expected {what}, found {describe(self.token)}",
            place,
            help=help,
            secondary=secondary,
        )
        raise SyntaxFault

    def foreign_sign(self) -> None:
        """Report the sign of another language that the current token is, or is a part of."""
        if self.token.kind == "foreign":
            words = str(self.token.value)
            message = unexpected(words)
            self.report("syntax-unexpected-character", message, self.token, help=instead_of(words))
            return
        before = self.tokens[self.position - 1] if self.position else self.token
        for first in (before, self.token):
            sign = _SIGN.match(self.encoded, first.start)
            if sign is not None and first.end < sign.end() >= self.token.end:
                span = Span(self.source, *sign.span())
                words = sign[0].decode()
                message = f"`{words}` is no sign of the language"
                self.report("syntax-expected", message, span, help=SIGNS[words])

    def expect(self, kind: str, help: str | None = None) -> Token:
        """The current token, which is to be of that kind."""
        if self.token.kind != kind:
            self.expected(f"`{kind}`", help)
        return self.advance()

    def closes_nothing(self) -> NoReturn:
        """Give up the statement because of a closing bracket."""
        kind = self.token.kind
        message = f"this `{kind}` closes nothing"
        self.report("syntax-unmatched", message, self.token, help="remove it, or open the bracket")
        raise SyntaxFault

    def recover(self, start: Token) -> None:
        """Skip to the end of the statement that begins there.

        That is a newline or the brace that closes the block. After a colon at the end of a line the
        lines that stand further to the right belong to the statement, as they do in Python.
        """
        depth = 0
        while self.token.kind != "end":
            kind = self.token.kind
            if depth == 0 and kind in ("newline", "}", ";"):
                if kind == "newline" and self.tokens[self.position - 1].kind == ":":
                    self.skip_indented(self.column(start))
                return
            if kind in ("(", "[", "{"):
                depth += 1
            elif kind in (")", "]", "}"):
                depth = max(0, depth - 1)
            self.advance()

    def skip_indented(self, margin: int) -> None:
        """Skip the lines further to the right, and an `else` among them with its own."""
        while self.token.kind == "newline":
            token = self.tokens[self.position + 1]
            word = token.value if token.kind == "name" else token.kind
            column = self.column(token)
            if token.kind == "end" or column < margin:
                return
            if column == margin and word not in ELSE_BEGINNINGS:
                return
            self.advance()
            while self.token.kind not in ("newline", "end"):
                self.advance()

    def column(self, token: Token) -> int:
        """The bytes before a token on its line."""
        newline = max(self.encoded.rfind(mark, 0, token.start) for mark in (b"\n", b"\r"))
        return token.start - newline - 1

    def deeper(self, token: Token) -> None:
        """Enter a bracket, block or prefix; `nesting` goes back by one at its end."""
        self.nesting += 1
        if self.nesting > self.limits.nesting:
            self.report(
                "limit-nesting",
                f"more than {self.limits.nesting} brackets, blocks or prefixes within one another",
                token,
                help="name the inner parts with `let`",
            )
            raise Abandon

    def binding_name(self, what: str) -> Token:
        """A name that is being defined."""
        token = self.token
        if token.kind == "name":
            return self.advance()
        if token.kind == "reserved" or token.kind in KEYWORDS:
            self.refused.add(token.kind)
            self.report(
                "syntax-reserved-word",
                f"`{token.value or token.kind}` is a word of the language and cannot be a name",
                token,
                help="choose another name",
            )
            raise SyntaxFault
        return self.expected(what)

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

    def begins_line(self) -> bool:
        """Whether a newline is between the token before and the current."""
        start = self.tokens[self.position - 1].end if self.position else 0
        return any(mark in self.encoded[start : self.token.start] for mark in b"\r\n")

    def close(self, opener: Token, closer: str, expected: str = "") -> None:
        """The end of a bracket."""
        kind = self.token.kind
        if kind != closer:
            label = Label(self.token_span(opener), f"this `{opener.kind}` is open")
            if kind in ("newline", "end", "let", "fn", "use", "param", "}"):
                self.report(
                    "syntax-unclosed",
                    f"this `{opener.kind}` is never closed",
                    opener,
                    help=f"add a `{closer}` for it",
                )
                raise SyntaxFault
            help = None
            before = self.tokens[self.position - 1]
            if kind == "if":
                help = "write `if condition { a } else { b }`"
            elif kind == "for":
                help = "a loop emits objects, from a line of its own: `for i in 0..n { … }`"
            elif (kind == ":" and before.kind == "number") or self.token.value == "to":
                help = "an interval is written `a..b`"
            elif expected and not self.begins_line() and before.kind == "name":
                word = before.value
                help = f"an argument is named `{word}: …`, a function called `{word}(…)`"
            elif expected and not self.begins_line() and kind in ("name", "number", "angle"):
                help = "separate the items with `,`"
            elif expected and self.begins_line():
                help = f"close the bracket with `{closer}`, or separate the items with `,`"
            self.expected(expected or f"`{closer}`", help, secondary=(label,))
        self.advance()
        self.nesting -= 1
