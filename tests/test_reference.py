"""The language reference is the conformance suite: every example of it is run."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import pytest

from compiler.compilation import Compilation, compile_path
from compiler.ir_file import read_ir_file
from compiler.ir_text import print_ir
from compiler.usd.options import StageOptions
from dsl.budget import Limits
from dsl.builtins import BUILTINS
from dsl.codes import CODES, is_advice
from dsl.diagnostics import CompileError
from dsl.examples import REFERENCE, Example, read_examples
from dsl.files import Files
from dsl.format import format_source
from dsl.render_diagnostic import render_diagnostics
from dsl.spans import Source
from runtime.text_picture import text_picture

EXAMPLES = list(read_examples())
KEPT = ("ir", "picture")


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The folder of the example: names in diagnostics start from it."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


def run(example: Example, folder: Path) -> str:
    example.write_files(folder)
    if example.kind == "formatted":
        return format_source(Source(example.file, example.source))[0] or ""
    try:
        if example.language == "ir":
            return print_ir(read_ir_file(Path(example.file)))
        compilation = compiled(example, folder)
    except CompileError as error:
        return render_diagnostics(error.diagnostics)
    return outcome(compilation, example)


def compiled(example: Example, folder: Path) -> Compilation:
    words = dict(example.words)
    given = {n.removeprefix("set:"): words.pop(n) for n in example.words if n.startswith("set:")}
    time = float(words.pop("time")) if "time" in words else None
    options = StageOptions(variants=tuple(words.pop("variant", "").split()))
    files = Files(folder, int(words.pop("file_bytes", 1_000_000)))
    limits = Limits(**{word: int(value) for word, value in words.items()})
    return compile_path(Path(example.file), time, options, files, limits, given)


def outcome(compilation: Compilation, example: Example) -> str:
    if example.kind == "diagnostics":
        shown = [w for w in compilation.warnings if example.shows_advice or not is_advice(w.code)]
        return render_diagnostics(shown)
    return print_ir(compilation.ir) if example.kind == "ir" else text_picture(compilation.ir)


@pytest.mark.parametrize("example", EXAMPLES, ids=lambda example: example.name)
def test_example(example: Example, folder: Path, request: pytest.FixtureRequest) -> None:
    found = run(example, folder)
    if request.config.getoption("--update"):
        rewrite(example, found)
    else:
        assert found == example.outcome


@pytest.mark.parametrize("chapter", sorted({example.chapter for example in EXAMPLES}))
def test_formatting_keeps_the_meaning(chapter: str, folder: Path) -> None:
    for example in EXAMPLES:
        if (example.chapter, example.language) == (chapter, "ovolo") and example.kind in KEPT:
            formatted, _ = format_source(Source(example.file, example.source))
            assert formatted is not None
            assert run(replace(example, source=formatted), folder) == example.outcome


def rewrite(example: Example, found: str) -> None:
    path = REFERENCE / f"{example.chapter}.md"
    head, name, rest = path.read_text(encoding="utf-8").partition(f"## {example.name}\n")
    section, mark, tail = rest.partition("\n## ")
    block = re.compile(rf"^```{example.kind}\n.*?^```$", re.MULTILINE | re.DOTALL)
    last = list(block.finditer(section))[-1]
    section = f"{section[: last.start()]}```{example.kind}\n{found}```{section[last.end() :]}"
    path.write_text(head + name + section + mark + tail)


@pytest.mark.parametrize("example", [e for e in EXAMPLES if e.stage], ids=lambda e: e.name)
def test_stage_gives_the_same_ir(example: Example, folder: Path) -> None:
    stage = replace(example, language="usda", source=example.stage or "")
    assert run(stage, folder) == example.outcome


def test_names_are_unique() -> None:
    names = [example.name for example in EXAMPLES]
    assert sorted(set(names)) == sorted(names)


def test_every_code_has_an_example() -> None:
    text = "\n".join(example.outcome for example in EXAMPLES if example.kind == "diagnostics")
    shown = set(re.findall(r"^(?:error|warning)\[(.*?)\]", text, re.MULTILINE))
    # What befalls the process that imports a stage depends on the machine, and `usd-program`
    # tells of a stage that becomes a program; textures are read when a picture is made.
    assert shown ^ set(CODES) == {
        "texture-unreadable",
        "usd-crash",
        "usd-deadline",
        "usd-memory",
        "usd-program",
    }


def test_every_builtin_has_an_example() -> None:
    text = "\n".join(example.source for example in EXAMPLES if example.kind != "diagnostics")
    assert [name for name in BUILTINS if not re.search(rf"\b{name}\b", text)] == []
