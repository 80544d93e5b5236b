"""The language reference is the conformance suite: every example of dsl/reference/*.md is run.

An example is a `##` section with one source block and one outcome block. The source is
```` ```ovolo ````, followed by words `name=value` for the limits it is run under; further blocks
```` ```ovolo bricks.ovo ```` are files beside it, and a ```` ```usda ```` block is a stage that
must give the same IR. The outcome is `ir`, the canonical text; `diagnostics`, their exact
rendering; or `picture`, what a ray through each character hits: `a` for prototype 0, and so on.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from dataclasses import asdict, dataclass, field
from pathlib import Path

import numpy as np
import pytest

from compiler.flatten import flatten
from compiler.ir import ORTHOGRAPHIC, SceneIR
from compiler.ir_text import print_ir
from compiler.mesh import load_file
from dsl.budget import Limits
from dsl.codes import CODES
from dsl.diagnostics import Diagnostic
from dsl.evaluate import evaluate_source
from dsl.files import Files
from dsl.render_diagnostic import render_diagnostics
from dsl.scene import SceneGraph
from dsl.spans import Source

REFERENCE = Path(__file__).parent.parent / "dsl" / "reference"
OUTCOMES = ("ir", "diagnostics", "picture")
COLUMNS, ROWS = 48, 24  # characters of a picture, each twice as high as wide
BLOCK = re.compile(r"^```(\w+)([^\n]*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)


@dataclass
class Example:
    chapter: str
    name: str
    source: str
    words: dict[str, str]
    files: dict[str, str] = field(default_factory=dict)
    stage: str | None = None
    kind: str = ""
    outcome: str = ""


def read_examples() -> Iterator[Example]:
    for chapter in sorted(REFERENCE.glob("*.md")):
        for section in re.split(r"^## ", chapter.read_text(), flags=re.MULTILINE)[1:]:
            blocks = [(m[1], m[2].split(), m[3]) for m in BLOCK.finditer(section)]
            if blocks:
                yield _example(chapter.name, section.partition("\n")[0].strip(), blocks)


def _example(chapter: str, name: str, blocks: list[tuple[str, list[str], str]]) -> Example:
    sources = [b for b in blocks if b[0] == "ovolo" and not (b[1] and "=" not in b[1][0])]
    outcomes = [b for b in blocks if b[0] in OUTCOMES]
    assert len(sources) == 1, f"{chapter}: `{name}` needs exactly one source"
    assert len(outcomes) == 1, f"{chapter}: `{name}` needs exactly one outcome"
    words = dict(word.split("=", 1) for word in sources[0][1])
    files = {b[1][0]: b[2] for b in blocks if b[0] == "ovolo" and b not in sources}
    stage = next((b[2] for b in blocks if b[0] == "usda"), None)
    kind, _, outcome = outcomes[0]
    return Example(chapter, name, sources[0][2], words, files, stage, kind, outcome)


EXAMPLES = list(read_examples())


def run(example: Example, folder: Path) -> str:
    for name, text in example.files.items():
        encoding = "latin-1" if name.startswith("latin") else "utf-8"
        (folder / name).write_text(text, encoding=encoding)
    words = dict(example.words)
    files = Files(folder, int(words.pop("file_bytes", "1000000")))
    limits = Limits(**{word: int(value) for word, value in words.items()})
    source = Source("scene.ovo", example.source.removesuffix("\n"))
    graph, found = evaluate_source(source, files, limits)
    return outcome(graph, found, files, example.kind)


def outcome(graph: SceneGraph | None, found: list[Diagnostic], files: Files, kind: str) -> str:
    if graph is not None:
        ir, more, _ = flatten(graph, lambda file: load_file(file, files))
        found = [*found, *more]
    if kind == "diagnostics":
        return render_diagnostics(found)
    assert not found, render_diagnostics(found)
    assert graph is not None
    assert ir is not None
    return print_ir(ir) if kind == "ir" else picture(ir)


def picture(ir: SceneIR) -> str:
    """What the first camera sees, one character a ray."""
    kernel = pytest.importorskip("runtime._kernel").Kernel(ir, "float64")
    camera = ir.cameras[0]
    y, x = np.meshgrid(
        0.5 - (np.arange(ROWS) + 0.5) / ROWS,
        (np.arange(COLUMNS) + 0.5) / COLUMNS - 0.5,
        indexing="ij",
    )
    window = camera["height"] * np.stack([x.ravel(), y.ravel(), np.zeros(x.size)], axis=1)
    axis = np.broadcast_to([0.0, 0.0, -1.0], window.shape)
    orthographic = camera["projection"] == ORTHOGRAPHIC
    world_from_camera = camera["world_from_camera"]
    origins = (window if orthographic else 0.0 * window) @ world_from_camera[:, :3].T
    directions = (axis if orthographic else window + axis) @ world_from_camera[:, :3].T
    origins = np.ascontiguousarray(origins + world_from_camera[:, 3])
    everywhere = np.array([0.0]), np.array([np.inf])
    hit = kernel.trace(origins, np.ascontiguousarray(directions), *everywhere)[4]
    letters = np.array([*"abcdefghijklmnopqrstuvwxyz", "."])[hit].reshape(ROWS, COLUMNS)
    return "".join("".join(row) + "\n" for row in letters)


@pytest.mark.parametrize("example", EXAMPLES, ids=lambda example: example.name)
def test_example(example: Example, tmp_path: Path, request: pytest.FixtureRequest) -> None:
    found = run(example, tmp_path)
    if request.config.getoption("--update"):
        rewrite(example, found)
    else:
        assert found == example.outcome


def rewrite(example: Example, found: str) -> None:
    path = REFERENCE / example.chapter
    head, name, rest = path.read_text().partition(f"## {example.name}\n")
    section, mark, tail = rest.partition("\n## ")
    block = re.compile(rf"^```{example.kind}\n.*?^```$", re.MULTILINE | re.DOTALL)
    section = block.sub(lambda _: f"```{example.kind}\n{found}```", section, count=1)
    path.write_text(head + name + section + mark + tail)


@pytest.mark.parametrize("example", [e for e in EXAMPLES if e.stage], ids=lambda e: e.name)
def test_stage_gives_the_same_ir(example: Example, tmp_path: Path) -> None:
    stage = pytest.importorskip("compiler.usd")
    (tmp_path / "stage.usda").write_text(example.stage or "")
    graph, found = stage.import_stage(tmp_path / "stage.usda")
    assert outcome(graph, found, Files(tmp_path), "ir") == example.outcome


def test_names_are_unique() -> None:
    names = [example.name for example in EXAMPLES]
    assert sorted(set(names)) == sorted(names)


def test_every_code_of_the_language_has_an_example() -> None:
    shown = set(
        re.findall(r"^(?:error|warning)\[(.*?)\]", "\n".join(e.outcome for e in EXAMPLES), re.M)
    )
    phases = ("syntax-", "name-", "type-", "value-", "file-", "limit-")
    assert {code for code in CODES if code.startswith(phases)} - shown == set()


def test_dump(request: pytest.FixtureRequest) -> None:
    target = request.config.getoption("--dump")
    if target is None:
        pytest.skip("asked for by --dump FILE")
    Path(target).write_text(json.dumps([asdict(example) for example in EXAMPLES], indent=1))
