"""The driver runs programs: it carries out their requests at the times of the robot's clock. A program runs while its
motions are executed: after a motion begins, the program continues until its next motion, which waits until it may
begin. Several programs run at the same time, each as a task with a number; a line typed at the prompt is a task too,
and comes first. For each task the driver knows the time at which it continues, and always continues the task with the
earliest time; if several have the same time, the one with the lowest number. So the same programs always give the same
timeline. The given clock sets the pace. A task that waits for a condition tests it at every tick and whenever a signal
changes."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from math import inf
from typing import TYPE_CHECKING, TypeVar, cast

from msgspec import Struct, structs

from vrs_cli.devices.outside import Outside
from vrs_cli.engine.engine import Engine
from vrs_cli.errors import ClockPaused, LimitReached, VrsError
from vrs_cli.files import opening
from vrs_cli.interfaces.dialogue import Dialogue, Slice, Terminal
from vrs_cli.interfaces.tasks import devices, observations, performing, tasks
from vrs_cli.interfaces.tasks.limits import ATTENDED, GO_ON, Advice, Limits, Spent, at_prompt
from vrs_cli.language.run import effects, runtime
from vrs_cli.language.run.environment import Environment
from vrs_cli.language.run.signals import NO_CELL, NO_INPUTS, Cell, ComputedSignals, Inputs, LivingCell
from vrs_cli.language.words.values import INTERNAL, key_of
from vrs_cli.values import commands, results
from vrs_cli.values.scene import NO_SCENE

if TYPE_CHECKING:
    from vrs_cli.world.course import World, WorldCourse

_P = TypeVar("_P", bound=tasks.Pending)


# count the used memory only every (elements in memory / this number) steps, so that counting takes little time
ELEMENTS_A_STEP = 20
AN_EVENT = 10  # one event of the timeline uses as much memory as this many array elements
MAX_ELEMENTS_A_STEP = 200  # no step adds more elements to memory than this; a string has up to 128 characters


def world_of(engine: Engine, cell: Cell) -> tuple[World | None, ComputedSignals | None]:
    """Return the world of a cell (its parts and sensors), and the signals that the world computes; (None, None) for a
    cell that only names signals."""
    if not cell.follows and cell.scene == NO_SCENE:
        return None, None
    from vrs_cli.world.course import World

    world = World(engine.arm, cell)
    settings = world.settings
    if not settings.computed:
        return world, None

    return world, ComputedSignals(
        settings.computed,
        frozenset(settings.sensed),
        state=lambda timeline, signal, t: bool(world.course(timeline).signal(signal, t)),
        next_change=lambda timeline, t, until: (world.course(timeline).next_change(t, until) or (inf,))[0],
        changes=lambda timeline, t: world.course(timeline).changes_at(t),
    )


class AskedInVain(Exception):
    """Raised in the dialogue that shows a task's question to a user, when the task no longer needs the answer."""


class _Run(Struct, eq=False):
    """A task that a user started and waits for, with its limits. `started`: when the run began [s]; `last`: when it
    must end [s]; `before`: the number of steps that all tasks had done when it began. `then`: the function to call with
    the result if no request waits for it any more. `all_tasks`: the run lasts until all other tasks have also ended.
    `look`: the number of steps of the run after which memory is counted next."""

    track: tasks.Track
    limits: Limits
    started: float
    last: float
    before: int
    then: Callable[[results.RunResult], None] | None = None
    all_tasks: bool = False
    look: int = 0


