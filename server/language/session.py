"""One editor's session: its documents, and their evaluation while they are typed."""

from __future__ import annotations

import asyncio
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from functools import partial
from typing import Any

from lsprotocol import types as lsp
from pygls.lsp.server import LanguageServer
from pygls.protocol import LanguageServerProtocol, lsp_method

from dsl.diagnostics import Diagnostic
from dsl.language_service.lines import Unit
from dsl.language_service.program import Program
from dsl.language_service.values import evaluate_program
from server.language import answers
from server.language.documents import Document, Documents, path_of

_PAUSE = 0.15
"""Seconds without a key before a program is evaluated."""
_LARGE = 100_000
"""Bytes from which faults of syntax and names are told before the program has been evaluated."""


class _Protocol(LanguageServerProtocol):
    """The protocol with documents of our own.

    pygls counts U+2028 and others as ends of lines, which the protocol does not, and clips the
    positions of a change in place before we see them.
    """

    @lsp_method(lsp.TEXT_DOCUMENT_DID_CHANGE)
    def lsp_text_document__did_change(
        self, params: lsp.DidChangeTextDocumentParams
    ) -> Iterator[Any]:
        """Hand a change on as it is."""
        yield self.fm.features[lsp.TEXT_DOCUMENT_DID_CHANGE], (params,), None


class OvoloServer(LanguageServer):
    """The documents of one editor, and the evaluation of what is typed into them."""

    documents: Documents

    def __init__(self, version: str) -> None:
        super().__init__("ovolo", version, protocol_cls=_Protocol)
        self.documents = Documents("utf-16")
        self._worker = ThreadPoolExecutor(1, "evaluate")
        self._tasks: dict[str, asyncio.Task[None]] = {}

    def begin(self) -> None:
        """Take over what the editor said about itself."""
        folders = tuple(path_of(folder.uri) for folder in self.workspace.folders.values())
        encoding = self.workspace.position_encoding
        units: dict[object, Unit] = {
            lsp.PositionEncodingKind.Utf8: "utf-8",
            lsp.PositionEncodingKind.Utf32: "utf-32",
        }
        self.documents = Documents(units.get(encoding, "utf-16"), folders)
        if self.supports("workspace.did_change_watched_files.dynamic_registration"):
            options = lsp.DidChangeWatchedFilesRegistrationOptions(
                [lsp.FileSystemWatcher("**/*.ovo")]
            )
            watch = lsp.Registration("watch", lsp.WORKSPACE_DID_CHANGE_WATCHED_FILES, options)
            self.client_register_capability(lsp.RegistrationParams([watch]))

    def supports(self, path: str) -> bool:
        """Whether the editor said that it can do something."""
        found: Any = self.client_capabilities
        for name in path.split("."):
            found = getattr(found, name, None)
        return bool(found)

    def changed(self, document: Document) -> None:
        """Evaluate a document, and those that use it, once there is a pause."""
        for each in (document, *self.documents.users(document)):
            self.stop(each.uri)
            self._tasks[each.uri] = asyncio.ensure_future(self._evaluate(each))

    def stop(self, uri: str) -> None:
        """No longer evaluate a document."""
        task = self._tasks.pop(uri, None)
        if task is not None:
            task.cancel()

    async def evaluated(self, document: Document) -> None:
        """Wait until this version of a document has been evaluated."""
        task = self._tasks.get(document.uri)
        if document.evaluated != document.version and task is not None:
            with suppress(asyncio.CancelledError):
                await asyncio.shield(task)

    async def _evaluate(self, document: Document) -> None:
        """Tell the faults of a document, unless it changes before they are found."""
        await asyncio.sleep(_PAUSE)
        loop = asyncio.get_running_loop()
        project = self.documents.project
        program = self.documents.program(document)
        if len(program.encoded) >= _LARGE:
            quick = await loop.run_in_executor(self._worker, _faults, program)
            self._publish(document, quick)
        evaluate = partial(evaluate_program, project, program)
        found = await loop.run_in_executor(self._worker, evaluate)
        document.values, document.evaluated = found.values, document.version
        self._publish(document, found.diagnostics)
        if self.supports("workspace.inlay_hint.refresh_support"):
            self.workspace_inlay_hint_refresh(None)

    def _publish(self, document: Document, found: list[Diagnostic]) -> None:
        if self.documents.open.get(document.uri) is document:
            told = answers.diagnostics(self.documents, document, found)
            self.text_document_publish_diagnostics(
                lsp.PublishDiagnosticsParams(document.uri, told, document.version)
            )

    def shutdown(self) -> None:
        """End the evaluation with the server."""
        self._worker.shutdown(wait=False, cancel_futures=True)
        super().shutdown()  # type: ignore[no-untyped-call]


def _faults(program: Program) -> list[Diagnostic]:
    return [*program.faults, *program.resolution.diagnostics]
