"""`ovolo version`."""

from __future__ import annotations

import argparse
import platform

import ovolo
from ovolo.exits import Exit
from ovolo.terminal import print_json


def configure(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument("--json", action="store_true", help="answer as JSON")


def run(arguments: argparse.Namespace) -> Exit:
    """Print the versions, and the instruction sets that the kernel can use here."""
    from runtime._kernel import instruction_sets

    facts = {
        "ovolo": ovolo.__version__,
        "python": platform.python_version(),
        "machine": platform.machine(),
        "instruction_sets": instruction_sets(),
    }
    if arguments.json:
        print_json(facts)
    else:
        print(f"ovolo {facts['ovolo']}")
        print(f"Python {facts['python']} on {facts['machine']}")
        print(f"instruction sets, best first: {', '.join(instruction_sets())}")
    return Exit.OK
