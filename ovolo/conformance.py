"""Judging an implementation of the language by the examples of its reference.

`dsl/reference/README.md` says what a tool is given and what it must answer.
"""

from __future__ import annotations

import os
import re
import shlex
import signal
import subprocess
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass, field
from itertools import zip_longest
from pathlib import Path
from tempfile import TemporaryDirectory, TemporaryFile
from time import monotonic
from typing import IO, Any, NamedTuple

from dsl.examples import Example

_HEAD = re.compile(r"^(error|warning)\[([a-z-]+)\]", re.MULTILINE)
_PLACE = re.compile(r"^ *--> (.*)$", re.MULTILINE)
_SECONDS = 60.0
_MOST_BYTES = 10_000_000
"""What a tool may print; the longest outcome has a few thousand."""


class Answer(NamedTuple):
    """What a command has done; `stopped` says why it was ended, "" if it ended by itself."""

    code: int
    stdout: str
    stderr: str
    stopped: str = ""


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
    """How an implementation did: failed examples with the reasons, and two counts.

    `answers` are those of the tool to the failed examples.
    """

    passed: int = 0
    failed: dict[str, str] = field(default_factory=dict)
    skipped: int = 0
    answers: dict[str, Answer] = field(default_factory=dict)

    def as_json(self) -> dict[str, Any]:
        """The reasons and the counts as JSON values."""
        return {"passed": self.passed, "failed": self.failed, "skipped": self.skipped}


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


def execute(words: list[str], folder: Path, seconds: float = _SECONDS) -> Answer:
    """Run a command as a process; OSError for one that does not exist.

    It is ended, with all processes that it has started, if it takes more time than `seconds`
    or prints more than 10 MB.
    """
    with TemporaryFile() as out, TemporaryFile() as err:
        process = subprocess.Popen(
            words,
            cwd=folder,
            stdin=subprocess.DEVNULL,
            stdout=out,
            stderr=err,
            start_new_session=True,
        )
        try:
            stopped = _watch(process, (out, err), seconds)
        finally:
            _end(process)
        return Answer(process.wait(), _text(out), _text(err), stopped)


def _watch(process: subprocess.Popen[bytes], files: Sequence[IO[bytes]], seconds: float) -> str:
    """Wait for a process that writes to files; why it must be ended, "" if it has ended."""
    end = monotonic() + seconds
    while True:
        with suppress(subprocess.TimeoutExpired):
            process.wait(min(0.1, max(0.0, end - monotonic())))
            return ""
        if sum(os.fstat(file.fileno()).st_size for file in files) > _MOST_BYTES:
            return f"more than {_MOST_BYTES // 1_000_000} MB printed"
        if monotonic() >= end:
            return f"no answer after {seconds:g} seconds"


def _end(process: subprocess.Popen[bytes]) -> None:
    """End a process and those that it has started."""
    if os.name == "posix":
        with suppress(ProcessLookupError, PermissionError):
            os.killpg(process.pid, signal.SIGKILL)
    else:
        process.kill()


def _text(file: IO[bytes]) -> str:
    file.seek(0)
    return file.read(_MOST_BYTES).decode(errors="replace").replace("\r\n", "\n")


def judge(
    examples: Sequence[Example], tools: Tools, execute: Execute = execute
) -> Iterator[tuple[str, Chapter]]:
    """Run the tools for every example that they can run, each in a folder of its own.

    Yields the names of the chapters and how the implementation did, one after the other. Raises
    OSError for a command that does not exist.
    """
    chapters: dict[str, list[Example]] = {}
    for example in examples:
        chapters.setdefault(example.chapter, []).append(example)
    for name, members in chapters.items():
        chapter = Chapter()
        for example in members:
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
            if (reason := _mistake(example, answer)) is None:
                chapter.passed += 1
            else:
                chapter.failed[example.name] = reason
                chapter.answers[example.name] = answer
        yield name, chapter


def _mistake(example: Example, answer: Answer) -> str | None:
    """What is wrong with an answer, or None."""
    if answer.stopped:
        return answer.stopped
    if answer.code < 0:
        return f"the tool was ended by {signal.Signals(-answer.code).name}"
    if example.kind == "diagnostics":
        found, due = _outline(answer.stderr), _outline(example.outcome)
        if not example.shows_advice:
            found = [line for line in found if "[advice-" not in line]
    elif answer.code != 0:
        last = answer.stderr.strip().rpartition("\n")[2]
        told = next(iter(_outline(answer.stderr)), last and f"`{last[:100]}`")
        return f"exit code {answer.code}, where 0 is due" + (told and f": {told}")
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
