"""Judging an implementation of the language by the examples of its reference."""

from __future__ import annotations

import re
import shlex
import subprocess
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from dsl.examples import Example

_HEAD = re.compile(r"^(error|warning)\[([a-z-]+)\]", re.MULTILINE)
_PLACE = re.compile(r"^ *--> (.*)$", re.MULTILINE)
_SECONDS = 60.0


@dataclass(slots=True)
class Chapter:
    """How an implementation did: the names of the examples that it failed, and two counts."""

    passed: int = 0
    failed: list[str] = field(default_factory=list)
    skipped: int = 0

    def as_json(self) -> dict[str, Any]:
        """The same as JSON values."""
        return asdict(self)


def as_json(examples: Sequence[Example]) -> list[dict[str, Any]]:
    """The examples as JSON values: the fields of `Example`."""
    return [asdict(example) for example in examples]


def judge(examples: Sequence[Example], command: str) -> dict[str, Chapter]:
    """Run a command for every example that says `ir` or `diagnostics` under the usual limits.

    `{source}` in the command becomes `scene.ovo`, in a folder that has what belongs to it. The IR
    must be the same to the last character; diagnostics must have the same codes, severities and
    places in the same order. Raises OSError for a command that does not exist.
    """
    chapters: dict[str, Chapter] = {}
    for example in examples:
        chapter = chapters.setdefault(example.chapter.removesuffix(".md"), Chapter())
        if example.words or example.kind not in ("ir", "diagnostics"):
            chapter.skipped += 1
        elif _passes(example, command):
            chapter.passed += 1
        else:
            chapter.failed.append(example.name)
    return chapters


def _passes(example: Example, command: str) -> bool:
    with TemporaryDirectory() as folder:
        example.write_files(Path(folder))
        (Path(folder) / "scene.ovo").write_text(example.source, encoding="utf-8")
        words = [word.replace("{source}", "scene.ovo") for word in shlex.split(command)]
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
            return False
    if example.kind == "ir":
        return done.returncode == 0 and done.stdout == example.outcome
    return _outline(done.stderr) == _outline(example.outcome)


def _outline(text: str) -> tuple[list[tuple[str, ...]], list[str]]:
    """Severities with codes, and places, in order."""
    return [match.groups() for match in _HEAD.finditer(text)], _PLACE.findall(text)
