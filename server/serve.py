"""The service on a port of this machine."""

from __future__ import annotations

import socket
from collections.abc import Callable

from server.settings import Settings
from server.strangers import is_loopback


def serve(
    settings: Settings,
    host: str = "127.0.0.1",
    port: int = 8000,
    ready: Callable[[str], object] = print,
) -> None:
    """Serve until interrupted; `ready` is told the address once connections are taken.

    `port` 0 takes a free one. Raises ValueError for a host that is not a loopback address
    (nobody is asked for a token yet), OSError where the port cannot be had.
    """
    if not is_loopback(host):
        raise ValueError(
            f"`{host}` is not a loopback address, and there are no tokens yet that would keep "
            "strangers out: listen on 127.0.0.1, behind a proxy that asks who is there"
        )
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    with socket.create_server((host, port), family=family) as listener:
        import uvicorn

        from server.app import create_app

        config = uvicorn.Config(create_app(settings), timeout_graceful_shutdown=5)
        server = uvicorn.Server(config)
        name = f"[{host}]" if ":" in host else host
        ready(f"http://{name}:{listener.getsockname()[1]}")
        server.run(sockets=[listener])
