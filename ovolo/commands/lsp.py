"""`ovolo lsp`."""

from __future__ import annotations

import argparse
import os
import sys
from contextlib import redirect_stdout

import ovolo
from ovolo.exits import Exit


def configure(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument("--stdio", action="store_true", help="what it does anyway; editors say so")


def run(arguments: argparse.Namespace) -> Exit:
    """Answer an editor on standard input and output until it says that it ends."""
    from server.language.server import make_server

    # The server closes what it speaks on; and nothing else may be written there.
    with os.fdopen(os.dup(sys.stdout.fileno()), "wb") as channel, redirect_stdout(sys.stderr):
        make_server(ovolo.__version__).start_io(stdout=channel)
    return Exit.OK
