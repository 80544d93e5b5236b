"""Web pages of strangers: a browser on this machine reaches the service, and must not for them.

A page may send what it likes to 127.0.0.1, though it cannot read the answer; and one whose own
name leads to 127.0.0.1 all of a sudden (DNS rebinding) can. The first says in `Origin` where it
is from, the second in `Host` by which name it calls.
"""

from __future__ import annotations

from collections.abc import Collection
from ipaddress import ip_address
from urllib.parse import urlsplit

from starlette.datastructures import Headers
from starlette.types import ASGIApp, Receive, Scope, Send

from server.problems import Problem


class NoStrangers:
    """Refuses requests that pages of other services send, and those for another host.

    `hosts` are names of the service beside `localhost` and all loopback addresses.
    """

    def __init__(self, app: ASGIApp, hosts: Collection[str] = ()) -> None:
        self._app = app
        self._hosts = {name.lower() for name in hosts}

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Hand a request on, or answer it with the problem 403."""
        answer = self._app
        if scope["type"] == "http" and (refused := self._refusal(Headers(scope=scope))):
            answer = Problem(403, "stranger", refused).response()
        await answer(scope, receive, send)

    def _refusal(self, headers: Headers) -> str | None:
        host = headers.get("host", "localhost").lower()
        if not self._is_ours(host):
            return f"`{host}` is not a name of this service: start it with `--allow-host`"
        origin = headers.get("origin")
        if origin is not None and _authority(origin) != host:
            return f"a page from `{origin}` may not use this service"
        return None

    def _is_ours(self, host: str) -> bool:
        name = _name(host)
        return name in self._hosts or is_loopback(name)


def is_loopback(host: str) -> bool:
    """Whether a name or an address, without a port, is of this machine alone."""
    if host == "localhost":
        return True
    try:
        return ip_address(host).is_loopback
    except ValueError:
        return False


def _name(host: str) -> str:
    try:
        return urlsplit(f"//{host}").hostname or ""
    except ValueError:
        return ""


def _authority(origin: str) -> str:
    try:
        return urlsplit(origin).netloc.lower()
    except ValueError:
        return ""
