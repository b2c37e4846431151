"""A session: a station driven line by line. It prints nothing itself.

`HANDLERS` says who carries out which monitor command, from a checked instruction to replies. One that asks questions
between its replies is a generator: each reply is shown before the next question.
"""

from __future__ import annotations

from collections.abc import Callable, Container, Iterable, Iterator, Mapping
from types import MappingProxyType
from typing import NamedTuple

from msgspec import Struct

from vrs_cli.engine.book import Book
from vrs_cli.engine.branches import MAIN
from vrs_cli.engine.displacement import displacement
from vrs_cli.errors import UsageError
from vrs_cli.interfaces.dialogue import Dialogue
from vrs_cli.interfaces.jog.jogger import jog
from vrs_cli.interfaces.monitor.clock import clock
from vrs_cli.interfaces.monitor.files import FILES
from vrs_cli.interfaces.monitor.locations import LOCATIONS
from vrs_cli.interfaces.monitor.programs import PROGRAMS
from vrs_cli.interfaces.monitor.running import RUNNING
from vrs_cli.interfaces.monitor.state import STATE
from vrs_cli.interfaces.monitor.stepping import STEPPING
from vrs_cli.interfaces.monitor.timeline import TIMELINE
from vrs_cli.interfaces.monitor.variables import VARIABLES, shown_value
from vrs_cli.interfaces.rights import check_beside, needed
from vrs_cli.interfaces.session.command_file import carry_out_file
from vrs_cli.interfaces.station.operands import path_of
from vrs_cli.interfaces.station.station import Station
from vrs_cli.language.analysis.analyzer import check_line
from vrs_cli.language.analysis.lineage import beyond_dialect, beyond_val2
from vrs_cli.language.text.ast import (
    DoInstruction,
    Instruction,
    ProgramHeader,
    Show,
    Statement,
)
from vrs_cli.language.text.parser import parse_prompt
from vrs_cli.language.words.word import Role
from vrs_cli.trajectory.timeline import Timeline
from vrs_cli.values.diagnostics import Diagnostic, LineRefused, first_error
from vrs_cli.values.replies import Diagnosed, DiagnosticsReport, Displaced, Reply


class _Either(Struct, frozen=True):
    """What one or the other contains."""

    one: Container[str]
    other: Container[str]

    def __contains__(self, key: object) -> bool:
        return key in self.one or key in self.other


class _Reading(NamedTuple):
    """A line of the prompt, what it says, and what the analyzer finds in it."""

    line: str
    statement: Statement | ProgramHeader | None
    findings: tuple[Diagnostic, ...]


