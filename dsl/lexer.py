"""Source text to tokens; never raises.

The layout rule lives here: a newline is a token only where it ends a statement, that is, unless a
round or square bracket is open or the next line starts with a dot.
"""

from __future__ import annotations

import math
import re
import unicodedata
from collections.abc import Callable
from functools import cache, partial
from itertools import accumulate

from dsl.angles import UNITS, degrees_from_literal
from dsl.budget import Limits
from dsl.codes import diagnostic
from dsl.diagnostics import Diagnostic
from dsl.spans import Source, Span
from dsl.suggest import did_you_mean
from dsl.tokens import KEYWORDS, RESERVED, Token, TokenValue

_TOKEN = r"""
    (?P<space>[^\S\r\n]+|//[^\r\n]*|/\*[\s\S]*?\*/)
  | (?P<newline>\r\n?|\n)
  | (?P<name>[^\W\d]\w*)
  | (?P<number>(?P<digits>[0-9]+(?:\.[0-9]+)?(?:[eE][+-]?[0-9]+)?)(?P<unit>[^\W\d]\w*)?)
  | (?P<symbol>\.\.|==|!=|<=|>=|[()\[\]{}.,:=+\-*%<>]|/(?!\*))
  | (?P<string>"(?:[^"\\\r\n]|\\[^\r\n])*")
  | (?P<open_string>"(?:[^"\\\r\n]|\\[^\r\n])*)
  | (?P<color>\#\w*)
  | (?P<open_comment>/\*[\s\S]*)
  | (?P<other>[^\s\w"#()\[\]{}.,:=+\-*/%<>]+|[\s\S])
    """
_ASCII = re.compile(_TOKEN, re.VERBOSE)
_ESCAPE = re.compile(r"\\(?:u\{([0-9a-fA-F]{1,6})\}|(.))")
_ESCAPES = {'"': '"', "\\": "\\", "n": "\n", "t": "\t"}
_CLOSES = {")": "(", "]": "[", "}": "{"}
_BRACKETS = frozenset("()[]{}")
_STATEMENT_WORDS = frozenset(("let", "fn", "use", "param"))

_MENDS = {
    "^": "write `pow(a, b)`",
    "&&": "write `and`",
    "||": "write `or`",
    "!": "write `not`",
    ";": "end a statement with a new line",
    "'": 'strings are written in double quotes: "…"',
    "`": 'strings are written in double quotes: "…"',
    "?": "write `if condition { a } else { b }`",
    "²": "write `pow(a, 2)`",
    "³": "write `pow(a, 3)`",
    "×": "write `a * b`",
    "·": "write `a * b`",
    "÷": "write `a / b`",
    "−": "write the sign as `-`",
    "–": "write the sign as `-`",
    "≤": "write `<=`",
    "≥": "write `>=`",
    "≠": "write `!=`",
    "°": "write `deg`, as in `40deg`",
    "“": 'strings are written in straight quotes: "…"',
    "”": 'strings are written in straight quotes: "…"',
    "…": "write `a..b`",
    "$": "a name begins with a letter",
    "@": "a name begins with a letter",
}


def tokenize(source: Source, limits: Limits) -> tuple[list[Token], list[Diagnostic]]:
    """The words of a source, the last one of kind "end", and the faults in them."""
    return _Lexer(source, limits).run()


def _pattern(text: str) -> re.Pattern[str]:
    r"""The words of a text; its names go on with all of XID_Continue, of which `\w` lacks marks."""
    marks = "" if text.isascii() else "".join(filter(_continues, set(text)))
    return re.compile(_TOKEN.replace(r"\w*", rf"[\w{marks}]*"), re.VERBOSE) if marks else _ASCII


def _continues(character: str) -> bool:
    return not re.match(r"\w", character) and f"a{character}".isidentifier()


@cache
def srgb_to_linear(encoded: float, white: int = 1) -> float:
    """One sRGB-encoded component in [0, white] to linear light in [0, 1], rounded once.

    IEC 61966-2-1: c / 12.92 up to c = 0.04045, ((c + 0.055) / 1.055)^2.4 above.
    """
    from decimal import Decimal, localcontext

    with localcontext(prec=50):
        c = Decimal(encoded) / white
        if c <= Decimal("0.04045"):
            return float(c / Decimal("12.92"))
        return float(((c + Decimal("0.055")) / Decimal("1.055")) ** Decimal("2.4"))


