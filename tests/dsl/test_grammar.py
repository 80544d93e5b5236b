"""dsl/reference/grammar.md against the lexer and the parser, and the examples against it."""

from __future__ import annotations

import re
from collections.abc import Sequence
from random import Random

import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from dsl.budget import DEFAULT_LIMITS
from dsl.examples import REFERENCE, read_examples
from dsl.lexer import tokenize
from dsl.parser import parse
from dsl.spans import Source
from dsl.tokens import KEYWORDS, Token
from tests.dsl.ebnf import Grammar, Node, Reading

PAGE = (REFERENCE / "grammar.md").read_text(encoding="utf-8")
WORDS, SYNTAX = (
    Grammar(block) for block in re.findall(r"^```ebnf\n(.*?)^```", PAGE, re.MULTILINE | re.DOTALL)
)
KINDS = ("name", "number", "angle", "string", "color")
SEEDS = st.integers(0, 2**64).map(Random)

LETTERS: dict[str, Sequence[str]] = {
    "XID_Start": "aeLλö日",
    "XID_Continue": "a3_·ö",
    "0 to 9": "0123456789",  # which make numbers that are too large, see `finite`
    "0 to 9, a to f, A to F": "0fF",
    'any but " and \\ and the end of the line': "a /'日",
    "any": "a*/\n",
    "any but the end of the line": "a*/",
    "a white-space character that ends no line": " \t",
    "U+000A": "\n",
    "U+000D": "\r",
}
"""Characters for the descriptions of the page."""

SAMPLES: dict[str, Sequence[str]] = {
    "name": ("a", "sphere", "ö"),
    "number": ("1", "0.5"),
    "angle": ("40deg", "2e1turn"),
    "string": ('"s"', '"\\n"'),
    "color": ("#d2b48c",),
    "keyword": sorted(KEYWORDS),
    "newline": ("\n", "\r\n"),
}
"""Words for the names of the page."""


def described(description: str, letter: str) -> bool:
    match description:
        case "XID_Start":
            return letter.isidentifier() and letter != "_"
        case "XID_Continue":
            return f"a{letter}".isidentifier()
        case "0 to 9":
            return letter in "0123456789"
        case "0 to 9, a to f, A to F":
            return letter in "0123456789abcdefABCDEF"
        case 'any but " and \\ and the end of the line':
            return letter not in '"\\\r\n'
        case "any but the end of the line":
            return letter not in "\r\n"
        case "any":
            return True
        case "a white-space character that ends no line":
            return letter.isspace() and letter not in "\r\n"
    return letter == {"U+000A": "\n", "U+000D": "\r"}.get(description)


def kinds(text: str) -> list[str]:
    """The words of a source by the names of the page, or [] if it has others."""
    tokens, faults = tokenize(Source("", text), DEFAULT_LIMITS)
    return [] if faults else [_kind(token) for token in tokens[:-1]]


def _kind(token: Token) -> str:
    return str(token.value) if token.kind == "reserved" else token.kind


def is_word(name: str, kind: str) -> bool:
    """Whether a name of the page stands for a word of that kind."""
    return kind in KEYWORDS if name == "keyword" else kind == name


def finite(word: str) -> bool:
    """Whether float64 can hold the number of a word, and Unicode its escapes."""
    number = re.match(r"[0-9]+(\.[0-9]+)?([eE][+-]?[0-9]+)?", word)
    if any(int(digits, 16) > 0x10FFFF for digits in re.findall(r"\\u\{([0-9a-fA-F]+)\}", word)):
        return False
    return number is None or float(number[0]) < float("inf")


def written(nodes: list[Node], random: Random, samples: dict[str, Sequence[str]]) -> list[str]:
    return [
        node.name if node.kind == "text" else random.choice(samples[node.name]) for node in nodes
    ]


def accepted(text: str) -> bool:
    """Whether the parser finds no fault of syntax."""
    return not parse(Source("", text))[1]


def mutated(words: list[str], random: Random) -> list[str]:
    words = [*words]
    for _ in range(random.randrange(1, 3)):
        place = random.randrange(len(words) + 1)
        match random.randrange(3):
            case 0 if place < len(words):
                del words[place]
            case 1 if place < len(words):
                words[place] = random.choice(words)
            case _:
                every = [*words, *KEYWORDS, *"()[]{}.,:=-+", "..", "==", "\n", "x", "1", "time"]
                words.insert(place, random.choice(every))
    return words


@given(SEEDS)
@settings(max_examples=300)
def test_what_the_grammar_makes_is_parsed(random: Random) -> None:
    words = written(SYNTAX.sentence("file", random, 40), random, SAMPLES)
    text = " ".join(words)
    assert Reading(SYNTAX, kinds(text), is_word).conforms("file"), text
    assert accepted(text), text


