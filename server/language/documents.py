"""The documents that an editor has open, and what has been found out about each version."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from urllib.parse import unquote, urlsplit

from lsprotocol import types as lsp
from pygls.uris import from_fs_path

from dsl.language_service.lines import Lines, Position, Unit
from dsl.language_service.program import Program
from dsl.language_service.project import Project
from dsl.language_service.values import Values
from dsl.spans import Source, Span


@dataclass(slots=True)
class Document:
    """One open document; `values` are those of version `evaluated`."""

    uri: str
    path: str
    version: int
    text: str
    lines: Lines
    values: Values = field(default_factory=dict)
    evaluated: int | None = None


class Documents:
    """Open documents by URI, and the places of all files in the editor's coordinates."""

    def __init__(self, unit: Unit, folders: tuple[str, ...] = ()) -> None:
        self.unit: Unit = unit
        self.project = Project(folders)
        self.open: dict[str, Document] = {}
        self._uris: dict[str, str] = {}
        self._lines: tuple[Source, Lines] | None = None

    def put(self, uri: str, version: int, text: str) -> Document:
        """A document as the editor shows it from now on."""
        path = path_of(uri)
        document = Document(uri, path, version, text, Lines(text, self.unit))
        self.open[uri] = document
        self._uris[path] = uri
        self.project.open(path, text)
        return document

    def change(
        self, uri: str, version: int, changes: list[lsp.TextDocumentContentChangeEvent]
    ) -> Document:
        """Apply an editor's changes, one after the other."""
        document = self.open[uri]
        text, lines = document.text, document.lines
        for change in changes:
            if isinstance(change, lsp.TextDocumentContentChangePartial):
                start = lines.offset(position(change.range.start))
                end = max(start, lines.offset(position(change.range.end)))
                encoded = lines.encoded
                text = (
                    encoded[:start].decode("utf-8", "surrogatepass")
                    + change.text
                    + encoded[end:].decode("utf-8", "surrogatepass")
                )
            else:
                text = change.text
            lines = Lines(text, self.unit)
        return self.put(uri, version, text)

    def close(self, uri: str) -> None:
        """The editor no longer shows a document."""
        document = self.open.pop(uri)
        self._uris.pop(document.path, None)
        self.project.close(document.path)

    def at(self, uri: str, place: lsp.Position) -> tuple[Document, Program, int]:
        """The document, its program, and the offset of a position in it."""
        document = self.open[uri]
        return document, self.program(document), document.lines.offset(position(place))

    def program(self, document: Document) -> Program:
        """The program in an open document."""
        program = self.project.program(document.path)
        assert program is not None, "what is open can be read"
        return program

    def users(self, document: Document) -> list[Document]:
        """The other open documents whose programs use that one."""
        return [
            other
            for other in self.open.values()
            if other is not document
            and any(
                inner.path == document.path for inner in self.project.reachable(self.program(other))
            )
        ]

    def uri(self, path: str) -> str:
        """The URI of a file, as the editor writes it if it is open."""
        return self._uris.get(path) or from_fs_path(path) or path

    def version(self, path: str) -> int | None:
        """The version of an open document, None for a file that is not open."""
        uri = self._uris.get(path)
        return None if uri is None else self.open[uri].version

    def range(self, span: Span) -> lsp.Range:
        """A span in the editor's coordinates."""
        source, known = span.source, self._lines  # which another thread may replace meanwhile
        if known is None or known[0] is not source:
            known = self._lines = (source, Lines(source.text, self.unit))
        return range_in(known[1], span.start, span.end)

    def location(self, span: Span) -> lsp.Location:
        """A span with its file."""
        return lsp.Location(self.uri(span.source.name), self.range(span))


def position(place: lsp.Position) -> Position:
    """The protocol's position as ours."""
    return Position(place.line, place.character)


def range_in(lines: Lines, start: int, end: int) -> lsp.Range:
    """Offsets as the protocol's range."""
    return lsp.Range(lsp.Position(*lines.position(start)), lsp.Position(*lines.position(end)))


def path_of(uri: str) -> str:
    """The file that a URI names, symbolic links followed; the URI itself if it names none."""
    parts = urlsplit(uri)
    if parts.scheme != "file":
        return uri
    path = unquote(parts.path)
    try:
        return str(Path(path).resolve())
    except (OSError, RuntimeError, ValueError):
        return path
