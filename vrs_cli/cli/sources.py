"""Program files as subcommands take them, and what is wrong with them."""

from __future__ import annotations

import sys
from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING

from vrs_cli.cli.command_line import STANDARD_STREAM

if TYPE_CHECKING:
    from vrs_cli.language.diagnostics import Diagnostic


@dataclass(frozen=True, slots=True)
class Source:
    """The text of a program file, and what to call it in messages."""

    path: str
    text: str

    def line(self, number: int) -> str:
        """A line of it, counted from 1."""
        lines = self.text.split("\n")
        return lines[number - 1] if 1 <= number <= len(lines) else ""

    def shown(self, diagnostics: Iterable[Diagnostic]) -> str:
        """Diagnostics in the order of their lines, each with its line and a caret."""
        from vrs_cli.language.diagnostics import show

        return "".join(f"{show(one, self.line(one.span.line), self.path)}\n" for one in ordered(diagnostics))


def read_source(path: str) -> Source:
    """A program file, or standard input for `-`. Raises NonexistentFile, FileError, FileDamaged."""
    from vrs_cli.files.program_file import decode_program, find_program_file, read_program_file

    if path == STANDARD_STREAM:
        return Source("standard input", decode_program("standard input", sys.stdin.buffer.read()))
    return Source(str(find_program_file(path)), read_program_file(path))


def ordered(diagnostics: Iterable[Diagnostic]) -> tuple[Diagnostic, ...]:
    """In the order of their lines."""
    return tuple(sorted(diagnostics, key=lambda one: (one.span.line, one.span.column)))


def has_errors(diagnostics: Iterable[Diagnostic]) -> bool:
    """Whether a program with these is not executable."""
    from vrs_cli.language.diagnostics import Severity

    return any(diagnostic.severity is Severity.ERROR for diagnostic in diagnostics)
