"""Source text to tokens; never raises.

The layout rule lives here: a newline is a token only where it ends a statement, that is, unless a
round or square bracket is open or the next line starts with a dot.
"""

from __future__ import annotations

import math
import re
from functools import cache

from dsl.angles import UNITS, degrees_from_literal
from dsl.budget import Limits
from dsl.codes import diagnostic
from dsl.diagnostics import Diagnostic
from dsl.elsewhere import MEANT, SIGNS, WORDS
from dsl.files import SourceTooLarge
from dsl.spans import Source, Span
from dsl.suggest import did_you_mean
from dsl.tokens import KEYWORDS, RESERVED, Tokens, TokenValue

_WORD = r"""
    [()\[\]{},:+\-*%] | [=<>]=? | \.\.? | != | /(?![/*])
  | [^\W\d]\w*                                          # name
  | [0-9]+(?:\.[0-9]+)?(?:[eE][+-]?[0-9]+)?(?:[^\W\d]\w*)?
  | [^\S\r\n]+ | //[^\r\n]* | /\*[\s\S]*?\*/            # space
  | \r\n? | \n
  | "(?:[^"\\\r\n]|\\[^\r\n])*"?
  | \#\w+                                               # color
  | \#[^\r\n]*                                          # comment of another language
  | '[^'\r\n]*' | `[^`\r\n]*` | “[^“”\r\n]*” | ‘[^‘’\r\n]*’
  | /\*[\s\S]*                                          # comment without an end
  | [^\s\w"'`“”‘’\#;()\[\]{}.,:=+\-*/%<>]+ | [\s\S]            # what begins no word
    """
"""A text is a row of these, without gaps; what is frequent comes first."""
_ASCII = re.compile(_WORD, re.VERBOSE)
_DIGITS = re.compile(r"[0-9]+(?:\.[0-9]+)?(?:[eE][+-]?[0-9]+)?")
_STRING = re.compile(r'"(?:[^"\\]|\\.)*"')
_ESCAPE = re.compile(r"\\(?:u\{([0-9a-fA-F]{1,6})\}|(.))")
_ESCAPES = {'"': '"', "\\": "\\", "n": "\n", "t": "\t"}
_CLOSES = {")": "(", "]": "[", "}": "{"}
_STATEMENT_WORDS = frozenset(("let", "fn", "use", "param"))
_LAYOUT = frozenset(("space", "newline", ".", *"()[]{}", *_STATEMENT_WORDS))
"""The words that say, or depend on, which newline ends a statement."""

_Word = tuple[str, TokenValue]
"""The kind and value of a word: those of its token, or "space"."""
_SPACE: _Word = ("space", None)
_FIXED: dict[str, _Word] = {
    " ": _SPACE,
    **dict.fromkeys(("\n", "\r", "\r\n"), ("newline", None)),
    **{word: (word, None) for word in (*"()[]{}.,:=+-*/%<>", "..", "==", "!=", "<=", ">=")},
    **{word: (word, None) for word in KEYWORDS},
    **{word: ("reserved", word) for word in RESERVED},
}


def tokenize(source: Source, limits: Limits) -> tuple[Tokens, list[Diagnostic]]:
    """The words of a source, the last one of kind "end", and the faults in them."""
    return _Lexer(source, limits).run()


def _pattern(text: str) -> re.Pattern[str]:
    r"""The words of a text; its names go on with all of XID_Continue, of which `\w` lacks marks."""
    marks = "" if text.isascii() else "".join(filter(_continues, set(text)))
    return re.compile(_WORD.replace(r"\w*", rf"[\w{marks}]*"), re.VERBOSE) if marks else _ASCII


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


