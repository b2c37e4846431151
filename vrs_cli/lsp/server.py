"""The language server: what `document.Document` knows, in the words of the Language Server Protocol 3.17.

Nothing about VAL-II is decided here. Lines and columns count from 1 in a `Span` and from 0 in the protocol, where a
character is as many units as the editor and pygls have agreed upon.
"""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any, Protocol

from lsprotocol import types as lsp
from pygls.exceptions import JsonRpcInvalidParams
from pygls.lsp.server import LanguageServer
from pygls.protocol import json_rpc

from vrs_cli.errors import VrsError
from vrs_cli.interfaces.inspection import Inspector
from vrs_cli.kinematics.model import RobotModel
from vrs_cli.lsp.document import Document, Symbol
from vrs_cli.lsp.occurrences import Colour, Modifier, SymbolKind
from vrs_cli.values.diagnostics import Diagnostic, Severity, Span
from vrs_cli.version import __version__

PAUSE = 0.05  # [s] without a keystroke before a text is checked: a burst of keys is checked once

_SEVERITIES: Mapping[Severity, lsp.DiagnosticSeverity] = {
    Severity.ERROR: lsp.DiagnosticSeverity.Error,
    Severity.WARNING: lsp.DiagnosticSeverity.Warning,
}
_SYMBOLS: Mapping[SymbolKind, lsp.SymbolKind] = {
    SymbolKind.PROGRAM: lsp.SymbolKind.Function,
    SymbolKind.SECTION: lsp.SymbolKind.Namespace,
    SymbolKind.LABEL: lsp.SymbolKind.Key,
    SymbolKind.VARIABLE: lsp.SymbolKind.Variable,
}


class InvalidRequest(JsonRpcInvalidParams):
    """A request that cannot be done; the editor shows the message."""


class Question(Protocol):
    """The parameters of whatever asks about a place."""

    text_document: lsp.TextDocumentIdentifier
    position: lsp.Position


class Val2Server(LanguageServer):
    """The open texts, each read once a version."""

    def __init__(self, model: RobotModel) -> None:
        super().__init__("vrs", __version__)
        self._model = model
        self._read: dict[str, Document] = {}
        self._inspectors: dict[str, Inspector] = {}
        self._waiting: dict[str, asyncio.TimerHandle] = {}
        logging.getLogger(json_rpc.__name__).addFilter(  # what is refused has been answered, and is no fault of ours
            lambda record: record.exc_info is None or not isinstance(record.exc_info[1], InvalidRequest)
        )
        for name, (feature, options) in _FEATURES.items():
            self.feature(name, options)(partial(feature, self))

    def document(self, uri: str) -> Document:
        """The text as it is now, or as it is on the disk where it is not open. Raises Refused."""
        try:
            source = self.workspace.get_text_document(uri).source
        except (OSError, UnicodeError) as error:
            raise InvalidRequest(f"{uri} is not open, and cannot be read: {error}") from None
        known = self._read.get(uri)
        if known is None or known.text != source:
            inspector = self._inspectors.setdefault(uri, Inspector(self._model))
            known = self._read[uri] = Document(source, self._model, inspector)
        return known

    # --- places ---

    def asked(self, params: Question) -> tuple[str, Document, tuple[int, int]]:
        """The text of a question as it is now, and the line and column, from 1, that it asks about."""
        uri = params.text_document.uri
        document = self.document(uri)
        codec = self.workspace.get_text_document(uri).position_codec
        found = codec.position_from_client_units([*document.lines, ""], params.position)
        return uri, document, (found.line + 1, found.character + 1)

    def range(self, uri: str, span: Span) -> lsp.Range:
        """A span in the editor's units."""
        return lsp.Range(self._position(uri, span.line, span.column), self._position(uri, span.line, span.end))

    def _position(self, uri: str, line: int, column: int) -> lsp.Position:
        lines = self.document(uri).lines
        text = lines[line - 1] if line <= len(lines) else ""
        codec = self.workspace.get_text_document(uri).position_codec
        return lsp.Position(line - 1, codec.client_num_units(text[: column - 1]))

    # --- diagnostics ---

    def check_soon(self, uri: str) -> None:
        """Check a text when the typing pauses."""
        self.forget(uri)
        self._waiting[uri] = asyncio.get_running_loop().call_later(PAUSE, self.check, uri)

    def check(self, uri: str) -> None:
        """Tell the editor all that is wrong with a text that it has open."""
        if uri not in self.workspace.text_documents:
            return
        document = self.workspace.get_text_document(uri)
        found = [self.diagnostic(uri, one) for one in self.document(uri).diagnostics]
        self.publish(uri, found, document.version)

    def diagnostic(self, uri: str, one: Diagnostic) -> lsp.Diagnostic:
        place, severity = self.range(uri, one.span), _SEVERITIES[one.severity]
        return lsp.Diagnostic(place, one.message, severity, code=one.code, source="vrs")

    def publish(self, uri: str, found: list[lsp.Diagnostic], version: int | None = None) -> None:
        """Replace what the editor shows for a text."""
        self.text_document_publish_diagnostics(lsp.PublishDiagnosticsParams(uri, found, version))

    def forget(self, uri: str) -> None:
        """No check that was to come."""
        waiting = self._waiting.pop(uri, None)
        if waiting is not None:
            waiting.cancel()

    def close(self, uri: str) -> None:
        """The editor has the text open no more."""
        self.forget(uri)
        self._read.pop(uri, None)
        self._inspectors.pop(uri, None)
        self.publish(uri, [])

    # --- symbols ---

    def symbol(self, uri: str, symbol: Symbol) -> lsp.DocumentSymbol:
        """A symbol with its children."""
        name, lines, last = self.range(uri, symbol.span), self.document(uri).lines, symbol.last
        end = self._position(uri, last, len(lines[last - 1]) + 1 if last <= len(lines) else 1)
        whole = lsp.Range(lsp.Position(symbol.span.line - 1, 0), end)
        children = [self.symbol(uri, child) for child in symbol.children]
        return lsp.DocumentSymbol(
            symbol.name, _SYMBOLS[symbol.kind], whole, name, symbol.detail or None, children=children
        )


