"""Work beside the event loop: bounded in number and in time."""

from __future__ import annotations

import asyncio
import threading
from collections.abc import Awaitable, Callable
from time import monotonic, sleep

import pytest
from fastapi import Request

from server.bodies import Body
from server.problems import Problem
from server.settings import Settings
from server.workshop import Ticket, Workshop


def client(leaves: asyncio.Event | None = None) -> Request:
    """A request whose client stays, or leaves with an event."""
    messages: list[dict[str, object]] = [{"type": "http.request", "body": b"sphere()"}]

    async def receive() -> dict[str, object]:
        if messages:
            return messages.pop()
        await (leaves or asyncio.Event()).wait()
        return {"type": "http.disconnect"}

    return Request({"type": "http", "headers": [], "query_string": b""}, receive)


def silent() -> Request:
    """A request whose body never comes."""

    async def receive() -> dict[str, object]:
        await asyncio.Event().wait()
        return {}

    return Request({"type": "http", "headers": [], "query_string": b""}, receive)


def run(workshop: Workshop, main: Callable[[], Awaitable[None]]) -> None:
    async def with_limit() -> None:
        await asyncio.wait_for(main(), 20)

    try:
        asyncio.run(with_limit())
    finally:
        workshop.close()


def until_ended(body: Body, ticket: Ticket) -> None:
    while True:
        ticket()
        sleep(0.001)


def test_the_result_comes_back_and_the_loop_stays_free() -> None:
    workshop = Workshop(Settings())
    turn = threading.Event()

    async def main() -> None:
        task = asyncio.ensure_future(workshop.run(client(), lambda body, ticket: turn.wait(10)))
        await asyncio.sleep(0)
        turn.set()
        assert await task

    run(workshop, main)


@pytest.mark.parametrize("asked", [None, 0.02])
def test_work_ends_at_its_deadline(asked: float | None) -> None:
    workshop = Workshop(Settings(max_seconds=0.05 if asked is None else 1000.0))

    def work(body: Body, ticket: Ticket) -> None:
        ticket.shorten(asked)
        until_ended(body, ticket)

    async def main() -> None:
        with pytest.raises(Problem, match="max_seconds") as caught:
            await workshop.run(client(), work)
        assert caught.value.status == 503

    run(workshop, main)


def test_a_request_cannot_ask_for_more_time_than_there_is() -> None:
    ticket = Ticket(1e-9)
    ticket.shorten(1e9)
    sleep(0.001)
    with pytest.raises(Problem, match="1e-09 s"):
        ticket()


def test_too_many_requests_are_refused_and_room_comes_back() -> None:
    workshop = Workshop(Settings(running=1, waiting=1))
    turn = threading.Event()

    async def main() -> None:
        inside = [
            asyncio.ensure_future(workshop.run(client(), lambda body, ticket: turn.wait(10)))
            for _ in range(2)
        ]
        await asyncio.sleep(0)
        with pytest.raises(Problem) as caught:
            await workshop.run(client(), lambda body, ticket: None)
        assert caught.value.status == 503
        assert caught.value.headers == {"Retry-After": "1"}
        turn.set()
        assert await asyncio.gather(*inside) == [True, True]
        assert await workshop.run(client(), lambda body, ticket: "free again") == "free again"

    run(workshop, main)


def test_a_body_that_does_not_come_keeps_its_place_for_no_longer_than_work() -> None:
    workshop = Workshop(Settings(running=1, waiting=0, max_seconds=0.05))

    async def main() -> None:
        reading = asyncio.ensure_future(workshop.run(silent(), until_ended))
        await asyncio.sleep(0)
        with pytest.raises(Problem) as refused:
            await workshop.run(client(), until_ended)
        assert refused.value.kind == "busy"
        with pytest.raises(Problem) as caught:
            await reading
        assert caught.value.status == 408
        assert await workshop.run(client(), lambda body, ticket: body.content) == b"sphere()"

    run(workshop, main)


def test_work_ends_when_the_client_leaves() -> None:
    workshop = Workshop(Settings())

    async def main() -> None:
        leaves = asyncio.Event()
        task = asyncio.ensure_future(workshop.run(client(leaves), until_ended))
        await asyncio.sleep(0.01)
        leaves.set()
        start = monotonic()
        with pytest.raises(Problem, match="client"):
            await task
        assert monotonic() - start < 10  # not the minute that it was allowed

    run(workshop, main)


def test_nobody_waits_longer_than_the_deadline() -> None:
    workshop = Workshop(Settings(running=1, max_seconds=0.05))
    turn = threading.Event()
    begun: list[str] = []

    async def main() -> None:
        deaf = asyncio.ensure_future(workshop.run(client(), lambda body, ticket: turn.wait(10)))
        await asyncio.sleep(0)
        queued = workshop.run(client(), lambda body, ticket: begun.append("queued"))
        for task in (queued, deaf):
            with pytest.raises(Problem) as caught:
                await task
            assert caught.value.kind == "too-slow"
        turn.set()

    run(workshop, main)
    assert begun == []


def test_what_the_work_raises_comes_back() -> None:
    workshop = Workshop(Settings())

    def work(body: Body, ticket: Ticket) -> None:
        raise Problem(422, "odd", "odd")

    async def main() -> None:
        with pytest.raises(Problem, match="odd"):
            await workshop.run(client(), work)

    run(workshop, main)