_token: Callable[[tuple[str, int, int, TokenValue]], Token] = partial(tuple.__new__, Token)


class _Lexer:
    def __init__(self, source: Source, limits: Limits) -> None:
        self.source = source
        self.limits = limits
        self.tokens: list[Token] = []
        self.diagnostics: list[Diagnostic] = []
        self.brackets: list[str] = []
        self.open = dict.fromkeys("([{", 0)  # how many of each are among the brackets
        self.newline: Token | None = None  # seen, but the next line may still start with a dot
        self.line_start = True
        text = source.text
        self.offsets: list[int] | None = None  # byte offset of each character, if they differ
        if not text.isascii():
            self.offsets = list(accumulate((_utf8_length(c) for c in text), initial=0))

    def run(self) -> tuple[list[Token], list[Diagnostic]]:
        size = self.byte(len(self.source.text))
        if size > self.limits.source_bytes:
            self.fault(
                "limit-source",
                f"the source has {size} bytes, more than the limit of {self.limits.source_bytes}",
                0,
                0,
                help="split it into files and `use` them",
            )
            return [Token("end", 0, 0)], self.diagnostics
        handlers: dict[str | None, Callable[[re.Match[str]], None]] = {
            "newline": self._newline,
            "name": self._name,
            "number": self._number,
            "symbol": self._symbol,
            "string": self._string,
            "open_string": self._open_string,
            "color": self._color,
            "open_comment": self._open_comment,
            "other": self._other,
        }
        for match in _pattern(self.source.text).finditer(self.source.text):
            if match.lastgroup != "space":
                handlers[match.lastgroup](match)
        self.add("end", len(self.source.text), len(self.source.text))
        return self.tokens, self.diagnostics

    def byte(self, index: int) -> int:
        return index if self.offsets is None else self.offsets[index]

    def fault(self, code: str, message: str, start: int, end: int, help: str | None = None) -> None:
        if len(self.diagnostics) <= self.limits.diagnostics:
            span = Span(self.source, self.byte(start), self.byte(end))
            self.diagnostics.append(diagnostic(code, message, span, help=help))

    def add(self, kind: str, start: int, end: int, value: TokenValue = None) -> None:
        if self.newline is not None:
            if kind != ".":
                self.tokens.append(self.newline)
            self.newline = None
        if self.offsets is not None:
            start, end = self.offsets[start], self.offsets[end]
        self.tokens.append(_token((kind, start, end, value)))
        self.line_start = False

    def _newline(self, match: re.Match[str]) -> None:
        self.line_start = True
        if self.newline is None and not (self.brackets and self.brackets[-1] != "{"):
            self.newline = Token("newline", self.byte(match.start()), self.byte(match.end()))

    def _name(self, match: re.Match[str]) -> None:
        word = match[0]
        if word in _STATEMENT_WORDS and self.line_start and self.newline is None:
            # Only a bracket that was never closed can put one of these words here: close it,
            # so that the fault stays in its own statement.
            self._leave_line()
            start = self.byte(match.start())
            self.newline = Token("newline", start, start)
        if word in KEYWORDS:
            self.add(word, *match.span())
        elif word in RESERVED:
            self.add("reserved", *match.span(), word)
        elif word.isidentifier():
            value = word if word.isascii() else unicodedata.normalize("NFC", word)
            self.add("name", *match.span(), value)
        else:
            valid = next(n for n in range(len(word)) if not word[: n + 1].isidentifier())
            self._unexpected(match.start() + valid, match.start() + valid + 1)
            self.add("fault", match.start(), match.end())

    def _number(self, match: re.Match[str]) -> None:
        digits, unit = match.group("digits", "unit")
        start, end = match.span()
        kind, value = "number", float(digits)
        if unit in UNITS:
            kind, value = "angle", degrees_from_literal(digits, unit)
        elif unit is not None:
            kind = "fault"
            near = did_you_mean(unit, UNITS)
            self.fault(
                "syntax-unknown-unit",
                f"no unit named `{unit}`",
                start + len(digits),
                end,
                help=near
                or f"angles have the units deg, rad and turn; a product is written "
                f"`{digits} * {unit}`",
            )
        if math.isinf(value):
            self.fault(
                "syntax-number",
                f"`{digits[:40]}` is too large for a number",
                start,
                start + len(digits),
                help="numbers go up to about 1.8e308",
            )
            kind = "fault"
        self.add(kind, start, end, value)

    def _symbol(self, match: re.Match[str]) -> None:
        symbol = match[0]
        self.add(symbol, *match.span())
        if symbol not in _BRACKETS:
            return
        if symbol in "([{":
            self.brackets.append(symbol)
            self.open[symbol] += 1
        elif self.open[opener := _CLOSES[symbol]]:
            while self._leave() != opener:
                pass

    def _leave(self) -> str:
        """Forget the innermost bracket."""
        opener = self.brackets.pop()
        self.open[opener] -= 1
        return opener

    def _leave_line(self) -> None:
        """Forget the brackets in which a newline ends no statement."""
        while self.brackets and self.brackets[-1] != "{":
            self._leave()

    def _string(self, match: re.Match[str]) -> None:
        start, end = match.span()
        if end - start - 2 > self.limits.string_length:
            self.fault(
                "limit-string-length",
                f"a string of {end - start - 2} characters, more than the limit of "
                f"{self.limits.string_length}",
                start,
                start + 1,
            )
            self.add("fault", start, end)
            return

        def unescape(escape: re.Match[str]) -> str:
            code, letter = escape.groups()
            if (
                code is not None
                and int(code, 16) <= 0x10FFFF
                and not 0xD800 <= int(code, 16) < 0xE000
            ):
                return chr(int(code, 16))
            if letter in _ESCAPES:
                return _ESCAPES[letter]
            self.fault(
                "syntax-escape",
                f"no escape `{escape[0]}`",
                start + 1 + escape.start(),
                start + 1 + escape.end(),
                help='the escapes are \\" \\\\ \\n \\t and \\u{hexadecimal digits}',
            )
            return ""

        self.add("string", start, end, _ESCAPE.sub(unescape, match[0][1:-1]))

    def _open_string(self, match: re.Match[str]) -> None:
        self.fault(
            "syntax-unterminated-string",
            "this string has no closing quote on its line",
            *match.span(),
            help='end it with `"`',
        )
        # What would close the brackets of this line is inside the string.
        self._leave_line()
        self.add("fault", match.start(), match.end())

    def _open_comment(self, match: re.Match[str]) -> None:
        self.fault(
            "syntax-unterminated-comment",
            "this comment is never closed",
            match.start(),
            match.start() + 2,
            help="end it with `*/`",
        )

    def _color(self, match: re.Match[str]) -> None:
        digits = match[0][1:]
        if re.fullmatch("[0-9a-fA-F]{6}", digits):
            red, green, blue = (srgb_to_linear(int(digits[i : i + 2], 16), 255) for i in (0, 2, 4))
            self.add("color", match.start(), match.end(), (red, green, blue))
            return
        help = "a color has six hexadecimal digits, such as `#d2b48c`; comments begin with `//`"
        if re.fullmatch("[0-9a-fA-F]{3}", digits):
            help = f"write `#{''.join(2 * digit for digit in digits)}`"
        self.fault("syntax-color", f"`{match[0][:40]}` is no color", *match.span(), help=help)
        self.add("fault", match.start(), match.end())

    def _other(self, match: re.Match[str]) -> None:
        self._unexpected(*match.span())
        self.add("fault", match.start(), match.end())

    def _unexpected(self, start: int, end: int) -> None:
        words = self.source.text[start:end]
        shown = words if len(words) <= 8 else words[:8] + "…"
        named = f"`{shown}`" if shown.isprintable() else f"U+{ord(shown[0]):04X}"
        message = f"unexpected character {named}"
        self.fault("syntax-unexpected-character", message, start, end, help=_MENDS.get(words))


def _utf8_length(character: str) -> int:
    code = ord(character)
    return 1 if code < 0x80 else 2 if code < 0x800 else 3 if code < 0x10000 else 4
