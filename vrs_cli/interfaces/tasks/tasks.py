"""The tasks of one robot, by number: which tasks run or have stopped, what each of them waits for, and which task has
the robot. Task 0 is the robot program, task 1 the process control program of VAL-II, the others are tasks of V+; task
-1 is a line typed at the prompt. Only the task that has the robot may move it: task 0 from its start, or a task that
attaches the robot."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING

from msgspec import Struct, field

from vrs_cli.errors import IllegalValue, RobotNotAttached, TaskActive, TaskNotActive, VrsError
from vrs_cli.files.opening import Folder
from vrs_cli.interfaces.tasks.devices import Devices
from vrs_cli.interfaces.users import THE_ROBOTS, HolderTimes
from vrs_cli.kinematics import joints, transform
from vrs_cli.language.run import effects, memory, operations
from vrs_cli.language.words.values import key_of
from vrs_cli.values import commands, numbers, questions, results
from vrs_cli.version import __version__

if TYPE_CHECKING:
    from vrs_cli.engine.engine import Engine
    from vrs_cli.language.run.environment import Environment
    from vrs_cli.language.run.runtime import Task

ROBOT_PROGRAM = 0
PROMPT_LINE = -1  # task number of a line typed at the prompt

RUN_STATES = {
    effects.TaskState.RUNNING: operations.EXECUTING,
    effects.TaskState.PAUSED: operations.PAUSED,
    effects.TaskState.FAILED: operations.FAILED,
    effects.TaskState.HALTED: operations.COMPLETED,
    effects.TaskState.ABORTED: operations.ABORTED,
    effects.TaskState.COMPLETED: operations.COMPLETED,
}
NOT_IN_MEMORY, NOT_EXECUTABLE, NOT_EXECUTING, RUNS, STOPPED = -1, -2, 0, 1, 2  # codes that the function STATUS returns


# --- pending values of a task that are not events of its program ------------------------------------------------------


class Aborted(Struct, frozen=True):
    """The pending value of a task that was stopped from outside: it ends when the robot is at rest."""


class PendingInput(Struct, frozen=True):
    """The pending value of a task that waits for a line of the terminal. `number`: the number of its question; `event`:
    the request of the task."""

    number: int
    event: effects.Prompt | effects.ReadRecord | effects.AwaitLine

    @property
    def question(self) -> questions.LineWanted:
        """The question to show to the user who drives the task."""
        if not isinstance(self.event, effects.Prompt):
            return questions.LineWanted("")
        wrong = self.event.wrong
        return questions.LineWanted(self.event.text, "" if wrong is None else str(wrong))


class Stopped(Struct, frozen=True):
    """The pending value of a task whose program stops before a step. `outcome`: STEPPED, BREAKPOINT or WATCHED;
    `detail`: for WATCHED the change of the value."""

    outcome: str
    detail: str = ""


class Onward(Struct, frozen=True):
    """The pending value of a task whose program has finished one step and continues with the next step at once."""


Pending = effects.Event | Aborted | Stopped | Onward | PendingInput
ONWARD = Onward()


# --- one task -------------------------------------------------------------------------------------------------------


class Stepping(Struct):
    """A request to carry out one step of a program. `over`: a step that calls a program runs until that program
    returns. `begun`: whether the step is being carried out; `depth`: how many programs were on the stack when it
    began."""

    over: bool
    begun: bool = False
    depth: int = 0


class Track(Struct, eq=False):
    """A task and its timing. At the time `wake` [s] the task carries out `pending`, if that is not None, and continues.

    - `outcome`: how the task ended or stopped; None while it runs. `detail`: more about it.
    - `asked`: when `pending` was requested [s]. `answer`: what the program receives when it continues.
    - `mine`: the task takes the robot when it continues. `awaited`: a user waits for its end.
    - `instant`: when the task last continued [s]. `before`: the number of its steps until then.
    - `held`: events that reactions (REACT) have interrupted, each with the time of its request.
    - `driven_by`: the user who last continued the task and is asked its questions; None if that user has left.
    - `times`: clock corrections of the user who typed the task's line. `issued`: when the line was typed, until its
      first request [s].
    - `event`: whether the task's event is set (SET.EVENT). `event_signal`: the input that sets it. `run_signal`: the
      output that is on while the task runs.
    """

    number: int
    task: Task
    wake: float = 0.0
    pending: Pending | None = None
    asked: float = 0.0
    answer: str | None = None
    outcome: results.RunOutcome | None = None
    fault: results.ProgramFault | None = None
    error: VrsError | None = None
    detail: str = ""
    mine: bool = False
    awaited: bool = False
    event: bool = False
    event_signal: int | None = None
    run_signal: int | None = None
    stepping: Stepping | None = None
    instant: float = -1.0
    before: int = 0
    held: list[tuple[Pending, float]] = field(default_factory=list)
    driven_by: object = None
    times: HolderTimes = THE_ROBOTS
    issued: float | None = None

    @property
    def running(self) -> bool:
        return self.outcome is None

    @property
    def at_prompt(self) -> bool:
        return self.number == PROMPT_LINE

    @property
    def in_program(self) -> bool:
        """Return whether the task runs a program, not only a prompt line. The motion of a prompt line has ended when
        the line returns, and a motion with a time stamp does not advance the clock. A program that the line CALLs runs
        like any other program."""
        return not self.at_prompt or len(self.task.stack) > 1

    @property
    def reacts(self) -> bool:
        """Return whether a reaction must interrupt the event for which the task waits. REACT interrupts a wait for a
        condition, an event or a unit; REACTI also interrupts a wait for the robot."""
        due = self.task.reactions.due
        return due is not None and (
            isinstance(self.pending, effects.Wait | effects.WaitEvent | effects.UnitEffect)
            or (due.immediate and isinstance(self.pending, commands.Request))
        )

    def until(self, instant: float, pending: Pending | None = None) -> None:
        """Let the task wait until a time [s], then carry out `pending` (None: nothing) and continue."""
        self.wake, self.pending = instant, pending


# --- programs one step at a time ------------------------------------------------------------------------------------


class Watch(Struct):
    """A watched expression. `text`: as typed; `last`: its value at the last evaluation, None if the expression had no
    value."""

    text: str
    evaluate: Callable[[], numbers.Value]
    shown: Callable[[numbers.Value], str]
    last: numbers.Value | None = None

    def change(self) -> str:
        """Evaluate the expression. Return a string with the current and the previous value, or "" if the value has not
        changed."""
        before = self.last
        try:
            self.last = self.evaluate()
        except VrsError:
            self.last = None
        now, was = ("undefined" if value is None else self.shown(value) for value in (self.last, before))
        return "" if self.last == before else f"{self.text} is {now}, was {was}"


# --- all tasks of a robot -------------------------------------------------------------------------------------------


class Tasks(memory.System):
    """The tasks of a robot that run or have stopped. `current`: the number of the task that is carrying out steps.
    `who`: the user who is being served; this user drives the tasks that begin now. `failed`: the tasks that stopped
    with an error while a user waited for another task; `notify` is called with each of them. `observed` is called when
    a task reacts to a signal. `breakpoints`: programs stop before these steps (program keys, and step numbers from 1).
    `watches`: programs stop when the value of one of these expressions changes."""

    def __init__(self, engine: Engine, environment: Environment, devices: Devices) -> None:
        self.current = PROMPT_LINE
        self.who: object = None
        self.failed: list[results.StoppedTask] = []
        self.breakpoints = set[tuple[str, int]]()
        self.watches = list[Watch]()
        self._latch: tuple[transform.Transform, joints.Joints] | None = (
            None  # robot's pose and joints when the signal of LATCH.SIGNAL last turned on
        )
        self._latched = False
        self.notify: Callable[[results.StoppedTask], None] = lambda _failed: None
        self.observed: Callable[[Track, int, bool], None] = lambda _track, _signal, _on: None
        self._engine, self._environment, self._devices = engine, environment, devices
        self._tracks: dict[int, Track] = {}
        self._owner: int | None = None
        environment.signals.listeners.append(self._signal_changed)

    def __iter__(self) -> Iterator[Track]:
        return iter(self._tracks.values())

    def get(self, number: int) -> Track | None:
        return self._tracks.get(number)

    def in_order(self) -> list[Track]:
        return sorted(self, key=lambda track: track.number)

    @property
    def running(self) -> Iterator[Track]:
        return (track for track in self._tracks.values() if track.outcome is None)

    @property
    def steps_done(self) -> int:
        return sum([track.task.steps_done for track in self._tracks.values()])

    def next(self) -> Track | None:
        """Return the running task that continues first: the one with the earliest `wake` and, if several are equal,
        with the lowest number."""
        first: Track | None = None
        for track in self._tracks.values():  # a plain loop, because this is called twice for each step
            if track.outcome is None and (first is None or (track.wake, track.number) < (first.wake, first.number)):
                first = track
        return first

    def uses(self, program: str) -> Track | None:
        """Return a task that is executing a program, also indirectly by CALL; None if there is none."""
        return next((track for track in self.in_order() if not track.task.is_over and track.task.uses(program)), None)

    # --- start and continue ---

    def start(self, number: int, task: Task, folder: Folder | None = None) -> Track:
        """Start a task; the other tasks continue. `folder`: the folder of the task's files, if the task has its own
        folder. Raises TaskActive.
        """
        if (there := self.get(number)) is not None and there.running:
            raise TaskActive(f"task {number} runs {there.task.program}", "{ABORT} stops it")
        if number != PROMPT_LINE:
            self._devices.release(number)
        track = Track(number, task, self._engine.now, mine=number == ROBOT_PROGRAM, driven_by=self.who)
        self.forget(number)
        self._tracks[number] = track
        self._devices.place(number, folder)
        self._take_robot(track)
        return track

    def free(self) -> int:
        """Return the lowest number that no running task has. Raises TaskActive if all are in use."""
        free = set(range(1, effects.LAST_TASK + 1)) - {track.number for track in self.running}
        if not free:
            raise TaskActive("every task is in use", "{KILL} clears one")
        return min(free)

    def proceed(self, number: int, *, retry: bool = False) -> Track:
        """Continue a stopped task at its next step. `retry`: repeat the step at which it stopped. Raises TaskNotActive,
        TaskActive."""
        if (track := self.get(number)) is None or (not track.running and track.task.is_over):
            raise TaskNotActive(f"task {number}", "{EXECUTE name} starts one")
        if track.running:
            raise TaskActive(f"task {number} runs {track.task.program}")
        if retry:
            track.task.retry()
        track.outcome, track.fault, track.error, track.wake = None, None, None, self._engine.now
        # set now, because the task itself would set it only at its next step
        track.task.state = effects.TaskState.RUNNING
        track.driven_by = self.who
        self._take_robot(track)
        self._run_signal(track, running=True)
        return track

    # --- ending ---

    def abort(self, number: int) -> Track | None:
        """Stop a task, and the robot if this task has it. Return the task; None if no task with this number is
        running."""
        if (track := self.get(number)) is None or not track.running:
            return None
        if isinstance(track.pending, Aborted):
            return track
        track.task.abort()
        if self.owns(track) and not self.only_waits(track):
            self._engine.stop()
        track.until(self._engine.now, Aborted())
        return track

    def only_waits(self, track: Track) -> bool:
        """Return whether a task is a prompt line in real time: aborting it ends only its wait, and the arm continues to
        move."""
        return track.at_prompt and self._engine.realtime

    def end_cycles(self, number: int) -> Track:
        """Make the current cycle of a task its last one (CYCLE.END). Raises TaskNotActive."""
        if (track := self.get(number)) is None or track.task.is_over:
            raise TaskNotActive(f"task {number}", "nothing is to be ended")
        track.task.end_cycles()
        return track

    def stop(self, track: Track, outcome: results.RunOutcome) -> None:
        """End or pause a task: the task releases the robot, turns off its run signal, and releases its files."""
        track.outcome, track.pending, track.stepping = outcome, None, None
        self.release_robot(track)
        self._run_signal(track, running=False)
        if track.task.is_over and not track.at_prompt:
            self._devices.release(track.number)
        else:  # the task may continue: keep its files open, but save what it has written so far
            self._devices.rest(track.number)
        if track.fault is not None and not track.awaited:
            self.failed.append(results.StoppedTask(track.number, track.fault, self._engine.now))
            self.notify(self.failed[-1])

    def kill(self, number: int) -> None:
        """Remove a task that has stopped. Raises TaskNotActive, TaskActive."""
        if (track := self.get(number)) is None:
            raise TaskNotActive(f"task {number}", "there is nothing to clear")
        if track.running:
            raise TaskActive(f"task {number} runs {track.task.program}", f"ABORT {number} stops it")
        self._devices.release(number)
        self.forget(number)

    def forget(self, number: int) -> None:
        if (track := self._tracks.pop(number, None)) is not None and not track.running:
            track.task.close()

    # --- the robot ---

    def owns(self, track: Track) -> bool:
        """Return whether a task has the robot. A prompt line also has it if no task has."""
        return self._owner == track.number or (track.at_prompt and self._owner is None)

    def check_robot_free(self) -> None:
        """Check that no task has the robot. Raises RobotNotAttached."""
        if self._owner is not None:
            raise self.not_attached()

    def not_attached(self) -> RobotNotAttached:
        if self._owner is None:
            return RobotNotAttached("no program has it", "ATTACH takes it")
        return RobotNotAttached(f"task {self._owner} has it", "DETACH there and ATTACH here, or send it a signal")

    def attach_robot(self, track: Track) -> bool:
        """Give the robot to a task. Return False if another task has it."""
        if self._owner not in (None, track.number):
            return False
        self._owner, track.mine = track.number, True
        return True

    def _take_robot(self, track: Track) -> None:
        if track.mine and self._owner is None:
            self._owner = track.number

    def release_robot(self, track: Track) -> None:
        """Take the robot from a task, if the task has it. Tasks that wait for the robot then try again."""
        if self._owner != track.number:
            return
        self._owner = None
        for other in self:
            if isinstance(other.pending, effects.AttachRobot):
                other.wake = self._engine.now

    # --- units ---

    def look_at_units(self) -> None:
        """Wake the tasks that wait for a device, because data has arrived."""
        for track in self.running:
            if isinstance(track.pending, effects.UnitEffect):
                track.wake = self._engine.now

    # --- signals ---

    def _signal_changed(self, signal: int, on: bool) -> None:
        """Wake the tasks whose wait may end, and note the reactions that are due, because a signal has changed."""
        if on and signal == self._engine.settings.parameters["LATCH.SIGNAL"]:
            position = self._engine.position()
            self._latch, self._latched = (position.T_world_tool, position.joints), True
        for track in self.running:
            if track.task.reactions.note_change(signal, on):
                self.observed(track, signal, on)
            if on and track.event_signal == signal:
                self.set_event(track)
            if (isinstance(track.pending, effects.Wait) and not track.pending.ticks) or track.reacts:
                track.wake = self._engine.now

    def set_event(self, track: Track) -> None:
        """Set the event of a task (SET.EVENT). A task that waits for it (WAIT.EVENT) continues now."""
        track.event = True
        if isinstance(track.pending, effects.WaitEvent):
            track.wake = self._engine.now

    def set_run_signal(self, track: Track, signal: int) -> None:
        """Set the number of the output signal that is on while the task runs (RUNSIG)."""
        self._run_signal(track, running=False)
        track.run_signal = signal
        self._run_signal(track, running=True)

    def _run_signal(self, track: Track, *, running: bool) -> None:
        if track.run_signal is not None:
            # with a time stamp the change belongs to the program, and UNDO does not revert it as a command
            stamp = commands.Stamp(self._engine.now)
            self._environment.signals.write(track.run_signal if running else -track.run_signal, stamp=stamp)

    # --- system values for functions of programs ---

    def take_latch(self) -> bool:
        came, self._latched = self._latched, False
        return came

    def latch(self) -> tuple[transform.Transform, joints.Joints] | None:
        return self._latch

    def task(self) -> int:
        return self.current

    def priority(self) -> int:
        track = self.get(self.current)
        return 0 if track is None else track.task.reactions.priority

    def run_state(self, task: int) -> int:
        track = self.get(task)
        return operations.IDLE if track is None else RUN_STATES[track.task.state]

    def event(self, task: int) -> bool:
        track = self.get(task)
        return track is not None and track.event

    def robot_of(self, task: int) -> int:
        track = self.get(task)
        return memory.ROBOT_NUMBER if track is not None and self.owns(track) else 0

    def program_status(self, name: str) -> int:
        if (stored := self._environment.programs.get(key_of(name.strip()))) is None:
            return NOT_IN_MEMORY
        if not stored.analysis.executable:
            return NOT_EXECUTABLE
        if (track := self.uses(stored.name)) is None:
            return NOT_EXECUTING
        return RUNS if track.running else STOPPED

    def identity(self, component: int) -> float:
        digits = re.search(r"\d+", self._engine.model.name)
        major, minor, *_ = __version__.split(".")
        parts = {1: float(digits[0]) if digits else 0.0, 2: 0.0, 3: float(major) + float(minor) / 100.0}
        if component not in parts:
            raise IllegalValue(f"ID({component})", "1 model of the robot, 2 serial number, 3 version of the system")
        return parts[component]

    def unit_status(self, unit: int) -> int:
        return self._devices.unit(self.current, unit).status

    def record_length(self, unit: int) -> int:
        return self._devices.unit(self.current, unit).length

    def connection(self, unit: int) -> int | None:
        return self._devices.connection(self.current, unit)

    def begin_reading(self) -> None:
        self._devices.begin_reading()

    def put_back(self) -> None:
        self._devices.put_back()

    def character(self, unit: int, wait: bool) -> int:
        return self._devices.character(self.current, unit, wait)
