"""A session of the language server with a real client: pygls' own, over standard input and output.

`Editor` speaks for an editor: it opens documents and types into them, and keeps what it is told.
"""

from __future__ import annotations

import asyncio
import os
import sys
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import Any, cast

import pytest
from lsprotocol import types as lsp
from pygls.exceptions import JsonRpcException
from pygls.lsp.client import LanguageClient

ROOT = Path(__file__).parent.parent.parent

BRICKS = """/// The colour of snow.
let snow = matte(color: #ffffff)
"""
MAIN = """use "bricks.ovo" as bricks
let n = 8
let step = 360deg / n

/// A ring of 😀 bricks.
fn ring(
  /// how many
  count,
) {
  let block = box(bevel: 0.1)
  for i in 0..count { block.rotate_y(step * i) }
}

/* 😀 */ ring(count: n).material(bricks.snow)
"""


class Editor(LanguageClient):
    """A client that waits for diagnostics."""

    def __init__(self) -> None:
        super().__init__("editor", "1")
        self.told: list[lsp.PublishDiagnosticsParams] = []
        self.refreshed = 0
        self.errors: list[str] = []
        self.feature(lsp.TEXT_DOCUMENT_PUBLISH_DIAGNOSTICS)(lambda params: self.told.append(params))
        self.feature(lsp.WORKSPACE_INLAY_HINT_REFRESH)(lambda params: self.refresh())
        self.feature(lsp.WINDOW_SHOW_MESSAGE)(lambda params: self.errors.append(params.message))

    def refresh(self) -> None:
        self.refreshed += 1

    def open(self, uri: str, text: str) -> None:
        item = lsp.TextDocumentItem(uri, "ovolo", 1, text)
        self.text_document_did_open(lsp.DidOpenTextDocumentParams(item))

    def type(self, uri: str, version: int, *changes: tuple[lsp.Range | None, str]) -> None:
        events: list[lsp.TextDocumentContentChangeEvent] = [
            lsp.TextDocumentContentChangeWholeDocument(text)
            if place is None
            else lsp.TextDocumentContentChangePartial(place, text)
            for place, text in changes
        ]
        document = lsp.VersionedTextDocumentIdentifier(version, uri)
        self.text_document_did_change(lsp.DidChangeTextDocumentParams(document, events))

    async def diagnostics(self, uri: str, version: int) -> list[lsp.Diagnostic]:
        """Those of a version, once it has been evaluated."""
        for _ in range(600):
            for told in self.told:
                if told.uri == uri and told.version == version:
                    return list(told.diagnostics)
            await asyncio.sleep(0.05)
        raise AssertionError(f"no diagnostics of version {version}: {self.told}")


Session = Callable[[Editor], Awaitable[None]]


def with_editor(
    session: Session, folder: Path, encodings: list[lsp.PositionEncodingKind | str] | None = None
) -> None:
    """Start a server, let the session talk to it, and end it as editors do."""

    async def run() -> None:
        editor = Editor()
        environment = {**os.environ, "PYTHONPATH": str(ROOT)}
        arguments = ["-m", "ovolo", "lsp", "--stdio"]
        await editor.start_io(sys.executable, *arguments, env=environment, cwd=folder)
        answer = await editor.initialize_async(
            lsp.InitializeParams(
                capabilities=lsp.ClientCapabilities(
                    general=lsp.GeneralClientCapabilities(position_encodings=encodings),
                    workspace=lsp.WorkspaceClientCapabilities(
                        workspace_edit=lsp.WorkspaceEditClientCapabilities(document_changes=True),
                        inlay_hint=lsp.InlayHintWorkspaceClientCapabilities(refresh_support=True),
                    ),
                    text_document=lsp.TextDocumentClientCapabilities(
                        completion=lsp.CompletionClientCapabilities(
                            completion_item=lsp.ClientCompletionItemOptions(snippet_support=True)
                        )
                    ),
                ),
                workspace_folders=[lsp.WorkspaceFolder(folder.as_uri(), "scenes")],
            )
        )
        wanted = encodings[0] if encodings else lsp.PositionEncodingKind.Utf16
        assert answer.capabilities.position_encoding == wanted
        editor.initialized(lsp.InitializedParams())
        await session(editor)
        assert editor.errors == []
        await editor.shutdown_async(None)
        editor.exit(None)
        server = cast("Any", editor)._server
        assert await asyncio.wait_for(server.wait(), 30) == 0
        await cast("Any", editor).stop()

    asyncio.run(asyncio.wait_for(run(), 120))


