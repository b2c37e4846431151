"""A session: a station (one robot with its programs, variables and clock) that a user drives line by line. It prints
nothing itself: each line becomes replies. A monitor command is carried out by its handler (`handles` in
`station/operands.py`); a handler that asks questions between its replies is a generator, so each reply is shown before
the next question. The command COMMANDS carries out the lines of a command file until one fails. The commands stand
between `.PROGRAM name` and `.END`, or alone in the file; `MC` before a command (from command programs of V+), blank
lines and comments are accepted. After EDIT the lines up to `E` go to the editor."""

from __future__ import annotations

import os
import re
from collections import ChainMap
from collections.abc import Container, Iterator, Mapping
from types import MappingProxyType
from typing import Any, NamedTuple, cast

from vrs_cli.engine.book import Book, displacement
from vrs_cli.engine.branches import MAIN
from vrs_cli.errors import CannotInterpret, UsageError, VrsError
from vrs_cli.files.program_file import find_program_file, read_program_file
from vrs_cli.interfaces.dialogue import Dialogue, Said
from vrs_cli.interfaces.jog import jogger  # noqa: F401 (imported for the handler of JOG)
from vrs_cli.interfaces.monitor import explaining, files, locations, programs, state, timeline  # noqa: F401 (for their handlers)
from vrs_cli.interfaces.station import operands, station
from vrs_cli.interfaces.tasks.observations import changed_since, untrue
from vrs_cli.interfaces.users import check_beside, need_of
from vrs_cli.language.analysis import analyzer, structure
from vrs_cli.language.text import ast, parser
from vrs_cli.language.words.word import Role
from vrs_cli.trajectory.timeline import Timeline
from vrs_cli.values import diagnostics, replies, results

_MC = re.compile(r"(\s*)MC(?=\s)", re.IGNORECASE)


class _Reading(NamedTuple):
    """A prompt line, its parsed statement, and the mistakes and warnings found in it."""

    line: str
    statement: ast.Statement | ast.ProgramHeader | None
    findings: tuple[diagnostics.Diagnostic, ...]


