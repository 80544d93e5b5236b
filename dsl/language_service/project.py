"""The files of an editor's session: those that are open as they are typed, the rest as stored."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path, PurePath
from threading import RLock

from dsl import ast
from dsl.budget import DEFAULT_LIMITS
from dsl.files import FileFault, Files
from dsl.language_service.program import Program

_MOST_FILES = 20_000
_SKIPPED = frozenset(("node_modules", "target", "__pycache__"))


class OpenFiles(Files):
    """Files whose text is what the editor shows, where it shows it."""

    def __init__(self) -> None:
        super().__init__()
        self.texts: dict[str, str] = {}

    def resolve(self, path: str, folder: str = "", source_bytes: int | None = None) -> Path:
        """The file, which need not be stored yet if it is open; raises FileFault."""
        named = PurePath(folder) / path
        return (
            Path(named) if str(named) in self.texts else super().resolve(path, folder, source_bytes)
        )

    def read_bytes(self, path: str, folder: str = "", source_bytes: int | None = None) -> bytes:
        """The bytes of the open text, or of the file; raises FileFault."""
        text = self.texts.get(str(self.resolve(path, folder, source_bytes)))
        if text is not None:
            return text.encode("utf-8", "replace")
        return super().read_bytes(path, folder, source_bytes)


class Project:
    """Programs by path, each read once per version.

    `folders` are searched for other programs that use a file.
    """

    def __init__(self, folders: tuple[str, ...] = ()) -> None:
        self.folders = folders
        self.files = OpenFiles()
        self._lock = RLock()  # the editor's questions come while a program is being evaluated
        self._programs: dict[str, tuple[object, Program]] = {}

    def open(self, path: str, text: str) -> None:
        """What the editor shows for a path from now on."""
        self.files.texts[path] = text

    def close(self, path: str) -> None:
        """From now on the path has what is stored there."""
        self.files.texts.pop(path, None)
        self._programs.pop(path, None)

    def program(self, path: str) -> Program | None:
        """The program at a path, or None if there is none that can be read; one per version."""
        with self._lock:
            return self._program(path)

    def _program(self, path: str) -> Program | None:
        text = self.files.texts.get(path)
        if text is None:
            try:
                found = Path(path).stat()
                version: object = (found.st_mtime_ns, found.st_size)
            except (OSError, ValueError):
                return None
            known = self._programs.get(path)
            if known is not None and known[0] == version:
                return known[1]
            try:
                text = self.files.read_text(path, "", DEFAULT_LIMITS.source_bytes)
            except FileFault:
                return None
        else:
            version = text
        known = self._programs.get(path)
        if known is None or known[0] != version:
            known = self._programs[path] = (version, Program(path, text))
        return known[1]

    def used(self, program: Program, use: ast.Use) -> Program | None:
        """The program that a `use` names."""
        if use.path is None:
            return None
        try:
            found = self.files.resolve(use.path.text, program.source.folder)
        except FileFault:
            return None
        return self.program(str(found))

    def reachable(self, program: Program) -> Iterator[Program]:
        """The programs that one uses, directly or through others; each once."""
        seen = {program.path}
        waiting = [program]
        while waiting:
            user = waiting.pop()
            for statement in user.uses:
                inner = self.used(user, statement)
                if inner is not None and inner.path not in seen:
                    seen.add(inner.path)
                    waiting.append(inner)
                    yield inner

    def programs(self) -> Iterator[Program]:
        """The open programs, what they use, and those in the folders; each once."""
        seen: set[str] = set()
        waiting = [*self.files.texts, *self._stored()]
        while waiting:
            path = waiting.pop(0)
            program = self.program(path) if path not in seen else None
            seen.add(path)
            if program is None:
                continue
            yield program
            waiting += [inner.path for inner in self.reachable(program) if inner.path not in seen]

    def _stored(self) -> Iterator[str]:
        """Programs in the folders, as many as can be looked through while someone waits."""
        count = 0
        for folder in self.folders:
            for root, folders, files in os.walk(folder):
                folders[:] = [f for f in folders if not f.startswith(".") and f not in _SKIPPED]
                count += len(files)
                if count > _MOST_FILES:
                    return
                for name in files:
                    if name.endswith(".ovo"):
                        yield str((Path(root) / name).resolve())
