"""The language server: which question of an editor gets which answer."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import Any

from lsprotocol import types as lsp
from pygls.exceptions import JsonRpcException

from dsl.format import format_source
from dsl.language_service.colors import colors, presentations
from dsl.language_service.completion import completions
from dsl.language_service.hover import hover
from dsl.language_service.navigation import definition, references
from dsl.language_service.outline import folds, symbols
from dsl.language_service.rename import RefusedError, renamable, rename
from dsl.language_service.signature import signature_help
from dsl.language_service.values import inlays
from dsl.spans import Source
from server.language import answers
from server.language.documents import position, range_in
from server.language.session import OvoloServer

_REQUEST_FAILED = int(lsp.LSPErrorCodes.RequestFailed)
_CONTENT_MODIFIED = int(lsp.LSPErrorCodes.ContentModified)


def make_server(version: str) -> OvoloServer:
    """A server for one editor; `start_io` lets it speak on standard input and output."""
    server = OvoloServer(version)
    for method, (handler, options) in _FEATURES.items():
        server.feature(method, options)(handler)
    return server


def _initialized(server: OvoloServer, params: lsp.InitializedParams) -> None:
    server.begin()


def _did_open(server: OvoloServer, params: lsp.DidOpenTextDocumentParams) -> None:
    item = params.text_document
    server.changed(server.documents.put(item.uri, item.version, item.text))


def _did_change(server: OvoloServer, params: lsp.DidChangeTextDocumentParams) -> None:
    item = params.text_document
    changes = list(params.content_changes)
    server.changed(server.documents.change(item.uri, item.version, changes))


def _did_save(server: OvoloServer, params: lsp.DidSaveTextDocumentParams) -> None:
    server.changed(server.documents.open[params.text_document.uri])


def _did_close(server: OvoloServer, params: lsp.DidCloseTextDocumentParams) -> None:
    uri = params.text_document.uri
    server.stop(uri)
    server.documents.close(uri)
    server.text_document_publish_diagnostics(lsp.PublishDiagnosticsParams(uri, []))


def _files_changed(server: OvoloServer, params: lsp.DidChangeWatchedFilesParams) -> None:
    for document in list(server.documents.open.values()):
        server.changed(document)


def _hover(server: OvoloServer, params: lsp.HoverParams) -> lsp.Hover | None:
    documents = server.documents
    document, program, offset = documents.at(params.text_document.uri, params.position)
    values = document.values if document.evaluated == document.version else None
    found = hover(documents.project, program, offset, values)
    if found is None:
        return None
    return lsp.Hover(answers.markdown(found.markdown), documents.range(found.span))


def _completion(server: OvoloServer, params: lsp.CompletionParams) -> lsp.CompletionList:
    documents = server.documents
    document, program, offset = documents.at(params.text_document.uri, params.position)
    snippets = server.supports("text_document.completion.completion_item.snippet_support")
    found = completions(documents.project, program, offset)
    items = [answers.completion(document.lines, item, snippets) for item in found]
    return lsp.CompletionList(is_incomplete=False, items=items)


def _signature_help(
    server: OvoloServer, params: lsp.SignatureHelpParams
) -> lsp.SignatureHelp | None:
    documents = server.documents
    _, program, offset = documents.at(params.text_document.uri, params.position)
    found = signature_help(documents.project, program, offset)
    return None if found is None else answers.signature_help(found)


def _definition(server: OvoloServer, params: lsp.DefinitionParams) -> lsp.Location | None:
    documents = server.documents
    _, program, offset = documents.at(params.text_document.uri, params.position)
    found = definition(documents.project, program, offset)
    return None if found is None else documents.location(found)


def _references(server: OvoloServer, params: lsp.ReferenceParams) -> list[lsp.Location]:
    documents = server.documents
    _, program, offset = documents.at(params.text_document.uri, params.position)
    return [
        documents.location(each.span)
        for each in references(documents.project, program, offset)
        if params.context.include_declaration or not each.is_definition
    ]


def _highlight(
    server: OvoloServer, params: lsp.DocumentHighlightParams
) -> list[lsp.DocumentHighlight]:
    documents = server.documents
    _, program, offset = documents.at(params.text_document.uri, params.position)
    return [
        lsp.DocumentHighlight(
            documents.range(each.span),
            lsp.DocumentHighlightKind.Write
            if each.is_definition
            else lsp.DocumentHighlightKind.Read,
        )
        for each in references(documents.project, program, offset)
        if each.span.source is program.source
    ]


def _prepare_rename(
    server: OvoloServer, params: lsp.PrepareRenameParams
) -> lsp.PrepareRenamePlaceholder | None:
    documents = server.documents
    _, program, offset = documents.at(params.text_document.uri, params.position)
    found = renamable(documents.project, program, offset)
    if found is None:
        return None
    return lsp.PrepareRenamePlaceholder(documents.range(found.span), program.text(found.span))


async def _rename(server: OvoloServer, params: lsp.RenameParams) -> lsp.WorkspaceEdit:
    documents = server.documents
    _, program, offset = documents.at(params.text_document.uri, params.position)
    versioned = server.supports("workspace.workspace_edit.document_changes")
    before = dict(documents.open)

    def edit() -> lsp.WorkspaceEdit:
        edits = rename(documents.project, program, offset, params.new_name)
        return answers.workspace_edit(documents, edits, versioned)

    try:
        result = await asyncio.to_thread(edit)  # in a file of a megabyte it takes seconds
    except RefusedError as refused:
        raise JsonRpcException(str(refused), _REQUEST_FAILED) from None
    if any(documents.open.get(uri) is not document for uri, document in before.items()):
        raise JsonRpcException("a document has changed", _CONTENT_MODIFIED)
    return result


def _symbols(server: OvoloServer, params: lsp.DocumentSymbolParams) -> list[lsp.DocumentSymbol]:
    documents = server.documents
    program = documents.program(documents.open[params.text_document.uri])
    return [answers.symbol(documents, each) for each in symbols(documents.project, program)]


def _folding(server: OvoloServer, params: lsp.FoldingRangeParams) -> list[lsp.FoldingRange]:
    document = server.documents.open[params.text_document.uri]
    found = folds(server.documents.program(document), document.lines)
    return [lsp.FoldingRange(each.first, each.last, kind=each.kind) for each in found]


async def _formatting(
    server: OvoloServer, params: lsp.DocumentFormattingParams
) -> list[lsp.TextEdit] | None:
    document = server.documents.open[params.text_document.uri]
    source = Source(document.path, document.text)
    text, _ = await asyncio.to_thread(format_source, source)  # a long one takes seconds
    if server.documents.open.get(document.uri) is not document:
        raise JsonRpcException("the document has changed", _CONTENT_MODIFIED)
    return None if text is None else answers.replacement(document.lines, text)


def _colors(server: OvoloServer, params: lsp.DocumentColorParams) -> list[lsp.ColorInformation]:
    document = server.documents.open[params.text_document.uri]
    return [
        lsp.ColorInformation(
            range_in(document.lines, each.start, each.end), lsp.Color(*each.encoded, 1.0)
        )
        for each in colors(server.documents.program(document))
    ]


def _color_presentation(
    server: OvoloServer, params: lsp.ColorPresentationParams
) -> list[lsp.ColorPresentation]:
    lines = server.documents.open[params.text_document.uri].lines
    start, end = (lines.offset(position(p)) for p in (params.range.start, params.range.end))
    now = lines.encoded[start:end].decode("utf-8", "replace")
    color = params.color
    return [
        lsp.ColorPresentation(text, lsp.TextEdit(params.range, text))
        for text in presentations((color.red, color.green, color.blue), now)
    ]


async def _inlay(server: OvoloServer, params: lsp.InlayHintParams) -> list[lsp.InlayHint]:
    documents = server.documents
    document = documents.open[params.text_document.uri]
    await server.evaluated(document)
    first, last = (
        document.lines.offset(position(p)) for p in (params.range.start, params.range.end)
    )
    return [
        lsp.InlayHint(
            lsp.Position(*document.lines.position(each.offset)), each.text, padding_left=True
        )
        for each in inlays(documents.program(document), document.values)
        if first <= each.offset <= last
    ]


_FEATURES: dict[str, tuple[Callable[..., Any], Any]] = {
    lsp.INITIALIZED: (_initialized, None),
    lsp.TEXT_DOCUMENT_DID_OPEN: (_did_open, None),
    lsp.TEXT_DOCUMENT_DID_CHANGE: (_did_change, None),
    lsp.TEXT_DOCUMENT_DID_SAVE: (_did_save, None),
    lsp.TEXT_DOCUMENT_DID_CLOSE: (_did_close, None),
    lsp.WORKSPACE_DID_CHANGE_WATCHED_FILES: (_files_changed, None),
    lsp.TEXT_DOCUMENT_HOVER: (_hover, None),
    lsp.TEXT_DOCUMENT_COMPLETION: (_completion, lsp.CompletionOptions([".", "(", ","])),
    lsp.TEXT_DOCUMENT_SIGNATURE_HELP: (
        _signature_help,
        lsp.SignatureHelpOptions(["(", ","], [":"]),
    ),
    lsp.TEXT_DOCUMENT_DEFINITION: (_definition, None),
    lsp.TEXT_DOCUMENT_REFERENCES: (_references, None),
    lsp.TEXT_DOCUMENT_DOCUMENT_HIGHLIGHT: (_highlight, None),
    lsp.TEXT_DOCUMENT_PREPARE_RENAME: (_prepare_rename, None),
    lsp.TEXT_DOCUMENT_RENAME: (_rename, lsp.RenameOptions(prepare_provider=True)),
    lsp.TEXT_DOCUMENT_DOCUMENT_SYMBOL: (_symbols, None),
    lsp.TEXT_DOCUMENT_FOLDING_RANGE: (_folding, None),
    lsp.TEXT_DOCUMENT_FORMATTING: (_formatting, None),
    lsp.TEXT_DOCUMENT_DOCUMENT_COLOR: (_colors, None),
    lsp.TEXT_DOCUMENT_COLOR_PRESENTATION: (_color_presentation, None),
    lsp.TEXT_DOCUMENT_INLAY_HINT: (_inlay, None),
}
