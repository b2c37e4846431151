"""Serve the Language Server Protocol 3.17. The server converts messages; all knowledge of VAL-II is in `document` and
`workspace`.

Lines and columns count from 1 in a `Span`, but from 0 in the protocol. The protocol's columns count units of a text
encoding (such as UTF-16) on which the editor and pygls have agreed.
"""

from __future__ import annotations

import asyncio
import logging
import os
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from functools import partial
from itertools import islice
from pathlib import Path
from typing import Any, NamedTuple, Protocol, cast

from lsprotocol import types as lsp
from pygls import exceptions, uris, workspace
from pygls.lsp.server import LanguageServer
from pygls.protocol import LanguageServerProtocol, json_rpc

from vrs_cli.errors import FileError, VrsError
from vrs_cli.files import opening, program_file
from vrs_cli.kinematics.model import RobotModel
from vrs_cli.lsp.document import Colour, Document, Modifier, Symbol, SymbolKind
from vrs_cli.lsp.workspace import FileSpan, Workspace
from vrs_cli.values.diagnostics import Diagnostic, Severity, Span
from vrs_cli.version import __version__

MAX_FILES = 2000  # read at most this many program files of a workspace
PAUSE = 0.05  # [s] check a file this long after the last keystroke, so that fast typing causes only one check

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


class InvalidRequest(exceptions.JsonRpcInvalidParams):
    """Raised for a request that cannot be carried out. The editor shows the message to the user."""


class Question(Protocol):
    """The parameters of a request about a position in a file."""

    text_document: lsp.TextDocumentIdentifier
    position: lsp.Position


class UnreadMessage(NamedTuple):
    """A message from the editor that cannot be decoded. `number`: the id of the request, None if unknown; `error`: the
    answer, with the reason."""

    number: int | str | None
    error: lsp.ResponseError
    jsonrpc: str = "2.0"


class AnsweringProtocol(LanguageServerProtocol):
    """A protocol that sends an error in answer to malformed requests, and to requests before `initialize` or after
    `shutdown`."""

    def structure_message(self, data: dict[str, Any]) -> Any:
        try:
            return super().structure_message(data)
        except exceptions.JsonRpcException as wrong:
            if "method" in data and "id" in data:
                number = data["id"] if isinstance(data["id"], int | str) else None
                return UnreadMessage(number, exceptions.JsonRpcInvalidParams.of(wrong).to_response_error())
            raise

    def handle_message(self, message: Any) -> None:
        """Handle a message: refuse it if it is malformed or not allowed now, otherwise let pygls handle it."""
        number, method = getattr(message, "id", None), getattr(message, "method", None)
        if isinstance(message, UnreadMessage):
            self.refuse(message.number, message.error)
        elif not hasattr(message, "jsonrpc"):
            self.refuse(
                None, exceptions.JsonRpcInvalidRequest("a message is an object with jsonrpc").to_response_error()
            )
        elif method is not None and number is not None and self._shutdown:
            self.refuse(number, exceptions.JsonRpcInvalidRequest("the server is shut down").to_response_error())
        elif method not in (None, lsp.INITIALIZE, lsp.EXIT) and self._workspace is None:
            if number is not None:
                self.refuse(
                    number, exceptions.JsonRpcServerNotInitialized("initialize comes first").to_response_error()
                )
        else:
            super().handle_message(message)

    def refuse(self, number: int | str | None, error: lsp.ResponseError) -> None:
        self._send_data(lsp.ResponseErrorMessage(number, error))


