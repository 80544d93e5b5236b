"""The language reference is the conformance suite: every example of it is run."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest

from compiler.flatten import flatten
from compiler.ir import SceneIR
from compiler.ir_text import print_ir
from compiler.mesh import load_file
from compiler.usd import import_stage
from dsl.budget import Limits
from dsl.builtins import BUILTINS
from dsl.codes import CODES
from dsl.diagnostics import Diagnostic
from dsl.evaluate import evaluate_source
from dsl.examples import REFERENCE, Example, read_examples
from dsl.files import Files
from dsl.format import format_source
from dsl.render_diagnostic import render_diagnostics
from dsl.scene import SceneGraph
from dsl.spans import Source

Draw = Callable[[SceneIR], str]


EXAMPLES = list(read_examples())


def run(example: Example, folder: Path, draw: Draw) -> str:
    example.write_files(folder)
    words = {word: int(value) for word, value in example.words.items()}
    files = Files(folder, words.pop("file_bytes", 1_000_000))
    source = Source("scene.ovo", example.source)
    if example.kind == "formatted":
        return format_source(source)[0] or ""
    time = float(words.pop("time", 0))
    graph, found = evaluate_source(source, files, Limits(**words), time)
    return outcome(graph, found, files, example.kind, draw)


def outcome(
    graph: SceneGraph | None, found: list[Diagnostic], files: Files, kind: str, draw: Draw
) -> str:
    if graph is not None:
        ir, more, _ = flatten(graph, lambda file: load_file(file, files))
        found = [*found, *more]
    if kind == "diagnostics":
        return render_diagnostics(found)
    assert not found, render_diagnostics(found)
    assert ir is not None
    return print_ir(ir) if kind == "ir" else draw(ir)


@pytest.mark.parametrize("example", EXAMPLES, ids=lambda example: example.name)
def test_example(
    example: Example, tmp_path: Path, draw: Draw, request: pytest.FixtureRequest
) -> None:
    found = run(example, tmp_path, draw)
    if request.config.getoption("--update"):
        rewrite(example, found)
    else:
        assert found == example.outcome


@pytest.mark.parametrize("chapter", sorted({example.chapter for example in EXAMPLES}))
def test_formatting_keeps_the_meaning(chapter: str, tmp_path: Path, draw: Draw) -> None:
    for example in EXAMPLES:
        if example.chapter == chapter and example.kind in ("ir", "picture"):
            formatted, _ = format_source(Source("scene.ovo", example.source))
            assert formatted is not None
            assert run(replace(example, source=formatted), tmp_path, draw) == example.outcome


def rewrite(example: Example, found: str) -> None:
    path = REFERENCE / example.chapter
    head, name, rest = path.read_text().partition(f"## {example.name}\n")
    section, mark, tail = rest.partition("\n## ")
    block = re.compile(rf"^```{example.kind}\n.*?^```$", re.MULTILINE | re.DOTALL)
    section = block.sub(lambda _: f"```{example.kind}\n{found}```", section, count=1)
    path.write_text(head + name + section + mark + tail)


@pytest.mark.parametrize("example", [e for e in EXAMPLES if e.stage], ids=lambda e: e.name)
def test_stage_gives_the_same_ir(example: Example, tmp_path: Path, draw: Draw) -> None:
    (tmp_path / "stage.usda").write_text(example.stage or "")
    graph, found = import_stage(tmp_path / "stage.usda")
    assert outcome(graph, found, Files(tmp_path), "ir", draw) == example.outcome


def test_names_are_unique() -> None:
    names = [example.name for example in EXAMPLES]
    assert sorted(set(names)) == sorted(names)


def test_every_code_of_the_language_has_an_example() -> None:
    text = "\n".join(example.outcome for example in EXAMPLES if example.kind == "diagnostics")
    phases = ("syntax-", "name-", "type-", "value-", "file-", "limit-")
    codes = {code for code in CODES if code.startswith(phases)}
    assert codes - set(re.findall(r"^(?:error|warning)\[(.*?)\]", text, re.MULTILINE)) == set()


def test_every_builtin_has_an_example() -> None:
    text = "\n".join(example.source for example in EXAMPLES if example.kind != "diagnostics")
    assert [name for name in BUILTINS if not re.search(rf"\b{name}\b", text)] == []
