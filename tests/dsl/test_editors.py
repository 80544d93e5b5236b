"""The editors' grammar reads programs as the lexer does."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import pytest

from dsl.angles import UNITS
from dsl.budget import DEFAULT_LIMITS
from dsl.builtins import BUILTINS
from dsl.examples import read_examples
from dsl.language_service.meaning import METHODS
from dsl.lexer import tokenize
from dsl.spans import Source
from dsl.tokens import KEYWORDS
from dsl.values import Builtin
from tests.dsl.textmate import scopes

VSCODE = Path(__file__).parent.parent.parent / "dsl" / "editors" / "vscode"
GRAMMAR: dict[str, Any] = json.loads((VSCODE / "syntaxes" / "ovolo.tmLanguage.json").read_text())
PROGRAMS = sorted({e.source for e in read_examples() if e.language == "ovolo"})


def due(kind: str) -> str:
    """What the scope of a token of that kind begins with."""
    if kind in ("let", "fn", "param"):
        return r"storage\.type"
    if kind in ("true", "false"):
        return r"constant\.language"
    if kind in KEYWORDS:
        return r"keyword\.(control|operator\.word)"
    kinds = {
        "number": r"constant\.numeric",
        "angle": r"constant\.numeric|keyword\.other\.unit",
        "string": r"string|constant\.character\.escape",
        "color": r"constant\.other\.color",
        "reserved": r"support\.constant|variable|entity",
        "name": r"variable|entity\.name|support",
    }
    return kinds.get(kind, r"keyword\.operator|punctuation")


def check(text: str) -> int:
    """Compare the two; the number of tokens compared."""
    tokens, faults = tokenize(Source("t.ovo", text), DEFAULT_LIMITS)
    if faults:
        return 0
    found = scopes(GRAMMAR, text)
    offsets = [0]
    for character in text:
        offsets.append(offsets[-1] + len(character.encode()))
    index = {offset: position for position, offset in enumerate(offsets)}
    before, after_dot, end = "", False, 0
    for position, token in enumerate(tokens):
        if token.kind in ("newline", "end"):
            continue
        start, stop = index[token.start], index[token.end]
        for between in range(end, start):
            assert text[between].isspace() or found[between].startswith("comment"), text[between:]
        is_name = after_dot or (tokens[position + 1].kind == ":" and before in ("(", ","))
        expected = due("name" if is_name and re.match(r"[^\W\d]", text[start]) else token.kind)
        for scope in found[start:stop]:
            assert re.match(expected, scope), (text[start:stop], scope, expected)
        before, after_dot, end = token.kind, token.kind == ".", stop
    return len(tokens)


def test_every_example_of_the_reference() -> None:
    assert sum(map(check, PROGRAMS)) > 3000


@pytest.mark.parametrize(
    "text",
    [
        'let größe = 1.5e-3 // "no string" /* no comment\nsphere(radius: größe)\n',
        '"a // b /* \\" \\u{1F600} #ffffff 1deg let" /* let\n"x" */ let a = 1\n',
        "a.let.in(for: 1deg, in: 2rad) + b .x\n",
        "let letter = format1 + time.x\nfn fn1(a) { if not a { 1..2 } else { 0.5..1.5 } }\n",
        "/// doc #ffffff\n//// rule\n/**/ 1 /***/ 2 /*/ 3 */ 4\n",
        "x[0].y\n  .z(1)\n",
        "#d2b48c\n[1, 2.5turn]\n",
    ],
)
def test_cases_where_regular_expressions_go_wrong(text: str) -> None:
    assert check(text)


def test_the_grammar_knows_the_words_of_the_language() -> None:
    text = json.dumps(GRAMMAR["repository"])
    for word in (*KEYWORDS, *UNITS, *METHODS, *(n for n, b in BUILTINS.items())):
        assert re.search(rf"\b{word}\b", text), word
    functions = GRAMMAR["repository"]["functions"]["patterns"][0]["match"]
    listed = set(re.findall(r"[a-z_0-9]{2,}", functions.replace("(?<!\\w)", "").replace("\\s", "")))
    assert listed == {n for n, b in BUILTINS.items() if isinstance(b.value, Builtin)}


def test_the_extension_names_files_that_exist() -> None:
    package = json.loads((VSCODE / "package.json").read_text())
    contributes = package["contributes"]
    named = [
        package["main"],
        contributes["languages"][0]["configuration"],
        contributes["grammars"][0]["path"],
    ]
    for name in named:
        assert (VSCODE / name).is_file()
    assert contributes["grammars"][0]["scopeName"] == GRAMMAR["scopeName"]
    json.loads((VSCODE / "language-configuration.json").read_text())
