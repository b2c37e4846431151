"""The driver of running programs: performs what they ask, in the time of the robot's clock.

Program and motion run side by side: a motion is begun and the program goes on; the next motion waits until it may
begin. Several programs run side by side too, each a task with a number; a line of the prompt comes before them all.
Each has an instant at which it goes on. The earliest goes on first, of equal ones the lowest number, so that the same
programs give the same timeline. Nothing here is faster or slower than the clock that was passed in.

A task that waits for a condition looks at it every tick, and at once when a signal changes.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from math import inf
from typing import TypeVar, cast

from msgspec import Struct

from vrs_cli.devices.outside import Nothing, Outside
from vrs_cli.engine.engine import Engine
from vrs_cli.errors import ClockPaused, DeviceNotReady, LimitReached, VrsError
from vrs_cli.files.bounds import FREE, Folder
from vrs_cli.files.disk import Disk
from vrs_cli.interfaces.dialogue import Dialogue, Slice, Terminal
from vrs_cli.interfaces.tasks.debugging import Debugging
from vrs_cli.interfaces.tasks.devices import Devices
from vrs_cli.interfaces.tasks.endless import UNTIMED, endless, in_vain
from vrs_cli.interfaces.tasks.limits import ATTENDED, GO_ON, Advice, Limits, Spent, at_prompt
from vrs_cli.interfaces.tasks.performing import Performer, TypedLines
from vrs_cli.interfaces.tasks.readings import SystemReadings
from vrs_cli.interfaces.tasks.tasks import Tasks
from vrs_cli.interfaces.tasks.track import PROMPT_LINE, ROBOT_PROGRAM, Aborted, Pending, PendingInput, Track
from vrs_cli.language.run.cell import NO_CELL, Cell, LivingCell
from vrs_cli.language.run.effects import Budget, Event, Failed
from vrs_cli.language.run.environment import Environment
from vrs_cli.language.run.robot import RobotReadings
from vrs_cli.language.run.runtime import BUDGET, Task
from vrs_cli.language.run.signals import NO_INPUTS, Inputs
from vrs_cli.values.replies import Message, Tone
from vrs_cli.values.results import RunOutcome, RunResult

_P = TypeVar("_P", bound=Pending)


ELEMENTS_A_STEP = 20  # that may be counted again for each step that was done: the cost is small beside that of steps
MOST_A_STEP = 200  # elements that a step can add; a string has 128 characters


class AskedInVain(Exception):
    """Thrown into who asks: a task whose question somebody has before him waits for its answer no longer."""


class _Run(Struct, eq=False):
    """A task that somebody waits for: when it began and is to end [s], the steps that all had done before it, and after
    how many of its own its memory is looked at. `then` is told of its end, where nobody lets time go on for it alone.
    `all_tasks`: the others are waited for too.
    """

    track: Track
    limits: Limits
    started: float
    last: float
    before: int
    then: Callable[[RunResult], None] | None = None
    all_tasks: bool = False
    look: int = 0


class Driver:
    """Runs the `tasks` of one robot. `folder`: where programs have their files. `advice`: what helps where a limit is
    reached.

    `begin` says what is waited for, `step` lets the next thing happen, `peek` tells when that is. `run` waits until a
    task has stopped; `settle` does what is due. `answers`: whether who is served is asked what a task asks. `then`:
    what comes after a task that nobody waits for any more, None where it is to stop at once.
    """

    def __init__(
        self,
        engine: Engine,
        terminal: Terminal,
        environment: Environment,
        robot: RobotReadings,
        folder: Folder = FREE,
        outside: Outside | None = None,
        advice: Advice = at_prompt,
    ) -> None:
        self.engine, self.terminal, self.environment = engine, terminal, environment
        self.inputs: Inputs = NO_INPUTS
        self.cell = NO_CELL
        self._living = LivingCell(NO_CELL)
        self._advice = advice
        self.debugging = Debugging()
        self._transcript = TypedLines(engine, terminal, advice)
        self._written = Spent("max_disk", "write", advice)
        self._disk = Disk(folder, self._written.add, self._check_held)
        self.devices = Devices(self._disk, self._transcript.show, outside or Nothing(), self._missed)
        self.devices.outside.tell = lambda text: terminal.show(Message(text))
        self.tasks = Tasks(engine, environment, self.devices)
        self._performer = Performer(engine, environment, robot, self.tasks, self._transcript, self.devices, advice)
        self._interrupted = False
        self._ended_by: LimitReached | None = None
        self._runs: list[_Run] = []  # the program, and a line of the prompt that is carried out beside it
        self._put: set[int] = set()  # numbers of the questions that somebody has before him
        self.asks = False  # somebody, for a line
        self.answers: Callable[[Track], bool] = lambda track: track.driven_by in (None, self.tasks.who)
        self.then: Callable[[Track], Callable[[RunResult], None] | None] = lambda _track: None
        self.lags: Callable[[], bool] = lambda: False  # whether who hears what programs TYPE is behind
        environment.signals.listeners.append(self._follow)
        environment.system = SystemReadings(engine, environment, self.tasks, self.devices)

    @property
    def waited(self) -> Track | None:
        """The task until whose end somebody lets time go on. Any thread may ask."""
        last = self._runs[-1:]
        return last[0].track if last and last[0].then is None else None

    def change_folder(self, folder: Folder) -> None:
        """Where programs have the files that they open from now on."""
        self._disk.folder = folder

    def close(self) -> None:
        """Close the files of programs, and all else that they have open."""
        self.devices.close_all()

    def _missed(self, fault: DeviceNotReady) -> None:
        """A program goes on without a device; whoever runs it is to know why."""
        self.terminal.show(Message(str(fault), Tone.WARNING))

    def end_by(self, error: LimitReached) -> bool:
        """End the run before its next step with this error; False where none is under way. Safe in a signal handler."""
        if self._runs:
            self._ended_by = error
        return bool(self._runs)

    def interrupt(self) -> None:
        """Stop the run before its next step and the robot as soon as it can. Safe in a signal handler."""
        self._interrupted = True

    @property
    def _ends(self) -> bool:
        """Whether the run is to end, whatever it waits for."""
        return self._interrupted or self._ended_by is not None

    @property
    def held(self) -> bool:
        """Whether programs wait for who hears what they TYPE. Those that are to end do so."""
        return (
            self.lags() and not self._ends and not any(isinstance(one.pending, Aborted) for one in self.tasks.running)
        )

    @property
    def stands(self) -> bool:
        """Whether a program that nobody waits for waits until the clock goes on."""
        clock = self.engine.clock
        return clock.paused and not self._ends and self.waited is None and self.peek() > clock.reached

    # --- somebody waits ---

    def run(self, track: Track, limits: Limits = ATTENDED, *, all_tasks: bool = False) -> Dialogue[RunResult]:
        """Until a task stops, or (`all_tasks`) until every task has. At each RUNNING whoever drives lets one thing
        happen (`step`); the other tasks run beside it, and what they ask is asked.
        """
        run = self.begin(track, limits)
        run.all_tasks = all_tasks
        try:
            while self._foreground(run) is not None:
                if self._performer.asked:
                    yield from self.ask()
                if self._foreground(run) is not None:
                    yield Slice.RUNNING
        except BaseException as error:
            if isinstance(error, GeneratorExit):
                run.then = self.then(track)
            if run.then is None:
                self.drop(track)
                self._over(track)
            raise
        return self._result(self._over(track))

    def _foreground(self, run: _Run) -> Track | None:
        """The task that a run waits for now; None where the run is over."""
        if run.track.running:
            return run.track
        return next((track for track in self.tasks.in_order() if track.running), None) if run.all_tasks else None

    def begin(self, track: Track, limits: Limits = ATTENDED, then: Callable[[RunResult], None] | None = None) -> _Run:
        """From now on a task is waited for, within limits; or `then` is told of its end, whoever lets time go on."""
        now = self.engine.now
        run = _Run(track, limits, now, now + limits.last, self.tasks.steps_done, then)
        self._runs.append(run)
        self._transcript.begin(limits)
        self._written.begin(limits)
        self.tasks.failed, track.awaited = [], True
        self._interrupted = False
        self._bound()
        return run

    def _bound(self) -> None:
        """Motions begin before the run under way is stopped."""
        self._performer.last = self._runs[-1].last if self._runs else inf

    def _over(self, track: Track) -> _Run:
        """A task is waited for no longer."""
        run = next(run for run in self._runs if run.track is track)
        self._runs.remove(run)
        track.awaited = False
        self._transcript.end_line()
        self._bound()
        return run

    def step(self) -> float:
        """Let the next thing happen, or time go on towards it; the robot's clock [s] then."""
        if not self._runs:
            coming = self.peek()
            if coming < inf:
                self.engine.clock.wait(coming)
            self.settle(self.engine.now)
            return self.engine.now
        run = self._runs[-1]
        if self._interrupted:
            self._interrupted = False
            for ended in list(self.tasks.running) if run.all_tasks else [run.track]:
                self.abort(ended.number)
        if self._ended_by is not None:
            error, self._ended_by = self._ended_by, None
            self._exhausted(run, error.detail, error.hint)
        if (track := self._foreground(run)) is not None:
            self._go_on(run, track)
        self._tell_ends()
        return self.engine.now

    def abort(self, number: int) -> Track | None:
        """Stop a task now, however late its own steps are; None where there is none that runs."""
        self._catch_up()
        return self.tasks.abort(number)

    def _catch_up(self) -> None:
        """Who is stopped from outside is stopped now, however late its own steps are."""
        self.engine.clock.advance(self.engine.clock.reached)

    def drop(self, foreground: Track | None = None) -> None:
        """Stop the robot, the task that somebody waited for, and those that an error of vrs itself has broken."""
        self._catch_up()
        self.engine.stop()
        for track in self.tasks.running:
            if track is foreground or track.task.broken:
                track.task.abort()
                self.tasks.stop(track, RunOutcome.ABORTED)

    def broken_off(self, error: LimitReached) -> RunResult:
        """The result of a run that `error` broke off in the middle of a step."""
        track = self.tasks.get(ROBOT_PROGRAM)
        assert track is not None
        self.drop(track)
        track.fault, track.outcome = track.task.fail(error).fault, RunOutcome.FAILED
        self._transcript.end_line()
        return self._result(_Run(track, ATTENDED, 0.0, inf, 0))

    def _result(self, run: _Run) -> RunResult:
        track = run.track
        assert track.outcome is not None
        return RunResult(
            track.task.program,
            track.task.cycles_done,
            run.started,
            self.engine.now,
            tuple(self._transcript.lines),
            track.fault,
            track.outcome,
            tuple(self.tasks.failed),
            track.detail,
        )

    # --- questions ---

    def questions(self) -> Iterator[tuple[Track, PendingInput]]:
        """The tasks that wait for a line of the terminal, and what they ask, in the order of asking."""
        waiting = [(track, track.pending) for track in self.tasks.running if isinstance(track.pending, PendingInput)]
        return iter(sorted(waiting, key=lambda one: one[1].number))

    def answer(self, number: int, answer: str | VrsError | None) -> None:
        """A line for the task that asked this question, None where nobody gives one, or why there is none. A task that
        waits no longer gets nothing.
        """
        found = next((one for one in self.questions() if one[1].number == number), None)
        if found is None:
            return
        self.tasks.current = found[0].number
        try:
            self._performer.answer(*found, answer)
        except VrsError as error:
            self._performer.do(found[0], self._thrown(found[0], error))
        self.tasks.current = PROMPT_LINE

    def ask(self) -> Dialogue[None]:
        """Put the questions of their tasks to those who drive them; Ctrl-C stops the task that asks."""
        self._performer.asked = False
        while waiting := self.unasked():
            track, asked = waiting[0]
            self._put.add(asked.number)
            self.asks = True
            try:
                answer = yield asked.question
                self.answer(asked.number, answer if isinstance(answer, str) else None)
            except AskedInVain:
                pass  # one that still waits is put again
            except VrsError as error:
                self.answer(asked.number, error)
            except KeyboardInterrupt:
                self.abort(track.number)
            finally:
                self._put.discard(asked.number)
                self.asks = bool(self._put)

    def unasked(self) -> list[tuple[Track, PendingInput]]:
        """Questions for whoever is served that nobody has before him."""
        return [one for one in self.questions() if one[1].number not in self._put and self.answers(one[0])]

    @property
    def withdrawn(self) -> bool:
        """Whether somebody has a question before him whose task waits for its answer no longer."""
        return not self._put <= {asked.number for _, asked in self.questions()}

    # --- limits ---

    def _go_on(self, run: _Run, track: Track) -> None:
        """The next thing that happens: an input changes, or a task goes on; or a limit is reached."""
        now, coming = self.engine.now, self.peek()
        if isinstance(track.pending, UNTIMED) and self._in_vain():
            more = self._advice("signals")
            error = endless(track, "" if more == GO_ON else more, self.environment.signals.said)
            if track is run.track:
                self._fail(track, error)
            else:  # the program is over, and nothing will ever happen in this task
                place = f"task {track.number} is ended at {track.task.program} step {track.task.step}"
                self.terminal.show(Message(f"{place}: {error}", Tone.WARNING))
                self.tasks.abort(track.number)
        elif coming > run.last and not isinstance(track.pending, Failed | Aborted):
            self.engine.clock.advance(max(run.last, now))
            what = f"the program was still running after {run.limits.max_time:g} s of the robot's time"
            late = (one.text for one in self.engine.records() if one.asked is not None and one.asked > run.last)
            if text := next(late, None):  # the first motion that was asked for a later time is to blame
                what += f", and {text} was asked for later than that"
            self._exhausted(run, what, self._advice("max_time"))
        elif self._waited(track, coming):
            self._happen(self._budget(run))
            self._look()

    def _in_vain(self) -> bool:
        """Whether time could go on for ever, and nothing would happen."""
        engine = self.engine
        if engine.realtime or self.inputs.next_time < inf or engine.now < engine.end:
            return False
        return in_vain(self.tasks.running, engine.now)

    def _budget(self, run: _Run) -> int:
        """How many steps may be done at once; of those that may be done at all one more begins, and is not done."""
        most = run.limits.max_steps
        return BUDGET if most is None else most - (self.tasks.steps_done - run.before) + 1

    def _look(self) -> None:
        """Whether a limit of steps or of memory is reached."""
        for run in self._runs:
            track = self._foreground(run)
            if track is None or isinstance(track.pending, Failed | Aborted):
                continue
            limits, done = run.limits, self.tasks.steps_done - run.before
            if limits.max_steps is not None and done > limits.max_steps:
                what = f"the program was still running after {limits.max_steps} steps"
                self._exhausted(run, what, self._advice("max_steps"))
            elif limits.max_elements is not None and done >= run.look:
                held = self.environment.held() + sum(track.task.held() for track in self.tasks)
                run.look = done + max(held // ELEMENTS_A_STEP, (limits.max_elements - held) // MOST_A_STEP)
                if held > limits.max_elements:
                    what = f"arrays and strings hold {held} elements, {limits.max_elements} at most"
                    self._exhausted(run, what, self._advice("max_elements"))

    def _waited(self, foreground: Track, coming: float) -> bool:
        """Let time go on; whether it has come so far. On a clock that stands, the foreground waits in vain."""
        try:
            self.engine.clock.wait(coming)
        except ClockPaused as error:
            self._fail(foreground, error)
        return self.engine.now >= coming

    def _check_held(self, characters: int) -> None:
        """Raises LimitReached where the files that are open to be read would hold so many characters."""
        most = None if not self._runs else self._runs[-1].limits.max_elements
        if most is not None and characters > most:
            what = f"the files that are read hold {characters} characters, {most} at most"
            raise LimitReached(what, self._advice("max_elements"))

    def _exhausted(self, run: _Run, what: str, hint: str) -> None:
        """A limit ends the task that is waited for, and all others that are waited for with it."""
        foreground = self._foreground(run)
        if foreground is None:
            return
        error = LimitReached(f"{what}: {'; '.join(self._whereabouts(foreground))}", hint)
        self.engine.stop()
        self._fail(foreground, error)
        for track in list(self.tasks.running) if run.all_tasks else ():
            if track is not foreground:
                self.tasks.abort(track.number)

    def _fail(self, track: Track, error: VrsError) -> None:
        """What a task waits for does not come."""
        track.pending = None
        self._performer.do(track, self._thrown(track, error))

    def _whereabouts(self, foreground: Track) -> Iterator[str]:
        """Where each task hangs, the one that was waited for first."""
        others = [track for track in self.tasks.in_order() if track.running and track is not foreground]
        for track in [foreground, *others]:
            task = track.task
            waits = "waits" if track.pending is not None else "is busy"
            number = f"task {track.number}, " if track.number > ROBOT_PROGRAM else ""
            place = f"{number}{task.program or 'the line'} step {task.step}"
            yield f"{place} {waits} at {task.source}" if task.source else f"{place} {waits}"

    # --- nobody waits ---

    def settle(self, until: float | None = None) -> None:
        """Let the tasks do all that is due by an instant, that which time has reached unless told otherwise."""
        clock = self.engine.clock
        until = clock.reached if until is None else until
        while (coming := min(self.peek(), self.inputs.next_time)) <= until and not self.held:
            clock.advance(coming)
            self._happen(BUDGET)
            self._look()
        clock.advance(until)
        self._tell_ends()

    def _tell_ends(self) -> None:
        """The end of what nobody lets time go on for alone."""
        for run in tuple(self._runs):
            if run.then is not None and not run.track.running:
                run.then(self._result(self._over(run.track)))

    # --- what happens next ---

    def peek(self) -> float:
        """When something happens next [s]; infinity where nothing does by itself."""
        track = self.tasks.next()
        if track is None:
            return inf
        return min(track.wake, self.inputs.next_time, self.devices.outside.due(self.engine.clock))

    def _happen(self, budget: int) -> None:
        """What is due now: something arrives, an input changes, or a task goes on."""
        clock = self.engine.clock
        if self.devices.outside.due(clock) <= clock.now:
            self.devices.arrive(clock.now)
            self.tasks.look_at_units()
            return
        if self.inputs.next_time <= self.engine.now:
            self._change_inputs()
            return
        track = self.tasks.next()
        assert track is not None
        self._turn(track, budget)

    def _change_inputs(self) -> None:
        """What the world outside does now, and what follows of it in its turn."""
        due, self.inputs = self.inputs.taken(self.engine.now)
        for change in due:
            for name, value in change.values.items():
                self.environment.reference(name, None).assign(value)
            if change.signal:
                self.environment.signals.write(change.signal if change.on else -change.signal, inputs=True)

    def surround(self, cell: Cell) -> None:
        """Put the robot in a cell: its signals have names, and what follows of them comes by itself."""
        self.cell, self._living = cell, LivingCell(cell)
        self.environment.signals.names = cell.names

    def _follow(self, signal: int, on: bool) -> None:
        """Apply the cell's rules to a signal that has changed."""
        if self.cell.follows:
            self.inputs = self.inputs.with_more(self._living.answers(signal, on, self.engine.now))

    @contextmanager
    def surrounded(self, cell: Cell | None, inputs: Inputs) -> Iterator[None]:
        """Meanwhile another cell is around the robot (None: the same), and inputs change, at times [s] from now. What
        these have not done by the end does not happen.
        """
        before = (self.cell, self._living, self.environment.signals.names)
        own, given = self.inputs.left, inputs.later(self.engine.now).left
        if cell is not None:
            self.surround(cell)
        self.inputs = self.inputs.with_more(given)
        try:
            yield
        finally:
            self.cell, self._living, self.environment.signals.names = before
            kept, dropped = {id(change) for change in own}, {id(change) for change in given}
            left = (change for change in self.inputs.left if id(change) not in dropped)
            self.inputs = Inputs.of(change for change in left if cell is None or id(change) in kept)

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
        looked_at = self.engine.settings.switch("TRACE") or track.stepping is not None or self.debugging.active
        if looked_at and not track.at_prompt:  # each step, before it is done
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

    def _trace(self, task: Task) -> None:
        if self.engine.settings.switch("TRACE"):
            self.terminal.type(f"{task.program} {task.step}: {task.source}", newline=True)