class Session(Station):
    """A station with a prompt: lines in, replies out."""

    _read: _Reading | None = None  # a line that was found without mistake, before it is sent
    # the books of main and of the present branch with their timelines when the present line began
    _scheduled: Mapping[str, tuple[Book, Timeline]] = MappingProxyType({})

    @property
    def prompt(self) -> str:
        """VAL's dot, after the name of the branch where one is tried."""
        return "." if self.branches.on_main else f"({self.branches.present})."

    def perform(self, line: str) -> None:
        """One line of the prompt, or of the editor: parse it, check it, do it. Answers go to the terminal.

        Raises LineRefused for a line that cannot be read or checked, and VrsError for what cannot be done.
        """
        self.converse(self.answers(line))

    def answers(self, line: str) -> Dialogue[None]:
        """What `perform` shows and asks, as it comes. Raises LineRefused, VrsError; RoleWanted and LeaseHeld for what
        who is at the desk may not do.
        """
        self.serve()
        self.settle()
        yield from self._attend()
        editor = self.user_state.editor
        if editor is not None and self.user_state.role is Role.SUPERVISOR:
            replies = yield from editor.take(line)
            self.user_state.last_edited = editor.name
            self.user_state.editor = None if editor.done else editor
            yield from replies
        else:
            yield from self._answered(line)
        yield from self._attend()

    def _attend(self) -> Dialogue[None]:
        """Put the questions of tasks, which go on then. A prompt that lives puts them by itself."""
        while not self.user_state.lives and self.driver.unasked():
            yield from self.driver.ask()
            self.settle()

    def _answered(self, line: str) -> Dialogue[None]:
        read, self._read = self._read if self._read and self._read.line == line else self._reading(line), None
        statement = read.statement
        if statement is None:
            return
        if isinstance(statement, ProgramHeader):
            raise UsageError(
                ".PROGRAM opens a program of several lines", "type it at the prompt of vrs, or LOAD a file"
            )
        said, role = needed(statement)
        self.check_may(said, role)
        yield from self._check(statement, read)
        if self.running or self.elsewhere:
            check_beside(statement, elsewhere=self.elsewhere)
        self._scheduled = self._schedules()
        yield from self.on_branch(role, self.carry_out(statement))
        yield from self._displaced()

    def _schedules(self) -> dict[str, tuple[Book, Timeline]]:
        """What is scheduled on main and on the present branch."""
        books = {MAIN: self.branches.book(MAIN), self.branches.present: self.engine.book}
        return {name: (book, book.timeline) for name, book in books.items()}

    def _displaced(self) -> Iterator[Reply]:
        """What has moved since the line began, or since a line of its own (COMMANDS) told it."""
        book, before = self._scheduled.get(self.branches.present, (None, None))
        self._scheduled = self._schedules()
        if before is not None and book is self.engine.book and (found := displacement(book, before)) is not None:
            yield Displaced(found)

    def names(self) -> Container[str]:
        """The keys of the variables that have a value, those among them that a stopped program has for itself."""
        own = {} if self.task is None else self.task.own
        defined = frozenset(key for key, one in own.items() if one.defined())
        known = self.environment.kinds()
        return _Either(defined, known) if defined else known

    def mistake(self, line: str) -> Diagnostic | None:
        """The first mistake in a line that is not sent yet. One without is remembered: it need not be read again."""
        try:
            read = self._reading(line)
        except LineRefused as refused:
            return refused.diagnostic
        self._read = read
        return first_error(read.findings)

    def _reading(self, line: str) -> _Reading:
        """Raises LineRefused for a line that cannot be read."""
        statement = parse_prompt(line, self.names(), self.dialect)
        if statement is None or isinstance(statement, ProgramHeader):
            return _Reading(line, statement, ())
        return _Reading(line, statement, check_line(statement, self.environment.kinds()))

    def _check(self, statement: Statement, read: _Reading) -> Iterator[Reply]:
        """Raises LineRefused for the first error; warnings are answered."""
        found = read.findings
        found += tuple(beyond_dialect(statement, self.dialect))
        found += () if self.robot.switch("VPLUS") else tuple(beyond_val2(statement, at_prompt=True))
        wrong = first_error(found)
        if wrong is not None:
            raise LineRefused(wrong)
        if found:
            yield DiagnosticsReport(tuple(Diagnosed(warning, read.line) for warning in found))

    def carry_out(self, statement: Statement) -> Dialogue[None]:
        """A monitor command by its handler, everything else as DO."""
        if isinstance(statement, Instruction) and statement.word in HANDLERS:
            yield from HANDLERS[statement.word](self, statement) or ()
            return
        if isinstance(statement, Show):
            yield from shown_value(self, statement.expression)
            return
        if isinstance(statement, DoInstruction):
            if statement.statement is None and self.user_state.last_statement is None:
                raise UsageError("there is no instruction to repeat", "DO instruction")
            statement = statement.statement or self.user_state.last_statement or statement
        yield from self.do(statement)


HANDLERS: Mapping[str, Callable[[Session, Instruction], Dialogue[None] | Iterable[Reply] | None]] = {
    **LOCATIONS,
    **VARIABLES,
    **PROGRAMS,
    **FILES,
    **RUNNING,
    **STEPPING,
    **STATE,
    **TIMELINE,
    "CLOCK": clock,
    "JOG": jog,
    "COMMANDS": lambda session, it: carry_out_file(session, session.answers, path_of(session, it)),
}
