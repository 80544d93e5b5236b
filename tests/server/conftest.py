from __future__ import annotations

from collections.abc import Callable, Iterator

import pytest
from fastapi.testclient import TestClient

from server.app import create_app
from server.settings import Settings

Connect = Callable[[Settings], TestClient]


@pytest.fixture
def connect() -> Iterator[Connect]:
    """A client of a new service with these settings."""
    clients: list[TestClient] = []

    def connect(settings: Settings) -> TestClient:
        app = create_app(settings)
        client = TestClient(app, "http://localhost:8000", raise_server_exceptions=False)
        clients.append(client.__enter__())
        return client

    yield connect
    for client in clients:
        client.__exit__(None, None, None)


@pytest.fixture
def client(connect: Connect) -> TestClient:
    """A client of a new service."""
    return connect(Settings())
