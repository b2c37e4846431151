"""SEE without its screen: a program as one text, what is wrong with it, its canonical form, and how it is stored.

The text is the `.PROGRAM` line and one line a step; `.END` is not shown, as in VAL's editors.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

from vrs_cli.errors import CannotInterpret, ProgramExists
from vrs_cli.interfaces.dialogue import Dialogue, beside_if
from vrs_cli.interfaces.editor.lines import analysis_of, opened, refuse_running, stored
from vrs_cli.interfaces.station.loaded_file import LONG_TEXT
from vrs_cli.interfaces.station.station import Station
from vrs_cli.language.text.ast import BadLine, Program, ProgramHeader, Step
from vrs_cli.language.text.meaning import resolve_program
from vrs_cli.language.text.parser import parse_prompt, parse_step
from vrs_cli.language.text.printer import program_header, step_texts
from vrs_cli.language.words.values import key_of
from vrs_cli.values.acts import Findings, KeepDraft, Kept, ReadDraft
from vrs_cli.values.diagnostics import Diagnostic, Dialect, LineRefused, Span, error, in_order
from vrs_cli.values.replies import Message, Reply


class ProgramReading(NamedTuple):
    """A text as a program, None where its heading cannot be read, and everything that is wrong with it by line."""

    program: Program | None
    findings: tuple[Diagnostic, ...]


Found = Callable[[tuple[Diagnostic, ...]], None]


class ScreenDraft:
    """A program of a station while it is edited as a text."""

    def __init__(self, station: Station, asked: Program, step: int = 1) -> None:
        self._station = station
        draft = opened(station, asked, step)
        self.name, self.dialect = draft.program.name, draft.program.dialect
        self.text = program_text(draft.program)
        self.row = draft.at + 1 if draft.at < len(draft.steps) else max(len(draft.steps), 1)
        self.said: tuple[Reply, ...] = ()
        self._stored = self.text

    def do(self, act: ReadDraft | KeepDraft) -> Dialogue[Findings | Kept]:
        """Look at the text, which is the draft from now on, or store it. Raises LineRefused, ProgramExists for the name
        of another program.
        """
        self._station.user_state.drafted = "" if act.text == self._stored else f"{act.text}\n.END\n"
        program, findings = yield from read_among(self._station, act.text, self.dialect)
        if isinstance(act, ReadDraft):
            return Findings(findings)
        if program is None:
            raise LineRefused(findings[0])
        if program.key != key_of(self.name) and program.key in self._station.programs:
            raise ProgramExists(program.name, "give this one another name")
        self.said = yield from stored(self._station, program)
        self.name = self._station.user_state.last_edited = program.name
        self._stored, self._station.user_state.drafted = act.text, ""
        return _kept(self.name, self.said)


def done_without_screen(station: Station, act: ReadDraft | KeepDraft) -> Dialogue[Findings | Kept]:
    """Look at the text of a program, or store it in place of the one of its name. Raises LineRefused where its heading
    cannot be read, UsageError for a program that runs.
    """
    header = read_header(act.text.partition("\n")[0])
    before = station.programs.get(key_of(header.name)) if isinstance(header, ProgramHeader) else None
    dialect = station.dialect if before is None else before.program.dialect
    program, findings = yield from read_among(station, act.text, dialect)
    if isinstance(act, ReadDraft):
        return Findings(findings)
    if program is None:
        raise LineRefused(findings[0])
    refuse_running(station, program.name)
    said = yield from stored(station, program)
    station.user_state.last_edited = program.name
    return _kept(program.name, said)


def _kept(name: str, said: tuple[Reply, ...]) -> Kept:
    return Kept(name, next((one.text for one in reversed(said) if isinstance(one, Message)), ""))


def program_text(program: Program) -> str:
    """Return a program as SEE shows it, with one empty step where it has none."""
    return "\n".join((program_header(program), *step_texts(program), *("",) * (not program.steps)))


def read_among(station: Station, text: str, dialect: Dialect) -> Dialogue[ProgramReading]:
    """Read a text among the programs in memory; another thread reads a long one, among a copy of the memory."""
    environment, long = station.environment, len(text) > LONG_TEXT
    memory = environment.copy() if long else environment

    def work() -> ProgramReading:
        program, findings = read(text, dialect)
        if program is None:
            return ProgramReading(None, findings)
        return ProgramReading(program, in_order((*findings, *analysis_of(memory, program).diagnostics)))

    return (yield from beside_if(long, work))


def read(text: str, dialect: Dialect) -> ProgramReading:
    """The program of a text, and the lines that cannot be read."""
    first, *rest = text.split("\n")
    header = read_header(first)
    while rest and not rest[-1].strip():  # blank lines at the end are no steps
        rest.pop()
    steps = [read_step(line, number, dialect) for number, line in enumerate(rest, 2)]
    findings = tuple(found for _, found in steps if found is not None)
    if isinstance(header, Diagnostic):
        return ProgramReading(None, (header, *findings))
    body = tuple(step for step, _ in steps)
    program = Program(header.name, header.parameters, body, header.comment, dialect, span=header.span)
    return ProgramReading(resolve_program(program), findings)


def canonical(text: str, dialect: Dialect) -> str:
    """Keywords in upper case, names in lower case, blocks indented; lines that cannot be read as they are."""
    program = read(text, dialect).program
    if program is None:
        return text
    typed, count = text.split("\n")[1:], len(program.steps)
    rows = zip(program.steps, step_texts(program), typed, strict=False)
    shown = (line if isinstance(step.statement, BadLine) else text for step, text, line in rows)
    return "\n".join((program_header(program), *shown, *map(str.strip, typed[count:])))


def canonical_line(text: str, row: int, dialect: Dialect) -> str:
    """One line of the text (from 0), as it is when the cursor leaves it."""
    lines, changed = text.split("\n"), canonical(text, dialect).split("\n")
    return changed[row] if row < len(changed) else lines[row]


def read_header(line: str) -> ProgramHeader | Diagnostic:
    """The heading, or what is wrong with it."""
    try:
        header = parse_prompt(line)
    except LineRefused as refused:
        return refused.diagnostic
    if isinstance(header, ProgramHeader):
        return header
    return error(CannotInterpret, Span(1, 1, len(line) + 1), "the first line names the program", ".PROGRAM name")


def read_step(text: str, line: int, dialect: Dialect) -> tuple[Step, Diagnostic | None]:
    """A step, or a bad line with what is wrong. Raises nothing."""
    try:
        return parse_step(text, line, dialect), None
    except LineRefused as refused:
        span = Span(line, len(text) - len(text.lstrip()) + 1, len(text.rstrip()) + 1)
        return Step(None, BadLine(text.strip(), span=span), None, span=span), refused.diagnostic
