"""`ovolo fmt`."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from dsl.diagnostics import Diagnostic
from dsl.whole_files import replacing
from ovolo.exits import Exit, StopError
from ovolo.terminal import report


def configure(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument(
        "scenes",
        nargs="+",
        metavar="SCENE",
        help=".ovo file, rewritten in place; - reads standard input and prints",
    )
    parser.add_argument("--check", action="store_true", help="write nothing; 1 if anything would")
    parser.add_argument("--diff", action="store_true", help="print what would change instead")


def run(arguments: argparse.Namespace) -> Exit:
    """Format every scene; those with faults of syntax stay as they are."""
    from dsl.budget import DEFAULT_LIMITS
    from dsl.files import FileFault, Files
    from dsl.format import format_source
    from dsl.spans import Source

    limit = DEFAULT_LIMITS.source_bytes

    faults: list[Diagnostic] = []
    changed = []
    for name in arguments.scenes:
        try:
            if name == "-":
                text = _standard_input(limit)
            else:
                text = Files().read_text(name, source_bytes=limit)
        except FileFault as fault:
            faults.append(fault.diagnostic(None))
            continue
        formatted, found = format_source(Source(name, text))
        faults += found
        if formatted is None:
            continue
        if formatted != text:
            changed.append(name)
        if arguments.diff:
            sys.stdout.write(_diff(name, text, formatted))
        elif not arguments.check:
            _write(name, text, formatted)
    code = report(faults)
    if arguments.check:
        for name in changed:
            print(f"{name} is not in its canonical form", file=sys.stderr)
        return code if faults or not changed else Exit.FAULTS
    return code


def _standard_input(limit: int) -> str:
    from dsl.files import SourceTooLarge, decode

    content = sys.stdin.buffer.read(limit + 1)
    if len(content) > limit:
        raise SourceTooLarge("standard input", f"at least {len(content)} bytes", limit)
    return decode(content, "standard input")


def _write(name: str, text: str, formatted: str) -> None:
    if name == "-":
        sys.stdout.write(formatted)
    elif formatted != text:
        try:
            with replacing(Path(name)) as unfinished:
                unfinished.write_text(formatted, encoding="utf-8", newline="\n")
        except OSError as error:
            message = f"`{name}` cannot be written: {error.strerror}"
            raise StopError(Exit.FILES, message) from None


def _diff(name: str, text: str, formatted: str) -> str:
    import difflib

    before, after = text.splitlines(keepends=True), formatted.splitlines(keepends=True)
    lines = difflib.unified_diff(before, after, name, f"{name} (formatted)")
    return "".join(line if line.endswith("\n") else f"{line}\n" for line in lines)
