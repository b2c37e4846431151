"""Mistakes in a line (VAL-II's text and code, details, a hint, and the position), and the dialects of programs. A file
names its dialect in a comment above its first program: `; dialect: val2`. Each dialect includes the words of all
earlier dialects. The rule that AND, OR and NOT bind tighter than relations in VAL and VAL-II is from memory (val2
section 2.2), not from a printed manual."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from enum import Enum
from typing import Final, Protocol, TypeVar

from msgspec import Struct

from vrs_cli.errors import ProgramError, VrsError, sentence


class Dialect(Enum):
    """A dialect. Its value is its name in files and in `--dialect`; `title` is its name in messages."""

    VAL = "val", "VAL"
    VAL2 = "val2", "VAL-II"
    VPLUS = "vplus", "V+"

    def __new__(cls, word: str, title: str) -> Dialect:
        dialect = object.__new__(cls)
        dialect._value_ = word
        dialect.title = title
        return dialect

    title: str

    def knows(self, where: str) -> bool:
        """Return whether the dialect contains a word. `where`: the lineage column of the word's table row. Words that
        vrs itself adds are in all dialects."""
        marks = where.split()
        return not marks or any(mark in _MARKS[self] for mark in marks)


_MARKS = {
    Dialect.VAL: frozenset({"1"}),
    Dialect.VAL2: frozenset({"1", "2"}),
    Dialect.VPLUS: frozenset({"1", "2", "+"}),
}
DIALECTS = tuple(dialect.value for dialect in Dialect)


Placed = TypeVar("Placed", bound="HasSpan")

# maximum numbers of characters shown of a source line (lines of old programs are shorter) and of a detail
MAX_LINE_CHARS, MAX_DETAIL_CHARS = 160, 400


class HasSpan(Protocol):
    """A value with a position in a program text."""

    @property
    def span(self) -> Span: ...


def in_order(found: Iterable[Placed]) -> tuple[Placed, ...]:
    """Sort values by their position in the text."""
    return tuple(sorted(found, key=lambda one: (one.span.line, one.span.column)))


class Severity(Enum):
    """The severity of a diagnostic: an error keeps a program from running, a warning does not."""

    ERROR = "error"
    WARNING = "warning"


class Diagnostic(Struct, frozen=True):
    """A mistake found in the source. `detail`: what is wrong; `hint`: a correct form. `mend`: the text to put in place
    of the span if only one correction is possible, otherwise empty."""

    severity: Severity
    code: int
    text: str
    detail: str
    hint: str
    span: Span
    mend: str = ""

    @property
    def label(self) -> str:
        """Return the code in the form used in file names and options: V452 for -452."""
        return f"V{abs(self.code):03d}"

    @property
    def message(self) -> str:
        """Return the message, such as `*Unknown instruction* MOVEE (did you mean MOVE?)`. A very long detail is
        shortened."""
        detail = self.detail
        shown = detail if len(detail) <= MAX_DETAIL_CHARS else f"{detail[:MAX_DETAIL_CHARS]}..."
        return sentence(self.text, shown, self.hint)


class LineRefused(ProgramError):
    """The error for a line that cannot be read. `diagnostic`: the reason, with the position."""

    def __init__(self, diagnostic: Diagnostic) -> None:
        super().__init__(diagnostic.detail, diagnostic.hint)
        self.diagnostic: Final = diagnostic

    def __str__(self) -> str:
        return self.diagnostic.message

    @property
    def title(self) -> str:
        return self.diagnostic.text


def error(kind: type[VrsError], span: Span, detail: str = "", hint: str = "", mend: str = "") -> Diagnostic:
    """Make an error diagnostic with the text and code of an error class."""
    return Diagnostic(Severity.ERROR, kind.code, kind.text, detail, hint, span, mend)


def warning(kind: type[VrsError], span: Span, detail: str = "", hint: str = "", mend: str = "") -> Diagnostic:
    """Make a warning diagnostic with the text and code of an error class."""
    return Diagnostic(Severity.WARNING, kind.code, kind.text, detail, hint, span, mend)


class DiagnosticCollector:
    """Collects errors and warnings in a list."""

    def __init__(self) -> None:
        self.diagnostics: list[Diagnostic] = []

    def fault(self, kind: type[VrsError], span: Span, detail: str, hint: str = "") -> None:
        """Add an error."""
        self.diagnostics.append(error(kind, span, detail, hint))

    def warn(self, kind: type[VrsError], span: Span, detail: str, hint: str = "", mend: str = "") -> None:
        """Add a warning."""
        self.diagnostics.append(warning(kind, span, detail, hint, mend))


def refusal(kind: type[VrsError], span: Span, detail: str = "", hint: str = "") -> LineRefused:
    """Make the exception that refuses a line."""
    return LineRefused(error(kind, span, detail, hint))


def first_error(found: Iterable[Diagnostic]) -> Diagnostic | None:
    """Return the first error; None if there are only warnings."""
    return next(errors(found), None)


def errors(found: Iterable[Diagnostic]) -> Iterator[Diagnostic]:
    """Yield the errors among diagnostics."""
    return (one for one in found if one.severity is Severity.ERROR)


def show(diagnostic: Diagnostic, source_line: str, path: str | None = None) -> str:
    """Return `file:line:column: V452 *Text* detail (hint)`, the source line, and a line of carets under the span, as
    plain text. Without a path (at the prompt) the position and the code are left out. If a line is very long, only the
    part around the span is shown."""
    span = diagnostic.span
    place = f"{path}:{span.line}:{span.column}: {diagnostic.label} " if path is not None else ""
    lines = [f"{place}{'warning: ' * (diagnostic.severity is Severity.WARNING)}{diagnostic.message}"]
    if source_line.strip():
        stretch, place_in_it = _stretch(source_line.rstrip(), span)
        plain = (c if c.isprintable() or c == "\t" else "\N{REPLACEMENT CHARACTER}" for c in stretch.rstrip())
        lines += [
            "".join(plain),
            _pointer(stretch, place_in_it),
        ]  # replace characters that would move the cursor, but keep tabs
    return "\n".join(lines)


def _stretch(line: str, span: Span) -> tuple[str, Span]:
    """Return the part of a long line around a span, and the position of the span in that part."""
    if len(line) <= MAX_LINE_CHARS:
        return line, span
    begin = max(0, min(span.column - 1 - MAX_LINE_CHARS // 2, len(line) - MAX_LINE_CHARS))
    before, after = "..." if begin else "", "..." if begin + MAX_LINE_CHARS < len(line) else ""
    moved = begin - len(before)
    end = min(span.end, begin + MAX_LINE_CHARS + 1)
    return f"{before}{line[begin : begin + MAX_LINE_CHARS]}{after}", Span(span.line, span.column - moved, end - moved)


def _pointer(line: str, span: Span) -> str:
    indent = "".join("\t" if c == "\t" else " " for c in line[: span.column - 1].ljust(span.column - 1))
    return indent + "^" * max(1, min(span.end, len(line.rstrip()) + 1) - span.column)


class Span(Struct, frozen=True):
    """A range of one source line. Line and columns count from 1; `end` is the column after the last character."""

    line: int
    column: int
    end: int
