"""The parser: never raises, keeps places inside the source, and keeps faults to themselves."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import fields, is_dataclass

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dsl import ast
from dsl.diagnostics import Diagnostic
from dsl.evaluate import evaluate
from dsl.files import Files
from dsl.parser import parse
from dsl.render_diagnostic import render_diagnostics, to_json
from dsl.spans import Source, Span

TEXT = """let fn for in if else use as and or not true false param time x sphere box 1 0.5 1e9
40deg 2em "s" "open #ff8000 #f // /* */ ( ) [ ] { } . , : = + - * / % < == .. é 太"""
WORDS = [*TEXT.split(), "\n", "\t"]

STATEMENTS = (
    "sphere()",
    "let a = 1 + 2 * 3",
    "let b = [1, (2, 3), 0..4, #ff8000]",
    "fn f(x, y = 2) { sphere(radius: x).translate(y, 0, 0) }",
    "for i in 0..3, j in [1, 2] { box(size: (1, i, j)) }",
    "if not 1 < 2 { sphere() } else if true { box() } else { plane() }",
    'use "other.ovo" as other',
    "sphere()\n  .scale(2)\n  // up\n  .translate(0, 1, 0)",
)
FAULTY = ("let = 3", "sphere(", "1 +", "a b", ")", "2 ^ 3", 'let s = "open', "if { }", "f(a: 1, 2)")


def nodes(node: object) -> Iterator[object]:
    """All nodes of a tree, without recursion."""
    stack = [node]
    while stack:
        top = stack.pop()
        if isinstance(top, tuple):
            stack.extend(top)
        elif is_dataclass(top) and not isinstance(top, Span | Source):
            yield top
            stack.extend(getattr(top, field.name) for field in fields(top))


def check(text: str) -> tuple[ast.Module, list[Diagnostic]]:
    source = Source("scene.ovo", text)
    module, diagnostics = parse(source)
    size = len(source.encoded())
    for node in nodes(module.body):
        span = getattr(node, "span", None)
        if isinstance(span, Span):
            assert 0 <= span.start <= span.end <= size
    for found in diagnostics:
        assert found.primary is not None
        assert isinstance(found.primary.place, Span)
        assert 0 <= found.primary.place.start <= found.primary.place.end <= size
        to_json(found)
    render_diagnostics(diagnostics, color=True)
    return module, diagnostics


@given(st.text(alphabet=st.characters(), max_size=60))
def test_any_text_is_parsed(text: str) -> None:
    check(text)


@given(st.lists(st.sampled_from(WORDS), max_size=40), st.booleans())
def test_any_words_are_parsed(words: list[str], spaced: bool) -> None:
    check((" " if spaced else "").join(words))


@given(st.lists(st.sampled_from(STATEMENTS), max_size=6))
def test_statements_without_faults(statements: list[str]) -> None:
    module, diagnostics = check("\n".join(statements))
    assert not diagnostics
    assert len(module.body.statements) == len(statements)


@given(st.lists(st.sampled_from(STATEMENTS), max_size=4), st.sampled_from(FAULTY), st.data())
def test_a_fault_is_reported_once_and_leaves_the_others_alone(
    statements: list[str], faulty: str, data: st.DataObject
) -> None:
    # A statement that begins with a word of its own ends whatever the fault has left open.
    statements = [f"let v{i} = {{ {s} }}" for i, s in enumerate(statements)]
    position = data.draw(st.integers(0, len(statements)))
    module, diagnostics = check("\n".join([*statements[:position], faulty, *statements[position:]]))
    assert len(diagnostics) == 1
    kept = {s.name for s in module.body.statements if isinstance(s, ast.Let)}
    assert {f"v{i}" for i in range(len(statements))} <= kept


@given(st.lists(st.sampled_from(FAULTY), min_size=2, max_size=5))
def test_independent_faults_are_all_reported(faults: list[str]) -> None:
    lines = [f"let v{i} = {{ {fault}\n}}\nlet w{i} = 1" for i, fault in enumerate(faults)]
    _, diagnostics = check("\n".join(lines))
    assert len(diagnostics) >= len(faults)


@given(st.lists(st.sampled_from(["1", "x", "(2)", "f(3)"]), min_size=2, max_size=8), st.data())
def test_precedence_is_that_of_python(operands: list[str], data: st.DataObject) -> None:
    operators = [data.draw(st.sampled_from("+-*/%")) for _ in operands[1:]]
    text = operands[0] + "".join(f" {o} {p}" for o, p in zip(operators, operands[1:], strict=True))
    module, diagnostics = check(text)
    assert not diagnostics
    (expression,) = module.body.statements
    names = {"x": 7.0, "f": lambda value: value + 4.0}
    assert _value(expression) == eval(text, {"__builtins__": {}}, names)


def _value(node: object) -> float:
    """An arithmetic expression's value, computed from the tree by its definition."""
    match node:
        case ast.Number(value=value):
            return value
        case ast.Name():
            return 7.0
        case ast.Chain(suffixes=(ast.Call(arguments=(argument,)),)):
            return _value(argument.value) + 4.0
        case ast.Operation(operands=(first, *rest), operators=operators):
            value = _value(first)
            for operator, operand in zip(operators, rest, strict=True):
                other = _value(operand)
                match operator.symbol:
                    case "+":
                        value += other
                    case "-":
                        value -= other
                    case "*":
                        value *= other
                    case "/":
                        value /= other
                    case "%":
                        value %= other
            return value
    raise AssertionError(node)


@pytest.mark.parametrize("newline", ["\n", "\r\n", "\r"])
def test_newlines_of_every_system(newline: str) -> None:
    module, diagnostics = check(newline.join(STATEMENTS))
    assert not diagnostics
    assert len(module.body.statements) == len(STATEMENTS)


@pytest.mark.parametrize(
    ("text", "codes"),
    [
        ("sphere()" + ".translate(1, 0, 0)" * 5_000, []),
        ("sphere(radius: " + " + ".join(["1"] * 5_000) + ")", []),
        ("let a = if false { 1 }" + " else if true { 2 }" * 5_000, []),
        ("sphere(radius: " + "(" * 20_000, ["limit-nesting"]),
        ("{" * 20_000, ["limit-nesting"]),
        ("sphere(radius: " + "-" * 20_000 + "1)", ["limit-nesting"]),
        ("if true " + "{ if true " * 20_000, ["limit-nesting"]),
        ("f(\n" * 20_000, ["limit-nesting"]),
    ],
    ids=["chain", "sum", "else if", "parentheses", "braces", "signs", "conditions", "calls"],
)
def test_depth_is_no_recursion(text: str, codes: list[str]) -> None:
    _, diagnostics = parse(Source("deep.ovo", text))
    assert [found.code for found in diagnostics] == codes


def test_the_deepest_tree_is_within_the_machine_s_recursion() -> None:
    level = "a or b and c == d .. e + f * g({ if h { "
    _, diagnostics = parse(Source("deep.ovo", "let a = " + level * 100))
    assert [found.code for found in diagnostics] == ["limit-nesting"]
    deepest = "let a = " + "true or true and 1 == 1 .. 1 + 1 * count([" * 30 + "])" * 30
    module, diagnostics = parse(Source("deep.ovo", deepest))
    assert not diagnostics
    evaluate(module, Files())


@settings(max_examples=20)
@given(st.integers(1, 64))
def test_nesting_up_to_the_limit(depth: int) -> None:
    _, diagnostics = check("let a = " + "(" * depth + "1" + ")" * depth)
    assert not diagnostics
