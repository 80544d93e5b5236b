"""How the command ends."""

from __future__ import annotations

from enum import IntEnum


class Exit(IntEnum):
    """Exit codes of `ovolo`, with their meaning."""

    meaning: str

    def __new__(cls, value: int, meaning: str) -> Exit:
        """Make the member an integer that carries its meaning."""
        member = int.__new__(cls, value)
        member._value_ = value
        member.meaning = meaning
        return member

    OK = 0, "done"
    FAULTS = 1, "the scene has faults"
    USAGE = 2, "the command line asks for what cannot be"
    FILES = 3, "a file cannot be read or written"
    BUG = 70, "a fault of ovolo's own"
    INTERRUPTED = 130, "interrupted"
    PIPE_CLOSED = 141, "nobody reads the output any more"


class StopError(Exception):
    """Ends the command with an exit code, a line for the user, and how to mend it."""

    def __init__(self, code: Exit, message: str, help: str | None = None) -> None:
        super().__init__(message)
        self.code = code
        self.message = message
        self.help = help
