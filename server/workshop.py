"""Where scenes are worked on: threads beside the event loop, few at a time, none for too long."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from threading import Event
from time import monotonic
from typing import Any, TypeVar

from fastapi import Request
from starlette.requests import ClientDisconnect

from server.bodies import Body, read_body
from server.problems import Problem
from server.settings import Settings

Result = TypeVar("Result")


class AbandonedError(Exception):
    """Raised inside the work when nobody wants it any more."""


class Ticket:
    """What a piece of work has to go by: call it now and then, it raises once work must end."""

    def __init__(self, seconds: float) -> None:
        self.seconds = seconds
        self._deadline = monotonic() + seconds
        self._cancelled = Event()

    def shorten(self, seconds: float | None) -> None:
        """Allow no more than `seconds` from now on, if that is said and less."""
        if seconds is not None and seconds < self.seconds:
            self.seconds = seconds
            self._deadline = min(self._deadline, monotonic() + seconds)

    @property
    def left(self) -> float:
        """Seconds until the deadline."""
        return max(0.0, self._deadline - monotonic())

    def cancel(self) -> None:
        """End the work at its next call."""
        self._cancelled.set()

    def __call__(self, *_: object) -> None:
        """Raise if the work must end; the arguments of a progress callback are welcome."""
        if self._cancelled.is_set():
            raise AbandonedError
        if monotonic() > self._deadline:
            raise self.too_slow()

    def too_slow(self) -> Problem:
        """What to answer when the time is over."""
        return Problem(
            503,
            "too-slow",
            f"the answer is not ready after {self.seconds:g} s: ask for fewer pixels or samples, "
            "or for more time (max_seconds)",
        )


class Workshop:
    """Runs work in threads: at most `settings.running` at once and `settings.waiting` queued.

    What is still being read waits too, so that bodies cannot fill the memory.
    """

    def __init__(self, settings: Settings) -> None:
        self._settings = settings
        self._pool = ThreadPoolExecutor(settings.running, thread_name_prefix="ovolo")
        self._inside = 0

    async def run(self, request: Request, work: Callable[[Body, Ticket], Result]) -> Result:
        """Read the request, run `work(body, ticket)`, and give its result.

        Raises the problems of `read_body`, 408 for a body that does not come, 503 for want of room
        or of time. The work is abandoned when the client goes away.
        """
        settings = self._settings
        if self._inside >= settings.running + settings.waiting:
            raise Problem(
                503, "busy", "too many requests are waiting", headers={"Retry-After": "1"}
            )
        ticket = Ticket(settings.max_seconds)
        self._inside += 1
        try:
            body = await _read(request, settings)
        except BaseException:
            self._inside -= 1
            raise
        loop = asyncio.get_running_loop()
        task: asyncio.Future[Result] = loop.run_in_executor(self._pool, _begin, work, body, ticket)
        task.add_done_callback(self._leave)
        gone: asyncio.Future[None] = asyncio.ensure_future(_disconnected(request))
        both: set[asyncio.Future[Any]] = {task, gone}
        try:
            done, _ = await asyncio.wait(
                both, timeout=ticket.left, return_when=asyncio.FIRST_COMPLETED
            )
            if task in done:
                return task.result()
            if gone in done:
                raise _gone()
            raise ticket.too_slow()
        finally:
            # What waits is dropped; what runs ends at its next look at the ticket.
            task.cancel()
            ticket.cancel()
            gone.cancel()

    def _leave(self, task: asyncio.Future[Any]) -> None:
        self._inside -= 1
        if not task.cancelled():
            task.exception()  # nobody else asks for that of work which is abandoned

    def close(self) -> None:
        """Refuse further work and drop what waits."""
        self._pool.shutdown(wait=False, cancel_futures=True)


async def _read(request: Request, settings: Settings) -> Body:
    try:
        async with asyncio.timeout(settings.max_seconds):
            return await read_body(request, settings)
    except TimeoutError:
        seconds = settings.max_seconds
        message = f"the body has not come within {seconds:g} s"
        raise Problem(408, "too-slow", message) from None
    except ClientDisconnect:
        raise _gone() from None


def _gone() -> Problem:
    return Problem(503, "gone", "the client went away")


def _begin(work: Callable[[Body, Ticket], Result], body: Body, ticket: Ticket) -> Result:
    ticket()
    return work(body, ticket)


async def _disconnected(request: Request) -> None:
    """Return once the client has gone; its body has been read."""
    while (await request.receive())["type"] != "http.disconnect":
        pass
