"""The examples of the language reference: what conforms to the language passes them.

`dsl/reference/README.md` says what an example is and how an implementation is judged by it.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

REFERENCE = Path(__file__).parent / "reference"
KINDS = ("ir", "diagnostics", "formatted", "picture")
LANGUAGES = {"ovolo": ".ovo", "usda": ".usda", "ir": ".ir"}
"""What a source may be written in, and how its file's name ends."""

_BLOCK = re.compile(r"^```(\w+)([^\n]*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)


@dataclass(frozen=True, slots=True)
class Example:
    """One source of the reference and its outcome.

    `text` is its whole section; `words` are the time, parameters and limits that it is run with,
    `files` the contents of files by name, `stage` a USD stage of the same scene; `language` is
    one of `LANGUAGES`, `kind` one of `KINDS`; `chapter` is the name of the file without `.md`.
    """

    chapter: str
    name: str
    text: str
    language: str
    source: str
    words: dict[str, str]
    files: dict[str, str]
    stage: str | None
    kind: str
    outcome: str

    @property
    def file(self) -> str:
        """The name of the file that the source stands in."""
        return f"scene{LANGUAGES[self.language]}"

    @property
    def shows_advice(self) -> bool:
        """Whether the outcome has advice too; elsewhere it is left out."""
        return self.chapter == "advice"

    def write_files(self, folder: Path) -> None:
        """Write the source and the files beside it; some names say how, see the README."""
        for name, text in {self.file: self.source, **self.files}.items():
            stem = name.partition(".")[0]
            encoding = {"latin": "latin-1", "bom": "utf-8-sig"}.get(stem, "utf-8")
            newline = {"cr": "\r", "crlf": "\r\n"}.get(stem, "")
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            (folder / name).write_text(text, encoding=encoding, newline=newline)


def read_examples() -> Iterator[Example]:
    """All examples of the reference, chapter by chapter."""
    for chapter in sorted(REFERENCE.glob("*.md")):
        yield from read_chapter(chapter)


def read_chapter(path: Path) -> Iterator[Example]:
    """The examples of one file."""
    for section in re.split(r"^## ", path.read_text(encoding="utf-8"), flags=re.MULTILINE)[1:]:
        matches = [match for match in _BLOCK.finditer(section) if match[1] in _READ]
        if matches:
            end = matches[-1].end()
            end += len(section[end:].partition("\n# ")[0])  # another part of the chapter
            blocks = [(match[1], match[2].split(), match[3]) for match in matches]
            yield _read_example(path.stem, section[:end], blocks)


_READ = {*LANGUAGES, *KINDS, "obj", "stl", "off", "ppm"}
"""The blocks that belong to examples; others, such as `ebnf`, are prose."""


def _read_example(chapter: str, section: str, blocks: list[tuple[str, list[str], str]]) -> Example:
    name = section.partition("\n")[0].strip()
    files = {words[0]: text for _, words, text in blocks if words and "=" not in words[0]}
    plain = [block for block in blocks if not block[1] or "=" in block[1][0]]
    assert len(plain) > 1, f"{chapter}: `{name}` needs a source and an outcome"
    *sources, (kind, _, outcome) = plain
    assert kind in KINDS, f"{chapter}: `{name}` ends with a source"
    language = min((source[0] for source in sources), key=list(LANGUAGES).index)
    chosen = [source for source in sources if source[0] == language]
    others = [source for source in sources if source[0] != language]
    assert len(chosen) == 1, f"{chapter}: `{name}` needs exactly one source"
    stages = [text for other, _, text in others if other == "usda"]
    assert len(stages) == len(others) < 2, f"{chapter}: `{name}` needs exactly one outcome"
    words = dict(word.split("=", 1) for word in chosen[0][1])
    source = chosen[0][2].removesuffix("\n") if language == "ovolo" else chosen[0][2]
    return Example(
        chapter, name, section.strip(), language, source, words, files,
        stages[0] if stages else None, kind, outcome,
    )  # fmt: skip
