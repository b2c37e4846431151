"""Test `vrs tools lsp` as an editor starts it: a process with messages on its stdin and stdout."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryFile
from threading import Timer
from typing import Any

import pytest

from tests.live import PATIENCE

pytest.importorskip("pygls")

ROOT = Path(__file__).parents[2]
URI = "file:///home/demo.v2"
TEXT = """\
.PROGRAM demo
  n = 1
  TYPE "\N{GRINNING FACE} é", n
  move part
10 CALL pick(part)
  GOTO 10
  MOVEE part
.END
.PROGRAM pick(a)
  DEPART 50
.END
"""
MENDED = {"range": {"start": {"line": 6, "character": 2}, "end": {"line": 6, "character": 7}}, "text": "MOVES"}
OPTIONS = {"tabSize": 4, "insertSpaces": True}
CAPABILITIES = {"textDocument": {"rename": {"prepareSupport": True}}}


class Editor:
    """The client's half of the protocol, as far as the tests need it."""

    def __init__(self, root: str | None = None, *, begins: bool = True) -> None:
        environment = os.environ | {"PYTHONPATH": str(ROOT)}
        command = [sys.executable, "-m", "vrs_cli", "tools", "lsp", "--stdio"]
        self.log = TemporaryFile()  # noqa: SIM115 (closed with the editor)
        self.process = subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=self.log, env=environment
        )
        self.notified: list[dict[str, Any]] = []
        self._number, self._root = 0, root
        if begins:
            self.begin()

    def begin(self) -> None:
        """Say hello."""
        said = self.ask("initialize", processId=None, rootUri=self._root, capabilities=CAPABILITIES)
        self.able: dict[str, Any] = said["capabilities"]
        self.name: str = said["serverInfo"]["name"]
        self.tell("initialized")

    def ask(self, method: str, **params: Any) -> Any:
        """Send a request and return its result."""
        answer = self._answer(method, params)
        assert "error" not in answer, answer
        return answer["result"]

    def refused(self, method: str, **params: Any) -> str:
        """Send a request that is refused, and return the message."""
        message: str = self._answer(method, params)["error"]["message"]
        return message

    def code(self, method: str, params: Any) -> int:
        """Return the code of the error that answers a request."""
        error = self._answer(method, params)["error"]
        code: int = error["code"]
        return code

    def next(self) -> dict[str, Any]:
        """Return the next message that is no notification."""
        while "method" in (message := self._receive()):
            self.notified.append(message)
        return message

    def _answer(self, method: str, params: Any) -> dict[str, Any]:
        self._number += 1
        self._send({"id": self._number, "method": method, "params": params or None})
        while True:
            message = self._receive()
            if message.get("id") == self._number and "method" not in message:
                return message
            self.notified.append(message)

    def tell(self, method: str, **params: Any) -> None:
        """Send a notification."""
        self._send({"method": method, "params": params or None})

    def diagnostics(self, version: int) -> list[dict[str, Any]]:
        """Return the diagnostics of a version of the text."""
        while True:
            message = self.notified.pop(0) if self.notified else self._receive()
            params = message.get("params") or {}
            if message.get("method") == "textDocument/publishDiagnostics" and params.get("version") == version:
                found: list[dict[str, Any]] = params["diagnostics"]
                return found

    def end(self) -> int:
        """End the session and return the exit status."""
        self.ask("shutdown")
        self.tell("exit")
        status = self.process.wait(PATIENCE)
        self.close()
        return status

    def close(self) -> None:
        self.process.kill()
        self.process.communicate()
        self.log.close()

    def logged(self) -> str:
        """Return the server's stderr."""
        self.log.seek(0)
        return self.log.read().decode()

    def _send(self, message: dict[str, Any]) -> None:
        self.send_raw(json.dumps({"jsonrpc": "2.0", **message}).encode())

    def send_raw(self, body: bytes) -> None:
        """Send a message unchanged."""
        assert self.process.stdin is not None
        self.process.stdin.write(b"Content-Length: %d\r\n\r\n%s" % (len(body), body))
        self.process.stdin.flush()

    def _receive(self) -> dict[str, Any]:
        impatient = Timer(PATIENCE, self.process.kill)
        impatient.start()
        try:
            return self._message()
        finally:
            impatient.cancel()

    def _message(self) -> dict[str, Any]:
        assert self.process.stdout is not None
        length = 0
        while line := self.process.stdout.readline().strip():
            name, _, value = line.partition(b":")
            if name.lower() == b"content-length":
                length = int(value)
        assert length, "the server has gone"
        message: dict[str, Any] = json.loads(self.process.stdout.read(length))
        return message


