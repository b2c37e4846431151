"""Program files as subcommands take them, and what is wrong with them."""

from __future__ import annotations

import sys
from collections.abc import Iterable
from typing import TYPE_CHECKING

from msgspec import Struct

from vrs_cli.cli.command_line import STANDARD_STREAM

if TYPE_CHECKING:
    from vrs_cli.language.text.diagnostics import Diagnostic


PROGRAMS = (".v2", ".pg")  # how files of programs end


class Source(Struct, frozen=True):
    """The text of a program file, and what to call it in messages."""

    path: str
    text: str

    def shown(self, diagnostics: Iterable[Diagnostic], most: int | None = None) -> str:
        """Diagnostics in the order of their lines, each with its line and a caret; the first `most`, errors before
        warnings, and how many more there are.
        """
        from vrs_cli.language.text.diagnostics import show

        everything = ordered(diagnostics)
        chosen = everything
        if most is not None:  # errors before warnings
            chosen = ordered(sorted(everything, key=lambda one: not has_errors([one]))[:most])
        lines = ["", *self.text.split("\n"), ""]  # counted from 1; a finding may stand behind the last
        told = "".join(f"{show(one, lines[one.span.line], self.path)}\n" for one in chosen)
        rest = len(everything) - len(chosen)
        return f"{told}{rest} more (vrs check {self.path} shows all)\n" if rest else told


def read_source(path: str) -> Source:
    """A program file, or standard input for `-`. Raises NonexistentFile, FileError, FileDamaged."""
    from vrs_cli.files.program_file import decode_program, find_program_file, read_program_file

    if path == STANDARD_STREAM:
        return Source("standard input", decode_program("standard input", sys.stdin.buffer.read()))
    return Source(str(find_program_file(path)), read_program_file(path))


def is_program(name: str) -> bool:
    """Whether a program file is meant, and no address."""
    return name.lower().endswith(PROGRAMS) and "://" not in name


def ordered(diagnostics: Iterable[Diagnostic]) -> tuple[Diagnostic, ...]:
    """In the order of their lines."""
    return tuple(sorted(diagnostics, key=lambda one: (one.span.line, one.span.column)))


def has_errors(diagnostics: Iterable[Diagnostic]) -> bool:
    """Whether a program with these is not executable."""
    from vrs_cli.language.text.diagnostics import first_error

    return first_error(diagnostics) is not None
