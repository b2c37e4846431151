"""Carry out the requests of tasks (`ACTS`): requests to the robot, waits, input and output, requests to other tasks,
and the end of a program. An act that takes time sets the time at which the task continues; only the driver advances the
clock."""

from __future__ import annotations

from collections.abc import Callable
from itertools import count
from math import inf
from typing import Any

from msgspec import Struct, structs

from vrs_cli.devices.outside import Waits
from vrs_cli.engine.engine import Engine
from vrs_cli.errors import EndOfInput, IllegalValue, NoDataReceived, TaskNotActive, VrsError
from vrs_cli.interfaces import dialogue, users
from vrs_cli.interfaces.tasks.devices import Devices
from vrs_cli.interfaces.tasks.limits import GO_ON, Advice, Limits, Spent
from vrs_cli.interfaces.tasks.tasks import Aborted, Onward, PendingInput, Stopped, Tasks, Track
from vrs_cli.language.run import effects, memory, runtime, variables
from vrs_cli.language.run.environment import Environment
from vrs_cli.trajectory.instant import LATEST, on_grid
from vrs_cli.values import commands, results

VAIN_READ = 100  # count a READ that finds no input as this many steps, because it takes as much CPU time
LOOK = 1.0  # [s] check a unit that waits for data again after this time, so that time limits are noticed
EVERYBODYS = (
    commands.SetChannels,
    commands.SetMonitorSpeed,
    commands.SetParameter,
    commands.SetSwitch,
)  # requests that a task may make even if another task has the robot
STAMPED = (commands.Move, commands.SetChannels, commands.OperateHand)  # requests that may have a time (AT, IN)
STEPS_A_START = 100  # count the start of a task as this many steps, because it takes as much CPU time


class TypedLine(Struct, frozen=True):
    """A line that a program typed (TYPE). `t`: the time of the robot's clock when the line was complete [s]."""

    t: float
    text: str


class TypedLines:
    """The output of programs (TYPE). `lines`: the complete lines since the run began."""

    def __init__(self, engine: Engine, terminal: dialogue.Terminal, advice: Advice) -> None:
        self.lines: list[TypedLine] = []
        self._engine, self._terminal = engine, terminal
        self._line = ""
        self._spent = Spent("max_output", "type", advice)

    def begin(self, limits: Limits) -> None:
        self.lines, self._line = [], ""
        self._spent.begin(limits)

    def count(self, text: str, newline: bool = False) -> None:
        """Count the characters of a string before TYPE prints it. `newline`: whether a line end follows. Raises
        LimitReached if the output is too long."""
        self._spent.add(len(text.encode("utf-8", "replace")) + newline)

    def show(self, text: str, newline: bool) -> None:
        """Print a string for TYPE. If the switch MESSAGES is off, the string is only recorded, not shown on the
        terminal. Raises LimitReached."""
        self.count(text, newline)
        self._put(text, newline)

    def _put(self, text: str, newline: bool) -> None:
        if self._engine.settings.switch("MESSAGES"):
            self._terminal.type(text, newline)
        *lines, self._line = (self._line + text + ("\n" if newline else "")).split("\n")
        now = self._engine.now
        self.lines += [TypedLine(now, line) for line in lines]

    def end_line(self) -> None:
        if self._line:
            self._put("", newline=True)


