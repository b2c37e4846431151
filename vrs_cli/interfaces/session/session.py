"""A session: one robot with its programs, variables and clock, driven line by line. It prints nothing itself."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import nullcontext
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple
from weakref import finalize

from vrs_cli.dialogue.replies import Diagnosed, DiagnosticsReport, Displaced, Message, ProgramStopped, Reply, Tone
from vrs_cli.dialogue.terminal import Dialogue, Terminal
from vrs_cli.engine.branches import MAIN, Branches
from vrs_cli.engine.clock import Clock
from vrs_cli.engine.displacement import displacement
from vrs_cli.engine.engine import Engine, Postponement
from vrs_cli.errors import (
    ClockPaused,
    NoProgramSpecified,
    ProgramInterlocked,
    ProgramNotExecutable,
    TaskNotActive,
    UsageError,
    VrsError,
)
from vrs_cli.files.layout import Layout
from vrs_cli.interfaces.controller.unstored import Unstored
from vrs_cli.interfaces.tasks.debugging import Stepping
from vrs_cli.interfaces.tasks.driver import Driver
from vrs_cli.interfaces.tasks.readings import Readings
from vrs_cli.interfaces.tasks.runs import USUAL, Beside, Limits, Outcome, RunResult
from vrs_cli.interfaces.tasks.track import PROMPT_LINE, ROBOT_PROGRAM, Track
from vrs_cli.kinematics.joints import Joints
from vrs_cli.kinematics.model import RobotModel
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.language.run.cells import Reference
from vrs_cli.language.run.effects import CYCLE_SETTINGS
from vrs_cli.language.run.environment import Environment
from vrs_cli.language.run.programs import StoredProgram
from vrs_cli.language.run.prompt import statement_task
from vrs_cli.language.run.runtime import Task
from vrs_cli.language.text.ast import (
    BadLine,
    DoInstruction,
    File,
    Instruction,
    Program,
    ProgramHeader,
    Section,
    Show,
    Statement,
)
from vrs_cli.language.text.collector import collector_paused
from vrs_cli.language.text.diagnostics import Diagnostic, LineRefused, Severity, error
from vrs_cli.language.words.values import Value
from vrs_cli.trajectory.timeline import Timeline

if TYPE_CHECKING:
    from vrs_cli.files.journal import Journal
    from vrs_cli.interfaces.editor.lines import Editor


class Schedule(NamedTuple):
    """A course of events as it was: how it began, and its timeline."""

    initial: Timeline
    timeline: Timeline


class Session:
    """One robot, its programs and variables, one clock.

    `driver` runs its tasks. `task` is the robot program that runs or ran last, `last_program` its name,
    `last_statement` what a bare DO repeats.
    `editor`: EDIT is open, and lines go to it; `last_edited` is its program, or that of the one before.
    `folder`: where programs have their files; `close` sees to it that all of what they wrote is in these.
    """

    def __init__(
        self,
        terminal: Terminal,
        model: RobotModel | None = None,
        *,
        start: Joints | None = None,
        clock: Clock | None = None,
        limits: Limits = USUAL,
        folder: Path = Path(),
    ) -> None:
        self.terminal = terminal
        self.engine = Engine(model or load_robot("puma560"), start=start, clock=clock)
        self.branches = Branches(self.engine)
        self.environment = Environment(units=self.engine.model.units)
        self.unstored = Unstored(self.environment)
        self.robot = Readings(self.engine)
        self.limits = limits
        self.driver = Driver(self.engine, terminal, self.environment, self.robot, folder)
        self.driver.tasks.told = self._tell
        self._closing = finalize(self, self.driver.devices.disk.close_all)
        self.engine.postponed.append(self._postponed)
        self.last_program: str | None = None
        self.last_statement: Statement | None = None
        self.editor: Editor | None = None
        self.drafted = ""  # the program in SEE while it is changed and not stored, as a file would hold it
        self.last_edited: str | None = None
        self.layout = Layout()
        self.journal: Journal | None = None  # the file that all motions are written to as they are commanded
        self.command_files: list[Path] = []  # those that are carried out, the innermost last
        self._scheduled: dict[str, Schedule] = {}  # by branch, when the present line began
        self.interrupted = False  # by Ctrl-C: what was to come after the present line does not

    @property
    def task(self) -> Task | None:
        track = self.driver.tasks.get(ROBOT_PROGRAM)
        return None if track is None else track.task

    def close(self) -> None:
        """The end of the session: the files of programs are closed. It comes by itself when a process ends."""
        self._closing()

    # --- programs ---

    @collector_paused()
    def load_text(self, text: str) -> tuple[Diagnostic, ...]:
        """Put the programs and variables of a file in memory; all that is wrong with it.

        A program with errors is kept, and not executable. Programs of the same name are replaced. Raises
        ProgramInterlocked where one of these is on the stack of a task.
        """
        from vrs_cli.language.text.parser import parse_file

        file, diagnostics = parse_file(text)
        return tuple(diagnostics) + self.put(file, text)

    def put(self, file: File, text: str) -> tuple[Diagnostic, ...]:
        """The same of a file that has been parsed; what is wrong with what it means."""
        for part in file.parts:
            if isinstance(part, Program):
                self.check_free(part.name)
        refused = defined(self.environment, (part for part in file.parts if isinstance(part, Section)))
        self.layout = self.layout.with_file(file)
        return refused + self._store(file, text)

    def keep(self, program: Program, text: str) -> tuple[Diagnostic, ...]:
        """Put one program in memory, in the place of one of its name; `text` is its source. What is wrong with it."""
        return self._store(File((program,)), text)

    def _store(self, file: File, text: str) -> tuple[Diagnostic, ...]:
        from vrs_cli.language.analysis.analyzer import analyze_among
        from vrs_cli.language.analysis.lineage import program_beyond_val2
        from vrs_cli.language.analysis.surroundings import Surroundings

        programs = {part.key: part for part in file.parts if isinstance(part, Program)}
        lines = tuple(text.split("\n"))
        everything = {key: stored.program for key, stored in self.environment.programs.items()} | programs
        surroundings = Surroundings(self.environment.kinds(), everything)
        diagnostics: list[Diagnostic] = []
        for program in programs.values():
            analysis = analyze_among(surroundings, program)
            self.environment.store(analysis, lines)
            diagnostics += analysis.diagnostics
            diagnostics += () if self.robot.switch("VPLUS") else tuple(program_beyond_val2(program))
        return tuple(diagnostics)

    # --- running ---

    @property
    def running(self) -> bool:
        return self.driver.running

    def check_free(self, program: str) -> None:
        """Raises ProgramInterlocked for a program on the stack of a task, which cannot be changed."""
        track = self.driver.tasks.uses(program)
        if track is not None:
            number = "" if track.number == ROBOT_PROGRAM else f" {track.number}"
            clears = f"ABORT{number}, then KILL{number}" if track.running else f"KILL{number}"
            raise ProgramInterlocked(
                f"{program} is on the stack of task {track.number}, which is {track.task.state.value}",
                f"{clears} clears it",
            )

    def execute(
        self,
        program: str | None = None,
        arguments: Sequence[Reference | Value | None] = (),
        cycles: int = 1,
        step: int = 1,
        *,
        limits: Limits | None = None,
        progress: Callable[[float], None] | None = None,
    ) -> RunResult:
        """Run a program, the last one when none is named. Raises NoProgramSpecified, UndefinedName,
        ProgramNotExecutable, ArgumentMismatch; what goes wrong in the program is in the result.
        """
        task = self._prepared(program, arguments, cycles, step)
        self._nothing_runs()
        self._clock_runs()
        return self._run(self.driver.tasks.start(ROBOT_PROGRAM, task), limits or self.limits, progress)

    def _run(self, track: Track, limits: Limits, progress: Callable[[float], None] | None) -> RunResult:
        """SPEED and the like of a program end with it: the prompt has what every program starts with."""
        asked = isinstance(self.terminal, Dialogue)  # about what is not stored; elsewhere nobody looks
        with self.unstored.running() if asked else nullcontext():
            result = self.driver.run(track, limits, progress)
        if track.task.ended:
            for setting in CYCLE_SETTINGS:
                self.engine.perform(setting)
        return result

    def prime(
        self,
        program: str | None = None,
        arguments: Sequence[Reference | Value | None] = (),
        cycles: int = 1,
        step: int = 1,
    ) -> Track:
        """Get a program ready: `proceed` and `step` begin it. Raises as `execute` does."""
        task = self._prepared(program, arguments, cycles, step)
        self._nothing_runs()
        return self.driver.tasks.prime(ROBOT_PROGRAM, task)

    def start(
        self,
        number: int,
        program: str,
        arguments: Sequence[Reference | Value | None] = (),
        cycles: int = 1,
        step: int = 1,
    ) -> None:
        """Start a task that runs whenever time goes on. Raises TaskActive, and as `execute` does."""
        stored = self._executable(program)
        self.driver.tasks.start(number, Task(self.environment, self.robot, stored.name, arguments, cycles, step))
        self.settle()

    def _prepared(
        self, program: str | None, arguments: Sequence[Reference | Value | None], cycles: int, step: int
    ) -> Task:
        name = program or self.last_program
        if name is None:
            raise NoProgramSpecified("there is no last program", "EXECUTE name")
        stored = self._executable(name)
        task = Task(self.environment, self.robot, stored.name, arguments, cycles, step)
        self.last_program = stored.name
        return task

    def _executable(self, name: str) -> StoredProgram:
        stored = self.environment.program(name)
        if not stored.analysis.executable:
            raise ProgramNotExecutable(stored.name, _why_not(stored))
        if not self.robot.switch("VPLUS"):
            self.environment.executable(stored).refuse_beyond_val2()
        return stored

    def _nothing_runs(self) -> None:
        if self.running:
            raise UsageError("a program is running", "ABORT stops it")

    def _clock_runs(self) -> None:
        if self.engine.clock.paused:
            raise ClockPaused(f"a program would wait at {self.engine.now:.3f} s", "CLOCK GO lets it go on")

    def proceed(self, progress: Callable[[float], None] | None = None) -> RunResult:
        """Go on with a program that was paused, aborted or stopped by an error, at the next step."""
        return self._go_on(progress)

    def retry(self, progress: Callable[[float], None] | None = None) -> RunResult:
        """Like `proceed`, but the step that failed or was interrupted is done again."""
        return self._go_on(progress, retry=True)

    def step(self, *, over: bool, progress: Callable[[float], None] | None = None) -> RunResult:
        """Do one step of a program that was stopped or primed. `over`: a program that it calls is part of it."""
        return self._go_on(progress, stepping=Stepping(over))

    def _go_on(
        self,
        progress: Callable[[float], None] | None,
        *,
        retry: bool = False,
        stepping: Stepping | None = None,
    ) -> RunResult:
        self._nothing_runs()
        self._clock_runs()
        try:
            track = self.driver.tasks.proceed(ROBOT_PROGRAM, retry=retry)
        except TaskNotActive:
            raise NoProgramSpecified("no program was stopped", "EXECUTE name starts one") from None
        track.stepping = stepping
        return self._run(track, self.limits, progress)

    def watched(self, run: Callable[[Callable[[float], None] | None], RunResult]) -> RunResult:
        """Run, with progress where somebody watches."""
        terminal = self.terminal
        if not isinstance(terminal, Dialogue):
            return run(None)
        terminal.begin_progress()
        try:
            return run(terminal.progress)
        finally:
            terminal.end_progress()

    def settle(self, until: float | None = None, *, asking: bool = True) -> None:
        """Let the other tasks see what has changed; do all that has become due in real time, or is `until` then.

        Without `asking` nobody can answer a PROMPT, which waits.
        """
        self.driver.settle(until, asking=asking)

    def _postponed(self, it: Postponement) -> None:
        what = it.text or "the motion"
        self.terminal.show(Message(f"{what} is postponed from {it.asked:.3f} to {it.executed:.3f} s", Tone.WARNING))

    def _tell(self, one: Beside) -> None:
        """Show what became of another task."""
        fault = one.fault
        what = f"{fault.message} [{one.where}]"
        self.terminal.show(ProgramStopped(what, fault.program, fault.step, fault.source, Tone.ERROR))

    def interrupt(self) -> bool:
        """Stop the program that runs before its next step; False when none does, or one that waits for a line: whoever
        reads that has to be stopped. Safe in a signal handler.
        """
        if self.running:
            self.interrupted = True
            self.driver.interrupt()
        return self.running and not self.driver.asks

    def abort(self) -> None:
        """ABORT at the prompt: brake now and drop what is scheduled; a stopped program cannot go on by itself."""
        self.interrupt()
        self.engine.stop()
        if not self.engine.realtime:
            self.settle(self.engine.end)

    # --- the prompt ---

    @property
    def prompt(self) -> str:
        """VAL's dot, after the name of the branch where one is tried."""
        return "." if self.branches.on_main else f"({self.branches.present})."

    def perform(self, line: str) -> None:
        """One line of the prompt, or of the editor: parse it, check it, do it. Answers go to the terminal.

        Raises LineRefused for a line that cannot be read or checked, and VrsError for what cannot be done.
        """
        for reply in self.answers(line):
            self.terminal.show(reply)

    def answers(self, line: str) -> Iterator[Reply]:
        """What `perform` shows, as it comes. Raises LineRefused, VrsError."""
        self.settle()
        if self.editor is not None:
            yield from self._edited(self.editor, line)
            return
        from vrs_cli.language.text.parser import parse_prompt

        statement = parse_prompt(line, self.names())
        if statement is None:
            return
        if isinstance(statement, ProgramHeader):
            raise UsageError(
                ".PROGRAM opens a program of several lines", "type it at the prompt of vrs, or LOAD a file"
            )
        yield from self._check(statement, line)
        self._scheduled = self._schedules()
        yield from self.carry_out(statement)
        yield from self._displaced()

    def _schedules(self) -> dict[str, Schedule]:
        """What is scheduled on main and on the present branch."""
        engine, branches = self.engine, self.branches
        schedules = {branches.present: Schedule(engine.initial, engine.timeline)}
        if not branches.on_main:
            main = branches.line(MAIN)
            schedules[MAIN] = Schedule(main.initial, main.timeline)
        return schedules

    def _displaced(self) -> Iterator[Reply]:
        """What has moved since the line began, or since a line of its own (COMMANDS) told it."""
        engine, before = self.engine, self._scheduled.get(self.branches.present)
        self._scheduled = self._schedules()
        if before is None or before.initial is not engine.initial:
            return
        changes = engine.deltas[len(engine.deltas) - (engine.timeline.version - before.timeline.version) :]
        found = displacement(before.timeline, engine.timeline, changes, engine.history.done)
        if found is not None:
            yield Displaced(found)

    def names(self) -> frozenset[str]:
        """The keys of the variables that have a value, those among them that a stopped program has for itself."""
        own = {} if self.task is None else self.task.own
        return frozenset((*self.environment.kinds(), *(key for key, one in own.items() if one.defined())))

    def _edited(self, editor: Editor, line: str) -> Iterator[Reply]:
        replies = editor.take(line)
        self.last_edited = editor.name
        if editor.done:
            self.editor = None
        yield from replies

    def _check(self, statement: Statement, line: str) -> Iterator[Reply]:
        """Raises LineRefused for the first error; warnings are answered."""
        from vrs_cli.language.analysis.analyzer import check_line
        from vrs_cli.language.analysis.lineage import beyond_val2

        found = check_line(statement, self.environment.kinds())
        found += () if self.robot.switch("VPLUS") else tuple(beyond_val2(statement, at_prompt=True))
        for diagnostic in found:
            if diagnostic.severity is Severity.ERROR:
                raise LineRefused(diagnostic)
        if found:
            yield DiagnosticsReport(tuple(Diagnosed(warning, line) for warning in found))

    def carry_out(self, statement: Statement) -> Iterator[Reply]:
        """A monitor command by its handler, everything else as DO."""
        from vrs_cli.interfaces.monitor.table import MONITOR
        from vrs_cli.interfaces.monitor.variables import shown_value

        if isinstance(statement, Instruction) and statement.word in MONITOR:
            yield from MONITOR[statement.word](self, statement)
            return
        if isinstance(statement, Show):
            yield from shown_value(self, statement.expression)
            return
        if isinstance(statement, DoInstruction):
            if statement.statement is None and self.last_statement is None:
                raise UsageError("there is no instruction to repeat", "DO instruction")
            statement = statement.statement or self.last_statement or statement
        self.do(statement)

    def do(self, statement: Statement) -> None:
        """One instruction now, as a program of one step. Raises VrsError where it cannot be done, KeyboardInterrupt
        where it was stopped.
        """
        self.last_statement = statement
        task = statement_task(self.environment, self.robot, statement)
        self._nothing_runs()
        track = self.driver.tasks.start(PROMPT_LINE, task)
        try:
            result = self.watched(lambda progress: self.driver.run(track, self.limits, progress))
        finally:
            self.driver.tasks.forget(PROMPT_LINE)
        self.settle()
        if result.outcome is Outcome.ABORTED:
            raise KeyboardInterrupt
        if track.error is not None:
            raise track.error


def defined(environment: Environment, sections: Iterable[Section]) -> tuple[Diagnostic, ...]:
    """Give the variables of a file their values; what is wrong with those that cannot be."""
    refused: list[Diagnostic] = []
    for entry in chain.from_iterable(section.entries for section in sections):
        try:
            environment.define(entry)
        except VrsError as wrong:
            refused.append(error(type(wrong), entry.span, wrong.detail, wrong.hint))
    return tuple(refused)


def _why_not(stored: StoredProgram) -> str:
    """Why a program is not executable: its bad lines, or its first mistake."""
    if any(isinstance(step.statement, BadLine) for step in stored.program.steps):
        return f"LISTP {stored.name} shows its bad lines with a ?"
    mistakes = (one for one in stored.analysis.diagnostics if one.severity is Severity.ERROR)
    return next((one.detail for one in mistakes), "")