# --- features --------------------------------------------------------------------------------------------------------


def _completion(server: Val2Server, params: lsp.CompletionParams) -> lsp.CompletionList:
    uri, document, (line, column) = server.asked(params)
    items = list[lsp.CompletionItem]()
    for one in document.completions(line, column):
        edit = lsp.TextEdit(server.range(uri, Span(line, column - one.length, column)), one.text)
        kind = lsp.CompletionItemKind.Keyword if one.text.isupper() else lsp.CompletionItemKind.Variable
        rank = f"{len(items):04}"
        items.append(lsp.CompletionItem(one.text, kind=kind, detail=one.meta or None, sort_text=rank, text_edit=edit))
    return lsp.CompletionList(False, items)


def _hover(server: Val2Server, params: lsp.HoverParams) -> lsp.Hover | None:
    uri, document, place = server.asked(params)
    found = document.hover(*place)
    if found is None:
        return None
    return lsp.Hover(lsp.MarkupContent(lsp.MarkupKind.Markdown, found[0]), server.range(uri, found[1]))


def _definition(server: Val2Server, params: lsp.DefinitionParams) -> lsp.Location | None:
    uri, document, place = server.asked(params)
    span = document.definition(*place)
    return None if span is None else lsp.Location(uri, server.range(uri, span))


def _formatting(server: Val2Server, params: lsp.DocumentFormattingParams) -> Sequence[lsp.TextEdit] | None:
    """One edit of the whole text; none where it is canonical already or cannot be read."""
    uri = params.text_document.uri
    document = server.document(uri)
    text = document.formatted()
    if text is None or text == document.text:
        return None
    end = lsp.Position(len(document.lines) + 1, 0)
    return [lsp.TextEdit(lsp.Range(lsp.Position(0, 0), end), text)]


def _symbols(server: Val2Server, params: lsp.DocumentSymbolParams) -> Sequence[lsp.DocumentSymbol]:
    uri = params.text_document.uri
    return [server.symbol(uri, one) for one in server.document(uri).symbols]


def _references(server: Val2Server, params: lsp.ReferenceParams) -> Sequence[lsp.Location]:
    uri, document, place = server.asked(params)
    defined = None if params.context.include_declaration else document.definition(*place)
    taken = None if defined is None else (defined.line, defined.column)
    spans = (span for span in document.references(*place) if (span.line, span.column) != taken)
    return [lsp.Location(uri, server.range(uri, span)) for span in spans]


def _prepare_rename(server: Val2Server, params: lsp.PrepareRenameParams) -> lsp.Range | None:
    uri, document, place = server.asked(params)
    found = document.occurrence(*place)
    return None if found is None else server.range(uri, found.span)


def _rename(server: Val2Server, params: lsp.RenameParams) -> lsp.WorkspaceEdit:
    """Raises Refused for a name that cannot be taken."""
    uri, document, place = server.asked(params)
    try:
        name, spans = document.renamed(*place, params.new_name)
    except VrsError as refused:
        raise InvalidRequest(str(refused)) from None
    return lsp.WorkspaceEdit({uri: [lsp.TextEdit(server.range(uri, span), name) for span in spans]})


def _folding(server: Val2Server, params: lsp.FoldingRangeParams) -> Sequence[lsp.FoldingRange]:
    folds = server.document(params.text_document.uri).folds
    return [lsp.FoldingRange(first - 1, last - 1) for first, last in folds]


def _signature(server: Val2Server, params: lsp.SignatureHelpParams) -> lsp.SignatureHelp | None:
    _, document, place = server.asked(params)
    found = document.signature(*place)
    if found is None:
        return None
    parameters = [lsp.ParameterInformation(place) for place in found.arguments]
    shown = lsp.SignatureInformation(found.form, found.summary, parameters)
    return lsp.SignatureHelp([shown], active_signature=0, active_parameter=found.active)


