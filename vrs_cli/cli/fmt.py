"""`vrs fmt`: program files as canonical VAL-II text."""

from __future__ import annotations

import sys
from argparse import Namespace
from collections.abc import Iterable
from io import StringIO
from typing import TYPE_CHECKING

from msgspec import Struct

from vrs_cli.cli.command_line import DIALECT, STANDARD_STREAM, CommandLineError, Parser, chosen_dialect, one_of, option
from vrs_cli.cli.main import FAILED, OK
from vrs_cli.cli.sources import Source, program_files, read_source

if TYPE_CHECKING:
    from vrs_cli.values.dialect import Dialect

EPILOG = """\
A file with mistakes is left as it is. Formatting twice changes nothing more.

  vrs fmt pick.v2
  vrs fmt --write pick.v2 place.v2
  vrs fmt --write cell              all program files in a folder, and below it
  vrs fmt --diff pick.v2            what would change
  vrs fmt --check pick.v2 || echo "run vrs fmt --write"
"""


class Formatted(Struct, frozen=True):
    """A file and its canonical text; None where it has mistakes."""

    source: Source
    text: str | None

    @property
    def changed(self) -> bool:
        return self.text is not None and self.text != self.source.text


def main(options: Namespace) -> int:
    """Print, rewrite or compare; returns 1 when a file has mistakes, or with --check or --diff would change."""
    if options.write and STANDARD_STREAM in options.files:
        raise CommandLineError("--write cannot change standard input", "leave --write out")
    dialect = chosen_dialect(options)
    formatted = [_formatted(source, dialect) for source in map(read_source, program_files(options.files))]
    for one in formatted:
        if one.text is None:
            continue
        if not (options.check or options.write or options.diff):
            print(one.text, end="")
        elif one.changed:
            _tell(one, options)
    compared = options.check or options.diff
    wrong = any(one.text is None or (compared and one.changed) for one in formatted)
    return FAILED if wrong else OK


def _tell(one: Formatted, options: Namespace) -> None:
    """A file that is not as it should be."""
    path, text = one.source.path, one.text or ""
    if options.diff:
        _show(_difference(path, one.source.text, text))
    elif options.check:
        print(f"{path} would change")
    else:
        from vrs_cli.files.atomic import write_atomically

        write_atomically(path, text)
        print(f"{path} rewritten")


def _difference(path: str, before: str, after: str) -> Iterable[str]:
    """As `diff -u` tells it and `patch -p0` takes it."""
    from difflib import unified_diff

    for line in unified_diff(list(StringIO(before)), list(StringIO(after)), path, path):
        yield line.rstrip("\n")
        if not line.endswith("\n"):
            yield "\\ No newline at end of file"


def _show(lines: Iterable[str]) -> None:
    """In colours on a terminal."""
    if not sys.stdout.isatty():
        print("\n".join(lines))
        return
    from vrs_cli.render.blocks import line
    from vrs_cli.render.colours import Ink
    from vrs_cli.render.console import TerminalRenderer, rich_text

    console, inks = TerminalRenderer(sys.stdout).console, {"-": Ink.ERROR, "+": Ink.STRING, "@": Ink.INSTRUCTION}
    for text in lines:
        console.print(rich_text(line(text, inks.get(text[0], Ink.TEXT))), soft_wrap=True)


def parser(prog: str) -> Parser:
    return Parser(
        prog,
        "Print program files as canonical VAL-II text: one layout, comments kept.",
        EPILOG,
        option("files", metavar="FILE.v2", nargs="+", help="files, folders or patterns (- is standard input)"),
        DIALECT,
        one_of(
            option("--write", action="store_true", help="rewrite the files in place"),
            option("--check", action="store_true", help="change nothing; status 1 if a file would change"),
            option("--diff", action="store_true", help="the same, and show what would change"),
        ),
    )


def _formatted(source: Source, dialect: Dialect) -> Formatted:
    """The canonical text; what stands in its way is told on standard error."""
    from vrs_cli.language.analysis.structure import canonical_text

    text = canonical_text(source.text, dialect)
    if isinstance(text, str):
        return Formatted(source, text)
    print(source.shown(text), end="", file=sys.stderr)
    return Formatted(source, None)
