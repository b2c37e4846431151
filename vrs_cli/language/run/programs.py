"""A program in memory: what the analyzer found, and the lines that it was read from."""

from __future__ import annotations

from msgspec import Struct

from vrs_cli.language.analysis.analyzer import Analysis
from vrs_cli.language.text.ast import Program
from vrs_cli.language.text.printer import statement_text


class StoredProgram(Struct, frozen=True, eq=False):
    """A program as it was stored. `lines`: those of its whole file, which all of its programs share."""

    analysis: Analysis
    lines: tuple[str, ...] = ()

    @property
    def program(self) -> Program:
        return self.analysis.program

    @property
    def name(self) -> str:
        return self.program.name

    def source(self, step: int) -> str:
        """The text of a step (counted from 0) as it was read, or in canonical form where it was not."""
        if not self.program.steps:
            return ""
        it = self.program.steps[step]
        if 1 <= it.span.line <= len(self.lines):
            return self.lines[it.span.line - 1].strip()
        return "" if it.statement is None else statement_text(it.statement)
