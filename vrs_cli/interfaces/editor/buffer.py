"""The buffer for a program that is typed at the prompt (`.PROGRAM`) or edited (EDIT, SEE): a heading, lines of text,
and a cursor. It parses and checks its lines, and does not depend on a terminal. The sections of a program file
(`.LOCATIONS`, `.REALS`, `.STRINGS`) can be typed too, so that a whole file can be pasted at the prompt."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from functools import reduce
from typing import TYPE_CHECKING, NamedTuple

from msgspec.structs import replace

from vrs_cli.errors import CannotInterpret, IllegalValue, ProgramNotExecutable, UsageError
from vrs_cli.interfaces.dialogue import Dialogue, beside_if
from vrs_cli.interfaces.station.loaded_file import LONG_PROGRAM
from vrs_cli.language.analysis import analyzer, names
from vrs_cli.language.run.memory import Memory
from vrs_cli.language.text import ast, parser, printer
from vrs_cli.language.words.values import Kind, key_of
from vrs_cli.values import diagnostics, numbers, replies, results

if TYPE_CHECKING:
    from vrs_cli.interfaces.station.station import Station

INDENT = "    "  # indentation of each level of blocks (val2 section 7)
FIRST_STEP_LINE = 2  # line number of the first step in a program's text; the heading is line 1

_NAME = re.compile(r"\s*\.\w+\s+([A-Za-z][\w.]*)")
_LABEL = re.compile(r"^\s*\d+\s+")
_COMMENT = re.compile(r";.*|\"[^\"]*\"")
# not an assignment: `end = 5` does not end a block
_FIRST = re.compile(r"[A-Z][\w.]*(?!\s*(?:\[|=(?!=)))(?![\w.])", re.IGNORECASE)

CLOSERS = frozenset({"END", "UNTIL"})
MIDDLES = frozenset({"ELSE", "VALUE", "ANY"})
OPENERS = frozenset({"FOR", "WHILE", "CASE"})


class ProgramReading(NamedTuple):
    """The result of parsing a program text: the program (None if its heading cannot be parsed), and all mistakes,
    sorted by line."""

    program: ast.Program | None
    findings: tuple[diagnostics.Diagnostic, ...]


class ProgramBuffer:
    """A program or section that is being typed or edited. `header`: its first line. `at`: the index from 0 of the line
    at the cursor; `len(lines)` if the cursor is after the last line. `inserting`: new lines are inserted before the
    line at the cursor until an empty line is typed. `dialect`: the dialect in which the lines are parsed."""

    def __init__(
        self,
        header: str,
        lines: Iterable[str] = (),
        at: int | None = None,
        dialect: diagnostics.Dialect = diagnostics.Dialect.VPLUS,
    ) -> None:
        self.header, self.lines, self.dialect = header.strip(), list(lines), dialect
        self._blocks = depth(self.lines)  # number of blocks that are still open after the last line
        self.move(len(self.lines) if at is None else at)

    @classmethod
    def of_program(cls, program: ast.Program, at: int = 0) -> ProgramBuffer:
        """Return a buffer with the lines of a program. `at`: the index of the line at the cursor."""
        return cls(printer.program_header(program), printer.step_texts(program), at, program.dialect)

    @classmethod
    def of_text(cls, text: str, dialect: diagnostics.Dialect) -> ProgramBuffer:
        """Return a buffer with the program text `text`, whose first line is the heading. Blank lines at its end are
        dropped."""
        header, *lines = text.split("\n")
        while lines and not lines[-1].strip():
            lines.pop()
        return cls(header, lines, dialect=dialect)

    # --- contents ---

    @property
    def name(self) -> str:
        """The program name in the heading; "" if there is none."""
        found = _NAME.match(self.header)
        return found.group(1) if found else ""

    @property
    def is_program(self) -> bool:
        """Return whether the buffer contains a program; otherwise it contains a section of variables."""
        return _directive(self.header) == parser.PROGRAM

    @property
    def text(self) -> str:
        return "\n".join((self.header, *self.lines))

    @property
    def source(self) -> str:
        """The whole program as the text of a program file."""
        return f"{self.text}\n.END\n"

    @property
    def prompt(self) -> str:
        """The prompt with the number of the step at the cursor, as in the editor of VAL-II: `    1.? `. It is as wide
        as the step numbers in a listing."""
        return f"{self.at + 1:5d}.? "

    @property
    def indent(self) -> str:
        """The blanks at the start of the next line: one INDENT for the program, and one more for each open block."""
        return INDENT * (1 + self._open_blocks()) if self.is_program else ""

    def _open_blocks(self) -> int:
        return self._blocks if self.at == len(self.lines) else depth(self.lines[: self.at])

    # --- changes ---

    def move(self, at: int) -> None:
        """Move the cursor to the line with index `at`, or to the nearest line that exists. Stop inserting."""
        self.at, self.inserting = max(0, min(at, len(self.lines))), False

    def add(self, line: str) -> None:
        """Put a line at the cursor and move the cursor to the next line. The new line replaces the current line, unless
        `inserting`. A line that ends or divides a block (END, ELSE) is indented like the first line of the block."""
        text = line.strip()
        if self.is_program and text:
            before = self._open_blocks()
            back = 1 if before and _first_word(text) in CLOSERS | MIDDLES else 0
            text = INDENT * (1 + before - back) + text
        last = self.at == len(self.lines)
        self.lines[self.at : self.at if self.inserting else self.at + 1] = [text]
        self.at += 1
        self._blocks = _blocks_after(self._blocks, text) if last else depth(self.lines)

    def delete(self, wanted: int) -> int:
        """Delete up to `wanted` lines, starting at the cursor. Return the number of deleted lines."""
        gone = len(self.lines[self.at : self.at + wanted])
        del self.lines[self.at : self.at + wanted]
        self._blocks = depth(self.lines)
        self.move(self.at)
        return gone

    # --- reading and checking ---

    def read(self) -> ProgramReading:
        header = read_header(self.header)
        steps = [read_step(line, number, self.dialect) for number, line in enumerate(self.lines, FIRST_STEP_LINE)]
        findings = tuple(found for _, found in steps if found is not None)
        if isinstance(header, diagnostics.Diagnostic):
            return ProgramReading(None, (header, *findings))
        body = tuple(step for step, _ in steps)
        program = ast.Program(header.name, header.parameters, body, header.comment, self.dialect, span=header.span)
        return ProgramReading(ast.resolve_program(program), findings)

    def read_among(self, memory: Memory) -> ProgramReading:
        """Parse all lines, and analyse the program together with the programs in memory. Return the program and all
        mistakes."""
        program, findings = self.read()
        if program is None:
            return ProgramReading(None, findings)
        return ProgramReading(program, diagnostics.in_order((*findings, *analysis_of(memory, program).diagnostics)))

    def show(self, first: int, count: int, memory: Memory) -> tuple[replies.ListedStep, ...]:
        """Return up to `count` steps, starting at index `first` (from 0), formatted as in a listing."""
        program = self.read().program if first < len(self.lines) else None
        return () if program is None else list_steps(analysis_of(memory, program))[first : first + count]

    def check(self, line: str, known: Mapping[str, Kind]) -> tuple[ast.Step, tuple[diagnostics.Diagnostic, ...]]:
        """Return the step in a line, and warnings about the line. `known`: the kinds (real, location ...) of the
        variables that have a value. Raises LineRefused for the first mistake in the line or in the heading."""
        step, heading = parser.parse_step(line, 1, self.dialect), parser.parse_prompt(self.header)
        if step.statement is None:
            return step, ()
        # ignore the kinds of variables that have the name of a parameter: the parameter hides them
        own = {one.key for one in heading.parameters} if isinstance(heading, ast.ProgramHeader) else set[str]()
        meant = ast.resolve_line(step.statement, parser.variables_in((self.header, *self.lines)))
        found = analyzer.check_line(
            meant, {key: kind for key, kind in known.items() if key not in own}, in_program=True
        )
        if (wrong := diagnostics.first_error(found)) is not None:
            raise diagnostics.LineRefused(wrong)
        return step, found

    def mistake(self, line: str, known: Mapping[str, Kind]) -> diagnostics.Diagnostic | None:
        """Return the first mistake in a line that will be added next; None if there is none. `.END` and the lines of a
        section are not checked."""
        if closes_entry(line) or not self.is_program:
            return None
        try:
            self.check(line, known)
        except diagnostics.LineRefused as refused:
            return refused.diagnostic
        return None


# --- lines -----------------------------------------------------------------------------------------------------------


def opens_entry(line: str) -> bool:
    """Return whether a line typed at the prompt begins a program or a section."""
    return _directive(line) in (parser.PROGRAM, *parser.SECTIONS)


def closes_entry(line: str) -> bool:
    return _directive(line) == parser.END


def _directive(line: str) -> str:
    lines = parser.lines_of(line)
    return lines[0].directive if lines else ""


def depth(lines: Sequence[str]) -> int:
    """Return how many blocks are open after the given lines."""
    return reduce(_blocks_after, lines, 0)


def _blocks_after(before: int, line: str) -> int:
    word, words = _first_word(line), _LABEL.sub("", _COMMENT.sub("", line), count=1).upper().split()
    if word in CLOSERS:
        return max(0, before - 1)
    return before + (word in OPENERS or (word == "IF" and words[-1:] == ["THEN"]) or words == ["DO"])


def _first_word(line: str) -> str:
    found = _FIRST.match(_LABEL.sub("", line.lstrip(), count=1))
    return found.group().upper() if found else ""


def read_header(line: str) -> ast.ProgramHeader | diagnostics.Diagnostic:
    """Return the parsed heading of a program, or the mistake in it."""
    try:
        header = parser.parse_prompt(line)
    except diagnostics.LineRefused as refused:
        return refused.diagnostic
    if isinstance(header, ast.ProgramHeader):
        return header
    return diagnostics.error(
        CannotInterpret, diagnostics.Span(1, 1, len(line) + 1), "the first line names the program", ".PROGRAM name"
    )


def read_step(text: str, line: int, dialect: diagnostics.Dialect) -> tuple[ast.Step, diagnostics.Diagnostic | None]:
    """Return the step in a line, and None. For a line that cannot be parsed, return a step with a BadLine, and the
    mistake. Raises no error."""
    try:
        return parser.parse_step(text, line, dialect), None
    except diagnostics.LineRefused as refused:
        span = diagnostics.Span(line, len(text) - len(text.lstrip()) + 1, len(text.rstrip()) + 1)
        return ast.Step(None, ast.BadLine(text.strip(), span=span), None, span=span), refused.diagnostic


# --- canonical form --------------------------------------------------------------------------------------------------


def canonical(text: str, dialect: diagnostics.Dialect) -> str:
    """Return the text of a program with keywords in upper case, names in lower case, and blocks indented. Lines that
    cannot be parsed stay unchanged."""
    if (program := ProgramBuffer.of_text(text, dialect).read().program) is None:
        return text
    typed, count = text.split("\n")[1:], len(program.steps)
    shown = (
        line if isinstance(step.statement, ast.BadLine) else text
        for step, text, line in zip(program.steps, printer.step_texts(program), typed, strict=False)
    )
    return "\n".join((printer.program_header(program), *shown, *map(str.strip, typed[count:])))


def canonical_line(text: str, row: int, dialect: diagnostics.Dialect) -> str:
    """Return one line of a program text in canonical form (as `canonical`). `row`: its index from 0."""
    lines, changed = text.split("\n"), canonical(text, dialect).split("\n")
    return changed[row] if row < len(changed) else lines[row]


def program_text(program: ast.Program) -> str:
    """Return the text of a program as SEE shows it: without .END, and with one empty step if the program has none."""
    return "\n".join((printer.program_header(program), *printer.step_texts(program), *("",) * (not program.steps)))


def list_steps(analysis: names.Analysis) -> tuple[replies.ListedStep, ...]:
    """Return the steps of a program in canonical form, with numbers. Steps with a mistake are marked as `bad`."""
    program, wrong = analysis.program, {one.span.line for one in diagnostics.errors(analysis.diagnostics)}
    return tuple(
        replies.ListedStep(number, text, bad=isinstance(step.statement, ast.BadLine) or step.span.line in wrong)
        for number, (step, text) in enumerate(zip(program.steps, printer.step_texts(program), strict=True), 1)
    )


# --- programs in memory ----------------------------------------------------------------------------------------------


def rebuild(program: ast.Program) -> tuple[ast.Program, str]:
    """Return the canonical text of a program, and the program with its steps parsed from this text, so that their spans
    match the text."""
    texts, steps = printer.step_texts(program), list[ast.Step]()
    for line, (step, text) in enumerate(zip(program.steps, texts, strict=True), FIRST_STEP_LINE):
        if isinstance(step.statement, ast.BadLine):
            span = diagnostics.Span(line, len(text) - len(text.lstrip()) + 1, len(text) + 1)
            steps.append(replace(step, statement=replace(step.statement, span=span), span=span))
        else:
            # any dialect would do: the printer writes parentheses that have the same meaning in every dialect
            steps.append(parser.parse_step(text, line, diagnostics.Dialect.VPLUS))
    header = printer.program_header(program)
    source = "\n".join((header, *texts, ".END", ""))
    return ast.resolve_program(
        replace(program, steps=tuple(steps), span=diagnostics.Span(1, 1, len(header) + 1))
    ), source


def store(station: Station, program: ast.Program) -> Dialogue[tuple[replies.Reply, ...]]:
    """Store an edited program in memory. Return replies: its first mistake, if any, and whether it can be executed."""
    whole, source = yield from beside_if(len(program.steps) > LONG_PROGRAM, lambda: rebuild(program))
    first = diagnostics.first_error((yield from station.keep(whole, source)))
    report: tuple[replies.Reply, ...] = ()
    if first is not None:
        report = (replies.DiagnosticsReport((replies.Diagnosed(first, source.split("\n")[first.span.line - 1]),)),)
    elif bad := [number for number, step in enumerate(whole.steps, 1) if isinstance(step.statement, ast.BadLine)]:
        report = (results.Message(str(ProgramNotExecutable(f"step {bad[0]} cannot be read", "retype it"))),)
    ready = "" if station.environment.program(whole.name).analysis.executable else "; it cannot be executed yet"
    return (*report, results.Message(f"Program {whole.name}: {numbers.count(len(whole.steps), 'step')}{ready}"))


def open_program(station: Station, asked: ast.Program, step: int = 1) -> Dialogue[ProgramBuffer]:
    """Return a buffer with a program from memory, or with a new program. `asked`: the name of the program, and the
    parameters, if any, that replace the program's own parameters. `step`: the step at the cursor, from 1. Raises
    UsageError if the program is running."""
    check_not_running(station, asked.name)
    stored = station.programs.get(key_of(asked.name))
    program = replace(asked, dialect=station.dialect) if stored is None else stored.program
    if asked.parameters:
        program = replace(program, parameters=asked.parameters)
    return (
        yield from beside_if(len(program.steps) > LONG_PROGRAM, lambda: ProgramBuffer.of_program(program, step - 1))
    )


def analysis_of(memory: Memory, program: ast.Program) -> names.Analysis:
    """Analyse a program together with the programs in memory. It replaces the stored program of the same name for the
    analysis."""
    programs = {key: one.program for key, one in memory.programs.items()} | {program.key: program}
    return analyzer.analyze(program, memory.kinds, programs)


def check_not_running(station: Station, name: str) -> None:
    """Check that a program is not running. Raises UsageError if it is."""
    if station.running and station.task is not None and station.task.uses(name):
        raise UsageError(f"{name} is running", "ABORT stops it")


def named_program(text: str) -> ast.Program:
    """Return an empty program with the name and parameters given in a string such as `pick(part, height)`. Raises
    LineRefused.
    """
    header = parser.parse_prompt(f".PROGRAM {text}")
    assert isinstance(header, ast.ProgramHeader)
    return ast.Program(header.name, header.parameters, (), None, span=diagnostics.Span(1, 1, 1))


def asked_program(expression: ast.Expression) -> ast.Program:
    """Return an empty program with the name and parameters given as an argument of EDIT or SEE. Raises IllegalValue."""
    given = expression.arguments if isinstance(expression, ast.ProgramCall) else ()
    parameters = tuple(one for one in given if isinstance(one, ast.Variable))
    if not isinstance(expression, ast.ProgramCall) or len(parameters) < len(given):
        raise IllegalValue("the parameters of a program are variables", "EDIT pick(part, height)")
    return ast.Program(expression.name, parameters, (), None, span=diagnostics.Span(1, 1, 1))
