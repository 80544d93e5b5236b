"""Judging an implementation of the language by the examples of its reference.

`dsl/reference/README.md` says what a tool is given and what it must answer.
"""

from __future__ import annotations

import re
import shlex
import subprocess
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from itertools import zip_longest
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple

from dsl.examples import Example

_HEAD = re.compile(r"^(error|warning)\[([a-z-]+)\]", re.MULTILINE)
_PLACE = re.compile(r"^ *--> (.*)$", re.MULTILINE)
_SECONDS = 60.0


class Answer(NamedTuple):
    """What a command has done; `code` is None if it did not end in time."""

    code: int | None
    stdout: str
    stderr: str


Execute = Callable[[list[str], Path], Answer]
"""Runs the words of a command in a folder."""


@dataclass(frozen=True, slots=True)
class Tools:
    """The commands of an implementation, None for what it does not have.

    `command` prints IR or diagnostics, `formatter` rewrites the file, `picture` prints a text
    picture. `{source}` and `{options}` in them are replaced.
    """

    command: str | None
    formatter: str | None = None
    picture: str | None = None

    def words(self, example: Example) -> list[str] | None:
        """The words that run an example; None where no tool can."""
        command = {"formatted": self.formatter, "picture": self.picture}.get(
            example.kind, self.command
        )
        if command is None or (example.words and "{options}" not in command):
            return None
        words: list[str] = []
        for word in shlex.split(command):
            if word == "{options}":
                words += options(example.words)
            else:
                words.append(word.replace("{source}", example.file))
        return words


@dataclass(slots=True)
class Chapter:
    """How an implementation did: failed examples with the reasons, and two counts."""

    passed: int = 0
    failed: dict[str, str] = field(default_factory=dict)
    skipped: int = 0

    def as_json(self) -> dict[str, Any]:
        """The same as JSON values."""
        return asdict(self)


def as_json(examples: Sequence[Example]) -> list[dict[str, Any]]:
    """The examples as JSON values: the fields of `Example`."""
    return [asdict(example) for example in examples]


def options(words: Mapping[str, str]) -> list[str]:
    """The words of an example as arguments of a command."""
    arguments = []
    for name, value in words.items():
        if name == "time":
            arguments += ["--time", value]
        elif name == "variant":
            arguments += ["--variant", value]
        elif name.startswith("set:"):
            arguments += ["--set", f"{name.removeprefix('set:')}={value}"]
        else:
            arguments += ["--limit", f"{name}={value}"]
    return arguments


def execute(words: list[str], folder: Path) -> Answer:
    """Run a command as a process; OSError for one that does not exist."""
    try:
        done = subprocess.run(
            words,
            cwd=folder,
            stdin=subprocess.DEVNULL,
            capture_output=True,
            encoding="utf-8",
            errors="replace",
            timeout=_SECONDS,
            check=False,
        )
    except subprocess.TimeoutExpired:
        return Answer(None, "", "")
    return Answer(done.returncode, done.stdout, done.stderr)


def judge(
    examples: Sequence[Example], tools: Tools, execute: Execute = execute
) -> dict[str, Chapter]:
    """Run the tools for every example that they can run, each in a folder of its own.

    Raises OSError for a command that does not exist.
    """
    chapters: dict[str, Chapter] = {}
    for example in examples:
        chapter = chapters.setdefault(example.chapter.removesuffix(".md"), Chapter())
        words = tools.words(example)
        if words is None:
            chapter.skipped += 1
            continue
        with TemporaryDirectory() as folder:
            example.write_files(Path(folder))
            answer = execute(words, Path(folder))
            if example.kind == "formatted":
                text = (Path(folder) / example.file).read_bytes().decode(errors="replace")
                answer = answer._replace(stdout=text)
            reason = _mistake(example, answer)
        if reason is None:
            chapter.passed += 1
        else:
            chapter.failed[example.name] = reason
    return chapters


def _mistake(example: Example, answer: Answer) -> str | None:
    """What is wrong with an answer, or None."""
    if answer.code is None:
        return f"no answer after {_SECONDS:g} seconds"
    if example.kind == "diagnostics":
        found, due = _outline(answer.stderr), _outline(example.outcome)
        if not example.shows_advice:
            found = [line for line in found if "[advice-" not in line]
    elif answer.code != 0:
        return f"exit code {answer.code}, where 0 is due"
    else:
        found, due = answer.stdout.split("\n"), example.outcome.split("\n")
    for number, (a, b) in enumerate(zip_longest(found, due), start=1):
        if a != b:
            what = "diagnostic" if example.kind == "diagnostics" else "line"
            return f"{what} {number} is {_shown(a)}, where {_shown(b)} is due"
    errors = re.search(r"^error\[", example.outcome, re.MULTILINE)
    if example.kind == "diagnostics" and bool(errors) is not bool(answer.code):
        return f"exit code {answer.code} with {'errors' if errors else 'warnings alone'}"
    return None


def _shown(line: str | None) -> str:
    return "missing" if line is None else f"`{line if len(line) <= 60 else line[:60] + '…'}`"


def _outline(text: str) -> list[str]:
    """Severity, code and place of each diagnostic."""
    heads = list(_HEAD.finditer(text))
    ends = [*(head.start() for head in heads[1:]), len(text)][: len(heads)]
    outline = []
    for head, end in zip(heads, ends, strict=True):
        place = _PLACE.search(text, head.end(), end)
        outline.append(f"{head[0]} at {place[1] if place else 'no place'}")
    return outline
