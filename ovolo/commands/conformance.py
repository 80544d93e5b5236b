"""`ovolo conformance`."""

from __future__ import annotations

import argparse
import json
from pathlib import Path

from ovolo.exits import Exit, StopError
from ovolo.terminal import print_json


def configure(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument(
        "--command",
        metavar="COMMAND",
        default="ovolo compile {source}",
        help="an implementation that prints the IR of the scene {source} on standard output, or "
        "its diagnostics on standard error; default: `%(default)s`",
    )
    parser.add_argument("--chapter", metavar="NAME", help="run only that chapter, such as shapes")
    parser.add_argument("--dump", type=Path, metavar="FILE", help="write the examples as JSON only")
    parser.add_argument("--json", action="store_true", help="answer as JSON on standard output")


def run(arguments: argparse.Namespace) -> Exit:
    """Run the reference's examples through an implementation, and report chapter by chapter."""
    from dsl.examples import read_examples
    from ovolo.conformance import as_json, judge

    examples = list(read_examples())
    if arguments.chapter:
        examples = [e for e in examples if e.chapter == f"{arguments.chapter}.md"]
        if not examples:
            raise StopError(Exit.USAGE, f"no chapter `{arguments.chapter}` has examples")
    if arguments.dump is not None:
        try:
            text = json.dumps(as_json(examples), indent=1, ensure_ascii=False) + "\n"
            arguments.dump.write_text(text, encoding="utf-8")
        except OSError as error:
            message = f"`{arguments.dump}` cannot be written: {error.strerror}"
            raise StopError(Exit.FILES, message) from None
        return Exit.OK
    if "{source}" not in arguments.command:
        raise StopError(Exit.USAGE, "the command does not say where the scene's name goes",
                        'write `--command "tool {source}"`')  # fmt: skip
    try:
        chapters = judge(examples, arguments.command)
    except OSError as error:
        raise StopError(Exit.USAGE, f"the command cannot be run: {error.strerror}") from None
    if arguments.json:
        print_json({name: chapter.as_json() for name, chapter in chapters.items()})
    else:
        for name, chapter in chapters.items():
            print(f"{name:<14}{chapter.passed:>4} of {chapter.passed + len(chapter.failed)}")
            for example in chapter.failed:
                print(f"  fails: {example}")
        skipped = sum(chapter.skipped for chapter in chapters.values())
        print(f"{skipped} examples of limits, pictures and layout were not run")
    return Exit.FAULTS if any(chapter.failed for chapter in chapters.values()) else Exit.OK