class Val2Server(LanguageServer):
    """The language server. It parses each version of a file only once. The contents of open files come from the editor;
    all other files are read from the disk. `model`: the robot for which locations are checked."""

    def __init__(self, model: RobotModel) -> None:
        super().__init__("vrs", __version__, protocol_cls=AnsweringProtocol)
        self.files = Workspace(model)
        self._on_disk: dict[str, str] = {}
        self._stamps: dict[str, tuple[object, str]] = {}  # by path of a file: its stamp (time and size) and its text
        self._waiting: dict[str, asyncio.TimerHandle] = {}
        # do not log refused requests, because they have been answered and are not errors of the server
        logging.getLogger(json_rpc.__name__).addFilter(
            lambda record: record.exc_info is None or not isinstance(record.exc_info[1], InvalidRequest)
        )
        for name, (feature, options) in _FEATURES.items():
            self.feature(name, options)(partial(feature, self))

    def document(self, uri: str) -> Document:
        """Return the document at an address: with the editor's text if it is open there, otherwise with the text of the
        file. Raises InvalidRequest if the file cannot be read."""
        texts = self.texts()
        if uri not in texts:
            try:
                texts[uri] = self.workspace.get_text_document(uri).source
            except (OSError, UnicodeError) as error:
                raise InvalidRequest(f"{uri} is not open, and cannot be read: {error}") from None
        self.files.take(texts)
        return self.files.document(uri)

    def texts(self) -> dict[str, str]:
        """Return the current contents of all known files, by address. The contents of open files come from the
        editor."""
        return self._on_disk | {one: document.source for one, document in self.open_texts.items()}

    @property
    def open_texts(self) -> dict[str, workspace.TextDocument]:
        """Return the contents of the files that are open in the editor, by address."""
        return {document.uri: document for document in self.workspace.text_documents.values()}

    def look(self) -> None:
        """Update the contents of program files that are not open: files in the workspace, and files in the folders of
        open files. Only files that have changed on the disk are read again."""
        opened = {uris.to_fs_path(uri): uri for uri in self.open_texts}
        roots = [uris.to_fs_path(uri) for uri in self.workspace.folders] or [self.workspace.root_path]
        found = {path: uri for path, uri in opened.items() if path}
        for path in islice(_program_files(filter(None, roots), found), MAX_FILES):
            found.setdefault(path, uris.from_fs_path(path) or path)
        texts = ((uri, self._text(path)) for path, uri in found.items() if uri not in self.open_texts)
        self._on_disk = {uri: text for uri, text in texts if text is not None}

    def _text(self, path: str) -> str | None:
        """Return the text of a file; None if it cannot be read."""
        stamped = opening.stamp(Path(path))
        known = self._stamps.get(path)
        if known is None or known[0] != stamped:
            try:
                known = self._stamps[path] = stamped, program_file.read_program_file(path)
            except FileError:
                return None
        return known[1]

    # --- positions ---

    def locate(self, params: Question) -> tuple[str, Document, tuple[int, int]]:
        """Return the address of the file that a request names, its document, and the line and column of the request's
        position, counted from 1."""
        uri = params.text_document.uri
        document = self.document(uri)
        found = self.workspace.position_codec.position_from_client_units([*document.lines, ""], params.position)
        return uri, document, (found.line + 1, found.character + 1)

    def range(self, uri: str, span: Span) -> lsp.Range:
        """Convert a span in the text at an address to a range in the units of the protocol."""
        return lsp.Range(self._position(uri, span.line, span.column), self._position(uri, span.line, span.end))

    def _position(self, uri: str, line: int, column: int) -> lsp.Position:
        lines = self.document(uri).lines
        text = lines[line - 1] if line <= len(lines) else ""
        return lsp.Position(line - 1, self.workspace.position_codec.client_num_units(text[: column - 1]))

    # --- diagnostics ---

    def check_soon(self, uri: str) -> None:
        """Schedule a check of a file for when the user has not typed for PAUSE seconds."""
        self.forget(uri)
        self._waiting[uri] = asyncio.get_running_loop().call_later(PAUSE, self.check, uri)

    def check(self, uri: str) -> None:
        """Check an open text, and send its mistakes to the editor; also those of the other open files in its name
        space."""
        if uri not in self.open_texts:
            return
        self.document(uri)
        for one in self.files.project(uri):
            if one in self.open_texts:  # the change may also affect the mistakes of other files in the name space
                found = [self.diagnostic(one, wrong) for wrong in self.files.diagnostics(one)]
                self.publish(one, found, self.open_texts[one].version)

    def on_open(self, uri: str) -> None:
        self.look()
        self.check(uri)

    def diagnostic(self, uri: str, one: Diagnostic) -> lsp.Diagnostic:
        place, severity = self.range(uri, one.span), _SEVERITIES[one.severity]
        return lsp.Diagnostic(place, one.message, severity, code=one.code, source="vrs")

    def publish(self, uri: str, found: list[lsp.Diagnostic], version: int | None = None) -> None:
        """Send the diagnostics of a file to the editor; they replace the earlier ones."""
        self.text_document_publish_diagnostics(lsp.PublishDiagnosticsParams(uri, found, version))

    def forget(self, uri: str) -> None:
        """Cancel the scheduled check of a file, if there is one."""
        if (waiting := self._waiting.pop(uri, None)) is not None:
            waiting.cancel()

    def close(self, uri: str) -> None:
        """Handle the closing of a file in the editor: cancel its check, read its file, and remove its diagnostics."""
        self.forget(uri)
        self.look()
        self.publish(uri, [])

    def report_server_error(self, error: Exception, source: Any) -> None:
        """Handle an error in the server: answer a message that was not JSON; show any other error in the editor, unless
        the request was already answered."""
        if isinstance(error, ValueError):
            refusal = exceptions.JsonRpcParseError(str(error)).to_response_error()
            cast(AnsweringProtocol, self.protocol).refuse(None, refusal)
        elif not isinstance(error, exceptions.JsonRpcException):
            super().report_server_error(error, source)

    def location(self, place: FileSpan) -> lsp.Location:
        """Convert a span with an address to a location in the units of the protocol."""
        return lsp.Location(place.uri, self.range(place.uri, place.span))

    # --- symbols ---

    def symbol(self, uri: str, symbol: Symbol) -> lsp.DocumentSymbol:
        name, lines, last = self.range(uri, symbol.span), self.document(uri).lines, symbol.last
        end = self._position(uri, last, len(lines[last - 1]) + 1 if last <= len(lines) else 1)
        whole = lsp.Range(lsp.Position(symbol.span.line - 1, 0), end)
        children = [self.symbol(uri, child) for child in symbol.children]
        return lsp.DocumentSymbol(
            symbol.name, _SYMBOLS[symbol.kind], whole, name, symbol.detail or None, children=children
        )


