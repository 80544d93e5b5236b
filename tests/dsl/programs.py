"""Random programs: grown from the grammar, laid out by somebody with no taste."""

from __future__ import annotations

from random import Random

from hypothesis import strategies as st

Words = list[str]
"""Words of a program; `SPACE`, `BREAK` and `END` stand for what may be between two of them."""

SPACE, BREAK, END = "\0", "\1", "\2"

_NAMES = ("sphere", "box", "a", "größe", "i", "pi")
_BINARY = ("+", "-", "*", "/", "%", "or", "and")
_LITERALS = ("0.5", "2E2", "40deg", "0.25turn", '"text // no comment"', "#D2b48c", "true")
_LONG = "a_name_that_is_rather_long_for_a_name"
_GAPS = {
    SPACE: (" ", "  ", ""),
    BREAK: (" ", "", "", "\n", "\n\n\n   ", "\r\n\t"),
    END: ("\n", "\n\n", "\n \n\n\t", "  \r\n"),
}
_COMMENTS = {
    SPACE: (" /* c */ ",),
    BREAK: (
        *(" // c  \n", "\n// own\n", " /* c */\n", "\n/* a\n  b */ ", "\n\n// d\n\n// e\n"),
        *("\n/// f\n", "\n/* c */ /// f\n", " // c\n/// f\n\n"),
    ),
    END: (
        *("  // c\n", "\n// own\n", "\n\n/* a\n  b */ ", " /* c */ // d\n\n// e\n\n"),
        *("\n/// f\n", "\n/* c */ /// f\n"),
    ),
}


def programs(comments: bool = True) -> st.SearchStrategy[str]:
    """Programs without faults of syntax."""
    return st.integers(0, 2**64).map(lambda seed: text_of(seed, comments))


def text_of(seed: int, comments: bool = True) -> str:
    """The program that grows from a seed."""
    return _Author(Random(seed)).program(comments)


def _spaced(*parts: Words, space: str) -> Words:
    result: Words = []
    for part in parts:
        result += [*([space] if result and part else []), *part]
    return result


class _Author:
    def __init__(self, random: Random) -> None:
        self.random = random

    def program(self, comments: bool) -> str:
        text = self.random.choice(["", *_GAPS[END], *(_COMMENTS[END] if comments else [])])
        for word in self.statements(3):
            if word in _GAPS:
                share = 0.3 if comments else 0.0
                gaps = _COMMENTS if self.random.random() < share else _GAPS
                word = self.random.choice(gaps[word]) or " "
            text += word
        return text

    def statements(self, level: int) -> Words:
        result: Words = []
        for _ in range(self.random.randrange(4)):
            value = self.expression(level, SPACE)
            name = [self.random.choice(("a", "b", _LONG))]
            match self.random.randrange(6):
                case 0:
                    value = _spaced(["let"], name, ["="], value, space=SPACE)
                case 1:
                    head = ["fn", SPACE, *name, "(", BREAK, "x", BREAK, ",", BREAK, "y", BREAK]
                    default = ["=", BREAK, *self.expression(level - 1, BREAK), BREAK]
                    body = self.block(level - 1)
                    value = [*head, *self.random.choice(([], default)), ")", SPACE, *body]
                case 2:
                    value = _spaced(["use"], ['"b.ovo"'], ["as"], name, space=SPACE)
            result += [*value, END]
        return result

    def block(self, level: int) -> Words:
        inside = self.statements(level) if level > 0 else ["a"]
        if inside[-1:] == [END] and self.random.random() < 0.5:
            inside = inside[:-1]
        return ["{", self.random.choice((SPACE, END)), *inside, SPACE, "}"]

    def sequence(self, level: int, opener: str, closer: str = ")", named: bool = False) -> Words:
        result = [opener, BREAK]
        count = self.random.randrange(0 if opener == "[" or named else 1, 5)
        for position in range(count):
            if position:
                result += [",", BREAK]
            if named:
                result += [self.random.choice(("radius", _LONG)), BREAK, ":", BREAK]
            result += [*self.expression(level, BREAK), BREAK]
        if count and self.random.random() < 0.5:
            result += [",", BREAK]
        return [*result, closer]

    def expression(self, level: int, space: str) -> Words:
        """An expression; within round and square brackets `space` is `BREAK`."""
        if level <= 0:
            return [self.random.choice((*_NAMES, *_LITERALS, _LONG))]
        match self.random.randrange(9):
            case 0 | 1 | 2:
                result = [self.random.choice(_NAMES)]
                for _ in range(self.random.randrange(1, 4)):
                    name = self.random.choice(("scale", "x", "in", _LONG))
                    result += [BREAK, ".", space, name]
                    if self.random.random() < 0.6:
                        named = self.random.random() < 0.5
                        result += self.sequence(level - 1, "(", named=named)
                return result
            case 3:
                return self.sequence(level - 1, "(")
            case 4:
                return self.sequence(level - 1, "[", "]")
            case 5:
                left, right = self.expression(level - 1, BREAK), self.expression(level - 1, BREAK)
                product = _spaced(["("], left, ["*"], right, [")"], space=BREAK)
                return [*product, "[", BREAK, "1", BREAK, "]"]
            case 6:
                operator = self.random.choice(_BINARY)
                signs = [*self.random.choice(("", "-", "--"))]
                return _spaced(["a"], [operator], signs, ["b"], ["+"], ["c"], space=space)
            case 7:
                head = _spaced(["for"], ["i"], ["in"], ["0"], [".."], [_LONG], space=space)
                return _spaced(head, self.block(level - 1), space=space)
            case _:
                head = _spaced(["if"], ["not"], ["a"], self.block(level - 1), space=space)
                return _spaced(head, ["else"], self.block(level - 1), space=space)