def at(text: str, mark: str, offset: int = 0, unit: str = "utf-16-le") -> lsp.Position:
    """Where a text begins, or so many code units further, as an editor counts."""
    before = text[: text.index(mark)]
    width = {"utf-8": 1, "utf-16-le": 2, "utf-32-le": 4}[unit]
    column = len(before.rpartition("\n")[2].encode(unit)) // width
    return lsp.Position(before.count("\n"), column + offset)


def over(text: str, mark: str) -> lsp.Range:
    return lsp.Range(at(text, mark), at(text, mark, len(mark.encode("utf-16-le")) // 2))


def cut(text: str, place: lsp.Range) -> str:
    """The text at a range in UTF-16 units."""
    lines = text.split("\n")
    start, end = place.start, place.end
    assert start.line == end.line
    units = lines[start.line].encode("utf-16-le")
    return units[2 * start.character : 2 * end.character].decode("utf-16-le")


@pytest.fixture
def scenes(tmp_path: Path) -> Path:
    folder = tmp_path.resolve() / "höhe 1"
    folder.mkdir()
    (folder / "bricks.ovo").write_text(BRICKS, encoding="utf-8")
    (folder / "main.ovo").write_text(MAIN, encoding="utf-8")
    return folder


def test_a_session(scenes: Path) -> None:
    main, bricks = ((scenes / name).as_uri() for name in ("main.ovo", "bricks.ovo"))
    document = lsp.TextDocumentIdentifier(main)

    async def session(editor: Editor) -> None:
        editor.open(main, MAIN)
        assert await editor.diagnostics(main, 1) == []

        # What is under the pointer.
        call = at(MAIN, "ring(count: n)", 1)
        hovered = await editor.text_document_hover_async(lsp.HoverParams(document, call))
        assert hovered is not None
        assert hovered.range is not None
        assert cut(MAIN, hovered.range) == "ring"
        assert isinstance(hovered.contents, lsp.MarkupContent)
        assert hovered.contents.value == (
            "```ovolo\nfn ring(count)\n```\n\nA ring of 😀 bricks.\n\n- `count`: how many"
        )
        hovered = await editor.text_document_hover_async(
            lsp.HoverParams(document, at(MAIN, "step *"))
        )
        assert hovered is not None
        assert isinstance(hovered.contents, lsp.MarkupContent)
        assert "// = 45deg" in hovered.contents.value
        nothing = await editor.text_document_hover_async(
            lsp.HoverParams(document, lsp.Position(3, 0))
        )
        assert nothing is None

        # Where it comes from, and where it is used.
        member = at(MAIN, "snow)")
        found = await editor.text_document_definition_async(lsp.DefinitionParams(document, member))
        assert isinstance(found, lsp.Location)
        assert found.uri == bricks
        assert cut(BRICKS, found.range) == "snow"
        context = lsp.ReferenceContext(include_declaration=False)
        places = await editor.text_document_references_async(
            lsp.ReferenceParams(context, document, at(MAIN, "n = 8"))
        )
        assert places is not None
        assert [place.range.start.line for place in places] == [2, 13]
        assert {cut(MAIN, place.range) for place in places} == {"n"}
        marked = await editor.text_document_document_highlight_async(
            lsp.DocumentHighlightParams(document, at(MAIN, "n = 8"))
        )
        assert marked is not None
        assert len(marked) == 3

        # Another name for it.
        prepared = await editor.text_document_prepare_rename_async(
            lsp.PrepareRenameParams(document, member)
        )
        assert isinstance(prepared, lsp.PrepareRenamePlaceholder)
        assert prepared.placeholder == "snow"
        edit = await editor.text_document_rename_async(lsp.RenameParams(document, member, "white"))
        assert edit is not None
        assert edit.document_changes is not None
        changed = [c for c in edit.document_changes if isinstance(c, lsp.TextDocumentEdit)]
        versions = {c.text_document.uri: c.text_document.version for c in changed}
        assert versions == {main: 1, bricks: None}
        with pytest.raises(JsonRpcException, match="another meaning"):
            await editor.text_document_rename_async(
                lsp.RenameParams(document, at(MAIN, "n = 8"), "step")
            )
        assert (
            await editor.text_document_prepare_rename_async(
                lsp.PrepareRenameParams(document, at(MAIN, "box"))
            )
            is None
        )

        # The document as a whole.
        outline = await editor.text_document_document_symbol_async(
            lsp.DocumentSymbolParams(document)
        )
        assert outline is not None
        tree = [s for s in outline if isinstance(s, lsp.DocumentSymbol)]
        assert [s.name for s in tree] == ["bricks", "n", "step", "ring"]
        assert [s.name for s in tree[3].children or ()] == ["block"]
        assert tree[3].kind == lsp.SymbolKind.Function
        folding = await editor.text_document_folding_range_async(lsp.FoldingRangeParams(document))
        assert folding is not None
        assert [(f.start_line, f.end_line) for f in folding] == [(5, 7), (8, 10)]
        hints = await editor.text_document_inlay_hint_async(
            lsp.InlayHintParams(document, lsp.Range(lsp.Position(0, 0), lsp.Position(99, 0)))
        )
        assert hints is not None
        assert [(h.position.line, h.label) for h in hints] == [(2, "= 45deg")]
        assert editor.refreshed > 0
        unchanged = await editor.text_document_formatting_async(
            lsp.DocumentFormattingParams(document, lsp.FormattingOptions(2, True))
        )
        assert unchanged is not None
        assert list(unchanged) == []

        # Typing: a fault behind characters of two code units, and its mending.
        editor.type(main, 2, (over(MAIN, "ring(count: n)"), "rng(count: n)"))
        editor.type(main, 3, (None, MAIN.replace("ring(count: n)", "ring(cout: n)")))
        [fault] = await editor.diagnostics(main, 3)
        assert fault.code == "name-unknown-parameter"
        assert fault.severity == lsp.DiagnosticSeverity.Error
        assert "did you mean `count`?" in fault.message
        text = MAIN.replace("ring(count: n)", "ring(cout: n)")
        assert cut(text, fault.range) == "cout"
        assert not [told for told in editor.told if told.version == 2]
        start = at(text, "cout")
        here = lsp.Range(start, lsp.Position(start.line, start.character + 4))
        editor.type(main, 4, (here, "coun"), (lsp.Range(
            lsp.Position(start.line, start.character + 4),
            lsp.Position(start.line, start.character + 4)), "t"))  # fmt: skip
        assert await editor.diagnostics(main, 4) == []

        # What could be typed.
        broken = MAIN + "/* 😀 */ ring(3)."
        editor.type(main, 5, (None, broken))
        end = lsp.Position(14, len("/* xx */ ring(3)."))
        offered = await editor.text_document_completion_async(lsp.CompletionParams(document, end))
        assert isinstance(offered, lsp.CompletionList)
        items = {item.label: item for item in offered.items}
        assert {"translate", "rotate_y", "material"} <= items.keys()
        turn = items["rotate_y"]
        assert turn.insert_text_format == lsp.InsertTextFormat.Snippet
        assert isinstance(turn.text_edit, lsp.TextEdit)
        assert turn.text_edit.new_text == "rotate_y(${1:angle})"
        assert turn.text_edit.range == lsp.Range(end, end)
        editor.type(main, 6, (None, MAIN + "/* 😀 */ sphere("))
        end = lsp.Position(14, len("/* xx */ sphere("))
        signature = await editor.text_document_signature_help_async(
            lsp.SignatureHelpParams(document, end)
        )
        assert signature is not None
        assert signature.signatures[0].label == "sphere(radius: 1) → an object"
        assert signature.active_parameter == 0
        [fault] = await editor.diagnostics(main, 6)
        assert str(fault.code).startswith("syntax-")
        # A program with faults of syntax stays as it is.
        assert (
            await editor.text_document_formatting_async(
                lsp.DocumentFormattingParams(document, lsp.FormattingOptions(2, True))
            )
            is None
        )

        # Another file: formatting, colours, and its faults in the file that uses it.
        editor.type(main, 7, (None, MAIN))
        messy = BRICKS.replace("let snow = ", "let  snow=") + "// 😀\n"
        editor.open(bricks, messy)
        other = lsp.TextDocumentIdentifier(bricks)
        [formatted] = (
            await editor.text_document_formatting_async(
                lsp.DocumentFormattingParams(other, lsp.FormattingOptions(2, True))
            )
            or []
        )
        assert (formatted.range.start.line, formatted.range.end.line) == (1, 2)
        assert formatted.new_text == "let snow = matte(color: #ffffff)\n"
        [color] = await editor.text_document_document_color_async(lsp.DocumentColorParams(other))
        assert cut(messy, color.range) == "#ffffff"
        assert (color.color.red, color.color.green, color.color.blue) == (1.0, 1.0, 1.0)
        written = await editor.text_document_color_presentation_async(
            lsp.ColorPresentationParams(other, lsp.Color(1.0, 0.0, 0.0, 1.0), color.range)
        )
        assert [each.label for each in written] == ["#ff0000", "rgb(1, 0, 0)"]
        assert await editor.diagnostics(main, 7) == []
        editor.told.clear()
        editor.type(bricks, 2, (None, messy.replace("#ffffff", "1")))
        [fault] = await editor.diagnostics(bricks, 2)
        assert fault.code == "type-mismatch"
        [fault] = await editor.diagnostics(main, 7)
        assert fault.code == "type-mismatch"
        assert cut(MAIN, fault.range) == '"bricks.ovo"'
        assert fault.related_information is not None
        assert fault.related_information[0].location.uri == bricks

        # Its text is the stored one again once it is closed.
        editor.told.clear()
        editor.text_document_did_close(lsp.DidCloseTextDocumentParams(other))
        editor.text_document_did_save(lsp.DidSaveTextDocumentParams(document))
        assert await editor.diagnostics(main, 7) == []
        assert [len(t.diagnostics) for t in editor.told if t.uri == bricks] == [0]
        (scenes / "bricks.ovo").write_text("let snow = metal(color: #ffffff, rough: 1)\n")
        editor.told.clear()
        event = lsp.FileEvent(bricks, lsp.FileChangeType.Changed)
        editor.workspace_did_change_watched_files(lsp.DidChangeWatchedFilesParams([event]))
        [fault] = await editor.diagnostics(main, 7)
        assert fault.code == "name-unknown-parameter"

    with_editor(session, scenes)


@pytest.mark.parametrize(
    ("encoding", "unit"),
    [
        (lsp.PositionEncodingKind.Utf8, "utf-8"),
        (lsp.PositionEncodingKind.Utf32, "utf-32-le"),
    ],
)
def test_positions_in_the_units_that_the_editor_prefers(
    scenes: Path, encoding: lsp.PositionEncodingKind, unit: str
) -> None:
    uri = "untitled:Untitled-1"
    text = "let höhe = 2\n/* 😀\u2028 */ box((höhe, höhe, höh))\n"

    async def session(editor: Editor) -> None:
        editor.open(uri, text)
        [fault] = await editor.diagnostics(uri, 1)
        assert fault.code == "name-unknown"
        assert fault.range.start == at(text, "höh))", unit=unit)
        editor.type(uri, 2, (fault.range, "höhe"))
        assert await editor.diagnostics(uri, 2) == []

    with_editor(session, scenes, [encoding])


def test_nothing_that_is_typed_ends_the_server(scenes: Path) -> None:
    uri = (scenes / "new.ovo").as_uri()
    document = lsp.TextDocumentIdentifier(uri)

    async def session(editor: Editor) -> None:
        editor.open(uri, "")
        texts = ["(" * 5000, "sphere()" + ".scale(2)" * 2000, "fn f() { f() }\nf()\nf().", "\ud7ff"]
        for version, text in enumerate(texts, 2):
            editor.type(uri, version, (None, text))
            await editor.text_document_completion_async(
                lsp.CompletionParams(document, lsp.Position(99, 99))
            )
            await editor.text_document_hover_async(lsp.HoverParams(document, lsp.Position(0, 3)))
            await editor.diagnostics(uri, version)
        editor.text_document_did_close(lsp.DidCloseTextDocumentParams(document))
        # A question about a document that is not open is an error, and not the end.
        with pytest.raises(JsonRpcException):
            await editor.text_document_hover_async(lsp.HoverParams(document, lsp.Position(0, 0)))
        editor.open(uri, "spher()")
        [fault] = await editor.diagnostics(uri, 1)
        assert fault.code == "name-unknown"

    with_editor(session, scenes)
