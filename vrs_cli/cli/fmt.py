"""`vrs fmt`: program files as canonical VAL-II text."""

from __future__ import annotations

import sys
from collections.abc import Sequence

from msgspec import Struct

from vrs_cli.cli.command_line import STANDARD_STREAM, CommandLineError, Parser
from vrs_cli.cli.main import FAILED, OK
from vrs_cli.cli.sources import Source, read_source

EPILOG = """\
A file with mistakes is left as it is. Formatting twice changes nothing more.

  vrs fmt pick.v2
  vrs fmt --write pick.v2 place.v2
  vrs fmt --check pick.v2 || echo "run vrs fmt --write"
"""


class Formatted(Struct, frozen=True):
    """A file and its canonical text; None where it has mistakes."""

    source: Source
    text: str | None

    @property
    def changed(self) -> bool:
        return self.text is not None and self.text != self.source.text


def main(prog: str, arguments: Sequence[str]) -> int:
    """Print, rewrite or compare; returns 1 when a file has mistakes, or with --check would change."""
    options = _parser(prog).parse(arguments)
    if options.write and STANDARD_STREAM in options.files:
        raise CommandLineError("--write cannot change standard input", "leave --write out")
    formatted = [_formatted(source) for source in map(read_source, options.files)]
    for one in formatted:
        if one.text is None:
            continue
        if not (options.check or options.write):
            print(one.text, end="")
        elif one.changed and options.check:
            print(f"{one.source.path} would change")
        elif one.changed:
            from vrs_cli.files.atomic import write_atomically

            write_atomically(one.source.path, one.text)
            print(f"{one.source.path} rewritten")
    wrong = any(one.text is None or (options.check and one.changed) for one in formatted)
    return FAILED if wrong else OK


def _parser(prog: str) -> Parser:
    parser = Parser(prog, "Print program files as canonical VAL-II text: one layout, comments kept.", EPILOG)
    parser.add_argument("files", metavar="FILE.v2", nargs="+", help="program files (- is standard input)")
    how = parser.add_mutually_exclusive_group()
    how.add_argument("--write", action="store_true", help="rewrite the files in place")
    how.add_argument("--check", action="store_true", help="change nothing; status 1 if a file would change")
    return parser


def _formatted(source: Source) -> Formatted:
    """The canonical text; what stands in its way is told on standard error."""
    from vrs_cli.language.analysis.structure import canonical_text

    text = canonical_text(source.text)
    if isinstance(text, str):
        return Formatted(source, text)
    print(source.shown(text), end="", file=sys.stderr)
    return Formatted(source, None)
