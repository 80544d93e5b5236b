"""The language reference is the conformance suite: every example of dsl/reference/*.md is run.

An example is a `##` section with one source block and one outcome block. The source is
```` ```ovolo ````, followed by words `name=value` for the limits it is run under; further blocks
with a file's name, ```` ```ovolo bricks.ovo ````, are files beside it; a ```` ```usda ```` block
is a stage that must give the same IR. The outcome is `ir`, the canonical text; `diagnostics`,
their exact rendering; `formatted`, the canonical form; or `picture`, see `draw`.
"""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass, replace
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
from dsl.files import Files
from dsl.format import format_source
from dsl.render_diagnostic import render_diagnostics
from dsl.scene import SceneGraph
from dsl.spans import Source

REFERENCE = Path(__file__).parent.parent / "dsl" / "reference"
BLOCK = re.compile(r"^```(\w+)([^\n]*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
KINDS = ("ir", "diagnostics", "formatted", "picture")
Draw = Callable[[SceneIR], str]


@dataclass
class Example:
    chapter: str
    name: str
    source: str
    words: dict[str, str]
    files: dict[str, str]
    stage: str | None
    kind: str
    outcome: str


def read_examples() -> Iterator[Example]:
    for chapter in sorted(REFERENCE.glob("*.md")):
        for section in re.split(r"^## ", chapter.read_text(), flags=re.MULTILINE)[1:]:
            blocks = [(m[1], m[2].split(), m[3]) for m in BLOCK.finditer(section)]
            if blocks:
                yield read_example(chapter.name, section.partition("\n")[0].strip(), blocks)


def read_example(chapter: str, name: str, blocks: list[tuple[str, list[str], str]]) -> Example:
    files = {words[0]: text for _, words, text in blocks if words and "=" not in words[0]}
    rest = [block for block in blocks if not block[1] or "=" in block[1][0]]
    sources = [(words, text) for kind, words, text in rest if kind == "ovolo"]
    stage = next((text for kind, _, text in rest if kind == "usda"), None)
    outcomes = [(kind, text) for kind, _, text in rest if kind in KINDS]
    assert len(sources) == 1, f"{chapter}: `{name}` needs exactly one source"
    assert len(outcomes) == 1, f"{chapter}: `{name}` needs exactly one outcome"
    words = dict(word.split("=", 1) for word in sources[0][0])
    return Example(chapter, name, sources[0][1], words, files, stage, *outcomes[0])


EXAMPLES = list(read_examples())


def run(example: Example, folder: Path, draw: Draw) -> str:
    for name, text in example.files.items():
        encoding = "latin-1" if name.startswith("latin") else "utf-8"
        (folder / name).write_text(text, encoding=encoding)
    words = {word: int(value) for word, value in example.words.items()}
    files = Files(folder, words.pop("file_bytes", 1_000_000))
    source = Source("scene.ovo", example.source.removesuffix("\n"))
    if example.kind == "formatted":
        return format_source(source)[0] or ""
    graph, found = evaluate_source(source, files, Limits(**words))
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


def test_dump(request: pytest.FixtureRequest) -> None:
    if (target := request.config.getoption("--dump")) is None:
        pytest.skip("asked for by --dump FILE")
    Path(target).write_text(json.dumps([asdict(example) for example in EXAMPLES], indent=1))
