"""What is wrong with program files, as people, programs and GitHub read it; and what `vrs check --fix` mends of it."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any, Self

from msgspec import Struct

from vrs_cli.cli.sources import Source, has_errors
from vrs_cli.errors import FileError
from vrs_cli.values.numbers import count

if TYPE_CHECKING:
    from vrs_cli.values.diagnostics import Diagnostic

ROUNDS = 10  # of mends that uncover others


class Finding(Struct, frozen=True):
    """A file and what is wrong with it, in the order of its lines; what was mended in it before."""

    source: Source
    diagnostics: tuple[Diagnostic, ...]
    mended: int = 0

    @classmethod
    def of_file(cls, path: str, unreadable: FileError) -> Self:
        """A file that cannot be read."""
        from vrs_cli.values.diagnostics import Span, error

        found = error(type(unreadable), Span(1, 1, 2), unreadable.detail, unreadable.hint)
        return cls(Source(path, ""), (found,))


def _text(findings: Sequence[Finding]) -> None:
    """All of them, and how many there are; nothing for files without fault. In colours on a terminal."""
    for finding in findings:
        if sys.stdout.isatty():
            from vrs_cli.render.console import TerminalRenderer
            from vrs_cli.values.replies import Diagnosed, DiagnosticsReport

            lines = ["", *finding.source.text.split("\n"), ""]
            items = [Diagnosed(one, lines[one.span.line], finding.source.path) for one in finding.diagnostics]
            TerminalRenderer(sys.stdout).draw(DiagnosticsReport(tuple(items)))
        else:
            print(finding.source.shown(finding.diagnostics), end="")
    everything = [diagnostic for finding in findings for diagnostic in finding.diagnostics]
    errors = sum(has_errors([diagnostic]) for diagnostic in everything)
    mended = sum(finding.mended for finding in findings)
    if everything or mended:
        told = f"{count(errors, 'error')}, {count(len(everything) - errors, 'warning')}"
        print(f"{told}, {mended} mended" if mended else told)


def _json(findings: Sequence[Finding]) -> None:
    import json

    files = [
        {"path": finding.source.path, "diagnostics": [_object(one) for one in finding.diagnostics]}
        for finding in findings
    ]
    print(json.dumps({"files": files}, indent=2))


def _object(one: Diagnostic) -> dict[str, Any]:
    return {
        "severity": one.severity.value,
        "code": one.code,
        "label": one.label,
        "message": one.message,
        "text": one.text,
        "detail": one.detail,
        "hint": one.hint,
        "line": one.span.line,
        "column": one.span.column,
        "end": one.span.end,
        "mend": one.mend or None,
    }


def _github(findings: Sequence[Finding]) -> None:
    """Workflow commands, as GitHub Actions reads them from the output of a step."""
    for finding in findings:
        for one in finding.diagnostics:
            properties = {
                "file": finding.source.path,
                "line": one.span.line,
                "col": one.span.column,
                "endColumn": one.span.end,
                "title": f"{one.text} ({one.label})",
            }
            shown = ",".join(f"{name}={_escaped(str(value), _PROPERTY)}" for name, value in properties.items())
            print(f"::{one.severity.value} {shown}::{_escaped(one.message, _DATA)}")


# what a workflow command cannot hold as it stands (GitHub Actions toolkit, @actions/core)
_DATA: Mapping[str, str] = {"%": "%25", "\r": "%0D", "\n": "%0A"}
_PROPERTY: Mapping[str, str] = {**_DATA, ":": "%3A", ",": "%2C"}


def _escaped(text: str, table: Mapping[str, str]) -> str:
    return text.translate({ord(character): code for character, code in table.items()})


FORMATS: Mapping[str, Callable[[Sequence[Finding]], None]] = {"text": _text, "json": _json, "github": _github}


# --- mending: what can surely be mended is written into the file, all of it or nothing ------------------------------


def mended(finding: Finding, find: Callable[[str], tuple[Diagnostic, ...]]) -> Finding:
    """Mend a file and return what is left; one mend may uncover another, which `find` finds. Raises FileError."""
    now = finding
    for _ in range(ROUNDS):
        mends = tuple(_apart(now.diagnostics))
        text = _written(now.source.text, mends)
        now = Finding(Source(now.source.path, text), find(text), now.mended + len(mends)) if mends else now
    if now.mended:
        from vrs_cli.files.atomic import write_atomically

        write_atomically(now.source.path, now.source.text)
    return now


def _apart(found: Iterable[Diagnostic]) -> Iterator[Diagnostic]:
    """The mends of which none stands in another: of two such the one that begins first."""
    line, end = 0, 0
    for one in found:
        span = one.span
        if one.mend and (span.line, span.column) >= (line, end):
            yield one
            line, end = span.line, span.end


def _written(text: str, mends: Iterable[Diagnostic]) -> str:
    from vrs_cli.values.diagnostics import ordered

    lines = text.split("\n")
    for one in reversed(ordered(mends)):
        line, span = lines[one.span.line - 1], one.span
        lines[span.line - 1] = f"{line[: span.column - 1]}{one.mend}{line[span.end - 1 :]}"
    return "\n".join(lines)
