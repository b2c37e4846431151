"""A station: one robot with its programs, variables and clock. `vrs run` and all commands act on a station."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import cached_property
from itertools import chain
from math import degrees
from typing import TYPE_CHECKING, TypeVar
from weakref import WeakSet, finalize

from msgspec import Struct, structs

from vrs_cli import errors
from vrs_cli.contacts.watch import ContactWatch
from vrs_cli.devices.outside import Outside
from vrs_cli.engine import branches, engine
from vrs_cli.engine.clock import RobotClock
from vrs_cli.files import opening
from vrs_cli.files.layout import Layout
from vrs_cli.interfaces.actor.actor import Actor
from vrs_cli.interfaces.dialogue import Dialogue, Slice, Terminal, at_once, beside, beside_if, within
from vrs_cli.interfaces.station import loaded_file
from vrs_cli.interfaces.tasks.driver import Driver
from vrs_cli.interfaces.tasks.limits import ATTENDED, Advice, Limits, at_prompt
from vrs_cli.interfaces.tasks.tasks import PROMPT_LINE, ROBOT_PROGRAM, Aborted, Stepping, Track
from vrs_cli.interfaces.users import (
    STOPPED,
    RobotLease,
    StreamKind,
    TargetStream,
    UserState,
    check_goes_beside,
    check_may,
    must_drive,
    role_of,
)
from vrs_cli.kinematics.joints import Joints
from vrs_cli.kinematics.model import RobotModel
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.language.run import effects, runtime, signals
from vrs_cli.language.run.environment import Environment
from vrs_cli.language.run.memory import Memory, StoredProgram
from vrs_cli.language.text import ast, collector, parser
from vrs_cli.language.words import values, word
from vrs_cli.values import diagnostics, dragging, results

if TYPE_CHECKING:
    from pathlib import Path

    from vrs_cli.interfaces.station.body import DivergenceGuard, RobotBody
    from vrs_cli.values.replies import Plot
    from vrs_cli.values.scene import CellScene
    from vrs_cli.world.course import World

R = TypeVar("R")


class Conditions(Struct, frozen=True):
    """The conditions of one call. `limits`: the limits of programs; `folder`: the folder of their files; `cell`: the
    cell around the robot; `inputs`: inputs that change at times [s] counted from the start of the call. None: as set
    for the robot."""

    limits: Limits | None = None
    folder: opening.Folder | None = None
    cell: signals.Cell | None = None
    inputs: signals.Inputs = signals.NO_INPUTS


class LineStopped(KeyboardInterrupt):
    """Raised when Ctrl-C or ABORT has stopped a prompt line before its end."""


class Station:
    """One robot with its programs, variables and clock.

    - `terminal` shows messages of the robot itself. `driver` runs the tasks of the robot.
    - `task` is the robot program that is running or ran last; `last_program` is its name.
    - `user_state`: the state of the user who is being served. `own_user_state`: the state of the user of a robot that
      has only one.
    - `body`: the reports of the real or simulated arm; `divergence` compares them with the timeline. Both are made when
      one of them is first used, because few robots have a body.
    - `lease`: the right to drive; None: all users may drive.
    - `folder`: the folder of the files. `close` completes the files written by programs.
    - `outside`: the TCP peers and serial lines to which programs may connect; by default none.
    """

    def __init__(
        self,
        terminal: Terminal,
        model: RobotModel | None = None,
        *,
        start: Joints | None = None,
        clock: RobotClock | None = None,
        limits: Limits = ATTENDED,
        folder: opening.Folder = opening.FREE,
        outside: Outside | None = None,
        advice: Advice = at_prompt,
    ) -> None:
        if outside is not None and outside.live and not (clock and clock.realtime):
            raise errors.UsageError("what comes from outside comes in real time", "give a clock on the wall")
        self.terminal = terminal
        self.engine = engine.Engine(model or load_robot("puma560"), start=start, clock=clock)
        self.branches = branches.Branches(self.engine)
        self.units = self.engine.model.units
        self.environment = Environment(units=self.units)
        self.programs = self.environment.programs
        self.unstored = loaded_file.Unstored(self.environment)
        if terminal.attended:  # record changes only for a person, who is asked about unsaved work
            self.unstored.watch()
        self.limits, self.folder = limits, folder
        self.driver = Driver(self.engine, terminal, self.environment, folder, outside, advice)
        self.actor = Actor(self.driver)
        self.tasks = self.driver.tasks
        self.tasks.notify = self._tell
        self.close = finalize(self, self.driver.devices.close_all)  # `finalize` also calls it at the end of the process
        self.engine.postponed.append(lambda it: self._warn(it.sentence))
        self.engine.turned.append(self._warn_turned)
        self.contacts = ContactWatch(self.engine, self._around, self._warn)
        # dialect (VAL, VAL-II or V+) of typed lines, and of files that name no dialect
        self.dialect = diagnostics.Dialect.VPLUS
        self.last_program: str | None = None
        self.own_user_state = UserState(attended=terminal.attended)
        self.user_state = self.branches.who = self.tasks.who = self.own_user_state
        self._user_states: WeakSet[UserState] = WeakSet((self.user_state,))
        self.lease: RobotLease | None = None
        self.stream: TargetStream | None = None  # stream of targets that the robot is following; None if there is none
        self.pulled = dragging.DragState()  # which user drags the tool, and how far it is from its target
        self.stops = 0  # number of times that a user has stopped the robot
        # raises FileError or LimitReached if the robot can store no change now
        self.check_room: Callable[[], None] = lambda: None
        self.driver.answers, self.driver.then = self._answers, self._then
        self.layout = Layout()
        # folder for the files of programs that begin now; None: use `folder`
        self._given: opening.Folder | None = None
        self.home = folder  # CD without an argument returns to this folder; CD cannot leave it if it is closed
        # starts to write a log of the session to a file (None: stops), and returns the previous file; raises FileError
        self.log: Callable[[Path | None], Path | None] | None = None
        # draws a plot into a file; None if this robot cannot draw files
        self.draw: Callable[[Path, Plot], None] | None = None
        self.journal: Path | None = None  # file to which each motion is written when it is commanded

    @cached_property
    def divergence(self) -> DivergenceGuard:
        from vrs_cli.interfaces.station.body import DivergenceGuard

        return DivergenceGuard(
            self.engine,
            timeline=lambda: self.branches.seen_by(None)[0],
            settle=self.settle,
            stop=self.stop,
            runs=lambda: any(self.tasks.running),
            ask=lambda dialogue, urgent: self.actor.submit(self.divergence.report_failure(dialogue), urgent=urgent),
        )

    @property
    def body(self) -> RobotBody:
        return self.divergence.body

    @property
    def task(self) -> runtime.Task | None:
        track = self.tasks.get(ROBOT_PROGRAM)
        return None if track is None else track.task

    def change_folder(self, folder: opening.Folder) -> None:
        """Change the folder for the files of commands, and for files that programs open from now on. A program that was
        started with a closed folder keeps that folder."""
        self.folder = folder
        if not folder.closed:
            self.driver.devices.folder = folder

    # --- programs ---

    @collector.pause_collector()
    def load_text(self, text: str, name: str = "") -> tuple[diagnostics.Diagnostic, ...]:
        """Store the programs and variables of a file in memory. Return all mistakes in the file. `name`: the name of
        the file, which names a program that has no .PROGRAM heading. A program with mistakes is stored, but cannot be
        executed. Programs of the same name are replaced. Raises ProgramInterlocked if a task is executing one of
        them."""
        loaded = at_once(self.read_file(text, name))
        self.take(loaded)
        return loaded.diagnostics

    @collector.pause_collector()
    def load_texts(self, texts: Sequence[tuple[str, str]]) -> tuple[loaded_file.LoadedFile, ...]:
        """Load several files that share one namespace into memory. Each file is given by its text and its name (as in
        `load_text`). Return the contents of the files, in the same order. Raises ProgramInterlocked."""
        read = [parser.parse_file(text, self.dialect, name=name, remembered=False) for text, name in texts]
        memory, vplus = self._memory(), self.engine.settings.switch("VPLUS")
        programs: dict[str, ast.Program] = {}
        found = list[list[diagnostics.Diagnostic]]()
        for file, unreadable in read:
            for section in file.parts:
                if isinstance(section, ast.Section):
                    memory.take(loaded_file.variables_of(section, memory.units)[0])
            own = {part.key: part for part in file.parts if isinstance(part, ast.Program)}
            twice = [parser.duplicate_name(own[key], 0, parser.IN_ANOTHER_FILE) for key in own.keys() & programs.keys()]
            found.append([*unreadable, *twice])
            programs |= own
        loaded = list[loaded_file.LoadedFile]()
        for (file, _), (text, _), before in zip(read, texts, found, strict=True):
            one = loaded_file.LoadedFile.of(file, text, memory, vplus=vplus, beside=programs)
            loaded.append(structs.replace(one, diagnostics=(*before, *one.diagnostics)))
            self.take(one)
        return tuple(loaded)

    def read_file(self, text: str, name: str = "") -> Dialogue[loaded_file.LoadedFile]:
        """Parse a file and analyse it together with the memory, before `take` stores it. `name`: the name of the file,
        which names a program that has no .PROGRAM heading. Raises ProgramInterlocked."""
        long, dialect = len(text) > loaded_file.LONG_TEXT, self.dialect
        file, unreadable = yield from beside_if(
            long, lambda: parser.parse_file(text, dialect, name=name, remembered=False)
        )
        self._check_free(file)
        memory, vplus = self._memory(), self.engine.settings.switch("VPLUS")
        found = yield from beside_if(long, lambda: loaded_file.LoadedFile.of(file, text, memory, vplus=vplus))
        yield from self._compiled_for_tasks(found)
        return structs.replace(found, diagnostics=(*unreadable, *found.diagnostics))

    def _memory(self) -> Memory:
        """Return a copy of the memory and the variables of the cell, for the analysis of other programs."""
        memory = self.environment.copy()
        self.driver.cell.fill(memory)
        return memory

    def take(self, loaded: loaded_file.LoadedFile) -> None:
        """Store the contents of a file in memory in one step. Raises ProgramInterlocked."""
        self._check_free(loaded.file)
        self.environment.take(loaded.variables)
        self.layout = self.layout.with_file(loaded.layout)
        self.programs.update({stored.program.key: stored for stored in loaded.programs})

    def _check_free(self, file: ast.File) -> None:
        if all(track.task.is_over for track in self.tasks):
            return  # no program is in use, so do not check each program: there may be 40,000
        for part in file.parts:
            if isinstance(part, ast.Program):
                self.check_free(part.name)

    def keep(self, program: ast.Program, text: str) -> Dialogue[tuple[diagnostics.Diagnostic, ...]]:
        """Store a program in memory in place of the program of the same name. `text`: its source. Return its
        mistakes."""
        memory, vplus = self._memory(), self.engine.settings.switch("VPLUS")
        loaded = yield from beside_if(
            len(program.steps) > loaded_file.LONG_PROGRAM,
            lambda: loaded_file.LoadedFile.of(ast.File((program,)), text, memory, vplus=vplus),
        )
        yield from self._compiled_for_tasks(loaded)
        self.programs.update({stored.program.key: stored for stored in loaded.programs})
        return loaded.diagnostics

    # --- running ---

    @property
    def running(self) -> bool:
        """Return whether the robot program is running."""
        track = self.tasks.get(ROBOT_PROGRAM)
        return track is not None and track.running

    def check_free(self, program: str) -> None:
        """Check that no task is executing a program, directly or in a CALL, because a program that is executing cannot
        be changed. Raises ProgramInterlocked."""
        if (track := self.tasks.uses(program)) is not None:
            number = "" if track.number == ROBOT_PROGRAM else f" {track.number}"
            clears = f"{{ABORT{number}}}, then {{KILL{number}}}" if track.running else f"{{KILL{number}}}"
            raise errors.ProgramInterlocked(
                f"{program} is on the stack of task {track.number}, which is {track.task.state.value}",
                f"{clears} clears it",
            )

    def execute(
        self,
        program: str | None = None,
        arguments: runtime.Arguments = (),
        cycles: int = 1,
        step: int = 1,
        *,
        limits: Limits | None = None,
        all_tasks: bool = False,
    ) -> results.RunResult:
        """Run a program to its end at the terminal. `all_tasks`: also run all other tasks to their ends. Raises the
        errors of `begin`; the result contains an error that occurs in the program."""
        return self.converse(self.wait(self.begin(program, arguments, cycles, step), limits, all_tasks=all_tasks))

    def compile_program(self, program: str | None, *, everywhere: bool = False) -> Dialogue[None]:
        """Compile a program (by default the last one) and the programs that it calls, before it is started. Another
        thread compiles long programs. `everywhere`: also allow a start at any step. Errors are reported when the
        program begins."""
        programs = dict(self.programs)
        first = programs.get(values.key_of(program or self.last_program or ""))
        if first is None or sum(len(one.program.steps) for one in programs.values()) <= loaded_file.LONG_PROGRAM:
            return
        yield from self._compile_callable([first.program], programs, everywhere=first.program if everywhere else None)

    def _compiled_for_tasks(self, loaded: loaded_file.LoadedFile) -> Dialogue[None]:
        """Compile the long programs of a file in another thread before they are stored, because running tasks may call
        them immediately afterwards."""
        tasks = [track.task for track in self.tasks if not track.task.is_over]
        if not tasks or all(len(one.program.steps) <= loaded_file.LONG_PROGRAM for one in loaded.programs):
            return
        programs = self.programs | {one.program.key: one for one in loaded.programs}
        stacks = {values.key_of(name) for task in tasks for name, _ in task.stack}
        callers = [stored.program for key, stored in programs.items() if key in stacks]
        yield from self._compile_callable(callers, programs)

    def _compile_callable(
        self,
        callers: Sequence[ast.Program],
        programs: Mapping[str, StoredProgram],
        everywhere: ast.Program | None = None,
    ) -> Dialogue[None]:
        """Compile in another thread the long programs among `callers` and all programs that these may call.
        `everywhere`: the program that may be started at any step."""
        from vrs_cli.files.store import may_be_called  # imported here because only long programs need it

        known = {key: stored.program for key, stored in programs.items()}
        found = yield from beside(lambda: may_be_called(callers, known))
        needed = dict.fromkeys(one.key for one in found if len(one.steps) > loaded_file.LONG_PROGRAM)
        executables = [self.environment.executable(programs[key]) for key in needed]

        def compile_all() -> None:
            for one in executables:
                one.compile_ahead(everywhere=one.program is everywhere)

        yield from beside(compile_all)

    def begin(
        self,
        program: str | None = None,
        arguments: runtime.Arguments = (),
        cycles: int = 1,
        step: int = 1,
        *,
        primed: bool = False,
    ) -> Track:
        """Start a program (by default the last one); the caller must then call `wait` or `let_run`. `primed`: the
        program stops before its first step, and `resume` continues it. Raises NoProgramSpecified, UndefinedName,
        ProgramNotExecutable, ArgumentMismatch, TaskActive, ClockPaused."""
        if (name := program or self.last_program) is None:
            raise errors.NoProgramSpecified("there is no last program", "{EXECUTE name}")
        task = self._task(name, arguments, cycles, step)
        self.last_program = task.program
        if not primed:
            self._clock_runs()
        track = self.tasks.start(ROBOT_PROGRAM, task, self._given)
        if primed:
            task.state = effects.TaskState.PAUSED
            self.tasks.stop(track, results.RunOutcome.PAUSED)
        return track

    def start(
        self, number: int, program: str, arguments: runtime.Arguments = (), cycles: int = 1, step: int = 1
    ) -> None:
        """Start a task; it runs whenever the clock advances. `number`: the number of the task. Raises TaskActive, and
        the errors of `begin`."""
        self.tasks.start(number, self._task(program, arguments, cycles, step), self._given)
        self.settle()

    def _task(self, name: str, arguments: runtime.Arguments, cycles: int, step: int) -> runtime.Task:
        stored = self.environment.program(name)
        if any(isinstance(step.statement, ast.BadLine) for step in stored.program.steps):
            raise errors.ProgramNotExecutable(stored.name, f"{{LISTP {stored.name}}} shows its bad lines with a ?")
        if (mistake := diagnostics.first_error(stored.analysis.diagnostics)) is not None:
            raise errors.ProgramNotExecutable(stored.name, mistake.detail)
        if not self.engine.settings.switch("VPLUS"):
            self.environment.executable(stored).refuse_beyond_val2()
        return runtime.Task(self.environment, self.engine, stored.name, arguments, cycles, step)

    def _clock_runs(self) -> None:
        if self.engine.clock.paused:
            raise errors.ClockPaused(f"a program would wait at {self.engine.now:.3f} s", "{CLOCK GO} lets it go on")

    def resume(self, *, retry: bool = False, stepping: Stepping | None = None) -> Track:
        """Continue the robot program after it was paused, aborted, primed or stopped by an error, at its next step.
        `retry`: repeat the step that failed or was interrupted. `stepping`: carry out one step only. Raises
        NoProgramSpecified, TaskActive, ClockPaused."""
        self._clock_runs()
        try:
            track = self.tasks.proceed(ROBOT_PROGRAM, retry=retry)
        except errors.TaskNotActive:
            raise errors.NoProgramSpecified("no program was stopped", "{EXECUTE name} starts one") from None
        track.stepping = stepping
        return track

    def converse(self, dialogue: Dialogue[R]) -> R:
        """Carry out a dialogue: the terminal shows its replies and asks its questions. Return its result."""
        return self.actor.finish(self.actor.submit(dialogue), self.terminal)

    def wait(
        self, track: Track, limits: Limits | None = None, *, all_tasks: bool = False
    ) -> Dialogue[results.RunResult]:
        """Wait until a started program has stopped. `all_tasks`: until all tasks have stopped. Return the result of the
        program."""
        self._changes_by_program(True)
        try:
            result = yield from self.driver.run(track, limits or self.limits, all_tasks=all_tasks)
        finally:
            self._changes_by_program(False)
        self._reset_settings(track)
        return result

    def _then(self, track: Track) -> Callable[[results.RunResult], None] | None:
        """Return the function to call at the end of a program whose user has left; None if the user is still present,
        so that the program must stop now."""
        who = track.driven_by
        return (lambda _result: self._reset_settings(track)) if isinstance(who, UserState) and who.left else None

    def watch_over(self) -> Dialogue[None]:
        """Advance the clock for a program for which no user waits, until the program stops or asks a question."""
        while self.running and not self.driver.questions():
            yield Slice.RUNNING
        self.settle()

    def let_run(self, track: Track, ended: Callable[[results.RunResult], None]) -> None:
        """Let a started program run whenever the clock advances, without a waiting user. `ended` is called at its
        end."""

        def over(result: results.RunResult) -> None:
            self._changes_by_program(False)
            self._reset_settings(track)
            ended(result)

        self._changes_by_program(True)
        self.driver.begin(track, self.limits, over)
        self.settle()

    def _changes_by_program(self, begin: bool) -> None:
        """Record that a running program starts (`begin`) or stops changing variables. Variables changed in between do
        not count as unsaved work, because the program can compute them again."""
        if self.terminal.attended:
            self.unstored.begin_run() if begin else self.unstored.end_run()

    def _reset_settings(self, track: Track) -> None:
        """Reset SPEED and similar settings after a program, so that the prompt uses the same settings as a starting
        program."""
        if track.task.is_over:
            for setting in effects.CYCLE_SETTINGS:
                self.engine.perform(setting)

    def settle(self, until: float | None = None) -> None:
        """Let the tasks carry out all events up to the time `until` [s], by default the current time of the clock."""
        self.driver.settle(until)

    def _warn(self, text: str) -> None:
        self.terminal.show(results.Message(text, results.Tone.WARNING))

    def _around(self) -> tuple[CellScene, World | None]:
        """Return the scene around the robot (parts, fixtures and sensors of its cell) and the world that computes their
        states; None instead of the world if the scene is empty."""
        scene = self.driver.cell.scene
        return scene, None if scene.empty else self.driver.world

    def _warn_turned(self, it: engine.ToolTurning) -> None:
        """Warn, only once, that this arm turns the tool away from the orientation of a target, because it has too few
        joints."""
        self.engine.turned.remove(self._warn_turned)
        joints, off = self.engine.model.joint_count, f"{degrees(it.angle):.1f} deg off what is asked"
        self._warn(
            f"{it.text or 'the motion'}: {joints} joints turn the tool as nearly as they can, here {off} (said once)"
        )

    def _tell(self, one: results.StoppedTask) -> None:
        """Report that a task other than the awaited one has stopped with an error."""
        self.terminal.show(
            results.ProgramStopped(
                f"{one.fault.message} [{one.where}]",
                one.fault.program,
                one.fault.step,
                one.fault.source,
                results.Tone.ERROR,
            )
        )

    def interrupt(self, user_state: UserState | None = None) -> bool:
        """Stop the program or line for which a user is waiting, before its next step. `user_state`: only if this user
        is waiting. Return False if nobody is waiting, or if a line is being read (its reader must then be stopped).
        Signal handlers may call this method."""
        waited = self.driver.awaited
        if waited is None or (user_state is not None and waited.driven_by is not user_state):
            return False
        (user_state or self.user_state).interrupted = True
        self.driver.interrupt()
        return not self.driver.asking

    def abort(self) -> None:
        """Stop the robot program and the prompt line, brake immediately, and drop all scheduled motions."""
        for user_state in self._user_states:
            user_state.interrupted = user_state.interrupted or user_state is not self.user_state
        self._abort((PROMPT_LINE, ROBOT_PROGRAM))

    def pause(self) -> None:
        """Stop the program at the end of its current motion; PROCEED continues it."""
        track = self.tasks.get(ROBOT_PROGRAM)
        if track is not None and track.running and not isinstance(track.pending, Aborted):
            track.task.state = effects.TaskState.PAUSED
            track.until(self.engine.now, effects.Pause())
        self.settle()

    def stop(self) -> None:
        """Stop everything (emergency stop): as `abort`, and also all other tasks."""
        self._abort([track.number for track in self.tasks.running])

    def _abort(self, tasks: Iterable[int]) -> None:
        for stream in chain.from_iterable(user_state.streams.values() for user_state in self._user_states):
            stream.ended = stream.ended or STOPPED
        self.user_state.streams.pop(StreamKind.CHUNKS, None)  # who stops the robot may send the next chunk
        self.stops, self.pulled = self.stops + 1, dragging.DragState(why=STOPPED)
        for number in tasks:
            self.driver.abort(number)
        self.engine.stop()
        if not self.engine.realtime:
            self.settle(self.engine.end)

    def resync(self, *, stops: bool) -> Dialogue[results.ResyncReport]:
        """Make the body (the real or simulated arm) and the timeline agree again (RESYNC). Raises UsageError on a
        branch other than main and while a program runs, RequestRefused, MotionError."""
        if self.branches.present != branches.MAIN:
            raise errors.UsageError("RESYNC moves what the body follows, which is main", f"BRANCH {branches.MAIN}")

        def check() -> None:
            self.check_may("RESYNC", role_of("RESYNC"))
            if self.running:
                check_goes_beside("RESYNC", role_of("RESYNC"), elsewhere=self.elsewhere)

        return (yield from self.divergence.resync(stops=stops, issued=self.user_state.issued, check=check))

    def serve(self) -> None:
        """Switch to the branch of the history that the current user last worked on. While a task is running, stay on
        the current branch."""
        self.branches.serve(self.user_state, stay=any(self.tasks.running))

    def leave(self, user_state: UserState) -> None:
        """Forget a user who has left: the editor, the role as driver of tasks, and a branch that only this user
        needs."""
        own = self.user_state
        user_state.editor = user_state.on_screen = user_state.last_statement = None
        for track in self.tasks:
            if track.driven_by is user_state:
                track.driven_by = None
        if not any(self.tasks.running) or not self.branches.is_at(user_state):
            self.branches.forget(user_state)
        self._present(own)

    @property
    def elsewhere(self) -> bool:
        """Return whether the robot is on a branch other than the current user's, because a program is running there."""
        return not self.branches.is_at(self.user_state)

    def on_branch(self, role: word.Role, dialogue: Dialogue[R]) -> Dialogue[R]:
        """Return a dialogue that runs on the right branch. A dialogue for observers, which only reads, runs on the
        current user's branch, even while a program runs on another branch."""
        return (
            within(self.branches.own_in_place, dialogue) if role is word.Role.OBSERVER and self.elsewhere else dialogue
        )

    def check_may(self, said: str, wanted: word.Role) -> None:
        """Check that the current user has the role `wanted`, and drives the robot if the request requires it. `said`:
        the name of the request, for messages. Raises RoleWanted, LeaseHeld."""
        check_may(said, wanted, self.user_state.role)
        if self.lease is not None and must_drive(said, wanted, self.user_state.role):
            self.lease.check(self.user_state.name)

    def check_may_stop(self, user_state: UserState) -> None:
        """Check that a user may stop the robot now: a supervisor always; a designer who drives, or if nobody drives.
        Any thread may call this method. Raises RoleWanted, LeaseHeld."""
        check_may("ABORT", word.Role.DESIGNER, user_state.role)
        lease = self.lease
        if lease is not None and lease.holder and must_drive("ABORT", word.Role.DESIGNER, user_state.role):
            lease.check(user_state.name)

    def _answers(self, track: Track) -> bool:
        """Return whether the current user is asked the questions of a task: with a lease, the user who drives is asked;
        otherwise the user who last continued the task or, if that user has left, any user."""
        if self.lease is not None:
            return self.lease.drives(self.user_state.name)
        driver = track.driven_by
        return driver in (None, self.user_state) or (isinstance(driver, UserState) and driver.left)

    def at(self, user_state: UserState, dialogue: Dialogue[R]) -> Dialogue[R]:
        """Run a dialogue for a user, with the state that is kept for this user. Raises RequestRefused if it was
        stopped."""
        self._user_states.add(user_state)
        user_state.interrupted = False
        try:
            return (yield from within(lambda: self._serve_user(user_state), dialogue))
        except LineStopped:
            raise errors.RequestRefused("it was stopped before it was done") from None

    def under(self, conditions: Conditions, dialogue: Dialogue[R]) -> Dialogue[R]:
        """Run a dialogue under the given conditions. They also apply to programs that begin in it."""
        with self.driver.use_cell(conditions.cell, conditions.inputs):
            return (yield from within(lambda: self._held_to(conditions), dialogue))

    @contextmanager
    def _held_to(self, conditions: Conditions) -> Iterator[None]:
        before = self.limits, self.folder, self.home, self._given
        self.limits = conditions.limits or self.limits
        if conditions.folder is not None:
            self.folder = self.home = self._given = conditions.folder
        try:
            yield
        finally:
            self.limits, self.folder, self.home, self._given = before

    @contextmanager
    def _serve_user(self, user_state: UserState) -> Iterator[None]:
        own = self.user_state
        self._present(user_state)
        try:
            self.serve()
            yield
        finally:
            self._present(own)

    def _present(self, user_state: UserState) -> None:
        """Make a user the current user; new branches and tasks then belong to this user."""
        self.user_state = self.branches.who = self.tasks.who = user_state

    def do(self, statement: ast.Statement) -> Dialogue[None]:
        """Carry out one instruction now, as a program of one step. Raises VrsError if the instruction fails,
        LineStopped (a KeyboardInterrupt) if it was stopped."""
        self.user_state.last_statement = statement
        task = runtime.statement_task(self.environment, self.engine, statement)
        track = self.tasks.start(PROMPT_LINE, task, self._given)
        track.times, track.issued, self.user_state.issued = self.user_state.times, self.user_state.issued, None
        of_program = self.unstored.of_program
        if of_program:
            self._changes_by_program(False)
        try:
            result = yield from self.driver.run(track, self.limits)
        finally:
            self.tasks.forget(PROMPT_LINE)
            if of_program and self.running:
                self._changes_by_program(True)
        self.settle()
        if result.outcome is results.RunOutcome.ABORTED:
            raise LineStopped
        if track.error is not None:
            raise track.error
