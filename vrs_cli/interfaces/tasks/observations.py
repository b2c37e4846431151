"""Record on the timeline which signals programs have read, and their states (WAIT, SIG, BITS, REACT). After an edit of
the timeline, find the readings that no longer hold. Also find tasks that wait for a state that no event can bring
about.

A step that reads a signal repeatedly records its state once after each command, and again when the state has changed:
for a loop that polls a signal, the timeline contains the changes of the signal, not every reading."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from math import inf

from vrs_cli.engine.book import Book
from vrs_cli.engine.engine import Engine
from vrs_cli.errors import EndlessWait, VrsError
from vrs_cli.interfaces.tasks.tasks import Tasks, Track
from vrs_cli.language.run.effects import AttachRobot, Wait, WaitEvent
from vrs_cli.language.run.signals import Signals
from vrs_cli.language.text import ast, printer
from vrs_cli.language.words import functions, values
from vrs_cli.trajectory.instant import TICK
from vrs_cli.trajectory.timeline import Cause, Timeline, TimelineDelta
from vrs_cli.values.commands import Event, SetChannels
from vrs_cli.values.results import Untrue

# [s] times closer than this are equal: after an edit, sensor changes are computed again to within 1 us
SAME_INSTANT = 1e-5


class Observations:
    """The recorder of signals that the tasks of a robot read."""

    def __init__(self, engine: Engine, tasks: Tasks, signals: Signals) -> None:
        self._engine, self._tasks, self._signals = engine, tasks, signals
        # last reading by program, operation and signal: state, number of the last command before it, and time [s]
        self._known: dict[tuple[str, int, int], tuple[bool, int, float]] = {}
        self._numbers = 0  # numbers of `engine.book` used by observations, not by commands
        signals.observer, tasks.observed = self._read, self._record_reaction

    def _read(self, signal: int, on: bool) -> None:
        """Record that the current step of the current task has read a signal."""
        if (track := self._tasks.get(self._tasks.current)) is not None and track.in_program:
            self._record(track, self._signals.place, signal, on)

    def _record_reaction(self, track: Track, signal: int, on: bool) -> None:
        """Record that a task has reacted to a signal (REACT)."""
        if track.in_program:
            self._record(track, None, signal, on)

    def _record(self, track: Track, op: int | None, signal: int, on: bool) -> None:
        if signal in values.INTERNAL:
            return
        engine, (program, present) = self._engine, track.task.operation
        key = program, present if op is None else op, signal
        state, number, time = self._known.get(key, (None, 0, inf))
        if state is on and number == engine.book.number - self._numbers and time <= engine.now:
            return
        before = engine.book.number
        changed = self._signals.changes_now(signal)
        age = 0.0 if changed and self._signals.on_at(signal, engine.now - SAME_INSTANT) is not on else TICK
        engine.perform(
            SetChannels(((signal, float(on)),), text=track.task.place_of(key[1]), observed=True, duration=age)
        )
        self._signals.keep_states()
        self._numbers += engine.book.number - before
        self._known[key] = on, engine.book.number - self._numbers, engine.now


# --- after an edit --------------------------------------------------------------------------------------------------


def changed_since(before: Timeline, after: Timeline, changes: Iterable[TimelineDelta]) -> float:
    """Return the earliest time [s] at which `changes` may have invalidated readings, or infinity if they only add later
    motions and events. `before`, `after`: the timeline before and after the changes."""
    since, latest = inf, before.event(before.event_count - 1).time if before.event_count else -inf
    for delta in changes:
        edit = delta.events
        moved = delta.drop or delta.shift or (not delta.segments and edit is None)
        first = delta.cut if moved else delta.segments[0].start if delta.segments else inf
        if edit is not None and not edit.adds:
            kept = min(edit.keep, after.event_count)
            first = min(first, after.event(kept - 1).time if kept else -inf)
        new = [event.time for event in edit.events if not event.observed] if edit is not None else []
        first = min([first, *new])
        if first < latest:
            since = min(since, first)
        latest = max([latest, *(event.time for event in edit.events)] if edit is not None else [latest])
    return since


def untrue(book: Book, signals: Signals, since: float = -inf) -> Iterator[Untrue]:
    """Yield the readings of programs, made at `since` [s] or later, that do not agree with the timeline of a book."""
    # given: values that earlier events at the same instant have set
    wrong, instant, given = list[Event](), -inf, dict[int, float]()
    for event in book.timeline.events_between(since, inf):
        if event.time != instant:
            instant, given = event.time, {}
        if not event.observed:
            given[event.channel] = event.value
        elif not _holds(signals, event, given.get(event.channel)):
            wrong.append(event)
    if not wrong:
        return
    texts, following = _place_texts(book)
    for event in wrong:
        yield Untrue(
            number=event.number,
            signal=event.channel,
            on=event.value > 0.0,
            changed=event.duration == 0.0,
            time=event.time,
            place=texts.get(event.number, ""),
            command=following.get(event.number, ""),
            name=signals.names.get(event.channel, ""),
        )


def _holds(signals: Signals, event: Event, given: float | None) -> bool:
    """Return whether the recorded reading of a signal agrees with the timeline. `given`: the value that earlier events
    at the same instant have set; None if they have set none. Later events at that instant cannot have affected the
    reading."""
    on, computed, t = event.value > 0.0, signals.cell_inputs, event.time
    changed = event.duration == 0.0
    if computed is not None and event.channel in computed.numbers:
        # also true if the signal was read just before it changed at this instant
        if signals.on_at(event.channel, t) is not on:
            return not changed and signals.on_at(event.channel, t - TICK) is on
    elif (signals.on_at(event.channel, t - TICK) if given is None else given > 0.0) is not on:
        return False
    return not changed or signals.on_at(event.channel, t - SAME_INSTANT) is not on


def _place_texts(book: Book) -> tuple[dict[int, str], dict[int, str]]:
    """Return two dictionaries, by the number of an observation: the position in the program where the signal was read,
    and the text of the next motion command."""
    places, commands, waiting = dict[int, str](), dict[int, str](), list[int]()
    for delta in book.deltas:
        number, text = delta.motion.number, delta.motion.text
        if delta.cause is not Cause.COMMAND:
            continue
        if delta.events is not None and any(one.observed and one.number == number for one in delta.events.events):
            places[number] = text
            waiting.append(number)
        elif delta.segments:
            commands.update(dict.fromkeys(waiting, text))
            waiting.clear()
    return places, commands


UNTIMED = (Wait, WaitEvent, AttachRobot)  # requests that may wait forever, because they have no time limit


def in_vain(tracks: Iterable[Track], now: float) -> bool:
    """Return whether every task is waiting for a state that the passage of time alone will not change. `now` [s]: the
    time of the robot's clock."""
    return all(track.wake > now and not track.reacts and _stays(track) for track in tracks)


