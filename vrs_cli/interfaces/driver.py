"""The driver of running programs: performs what they ask, in the time of the robot's clock.

Program and motion run side by side: a motion is begun and the program goes on; the next motion waits until it may
begin. Several programs run side by side too, each a task with a number: 0 is the robot program, 1 the process control
program of VAL-II, others those of V+; a line of the prompt comes before them all. Each has an instant at which it goes
on. The earliest goes on first, of equal ones the lowest number, so that the same programs give the same timeline.
Nothing here is faster or slower than the clock that was passed in.

A task that waits for a condition looks at it every tick, and at once when a signal changes. The robot belongs to one
task at a time: to task 0 when it starts, or to the one that attaches it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from enum import Enum
from math import inf
from pathlib import Path
from typing import Any, Protocol, TypeGuard, TypeVar, get_args

from vrs_cli.engine.commands import Brake, Break, Request, SetMonitorSpeed, SetParameter, SetSwitch
from vrs_cli.engine.engine import Engine
from vrs_cli.errors import ClockPaused, RobotNotAttached, TaskActive, TaskNotActive, TimeExhausted, VrsError
from vrs_cli.files.disk import Disk
from vrs_cli.interfaces.debugging import Debugging, Onward, Stepping, Stopped
from vrs_cli.interfaces.devices import Devices
from vrs_cli.interfaces.system import SystemReadings
from vrs_cli.language.effects import (
    AttachRobot,
    Control,
    ControlTask,
    CycleBegins,
    DetachRobot,
    Prompt,
    RunSignal,
    SetEvent,
    StartTask,
    Type,
    Wait,
    WaitEvent,
)
from vrs_cli.language.environment import Environment, Robot
from vrs_cli.language.events import Budget, Completed, Event, Failed, Halted, Paused, ProgramFault, TaskState
from vrs_cli.language.inputs import NO_INPUTS, Inputs
from vrs_cli.language.runtime import BUDGET, Task
from vrs_cli.language.semantics.tasks import LAST_TASK
from vrs_cli.language.units import UnitEffect
from vrs_cli.trajectory.instant import on_grid

WAIT_TICK = on_grid(0.028)  # [s] a WAIT is tested, and a busy loop seen to be one, every trajectory tick of VAL-II
LONGEST = 86_400.0  # [s] of virtual time that a program may take unless told otherwise: a day
ROBOT_PROGRAM = 0
PROMPT_LINE = -1  # the number of the task that a line of the prompt is
EVERYBODYS = (SetMonitorSpeed, SetParameter, SetSwitch)  # requests that a task without the robot may make


class Console(Protocol):
    """What a running program needs of a terminal."""

    def type(self, text: str, newline: bool) -> None:
        """TYPE output."""

    def ask(self, prompt: str) -> str:
        """PROMPT: one line. Raises VrsError when there is no more input."""


class Outcome(Enum):
    """How a run ended; `value` is VAL-II's word for it."""

    COMPLETED = "Program completed"
    HALTED = "(HALTED)"
    PAUSED = "(PAUSED)"
    ABORTED = "(ABORTED)"
    FAILED = "error"
    STEPPED = "(STEP)"
    BREAKPOINT = "(BREAKPOINT)"
    WATCHED = "(WATCH)"


@dataclass(frozen=True, slots=True)
class Beside:
    """Another task that stopped with an error in the meantime."""

    number: int
    fault: ProgramFault


@dataclass(frozen=True, slots=True)
class RunResult:
    """A run of a program: cycles completed, robot clock at begin and end [s], what it typed, what went wrong.

    `beside`: the other tasks that stopped with an error; `detail`: what a watched expression has become.
    """

    program: str
    cycles: int
    started: float
    ended: float
    typed: tuple[str, ...]
    fault: ProgramFault | None
    outcome: Outcome
    beside: tuple[Beside, ...] = ()
    detail: str = ""


@dataclass(frozen=True, slots=True)
class Bounds:
    """When a program is stopped that does not stop by itself."""

    max_time: float = LONGEST
    max_steps: int | None = None


A_DAY = Bounds()


@dataclass(frozen=True, slots=True)
class _Aborted:
    """What a task waits with that is stopped from outside: until the robot is at rest."""


Pending = Event | _Aborted | Stopped | Onward
_P = TypeVar("_P", bound=Pending)


