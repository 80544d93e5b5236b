"""The examples of the language reference: what conforms to the language passes them.

An example is a `##` section of `dsl/reference/*.md` with one source block and one outcome block.
The source is ```` ```ovolo ````, followed by words `name=value` for its `time` and the limits it
is run under; further blocks with a file's name, ```` ```ovolo bricks.ovo ````, are files beside
it; a ```` ```usda ```` block is a stage that must give the same IR. The outcome is `ir`, the
canonical text; `diagnostics`, their exact rendering; `formatted`, the canonical form; or
`picture`, what the first camera sees as characters.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

REFERENCE = Path(__file__).parent / "reference"
KINDS = ("ir", "diagnostics", "formatted", "picture")

_BLOCK = re.compile(r"^```(\w+)([^\n]*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)


@dataclass(frozen=True, slots=True)
class Example:
    """One program of the reference and its outcome.

    `text` is its whole section; `words` are the time and limits, `files` the contents of files by
    name, `stage` a USD stage of the same scene; `kind` is one of `KINDS`.
    """

    chapter: str
    name: str
    text: str
    source: str
    words: dict[str, str]
    files: dict[str, str]
    stage: str | None
    kind: str
    outcome: str

    def write_files(self, folder: Path) -> None:
        """Write the files beside the program; one named `latin…` is not UTF-8."""
        for name, text in self.files.items():
            encoding = "latin-1" if name.startswith("latin") else "utf-8"
            (folder / name).write_text(text, encoding=encoding)


def read_examples() -> Iterator[Example]:
    """All examples of the reference, chapter by chapter."""
    for chapter in sorted(REFERENCE.glob("*.md")):
        yield from read_chapter(chapter)


def read_chapter(path: Path) -> Iterator[Example]:
    """The examples of one file."""
    for section in re.split(r"^## ", path.read_text(encoding="utf-8"), flags=re.MULTILINE)[1:]:
        matches = list(_BLOCK.finditer(section))
        if matches:
            end = matches[-1].end()
            end += len(section[end:].partition("\n# ")[0])  # another part of the chapter
            blocks = [(match[1], match[2].split(), match[3]) for match in matches]
            yield _read_example(path.name, section[:end], blocks)


def _read_example(chapter: str, section: str, blocks: list[tuple[str, list[str], str]]) -> Example:
    name = section.partition("\n")[0].strip()
    files = {words[0]: text for _, words, text in blocks if words and "=" not in words[0]}
    rest = [block for block in blocks if not block[1] or "=" in block[1][0]]
    sources = [(words, text) for kind, words, text in rest if kind == "ovolo"]
    stage = next((text for kind, _, text in rest if kind == "usda"), None)
    outcomes = [(kind, text) for kind, _, text in rest if kind in KINDS]
    assert len(sources) == 1, f"{chapter}: `{name}` needs exactly one source"
    assert len(outcomes) == 1, f"{chapter}: `{name}` needs exactly one outcome"
    words = dict(word.split("=", 1) for word in sources[0][0])
    source = sources[0][1].removesuffix("\n")
    return Example(chapter, name, section.strip(), source, words, files, stage, *outcomes[0])
