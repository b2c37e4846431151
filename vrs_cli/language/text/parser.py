"""Text to syntax trees, by the one grammar of the language (grammar/val2.lark): lines, files, and the parts of a file.

What cannot be read is a diagnostic, never another exception: of a line (`LineRefused`), or of a file, where every line
is read for itself and all findings come together.
"""

from __future__ import annotations

import re
from collections.abc import Container, Iterable, Iterator, Mapping
from contextlib import suppress
from functools import cache, cached_property

from msgspec import Struct
from msgspec.structs import replace

from vrs_cli.language.text import ast
from vrs_cli.language.text.ast import (
    File,
    Program,
    ProgramHeader,
    Section,
    Statement,
    Step,
)
from vrs_cli.language.text.builder import ValBuilder
from vrs_cli.language.text.line_parser import LineParser
from vrs_cli.language.text.meaning import FUNCTION_NAMES, variables_named_like_functions
from vrs_cli.language.text.source import (
    FileReader,
    cut,
    dialect_in,
    end_of,
    foreign_file,
    has_program,
    header_end,
    lines_of,
)
from vrs_cli.values.diagnostics import Diagnostic, Dialect, LineRefused, Span


def parse_file(
    text: str, dialect: Dialect = Dialect.VPLUS, *, name: str = "", whole: bool = True, remembered: bool = True
) -> tuple[ast.File, tuple[Diagnostic, ...]]:
    """The programs and sections of a file, and everything that cannot be read in it.

    A bad line of a program is kept as BadLine. Line ends may be LF, CR LF or CR. `dialect`: where the file says none.
    `name`: of the file, for steps without a heading. Where it is a `whole` file, one in another maker's language is
    told of as such, and not read if it has no program. `remembered`: its steps stay in memory for the next time, as for
    a text that is being changed.
    """
    foreign = foreign_file(text) if whole else None
    if foreign is not None and not has_program(text):
        return ast.File(()), (foreign,)
    own, wrong = dialect_in(text, dialect)
    file, found = FileReader(_parser(own), own, remembered=remembered).read(text, name)
    told = () if foreign is None else (foreign,)
    return file, (*told, *wrong, *found)


def parse_step(text: str, line: int = 1, dialect: Dialect = Dialect.VPLUS) -> Step:
    """A program line: label, statement and comment, each or none. Raises LineRefused."""
    return _parser(dialect).step(text, line)


def parse_prompt(
    text: str, names: Container[str] = (), dialect: Dialect = Dialect.VPLUS
) -> Statement | ProgramHeader | None:
    """A line of the prompt; None for a blank or a comment. `names`: the keys of what has a value. Raises LineRefused.

    A monitor command is an Instruction, an expression alone is Show, everything else that can be done a DoInstruction.
    """
    at, parser = header_end(text), _parser(dialect)
    return parser.prompt(text, names) if at is None else parser.header(text, 1, at)


def variables_in(lines: Iterable[str]) -> set[str]:
    """The keys of the variables that bear the name of a function, in lines of a program, its heading among them."""
    parameters: list[ast.Variable] = []
    statements: list[Statement | None] = []
    for line in lines:
        if re.search(_NAME_OF_FUNCTION, line):
            with suppress(LineRefused):
                header = parse_prompt(line) if header_end(line) is not None else None
                parameters += header.parameters if isinstance(header, ProgramHeader) else ()
                statements.append(parse_step(line).statement)
    return variables_named_like_functions(parameters, statements)


_NAME_OF_FUNCTION = "(?i)" + "|".join(map(re.escape, FUNCTION_NAMES))


@cache
def _parser(dialect: Dialect) -> LineParser:
    """A parser by our order of operators for V+, by that of VAL-II for VAL-II and VAL."""
    return LineParser() if dialect is Dialect.VPLUS else _val_parser()


@cache
def _val_parser() -> LineParser:
    return LineParser(ValBuilder())


# --- the parts of a file -----------------------------------------------------------------------------------------


class Part(Struct, frozen=True, eq=False, dict=True):
    """A program or a section with all lines up to the next heading; or the lines before the first heading.

    An editor changes one line, so few parts of a file: a part is read once. Its lines count from 1, so that a part
    stays what it is when lines come or go above it. `last`: its `.END`, or the last line where that is missing. `name`:
    of the file, for the first part, which may be steps without a heading.
    """

    lines: tuple[str, ...]
    last: int
    dialect: Dialect
    name: str = ""

    @cached_property
    def _read(self) -> tuple[File, tuple[Diagnostic, ...]]:
        text = "\n".join((*self.lines, ""))  # the last line ends: a Ctrl-Z in it is no end of the file
        return parse_file(text, self.dialect, name=self.name, whole=False)

    @property
    def diagnostics(self) -> tuple[Diagnostic, ...]:
        """The lines that cannot be read."""
        return self._read[1]

    @cached_property
    def node(self) -> Program | Section | None:
        """The program or section; None without a heading, or with one that cannot be read."""
        return next((part for part in self._read[0].parts if isinstance(part, Program | Section)), None)


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


def parts_of(text: str, known: Known, dialect: Dialect = Dialect.VPLUS, name: str = "") -> tuple[Placed, ...]:
    """Cut a file into its parts. Parts that are `known` by their lines are taken from there. `dialect`: where the file
    says none. `name`: of the file, for steps without a heading.
    """
    placed, above = list[Placed](), 0
    own, _ = dialect_in(text, dialect)
    bare = "" if has_program(text) else name
    for lines in cut(lines_of(text)):
        texts, end = tuple(line.text for line in lines), end_of(lines)
        part = known.get(texts)
        if part is None or part.dialect is not own:
            part = Part(texts, len(lines) if end is None else end + 1, own, "" if above else bare)
        placed.append(Placed(part, above))
        above += len(lines)
    return tuple(placed)


def programs_of(parts: Iterable[Placed]) -> Iterator[tuple[Placed, Program]]:
    """The programs with their places."""
    return ((placed, placed.part.node) for placed in parts if isinstance(placed.part.node, Program))