def at(line: int, character: int) -> dict[str, Any]:
    return {"textDocument": {"uri": URI}, "position": {"line": line, "character": character}}


def where(result: dict[str, Any]) -> tuple[int, int, int]:
    place = result["range"]
    return place["start"]["line"], place["start"]["character"], place["end"]["character"]


@pytest.fixture(scope="module")
def server() -> Iterator[Editor]:
    editor = Editor()
    try:
        yield editor
    finally:
        editor.close()


@pytest.fixture
def editor(server: Editor) -> Iterator[Editor]:
    """Return an editor with the text just opened, whatever tests ran before."""
    document = {"uri": URI, "languageId": "val2", "version": 1, "text": TEXT}
    server.tell("textDocument/didOpen", textDocument=document)
    yield server
    server.tell("textDocument/didClose", textDocument={"uri": URI})
    server.notified.clear()


def test_what_the_server_offers(server: Editor) -> None:
    assert server.name == "vrs"
    assert server.able["hoverProvider"]
    assert server.able["definitionProvider"]
    assert server.able["documentFormattingProvider"]
    assert server.able["documentSymbolProvider"]
    assert server.able["renameProvider"] == {"prepareProvider": True}


def test_diagnostics_when_a_text_is_opened_and_changed(editor: Editor) -> None:
    found = editor.diagnostics(1)
    wrong = next(one for one in found if one["severity"] == 1)
    assert (wrong["code"], where(wrong)) == (-452, (6, 2, 7))
    assert wrong["message"].startswith("*Unknown instruction* MOVEE")
    document = {"uri": URI, "version": 2}
    editor.tell("textDocument/didChange", textDocument=document, contentChanges=[MENDED])
    assert {one["code"] for one in editor.diagnostics(2)} == {57}


def test_completion(editor: Editor) -> None:
    items = editor.ask("textDocument/completion", **at(3, 5))["items"]
    first = next(item for item in items if item["label"].upper() == "MOVES")
    assert "straight-line motion" in first["detail"]
    assert first["textEdit"]["range"]["start"] == {"line": 3, "character": 2}


def test_columns_are_utf16_units(editor: Editor) -> None:
    """The face is one character for Python and two units for the editor."""
    found = editor.ask("textDocument/definition", **at(2, 15))
    assert TEXT.split("\n")[2].encode("utf-16-le")[30:32].decode("utf-16-le") == "n"
    assert where(found) == (1, 2, 3)


def test_hover(editor: Editor) -> None:
    found = editor.ask("textDocument/hover", **at(9, 4))
    assert "DEPART distance" in found["contents"]["value"]
    assert where(found) == (9, 2, 8)
    assert editor.ask("textDocument/hover", **at(2, 9)) is None


def test_definitions(editor: Editor) -> None:
    assert where(editor.ask("textDocument/definition", **at(4, 9))) == (8, 9, 13)
    assert where(editor.ask("textDocument/definition", **at(5, 8))) == (4, 0, 2)


def test_symbols(editor: Editor) -> None:
    found = editor.ask("textDocument/documentSymbol", textDocument={"uri": URI})
    assert [(one["name"], one["range"]["start"]["line"], one["range"]["end"]["line"]) for one in found] == [
        ("demo", 0, 7),
        ("pick", 8, 10),
    ]
    assert [child["name"] for child in found[0]["children"]] == ["10"]


