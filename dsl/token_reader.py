"""Tokens with one in view: reporting what is wrong with them and going on after a fault."""

from __future__ import annotations

import re
from collections.abc import Callable
from functools import cached_property
from typing import NoReturn, TypeVar

from dsl.angles import UNITS
from dsl.budget import Limits
from dsl.codes import diagnostic
from dsl.diagnostics import Diagnostic, Label
from dsl.documentation import documentation
from dsl.elsewhere import ELSE_BEGINNINGS, LOOP, MEANT, SIGNS, STRING, instead_of
from dsl.lexer import unexpected
from dsl.slips import DIVISION, begins_division
from dsl.spans import Source, Span
from dsl.tokens import KEYWORDS, Token, Tokens, describe

_Item = TypeVar("_Item")
_SIGN = re.compile(b"|".join(re.escape(sign.encode()) for sign in sorted(SIGNS, key=len)[::-1]))

_GROUPED_DIGITS = re.compile(rb"[0-9] [0-9]{3}(?![0-9])")


class SyntaxFault(Exception):
    """The statement being read cannot be completed; its fault has been reported."""


class Abandon(Exception):
    """The rest of the source is not worth reading."""


class TokenReader:
    """Tokens with a position; a statement reports its first fault only.

    Places are numbers of tokens: a `Token` is made only to tell of it.
    """

    def __init__(
        self, source: Source, tokens: Tokens, diagnostics: list[Diagnostic], limits: Limits
    ) -> None:
        self.source = source
        self.tokens = tokens
        self.kinds, self.values = tokens.kinds, tokens.values
        self.starts, self.ends = tokens.starts, tokens.ends
        self.diagnostics = diagnostics
        self.limits = limits
        self.position = 0
        self.nesting = 0
        self.tainted = False  # a fault in this statement has been reported
        self.unclosed = False  # so has a block that reaches the end of the file
        self.refused: set[str] = set()  # words that were to be names

    @cached_property
    def encoded(self) -> bytes:
        """The bytes that offsets count."""
        return self.source.encoded()

    @property
    def kind(self) -> str:
        """The kind of the current token."""
        return self.kinds[self.position]

    @property
    def token(self) -> Token:
        """The current token."""
        return self.tokens[self.position]

    @property
    def before(self) -> Token:
        """The token before the current one, if there is one."""
        return self.tokens[self.position - 1]

    @property
    def end_before(self) -> int:
        """Where the token before the current one ends; 0 if there is none."""
        return self.ends[self.position - 1] if self.position else 0

    def advance(self) -> int:
        """The place of the current token; the next one comes into view."""
        place = self.position
        if self.kinds[place] == "fault":
            self.tainted = True
        if self.kinds[place] != "end":
            self.position += 1
        return place

    def next_kind(self) -> str:
        """The kind of the token after the current."""
        return self.kinds[min(self.position + 1, len(self.kinds) - 1)]

    def name(self, place: int) -> str:
        """The word of a name, or of a keyword that stands for one."""
        return str(self.values[place] or self.kinds[place])

    def span(self, first: int) -> Span:
        """From a token to the one before the current."""
        start = self.starts[first]
        end = self.ends[self.position - 1] if self.position else self.ends[first]
        return Span(self.source, start, end if end > start else start)

    def token_span(self, place: int) -> Span:
        """The place of a token in the text."""
        return Span(self.source, self.starts[place], self.ends[place])

    def documentation(self) -> str:
        """The text of the `///` lines directly above the current token."""
        begins_line = not self.position or self.before.kind == "newline"
        # The first newline of a file comes after its first comment.
        first = not self.position or (begins_line and self.position == 1)
        between = self.encoded[0 if first else self.end_before : self.starts[self.position]]
        if b"///" not in between:
            return ""
        return documentation(between.decode("utf-8", "surrogatepass"), begins_line)

    def skip_newlines(self) -> None:
        """Go on to the next line with words."""
        while self.kind == "newline":
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
            span = place
            if isinstance(span, Token):
                span = Span(self.source, span.start, span.end)
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
        if self.kind == "fault" or (self.kind in MEANT.values() and self.token.value):
            self.tainted = True
        self.foreign_sign()
        place = self.token
        if place.value in UNITS and self.before.kind == "number":
            help = f"write the unit directly after the number, as in `40{place.value}`"
        if place.kind in ("newline", "end") and begins_division(self.encoded, self.end_before):
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
        if self.kind == "foreign":
            words = str(self.token.value)
            message = unexpected(words)
            self.report("syntax-unexpected-character", message, self.token, help=instead_of(words))
            return
        for first in (self.before if self.position else self.token, self.token):
            sign = _SIGN.match(self.encoded, first.start)
            if sign is not None and first.end < sign.end() >= self.token.end:
                span = Span(self.source, *sign.span())
                words = sign[0].decode()
                message = f"`{words}` is no sign of the language"
                self.report("syntax-expected", message, span, help=SIGNS[words])

    def expect(self, kind: str, help: str | None = None) -> int:
        """The place of the current token, which is to be of that kind."""
        if self.kind != kind:
            self.expected(f"`{kind}`", help)
        return self.advance()

    def string_after(self, word: Token) -> str:
        """Help for a string, the current token, that stands behind a name."""
        if word.end == self.token.start:
            return STRING
        return f"a call has brackets: `{word.value}(…)`"

    def closes_nothing(self) -> NoReturn:
        """Give up the statement because of a closing bracket."""
        message = f"this `{self.kind}` closes nothing"
        self.report("syntax-unmatched", message, self.token, help="remove it, or open the bracket")
        raise SyntaxFault

    def recover(self, start: int) -> None:
        """Skip to the end of the statement that begins there.

        That is a newline or the brace that closes the block. After a colon at the end of a line the
        lines that stand further to the right belong to the statement, as they do in Python.
        """
        depth = 0
        while (kind := self.kind) != "end":
            if depth == 0 and kind in ("newline", "}", ";"):
                if kind == "newline" and self.before.kind == ":":
                    self.skip_indented(self.column(start))
                return
            if kind in ("(", "[", "{"):
                depth += 1
            elif kind in (")", "]", "}"):
                depth = max(0, depth - 1)
            self.advance()

    def skip_indented(self, margin: int) -> None:
        """Skip the lines further to the right, and an `else` among them with its own."""
        while self.kind == "newline":
            token = self.tokens[self.position + 1]
            word = token.value if token.kind == "name" else token.kind
            column = self.column(self.position + 1)
            if token.kind == "end" or column < margin:
                return
            if column == margin and word not in ELSE_BEGINNINGS:
                return
            self.advance()
            while self.kind not in ("newline", "end"):
                self.advance()

    def column(self, place: int) -> int:
        """The bytes before a token on its line."""
        start = self.starts[place]
        return start - max(self.encoded.rfind(mark, 0, start) for mark in (b"\n", b"\r")) - 1

    def deeper(self, place: int) -> None:
        """Enter a bracket, block or prefix; `nesting` goes back by one at its end."""
        self.nesting += 1
        if self.nesting > self.limits.nesting:
            self.report(
                "limit-nesting",
                f"more than {self.limits.nesting} brackets, blocks or prefixes within one another",
                self.token_span(place),
                help="name the inner parts with `let`",
            )
            raise Abandon

    def binding_name(self, what: str) -> int:
        """The place of a name that is being defined."""
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
        self, opener: int, closer: str, what: str, item: Callable[[], _Item]
    ) -> list[_Item]:
        """Items between brackets, separated by commas; the last may be followed by one."""
        self.deeper(opener)
        items: list[_Item] = []
        kinds = self.kinds
        while kinds[self.position] not in (closer, "newline", "end", "}"):
            if kinds[self.position] == ",":
                self.expected(f"an {what}" if what[0] in "aeiou" else f"a {what}")
            items.append(item())
            if kinds[self.position] != ",":
                break
            self.position += 1
        self.close(opener, closer, f"`,` or `{closer}`")
        return items

    def begins_line(self) -> bool:
        """Whether a newline is between the token before and the current."""
        between = self.encoded[self.end_before : self.starts[self.position]]
        return any(mark in between for mark in b"\r\n")

    def close(self, opener: int, closer: str, expected: str = "") -> None:
        """The end of a bracket."""
        kind = self.kinds[self.position]
        if kind != closer:
            word = self.kinds[opener]
            label = Label(self.token_span(opener), f"this `{word}` is open")
            if kind in ("newline", "end", "let", "fn", "use", "param", "}"):
                self.report(
                    "syntax-unclosed",
                    f"this `{word}` is never closed",
                    self.token_span(opener),
                    help=f"add a `{closer}` for it",
                )
                raise SyntaxFault
            help = None
            before = self.before
            if kind == "if":
                help = "write `if condition { a } else { b }`"
            elif kind == "for":
                help = LOOP
            elif kind == "=":
                help = "`==` compares"
            elif (kind == ":" and before.kind == "number") or self.token.value == "to":
                help = "an interval is written `a..b`"
            elif kind == "string" and before.kind == "name":
                help = self.string_after(before)
            elif expected and not self.begins_line() and before.kind == "name":
                word = str(before.value)
                help = f"an argument is named `{word}: …`, a function called `{word}(…)`"
            elif _GROUPED_DIGITS.match(self.encoded, self.starts[self.position] - 2):
                help = "the digits of a number stand together: `1000`"
            elif expected and not self.begins_line() and kind in ("name", "number", "angle"):
                help = "separate the items with `,`"
            elif expected and self.begins_line():
                help = f"close the bracket with `{closer}`, or separate the items with `,`"
            self.expected(expected or f"`{closer}`", help, secondary=(label,))
        self.position += 1
        self.nesting -= 1
