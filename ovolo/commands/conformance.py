"""`ovolo conformance`."""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Iterable
from contextlib import chdir, redirect_stderr, redirect_stdout
from functools import partial
from io import StringIO
from pathlib import Path
from typing import TYPE_CHECKING

from ovolo.exits import Exit, StopError
from ovolo.terminal import print_json, wants_color

if TYPE_CHECKING:
    from dsl.examples import Example
    from ovolo.conformance import Answer, Chapter, Tools

_GREEN, _RED, _DIM, _RESET = "\x1b[32m", "\x1b[1;31m", "\x1b[2m", "\x1b[0m"

OURS = {
    "command": "ovolo compile --root . {options} {source}",
    "formatter": "ovolo fmt {source}",
    "picture": "ovolo inspect --picture --root . {options} {source}",
}


def configure(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument(
        "--command",
        metavar="COMMAND",
        help="an implementation that prints the IR of the scene {source} on standard output, or "
        "its diagnostics on standard error; {options} is where --time, --set and --limit go; "
        "default: this one",
    )
    parser.add_argument(
        "--formatter", metavar="COMMAND", help="rewrites {source} in canonical form"
    )
    parser.add_argument(
        "--picture", metavar="COMMAND", help="prints {source} as the first camera sees it"
    )
    parser.add_argument(
        "--seconds",
        type=float,
        default=60.0,
        metavar="S",
        help="end a tool that takes longer for an example; default: 60",
    )
    parser.add_argument("--chapter", metavar="NAME", help="run only that chapter, such as shapes")
    parser.add_argument(
        "--example",
        metavar="NAME",
        help="run only the example under that title, and show what the tool printed if it fails",
    )
    parser.add_argument("--dump", type=Path, metavar="FILE", help="write the examples as JSON only")
    parser.add_argument("--json", action="store_true", help="answer as JSON on standard output")


def run(arguments: argparse.Namespace) -> Exit:
    """Run the reference's examples through an implementation, and report chapter by chapter."""
    from dsl.examples import read_examples
    from dsl.suggest import did_you_mean
    from ovolo.conformance import Tools, execute, judge

    examples = list(read_examples())
    if arguments.chapter:
        examples = [e for e in examples if e.chapter == arguments.chapter]
        if not examples:
            raise StopError(Exit.USAGE, f"no chapter `{arguments.chapter}` has examples")
    if arguments.example:
        names = [example.name for example in examples]
        examples = [e for e in examples if e.name == arguments.example]
        if not examples:
            message = f"there is no example `{arguments.example}`"
            raise StopError(Exit.USAGE, message, did_you_mean(arguments.example, names))
    if arguments.dump is not None:
        _dump(examples, arguments.dump)
        return Exit.OK
    try:
        tools = _tools(arguments)
        process = partial(execute, seconds=arguments.seconds)
        judged = judge(examples, tools, ourselves if tools == Tools(**OURS) else process)
        if arguments.json:
            chapters = dict(judged)
            print_json({name: chapter.as_json() for name, chapter in chapters.items()})
        else:
            width = max((len(e.chapter) for e in examples), default=0)
            chapters = _printed(judged, width, wants_color(sys.stdout))
            if arguments.example:
                _print_answers(chapters.values())
    except OSError as error:
        raise StopError(Exit.USAGE, f"the command cannot be run: {error.strerror}") from None
    return Exit.FAULTS if any(chapter.failed for chapter in chapters.values()) else Exit.OK


def _dump(examples: list[Example], path: Path) -> None:
    from ovolo.conformance import as_json

    try:
        text = json.dumps(as_json(examples), indent=1, ensure_ascii=False) + "\n"
        path.write_text(text, encoding="utf-8")
    except OSError as error:
        message = f"`{path}` cannot be written: {error.strerror}"
        raise StopError(Exit.FILES, message) from None


def _tools(arguments: argparse.Namespace) -> Tools:
    """The commands that are given; none: our own."""
    from ovolo.conformance import Tools

    given = {name: getattr(arguments, name) for name in OURS}
    for command in filter(None, given.values()):
        if "{source}" not in command:
            message = f"`{command}` does not say where the scene's name goes"
            raise StopError(Exit.USAGE, message, 'write `--command "tool {source}"`')
    return Tools(**given if any(given.values()) else OURS)


def ourselves(words: list[str], folder: Path) -> Answer:
    """What `ovolo …` answers, without the time that a new process takes."""
    from ovolo.__main__ import main
    from ovolo.conformance import Answer

    with chdir(folder), redirect_stdout(StringIO()) as out, redirect_stderr(StringIO()) as err:
        code = main(words[1:])
    return Answer(code, out.getvalue(), err.getvalue())


def _printed(judged: Iterable[tuple[str, Chapter]], width: int, color: bool) -> dict[str, Chapter]:
    """The chapters, each printed as soon as it is judged; `width` is for their names."""

    def paint(text: str, hue: str) -> str:
        return f"{hue}{text}{_RESET}" if color else text

    chapters: dict[str, Chapter] = {}
    for name, chapter in judged:
        chapters[name] = chapter
        run = chapter.passed + len(chapter.failed)
        count = f"{chapter.passed:>4} of {run:>3}"
        skipped = f"  {chapter.skipped} not run" if chapter.skipped else ""
        hue = _RED if chapter.failed else _GREEN
        print(f"{name:<{width}}{paint(count, hue)}{paint(skipped, _DIM)}")
        for example, reason in chapter.failed.items():
            print(f"  {paint('fails', _RED)}: {example}: {reason}")
        sys.stdout.flush()
    passed = sum(chapter.passed for chapter in chapters.values())
    failed = sum(len(chapter.failed) for chapter in chapters.values())
    not_run = sum(chapter.skipped for chapter in chapters.values())
    print(f"{passed} passed, {failed} failed, {not_run} not run")
    return chapters


def _print_answers(chapters: Iterable[Chapter]) -> None:
    """What the tool printed for the examples that failed."""
    for chapter in chapters:
        for answer in chapter.answers.values():
            for title, text in (
                ("standard output", answer.stdout),
                ("standard error", answer.stderr),
            ):
                print(f"{title}:" if text else f"{title}: nothing")
                print(text, end="" if not text or text.endswith("\n") else "\n")