class Performer:
    """The executor of requests from the tasks of one robot. An act that fails raises VrsError. `asked`: whether a task
    has asked a question that has not yet been passed to the users. `last`: when the current run will be stopped [s]."""

    def __init__(
        self,
        engine: Engine,
        environment: Environment,
        tasks: Tasks,
        transcript: TypedLines,
        devices: Devices,
        advice: Advice,
    ) -> None:
        self.asked, self.last = False, inf
        self._advice = advice
        self._engine, self._environment, self._tasks = engine, environment, tasks
        self._transcript, self._devices, self._questions = transcript, devices, count(1)

    # --- the terminal and the files ---

    def _prompt(self, track: Track, event: effects.Prompt) -> None:
        self._transcript.count(event.text)
        self._ask(track, event)

    def _unit(self, track: Track, event: effects.UnitEffect) -> None:
        if isinstance(event, effects.AwaitLine | effects.ReadRecord) and event.unit == effects.TERMINAL:
            self._ask(track, event)
            return
        answer = self._devices.perform(track.number, event)
        if not isinstance(answer, Waits):
            track.answer = answer
            if (
                isinstance(event, effects.ReadRecord)
                and self._devices.unit(track.number, event.unit).status == NoDataReceived.code
            ):
                track.before -= VAIN_READ
            return
        last = on_grid(track.asked + min(self._devices.outside.patience, LATEST))
        if self._engine.now < last:
            track.until(min(last, on_grid(self._engine.now) + LOOK), event)
        else:
            self._devices.expire(track.number, event)

    def _ask(self, track: Track, event: effects.Prompt | effects.ReadRecord | effects.AwaitLine) -> None:
        """Ask a question; the task waits until it is answered."""
        self.asked = True
        track.until(inf, PendingInput(next(self._questions), event))

    def answer(self, track: Track, asked: PendingInput, answer: str | VrsError | None) -> None:
        """Give a line to a task that has asked for one; None at the end of the input. If the task needs a line and
        there is none, raise EndOfInput, or the error of the last wrong line."""
        track.until(self._engine.now)
        event = asked.event
        if isinstance(event, effects.Prompt) and answer is None:
            raise event.wrong or EndOfInput(f"PROMPT {event.text!r} has nothing more to read")
        if isinstance(event, effects.Prompt):
            track.answer = _line(answer)
        else:
            of_getc = isinstance(event, effects.AwaitLine)
            line = self._devices.line(None if isinstance(answer, EndOfInput) else _line(answer), of_getc=of_getc)
            track.answer = None if of_getc else line

    # --- waits ---

    def _wait(self, track: Track, wait: effects.Wait) -> None:
        first = on_grid(track.asked) + wait.ticks * memory.TICK
        if self._engine.now < first:
            track.until(first, wait)
        elif not wait.condition():
            track.until(on_grid(self._engine.now) + memory.TICK, wait)

    def _wait_event(self, track: Track, wait: effects.WaitEvent) -> None:
        if wait.event and track.event:
            track.event = False
            return
        end = inf if wait.seconds is None else on_grid(track.asked + wait.seconds)
        if self._engine.now < end:
            track.until(end, wait)

    def _set_event(self, track: Track, event: effects.SetEvent) -> None:
        other = track if event.task is None else self._tasks.get(event.task)
        if other is None or not other.running:
            raise TaskNotActive(f"task {event.task}", "an event is set for a task that runs")
        if event.on:
            self._tasks.set_event(other)
        else:
            other.event = False

    def _event_signal(self, track: Track, event: effects.EventSignal) -> None:
        track.event_signal = event.signal

    # --- the robot ---

    def _cycle_begins(self, track: Track, event: effects.CycleBegins) -> None:
        if self._tasks.owns(track) or track.at_prompt:
            for setting in event.settings:
                self._engine.perform(setting)

    def request(self, track: Track, request: commands.Request) -> None:
        """Pass a request to the robot; if the robot is not ready for it, let the task wait until it is."""
        if not (self._tasks.owns(track) or isinstance(request, EVERYBODYS)):
            if isinstance(request, commands.Break | commands.Brake):
                return
            raise self._tasks.not_attached()
        engine, in_program = self._engine, track.in_program
        if in_program and isinstance(request, STAMPED) and request.stamp is not None:
            self._check_in_bounds(request.stamp)
        ready = engine.ready_at(request, program=in_program)
        if ready > engine.now:
            track.until(ready, request)
            return
        issued, track.issued = track.asked if track.issued is None else track.issued, None
        request = request if in_program else by_robot_clock(request, track.times)
        track.until(engine.begin(request, program=in_program, issued=issued))
        for other in self._tasks.running if isinstance(request, commands.Brake) else ():
            # the robot may now be ready earlier: let the waiting task ask again
            if isinstance(other.pending, commands.Request):
                other.wake = engine.now

    def _check_in_bounds(self, stamp: commands.Stamp) -> None:
        """Check that the time stamp of a request (AT, IN) is not after the time limit of the run. Raises
        IllegalValue."""
        word, begin = ("IN", self._engine.now + stamp.seconds) if stamp.relative else ("AT", stamp.seconds)
        if begin > self.last:
            more = self._advice("max_time")
            hint = f"the program is stopped at {self.last:g} s"
            raise IllegalValue(f"{word} {stamp.seconds:g}", hint if more == GO_ON else f"{hint}: {more}")

    def _attach(self, track: Track, event: effects.AttachRobot) -> None:
        if not self._tasks.attach_robot(track):
            track.until(inf, event)

    def _detach(self, track: Track, _event: effects.DetachRobot) -> None:
        track.mine = False
        self._tasks.release_robot(track)

    # --- other tasks ---

    def _start_task(self, track: Track, event: effects.StartTask) -> None:
        """Start a task at the request of `track`. Until the clock advances, it may only do as many steps as the
        starting task has left, so that a program that starts itself repeatedly cannot stop time."""
        number = self._tasks.free() if event.number is None else event.number
        call = event.call
        arguments = [None if one is None else variables.Reference(*one) for one in call.arguments]
        task = runtime.Task(self._environment, self._engine, call.name, arguments, event.cycles, event.step)
        started = self._tasks.start(number, task, self._devices.folders.get(track.number))
        started.instant, started.before = track.instant, track.before - track.task.steps_done - STEPS_A_START

    def _control_task(self, _track: Track, event: effects.ControlTask) -> None:
        number = event.number
        if event.control is effects.TaskControl.ABORT:
            if self._tasks.abort(number) is None:
                raise TaskNotActive(f"task {number}", "it does not run")
        elif event.control is effects.TaskControl.KILL:
            self._tasks.kill(number)
        elif event.control is effects.TaskControl.CYCLE_END:
            self._tasks.end_cycles(number)
        else:
            self._tasks.proceed(number, retry=event.control is effects.TaskControl.RETRY)

    # --- endings ---

    def _end(
        self,
        track: Track,
        event: effects.ProgramCompleted | effects.Halt | effects.Pause | effects.Failed | Aborted | Stopped,
    ) -> None:
        """End the task. A task that has the robot first waits until the robot is at rest, except a prompt line, and
        except a task that fails or is aborted while the clock is paused."""
        rests = not track.at_prompt or (isinstance(event, Aborted) and not self._tasks.only_waits(track))
        fails_while_paused = self._engine.clock.paused and isinstance(event, effects.Failed | Aborted)
        if rests and not fails_while_paused and self._tasks.owns(track) and self._engine.now < self._engine.end:
            track.until(self._engine.end, event)
            return
        if isinstance(event, effects.Failed):
            track.fault, track.error = event.fault, event.error
        if isinstance(event, Stopped):
            track.detail, track.task.state = event.detail, effects.TaskState.PAUSED
        self._tasks.stop(
            track, results.RunOutcome[event.outcome] if isinstance(event, Stopped) else _ENDINGS[type(event)]
        )