def _stays(track: Track) -> bool:
    pending = track.pending
    if isinstance(pending, Wait):
        condition = _condition(track)
        changes = any(isinstance(node, ast.Call) and node.name in functions.BY_TIME for node in ast.nodes(condition))
        return condition is not None and not changes and not _wait_is_over(pending)
    return isinstance(pending, AttachRobot) or (isinstance(pending, WaitEvent) and pending.seconds is None)


def _condition(track: Track) -> ast.Expression | None:
    """Return the condition of the WAIT instruction at which a task has stopped; None if that WAIT has no condition."""
    it = track.task.statement
    return it.arguments[0] if isinstance(it, ast.Instruction) and it.word == "WAIT" and it.arguments else None


def _wait_is_over(wait: Wait) -> bool:
    try:
        return wait.condition()
    except VrsError:  # the task will raise this error when it evaluates the condition, so its wait is not endless
        return True


def endless(track: Track, help_: str, said: Callable[[str], str] = str) -> EndlessWait:
    """Return the error for a task whose wait can never end. `help_`: how the user can change an input; "" if SIGNAL at
    the prompt changes it and RETRY continues the task. `said`: formats a condition with the names of its signals."""
    if isinstance(track.pending, AttachRobot):
        return EndlessWait("waits for the robot, which another task keeps", "DETACH there, or ABORT it")
    if isinstance(track.pending, WaitEvent):
        return EndlessWait("waits for its event, which no task here sets", "SET.EVENT of another task sets it")
    condition = _condition(track)
    signal = _signal(condition)
    what = "makes true" if signal is None else "turns on" if signal > 0 else "turns off"
    change = "change that" if signal is None else f"SIGNAL {signal}"
    hint = f"{change} first" if track.at_prompt else f"{change}, then RETRY"
    if help_:
        hint = help_ if signal is not None and abs(signal) in values.INPUTS else ""
    awaited = "" if condition is None else said(printer.expression_text(condition))
    return EndlessWait(f"waits for {awaited}, which nothing here {what}", hint)


def _signal(condition: ast.Expression | None) -> int | None:
    """Return the number of the signal for which a condition waits (negative: for its off state); None if the condition
    is more than a single signal, as in WAIT SIG(1003), or WAIT 3 in VAL."""
    if condition is not None and (asked := ast.channel(condition)) is not None:
        return asked
    if not isinstance(condition, ast.Call) or condition.name != "SIG" or len(condition.arguments) != 1:
        return None
    number = ast.plain_number(condition.arguments[0])
    return None if number is None else round(number)