def test_references_and_rename(editor: Editor) -> None:
    """`n` is assigned in the second line, and stands after a character of two units in the third."""
    everywhere = [(1, 2, 3), (2, 15, 16)]
    found = editor.ask("textDocument/references", **at(1, 2), context={"includeDeclaration": True})
    assert [where(one) for one in found] == everywhere
    found = editor.ask("textDocument/references", **at(1, 2), context={"includeDeclaration": False})
    assert [where(one) for one in found] == everywhere[1:]
    assert where({"range": editor.ask("textDocument/prepareRename", **at(2, 15))}) == everywhere[1]
    edits = editor.ask("textDocument/rename", **at(2, 15), newName="count")["changes"][URI]
    assert [(*where(one), one["newText"]) for one in edits] == [(*place, "count") for place in everywhere]


def test_a_rename_that_is_refused_says_why(editor: Editor) -> None:
    message = editor.refused("textDocument/rename", **at(2, 15), newName="and")
    assert "AND is a word of the language" in message
    assert "Traceback" not in editor.logged()


def test_folding(editor: Editor) -> None:
    found = editor.ask("textDocument/foldingRange", textDocument={"uri": URI})
    assert [(one["startLine"], one["endLine"]) for one in found] == [(0, 6), (8, 9)]


def test_signature_help(editor: Editor) -> None:
    found = editor.ask("textDocument/signatureHelp", **at(4, 13))
    (shown,) = found["signatures"]
    assert (shown["label"], found["activeParameter"]) == ("pick(a)", 0)
    assert shown["parameters"] == [{"label": [5, 6]}]


def test_actions_write_what_was_meant(editor: Editor) -> None:
    everything = {"start": {"line": 0, "character": 0}, "end": {"line": 20, "character": 0}}
    ask = {"textDocument": {"uri": URI}, "range": everything}
    (found,) = editor.ask("textDocument/codeAction", **ask, context={"diagnostics": []})
    assert (found["title"], found["kind"]) == ("Write MOVE", "quickfix")
    (edit,) = found["edit"]["changes"][URI]
    assert (*where(edit), edit["newText"]) == (6, 2, 7, "MOVE")
    assert "MOVEE" in found["diagnostics"][0]["message"]
    assert editor.ask("textDocument/codeAction", **ask, context={"diagnostics": [], "only": ["refactor"]}) == []
    elsewhere = {"start": {"line": 0, "character": 0}, "end": {"line": 1, "character": 0}}
    asked = {"textDocument": {"uri": URI}, "range": elsewhere}
    assert editor.ask("textDocument/codeAction", **asked, context={"diagnostics": []}) == []


def test_pieces_have_their_colours(editor: Editor) -> None:
    legend = editor.able["semanticTokensProvider"]["legend"]
    data = editor.ask("textDocument/semanticTokens/full", textDocument={"uri": URI})["data"]
    lines, found, line, column = TEXT.split("\n"), [], 0, 0
    for down, right, length, kind, bits in zip(*(data[place::5] for place in range(5)), strict=True):
        line, column = line + down, right + (0 if down else column)
        units = lines[line].encode("utf-16-le")[2 * column : 2 * (column + length)]
        names = [one for place, one in enumerate(legend["tokenModifiers"]) if bits >> place & 1]
        found.append((units.decode("utf-16-le"), legend["tokenTypes"][kind], *names))
    assert ("demo", "function") in found
    assert ("n", "variable") in found
    assert ('"\N{GRINNING FACE} é"', "string") in found
    assert ("a", "parameter", "static") in found
    assert [one for one in found if one[0] == "10"] == [("10", "label")] * 2
    assert ("pick", "function") in found
    assert ("TYPE", "keyword") in found


def test_a_text_that_is_not_open_is_refused_and_no_fault(editor: Editor) -> None:
    never = {"uri": "file:///never/there.v2"}
    for method in ("hover", "completion", "definition"):
        told = editor.refused(f"textDocument/{method}", textDocument=never, position={"line": 0, "character": 0})
        assert "is not open, and cannot be read" in told
    for method in ("documentSymbol", "foldingRange", "semanticTokens/full"):
        assert "is not open" in editor.refused(f"textDocument/{method}", textDocument=never)
    editor.tell("textDocument/didClose", textDocument=never)
    editor.tell("textDocument/didChange", textDocument={**never, "version": 2}, contentChanges=[{"text": "x"}])
    assert where(editor.ask("textDocument/definition", **at(4, 9))) == (8, 9, 13)
    assert "Traceback" not in editor.logged()


