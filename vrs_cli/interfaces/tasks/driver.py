"""The driver of running programs: performs what they ask, in the time of the robot's clock.

Program and motion run side by side: a motion is begun and the program goes on; the next motion waits until it may
begin. Several programs run side by side too, each a task with a number; a line of the prompt comes before them all.
Each has an instant at which it goes on. The earliest goes on first, of equal ones the lowest number, so that the same
programs give the same timeline. Nothing here is faster or slower than the clock that was passed in.

A task that waits for a condition looks at it every tick, and at once when a signal changes.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from math import inf
from pathlib import Path
from typing import TypeVar, cast

from msgspec import Struct

from vrs_cli.dialogue.questions import LineWanted
from vrs_cli.dialogue.terminal import Console
from vrs_cli.engine.engine import Engine
from vrs_cli.errors import ClockPaused, LimitReached, VrsError
from vrs_cli.files.disk import Disk
from vrs_cli.interfaces.tasks.debugging import Debugging
from vrs_cli.interfaces.tasks.devices import Devices
from vrs_cli.interfaces.tasks.performing import Performer
from vrs_cli.interfaces.tasks.runs import USUAL, Limits, Outcome, RunResult, Spent
from vrs_cli.interfaces.tasks.system import SystemReadings
from vrs_cli.interfaces.tasks.tasks import Tasks
from vrs_cli.interfaces.tasks.track import PROMPT_LINE, ROBOT_PROGRAM, Aborted, Pending, Track
from vrs_cli.interfaces.tasks.transcript import Transcript
from vrs_cli.language.run.environment import Environment
from vrs_cli.language.run.events import Budget, Event, Failed
from vrs_cli.language.run.inputs import NO_INPUTS, Inputs
from vrs_cli.language.run.robot import RobotReadings
from vrs_cli.language.run.runtime import BUDGET, Task

_P = TypeVar("_P", bound=Pending)


ELEMENTS_A_STEP = 20  # that may be counted again for each step that was done: the cost is small beside that of steps
MOST_A_STEP = 200  # elements that a step can add; a string has 128 characters


class _SoFar(Struct):
    """A run: its limits, when it is to end, the steps done before it, and after how many its memory is looked at."""

    limits: Limits
    last: float
    before: int
    look: int = 0


class Driver:
    """Runs the `tasks` of one robot. `folder`: where programs have their files."""

    def __init__(
        self, engine: Engine, console: Console, environment: Environment, robot: RobotReadings, folder: Path = Path()
    ) -> None:
        self.engine, self.console, self.environment = engine, console, environment
        self.inputs: Inputs = NO_INPUTS
        self.debugging = Debugging()
        self._transcript = Transcript(engine, console)
        self._written = Spent("max_disk", "write")
        self.devices = Devices(Disk(folder, self._written.add), self._ask, self._transcript.show)
        self.tasks = Tasks(engine, environment, self.devices.disk)
        self._performer = Performer(engine, environment, robot, self.tasks, self._ask, self._transcript, self.devices)
        self._interrupted = False
        self._ended_by: LimitReached | None = None
        self._running = False
        self.asks = False  # for a line, which somebody has to give
        environment.system = SystemReadings(engine.model.name, environment, self.tasks, self.devices)

    @property
    def running(self) -> bool:
        return self._running

    def close(self) -> None:
        """Close the files of programs."""
        self.devices.disk.close_all()

    def end_by(self, error: LimitReached) -> bool:
        """End the run before its next step with this error; False where none is under way. Safe in a signal handler."""
        if self._running:
            self._ended_by = error
        return self._running

    def interrupt(self) -> None:
        """Stop the run before its next step and the robot as soon as it can. Safe in a signal handler."""
        self._interrupted = True

    # --- in the foreground ---

    def run(self, track: Track, limits: Limits = USUAL, progress: Callable[[float], None] | None = None) -> RunResult:
        """Let time go on until a task stops; the others run beside it. `progress` is told the clock now and then."""
        started = self.engine.now
        so_far = _SoFar(limits, started + limits.max_time, self.tasks.steps_done)
        self._transcript.begin(limits)
        self._written.begin(limits)
        self.tasks.failed, self.tasks.foreground = [], track
        self._interrupted, self._running = False, True
        self._performer.limits, self._performer.last = limits, so_far.last
        try:
            while track.running:
                if self._interrupted:
                    self._interrupted = False
                    self._catch_up()
                    self.tasks.abort(track.number)
                if self._ended_by is not None:
                    error, self._ended_by = self._ended_by, None
                    self._exhausted(track, error.detail, error.hint)
                self._go_on(track, so_far)
                if progress is not None:
                    progress(self.engine.now)
        except BaseException:
            self._give_up(track)
            raise
        finally:
            self._running, self.tasks.foreground, self._performer.last = False, None, inf
        self._transcript.end_line()
        return self._result(track, started)

    def _ask(self, prompt: str) -> str:
        """A line for a program; an empty one where Ctrl-C comes instead, which stops the run."""
        self.asks = True
        try:
            return self.console.ask(LineWanted(prompt))
        except KeyboardInterrupt:
            self._interrupted = True
            return ""
        finally:
            self.asks = False

    def _catch_up(self) -> None:
        """Who is stopped from outside is stopped now, however late its own steps are."""
        self.engine.clock.advance(self.engine.clock.reached)

    def _give_up(self, foreground: Track) -> None:
        """Something from outside broke the run off: its task stops here, and so does one that was broken itself."""
        self._catch_up()
        self.engine.stop()
        for track in self.tasks.running:
            if track is foreground or track.task.broken:
                track.task.abort()
                self.tasks.stop(track, Outcome.ABORTED)

    def broken_off(self, error: LimitReached) -> RunResult:
        """The result of a run that `error` broke off in the middle of a step."""
        track = self.tasks.get(ROBOT_PROGRAM)
        assert track is not None
        self._give_up(track)
        track.fault, track.outcome = track.task.break_off(error), Outcome.FAILED
        self._transcript.end_line()
        return self._result(track, 0.0)

    def _result(self, track: Track, started: float) -> RunResult:
        assert track.outcome is not None
        task = track.task
        return RunResult(
            task.program,
            task.cycles_done,
            started,
            self.engine.now,
            tuple(self._transcript.lines),
            track.fault,
            track.outcome,
            tuple(self.tasks.failed),
            track.detail,
        )

    def _go_on(self, foreground: Track, so_far: _SoFar) -> None:
        """The next thing that happens: an input changes, or a task goes on; or a limit is reached."""
        limits, now, coming = so_far.limits, self.engine.now, self._coming()
        if coming > so_far.last and not isinstance(foreground.pending, Failed | Aborted):
            self.engine.clock.advance(max(so_far.last, now))
            what = f"the program was still running after {limits.max_time:g} s of the robot's time"
            self._exhausted(foreground, what + self._asked_after(so_far.last), limits.told_by("max_time"))
            return
        if not self._waited(foreground, coming):
            return
        if limits.max_steps is None:
            self._happen(BUDGET)
        else:
            done = self.tasks.steps_done - so_far.before
            self._happen(limits.max_steps - done + 1)  # the one too many begins, and is not done
        if foreground.running:
            self._look(foreground, so_far)

    def _look(self, foreground: Track, so_far: _SoFar) -> None:
        """Whether a limit of steps or of memory is reached."""
        limits, done = so_far.limits, self.tasks.steps_done - so_far.before
        if limits.max_steps is not None and done > limits.max_steps:
            what = f"the program was still running after {limits.max_steps} steps"
            self._exhausted(foreground, what, limits.told_by("max_steps"))
        elif limits.max_elements is not None and done >= so_far.look:
            held = self.environment.held() + sum(track.task.held() for track in self.tasks)
            so_far.look = done + max(held // ELEMENTS_A_STEP, (limits.max_elements - held) // MOST_A_STEP)
            if held > limits.max_elements:
                what = f"arrays and strings hold {held} elements, {limits.max_elements} at most"
                self._exhausted(foreground, what, limits.told_by("max_elements"))

    def _waited(self, foreground: Track, coming: float) -> bool:
        """Let time go on; whether it has come so far. On a clock that stands, the foreground waits in vain."""
        try:
            self.engine.clock.wait(coming)
        except ClockPaused as error:
            foreground.pending = None
            self._performer.do(foreground, self._thrown(foreground, error))
        return self.engine.now >= coming

    def _exhausted(self, foreground: Track, what: str, hint: str) -> None:
        where = "; ".join(self._whereabouts(foreground))
        foreground.pending = None
        self.engine.stop()
        self._performer.do(foreground, self._thrown(foreground, LimitReached(f"{what}: {where}", hint)))

    def _asked_after(self, last: float) -> str:
        """The first motion that was asked for a time after `last` [s], to say who is to blame."""
        late = (one.text for one in self.engine.records() if one.asked is not None and one.asked > last)
        text = next(late, None)
        return "" if text is None else f", and {text} was asked for later than that"

    def _whereabouts(self, foreground: Track) -> Iterator[str]:
        """Where each task hangs, the one that was waited for first."""
        others = [track for track in self.tasks.in_order() if track.running and track is not foreground]
        for track in [foreground, *others]:
            task = track.task
            waits = "waits" if track.pending is not None else "is busy"
            number = f"task {track.number}, " if track.number > ROBOT_PROGRAM else ""
            place = f"{number}{task.program or 'the line'} step {task.step}"
            yield f"{place} {waits} at {task.source}" if task.source else f"{place} {waits}"

    # --- in the background ---

    def settle(self, until: float | None = None, *, asking: bool = True) -> None:
        """Let the tasks do all that is due by an instant, that which time has reached unless told otherwise. Without
        `asking` nobody can answer now: a PROMPT waits.
        """
        self._performer.asking = asking
        clock = self.engine.clock
        until = clock.reached if until is None else until
        while (coming := self._coming()) <= until:
            clock.advance(coming)
            self._happen(BUDGET)
        clock.advance(until)
        self._performer.asking = True

    # --- what happens next ---

    def _coming(self) -> float:
        """When something happens next."""
        track = self.tasks.next()
        return inf if track is None else min(track.wake, self.inputs.next_time)

    def _happen(self, budget: int) -> None:
        """What is due now: an input changes, or a task goes on."""
        if self.inputs.next_time <= self.engine.now:
            self.inputs = self.inputs.applied(self.engine.now, self.environment.signals)
            return
        track = self.tasks.next()
        assert track is not None
        self._turn(track, budget)

    def _turn(self, track: Track, budget: int) -> None:
        """One task goes on, until it wants something that takes time or another task may have its turn."""
        self.tasks.current = track.number
        event = self._event(track, budget)
        while True:
            try:
                self._performer.do(track, event)
                break
            except VrsError as error:
                event = self._thrown(track, error)
        self.tasks.current = PROMPT_LINE
        if track.reacts and self._left_now(track) > 0:  # to more than one signal: one after the other
            track.wake = self.engine.now

    def _event(self, track: Track, budget: int) -> Pending:
        """What a task wants now: what it was waiting for, or what comes next in its program."""
        reacts, pending, track.pending = track.reacts, track.pending, None
        if pending is not None:
            if not reacts:
                return pending
            track.held.append((pending, track.asked))
            track.asked = self.engine.now
            return self._asked_again(track, track.task.react(cast(Event, pending)))
        budget = min(budget, self._left_now(track))
        if budget <= 0:
            return Budget()
        track.asked = self.engine.now
        answer, track.answer = track.answer, None
        if self._careful(track):
            return self._asked_again(track, self.debugging.step(track.task, answer, track.stepping, self._trace))
        return self._asked_again(track, track.task.resume(answer, budget))

    def _thrown(self, track: Track, error: VrsError) -> Pending:
        """What a task wants now that what it asked for could not be done."""
        track.asked = self.engine.now
        return self._asked_again(track, track.task.throw(error))

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

    # --- one step at a time ---

    def _careful(self, track: Track) -> bool:
        """Whether each step is looked at before it is done."""
        tracing = self.engine.settings.switch("TRACE")
        return not track.at_prompt and (tracing or track.stepping is not None or self.debugging.active)

    def _trace(self, task: Task) -> None:
        if self.engine.settings.switch("TRACE"):
            self.console.type(f"{task.program} {task.step}: {task.source}", newline=True)
