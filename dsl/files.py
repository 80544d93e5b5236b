"""The files that scenes may read: all reading goes through a `Files`."""

from __future__ import annotations

import errno
import os
import re
import stat
from itertools import islice
from pathlib import Path

from dsl.codes import diagnostic
from dsl.diagnostics import Diagnostic, Label
from dsl.observation import asked_for
from dsl.spans import Place

_URL = re.compile(r"[A-Za-z][A-Za-z0-9+.-]+:")
_DRIVE = re.compile(r"[A-Za-z]:")


class FileFault(Exception):
    """A file that cannot be had; `diagnostic(place)` says why, at the words that name it."""

    def __init__(self, code: str, message: str, help: str | None = None) -> None:
        super().__init__(message)
        self.code = code
        self.message = message
        self.help = help

    def diagnostic(self, place: Place | None, secondary: tuple[Label, ...] = ()) -> Diagnostic:
        """The fault at a place."""
        return diagnostic(self.code, self.message, place, help=self.help, secondary=secondary)


class SourceTooLarge(FileFault):
    """A scene program beyond the limit: `size` in words, such as "12 bytes"."""

    def __init__(self, name: str, size: str, limit: int) -> None:
        message = f"`{name}` has {size}, more than the limit of {limit}"
        super().__init__("limit-source", message, "split it into files and `use` them")


class Files:
    """Reads files by the names that scenes give them.

    A relative path starts from the folder of the file that names it. With a `root`, folders are
    relative to it and nothing outside can be read: no absolute path, no `..` beyond the root, no
    symbolic link out, no URL. No file larger than `max_bytes` is read.
    """

    def __init__(self, root: Path | None = None, max_bytes: int = 2_000_000_000) -> None:
        self.root = None if root is None else root.resolve()
        self.max_bytes = max_bytes

    def name(self, path: Path) -> str:
        """How scenes name the file at a path of the file system; FileFault if it is outside."""
        if self.root is None:
            return str(path)
        resolved = path.resolve()
        if not resolved.is_relative_to(self.root):
            raise FileFault(
                "file-outside",
                f"`{path}` is not in the folder that the scene may read",
                "name a root that contains the scene",
            )
        return str(resolved.relative_to(self.root))

    def resolve(self, path: str, folder: str = "", source_bytes: int | None = None) -> Path:
        """The existing file that `path` names in `folder`, symbolic links followed.

        `source_bytes` are what it may have if it is to be a scene program. Raises FileFault for
        what is missing, outside, too large, or not a file.
        """
        if not path or "\0" in path:
            raise FileFault("file-missing", "a file's name is empty or has a null character")
        if _URL.match(path) and not _DRIVE.fullmatch(path[:2]):
            raise FileFault(
                "file-outside", f"`{path}` is a URL; scenes read files only", "download it first"
            )
        if self.root is not None and (Path(path).is_absolute() or _DRIVE.match(path)):
            raise FileFault(
                "file-outside",
                f"`{path}` is an absolute path",
                "write it relative to the file that names it",
            )
        try:
            found = ((self.root or Path()) / folder / path).resolve()
            asked_for(found)
            if self.root is not None and not found.is_relative_to(self.root):
                raise FileFault(
                    "file-outside",
                    f"`{path}` leads out of the folder that the scene may read",
                    "put the file into the scene's folder",
                )
            if not found.exists():
                raise FileFault("file-missing", f"no file `{path}`", self._near(found))
            if not found.is_file():
                raise FileFault("file-unreadable", f"`{path}` is not a file")
            size = found.stat().st_size
        except (OSError, RuntimeError, ValueError) as error:
            raise FileFault(
                "file-unreadable", f"`{path}` cannot be read: {_reason(error)}"
            ) from None
        self._check_size(path, size, source_bytes)
        return found

    def _check_size(self, path: str, size: int, source_bytes: int | None) -> None:
        if source_bytes is not None and size > source_bytes:
            raise SourceTooLarge(path, f"{size} bytes", source_bytes)
        if size > self.max_bytes:
            raise FileFault(
                "file-too-large", f"`{path}` has {size} bytes, more than {self.max_bytes}"
            )

    def read_bytes(self, path: str, folder: str = "", source_bytes: int | None = None) -> bytes:
        """The contents of a file, see `resolve`; raises FileFault."""
        found = self.resolve(path, folder, source_bytes)
        try:
            with open(found, "rb", opener=_without_waiting) as file:
                found_now = os.fstat(file.fileno())
                if not stat.S_ISREG(found_now.st_mode):
                    raise FileFault("file-unreadable", f"`{path}` is not a file")
                self._check_size(path, found_now.st_size, source_bytes)
                content = file.read(found_now.st_size + 1) or b""
        except OSError as error:
            raise FileFault(
                "file-unreadable", f"`{path}` cannot be read: {_reason(error)}"
            ) from None
        if len(content) != found_now.st_size:
            message = f"`{path}` cannot be read: it changes meanwhile"
            raise FileFault("file-unreadable", message, "read it when it is written")
        return content

    def read_text(self, path: str, folder: str = "", source_bytes: int | None = None) -> str:
        """The text of a UTF-8 file without its byte-order mark, see `resolve`; raises FileFault."""
        return decode(self.read_bytes(path, folder, source_bytes), path)

    def _near(self, missing: Path) -> str | None:
        """Help that names a file of nearly that name beside the missing one."""
        from dsl.suggest import did_you_mean

        try:
            names = [entry.name for entry in islice(missing.parent.iterdir(), 1000)]
        except OSError:
            return None
        return did_you_mean(missing.name, names)


def decode(content: bytes, name: str) -> str:
    """The text of UTF-8 without its byte-order mark; raises FileFault, which says the name."""
    try:
        return content.decode("utf-8").removeprefix("\ufeff")
    except UnicodeDecodeError as error:
        raise FileFault(
            "file-encoding",
            f"`{name}` is not UTF-8 text (byte {error.start})",
            "save it as UTF-8",
        ) from None


def _without_waiting(path: str, flags: int) -> int:
    """Open a file that may have become a pipe since it was looked at."""
    return os.open(path, flags | getattr(os, "O_NONBLOCK", 0))


def _reason(error: Exception) -> str:
    if isinstance(error, RuntimeError) or getattr(error, "errno", 0) == errno.ELOOP:
        return "its symbolic links lead in a circle"
    if isinstance(error, OSError) and error.strerror:
        return error.strerror.lower()
    return "its name is not possible"
