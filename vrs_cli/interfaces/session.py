"""A session: one robot with its programs, variables and clock, driven line by line. It prints nothing itself."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Protocol

from vrs_cli.engine.clock import Clock
from vrs_cli.engine.commands import Break
from vrs_cli.engine.engine import Engine
from vrs_cli.errors import NoProgramSpecified, ProgramNotExecutable, UsageError
from vrs_cli.interfaces.driver import Bounds, Console, Driver, Outcome, RunResult
from vrs_cli.interfaces.readings import Readings
from vrs_cli.interfaces.replies import Diagnosed, DiagnosticsReport, Reply
from vrs_cli.kinematics.joints import Joints
from vrs_cli.kinematics.model import RobotModel, load_robot
from vrs_cli.language.ast import File, Program, Section, Statement
from vrs_cli.language.diagnostics import Diagnostic
from vrs_cli.language.environment import Environment
from vrs_cli.language.runtime import Task
from vrs_cli.language.values import Value


class Terminal(Console, Protocol):
    """How a session talks to whoever drives it."""

    def show(self, reply: Reply) -> None:
        """An answer to a command."""

    def confirm(self, question: str) -> bool:
        """Are you sure (Y/N)? Where nobody can answer, the answer is no."""


class Session:
    """One robot, its programs and variables, one clock.

    `task` is the program that runs or ran last, `last_program` its name, `last_statement` what a bare DO repeats.
    """

    def __init__(
        self,
        terminal: Terminal,
        model: RobotModel | None = None,
        *,
        start: Joints | None = None,
        clock: Clock | None = None,
        bounds: Bounds = Bounds(),
    ) -> None:
        self.terminal = terminal
        self.engine = Engine(model or load_robot("puma560"), start=start, clock=clock)
        self.environment = Environment()
        self.robot = Readings(self.engine)
        self.bounds = bounds
        self.task: Task | None = None
        self.last_program: str | None = None
        self.last_statement: Statement | None = None
        self._driver: Driver | None = None

    # --- programs ---

    def load_text(self, text: str, path: str = "") -> tuple[Diagnostic, ...]:
        """Put the programs and variables of a file in memory; all that is wrong with it.

        A program with errors is kept, and not executable. Programs of the same name are replaced.
        """
        from vrs_cli.language.parser import parse_file

        file, diagnostics = parse_file(text)
        self._define(part for part in file.parts if isinstance(part, Section))
        return tuple(diagnostics) + self._store(file, text)

    def _store(self, file: File, text: str) -> tuple[Diagnostic, ...]:
        from vrs_cli.language.analyzer import analyze

        programs = {part.key: part for part in file.parts if isinstance(part, Program)}
        known = self.environment.kinds()
        everything = {key: stored.program for key, stored in self.environment.programs.items()} | programs
        diagnostics: list[Diagnostic] = []
        for program in programs.values():
            analysis = analyze(program, known, everything)
            self.environment.store(analysis, text)
            diagnostics += analysis.diagnostics
        return tuple(diagnostics)

    def _define(self, sections: Iterable[Section]) -> None:
        for section in sections:
            for entry in section.entries:
                self.environment.define(entry)

    # --- running ---

    @property
    def running(self) -> bool:
        return self._driver is not None

    def execute(
        self,
        program: str | None = None,
        arguments: tuple[Value, ...] = (),
        cycles: int = 1,
        step: int = 1,
        *,
        bounds: Bounds | None = None,
        progress: Callable[[float], None] | None = None,
    ) -> RunResult:
        """Run a program, the last one when none is named. Raises NoProgramSpecified, UndefinedName,
        ProgramNotExecutable, ArgumentMismatch; what goes wrong in the program is in the result.
        """
        name = program or self.last_program
        if name is None:
            raise NoProgramSpecified("there is no last program", "EXECUTE name")
        stored = self.environment.program(name)
        if not stored.analysis.executable:
            raise ProgramNotExecutable(stored.name, f"LISTP {stored.name} shows its bad lines with a ?")
        self.task = Task(self.environment, self.robot, stored.name, arguments, cycles, step)
        self.last_program = stored.name
        return self._drive(self.task, bounds, progress)