@dataclass(eq=False, slots=True)
class Track:
    """A task on its way: it goes on at `wake` [s], after `pending` is done where that is not None.

    `outcome` is None while it runs. `asked`: when `pending` was asked for. `mine`: it takes the robot when it goes on.
    `instant`: when it last went on, `before`: how many steps it had done then. `held`: what reactions
    have interrupted, and when that was asked for.
    """

    number: int
    task: Task
    wake: float = 0.0
    pending: Pending | None = None
    asked: float = 0.0
    answer: str | None = None
    outcome: Outcome | None = None
    fault: ProgramFault | None = None
    error: VrsError | None = None
    detail: str = ""
    mine: bool = False
    event: bool = False
    run_signal: int | None = None
    stepping: Stepping | None = None
    instant: float = -1.0
    before: int = 0
    held: list[tuple[Pending, float]] = field(default_factory=list)

    @property
    def running(self) -> bool:
        return self.outcome is None

    @property
    def at_prompt(self) -> bool:
        return self.number == PROMPT_LINE

    @property
    def in_program(self) -> bool:
        """Not in a line of the prompt: its motion is over when it returns, and one with a time stamp leaves the clock
        alone; a program that it CALLs runs as any other."""
        return not self.at_prompt or len(self.task.stack) > 1


class Driver:
    """Runs the tasks of one robot. `tasks` are those that run or have stopped, by number; `current` is the number of
    the one whose turn it is. `folder`: where programs have their files."""

    def __init__(
        self, engine: Engine, console: Console, environment: Environment, robot: Robot, folder: Path = Path()
    ) -> None:
        self.engine, self.console, self.environment, self.robot = engine, console, environment, robot
        self.devices = Devices(Disk(folder), console.ask, self._show)
        self.current = PROMPT_LINE
        self.tasks: dict[int, Track] = {}
        self.inputs: Inputs = NO_INPUTS
        self.debugging = Debugging()
        self.typed: list[str] = []
        self._line = ""
        self._owner: int | None = None
        self._interrupted = False
        self._running = False
        self._asking = True
        self._beside: list[Beside] = []
        environment.signals.listeners.append(self._signal_changed)
        environment.system = SystemReadings(self)

    # --- from outside ---

    @property
    def running(self) -> bool:
        return self._running

    def interrupt(self) -> None:
        """Stop the run before its next step and the robot as soon as it can. Safe in a signal handler."""
        self._interrupted = True

    def start(self, number: int, task: Task) -> Track:
        """A task beside those that run, from now on. Raises TaskActive."""
        there = self.tasks.get(number)
        if there is not None and there.running:
            raise TaskActive(f"task {number} runs {there.task.program}", "ABORT stops it")
        if number != PROMPT_LINE:
            self.devices.disk.release(number)
        track = Track(number, task, self.engine.now, mine=number == ROBOT_PROGRAM)
        self.tasks[number] = track
        self._take_robot(track)
        return track

    def prime(self, number: int, task: Task) -> Track:
        """Ready to run, and stopped before its first step. Raises TaskActive."""
        track = self.start(number, task)
        task.state = TaskState.PAUSED
        self._stop(track, Outcome.PAUSED)
        return track

    def stopped(self, number: int) -> Track:
        """A task that can go on. Raises TaskNotActive, TaskActive."""
        track = self.tasks.get(number)
        if track is None or (not track.running and track.task.ended):
            raise TaskNotActive(f"task {number}", "EXECUTE starts one")
        if track.running:
            raise TaskActive(f"task {number} runs {track.task.program}")
        return track

    def proceed(self, number: int, *, retry: bool = False) -> Track:
        """Let a task go on that has stopped: at its next step, or (`retry`) again with the one where it stopped.

        Raises TaskNotActive, TaskActive.
        """
        track = self.stopped(number)
        if retry:
            track.task.retry()
        track.outcome, track.fault, track.error, track.wake = None, None, None, self.engine.now
        self._take_robot(track)
        self._run_signal(track, running=True)
        return track

    def abort(self, number: int) -> Track | None:
        """Stop a task, and the robot if it is its; None where there is none that runs."""
        track = self.tasks.get(number)
        if track is None or not track.running:
            return None
        if isinstance(track.pending, _Aborted):
            return track
        track.task.abort()
        if self._owns(track) and not self._only_waits(track):
            self.engine.stop()
        track.pending, track.wake = _Aborted(), self.engine.now
        return track

    def _only_waits(self, track: Track) -> bool:
        """A line of the prompt in real time: the arm moves whether it waits or not."""
        return track.at_prompt and self.engine.realtime

    def kill(self, number: int) -> None:
        """Forget a task that has stopped. Raises TaskNotActive, TaskActive."""
        track = self.tasks.get(number)
        if track is None:
            raise TaskNotActive(f"task {number}", "there is nothing to clear")
        if track.running:
            raise TaskActive(f"task {number} runs {track.task.program}", f"ABORT {number} stops it")
        self.devices.disk.release(number)
        del self.tasks[number]

    def end_cycles(self, number: int) -> Track:
        """CYCLE.END: the present cycle of a task is its last. Raises TaskNotActive."""
        track = self.tasks.get(number)
        if track is None or track.task.ended:
            raise TaskNotActive(f"task {number}", "nothing is to be ended")
        track.task.end_cycles()
        return track

    def uses(self, program: str) -> Track | None:
        """A task that has a program on its stack."""
        tracks = (self.tasks[number] for number in sorted(self.tasks))
        return next((track for track in tracks if not track.task.ended and track.task.uses(program)), None)

    # --- running ---

    def run(self, track: Track, bounds: Bounds = A_DAY, progress: Callable[[float], None] | None = None) -> RunResult:
        """Let time go on until a task stops; the others run beside it. `progress` is told the clock now and then."""
        started, steps = self.engine.now, self._steps()
        self.typed, self._line, self._beside = [], "", []
        self._interrupted, self._running = False, True
        try:
            while track.running:
                if self._interrupted:
                    self._interrupted = False
                    self.abort(track.number)
                self._go_on(track, started + bounds.max_time, bounds, steps)
                if progress is not None:
                    progress(self.engine.now)
        except BaseException:
            self._give_up(track)
            raise
        finally:
            self._running = False
        if self._line:
            self._type(track, Type("", newline=True))
        return self._result(track, started)

    def _give_up(self, foreground: Track) -> None:
        """Something from outside broke the run off: its task stops here, and so does one that was broken itself."""
        self.engine.stop()
        for track in self.tasks.values():
            if track.running and (track is foreground or track.task.broken):
                track.task.abort()
                self._stop(track, Outcome.ABORTED)

    def settle(self, until: float | None = None, *, asking: bool = True) -> tuple[Beside, ...]:
        """Let the tasks do all that is due by an instant, that which time has reached unless told otherwise; those
        that stopped with an error. Without `asking` nobody can answer now: a PROMPT waits.
        """
        self._beside, self._asking = [], asking
        clock = self.engine.clock
        until = clock.reached if until is None else until
        while (coming := self._coming()) <= until:
            clock.advance(coming)
            self._happen(BUDGET)
        clock.advance(until)
        self._asking = True
        return tuple(self._beside)

    def _coming(self) -> float:
        """When something happens next."""
        track = self._next()
        return inf if track is None else min(track.wake, self.inputs.next_time)

    def _happen(self, budget: int) -> None:
        """What is due now: an input changes, or a task goes on."""
        if self.inputs.next_time <= self.engine.now:
            self.inputs = self.inputs.applied(self.engine.now, self.environment.signals)
            return
        track = self._next()
        assert track is not None
        self._turn(track, budget)

    def _result(self, track: Track, started: float) -> RunResult:
        assert track.outcome is not None
        task = track.task
        return RunResult(
            task.program,
            task.cycles_done,
            started,
            self.engine.now,
            tuple(self.typed),
            track.fault,
            track.outcome,
            tuple(self._beside),
            track.detail,
        )

    def _go_on(self, foreground: Track, last: float, bounds: Bounds, before: int) -> None:
        """The next thing that happens: an input changes, or a task goes on; or the bounds are reached."""
        now, coming = self.engine.now, self._coming()
        if coming > last and not isinstance(foreground.pending, Failed | _Aborted):
            self.engine.clock.advance(max(last, now))
            what = f"the program was still running after {bounds.max_time:g} s of the robot's time"
            self._exhausted(foreground, what, "give it more time with --max-time")
            return
        if not self._waited(foreground, coming):
            return
        if bounds.max_steps is None:
            self._happen(BUDGET)
            return
        self._happen(bounds.max_steps - (self._steps() - before) + 1)  # the one too many begins, and is not done
        if self._steps() - before > bounds.max_steps and foreground.running:
            what = f"the program was still running after {bounds.max_steps} steps"
            self._exhausted(foreground, what, "give it more with --max-steps")

    def _waited(self, foreground: Track, coming: float) -> bool:
        """Let time go on; whether it has come so far. On a clock that stands, the foreground waits in vain."""
        try:
            self.engine.clock.wait(coming)
        except ClockPaused as error:
            foreground.pending = None
            self._do(foreground, foreground.task.throw(error))
        return self.engine.now >= coming

    def _steps(self) -> int:
        return sum(track.task.steps_done for track in self.tasks.values())

    def _next(self) -> Track | None:
        """The task that goes on first."""
        return min(
            (track for track in self.tasks.values() if track.running),
            key=lambda track: (track.wake, track.number),
            default=None,
        )

    def _turn(self, track: Track, budget: int) -> None:
        """One task goes on, until it wants something that takes time or another task may have its turn."""
        self.current = track.number
        event = self._event(track, budget)
        while True:
            try:
                self._do(track, event)
                break
            except VrsError as error:
                event = track.task.throw(error)
                if self._left_now(track) <= 0:  # REACTE mends a step in vain: that must not go on for ever now
                    self._until(track, self._tick(), event)
                    break
        self.current = PROMPT_LINE

    def _event(self, track: Track, budget: int) -> Pending:
        """What a task wants now: what it was waiting for, or what comes next in its program."""
        pending, track.pending = track.pending, None
        if pending is not None:
            due = track.task.reactions.due
            if due is not None and self._interruptible(pending, due.immediate):
                track.held.append((pending, track.asked))
                track.asked = self.engine.now
                return self._asked_again(track, track.task.react(pending))
            return pending
        budget = min(budget, self._left_now(track))
        if budget <= 0:
            return Budget()
        track.asked = self.engine.now
        answer, track.answer = track.answer, None
        if self._careful(track):
            return self._asked_again(track, self.debugging.step(track.task, answer, track.stepping, self._trace))
        return self._asked_again(track, track.task.resume(answer, budget))

    @staticmethod
    def _asked_again(track: Track, event: _P) -> _P:
        """What a reaction had interrupted was asked for when it first was."""
        for held in track.held:
            if held[0] is event:
                track.asked = held[1]
                track.held.remove(held)
                break
        return event

    def _left_now(self, track: Track) -> int:
        """How many steps a task may do at the present instant before time has to go on."""
        if track.instant != self.engine.now:
            track.instant, track.before = self.engine.now, track.task.steps_done
        return BUDGET - (track.task.steps_done - track.before)

    @staticmethod
    def _interruptible(pending: Pending, immediate: bool) -> TypeGuard[Event]:
        """A WAIT, by any reaction; by REACTI also what waits for the robot."""
        return isinstance(pending, Wait | WaitEvent) or (immediate and isinstance(pending, Request))

    # --- what is asked for ---

    def _do(self, track: Track, event: Pending) -> None:
        """Raises VrsError where it cannot be done."""
        track.wake = self.engine.now
        act = _ACTS.get(type(event))
        if act is None:
            self._request(track, event)  # type: ignore[arg-type]
        else:
            act(self, track, event)

    def _until(self, track: Track, instant: float, pending: Pending | None = None) -> None:
        track.wake, track.pending = instant, pending

    def _tick(self) -> float:
        return on_grid(self.engine.now) + WAIT_TICK

    def _type(self, track: Track, event: Type) -> None:
        del track
        self._show(event.text, event.newline)

    def _show(self, text: str, newline: bool) -> None:
        if self.engine.parameters.switch("MESSAGES"):
            self.console.type(text, newline)
        *lines, self._line = (self._line + text + ("\n" if newline else "")).split("\n")
        self.typed += lines

    def _prompt(self, track: Track, event: Prompt) -> None:
        if not self._asking:
            self._until(track, self._tick(), event)
            return
        track.answer = self.console.ask(event.text)

    def _unit(self, track: Track, event: UnitEffect) -> None:
        track.answer = self.devices.perform(track.number, event)

    def _wait(self, track: Track, wait: Wait) -> None:
        first = on_grid(track.asked) + wait.ticks * WAIT_TICK
        if self.engine.now < first:
            self._until(track, first, wait)
        elif not wait.condition():
            self._until(track, self._tick(), wait)

    def _wait_event(self, track: Track, wait: WaitEvent) -> None:
        if wait.event and track.event:
            track.event = False
            return
        end = inf if wait.seconds is None else on_grid(track.asked + wait.seconds)
        if self.engine.now < end:
            self._until(track, end, wait)

    def _set_event(self, _track: Track, event: SetEvent) -> None:
        other = self.tasks.get(event.task)
        if other is None or not other.running:
            raise TaskNotActive(f"task {event.task}", "an event is set for a task that runs")
        other.event = True
        if isinstance(other.pending, WaitEvent):
            other.wake = self.engine.now

    def _budget(self, track: Track, _event: Budget) -> None:
        track.wake = self._tick()

    def _onward(self, track: Track, _event: Onward) -> None:
        """The next step at once."""

    def _cycle_begins(self, track: Track, event: CycleBegins) -> None:
        if self._owns(track) or track.at_prompt:
            for setting in event.settings:
                self.engine.perform(setting)

    def _request(self, track: Track, request: Request) -> None:
        if not (self._owns(track) or isinstance(request, EVERYBODYS)):
            if isinstance(request, Break | Brake):
                return
            raise self._not_attached()
        engine, in_program = self.engine, track.in_program
        ready = engine.ready_at(request, program=in_program)
        if ready > engine.now:
            self._until(track, ready, request)
            return
        self._until(track, engine.begin(request, program=in_program, issued=track.asked))
        if isinstance(request, Brake):
            self._look_again()

    def _look_again(self) -> None:
        """The robot will be at rest at another time than was thought."""
        for track in self.tasks.values():
            if track.running and isinstance(track.pending, Request):
                track.wake = self.engine.now

    # --- the robot ---

    def _owns(self, track: Track) -> bool:
        return self._owner == track.number or (track.at_prompt and self._owner is None)

    def _take_robot(self, track: Track) -> None:
        if track.mine and self._owner is None:
            self._owner = track.number

    def check_robot_free(self) -> None:
        """Raises RobotNotAttached where a task has the robot."""
        if self._owner is not None:
            raise self._not_attached()

    def _not_attached(self) -> RobotNotAttached:
        if self._owner is None:
            return RobotNotAttached("no program has it", "ATTACH takes it")
        return RobotNotAttached(f"task {self._owner} has it", "DETACH there and ATTACH here, or send it a signal")

    def _attach(self, track: Track, event: AttachRobot) -> None:
        if self._owner not in (None, track.number):
            self._until(track, inf, event)
            return
        self._owner, track.mine = track.number, True

    def _detach(self, track: Track, _event: DetachRobot) -> None:
        track.mine = False
        self._release(track)

    def _release(self, track: Track) -> None:
        if self._owner != track.number:
            return
        self._owner = None
        for other in self.tasks.values():
            if isinstance(other.pending, AttachRobot):
                other.wake = self.engine.now

    # --- signals ---

    def _signal_changed(self, signal: int, on: bool) -> None:
        """Waits that a signal may end are looked at now, and so are reactions."""
        for track in self.tasks.values():
            if not track.running:
                continue
            track.task.signal_changed(signal, on)
            due, pending = track.task.reactions.due, track.pending
            if (isinstance(pending, Wait) and not pending.ticks) or (
                due is not None and pending is not None and self._interruptible(pending, due.immediate)
            ):
                track.wake = self.engine.now

    def _run_signal_set(self, track: Track, event: RunSignal) -> None:
        self._run_signal(track, running=False)
        track.run_signal = event.signal
        self._run_signal(track, running=True)

    def _run_signal(self, track: Track, *, running: bool) -> None:
        if track.run_signal is not None:
            self.environment.signals.write(track.run_signal if running else -track.run_signal)

    # --- other tasks ---

    def _start_task(self, _track: Track, event: StartTask) -> None:
        number = self._free() if event.number is None else event.number
        call = event.call
        task = Task(self.environment, self.robot, call.name, call.arguments, event.cycles, event.step)
        self.start(number, task)

    def _free(self) -> int:
        for number in range(1, LAST_TASK + 1):
            if number not in self.tasks or not self.tasks[number].running:
                return number
        raise TaskActive("every task is in use", "KILL clears one")

    def _control_task(self, track: Track, event: ControlTask) -> None:
        number = event.number
        if event.control is Control.ABORT:
            if self.abort(number) is None:
                raise TaskNotActive(f"task {number}", "it does not run")
        elif event.control is Control.KILL:
            self.kill(number)
        elif event.control is Control.CYCLE_END:
            self.end_cycles(number)
        else:
            self.proceed(number, retry=event.control is Control.RETRY)
        del track

    # --- one step at a time ---

    def _careful(self, track: Track) -> bool:
        """Whether each step is looked at before it is done."""
        tracing = self.engine.parameters.switch("TRACE")
        return not track.at_prompt and (tracing or track.stepping is not None or self.debugging.active)

    def _trace(self, task: Task) -> None:
        if self.engine.parameters.switch("TRACE"):
            self.console.type(f"{task.program} {task.step}: {task.source}", newline=True)

    # --- endings ---

    def _end(self, track: Track, event: Completed | Halted | Paused | Failed | _Aborted | Stopped) -> None:
        """Once the robot is at rest, if it is this task's, and no line of the prompt."""
        rests = not track.at_prompt or (isinstance(event, _Aborted) and not self._only_waits(track))
        if rests and self._owns(track) and self.engine.now < self.engine.end:
            self._until(track, self.engine.end, event)
            return
        if isinstance(event, Failed):
            track.fault, track.error = event.fault, event.error
        if isinstance(event, Stopped):
            track.detail, track.task.state = event.detail, TaskState.PAUSED
        self._stop(track, Outcome[event.outcome] if isinstance(event, Stopped) else _ENDINGS[type(event)])

    def _stop(self, track: Track, outcome: Outcome) -> None:
        track.outcome, track.pending, track.stepping = outcome, None, None
        self._release(track)
        self._run_signal(track, running=False)
        self._put_files(track)
        if track.fault is not None and track.number > ROBOT_PROGRAM:
            self._beside.append(Beside(track.number, track.fault))

    def _put_files(self, track: Track) -> None:
        """What a task has written is in its files when it stops; they are closed when it cannot go on."""
        if track.task.ended and not track.at_prompt:
            self.devices.disk.release(track.number)
        else:
            self.devices.disk.rest(track.number)

    def _exhausted(self, foreground: Track, what: str, hint: str) -> None:
        where = "; ".join(self._whereabouts(foreground))
        foreground.pending = None
        self.engine.stop()
        self._do(foreground, foreground.task.throw(TimeExhausted(f"{what}: {where}", hint)))

    def _whereabouts(self, foreground: Track) -> Iterator[str]:
        """Where each task hangs, the one that was waited for first."""
        others = [self.tasks[number] for number in sorted(self.tasks) if self.tasks[number] is not foreground]
        for track in [foreground, *(track for track in others if track.running)]:
            task = track.task
            waits = "waits" if track.pending is not None else "is busy"
            number = f"task {track.number}, " if track.number > ROBOT_PROGRAM else ""
            place = f"{number}{task.program or 'the line'} step {task.step}"
            yield f"{place} {waits} at {task.source}" if task.source else f"{place} {waits}"


_ENDINGS: dict[type, Outcome] = {
    Completed: Outcome.COMPLETED,
    Halted: Outcome.HALTED,
    Paused: Outcome.PAUSED,
    Failed: Outcome.FAILED,
    _Aborted: Outcome.ABORTED,
}

_ACTS: dict[type, Callable[[Driver, Track, Any], None]] = {
    Type: Driver._type,
    Prompt: Driver._prompt,
    Wait: Driver._wait,
    WaitEvent: Driver._wait_event,
    SetEvent: Driver._set_event,
    Budget: Driver._budget,
    Onward: Driver._onward,
    CycleBegins: Driver._cycle_begins,
    AttachRobot: Driver._attach,
    DetachRobot: Driver._detach,
    **dict.fromkeys(get_args(UnitEffect), Driver._unit),
    RunSignal: Driver._run_signal_set,
    StartTask: Driver._start_task,
    ControlTask: Driver._control_task,
    **dict.fromkeys((*_ENDINGS, Stopped), Driver._end),
}