def _actions(server: Val2Server, params: lsp.CodeActionParams) -> Sequence[lsp.CodeAction]:
    """What mends the findings of these lines; and all that is sure in the whole text, in one action."""
    uri, document = params.text_document.uri, server.document(params.text_document.uri)
    wanted, lines = params.context.only, range(params.range.start.line + 1, params.range.end.line + 2)
    found = []
    for mend in document.mends:
        if mend.span.line in lines and _is_wanted(lsp.CodeActionKind.QuickFix, wanted):
            edit = lsp.TextEdit(server.range(uri, mend.span), mend.text)
            told = [server.diagnostic(uri, mend.finding)]
            found.append(_action(uri, f"Write {mend.text}", lsp.CodeActionKind.QuickFix, [edit], told, mend.sure))
    sure = [lsp.TextEdit(server.range(uri, one.span), one.text) for one in document.mends if one.sure]
    if sure and _is_wanted(lsp.CodeActionKind.SourceFixAll, wanted):
        found.append(_action(uri, "Mend all that is sure", lsp.CodeActionKind.SourceFixAll, sure, [], True))
    return found


def _is_wanted(kind: lsp.CodeActionKind, wanted: Sequence[lsp.CodeActionKind | str] | None) -> bool:
    """Editors ask for kinds, and for those above them: source, and source.fixAll."""
    asked = [one.value if isinstance(one, lsp.CodeActionKind) else one for one in wanted or ()]
    return wanted is None or any(kind.value == one or kind.value.startswith(f"{one}.") for one in asked)


def _action(
    uri: str,
    title: str,
    kind: lsp.CodeActionKind,
    edits: list[lsp.TextEdit],
    mended: list[lsp.Diagnostic],
    preferred: bool,
) -> lsp.CodeAction:
    return lsp.CodeAction(title, kind, mended, is_preferred=preferred, edit=lsp.WorkspaceEdit({uri: edits}))


LEGEND = lsp.SemanticTokensLegend([one.value for one in Colour], [one.value for one in Modifier])


def _colours(server: Val2Server, params: lsp.SemanticTokensParams) -> lsp.SemanticTokens:
    """Five numbers a piece: its line and its column from those of the one before, length, kind, modifiers as bits."""
    uri = params.text_document.uri
    kinds, modifiers = ({one: place for place, one in enumerate(of)} for of in (Colour, Modifier))
    data, line, column = list[int](), 0, 0
    for piece in server.document(uri).colours:
        place = server.range(uri, Span(piece.line, piece.column, piece.column + piece.length))
        begin, bits = place.start, 0 if piece.modifier is None else 1 << modifiers[piece.modifier]
        if begin.line != line:
            column = 0
        data += (begin.line - line, begin.character - column, place.end.character - begin.character)
        data += (kinds[piece.colour], bits)
        line, column = begin.line, begin.character
    return lsp.SemanticTokens(data)


_FEATURES: Mapping[str, tuple[Callable[[Val2Server, Any], Any], Any]] = {  # each with its options
    lsp.TEXT_DOCUMENT_DID_OPEN: (lambda server, params: server.check(params.text_document.uri), None),
    lsp.TEXT_DOCUMENT_DID_CHANGE: (lambda server, params: server.check_soon(params.text_document.uri), None),
    lsp.TEXT_DOCUMENT_DID_CLOSE: (lambda server, params: server.close(params.text_document.uri), None),
    lsp.TEXT_DOCUMENT_HOVER: (_hover, None),
    lsp.TEXT_DOCUMENT_DEFINITION: (_definition, None),
    lsp.TEXT_DOCUMENT_FORMATTING: (_formatting, None),
    lsp.TEXT_DOCUMENT_DOCUMENT_SYMBOL: (_symbols, None),
    lsp.TEXT_DOCUMENT_REFERENCES: (_references, None),
    lsp.TEXT_DOCUMENT_PREPARE_RENAME: (_prepare_rename, None),
    lsp.TEXT_DOCUMENT_RENAME: (_rename, lsp.RenameOptions(prepare_provider=True)),
    lsp.TEXT_DOCUMENT_FOLDING_RANGE: (_folding, None),
    lsp.TEXT_DOCUMENT_COMPLETION: (_completion, lsp.CompletionOptions(trigger_characters=[" ", ".", "$", "#"])),
    lsp.TEXT_DOCUMENT_CODE_ACTION: (
        _actions,
        lsp.CodeActionOptions([lsp.CodeActionKind.QuickFix, lsp.CodeActionKind.SourceFixAll]),
    ),
    lsp.TEXT_DOCUMENT_SEMANTIC_TOKENS_FULL: (_colours, LEGEND),
    lsp.TEXT_DOCUMENT_SIGNATURE_HELP: (_signature, lsp.SignatureHelpOptions([" ", ",", "("])),
}
