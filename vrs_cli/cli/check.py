"""`vrs check`: all that is wrong with program files, without running them."""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from msgspec import Struct

from vrs_cli.cli.command_line import Parser, chosen_robot
from vrs_cli.cli.main import FAILED, OK, status_of
from vrs_cli.cli.sources import Source, has_errors, read_source
from vrs_cli.dialogue.numbers import count
from vrs_cli.errors import FileError

if TYPE_CHECKING:
    from vrs_cli.language.text.diagnostics import Diagnostic


EPILOG = """\
Exit status: 0 without errors (there may be warnings), 1 with errors.

  vrs check pick.v2 place.v2
  vrs check pick.v2 --format json
  vrs check *.v2 --format github    annotations of a GitHub workflow
"""


class Finding(Struct, frozen=True):
    """A file and what is wrong with it, in the order of its lines."""

    source: Source
    diagnostics: tuple[Diagnostic, ...]


def main(prog: str, arguments: Sequence[str]) -> int:
    """Print all diagnostics of all files."""
    from vrs_cli.interfaces.inspection import inspect

    options = _parser(prog).parse(arguments)
    model = chosen_robot(prog, options)
    findings, status = [], OK
    for path in options.files:
        try:
            source = read_source(path)
            findings.append(Finding(source, inspect(source.text, model)))
        except FileError as error:  # the other files are checked all the same
            print(f"{prog}: {error}", file=sys.stderr)
            status = max(status, status_of(error))
    print(_FORMATS[options.format](findings), end="")
    return max(status, FAILED if any(has_errors(finding.diagnostics) for finding in findings) else OK)


def _parser(prog: str) -> Parser:
    parser = Parser(prog, "Find all mistakes in program files. Nothing is run, no file is changed.", EPILOG)
    parser.add_argument("files", metavar="FILE.v2", nargs="+", help="program files (- is standard input)")
    parser.add_argument("--format", choices=tuple(_FORMATS), default="text", help="text (default), json or github")
    parser.add_robot()
    return parser


def _text(findings: Sequence[Finding]) -> str:
    """All of them, and how many there are; nothing for files without fault."""
    told = "".join(finding.source.shown(finding.diagnostics) for finding in findings)
    everything = [diagnostic for finding in findings for diagnostic in finding.diagnostics]
    errors = sum(has_errors([diagnostic]) for diagnostic in everything)
    if not everything:
        return told
    return f"{told}{count(errors, 'error')}, {count(len(everything) - errors, 'warning')}\n"


def _json(findings: Sequence[Finding]) -> str:
    import json

    files = [
        {"path": finding.source.path, "diagnostics": [_object(one) for one in finding.diagnostics]}
        for finding in findings
    ]
    return json.dumps({"files": files}, indent=2) + "\n"


def _object(one: Diagnostic) -> dict[str, Any]:
    return {
        "severity": one.severity.value,
        "code": one.code,
        "message": one.message,
        "text": one.text,
        "detail": one.detail,
        "hint": one.hint,
        "line": one.span.line,
        "column": one.span.column,
        "end": one.span.end,
    }


def _command(path: str, one: Diagnostic) -> str:
    """A workflow command, as GitHub Actions reads it from the output of a step."""
    span = one.span
    properties = {
        "file": path,
        "line": span.line,
        "col": span.column,
        "endColumn": span.end,
        "title": f"{one.text} ({one.code})",
    }
    shown = ",".join(f"{name}={_escaped(str(value), _PROPERTY)}" for name, value in properties.items())
    return f"::{one.severity.value} {shown}::{_escaped(one.message, _DATA)}\n"


# what a workflow command cannot hold as it stands (GitHub Actions toolkit, @actions/core)
_DATA: Mapping[str, str] = {"%": "%25", "\r": "%0D", "\n": "%0A"}
_PROPERTY: Mapping[str, str] = {**_DATA, ":": "%3A", ",": "%2C"}


def _escaped(text: str, table: Mapping[str, str]) -> str:
    return text.translate({ord(character): code for character, code in table.items()})


def _github(findings: Sequence[Finding]) -> str:
    return "".join(_command(finding.source.path, one) for finding in findings for one in finding.diagnostics)


_FORMATS = {"text": _text, "json": _json, "github": _github}
