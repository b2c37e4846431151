"""The driver runs programs: it carries out their requests at the times of the robot's clock. A program and its motions
run side by side: after a motion begins, the program continues, and the next motion waits until it may begin. Several
programs also run side by side, each as a task with a number; a prompt line precedes all programs. Each task has an
instant at which it continues. The task with the earliest instant continues first; if instants are equal, the task with
the lowest number. So the same programs always give the same timeline. The given clock sets the pace. A task that waits
for a condition tests it at every tick and whenever a signal changes."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from math import inf
from typing import TYPE_CHECKING, TypeVar, cast

from msgspec import Struct, structs

from vrs_cli.devices.device import Outside
from vrs_cli.engine.engine import Engine
from vrs_cli.errors import ClockPaused, LimitReached, VrsError
from vrs_cli.files import disk, opening
from vrs_cli.interfaces.dialogue import Dialogue, Slice, Terminal
from vrs_cli.interfaces.tasks import devices, observations, performing, tasks
from vrs_cli.interfaces.tasks.limits import ATTENDED, GO_ON, Advice, Limits, Spent, at_prompt
from vrs_cli.language.run import effects, runtime
from vrs_cli.language.run.environment import Environment
from vrs_cli.language.run.signals import NO_CELL, NO_INPUTS, Cell, ComputedSignals, Inputs, LivingCell
from vrs_cli.language.words.values import INTERNAL, key_of
from vrs_cli.values import commands, replies, results
from vrs_cli.values.world import NO_SCENE

if TYPE_CHECKING:
    from vrs_cli.world.course import World, WorldCourse

_P = TypeVar("_P", bound=tasks.Pending)


# memory is counted again only after (elements held / this number) steps, so that counting takes little of the time
ELEMENTS_A_STEP = 20
AN_EVENT = 10  # number of elements that use as much memory as one event of the timeline
MAX_ELEMENTS_A_STEP = 200  # maximum number of elements that one step can add; a string has up to 128 characters


def world_of(engine: Engine, cell: Cell) -> tuple[World | None, ComputedSignals | None]:
    """Return the world of a cell, and the signals that it computes; (None, None) for a cell that only has names."""
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
    """The exception raised in a request that shows a task's question, when the task no longer needs the answer."""


class _Run(Struct, eq=False):
    """A task for whose end a user waits, within limits. `started`: when it began; `last`: when it must end [s];
    `before`: the number of steps of all tasks before the run. `then` is called with the result if no request waits for
    it. `all_tasks`: the run lasts until the other tasks have ended too. `look`: the number of steps of the run after
    which memory is counted next."""

    track: tasks.Track
    limits: Limits
    started: float
    last: float
    before: int
    then: Callable[[results.RunResult], None] | None = None
    all_tasks: bool = False
    look: int = 0