def _program_files(roots: Iterable[str], opened: Iterable[str]) -> Iterator[str]:
    """Yield the paths of the program files in the folders of the open files, then in the folders `roots` and all their
    subfolders, without hidden files."""
    for folder in sorted({os.path.dirname(path) for path in opened}):
        with suppress(OSError):
            yield from (os.path.join(folder, name) for name in sorted(os.listdir(folder)) if _is_program(name))
    for root in roots:
        for here, folders, names in os.walk(root):
            folders[:] = sorted(name for name in folders if not name.startswith(".") and name != "node_modules")
            yield from (os.path.join(here, name) for name in sorted(names) if _is_program(name))


def _is_program(name: str) -> bool:
    return name.lower().endswith(program_file.PROGRAM_SUFFIXES) and not name.startswith(".")


# --- features: one function answers each kind of request -------------------------------------------------------------


def _completion(server: Val2Server, params: lsp.CompletionParams) -> lsp.CompletionList:
    uri, document, (line, column) = server.locate(params)
    items = [
        lsp.CompletionItem(
            one.text,
            kind=lsp.CompletionItemKind.Keyword if one.text.isupper() else lsp.CompletionItemKind.Variable,
            detail=one.meta or None,
            sort_text=f"{rank:04}",
            text_edit=lsp.TextEdit(server.range(uri, Span(line, column - one.length, column)), one.text),
        )
        for rank, one in enumerate(document.completions(line, column, *server.files.near(uri)))
    ]
    return lsp.CompletionList(False, items)


def _hover(server: Val2Server, params: lsp.HoverParams) -> lsp.Hover | None:
    uri, document, place = server.locate(params)
    found = document.hover(*place, *server.files.near(uri))
    return (
        None
        if found is None
        else lsp.Hover(lsp.MarkupContent(lsp.MarkupKind.Markdown, found[0]), server.range(uri, found[1]))
    )


def _definition(server: Val2Server, params: lsp.DefinitionParams) -> lsp.Location | None:
    uri, _, place = server.locate(params)
    found = server.files.definition(uri, *place)
    return None if found is None else server.location(found)


def _formatting(server: Val2Server, params: lsp.DocumentFormattingParams) -> Sequence[lsp.TextEdit] | None:
    """Return one edit that formats the whole file; None if the file is already formatted, or has mistakes that prevent
    formatting."""
    document = server.document(params.text_document.uri)
    text = document.canonical()
    if text is None or text == document.text:
        return None
    end = lsp.Position(len(document.lines) + 1, 0)
    return [lsp.TextEdit(lsp.Range(lsp.Position(0, 0), end), text)]


def _symbols(server: Val2Server, params: lsp.DocumentSymbolParams) -> Sequence[lsp.DocumentSymbol]:
    uri = params.text_document.uri
    return [server.symbol(uri, one) for one in server.document(uri).symbols]


def _references(server: Val2Server, params: lsp.ReferenceParams) -> Sequence[lsp.Location]:
    server.look()
    uri, _, place = server.locate(params)
    defined = None if params.context.include_declaration else server.files.definition(uri, *place)
    taken = None if defined is None else (defined.uri, defined.span.line, defined.span.column)
    found = server.files.references(uri, *place)
    return [server.location(one) for one in found if (one.uri, one.span.line, one.span.column) != taken]


def _highlights(server: Val2Server, params: lsp.DocumentHighlightParams) -> Sequence[lsp.DocumentHighlight]:
    uri, document, place = server.locate(params)
    return [lsp.DocumentHighlight(server.range(uri, span)) for span in document.references(*place)]


def _workspace_symbols(server: Val2Server, params: lsp.WorkspaceSymbolParams) -> Sequence[lsp.WorkspaceSymbol]:
    server.look()
    server.files.take(server.texts())
    return [
        lsp.WorkspaceSymbol(
            server.location(FileSpan(uri, one.span)), one.name, _SYMBOLS[one.kind], container_name=holder or None
        )
        for uri, one, holder in server.files.symbols(params.query)
    ]


