"""EDIT, the line editor of VAL-II (val2 section 3.6), and SEE without its screen. Both work on a `ProgramBuffer` and do
not depend on a terminal. A line of EDIT is a sub-command (a letter and its argument, see `SUBCOMMANDS`) or an
instruction that replaces the step at the cursor. A letter before `=` or `[` is a variable: `d = 4` is an assignment, `D
4` deletes four steps. The program in memory changes only when `E` or `C` ends EDIT, or when SEE stores: then the
program is stored and its structure is checked."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, NamedTuple, TypeVar

from vrs_cli.errors import IllegalValue, NotAvailable, ProgramExists, UsageError
from vrs_cli.interfaces.dialogue import Dialogue, beside_if
from vrs_cli.interfaces.editor.buffer import (
    ProgramBuffer,
    ProgramReading,
    check_not_running,
    closes_entry,
    named_program,
    open_program,
    read_header,
    store,
)
from vrs_cli.interfaces.station.loaded_file import LONG_PROGRAM, LONG_TEXT
from vrs_cli.language.run.memory import Memory
from vrs_cli.language.text import ast, parser, printer
from vrs_cli.language.words.values import key_of
from vrs_cli.values import acts, diagnostics, numbers, results
from vrs_cli.values.replies import Diagnosed, DiagnosticsReport, ProgramPart, Reply

if TYPE_CHECKING:
    from vrs_cli.interfaces.station.station import Station

W = TypeVar("W")
Replies = tuple[Reply, ...]
_SUBCOMMAND = re.compile(r"\s*(?P<word>[A-Za-z]{1,2})(?:\s+(?P<argument>(?![=\[]).*))?$")
_STEP_NUMBER = re.compile(r"\d{1,9}$")


# --- sub-commands of EDIT --------------------------------------------------------------------------------------------


class _Context(NamedTuple):
    """The input of a sub-command. `buffer`: the edited program; `memory`: the stored programs and variables;
    `argument`: the text after the letter; `line`: the whole line."""

    buffer: ProgramBuffer
    memory: Memory
    argument: str
    line: str

    def number(self, form: str) -> int:
        """Return the argument as a step number or a number of steps; 1 if it is empty. `form`: the correct form, for
        the error message. Raises IllegalValue."""
        if not self.argument:
            return 1
        if _STEP_NUMBER.match(self.argument) is None or int(self.argument) == 0:
            raise IllegalValue(self.argument, f"{form}: a number from 1 on")
        return int(self.argument)


def _check_alone(argument: str, letter: str) -> None:
    """Check that nothing follows the letter of a sub-command. Raises UsageError."""
    if argument:
        raise UsageError(f"{letter} {argument}", f"{letter} stands alone")


def _delete(it: _Context) -> Replies:
    gone = it.buffer.delete(it.number("D n, n steps"))
    if not gone:
        raise IllegalValue("D", "there is no step here to delete")
    return (results.Message(f"{numbers.count(gone, 'step')} deleted"),)


def _find(it: _Context) -> None:
    """Move the cursor to the next step that contains the text, ignoring case. The search continues at the first step
    after the last one."""
    if not it.argument:
        raise UsageError("F without a text", "F text")
    buffer, wanted = it.buffer, it.argument.strip()
    order = [*range(buffer.at + 1, len(buffer.lines)), *range(min(buffer.at + 1, len(buffer.lines)))]
    found = next((at for at in order if wanted.lower() in buffer.lines[at].lower()), None)
    if found is None:
        raise UsageError(f"no step holds {wanted}", "F looks for text as it is listed")
    buffer.move(found)


def _insert(it: _Context) -> None:
    _check_alone(it.argument, "I")
    it.buffer.inserting = True


def _print(it: _Context) -> Replies:
    buffer, wanted = it.buffer, it.number("P n, n steps")
    steps = buffer.show(buffer.at, wanted, it.memory)
    buffer.move(buffer.at + wanted)
    return (ProgramPart("", steps),) if steps else ()


def _overlay(it: _Context) -> None:
    """Replace characters of the current step by the characters typed below them; a typed blank keeps the character
    above it."""
    buffer, line = it.buffer, it.line
    if buffer.at == len(buffer.lines):
        raise IllegalValue("R", "there is no step here to change")
    program = buffer.read().program
    assert program is not None
    above, first = printer.step_texts(program)[buffer.at], len(line) - len(line.lstrip())
    # replace the letter R by a blank, so that the text stays in its columns
    below = f"{line[:first]} {line[first + 1 :]}"
    width = max(len(above), len(below.rstrip()))
    text = "".join(
        old if new.isspace() else new for old, new in zip(above.ljust(width), below.ljust(width)[:width], strict=True)
    )
    parser.parse_step(text, 1, buffer.dialect)  # only to check the line: raises LineRefused
    at, buffer.inserting = buffer.at, False
    buffer.add(text)
    buffer.move(at)


def _teach(_it: _Context) -> None:
    raise NotAvailable(
        "T and TS record places with the pendant, and there is none",
        "leave by E, define places by HERE, and write MOVE or MOVES",
    )


class Subcommand(NamedTuple):
    """A sub-command of EDIT: its form, its description, and the function that carries it out and returns replies or
    None."""

    form: str
    summary: str
    act: Callable[[_Context], Replies | None]


SUBCOMMANDS: Mapping[str, Subcommand] = {
    "D": Subcommand("D [n]", "delete n steps from here", _delete),
    "F": Subcommand("F text", "go to the next step that holds the text", _find),
    "I": Subcommand("I", "insert lines before this step, until an empty line", _insert),
    "L": Subcommand(
        "L [n]", "go back one step, or n", lambda it: it.buffer.move(it.buffer.at - it.number("L n, n steps"))
    ),
    "P": Subcommand("P [n]", "print n steps and stand behind them", _print),
    "R": Subcommand("R text", "replace the characters above the text; a blank keeps one", _overlay),
    "S": Subcommand(
        "S [step]", "go to a step, the first where none is named", lambda it: it.buffer.move(it.number("S step") - 1)
    ),
    "T": Subcommand("T", "record MOVEs with the pendant (there is none)", _teach),
    "TS": Subcommand("TS", "record MOVESs with the pendant (there is none)", _teach),
}
LEAVING: Mapping[str, str] = {"E": "store the program, check it, and leave", "C": "C program [,step]: edit another"}


def subcommand(line: str) -> tuple[str, str] | None:
    """Return the letter of a sub-command, in upper case, and the text after it; None if the line is an instruction."""
    if (found := _SUBCOMMAND.match(line.rstrip())) is None or found["word"].upper() not in {*SUBCOMMANDS, *LEAVING}:
        return None
    return found["word"].upper(), found["argument"] or ""


def edit_line(buffer: ProgramBuffer, line: str, memory: Memory) -> Replies:
    """Carry out a line of EDIT other than E and C. Return its replies. Raises LineRefused for an instruction that
    cannot be parsed, VrsError for a wrong sub-command; in both cases the buffer is unchanged."""
    if not line.strip():
        buffer.move(buffer.at if buffer.inserting else buffer.at + 1)
        return ()
    if (asked := subcommand(line)) is not None:
        letter, argument = asked
        return SUBCOMMANDS[letter].act(_Context(buffer, memory, argument, line)) or ()
    step, warnings = buffer.check(line, memory.kinds)
    buffer.add(printer.step_texts(ast.Program("", (), (step,), None, buffer.dialect, span=step.span))[0])
    return (DiagnosticsReport(tuple(Diagnosed(one, line) for one in warnings)),) if warnings else ()


def _among_memory(station: Station, long: bool, work: Callable[[Memory], W]) -> Dialogue[W]:
    """Call a function that reads the memory. If the work is `long`, another thread does it with a copy of the
    memory."""
    memory = station.environment.copy() if long else station.environment
    return (yield from beside_if(long, lambda: work(memory)))


class Editor:
    """The open line editor EDIT: it holds a program of a station (one robot with its programs and variables) in a
    buffer until `E` stores it."""

    def __init__(self, station: Station, buffer: ProgramBuffer) -> None:
        self._station = station
        self.done = False
        self._open(buffer)

    def _open(self, buffer: ProgramBuffer) -> None:
        self.buffer, self.name, self._opened = buffer, buffer.name, buffer.lines.copy()

    @property
    def prompt(self) -> str:
        return self.buffer.prompt

    @property
    def source(self) -> str:
        return self.buffer.source

    @property
    def changed(self) -> bool:
        """Return whether leaving the editor without E would lose changes."""
        return self.buffer.lines != self._opened

    def take(self, line: str) -> Dialogue[Replies]:
        """Carry out a line. Return its replies. Raises LineRefused, VrsError; the editor then prompts for the same step
        again."""
        letter, argument = subcommand(line) or ("", "")
        if letter == "E" or closes_entry(line):
            _check_alone(argument, "E")
            replies = yield from self._store()
            self.done = True
            return replies
        if letter == "C":
            return (yield from self._change(argument))

        def work(memory: Memory) -> Replies:
            buffer = self.buffer
            replies = edit_line(buffer, line, memory)
            steps = () if buffer.inserting else buffer.show(buffer.at, 1, memory)
            return (*replies, ProgramPart("", steps)) if steps else replies

        return (yield from _among_memory(self._station, len(self.buffer.lines) > LONG_PROGRAM, work))

    def screen(self) -> Dialogue[Replies]:
        """Return what is shown when EDIT opens: the heading and the current step."""
        buffer = self.buffer
        return _among_memory(
            self._station,
            len(buffer.lines) > LONG_PROGRAM,
            lambda memory: (ProgramPart(buffer.header, buffer.show(buffer.at, 1, memory)),),
        )

    def mistake(self, line: str) -> diagnostics.Diagnostic | None:
        """Return the mistake in an instruction that is still being typed; None if there is no mistake, or if the line
        is a sub-command."""
        if not line.strip() or subcommand(line) is not None:
            return None
        return self.buffer.mistake(line, self._station.environment.kinds)

    def _store(self) -> Dialogue[Replies]:
        program = (yield from beside_if(len(self.buffer.lines) > LONG_PROGRAM, self.buffer.read)).program
        assert program is not None
        return (yield from store(self._station, program))

    def _change(self, argument: str) -> Dialogue[Replies]:
        """Store the program, and open the program named in the argument (sub-command C)."""
        name, comma, step = (part.strip() for part in argument.partition(","))
        if not name or (comma and not step):
            raise UsageError("C", LEAVING["C"])
        at = _Context(self.buffer, self._station.environment, step, "").number("C program, step")
        program = named_program(name)
        check_not_running(self._station, program.name)
        replies = yield from self._store()
        self._open((yield from open_program(self._station, program, at)))
        return (*replies, *(yield from self.screen()))


# --- SEE -------------------------------------------------------------------------------------------------------------


class ScreenDraft:
    """The state of SEE: a program of a station (one robot with its programs and variables), edited as a whole, without
    `.END`. `row`: the line of the cursor, from 0. `said`: the replies of the last storing."""

    def __init__(self, station: Station, buffer: ProgramBuffer) -> None:
        self._station = station
        self.name, self.dialect = buffer.name, buffer.dialect
        self.text = buffer.text if buffer.lines else f"{buffer.text}\n"
        self.row = buffer.at + 1 if buffer.at < len(buffer.lines) else max(len(buffer.lines), 1)
        self.said: Replies = ()
        self._stored = self.text

    def do(self, act: acts.ReadDraft | acts.KeepDraft) -> Dialogue[acts.Findings | acts.Kept]:
        """Find the mistakes in the text and keep it as the draft (ReadDraft), or store it (KeepDraft). Raises
        LineRefused, and ProgramExists if its heading has the name of another program."""
        user_state, programs = self._station.user_state, self._station.programs
        user_state.drafted = "" if act.text == self._stored else f"{act.text}\n.END\n"
        program, findings = yield from _read_text(self._station, act.text, self.dialect)
        if isinstance(act, acts.ReadDraft):
            return acts.Findings(findings)
        if program is not None and program.key != key_of(self.name) and program.key in programs:
            raise ProgramExists(program.name, "give this one another name")
        kept, self.said = yield from _keep_text(self._station, program, findings)
        self.name, self._stored, user_state.drafted = kept.name, act.text, ""
        return kept


def do_without_screen(station: Station, act: acts.ReadDraft | acts.KeepDraft) -> Dialogue[acts.Findings | acts.Kept]:
    """Find the mistakes in the text of a program (ReadDraft), or store it in place of the program of the same name
    (KeepDraft). Raises LineRefused if the heading cannot be parsed, UsageError if the program is running."""
    header = read_header(act.text.partition("\n")[0])
    before = station.programs.get(key_of(header.name)) if isinstance(header, ast.ProgramHeader) else None
    dialect = station.dialect if before is None else before.program.dialect
    program, findings = yield from _read_text(station, act.text, dialect)
    if isinstance(act, acts.ReadDraft):
        return acts.Findings(findings)
    if program is not None:
        check_not_running(station, program.name)
    return (yield from _keep_text(station, program, findings))[0]


def _read_text(station: Station, text: str, dialect: diagnostics.Dialect) -> Dialogue[ProgramReading]:
    """Parse the text of a program, and analyse it together with the programs in memory."""
    return _among_memory(
        station, len(text) > LONG_TEXT, lambda memory: ProgramBuffer.of_text(text, dialect).read_among(memory)
    )


def _keep_text(
    station: Station, program: ast.Program | None, findings: tuple[diagnostics.Diagnostic, ...]
) -> Dialogue[tuple[acts.Kept, Replies]]:
    """Store a program that `_read_text` has parsed. `findings`: the mistakes in its text. Raises LineRefused if its
    heading could not be parsed (`program` is None)."""
    if program is None:
        raise diagnostics.LineRefused(findings[0])
    said = yield from store(station, program)
    station.user_state.last_edited = program.name
    return acts.Kept(
        program.name, next((one.text for one in reversed(said) if isinstance(one, results.Message)), "")
    ), said
