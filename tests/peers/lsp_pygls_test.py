#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""pygls is the client of `hal lsp`: lsp_pygls_test.py PROGRAM. Each answer is read by the types of lsprotocol, so that a member of a
wrong type or a missing one fails."""

import asyncio
import sys
import tempfile
from pathlib import Path

from checks import check, checked

sys.path.insert(0, str(Path(__file__).resolve().parent))
from peers import package  # noqa: E402

package("pygls", "lsprotocol")
from lsprotocol import types as lsp  # noqa: E402
from pygls.lsp.client import LanguageClient  # noqa: E402

HAL = sys.argv[1]
NETLIST = """newthread servo 1ms
loadrt sum2 names=adder
addf adder servo
net total adder.out  # 𝛼
setp adder.ino 1
"""


class Client(LanguageClient):
    def __init__(self):
        super().__init__("halcyon-test", "1")
        self.diagnostics = asyncio.Queue()
        self.errors = []

        @self.feature(lsp.TEXT_DOCUMENT_PUBLISH_DIAGNOSTICS)
        def published(params):
            self.diagnostics.put_nowait(params)

    def report_server_error(self, error, source):
        self.errors.append(error)


async def newest(client, version):
    """The diagnostics of a version."""
    while True:
        params = await asyncio.wait_for(client.diagnostics.get(), 120)
        if params.version == version:
            return params.diagnostics


async def session(folder):
    client = Client()
    await client.start_io(HAL, "lsp")
    answer = await client.initialize_async(
        lsp.InitializeParams(capabilities=lsp.ClientCapabilities(), root_uri=folder.as_uri())
    )
    capabilities = answer.capabilities
    check("UTF-16 positions", capabilities.position_encoding == lsp.PositionEncodingKind.Utf16)
    sync = capabilities.text_document_sync
    check("incremental changes", sync.change == lsp.TextDocumentSyncKind.Incremental)
    client.initialized(lsp.InitializedParams())

    uri = (folder / "m.hal").as_uri()
    document = lsp.TextDocumentIdentifier(uri)
    client.text_document_did_open(
        lsp.DidOpenTextDocumentParams(lsp.TextDocumentItem(uri, "halcyon", 1, NETLIST))
    )
    found = await newest(client, 1)
    check("one error", [one.code for one in found] == ["no-such-pin"], found)
    error = found[0]
    check("its severity", error.severity == lsp.DiagnosticSeverity.Error)
    check("its span", error.range == lsp.Range(lsp.Position(4, 5), lsp.Position(4, 14)), error)

    def at(line, character):
        return {"text_document": document, "position": lsp.Position(line, character)}

    actions = await client.text_document_code_action_async(
        lsp.CodeActionParams(document, error.range, lsp.CodeActionContext([error]))
    )
    fix = actions[0].edit.changes[uri][0]
    check("a quick fix", actions[0].kind == lsp.CodeActionKind.QuickFix, actions)
    check("it names a pin", fix.new_text == "adder.in0", fix)
    client.text_document_did_change(
        lsp.DidChangeTextDocumentParams(
            lsp.VersionedTextDocumentIdentifier(2, uri),
            [lsp.TextDocumentContentChangePartial(fix.range, fix.new_text)],
        )
    )
    check("the fix removes the error", list(await newest(client, 2)) == [])

    completion = await client.text_document_completion_async(lsp.CompletionParams(**at(4, 12)))
    labels = [one.label for one in completion.items]
    check("completion", "adder.in1" in labels, labels)
    hover = await client.text_document_hover_async(lsp.HoverParams(**at(4, 11)))
    check(
        "hover", hover.contents.kind == lsp.MarkupKind.Markdown and "float" in hover.contents.value
    )
    made = await client.text_document_definition_async(lsp.DefinitionParams(**at(3, 12)))
    check("definition", made[0].range.start == lsp.Position(1, 18), made)
    context = lsp.ReferenceContext(include_declaration=True)
    uses = await client.text_document_references_async(
        lsp.ReferenceParams(context=context, **at(3, 12))
    )
    check("references", sorted(one.range.start.line for one in uses) == [1, 2, 3, 4], uses)
    marks = await client.text_document_document_highlight_async(
        lsp.DocumentHighlightParams(**at(3, 5))
    )
    check("highlights", len(marks) == 1, marks)
    symbols = await client.text_document_document_symbol_async(lsp.DocumentSymbolParams(document))
    check("the outline", {one.name for one in symbols} == {"adder", "servo", "total"}, symbols)
    check("its types", all(isinstance(one, lsp.DocumentSymbol) for one in symbols))
    name = await client.text_document_prepare_rename_async(lsp.PrepareRenameParams(**at(3, 12)))
    check("prepare rename", name.placeholder == "adder", name)
    edit = await client.text_document_rename_async(lsp.RenameParams(new_name="sum", **at(3, 12)))
    check("rename", len(edit.changes[uri]) == 4, edit)
    tokens = await client.text_document_semantic_tokens_full_async(
        lsp.SemanticTokensParams(document)
    )
    legend = capabilities.semantic_tokens_provider.legend.token_types
    check("semantic tokens", len(tokens.data) % 5 == 0 and len(tokens.data) > 50, tokens)
    check("they are in the legend", max(tokens.data[3::5]) < len(legend))
    edits = await client.text_document_formatting_async(
        lsp.DocumentFormattingParams(document, lsp.FormattingOptions(4, True))
    )
    check("format", len(edits) <= 1, edits)
    whole = lsp.Range(lsp.Position(0, 0), lsp.Position(9, 0))
    hints = await client.text_document_inlay_hint_async(lsp.InlayHintParams(document, whole))
    check("no values without a machine", not hints, hints)
    result = await client.workspace_execute_command_async(
        lsp.ExecuteCommandParams("halcyon.apply", [uri])
    )
    check("nothing is sent without a machine", result["applied"] is False, result)

    client.text_document_did_close(lsp.DidCloseTextDocumentParams(document))
    await client.shutdown_async(None)
    client.exit(None)
    await asyncio.wait_for(client._server.wait(), 120)
    check("the exit status", client._server.returncode == 0)
    check("pygls has read each message", not client.errors, client.errors)
    await client.stop()


with tempfile.TemporaryDirectory() as temporary:
    (Path(temporary) / "m.hal").write_text(NETLIST)
    asyncio.run(session(Path(temporary)))
sys.exit(checked())