def _prepare_rename(server: Val2Server, params: lsp.PrepareRenameParams) -> lsp.Range | None:
    uri, document, place = server.locate(params)
    found = document.occurrence(*place)
    return None if found is None else server.range(uri, found.span)


def _rename(server: Val2Server, params: lsp.RenameParams) -> lsp.WorkspaceEdit:
    """Return the edits in all files that rename the name at a position. Raises InvalidRequest if the new name cannot be
    used."""
    server.look()
    uri, _, place = server.locate(params)
    try:
        name, found = server.files.rename(uri, *place, params.new_name)
    except VrsError as refused:
        raise InvalidRequest(str(refused)) from None
    return lsp.WorkspaceEdit(
        {one: [lsp.TextEdit(server.range(one, span), name) for span in spans] for one, spans in found.items()}
    )


def _folding(server: Val2Server, params: lsp.FoldingRangeParams) -> Sequence[lsp.FoldingRange]:
    folds = server.document(params.text_document.uri).folds
    return [lsp.FoldingRange(first - 1, last - 1) for first, last in folds]


def _signature(server: Val2Server, params: lsp.SignatureHelpParams) -> lsp.SignatureHelp | None:
    uri, document, place = server.locate(params)
    if (found := document.signature(*place, server.files.near(uri)[1])) is None:
        return None
    parameters = [lsp.ParameterInformation(place) for place in found.arguments]
    shown = lsp.SignatureInformation(found.form, found.summary, parameters)
    return lsp.SignatureHelp([shown], active_signature=0, active_parameter=found.active)


def _actions(server: Val2Server, params: lsp.CodeActionParams) -> Sequence[lsp.CodeAction]:
    """Return an action for each correction of a mistake in the requested lines, and one action that makes all certain
    corrections in the file."""
    uri, document = params.text_document.uri, server.document(params.text_document.uri)
    wanted, lines = params.context.only, range(params.range.start.line + 1, params.range.end.line + 2)
    found = [
        _action(
            uri,
            f"Write {mend.text}",
            lsp.CodeActionKind.QuickFix,
            [lsp.TextEdit(server.range(uri, mend.span), mend.text)],
            [server.diagnostic(uri, mend.finding)],
            mend.sure,
        )
        for mend in document.mends
        if mend.span.line in lines and _is_wanted(lsp.CodeActionKind.QuickFix, wanted)
    ]
    sure = [lsp.TextEdit(server.range(uri, one.span), one.text) for one in document.mends if one.sure]
    if sure and _is_wanted(lsp.CodeActionKind.SourceFixAll, wanted):
        found.append(_action(uri, "Mend all that is sure", lsp.CodeActionKind.SourceFixAll, sure, [], True))
    return found


def _is_wanted(kind: lsp.CodeActionKind, wanted: Sequence[lsp.CodeActionKind | str] | None) -> bool:
    """Return whether the editor asks for actions of this kind, directly or by a more general kind (`source` includes
    `source.fixAll`). `wanted`: the kinds that it asks for; None: all."""
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
    """Return the colours of a file as semantic tokens: five numbers for each piece, which are its line and column
    relative to the previous piece, its length, its kind, and its modifiers as bits."""
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


# by method of the protocol: the function that handles it, and the options that the server announces for it
_FEATURES: Mapping[str, tuple[Callable[[Val2Server, Any], Any], Any]] = {
    lsp.TEXT_DOCUMENT_DID_OPEN: (lambda server, params: server.on_open(params.text_document.uri), None),
    lsp.TEXT_DOCUMENT_DID_SAVE: (lambda server, params: server.on_open(params.text_document.uri), None),
    lsp.WORKSPACE_DID_CHANGE_WATCHED_FILES: (lambda server, _params: server.look(), None),
    lsp.TEXT_DOCUMENT_DID_CHANGE: (lambda server, params: server.check_soon(params.text_document.uri), None),
    lsp.TEXT_DOCUMENT_DID_CLOSE: (lambda server, params: server.close(params.text_document.uri), None),
    lsp.TEXT_DOCUMENT_HOVER: (_hover, None),
    lsp.TEXT_DOCUMENT_DEFINITION: (_definition, None),
    lsp.TEXT_DOCUMENT_FORMATTING: (_formatting, None),
    lsp.TEXT_DOCUMENT_DOCUMENT_SYMBOL: (_symbols, None),
    lsp.TEXT_DOCUMENT_REFERENCES: (_references, None),
    lsp.TEXT_DOCUMENT_DOCUMENT_HIGHLIGHT: (_highlights, None),
    lsp.WORKSPACE_SYMBOL: (_workspace_symbols, None),
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
