"""Find the program files of a workspace that share their names (a name space), and all occurrences of a name in them.

Two files are in one name space if one of them names the other in a comment (`; with: lib.v2`), or if it calls a program
that it does not contain and that exactly one other file in its folder contains. The address of a text is its URI.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from functools import lru_cache
from itertools import islice
from posixpath import dirname, join, normpath, splitext
from typing import NamedTuple
from urllib.parse import unquote

from vrs_cli.errors import UsageError
from vrs_cli.interfaces.inspection import Beside, Inspector
from vrs_cli.kinematics.model import RobotModel
from vrs_cli.language.text.parser import files_named_above, program_name, programs_headed
from vrs_cli.language.words.values import key_of
from vrs_cli.lsp.document import Document, Symbol, SymbolKind
from vrs_cli.values.diagnostics import Diagnostic, Span

MAX_SYMBOLS = 500  # return at most this many symbols for a query
_CALLS = re.compile(r"(?i)\b(?:CALLP?|GOSUB|PRIME|(?:PC)?EXECUTE|REACT[IE]?)[ \t]([^;\n]*)")
_NAME = re.compile(r"[A-Za-z][\w.]*")


class FileSpan(NamedTuple):
    """A span in one of several files. `uri`: the address of the file."""

    uri: str
    span: Span


class _Outline(NamedTuple):
    """The data by which a file is linked to other files, found without parsing it. `programs`: the keys of its
    programs; `called`: the keys of programs that it may call but does not contain; `named`: the files that its comments
    name (`; with: ...`)."""

    programs: frozenset[str]
    called: frozenset[str]
    named: tuple[str, ...]


@lru_cache(maxsize=4096)
def _outline(text: str, name: str) -> _Outline:
    own = programs_headed(text) or {key_of(program_name(name))}
    found = (
        one[1]
        for one in _CALLS.finditer(text)
        if text.rfind(";", text.rfind("\n", 0, one.start()) + 1, one.start()) < 0
    )
    called = frozenset(key_of(word) for rest in set(found) for word in _NAME.findall(rest))
    return _Outline(frozenset(own), called - own, tuple(file for file, _ in files_named_above(text)))


class Workspace:
    """The current contents of the files of a workspace, by address, and their documents. `take` replaces the contents;
    unchanged files are not parsed again. `model`: the robot for which locations are checked."""

    def __init__(self, model: RobotModel) -> None:
        self._model = model
        self._texts: Mapping[str, str] = {}
        self._documents: dict[str, Document] = {}
        self._inspectors: dict[str, Inspector] = {}
        self._links: dict[str, set[str]] | None = None

    def take(self, texts: Mapping[str, str]) -> None:
        self._texts, self._links = texts, None
        for gone in self._documents.keys() - texts.keys():
            del self._documents[gone]
            self._inspectors.pop(gone, None)

    def document(self, uri: str) -> Document:
        """Return the document at an address. Each version of a file is parsed only once. Raises KeyError if the address
        is unknown."""
        known, text = self._documents.get(uri), self._texts[uri]
        if known is None or known.text != text:
            inspector = self._inspectors.setdefault(uri, Inspector(self._model))
            known = self._documents[uri] = Document(text, self._model, inspector, _stem(uri))
        return known

    # --- files in the same name space ---

    def project(self, uri: str) -> tuple[str, ...]:
        """Return the addresses of all files in the name space of a file: first its own address, then the others in
        alphabetical order."""
        if self._links is None:
            self._links = self._find_links()
        found, waiting = {uri}, [uri]
        for here in waiting:  # the list grows in the loop, which also visits the new items
            new = self._links.get(here, set()) - found
            found |= new
            waiting += new
        return (uri, *sorted(found - {uri}))

    def _find_links(self) -> dict[str, set[str]]:
        outlines = {other: _outline(text, _stem(other)) for other, text in self._texts.items()}
        folders = {other: _folder(other) for other in outlines}
        links: dict[str, set[str]] = {other: set() for other in outlines}
        owners: dict[tuple[str, str], list[str]] = {}
        for other, outline in outlines.items():
            for key in outline.programs:
                owners.setdefault((folders[other], key), []).append(other)
        by_path = {unquote(other).lower(): other for other in outlines}
        for other, outline in outlines.items():
            of_calls = (owners.get((folders[other], key), ()) for key in outline.called)
            linked = {files[0] for files in of_calls if len(files) == 1}
            paths = (normal(join(folders[other], file)) for file in outline.named)
            linked |= {meant for path in paths if (meant := by_path.get(path) or by_path.get(f"{path}.v2"))}
            links[other] |= linked
            for one in linked:
                links[one].add(other)
        return links

    def others(self, uri: str) -> list[Document]:
        """Return the documents of the other files in the name space of a file."""
        return [self.document(other) for other in self.project(uri)[1:]]

    # --- mistakes ---

    def diagnostics(self, uri: str) -> tuple[Diagnostic, ...]:
        """Check a file together with the other files of its name space, as `vrs check` does, and return its
        diagnostics."""
        document, others, project = self.document(uri), self.others(uri), self.project(uri)
        first = (self.document(other) for other in project[1:] if other < uri)
        near = frozenset(
            key
            for other, text in self._texts.items()
            if _folder(other) == _folder(uri) and other != uri
            for key in _outline(text, _stem(other)).programs
        )
        return document.findings(
            Beside(
                {key: program for other in others for key, program in other.programs.items()},
                tuple(section for other in others for section in other.sections),
                frozenset(key for other in first for key in other.programs),
                near,
            )
        )

    # --- names in all files ---

    def definition(self, uri: str, line: int, column: int) -> FileSpan | None:
        """Return where the name at a position is defined, in its own file or else in another file of the name space;
        None if it is not defined."""
        document = self.document(uri)
        asked = document.occurrence(line, column)
        span = document.definition(line, column)
        if span is not None or asked is None or document.is_local(asked, line):
            return None if span is None else FileSpan(uri, span)
        for other in self.project(uri)[1:]:
            if (span := self.document(other).origin(asked)) is not None:
                return FileSpan(other, span)
        return None

    def references(self, uri: str, line: int, column: int) -> Iterator[FileSpan]:
        """Yield all occurrences of the name at a position: first those in its own file, then those in the other files
        of the name space."""
        document = self.document(uri)
        asked = document.occurrence(line, column)
        yield from (FileSpan(uri, span) for span in document.references(line, column))
        if asked is not None and not document.is_local(asked, line):
            for other in self.project(uri)[1:]:
                yield from (FileSpan(other, span) for span in self.document(other).places(asked))

    def rename(self, uri: str, line: int, column: int, name: str) -> tuple[str, dict[str, tuple[Span, ...]]]:
        """Find what must change in all files of the name space to rename the name at a position. Return the new name as
        it must be written (with its sigil), and the spans to replace, by address. Raises UsageError, InvalidName."""
        document = self.document(uri)
        asked = document.occurrence(line, column)
        new, spans = document.rename(line, column, name)
        found = {uri: spans}
        if asked is None or document.is_local(asked, line):
            return new, found
        for other in self.project(uri)[1:]:
            file = self.document(other)
            if places := file.places(asked):
                found[other] = places
            try:
                file.check_free(asked, new)
            except UsageError as refused:
                raise UsageError(f"{refused.detail} in {_stem(other)}", refused.hint) from None
        return new, found

    def symbols(self, query: str) -> Iterator[tuple[str, Symbol, str]]:
        """Yield the programs, and the variables in sections, whose names contain a string, as (address, symbol,
        section); the section of a program is ""."""
        wanted, kinds = query.lower(), (SymbolKind.PROGRAM, SymbolKind.VARIABLE)
        found = (
            (uri, one, holder)
            for uri in sorted(self._texts)
            for symbol in self.document(uri).symbols
            for one, holder in ((symbol, ""), *((child, symbol.name) for child in symbol.children))
            if one.kind in kinds and wanted in one.name.lower()
        )
        return islice(found, MAX_SYMBOLS)

    # --- files whose programs may be called ---

    def near(self, uri: str) -> tuple[Sequence[Document], Sequence[Document]]:
        """Return the documents of the other files in the name space of a file, and of all other files whose programs it
        may call: those of the name space, then the remaining ones in its folder."""
        project, others = self.project(uri), self.others(uri)
        folder = sorted(one for one in self._texts if _folder(one) == _folder(uri) and one not in project)
        return others, [*others, *map(self.document, folder)]


def normal(path: str) -> str:
    """Return an address in lower case without `.` and `..`, so that addresses can be compared."""
    scheme, sign, rest = path.partition("://")
    return f"{scheme}{sign}{normpath(rest)}".lower() if sign else normpath(path).lower()


def _folder(uri: str) -> str:
    return dirname(unquote(uri))


def _stem(uri: str) -> str:
    return splitext(unquote(uri).rsplit("/", 1)[-1])[0]
