"""`ovolo serve`."""

from __future__ import annotations

import argparse
from pathlib import Path

from ovolo.commands.numbers import number
from ovolo.exits import Exit, StopError


def configure(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument("--host", default="127.0.0.1", help="loopback address; default 127.0.0.1")
    parser.add_argument("--port", type=_port, default=8000, help="default 8000; 0 takes a free one")
    parser.add_argument(
        "--assets", type=Path, metavar="FOLDER", help="where scenes may read files; default: none"
    )
    parser.add_argument(
        "--allow-host",
        action="append",
        default=[],
        metavar="NAME",
        help="a name by which a proxy calls the service; may be given several times",
    )


def run(arguments: argparse.Namespace) -> Exit:
    """Serve until interrupted."""
    from server.serve import serve
    from server.settings import Settings

    if arguments.assets is not None and not arguments.assets.is_dir():
        raise StopError(Exit.FILES, f"`{arguments.assets}` is not a folder")
    try:
        settings = Settings(asset_root=arguments.assets, hosts=tuple(arguments.allow_host))
        serve(settings, arguments.host, arguments.port, _ready)
    except ValueError as error:
        raise StopError(Exit.USAGE, str(error)) from None
    except OSError as error:
        place = f"{arguments.host}:{arguments.port}"
        raise StopError(Exit.USAGE, f"cannot listen on {place}: {error.strerror}") from None
    return Exit.OK


def _port(text: str) -> int:
    return int(number(text, range(65536).__contains__, "a port, 0 … 65535"))


def _ready(address: str) -> None:
    print(f"serving on {address} (Ctrl-C ends it)", flush=True)