class Driver:
    """The driver of the `tasks` of one robot. `disk`: the files of programs. `advice`: the hint at a limit. `begin`
    sets a task to wait for, `step` carries out the next event, `peek` returns its time. `run` waits until a task has
    stopped; `settle` processes everything that is due. `answers` returns whether the current user gets a task's
    questions. `then` returns the function to call at the end of a task whose user no longer waits, None if the task
    must stop now. `lags` returns whether users have not yet read what programs have typed. `asking`: the numbers of the
    questions that are being shown to users."""

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
        self.world: World | None = None  # world of the robot's latest cell
        self._advice = advice
        self._transcript = performing.TypedLines(engine, terminal, advice)
        self._written = Spent("max_disk", "write", advice)
        self.disk = disk.Disk(folder, self._written.add, self._check_held)
        self.devices = devices.Devices(
            self.disk,
            self._transcript.show,
            outside or Outside(),
            # a missing device is only a warning: the program continues without it
            lambda missing: terminal.show(replies.Message(str(missing), replies.Tone.WARNING)),
        )
        self.devices.outside.tell = lambda text: terminal.show(replies.Message(text))
        self.tasks = tasks.Tasks(engine, environment, self.devices)
        self._performer = performing.Performer(engine, environment, self.tasks, self._transcript, self.devices, advice)
        self._interrupted = False
        self._ended_by: LimitReached | None = None
        self._runs: list[_Run] = []  # the program, and a prompt line that runs at the same time
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
        """The task for whose end a request lets time advance. May be read in any thread."""
        last = self._runs[-1:]
        return last[0].track if last and last[0].then is None else None

    def end_by(self, error: LimitReached) -> bool:
        """End the run with this error before its next step. Return False if there is no run. Safe to call in a signal
        handler."""
        if self._runs:
            self._ended_by = error
        return bool(self._runs)

    def interrupt(self) -> None:
        """Stop the run before its next step, and the robot as soon as possible. Safe to call in a signal handler."""
        self._interrupted = True

    @property
    def _ends(self) -> bool:
        """Return whether the run must end even if its task still waits."""
        return self._interrupted or self._ended_by is not None

    @property
    def waits_for_users(self) -> bool:
        """Return whether programs wait until users have received their output (TYPE). Programs that are ending do not
        wait."""
        return (
            self.lags()
            and not self._ends
            and not any(isinstance(one.pending, tasks.Aborted) for one in self.tasks.running)
        )

    @property
    def stands(self) -> bool:
        """Return whether a program for which no user waits is held up by a paused clock."""
        clock = self.engine.clock
        return clock.paused and not self._ends and self.awaited is None and self.peek() > clock.reached

    # --- runs for which a user waits ---

    def run(
        self, track: tasks.Track, limits: Limits = ATTENDED, *, all_tasks: bool = False
    ) -> Dialogue[results.RunResult]:
        """Run until a task stops or, with `all_tasks`, until all tasks have stopped. At each RUNNING the actor carries
        out one event (`step`). The other tasks run beside the task, and their questions are asked."""
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
        """Return the task for which a run waits now; None if the run has ended."""
        if run.track.outcome is None:  # called several times for each step
            return run.track
        return next((track for track in self.tasks.in_order() if track.running), None) if run.all_tasks else None

    def begin(
        self, track: tasks.Track, limits: Limits = ATTENDED, then: Callable[[results.RunResult], None] | None = None
    ) -> _Run:
        """Start waiting for a task, within limits. `then` is called at the end of the task if no request waits for
        it."""
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
        """Carry out the next event, or advance time towards it. The run may reach a limit here."""
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
            # one more step begins after the last allowed one, but is not carried out
            self._happen(runtime.BUDGET if most is None else most - (self.tasks.steps_done - run.before) + 1)
            self._look()
        self._tell_ends()

    def abort(self, number: int) -> tasks.Track | None:
        """Stop a task now, even if its next step is far in the future. Return None if no task with this number is
        running."""
        self.engine.clock.advance(self.engine.clock.reached)
        return self.tasks.abort(number)

    def drop(self, foreground: tasks.Track | None = None) -> None:
        """Stop the robot, the task for which a user waited, and all tasks stopped by an internal error of vrs."""
        self.engine.clock.advance(self.engine.clock.reached)
        self.engine.stop()
        for track in self.tasks.running:
            if track is foreground or track.task.was_broken_off:
                track.task.abort()
                self.tasks.stop(track, results.RunOutcome.ABORTED)

    def broken_off(self, error: LimitReached) -> results.RunResult:
        """Return the result of a run that `error` has ended in the middle of a step."""
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
        """Return the lines that programs have typed since the last run began."""
        return tuple(self._transcript.lines)

    # --- questions ---

    def questions(self) -> list[tuple[tasks.Track, tasks.PendingInput]]:
        """Return the tasks that wait for a line of the terminal, with their questions, in the order in which they
        asked."""
        waiting = [(track, track.pending) for track in self.tasks if isinstance(track.pending, tasks.PendingInput)]
        return sorted(waiting, key=lambda one: one[1].number)

    def answer(self, number: int, answer: str | VrsError | None) -> None:
        """Give a line to the task that asked this question: None at the end of the input, or an error. If the task no
        longer waits, do nothing."""
        if (found := next((one for one in self.questions() if one[1].number == number), None)) is None:
            return
        self.tasks.current = found[0].number
        try:
            self._performer.answer(*found, answer)
        except VrsError as error:
            self._do(found[0], self._throw(found[0], error))
        self.tasks.current = tasks.PROMPT_LINE

    def ask(self) -> Dialogue[None]:
        """Ask the users the questions of the tasks that they drive. Ctrl-C stops the task that asks."""
        self._performer.asked = False
        while waiting := self.open_questions():
            track, asked = waiting[0]
            self.asking.add(asked.number)
            try:
                answer = yield asked.question
                self.answer(asked.number, answer if isinstance(answer, str) else None)
            except AskedInVain:
                pass  # the question is asked again if the task still waits for the answer
            except VrsError as error:
                self.answer(asked.number, error)
            except KeyboardInterrupt:
                self.abort(track.number)
            finally:
                self.asking.discard(asked.number)

    def open_questions(self) -> list[tuple[tasks.Track, tasks.PendingInput]]:
        """Return the questions for the current user that are not being shown to any user."""
        return [one for one in self.questions() if one[1].number not in self.asking and self.answers(one[0])]

    @property
    def has_withdrawn(self) -> bool:
        """Return whether a question is still shown to a user although its task no longer waits for the answer."""
        return not self.asking <= {asked.number for _, asked in self.questions()}

    # --- limits ---

    def _end_vain_wait(self, run: _Run, track: tasks.Track) -> None:
        """End a task's wait for an event that can never occur, with an error."""
        more = self._advice("signals")
        error = observations.endless(track, "" if more == GO_ON else more, self.environment.signals.with_names)
        if track is run.track:
            self._fail(track, error)
        else:  # the program has ended, and no more events will occur in this task
            place = f"task {track.number} is ended at {track.task.program} step {track.task.step}"
            self.terminal.show(replies.Message(f"{place}: {error}", replies.Tone.WARNING))
            self.tasks.abort(track.number)

    def _exceed_time(self, run: _Run) -> None:
        """End a run that has reached its limit of robot time."""
        self.engine.clock.advance(max(run.last, self.engine.now))
        what = f"the program was still running after {run.limits.max_time:g} s of the robot's time"
        late = (one.text for one in self.engine.book.records() if one.asked is not None and one.asked > run.last)
        if text := next(late, None):  # the cause is the first motion requested for a time after the limit
            what += f", and {text} was asked for later than that"
        self._end_at_limit(run, what, self._advice("max_time"))

    def _in_vain(self) -> bool:
        """Return whether time could pass for ever without any event."""
        engine = self.engine
        more_comes = engine.realtime or self._next_signal() < inf or engine.now < engine.end
        return not more_comes and observations.in_vain(self.tasks.running, engine.now)

    def _look(self) -> None:
        """Check each run for its limits of steps and memory, and end it at a limit."""
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
        """Advance time towards `coming`. Return whether that time was reached. On a paused clock the task for which the
        run waits fails."""
        try:
            self.engine.clock.wait(coming)
        except ClockPaused as error:
            self._fail(foreground, error)
        return self.engine.now >= coming

    def _check_held(self, characters: int) -> None:
        """Check how many characters are kept in memory for files that are open for reading. Raises LimitReached."""
        most = None if not self._runs else self._runs[-1].limits.max_elements
        if most is not None and characters > most:
            raise LimitReached(
                f"the files that are read hold {characters} characters, {most} at most", self._advice("max_elements")
            )

    def _end_at_limit(self, run: _Run, what: str, hint: str) -> None:
        """End the task of a run at a limit, together with the tasks of all other runs."""
        if (foreground := self._foreground(run)) is None:
            return
        error = LimitReached(f"{what}: {'; '.join(self._whereabouts(foreground))}", hint)
        self.engine.stop()
        self._fail(foreground, error)
        for track in list(self.tasks.running) if run.all_tasks else ():
            if track is not foreground:
                self.tasks.abort(track.number)

    def _fail(self, track: tasks.Track, error: VrsError) -> None:
        """Raise an error in a task, instead of the event for which it waits."""
        track.pending = None
        self._do(track, self._throw(track, error))

    def _whereabouts(self, foreground: tasks.Track) -> Iterator[str]:
        """Yield the position at which each task waits or works, the task of the run first."""
        others = [track for track in self.tasks.in_order() if track.running and track is not foreground]
        for track in [foreground, *others]:
            task = track.task
            waits = "waits" if track.pending is not None else "is busy"
            number = f"task {track.number}, " if track.number > tasks.ROBOT_PROGRAM else ""
            place = f"{number}{task.program or 'the line'} step {task.step}"
            yield f"{place} {waits} at {task.source}" if task.source else f"{place} {waits}"

    # --- events for which no user waits ---

    def settle(self, until: float | None = None) -> None:
        """Let the tasks do everything that is due up to an instant, by default the current one."""
        clock = self.engine.clock
        until = clock.reached if until is None else until
        while (coming := min(self.peek(), self._next_signal())) <= until and not self.waits_for_users:
            clock.advance(coming)
            self._happen(runtime.BUDGET)
            self._look()
        clock.advance(until)
        self._tell_ends()

    def _tell_ends(self) -> None:
        """Report the ends of runs for which no request waits."""
        for run in tuple(self._runs):
            if run.then is not None and not run.track.running:
                run.then(self._result(self._over(run.track)))

    # --- the next event ---

    def peek(self) -> float:
        """Return when the next event is due [s]; infinity if there is none without a new request."""
        if (track := self.tasks.next()) is None:
            return inf
        return min(track.wake, self._next_signal(), self.devices.outside.due(self.engine.clock))

    def _next_signal(self) -> float:
        """Return the time of the next change of an input or the next event on the timeline [s]."""
        dated = self.environment.signals.follow_clock()
        return dated if self.inputs is NO_INPUTS else min(self.inputs.next_time, dated)

    def _happen(self, budget: int) -> None:
        """Process all due events: arriving data, a signal change, or a task, which runs until its next request that
        takes time or until another task has its turn."""
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
            return  # a signal has changed for which no task waits
        self.tasks.current, signals.place = track.number, None
        self._do(track, self._event(track, budget))
        self.tasks.current = tasks.PROMPT_LINE
        signals.follow_clock()  # changes that the task itself made on the timeline are not signal changes now
        # reactions to several signals are carried out one after the other
        if track.reacts and self._left_now(track) > 0:
            track.wake = self.engine.now

    def _do(self, track: tasks.Track, event: tasks.Pending) -> None:
        """Carry out a request of a task. If it fails, raise the error in the task, and carry out the task's next
        request."""
        while True:
            track.wake = self.engine.now
            try:
                performing.ACTS.get(type(event), performing.Performer.request)(self._performer, track, event)
                return
            except VrsError as error:
                event = self._throw(track, error)

    def _change_inputs(self) -> None:
        """Carry out the changes of inputs that are due now, and apply the cell's rules to each of them."""
        due, self.inputs = self.inputs.take_until(self.engine.now)
        for change in due:
            for name, value in change.values.items():
                self.environment.reference(name, None).assign(value)
            if change.signal:
                signal = change.signal if change.on else -change.signal
                self.environment.signals.write(signal, inputs=True, stamp=commands.Stamp(self.engine.now))

    @property
    def course(self) -> WorldCourse | None:
        """The course of the cell's parts on the current timeline; None without a cell."""
        return None if self.world is None else self.world.course(self.engine.timeline)

    def surround(self, cell: Cell) -> None:
        """Put the robot in a cell. The cell gives names to signals, and its rules apply automatically."""
        self.cell, self._living = cell, LivingCell(cell)
        self.environment.signals.names = cell.names
        self.world, self.environment.signals.cell_inputs = world_of(self.engine, cell)

    def _follow(self, signal: int, on: bool) -> None:
        """Apply the cell's rules to a signal that has changed, unless the world computes that signal."""
        if self.cell.follows:
            computed = self.environment.signals.cell_inputs
            known = frozenset[int]() if computed is None or signal in INTERNAL else computed.numbers
            left = (
                structs.replace(one, signal=0) if one.signal in known else one
                for one in self._living.answers(signal, on, self.engine.now)
            )
            self.inputs = self.inputs.with_more(one for one in left if one.signal or one.values)

    @contextmanager
    def surrounding(self, cell: Cell | None, inputs: Inputs) -> Iterator[None]:
        """Within this context, put the robot in another cell (None: the same one), and let inputs change at times [s]
        from now. Changes that are not due by the end are dropped."""
        signals = self.environment.signals
        before, world = (self.cell, self._living, signals.names, signals.cell_inputs), self.world
        own, given = self.inputs.left, inputs.later(self.engine.now).left
        if cell is not None:
            self.surround(cell)
        self.inputs = self.inputs.with_more(given)
        try:
            yield
        finally:
            stay = signals.computed_states() if cell is not None else ()
            self.cell, self._living, signals.names, signals.cell_inputs = before
            self.world = world or self.world  # the parts of a call's own cell can be examined after the call
            signals.write(*stay, inputs=True, stamp=commands.Stamp(self.engine.now))  # keep the computed states
            kept, dropped = {id(change) for change in own}, {id(change) for change in given}
            left = (change for change in self.inputs.left if id(change) not in dropped)
            self.inputs = Inputs.of(change for change in left if cell is None or id(change) in kept)

    def _event(self, track: tasks.Track, budget: int) -> tasks.Pending:
        """Return what a task requests now: the event for which it waited, or the next request of its program."""
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
        # examine each step before it is carried out
        if (looked_at or self.engine.settings.switch("TRACE")) and not track.at_prompt:
            return self._asked_again(track, self._step_by_step(track, answer))
        return self._asked_again(track, track.task.resume(answer, budget))

    def _throw(self, track: tasks.Track, error: VrsError) -> tasks.Pending:
        """Raise an error in a task. Return the next request of the task."""
        track.asked = self.engine.now
        return self._asked_again(track, track.task.throw(error))

    @staticmethod
    def _asked_again(track: tasks.Track, event: _P) -> _P:
        """Restore the original request time of an event that a reaction interrupted. Return the event."""
        for held in track.held:
            if held[0] is event:
                track.asked = held[1]
                track.held.remove(held)
                break
        return event

    def _left_now(self, track: tasks.Track) -> int:
        """Return how many more steps a task may do at the current instant; after that, time must advance."""
        if track.instant != self.engine.now:
            track.instant, track.before = self.engine.now, track.task.steps_done
        return runtime.BUDGET - (track.task.steps_done - track.before)

    def _step_by_step(self, track: tasks.Track, answer: str | None) -> effects.Event | tasks.Stopped | tasks.Onward:
        """Carry out the current step of a task. Return its request, or whether the program stops before the next
        step.
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