class Driver:
    """The driver of the `tasks` of one robot.

    - `begin` starts the wait for a task, `step` carries out the next event, and `peek` returns its time. `run` waits
      until a task has stopped. `settle` carries out all events up to a time.
    - `advice`: returns the hint shown at a limit.
    - `answers` returns whether the current user is asked a task's questions.
    - `then` returns the function to call at the end of a task whose user no longer waits; None if the task must stop
      now.
    - `lags` returns whether users have not yet read all output of the programs (TYPE).
    - `asking`: the numbers of the questions that are being shown to users."""

    def __init__(
        self,
        engine: Engine,
        terminal: Terminal,
        environment: Environment,
        folder: opening.Folder = opening.FREE,
        outside: Outside | None = None,
        advice: Advice = at_prompt,
    ) -> None:
        self.engine, self.terminal, self.environment = engine, terminal, environment
        self.inputs: Inputs = NO_INPUTS
        self.cell = NO_CELL
        self._living = LivingCell(NO_CELL)
        self.world: World | None = None  # world (parts and sensors) of the cell that the robot was in last
        self._advice = advice
        self._transcript = performing.TypedLines(engine, terminal, advice)
        self._written = Spent("max_disk", "write", advice)
        self.devices = devices.Devices(
            folder,
            self._transcript.show,
            outside or Outside(),
            # only a warning, because the program continues without the device
            lambda missing: terminal.show(results.Message(str(missing), results.Tone.WARNING)),
            self._written.add,
            self._check_held,
        )
        self.devices.outside.tell = lambda text: terminal.show(results.Message(text))
        self.tasks = tasks.Tasks(engine, environment, self.devices)
        self._performer = performing.Performer(engine, environment, self.tasks, self._transcript, self.devices, advice)
        self._interrupted = False
        self._ended_by: LimitReached | None = None
        self._runs: list[_Run] = []  # the running program, then the run of a line typed at the prompt meanwhile, if any
        self.asking: set[int] = set()
        self.answers: Callable[[tasks.Track], bool] = lambda track: track.driven_by in (None, self.tasks.who)
        self.then: Callable[[tasks.Track], Callable[[results.RunResult], None] | None] = lambda _track: None
        self.lags: Callable[[], bool] = lambda: False
        environment.signals.engine = engine
        environment.signals.listeners.append(self._follow)
        self.observations = observations.Observations(engine, self.tasks, environment.signals)
        environment.system = self.tasks

    @property
    def awaited(self) -> tasks.Track | None:
        """The task whose end a request is waiting for; only then does the driver advance the clock by itself. Any
        thread may read this."""
        last = self._runs[-1:]
        return last[0].track if last and last[0].then is None else None

    def end_by(self, error: LimitReached) -> bool:
        """End the current run with this error before its next step. Return False if there is no run. Signal handlers
        may call this method."""
        if self._runs:
            self._ended_by = error
        return bool(self._runs)

    def interrupt(self) -> None:
        """Stop the current run before its next step, and the robot as soon as possible. Signal handlers may call this
        method."""
        self._interrupted = True

    @property
    def _ends(self) -> bool:
        """Return whether the current run must end even if its task is still waiting."""
        return self._interrupted or self._ended_by is not None

    @property
    def waits_for_users(self) -> bool:
        """Return whether programs must wait until users have received their output (TYPE). Programs that are ending do
        not wait."""
        return (
            self.lags()
            and not self._ends
            and not any(isinstance(one.pending, tasks.Aborted) for one in self.tasks.running)
        )

    @property
    def blocked_by_clock(self) -> bool:
        """Return whether programs cannot continue because the clock is paused, while no request is waiting for them."""
        clock = self.engine.clock
        return clock.paused and not self._ends and self.awaited is None and self.peek() > clock.reached

    # --- runs for which a user waits ---

    def run(
        self, track: tasks.Track, limits: Limits = ATTENDED, *, all_tasks: bool = False
    ) -> Dialogue[results.RunResult]:
        """Run until a task stops or, with `all_tasks`, until all tasks have stopped. Return the result. For each
        RUNNING that this dialogue yields, the actor carries out one event (`step`). Meanwhile the other tasks continue,
        and users are asked their questions."""
        run = self.begin(track, limits)
        run.all_tasks = all_tasks
        try:
            while self._foreground(run) is not None:
                if self._performer.asked:
                    yield from self.ask()
                else:
                    yield Slice.RUNNING
        except BaseException as error:
            if isinstance(error, GeneratorExit):
                run.then = self.then(track)
            if run.then is None:
                self.drop(track)
                self._over(track)
            raise
        return self._result(self._over(track))

    def _foreground(self, run: _Run) -> tasks.Track | None:
        """Return the task that a run is waiting for; None if the run has ended."""
        if run.track.outcome is None:  # fast path: this is called several times for each step
            return run.track
        return next((track for track in self.tasks.in_order() if track.running), None) if run.all_tasks else None

    def begin(
        self, track: tasks.Track, limits: Limits = ATTENDED, then: Callable[[results.RunResult], None] | None = None
    ) -> _Run:
        """Start to wait for a task, within limits. `then`: the function to call at the end of the task if no request
        waits for it."""
        now = self.engine.now
        run = _Run(track, limits, now, now + limits.last, self.tasks.steps_done, then)
        self._runs.append(run)
        self._transcript.begin(limits)
        self._written.begin(limits)
        self.tasks.failed, track.awaited = [], True
        self._interrupted = False
        self._performer.last = run.last
        return run

    def _over(self, track: tasks.Track) -> _Run:
        run = next(run for run in self._runs if run.track is track)
        self._runs.remove(run)
        track.awaited = False
        self._transcript.end_line()
        self._performer.last = self._runs[-1].last if self._runs else inf
        return run

    def step(self) -> None:
        """Carry out the next event, or advance the clock towards it. A run that reaches a limit is ended."""
        if not self._runs:
            if (coming := self.peek()) < inf:
                self.engine.clock.wait(coming)
            self.settle(self.engine.now)
            return
        run = self._runs[-1]
        if self._interrupted:
            self._interrupted = False
            for ended in list(self.tasks.running) if run.all_tasks else [run.track]:
                self.abort(ended.number)
        if self._ended_by is not None:
            error, self._ended_by = self._ended_by, None
            self._end_at_limit(run, error.detail, error.hint)
        track, coming = self._foreground(run), self.peek()
        if track is None:
            pass
        elif isinstance(track.pending, observations.UNTIMED) and self._in_vain():
            self._end_vain_wait(run, track)
        elif coming > run.last and not isinstance(track.pending, effects.Failed | tasks.Aborted):
            self._exceed_time(run)
        elif self._let_time_pass(track, coming):
            most = run.limits.max_steps
            # + 1: the limit is noticed when one more step would begin; that step is not carried out
            self._happen(runtime.BUDGET if most is None else most - (self.tasks.steps_done - run.before) + 1)
            self._look()
        self._tell_ends()

    def abort(self, number: int) -> tasks.Track | None:
        """Stop a task at the current time, even if its next step is far in the future. Return the task; None if no task
        with this number is running."""
        self.engine.clock.advance(self.engine.clock.reached)
        return self.tasks.abort(number)

    def drop(self, foreground: tasks.Track | None = None) -> None:
        """Stop the robot, the task `foreground` for which a user waited, and all tasks stopped by an internal error of
        vrs."""
        self.engine.clock.advance(self.engine.clock.reached)
        self.engine.stop()
        for track in self.tasks.running:
            if track is foreground or track.task.was_broken_off:
                track.task.abort()
                self.tasks.stop(track, results.RunOutcome.ABORTED)

    def broken_off(self, error: LimitReached) -> results.RunResult:
        """Return the result of a run that `error` has ended in the middle of a step of the robot program."""
        track = self.tasks.get(tasks.ROBOT_PROGRAM)
        assert track is not None
        self.drop(track)
        track.fault, track.outcome = track.task.fail(error).fault, results.RunOutcome.FAILED
        self._transcript.end_line()
        return self._result(_Run(track, ATTENDED, 0.0, inf, 0))

    def _result(self, run: _Run) -> results.RunResult:
        track = run.track
        assert track.outcome is not None
        return results.RunResult(
            track.task.program,
            track.task.cycles_done,
            run.started,
            self.engine.now,
            tuple(line.text for line in self._transcript.lines),
            track.fault,
            track.outcome,
            tuple(self.tasks.failed),
            track.detail,
        )

    @property
    def typed_lines(self) -> tuple[performing.TypedLine, ...]:
        """The lines that programs have typed since the last run began."""
        return tuple(self._transcript.lines)

    # --- questions ---

    def questions(self) -> list[tuple[tasks.Track, tasks.PendingInput]]:
        """Return the tasks that wait for a line of the terminal, each with its question, in the order in which they
        asked."""
        waiting = [(track, track.pending) for track in self.tasks if isinstance(track.pending, tasks.PendingInput)]
        return sorted(waiting, key=lambda one: one[1].number)

    def answer(self, number: int, answer: str | VrsError | None) -> None:
        """Give the answer to question `number` to the task that asked it: a line, None at the end of the input, or an
        error. Do nothing if the task no longer waits for it."""
        if (found := next((one for one in self.questions() if one[1].number == number), None)) is None:
            return
        self.tasks.current = found[0].number
        try:
            self._performer.answer(*found, answer)
        except VrsError as error:
            self._do(found[0], self._throw(found[0], error))
        self.tasks.current = tasks.PROMPT_LINE

    def ask(self) -> Dialogue[None]:
        """Ask the current user the questions of the tasks. Ctrl-C stops the task that asks."""
        self._performer.asked = False
        while waiting := self.open_questions():
            track, asked = waiting[0]
            self.asking.add(asked.number)
            try:
                answer = yield asked.question
                self.answer(asked.number, answer if isinstance(answer, str) else None)
            except AskedInVain:
                pass  # the loop asks the question again if the task still waits for the answer
            except VrsError as error:
                self.answer(asked.number, error)
            except KeyboardInterrupt:
                self.abort(track.number)
            finally:
                self.asking.discard(asked.number)

    def open_questions(self) -> list[tuple[tasks.Track, tasks.PendingInput]]:
        """Return the questions for the current user that are not shown to any user yet."""
        return [one for one in self.questions() if one[1].number not in self.asking and self.answers(one[0])]

    @property
    def has_withdrawn(self) -> bool:
        """Return whether a user still sees a question although the task that asked it no longer waits for the
        answer."""
        return not self.asking <= {asked.number for _, asked in self.questions()}

    # --- limits ---

    def _end_vain_wait(self, run: _Run, track: tasks.Track) -> None:
        """End the wait of a task for an event that can never occur: raise an error in the task."""
        more = self._advice("signals")
        error = observations.endless(track, "" if more == GO_ON else more, self.environment.signals.with_names)
        if track is run.track:
            self._fail(track, error)
        else:  # the program of the run has ended; only this task is left, and would wait forever
            place = f"task {track.number} is ended at {track.task.program} step {track.task.step}"
            self.terminal.show(results.Message(f"{place}: {error}", results.Tone.WARNING))
            self.tasks.abort(track.number)

    def _exceed_time(self, run: _Run) -> None:
        """End a run that has reached its limit on the robot's time."""
        self.engine.clock.advance(max(run.last, self.engine.now))
        what = f"the program was still running after {run.limits.max_time:g} s of the robot's time"
        late = (one.text for one in self.engine.book.records() if one.asked is not None and one.asked > run.last)
        if text := next(late, None):  # name the first motion that was requested for a time after the limit as the cause
            what += f", and {text} was asked for later than that"
        self._end_at_limit(run, what, self._advice("max_time"))

    def _in_vain(self) -> bool:
        """Return whether all tasks are waiting, and the clock could advance forever without an event that ends a
        wait."""
        engine = self.engine
        more_comes = engine.realtime or self._next_signal() < inf or engine.now < engine.end
        return not more_comes and observations.in_vain(self.tasks.running, engine.now)

    def _look(self) -> None:
        """Check each run's limits on steps and memory, and end a run that exceeds one of them."""
        for run in self._runs:
            if (track := self._foreground(run)) is None or isinstance(track.pending, effects.Failed | tasks.Aborted):
                continue
            limits, done = run.limits, self.tasks.steps_done - run.before
            if limits.max_steps is not None and done > limits.max_steps:
                self._end_at_limit(
                    run, f"the program was still running after {limits.max_steps} steps", self._advice("max_steps")
                )
            elif limits.max_elements is not None and done >= run.look:
                events = AN_EVENT * self.engine.timeline.event_count
                held = self.environment.size_of_all() + sum(track.task.own_size() for track in self.tasks) + events
                run.look = done + max(held // ELEMENTS_A_STEP, (limits.max_elements - held) // MAX_ELEMENTS_A_STEP)
                if held > limits.max_elements:
                    and_events = ", with signals that were set," if events else ""
                    what = f"arrays and strings{and_events} hold {held} elements, {limits.max_elements} at most"
                    self._end_at_limit(run, what, self._advice("max_elements"))

    def _let_time_pass(self, foreground: tasks.Track, coming: float) -> bool:
        """Advance the clock towards the time `coming` [s]. Return whether that time was reached. If the clock is
        paused, the task `foreground` fails."""
        try:
            self.engine.clock.wait(coming)
        except ClockPaused as error:
            self._fail(foreground, error)
        return self.engine.now >= coming

    def _check_held(self, characters: int) -> None:
        """Check how many characters of the files open for reading are held in memory. Raises LimitReached."""
        most = None if not self._runs else self._runs[-1].limits.max_elements
        if most is not None and characters > most:
            raise LimitReached(
                f"the files that are read hold {characters} characters, {most} at most", self._advice("max_elements")
            )

    def _end_at_limit(self, run: _Run, what: str, hint: str) -> None:
        """Stop the robot and end the task of a run with LimitReached; end its other tasks too if the run includes all
        tasks. `what`: which limit was reached."""
        if (foreground := self._foreground(run)) is None:
            return
        error = LimitReached(f"{what}: {'; '.join(self._whereabouts(foreground))}", hint)
        self.engine.stop()
        self._fail(foreground, error)
        for track in list(self.tasks.running) if run.all_tasks else ():
            if track is not foreground:
                self.tasks.abort(track.number)

    def _fail(self, track: tasks.Track, error: VrsError) -> None:
        """Raise an error in a task, which stops waiting."""
        track.pending = None
        self._do(track, self._throw(track, error))

    def _whereabouts(self, foreground: tasks.Track) -> Iterator[str]:
        """For each running task, yield a string that says at which step the task waits or works. The task `foreground`
        comes first."""
        others = [track for track in self.tasks.in_order() if track.running and track is not foreground]
        for track in [foreground, *others]:
            task = track.task
            waits = "waits" if track.pending is not None else "is busy"
            number = f"task {track.number}, " if track.number > tasks.ROBOT_PROGRAM else ""
            place = f"{number}{task.program or 'the line'} step {task.step}"
            yield f"{place} {waits} at {task.source}" if task.source else f"{place} {waits}"

    # --- events for which no user waits ---

    def settle(self, until: float | None = None) -> None:
        """Carry out all events up to the time `until` [s], by default the current time, and advance the clock to it."""
        clock = self.engine.clock
        until = clock.reached if until is None else until
        while (coming := min(self.peek(), self._next_signal())) <= until and not self.waits_for_users:
            clock.advance(coming)
            self._happen(runtime.BUDGET)
            self._look()
        clock.advance(until)
        self._tell_ends()

    def _tell_ends(self) -> None:
        """Call `then` of each run that has ended and for which no request waits."""
        for run in tuple(self._runs):
            if run.then is not None and not run.track.running:
                run.then(self._result(self._over(run.track)))

    # --- the next event ---

    def peek(self) -> float:
        """Return the time of the next event [s]; infinity if only a new request can cause one."""
        if (track := self.tasks.next()) is None:
            return inf
        return min(track.wake, self._next_signal(), self.devices.outside.due(self.engine.clock))

    def _next_signal(self) -> float:
        """Return the time of the next change of an input, or of the next event on the timeline [s]."""
        dated = self.environment.signals.follow_clock()
        return dated if self.inputs is NO_INPUTS else min(self.inputs.next_time, dated)

    def _happen(self, budget: int) -> None:
        """Carry out one kind of event due now: the arrival of data, changes of inputs, or the next task. That task runs
        until it makes a request that takes time, or has done `budget` steps."""
        clock, signals = self.engine.clock, self.environment.signals
        signals.follow_clock()
        if self.devices.outside.due(clock) <= clock.now:
            self.devices.arrive(clock.now)
            self.tasks.look_at_units()
            return
        if self.inputs.next_time <= self.engine.now:
            self._change_inputs()
            return
        if (track := self.tasks.next()) is None or track.wake > self.engine.now:
            return  # only a signal has changed, and no task waits for it
        self.tasks.current, signals.place = track.number, None
        self._do(track, self._event(track, budget))
        self.tasks.current = tasks.PROMPT_LINE
        # note the signal changes that the task itself has just made, so that they are not reported later
        signals.follow_clock()
        # if more reactions are due, let the task continue at the same time: each turn carries out one reaction
        if track.reacts and self._left_now(track) > 0:
            track.wake = self.engine.now

    def _do(self, track: tasks.Track, event: tasks.Pending) -> None:
        """Carry out a request of a task. If that fails, raise the error in the task, and carry out the next request of
        the task."""
        while True:
            track.wake = self.engine.now
            try:
                performing.ACTS.get(type(event), performing.Performer.request)(self._performer, track, event)
                return
            except VrsError as error:
                event = self._throw(track, error)

    def _change_inputs(self) -> None:
        """Carry out the changes of inputs that are due now. Each change also triggers the cell's rules."""
        due, self.inputs = self.inputs.take_until(self.engine.now)
        for change in due:
            for name, value in change.values.items():
                self.environment.reference(name, None).assign(value)
            if change.signal:
                signal = change.signal if change.on else -change.signal
                self.environment.signals.write(signal, inputs=True, stamp=commands.Stamp(self.engine.now))

    @property
    def course(self) -> WorldCourse | None:
        """The states of the cell's parts over time on the current timeline; None if there is no cell."""
        return None if self.world is None else self.world.course(self.engine.timeline)

    def surround(self, cell: Cell) -> None:
        """Put the robot in a cell. The cell names signals, and from now on its rules react to signal changes."""
        self.cell, self._living = cell, LivingCell(cell)
        self.environment.signals.names = cell.names
        self.world, self.environment.signals.cell_inputs = world_of(self.engine, cell)

    def add_inputs(self, inputs: Inputs) -> None:
        """Let inputs also change at known times. Raises IllegalSignal if a sensor of the cell sets one of them."""
        self.environment.signals.check_not_sensed(change.signal for change in inputs.left)
        self.inputs = self.inputs.with_more(inputs.left)

    def _follow(self, signal: int, on: bool) -> None:
        """Apply the cell's rules to a signal that has changed. Inputs that the world computes are not changed by
        rules."""
        if self.cell.follows:
            computed = self.environment.signals.cell_inputs
            known = frozenset[int]() if computed is None or signal in INTERNAL else computed.numbers
            left = (
                structs.replace(one, signal=0) if one.signal in known else one
                for one in self._living.answers(signal, on, self.engine.now)
            )
            self.inputs = self.inputs.with_more(one for one in left if one.signal or one.values)

    @contextmanager
    def use_cell(self, cell: Cell | None, inputs: Inputs) -> Iterator[None]:
        """Put the robot in another cell (None: the same cell) within this context, and let `inputs` change at times [s]
        counted from now. Changes that are not due before the end of the context are dropped."""
        signals = self.environment.signals
        before, world = (self.cell, self._living, signals.names, signals.cell_inputs), self.world
        own, given = self.inputs.left, inputs.later(self.engine.now)
        if cell is not None:
            self.surround(cell)
        try:
            self.add_inputs(given)
            yield
        finally:
            stay = signals.computed_states() if cell is not None else ()
            self.cell, self._living, signals.names, signals.cell_inputs = before
            # keep the world of the cell, so that its parts can be examined after the context has ended
            self.world = world or self.world
            # the inputs that the cell's world computed keep their states
            signals.write(*stay, inputs=True, stamp=commands.Stamp(self.engine.now))
            kept, dropped = {id(change) for change in own}, {id(change) for change in given.left}
            left = (change for change in self.inputs.left if id(change) not in dropped)
            self.inputs = Inputs.of(change for change in left if cell is None or id(change) in kept)

    def _event(self, track: tasks.Track, budget: int) -> tasks.Pending:
        """Return what a task requests now: the event for which it has waited, or the next request of its program."""
        reacts, pending, track.pending = track.reacts, track.pending, None
        if pending is not None:
            if not reacts:
                return pending
            track.held.append((pending, track.asked))
            track.asked = self.engine.now
            return self._asked_again(track, track.task.react(cast(effects.Event, pending)))
        budget = min(budget, self._left_now(track))
        if budget <= 0:
            return effects.Budget()
        track.asked = self.engine.now
        answer, track.answer = track.answer, None
        looked_at = track.stepping is not None or self.tasks.breakpoints or self.tasks.watches
        # for TRACE, breakpoints, watches and single steps, carry out one step at a time
        if (looked_at or self.engine.settings.switch("TRACE")) and not track.at_prompt:
            return self._asked_again(track, self._step_by_step(track, answer))
        return self._asked_again(track, track.task.resume(answer, budget))

    def _throw(self, track: tasks.Track, error: VrsError) -> tasks.Pending:
        """Raise an error in the program of a task. Return what the task requests next."""
        track.asked = self.engine.now
        return self._asked_again(track, track.task.throw(error))

    @staticmethod
    def _asked_again(track: tasks.Track, event: _P) -> _P:
        """Return the event for which a task waits. If a reaction interrupted the wait, set `track.asked` to the time at
        which the task first requested the event."""
        for held in track.held:
            if held[0] is event:
                track.asked = held[1]
                track.held.remove(held)
                break
        return event

    def _left_now(self, track: tasks.Track) -> int:
        """Return how many more steps a task may do at the current time. Afterwards the clock must advance, so that an
        endless loop cannot stop time."""
        if track.instant != self.engine.now:
            track.instant, track.before = self.engine.now, track.task.steps_done
        return runtime.BUDGET - (track.task.steps_done - track.before)

    def _step_by_step(self, track: tasks.Track, answer: str | None) -> effects.Event | tasks.Stopped | tasks.Onward:
        """Carry out the next step of a task. Return what the step requests, or whether the program stops before the
        following step (single step, breakpoint or watched value).
        """
        task, stepping = track.task, track.stepping
        if task.between:
            if self.engine.settings.switch("TRACE"):
                self.terminal.type(f"{task.program} {task.step}: {task.source}", newline=True)
            if stepping is not None and not stepping.begun:
                stepping.begun, stepping.depth = True, len(task.stack)
        event = task.resume(answer, 1)
        if not isinstance(event, effects.Budget):
            return event
        changes = [change for watch in self.tasks.watches if (change := watch.change())]
        if changes:
            return tasks.Stopped("WATCHED", "; ".join(changes))
        if stepping is not None:
            done = stepping.begun and not (stepping.over and len(task.stack) > stepping.depth)
            return tasks.Stopped("STEPPED") if done else tasks.ONWARD
        return (
            tasks.Stopped("BREAKPOINT") if (key_of(task.program), task.step) in self.tasks.breakpoints else tasks.ONWARD
        )