def test_formatting(editor: Editor) -> None:
    """A text without mistakes is formatted."""
    assert editor.ask("textDocument/formatting", textDocument={"uri": URI}, options=OPTIONS) is None
    document = {"uri": URI, "version": 2}
    editor.tell("textDocument/didChange", textDocument=document, contentChanges=[MENDED])
    [edit] = editor.ask("textDocument/formatting", textDocument={"uri": URI}, options=OPTIONS)
    assert "    MOVE part\n" in edit["newText"]
    assert edit["range"]["start"] == {"line": 0, "character": 0}
    assert edit["range"]["end"]["line"] >= TEXT.count("\n")


def test_every_request_is_answered(server: Editor) -> None:
    """Requests that the protocol does not have are answered too."""
    wrong: list[Any] = [{}, [1, 2], {"textDocument": {"uri": 3}, "position": {"line": "a", "character": 0}}]
    wrong += [{"textDocument": {"uri": URI}, "position": {"line": -5, "character": 0}}]
    for params in wrong:
        assert server.code("textDocument/hover", params) == -32602, params
    assert server.code("no/such", {}) == -32601
    server.send_raw(b"{no json")
    assert server.next()["error"]["code"] == -32700
    server.send_raw(b"[1]")
    assert server.next()["error"]["code"] == -32600


def test_a_request_comes_in_its_time() -> None:
    early = Editor(begins=False)
    try:
        assert early.code("textDocument/hover", at(0, 0)) == -32002
        early.begin()
        early.ask("shutdown")
        assert early.code("textDocument/hover", at(0, 0)) == -32600
    finally:
        early.close()


def test_the_files_of_a_folder(tmp_path: Path) -> None:
    """Definitions, rename, symbols and findings work in files that are not open."""
    (tmp_path / "sub folder").mkdir()
    main, lib = tmp_path / "sub folder" / "main.v2", tmp_path / "sub folder" / "lib.v2"
    lib.write_text(".PROGRAM grip(n)\n    CALL grip(n)\n.END\n")
    text = ".PROGRAM main()\n    CALL grip(1, 2)\n.END\n"
    editor = Editor(root=tmp_path.as_uri())
    try:
        uri = main.as_uri()
        editor.tell("textDocument/didOpen", textDocument={"uri": uri, "languageId": "v", "version": 1, "text": text})
        assert [one["code"] for one in editor.diagnostics(1)] == [-408]
        place = {"textDocument": {"uri": uri}, "position": {"line": 1, "character": 10}}
        found = editor.ask("textDocument/definition", **place)
        assert (found["uri"], where(found)) == (lib.as_uri(), (0, 9, 13))
        found = editor.ask("textDocument/references", **place, context={"includeDeclaration": False})
        assert [(one["uri"] == uri, where(one)) for one in found] == [(True, (1, 9, 13)), (False, (1, 9, 13))]
        changes = editor.ask("textDocument/rename", **place, newName="hold")["changes"]
        assert {one: len(edits) for one, edits in changes.items()} == {uri: 1, lib.as_uri(): 2}
        assert [where(one) for one in editor.ask("textDocument/documentHighlight", **place)] == [(1, 9, 13)]
        (symbol,) = editor.ask("workspace/symbol", query="gr")
        assert (symbol["name"], symbol["location"]["uri"]) == ("grip", lib.as_uri())
        assert ".PROGRAM grip(n)" in editor.ask("textDocument/hover", **place)["contents"]["value"]
        lib.write_text(".PROGRAM grip(n, m)\n.END\n")
        editor.tell("textDocument/didSave", textDocument={"uri": uri})
        assert editor.diagnostics(1) == []
    finally:
        editor.close()


def test_goodbye() -> None:
    assert Editor().end() == 0