class Session(station.Station):
    """A station (one robot with its programs, variables and clock) with a prompt: it takes lines, and returns
    replies."""

    _read: _Reading | None = None  # the last line that `mistake` has checked, so that it need not be parsed again
    # the books (records of changes) and timelines of main and of the current branch when the current line began
    _scheduled: Mapping[str, tuple[Book, Timeline]] = MappingProxyType({})

    # values of signals that programs have read and that a later change of the motion has made wrong, as far as the user
    # has been warned of them
    warned_untrue: tuple[results.Untrue, ...] = ()

    @property
    def prompt(self) -> str:
        """The prompt: a dot as in VAL, after the name of the branch in parentheses unless that is main."""
        return "." if self.branches.present == MAIN else f"({self.branches.present})."

    def perform(self, line: str) -> None:
        """Parse, check and carry out one line of the prompt or of the editor. The terminal shows its replies. Raises
        LineRefused for a line that cannot be parsed or has a mistake, and VrsError if it cannot be carried out."""
        self.converse(self.answers(line))

    def answers(self, line: str) -> Dialogue[None]:
        """Carry out one line as `perform` does, and yield its replies and questions. Raises LineRefused, VrsError;
        RoleWanted and LeaseHeld if the user may not do this.
        """
        self.serve()
        self.settle()
        yield from self._attend()
        editor = self.user_state.editor
        if editor is not None and self.user_state.role is Role.SUPERVISOR:
            said = yield from editor.take(line)
            self.user_state.last_edited = editor.name
            self.user_state.editor = None if editor.done else editor
            yield from said
        else:
            yield from self._carry_out_line(line)
        yield from self._attend()

    def _attend(self) -> Dialogue[None]:
        """Ask the questions of tasks, which then continue. Do nothing for a user who continues typing while programs
        run: the front end asks this user."""
        while not self.user_state.lives and self.driver.open_questions():
            yield from self.ask_for_tasks()

    def ask_for_tasks(self) -> Dialogue[None]:
        """Ask the user the questions of tasks (PROMPT); the tasks then continue."""
        yield from self.driver.ask()
        self.settle()

    def _carry_out_line(self, line: str) -> Dialogue[None]:
        read, self._read = self._read if self._read and self._read.line == line else self._read_line(line), None
        if (statement := read.statement) is None:
            return
        if isinstance(statement, ast.ProgramHeader):
            raise UsageError(
                ".PROGRAM opens a program of several lines", "type it at the prompt of vrs, or LOAD a file"
            )
        said, role = need_of(statement)
        self.check_may(said, role)
        beyond = structure.line_beyond(statement, self.dialect, vplus=self.engine.settings.switch("VPLUS"))
        found = (*read.findings, *beyond)
        if (wrong := diagnostics.first_error(found)) is not None:
            raise diagnostics.LineRefused(wrong)
        if found:
            yield replies.DiagnosticsReport(tuple(replies.Diagnosed(warning, read.line) for warning in found))
        if self.running or self.elsewhere:
            check_beside(statement, elsewhere=self.elsewhere)
        self._scheduled = self._schedules()
        yield from self.on_branch(role, self.carry_out(statement))
        yield from self._tell_displaced()

    def _schedules(self) -> dict[str, tuple[Book, Timeline]]:
        """Return, by branch, the book (the record of changes) and the timeline of main and of the current branch."""
        books = {self.branches.present: self.engine.book}
        if self.branches.present != MAIN:
            books[MAIN] = self.branches.book(MAIN)
        return {name: (book, book.timeline) for name, book in books.items()}

    def _tell_displaced(self) -> Iterator[replies.Reply]:
        """Report motions whose times have changed, and readings of signals that no longer hold, since the current line
        or the previous line of a command file began."""
        book, before = self._scheduled.get(self.branches.present, (None, None))
        self._scheduled = self._schedules()
        if book is not self.engine.book:
            self.warned_untrue = ()  # the user has moved to another branch; these warnings were about the previous one
        if book is None or before is None or book is not self.engine.book or book.timeline is before:
            return
        if (found := displacement(book, before)) is not None:
            yield replies.Displaced(found)
        if book.timeline.event_count:
            changes = book.deltas[len(book.deltas) - (book.timeline.version - before.version) :]
            since = changed_since(before, book.timeline, changes)
            wrong = tuple(untrue(book, self.environment.signals, since))
            known = {one.number for one in self.warned_untrue}
            if new := tuple(one for one in wrong if one.number not in known):
                yield replies.NoLongerTrue(new)
            self.warned_untrue = (*(one for one in self.warned_untrue if one.time < since), *wrong)

    def names(self) -> Container[str]:
        """Return the keys of all variables that have a value, including the own variables of the stopped program."""
        known = self.environment.kinds
        defined = {key: one for key, one in operands.own_variables(self).items() if one.has_value()}
        return ChainMap(defined, cast(Any, known)) if defined else known

    def mistake(self, line: str) -> diagnostics.Diagnostic | None:
        """Return the first mistake in a line that is still being typed; None if there is none. The parsed line is kept,
        so that `answers` need not parse it again."""
        try:
            read = self._read_line(line)
        except diagnostics.LineRefused as refused:
            return refused.diagnostic
        self._read = read
        return diagnostics.first_error(read.findings)

    def _read_line(self, line: str) -> _Reading:
        """Parse and check a line. Return the statement and the findings. Raises LineRefused if it cannot be parsed."""
        statement = parser.parse_prompt(line, self.names(), self.dialect)
        if statement is None or isinstance(statement, ast.ProgramHeader):
            return _Reading(line, statement, ())
        found = analyzer.check_line(statement, self.environment.kinds)
        if ";" in line:
            comment = line[statement.span.end - 1 :].partition(";")[2]
            found = (*found, *analyzer.hidden_statement(statement, comment, len(line) + 1))
        return _Reading(line, statement, found)

    def carry_out(self, statement: ast.Statement) -> Dialogue[None]:
        """Carry out a statement: a monitor command by its handler, any other statement as DO does."""
        if isinstance(statement, ast.Instruction) and statement.word in operands.HANDLERS:
            yield from operands.HANDLERS[statement.word](self, statement) or ()
        elif isinstance(statement, ast.ExplainCommand):
            yield from explaining.explain(self, statement)
        elif isinstance(statement, ast.Show):
            yield from locations.show_value(self, statement.expression)
        elif isinstance(statement, ast.DoInstruction):
            if (repeated := statement.statement or self.user_state.last_statement) is None:
                raise UsageError("there is no instruction to repeat", "DO instruction")
            yield from self.do(repeated)
        else:
            yield from self.do(statement)