@given(SEEDS)
@settings(max_examples=600)
def test_the_parser_accepts_what_the_grammar_accepts(random: Random) -> None:
    words = written(SYNTAX.sentence("file", random, 20), random, SAMPLES)
    text = " ".join(mutated(words, random))
    assert accepted(text) is Reading(SYNTAX, kinds(text), is_word).conforms("file"), text


@given(st.sampled_from([*KINDS, "symbol", "keyword"]), SEEDS)
@settings(max_examples=300)
def test_the_lexer_reads_the_words_of_the_grammar(kind: str, random: Random) -> None:
    word = "".join(written(WORDS.sentence(kind, random, 12), random, LETTERS))
    assume(finite(word))
    if kind == "name" and word in {*KEYWORDS, "time", "param"}:
        kind = word
    assert kinds(f"({word})")[1:-1] == [word if kind in ("symbol", "keyword") else kind], word


@given(st.sampled_from(KINDS), SEEDS)
@settings(max_examples=600)
def test_the_lexer_knows_no_other_words(kind: str, random: Random) -> None:
    letters = written(WORDS.sentence(kind, random, 12), random, LETTERS)
    word = "".join(mutated(letters, random))
    assume(word == word.strip() and finite(word))
    found = kinds(f"({word})")[1:-1]
    for kind in KINDS:
        conforms = Reading(WORDS, word, described).conforms(kind)
        if kind == "name" and word in {*KEYWORDS, "time", "param"}:
            conforms = False
        assert (found == [kind]) is conforms, word


@given(SEEDS)
@settings(max_examples=200)
def test_spaces_are_what_the_grammar_says(random: Random) -> None:
    rule = random.choice(("space", "newline"))
    text = "".join(written(WORDS.sentence(rule, random, 8), random, LETTERS))
    if rule == "space" and "*/" in text[2:-2] and text.startswith("/*"):
        return  # a comment ends at the first `*/`
    assert kinds(f"a{text}\nb") == ["name", "newline", "name"]
    assert kinds(f"(a{text}\nb)") == ["(", "name", "name", ")"]
    assert kinds(f"a{text}\n\t.b") == ["name", ".", "name"]


def test_the_words_of_the_page_are_those_of_the_lexer() -> None:
    assert {n.name for rule, n in WORDS.nodes if rule == "keyword" and n.kind == "text"} == KEYWORDS
    assert {n.name for _, n in WORDS.nodes if n.kind == "described"} == set(LETTERS)
    assert {n.name for _, n in SYNTAX.nodes if n.kind == "described"} == set(SAMPLES)


@pytest.mark.parametrize("grammar", [WORDS, SYNTAX], ids=["words", "syntax"])
def test_the_examples_use_every_piece_of_the_grammar(grammar: Grammar) -> None:
    used: set[Node] = set()
    for example in read_examples():
        programs = {example.file: example.source, **example.files}
        for name, text in programs.items():
            text = text.replace("\n", {"cr.ovo": "\r", "crlf.ovo": "\r\n"}.get(name, "\n"))
            if name.endswith(".ovo") and grammar is SYNTAX:
                reading = Reading(SYNTAX, kinds(text), is_word)
                if accepted(text) and reading.words:
                    used |= reading.used("file")
            elif name.endswith(".ovo"):
                used |= _used_by_words(text)
    unused = [(rule, node) for rule, node in grammar.nodes if node not in used]
    assert unused == []


def _used_by_words(text: str) -> set[Node]:
    source = Source("", text)
    tokens, _ = tokenize(source, DEFAULT_LIMITS)
    used: set[Node] = set()
    end = 0
    for token in tokens:
        if token.kind == "newline":
            continue  # it belongs to what is between two words
        word = source.encoded()[token.start : token.end].decode()
        between = source.encoded()[end : token.start].decode()
        end = token.end
        rule = token.kind if token.kind in KINDS else "keyword" if word in KEYWORDS else "symbol"
        reading = Reading(WORDS, word, described)
        if reading.conforms(rule):
            used |= reading.used(rule)
        for space in re.findall(r"//[^\r\n]*|/\*.*?\*/|\r\n?|\n|[^\S\r\n]", between, re.DOTALL):
            for rule in ("space", "newline"):
                reading = Reading(WORDS, space, described)
                if reading.conforms(rule):
                    used |= reading.used(rule)
    return used


def test_examples_conform_where_no_fault_of_syntax_is_shown() -> None:
    for example in read_examples():
        if example.language == "ovolo":
            words = kinds(example.source)
            conforms = (not example.source.strip() or bool(words)) and Reading(
                SYNTAX, words, is_word
            ).conforms("file")
            faulty = re.search(r"^error\[syntax.*\n *--> scene", example.outcome, re.MULTILINE)
            assert conforms is not bool(faulty) or example.chapter == "limits", example.name
