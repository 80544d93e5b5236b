"""`ovolo explain`."""

from __future__ import annotations

import argparse

from ovolo.exits import Exit, StopError


def configure(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument("code", metavar="CODE", help="what a diagnostic has in square brackets")


def run(arguments: argparse.Namespace) -> Exit:
    """Print what a code means, and the sections of the language reference that show it."""
    from dsl.codes import CODES
    from dsl.suggest import did_you_mean

    name = arguments.code.strip("[]")
    code = CODES.get(name)
    if code is None:
        help = did_you_mean(name, CODES) or "codes are listed in dsl/reference/codes.md"
        raise StopError(Exit.USAGE, f"no diagnostic has the code `{name}`", help)
    print(f"# {code.severity}[{name}]\n\n{code.summary[0].upper()}{code.summary[1:]}.")
    for section in _sections(f"{code.severity}[{name}]"):
        print(f"\n## {section}")
    return Exit.OK


def _sections(mark: str) -> list[str]:
    """The sections that show such a diagnostic: those that show it alone, if there are any."""
    from dsl.examples import read_examples

    shown = [e for e in read_examples() if e.kind == "diagnostics" and mark in e.outcome]
    alone = [e.text for e in shown if e.outcome.count(mark) == e.outcome.count("]: ")]
    return alone or [min((e.text for e in shown), key=len)] if shown else []
