"""The parts of a program file by themselves, each read once: an editor changes one line, and few parts of a file.

Lines count from 1 within a part, so that a part stays what it is when lines come or go above it.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from functools import cached_property

from msgspec import Struct
from msgspec.structs import replace

from vrs_cli.errors import ProgramExists
from vrs_cli.language.text.ast import File, Program, Section
from vrs_cli.language.text.parser import parse_file
from vrs_cli.language.text.source import cut, dialect_in, end_of, lines_of
from vrs_cli.values.diagnostics import Diagnostic, Span, error
from vrs_cli.values.dialect import Dialect


class Part(Struct, frozen=True, eq=False, dict=True):
    """A program or a section with all lines up to the next heading; or the lines before the first heading.

    `last`: its `.END`, or the last line where that is missing.
    """

    lines: tuple[str, ...]
    last: int
    dialect: Dialect

    @cached_property
    def _read(self) -> tuple[File, tuple[Diagnostic, ...]]:
        return parse_file("\n".join(self.lines), self.dialect, whole=False)

    @property
    def file(self) -> File:
        return self._read[0]

    @property
    def diagnostics(self) -> tuple[Diagnostic, ...]:
        """The lines that cannot be read."""
        return self._read[1]

    @cached_property
    def node(self) -> Program | Section | None:
        """None where there is no heading, or one that cannot be read."""
        return next((part for part in self.file.parts if isinstance(part, Program | Section)), None)


class Placed(Struct, frozen=True):
    """A part in a file, below so many lines (`above`)."""

    part: Part
    above: int

    def span(self, span: Span) -> Span:
        """Translate a span of the part into one of the file."""
        return Span(span.line + self.above, span.column, span.end)

    def found(self, diagnostics: Iterable[Diagnostic]) -> Iterator[Diagnostic]:
        """Translate findings in the part into findings in the file."""
        return (replace(one, span=self.span(one.span)) for one in diagnostics)


Known = Mapping[tuple[str, ...], Part]


def parts_of(text: str, known: Known, dialect: Dialect = Dialect.VPLUS) -> tuple[Placed, ...]:
    """Cut a file into its parts. Parts that are `known` by their lines are taken from there. `dialect`: where the file
    says none.
    """
    placed, above = list[Placed](), 0
    own, _ = dialect_in(text, dialect)
    for lines in cut(lines_of(text)):
        texts, end = tuple(line.text for line in lines), end_of(lines)
        part = known.get(texts)
        if part is None or part.dialect is not own:
            part = Part(texts, len(lines) if end is None else end + 1, own)
        placed.append(Placed(part, above))
        above += len(lines)
    return tuple(placed)


def programs_of(parts: Iterable[Placed]) -> Iterator[tuple[Placed, Program]]:
    """The programs with their places."""
    return ((placed, placed.part.node) for placed in parts if isinstance(placed.part.node, Program))


def repeated_programs(parts: Iterable[Placed]) -> Iterator[Diagnostic]:
    """Report programs whose name the file has already."""
    names: set[str] = set()
    for placed, program in programs_of(parts):
        if program.key in names:
            detail = f"{program.name} is there twice in this file"
            yield error(ProgramExists, placed.span(program.span), detail)
        names.add(program.key)
