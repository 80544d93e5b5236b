"""`///` lines belong to the definition that follows them."""

from __future__ import annotations

import pytest

from dsl import ast
from dsl.builtins import BUILTINS
from dsl.format import format_source
from dsl.materials import BIND, OVERRIDE
from dsl.parser import parse
from dsl.spans import Source
from dsl.transforms import PLACE
from dsl.values import Builtin


def documented(text: str) -> ast.Let:
    module, faults = parse(Source("t.ovo", text))
    assert not faults
    [statement] = [s for s in module.body.statements if isinstance(s, ast.Let)]
    return statement


@pytest.mark.parametrize(
    ("text", "doc"),
    [
        ("/// one brick\nlet a = 1", "one brick"),
        ("sphere()\n/// one\n///   two\nlet a = 1", "one\n  two"),
        ("/// one\r\n/// two\r\nlet a = 1\r\n", "one\ntwo"),
        ("/// höher: 高\nlet a = 1", "höher: 高"),
        ("///\nlet a = 1", ""),
        ("/// detached\n\nlet a = 1", ""),
        ("/// detached\n// plain\nlet a = 1", ""),
        ("/// first\n\n/// second\nlet a = 1", "second"),
        ("//// ruler\nlet a = 1", ""),
        ("/* /// not\n*/ let a = 1", ""),
        ("/* x\n/// not */\nlet a = 1", ""),
        ("sphere() /// behind\nlet a = 1", ""),
        ("/// of the sphere\nsphere()\nlet a = 1", ""),
    ],
)
def test_lines_directly_above_a_let_are_its_documentation(text: str, doc: str) -> None:
    assert documented(text).doc == doc


def test_functions_parameters_and_files_are_documented() -> None:
    module, faults = parse(
        Source(
            "t.ovo",
            '/// bricks\nuse "b.ovo" as b\n/// a ring of bricks\nfn course(\n'
            "  /// how many\n  count,\n  /// of the block\n  bevel = 1,\n) {\n"
            "  /// inner\n  let x = 1\n}\n",
        )
    )
    assert not faults
    use, function = module.body.statements
    assert isinstance(use, ast.Use)
    assert use.doc == "bricks"
    assert isinstance(function, ast.Function)
    assert function.doc == "a ring of bricks"
    assert [p.doc for p in function.parameters] == ["how many", "of the block"]
    assert function.body is not None
    [inner] = function.body.statements
    assert isinstance(inner, ast.Let)
    assert inner.doc == "inner"


def test_the_formatter_keeps_documentation() -> None:
    text = (
        "/// a\n///  b\nfn   f(\n /// how many\n count,\n/// size\n size=1) {\n/// in\nlet   x=1\n}"
    )
    formatted, _ = format_source(Source("t.ovo", text))
    assert formatted is not None
    before, after = (
        parse(Source("t.ovo", each))[0].body.statements[0] for each in (text, formatted)
    )
    assert isinstance(before, ast.Function)
    assert isinstance(after, ast.Function)
    assert after.doc == before.doc == "a\n b"
    assert [p.doc for p in after.parameters] == [p.doc for p in before.parameters]
    assert after.body is not None
    assert [getattr(s, "doc", "") for s in after.body.statements] == ["in"]


def test_every_builtin_says_what_it_is_and_gives() -> None:
    values = [binding.value for binding in BUILTINS.values()]
    for builtin in (*values, *PLACE.values(), BIND, OVERRIDE):
        if isinstance(builtin, Builtin):
            assert builtin.result, builtin.name
            assert builtin.doc.endswith("."), builtin.name