class _Lexer:
    def __init__(self, source: Source, limits: Limits) -> None:
        self.source = source
        self.limits = limits
        self.diagnostics: list[Diagnostic] = []
        self.faulty = False  # the word being read
        self.hash = False  # a `#` before a comment has been reported
        self.tokens = Tokens()
        self.known = dict(_FIXED)  # the words so far: each is read once
        self.brackets: list[str] = []
        self.open = dict.fromkeys("([{", 0)  # how many of each are among the brackets

    def run(self) -> tuple[Tokens, list[Diagnostic]]:
        text, limit = self.source.text, self.limits.source_bytes
        tokens, known, is_ascii = self.tokens, self.known, text.isascii()
        size = _size(text)
        if size > limit:
            fault = SourceTooLarge(self.source.name, f"{size} bytes", limit)
            self.diagnostics.append(fault.diagnostic(Span(self.source, 0, 0)))
            tokens.append("end", 0, 0)
            return tokens, self.diagnostics
        kinds, starts, ends, values = tokens.kinds, tokens.starts, tokens.ends, tokens.values
        brackets, opened = self.brackets, self.open
        broken = 0  # as many tokens as there were at the last newline that ends no statement
        end = 0
        for word in _pattern(text).findall(text):
            start = end
            end += len(word) if is_ascii else _size(word)
            kind, value = known.get(word) or self.read(word, start)
            if kind in _LAYOUT:
                if kind == "space":
                    continue
                if kind in _CLOSES:
                    self.close(kind)
                elif kind in opened:
                    brackets.append(kind)
                    opened[kind] += 1
                elif kind == "newline":
                    if self.in_brackets():
                        broken = len(kinds)
                    elif not kinds or kinds[-1] != "newline":
                        tokens.append("newline", start, end)
                    continue
                elif kind == ".":
                    if kinds and kinds[-1] == "newline":
                        tokens.pop()
                elif broken == len(kinds):
                    # Only a bracket that was never closed can put one of these words here: close
                    # it, so that the fault stays in its own statement.
                    self.leave_line()
                    tokens.append("newline", start, start)
            kinds.append(kind)
            starts.append(start)
            ends.append(end)
            values.append(value)
        tokens.append("end", size, size)
        return tokens, self.diagnostics

    def fault(self, code: str, message: str, start: int, end: int, help: str | None = None) -> None:
        self.faulty = True
        if len(self.diagnostics) <= self.limits.diagnostics:
            span = Span(self.source, start, end)
            self.diagnostics.append(diagnostic(code, message, span, help=help))

    def in_brackets(self) -> bool:
        """Whether a newline ends no statement here."""
        return bool(self.brackets) and self.brackets[-1] != "{"

    def close(self, closer: str) -> None:
        """Forget the brackets up to the one that this closes, if there is one."""
        opener = _CLOSES[closer]
        if self.open[opener]:
            while self.leave() != opener:
                pass

    def leave(self) -> str:
        """Forget the innermost bracket."""
        opener = self.brackets.pop()
        self.open[opener] -= 1
        return opener

    def leave_line(self) -> None:
        """Forget the brackets in which a newline ends no statement."""
        while self.in_brackets():
            self.leave()

    def read(self, word: str, start: int) -> _Word:
        """A word that is not known; the same word without faults is known from here on."""
        self.faulty = False
        first = word[0]
        if first in "0123456789":
            found = self.number(word, start)
        elif first == "_" or (first.isalnum() and not first.isdecimal()):
            found = self.name(word, start)
        elif first == '"':
            found = self.string(word, start)
        elif first == "#":
            found = self.color(word, start)
        elif first == "/":
            found = self.comment(word, start)
        elif first.isspace():
            found = _SPACE
        else:
            found = self.foreign(word, start)
        if not self.faulty:
            self.known[word] = found
        return found

    def name(self, word: str, start: int) -> _Word:
        if word.isascii():
            return "name", word
        if word.isidentifier():
            from unicodedata import normalize

            return "name", normalize("NFC", word)
        valid = next(n for n in range(len(word)) if not word[: n + 1].isidentifier())
        letter = word[valid]
        self.unexpected(letter, start + _size(word[:valid]), SIGNS.get(letter))
        return "fault", None

    def number(self, word: str, start: int) -> _Word:
        digits = _DIGITS.findall(word)[0] if word.strip("0123456789.") else word
        unit, middle = word[len(digits) :], start + len(digits)
        kind, value = "number", float(digits)
        if unit in UNITS:
            kind, value = "angle", degrees_from_literal(digits, unit)
        elif unit:
            kind = "fault"
            self.fault(
                "syntax-unknown-unit",
                f"no unit named `{unit}`",
                middle,
                middle + _size(unit),
                help=self.instead_of_unit(digits, unit),
            )
        if math.isinf(value):
            what, degrees = ("an angle", " degrees") if kind == "angle" else ("a number", "")
            self.fault(
                "syntax-number",
                f"`{word[:40]}` is too large for {what}",
                start,
                start + _size(word),
                help=f"float64 holds up to about 1.8e308{degrees}",
            )
            kind = "fault"
        return kind, value

    def instead_of_unit(self, digits: str, unit: str) -> str:
        """What to write in the place of a number and the letters behind it."""
        if self.tokens and self.tokens.kinds[-1] in _STATEMENT_WORDS:
            return "a name begins with a letter"
        if digits == "0" and re.fullmatch("x[0-9a-fA-F]{6}", unit):
            return f"a color is written `#{unit[1:]}`"
        if re.fullmatch("_[0-9_]*[0-9]", unit):
            return f"write `{digits}{unit.replace('_', '')}`"
        if unit in ("f", "F", "px", "mm", "cm", "m", "km", "in", "ft", "s"):
            return f"only angles have units: write `{digits}`"
        units = f"angles have the units deg, rad and turn; a product is written `{digits} * {unit}`"
        return did_you_mean(unit, UNITS) or units

    def string(self, word: str, start: int) -> _Word:
        if not _STRING.fullmatch(word):
            self.fault(
                "syntax-unterminated-string",
                "this string has no closing quote on its line",
                start,
                start + _size(word),
                help='end it with `"`',
            )
            # What would close the brackets of this line is inside the string.
            self.leave_line()
            return "fault", None
        length, limit = len(word) - 2, self.limits.string_length
        if length > limit:
            message = f"a string of {length} characters, more than the limit of {limit}"
            self.fault("limit-string-length", message, start, start + 1)
            return "fault", None

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
            before = start + _size(word[: 1 + escape.start()])
            self.fault(
                "syntax-escape",
                f"no escape `{escape[0]}`",
                before,
                before + _size(escape[0]),
                help='the escapes are \\" \\\\ \\n \\t and \\u{hexadecimal digits}',
            )
            return ""

        return "string", _ESCAPE.sub(unescape, word[1:-1])

    def comment(self, word: str, start: int) -> _Word:
        if word.startswith("/*") and not (word.endswith("*/") and len(word) > 3):
            self.fault(
                "syntax-unterminated-comment",
                "this comment is never closed",
                start,
                start + 2,
                help="end it with `*/`",
            )
        return _SPACE

    def color(self, word: str, start: int) -> _Word:
        digits = word[1:]
        if re.fullmatch("[0-9a-fA-F]{6}", digits):
            red, green, blue = (srgb_to_linear(int(digits[i : i + 2], 16), 255) for i in (0, 2, 4))
            return "color", (red, green, blue)
        if not digits or not (digits[0].isalnum() or digits[0] == "_"):
            if not self.hash:
                self.hash = True
                help = "comments begin with `//`: write it for every `#`"
                self.fault("syntax-color", "`#` begins no color", start, start + 1, help)
            return _SPACE
        help = "a color has six hexadecimal digits, such as `#d2b48c`; comments begin with `//`"
        if re.fullmatch("[0-9a-fA-F]{3}", digits):
            help = f"write `#{''.join(2 * digit for digit in digits)}`"
        elif re.fullmatch("[0-9a-fA-F]{8}", digits):
            help = f"write `#{digits[:6]}`: a color has no alpha, a material an `opacity`"
        message = f"`{word[:40]}` is no color"
        help = WORDS.get(digits, help)
        self.fault("syntax-color", message, start, start + _size(word), help)
        return "fault", None

    def foreign(self, words: str, start: int) -> _Word:
        """What begins no word; where it can mean one thing only, reading goes on with that."""
        if len(words) > 1 and words[0] in "'`“‘":
            is_number = words[1:2].isdigit()  # for which a string would be another fault
            self.fault(
                "syntax-unexpected-character",
                f"unexpected character `{words[0]}`",
                start,
                start + _size(words),
                f"write it without quotes: `{words[1:-1][:20]}`" if is_number else SIGNS[words[0]],
            )
            return ("fault", None) if is_number else ("string", words[1:-1])
        if (meant := MEANT.get(words)) is None:
            return "foreign", words
        self.unexpected(words, start, f"write `{meant}`")
        return meant, words

    def unexpected(self, words: str, start: int, help: str | None) -> None:
        message, end = unexpected(words), start + _size(words)
        self.fault("syntax-unexpected-character", message, start, end, help)


def unexpected(words: str) -> str:
    """How messages tell of characters that begin no word."""
    shown = words if len(words) <= 8 else words[:8] + "…"
    named = f"`{shown}`" if shown.isprintable() else f"U+{ord(shown[0]):04X}"
    return f"unexpected character {named}"


def _size(text: str) -> int:
    """Bytes in UTF-8; a lone surrogate has three."""
    return len(text) if text.isascii() else len(text.encode("utf-8", "surrogatepass"))
