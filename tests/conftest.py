"""Options of the whole suite."""

from __future__ import annotations

import pytest


def pytest_addoption(parser: pytest.Parser) -> None:
    group = parser.getgroup("reference", "the language reference, dsl/reference/*.md")
    group.addoption("--update", action="store_true", help="rewrite the outcomes of its examples")
    group.addoption("--dump", metavar="FILE", help="write its examples as JSON")
