"""Options of the whole suite."""

from __future__ import annotations

import pytest
from hypothesis import settings

# Machines are shared: how long an example takes says nothing about it.
settings.register_profile("ovolo", deadline=None)
settings.load_profile("ovolo")


def pytest_addoption(parser: pytest.Parser) -> None:
    group = parser.getgroup("reference", "the language reference, dsl/reference/*.md")
    group.addoption("--update", action="store_true", help="rewrite the outcomes of its examples")
    group.addoption("--dump", metavar="FILE", help="write its examples as JSON")