def by_robot_clock(request: commands.Request, times: users.HolderTimes) -> commands.Request:
    """Return a request of a prompt line with its time stamp converted from the user's clock to the robot's clock."""
    if not (isinstance(request, STAMPED) and request.stamp is not None and not request.stamp.relative):
        return request
    return structs.replace(request, stamp=commands.Stamp(times.robot_time(request.stamp.seconds)))


def _line(answer: str | VrsError | None) -> str | None:
    """Return the line that an answer contains; None at the end of the input. If the answer is an error, raise it."""
    if isinstance(answer, VrsError):
        raise answer
    return answer


_ENDINGS: dict[type, results.RunOutcome] = {
    effects.ProgramCompleted: results.RunOutcome.COMPLETED,
    effects.Halt: results.RunOutcome.HALTED,
    effects.Pause: results.RunOutcome.PAUSED,
    effects.Failed: results.RunOutcome.FAILED,
    Aborted: results.RunOutcome.ABORTED,
}

ACTS: dict[type, Callable[[Performer, Track, Any], None]] = {
    effects.Type: lambda performer, _track, event: performer._transcript.show(event.text, event.newline),
    effects.Prompt: Performer._prompt,
    **dict.fromkeys(effects.UnitEffect.__subclasses__(), Performer._unit),
    effects.Wait: Performer._wait,
    effects.WaitEvent: Performer._wait_event,
    effects.SetEvent: Performer._set_event,
    effects.EventSignal: Performer._event_signal,
    effects.Budget: lambda performer, track, _event: track.until(on_grid(performer._engine.now) + memory.TICK),
    Onward: lambda _performer, _track, _event: None,  # nothing to do: the task continues with its next step at once
    effects.CycleBegins: Performer._cycle_begins,
    effects.AttachRobot: Performer._attach,
    effects.DetachRobot: Performer._detach,
    effects.RunSignal: lambda performer, track, event: performer._tasks.set_run_signal(track, event.signal),
    effects.StartTask: Performer._start_task,
    effects.ControlTask: Performer._control_task,
    **dict.fromkeys((*_ENDINGS, Stopped), Performer._end),
}
