"""The parts of a program file by themselves, each read once: an editor changes one line, and few parts of a file.

Lines count from 1 within a part, so that a part stays what it is when lines come or go above it.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from functools import cached_property
from itertools import pairwise

from msgspec import Struct
from msgspec.structs import replace

from vrs_cli.errors import ProgramExists
from vrs_cli.language.text.ast import File, Program, Section, Span
from vrs_cli.language.text.diagnostics import Diagnostic, error
from vrs_cli.language.text.parser import parse_part, parse_prompt
from vrs_cli.language.text.source import END, PROGRAM, SECTIONS, SourceLine, lines_of


class Part(Struct, frozen=True, eq=False, dict=True):
    """A program or a section with all lines up to the next heading; or the lines before the first heading.

    `last`: its `.END`, or the last line where that is missing.
    """

    lines: tuple[str, ...]
    last: int

    @cached_property
    def _read(self) -> tuple[File, tuple[Diagnostic, ...]]:
        return parse_part("\n".join(self.lines))

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


def parts_of(text: str, known: Known) -> tuple[Placed, ...]:
    """Cut a file into its parts. Parts that are `known` by their lines are taken from there."""
    lines = lines_of(text)
    begins = [0, *(i for i, line in enumerate(lines) if i and _is_heading(line)), len(lines)]
    return tuple(_place_part(lines[begin:end], begin, known) for begin, end in pairwise(begins))


def _is_heading(line: SourceLine) -> bool:
    return line.directive == PROGRAM or line.directive in SECTIONS


def _place_part(lines: list[SourceLine], above: int, known: Known) -> Placed:
    texts = tuple(line.text for line in lines)
    part = known.get(texts)
    if part is None:
        ends = (i for i, line in enumerate(lines, 1) if line.directive == END)
        part = Part(texts, next(ends, len(lines)))
    return Placed(part, above)


def programs_of(parts: Iterable[Placed]) -> Iterator[tuple[Placed, Program]]:
    """The programs with their places."""
    return ((placed, placed.part.node) for placed in parts if isinstance(placed.part.node, Program))


def repeated_programs(parts: Iterable[Placed]) -> Iterator[Diagnostic]:
    """Report programs whose name the file has already."""
    names: set[str] = set()
    for placed, program in programs_of(parts):
        if program.key in names:
            header = parse_prompt(placed.part.lines[0])
            assert header is not None
            detail = f"{program.name} is there twice in this file"
            yield error(ProgramExists, placed.span(header.span), detail)
        names.add(program.key)
