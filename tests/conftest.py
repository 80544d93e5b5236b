"""Options and fixtures of the whole suite."""

from __future__ import annotations

import signal

import pytest
from hypothesis import HealthCheck, settings

settings.register_profile(  # a machine that is busy makes no test fail
    "unhurried", deadline=None, suppress_health_check=[HealthCheck.too_slow]
)
settings.load_profile("unhurried")


def pytest_addoption(parser: pytest.Parser) -> None:
    group = parser.getgroup("reference", "the language reference, dsl/reference/*.md")
    group.addoption("--update", action="store_true", help="rewrite the outcomes of its examples")


def pytest_configure() -> None:
    """Let Ctrl-C be heard, here and in the processes that tests start.

    A shell that starts a job in the background has it ignore that signal, and so its children.
    """
    signal.signal(signal.SIGINT, signal.default_int_handler)
