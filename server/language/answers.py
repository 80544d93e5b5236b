"""Answers of the language service in the words of the protocol."""

from __future__ import annotations

from collections.abc import Iterable

from lsprotocol import types as lsp

from dsl.diagnostics import Diagnostic, Label
from dsl.language_service.completion import Completion
from dsl.language_service.lines import Lines
from dsl.language_service.outline import Symbol
from dsl.language_service.rename import Edits
from dsl.language_service.signature import SignatureHelp
from dsl.spans import Span
from server.language.documents import Document, Documents, range_in

_KINDS = {
    "function": lsp.CompletionItemKind.Function,
    "method": lsp.CompletionItemKind.Method,
    "variable": lsp.CompletionItemKind.Variable,
    "parameter": lsp.CompletionItemKind.Field,
    "constant": lsp.CompletionItemKind.Constant,
    "member": lsp.CompletionItemKind.Property,
    "file": lsp.CompletionItemKind.Module,
    "keyword": lsp.CompletionItemKind.Keyword,
    "unit": lsp.CompletionItemKind.Unit,
}
_SYMBOLS = {
    "a function": lsp.SymbolKind.Function,
    "a file": lsp.SymbolKind.Module,
    "an object": lsp.SymbolKind.Object,
    "a number": lsp.SymbolKind.Number,
    "a string": lsp.SymbolKind.String,
    "a truth value": lsp.SymbolKind.Boolean,
    "a list": lsp.SymbolKind.Array,
}


def diagnostics(
    documents: Documents, document: Document, found: Iterable[Diagnostic]
) -> list[lsp.Diagnostic]:
    """Faults in a document; one without a place in it stands at its start."""
    return [_diagnostic(documents, document, each) for each in found]


def _diagnostic(documents: Documents, document: Document, found: Diagnostic) -> lsp.Diagnostic:
    place = found.primary.place if found.primary is not None else None
    inside = isinstance(place, Span) and place.source.name == document.path
    error = found.severity == "error"
    return lsp.Diagnostic(
        range=documents.range(place) if inside and isinstance(place, Span) else _START,
        message=found.message + (f"\nhelp: {found.help}" if found.help else ""),
        severity=lsp.DiagnosticSeverity.Error if error else lsp.DiagnosticSeverity.Warning,
        code=found.code,
        source="ovolo",
        tags=[lsp.DiagnosticTag.Unnecessary] if found.code == "advice-unused" else None,
        related_information=[*_related(documents, found.secondary)],
    )


_START = lsp.Range(lsp.Position(0, 0), lsp.Position(0, 0))


def _related(
    documents: Documents, labels: Iterable[Label]
) -> Iterable[lsp.DiagnosticRelatedInformation]:
    for label in labels:
        if isinstance(label.place, Span):
            yield lsp.DiagnosticRelatedInformation(
                documents.location(label.place), label.text or "here"
            )


def completion(lines: Lines, item: Completion, snippets: bool) -> lsp.CompletionItem:
    """One completion; without snippets, the word alone."""
    text = item.snippet if snippets else item.label
    return lsp.CompletionItem(
        label=item.label,
        kind=_KINDS[item.kind],
        detail=item.detail or None,
        documentation=markdown(item.doc) if item.doc else None,
        sort_text=f"{item.order}{item.label}",
        filter_text=item.label,
        insert_text_format=lsp.InsertTextFormat.Snippet
        if snippets
        else lsp.InsertTextFormat.PlainText,
        text_edit=lsp.TextEdit(range_in(lines, item.start, item.end), text),
    )


def markdown(text: str) -> lsp.MarkupContent:
    """Markdown for the editor."""
    return lsp.MarkupContent(lsp.MarkupKind.Markdown, text)


def signature_help(found: SignatureHelp) -> lsp.SignatureHelp:
    """Signatures with the argument that is being given."""
    signatures = [
        lsp.SignatureInformation(
            label=form.text,
            documentation=markdown(form.doc) if form.doc else None,
            parameters=[
                lsp.ParameterInformation(word, markdown(doc) if doc else None)
                for word, doc in form.parameters
            ],
        )
        for form in found.forms
    ]
    return lsp.SignatureHelp(signatures, found.active, found.parameter)


def symbol(documents: Documents, found: Symbol) -> lsp.DocumentSymbol:
    """A definition with those inside it."""
    return lsp.DocumentSymbol(
        name=found.name,
        kind=_SYMBOLS.get(found.kind, lsp.SymbolKind.Variable),
        range=documents.range(found.span),
        selection_range=documents.range(found.name_span),
        detail=found.detail,
        children=[symbol(documents, inner) for inner in found.children],
    )


def workspace_edit(documents: Documents, edits: Edits, versioned: bool) -> lsp.WorkspaceEdit:
    """Edits of several files; `versioned` ones apply to the versions that they were made for."""
    changes = {
        path: [lsp.TextEdit(documents.range(span), text) for span, text in places]
        for path, places in edits.items()
    }
    if not versioned:
        return lsp.WorkspaceEdit(changes={documents.uri(path): e for path, e in changes.items()})
    return lsp.WorkspaceEdit(
        document_changes=[
            lsp.TextDocumentEdit(
                lsp.OptionalVersionedTextDocumentIdentifier(
                    documents.uri(path), documents.version(path)
                ),
                list(places),
            )
            for path, places in changes.items()
        ]
    )


def replacement(lines: Lines, text: str) -> list[lsp.TextEdit]:
    """The edit that makes a document that text, between what both begin and end with."""
    before, after = lines.encoded, text.encode("utf-8", "surrogatepass")
    if before == after:
        return []
    old, new = before.splitlines(keepends=True), after.splitlines(keepends=True)
    first = 0
    while first < min(len(old), len(new)) and old[first] == new[first]:
        first += 1
    last = 0
    while last < min(len(old), len(new)) - first and old[-1 - last] == new[-1 - last]:
        last += 1
    start = sum(map(len, old[:first]))
    end = len(before) - sum(map(len, old[len(old) - last :]))
    words = b"".join(new[first : len(new) - last]).decode("utf-8", "surrogatepass")
    return [lsp.TextEdit(range_in(lines, start, end), words)]