# --- command files ---------------------------------------------------------------------------------------------------


class CommandLine(NamedTuple):
    """A command in a command file. `number`: the number of its line, from 1."""

    number: int
    text: str


def command_lines(text: str) -> tuple[CommandLine, ...]:
    """Return the commands in the text of a command file, without `MC`. Raises CannotInterpret if the file contains
    anything else."""
    lines = [line for line in parser.lines_of(text) if line.text.strip()]
    found: list[CommandLine] = []
    opened = closed = False
    for line in lines:
        remark = line.text.lstrip().startswith(";")
        if line.directive in parser.SECTIONS or (line.directive == parser.PROGRAM and opened):
            raise CannotInterpret(f"line {line.number}: {line.directive}", "a command file holds one .PROGRAM to .END")
        if line.directive == parser.PROGRAM and not found:
            opened = True
        elif line.directive == parser.END and opened:
            closed = True
        elif closed and not remark:
            raise CannotInterpret(f"line {line.number} stands after .END", "a command file ends there")
        elif not remark:
            found.append(CommandLine(line.number, _MC.sub(r"\1", line.text, count=1).strip()))
    return tuple(found)


@operands.handles("COMMANDS")
def carry_out_file(session: Session, it: ast.Instruction) -> Dialogue[None]:
    """Carry out the commands in a file (COMMANDS) until one fails; a message then names its line. Raises
    NonexistentFile, FileError, FileDamaged, CannotInterpret, UsageError."""
    path = find_program_file(operands.path_of(session, it))
    lines = command_lines(read_program_file(path, session.folder))
    if any(os.path.samefile(path, other) for other in session.user_state.command_files):
        raise UsageError(f"{path} is being carried out", "a command file cannot call itself")
    session.user_state.command_files.append(path)
    try:
        for line in lines:
            failed = leaving = False
            try:
                for_line = session.answers(line.text)
                said = next(for_line, None)
                while said is not None:
                    failed = failed or (isinstance(said, replies.Reply) and replies.is_error(said))
                    leaving = leaving or isinstance(said, replies.Farewell)
                    said = yield from _pass_on(for_line, said)
            except VrsError as error:
                failed = True
                yield replies.refusal(error, line.text)
            if failed:
                session.user_state.editor = None
                yield results.Message(f"{path} stopped at line {line.number}: {line.text}", results.Tone.ERROR)
            if failed or leaving or session.user_state.interrupted:
                return
    finally:
        session.user_state.command_files.pop()


def _pass_on(dialogue: Dialogue[None], said: Said) -> Dialogue[Said | None]:
    """Yield what another dialogue has yielded (`said`), pass the answer or error to that dialogue, and return what it
    yields next; None at its end."""
    try:
        try:
            answer = yield said
        except (Exception, KeyboardInterrupt) as error:
            return dialogue.throw(error)
        return dialogue.send(answer)
    except StopIteration:
        return None
