"""Record the history of a timeline: its first version, every change since, and the changes that UNDO can take back.

The timeline changes only here, in a fixed order: a planned change is written into the journal, then it takes effect,
then the callback `notify` is called. A change that the journal refuses does not take effect.

A book with a window keeps only its latest part in memory. After each change a little of the past is removed from
memory: commands that UNDO would take back, deltas, and rows of segments. From time to time a checkpoint is written. The
checkpoint contains the file positions of all rows of the timeline, so a later reader starts there.

The answer to a command says which scheduled motions the change has moved or dropped (`displacement`).
"""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterable, Iterator, Mapping, Sequence
from functools import reduce
from itertools import islice, pairwise
from typing import Protocol, TypeVar

from msgspec import Struct, structs

from vrs_cli.engine.history import History, HistoryStep, commands_in_force, records
from vrs_cli.errors import RequestRefused
from vrs_cli.kinematics.joints import Joints
from vrs_cli.trajectory.rope import SMALL_LEAF
from vrs_cli.trajectory.row import EventRow, Row, RowStore
from vrs_cli.trajectory.segment import rest
from vrs_cli.trajectory.timeline import PART, Cause, DeltaLog, KeptDeltas, Timeline, TimelineDelta
from vrs_cli.values.commands import EventEdit, Motion, MotionKind, Start
from vrs_cli.values.results import CommandRecord, Displacement, Moved

CHANGES_AT_ONCE = 50  # number of changes that are planned before the caller may do other work
R = TypeVar("R")
Parts = Generator[None, None, R]  # work in parts; the caller may do other work between two parts
ROW_LENGTH = 128  # maximum number of segments of a row, so that a change writes at most this many (3 ms of CPU)
MAX_MOTIONS_COMPARED = 100  # maximum number of motions whose shifts an answer reports, to limit its cost
SAME_TIME = 5e-4  # [s] times closer than this are shown as equal


class WindowSize(Struct, frozen=True):
    """The part of a book that stays in memory: the commands and deltas of the last `changes` changes, and the last
    `segments` segments. A checkpoint is written when `checkpoint` changes have passed since the previous checkpoint.
    """

    changes: int = 512
    segments: int = 512
    checkpoint: int = 1024


class Store(KeptDeltas, Protocol):
    """A place outside memory for the past of a book. Rows that cannot be written stay in memory."""

    def keep_row(self, row: Row) -> RowStore | None:
        """Write a row and return its store; None if the row cannot be written now."""

    def keep_events(self, row: EventRow) -> int | None:
        """Write a row of events and return its file position; None if the row cannot be written now."""

    def keep_checkpoint(self, timeline: Timeline, commands: int, number: int) -> bool:
        """Write the file positions of all rows of a timeline and of its events. Return whether this was possible.
        `commands`: the number of commands that are not undone; `number`: the number of the last motion.
        """


class MemoryWindow:
    """The latest part of a book, which stays in memory; older parts are written to the `store` and removed. `reach`:
    the size of the latest part; `checkpoint`: the version of the timeline at the last checkpoint.
    """

    def __init__(self, store: Store, reach: WindowSize, checkpoint: int = 0) -> None:
        self.store, self.reach, self._checkpoint = store, reach, checkpoint
        self._first = 0  # number of the first segment in memory
        self._first_event = 0  # number of the first event that is not written yet

    def let_go(self, timeline: Timeline, deltas: Sequence[TimelineDelta], commands: int, number: int) -> None:
        """Remove a part of the past from memory after the changes `deltas`, and write a checkpoint if enough changes
        have passed. `timeline`: the timeline after the changes. `commands`, `number`: as for `Store.keep_checkpoint`.
        """
        self._first = min(
            [self._first, *[max(delta.keep - SMALL_LEAF - 1, 0) for delta in deltas]]
        )  # an edit may also merge segments shortly before it into other rows
        edits = [delta.events.keep - SMALL_LEAF - 1 for delta in deltas if delta.events is not None]
        self._first_event = max(min([self._first_event, *edits]), 0)
        count = len(timeline)
        for index, _, leaf in timeline.parts(max(count - 2 * ROW_LENGTH, 0)):
            row, is_last = leaf.row, index + leaf.count == count
            if not row.closed and len(row) >= (ROW_LENGTH if is_last else ROW_LENGTH // 2):
                # so that neither new segments nor a merged row make it much longer than ROW_LENGTH
                row.close()
        due = timeline.version - self._checkpoint >= max(
            self.reach.checkpoint, (count + timeline.event_count) // ROW_LENGTH
        )
        written = self._write_rows(timeline, due=due) and self._write_events(timeline, due=due)
        if written and due and self.store.keep_checkpoint(timeline, commands, number):
            self._checkpoint = timeline.version

    def _write_rows(self, timeline: Timeline, *, due: bool) -> bool:
        """Write old rows to the store and remove them from memory; if a checkpoint is `due`, write all rows. Return
        whether nothing remains to be written.
        """
        written, old, away = 0, len(timeline) - self.reach.segments, True
        for index, _, leaf in timeline.parts(self._first):
            row, leaves = leaf.row, index + leaf.count <= old
            if not (leaves or due):
                break
            if row.stored_at is None:
                if written >= ROW_LENGTH:
                    return False
                written += len(row)
                row.close()
                row.stored_at = self.store.keep_row(row)
                if row.stored_at is None:
                    return False
            if leaves and not row.away:
                row.put_away()
            away = away and leaves
            if away:
                self._first = index + leaf.count
        return True

    def _write_events(self, timeline: Timeline, *, due: bool) -> bool:
        """Write rows of events that are long enough, or all rows if a checkpoint is `due`. Return whether nothing
        remains to be written. Written events also stay in memory, 50 bytes each.
        """
        written, before = 0, True
        for index, _, leaf in timeline.event_parts(self._first_event):
            row = leaf.row
            if row.stored_at is None and (due or len(row) >= ROW_LENGTH):
                if written >= ROW_LENGTH:
                    return False
                written += len(row)
                row.closed = True
                row.stored_at = self.store.keep_events(row)
                if row.stored_at is None:
                    return False
            before = before and row.stored_at is not None
            if before:
                self._first_event = index + leaf.count
        return True


def whole(parts: Parts[R]) -> R:
    """Do all parts of some work without a pause, and return its result."""
    while True:
        try:
            next(parts)
        except StopIteration as over:
            result: R = over.value
            return result


class JournalWriter(Protocol):
    """A journal, to which every change is written before it takes effect."""

    def record(self, deltas: Sequence[TimelineDelta], *, happens: bool = False) -> None:
        """Write deltas. Raises FileError if they cannot be written; the caller must then not apply them. Does not raise
        FileError for changes that the caller applies in any case (`happens`).
        """

    @property
    def unsettled(self) -> bool:
        """Return whether written changes are not on the disk yet, so that a power cut would lose them. Several changes
        may go to the disk together.
        """

    def settle(self) -> None:
        """Flush all written changes to the disk. Raises FileError."""


def silent(_deltas: Sequence[TimelineDelta]) -> None:
    """Do nothing: the callback of a book without listeners."""


class Book:
    """The recorded history of one robot: `timeline` is `initial` after all `deltas`.

    `number`: the number of the last motion. `stream`: the motion of the last command, if it follows a stream of targets
    and more targets may come (`prolong`). `window`: removes old parts of the book from memory; None if the whole book
    stays in memory. `marks_events`: the motions in the book's file contain the opening of the hand. The next delta must
    then have events, and later motions no longer contain the opening.
    """

    def __init__(
        self,
        initial: Timeline,
        timeline: Timeline,
        deltas: Iterable[TimelineDelta] = (),
        history: History | None = None,
        number: int = 0,
    ) -> None:
        self.initial, self.timeline = initial, timeline
        self.history = history or History()
        self.deltas = deltas.copy() if isinstance(deltas, DeltaLog) else DeltaLog()
        for packed in () if isinstance(deltas, DeltaLog) else self.deltas.extend(deltas, timeline):
            self.history.share(*packed)
        self.number = number
        self.stream: Motion | None = None
        self.journal: JournalWriter | None = None
        self.window: MemoryWindow | None = None
        self.marks_events = False
        self.notify: Callable[[Sequence[TimelineDelta]], None] = silent

    @classmethod
    def at(cls, joints: Joints) -> Book:
        """Make an empty book of a robot that is at rest at these joints from time 0 on."""
        initial = Timeline([rest(joints, 0.0, 0.0, Motion(0, MotionKind.REST, Start.AT))])
        return cls(initial, initial)

    def copy(self) -> Book:
        """Return a book with the same past, without journal and listeners, whose later changes are separate."""
        self.end_stream()
        book = Book(self.initial, self.timeline, self.deltas, self.history.copy(), self.number)
        book.marks_events = self.marks_events
        return book

    # --- reading ---

    def records(self) -> tuple[CommandRecord, ...]:
        """Return the motion commands that UNDO can take back, in the order of issue."""
        return records(self.timeline, [step.delta for step in self.history.done])

    def all_records(self) -> Callable[[], tuple[CommandRecord, ...]]:
        """Return a function that lists all motion commands that are not undone, including those that are no longer in
        memory. The function may be slow; any thread may call it.
        """
        timeline, deltas, history = self.timeline, self.deltas.copy(), self.history.copy()
        return lambda: records(
            timeline, commands_in_force(deltas) if history.forgotten else [step.delta for step in history.done]
        )

    # --- changing the timeline ---

    def commit(self, steps: Sequence[HistoryStep], timeline: Timeline | None = None, *, happens: bool = False) -> None:
        """Apply the changes of new commands, each planned on the result of the previous one: all of them or, if
        FileError is raised, none. With `happens`, apply them in any case. `timeline`: the resulting timeline, if the
        caller knows it.
        """
        deltas = [step.delta for step in steps]
        wrong = self._change(deltas, timeline, happens=happens)
        for step in steps:
            self.history.add(step)
            self.number = step.delta.motion.number
            self.stream = step.delta.motion if step.delta.motion.kind is MotionKind.STEERED else None
        self._let_go(deltas)
        self.notify(deltas)
        if wrong is not None:
            raise wrong

    def prolong(self, delta: TimelineDelta) -> None:
        """Apply the change for the next target of the stream, as a part of the last command. Raises FileError. Of the
        previous change, `deltas` keeps only the part that the robot has executed.
        """
        self._change([delta], goes_on=True)
        if len(self.deltas) % PART != 1:  # at the start of a part of the log, both deltas stay as they are in the file
            before = self.deltas[-2]
            kept = before.segments[: delta.keep - before.keep]
            shorter = structs.replace(delta, drop=delta.drop - len(before.segments) + len(kept))
            self.deltas[-2], self.deltas[-1] = structs.replace(before, segments=kept), shorter
        self._let_go([delta])
        self.notify([delta])

    def end_stream(self) -> None:
        """End the stream of targets, so that UNDO takes its whole motion back as one change."""
        if self.stream is not None:
            self.stream = None
            self.history.lengthen_last(self.timeline)

    def follow(self, other: Book) -> None:
        """Apply the changes of another book, which began as a copy of this one. Raises FileError."""
        other.end_stream()
        deltas = other.deltas[len(self.deltas) :]
        self._change(deltas, other.timeline if self.window is None else other.timeline.in_rows(ROW_LENGTH))
        self.deltas = other.deltas.copy()  # packed parts are shared
        self.history, self.number = other.history.copy(), other.number
        self._let_go(deltas)
        self.notify(deltas)

    def undo(self, count: int, clock: Callable[[], float], *, leaves_recorded: bool) -> Parts[float]:
        """Undo the last `count` commands, all of them or none, and return the clock [s] before them. `clock` returns
        the current time [s]; `leaves_recorded`: as for `History.last_done`. Raises UsageError if there are fewer
        commands, RequestRefused, FileError.
        """
        self.end_stream()
        steps, version = self.history.last_done(count, leaves_recorded=leaves_recorded), self.timeline.version
        taken_back = (step.taking_back(version + number) for number, step in enumerate(steps))
        deltas, timeline = yield from self._plan_changes(taken_back)
        self._change(deltas, timeline)
        before = clock()
        for step in steps:
            self.history.take_back(before, step.delta.motion)
            before = step.clock
        self._let_go(deltas)
        self.notify(deltas)
        return before

    def redo(self, count: int, check: Callable[[Timeline, TimelineDelta], None] | None = None) -> Parts[float]:
        """Repeat the last `count` commands that were undone, all of them or none, and return the clock [s] after them.
        `check` may refuse any of them. Raises the same errors as `undo`.
        """
        undone, version = self.history.last_undone(count), self.timeline.version
        again = (one.step.present(version + number) for number, one in enumerate(undone))
        done_again = (structs.replace(delta, cause=Cause.REDO) for delta in again)
        deltas, timeline = yield from self._plan_changes(done_again, check)
        self._change(deltas, timeline)
        for _ in undone:
            self.history.do_again()
        self._let_go(deltas)
        self.notify(deltas)
        return undone[-1].clock

    def keep_short(self, window: MemoryWindow) -> None:
        """After this call, keep only the latest part of the book in memory."""
        self.timeline, self.window = self.timeline.in_rows(ROW_LENGTH), window
        for _ in list(self.timeline.parts()):
            self._let_go(())

    def _let_go(self, deltas: Sequence[TimelineDelta]) -> None:
        """Remove from memory the changes and rows that are now too old."""
        window = self.window
        if window is not None:
            old = len(self.deltas) - window.reach.changes
            self.history.forget(self.initial.version + old)
            self.deltas.put_away(old, window.store)
            window.let_go(self.timeline, deltas, self.history.commands, self.number)

    def _plan_changes(
        self, deltas: Iterable[TimelineDelta], check: Callable[[Timeline, TimelineDelta], None] | None = None
    ) -> Parts[tuple[list[TimelineDelta], Timeline]]:
        """Apply changes in order to a timeline that is not published yet; return the changes and this timeline. `check`
        is called before each change. Raises RequestRefused if another change of the book happened in a pause.
        """
        before = timeline = self.timeline
        planned: list[TimelineDelta] = []
        for number, delta in enumerate(deltas, 1):
            if check is not None:
                check(timeline, delta)
            timeline = timeline.apply(delta)
            planned.append(delta)
            if check is not None or not number % CHANGES_AT_ONCE:
                yield
                self.check_same(before)
        return planned, timeline

    def check_same(self, before: Timeline) -> None:
        """Raise RequestRefused if the timeline has changed since `before`."""
        if self.timeline is not before:
            raise RequestRefused("the robot was stopped before it was done", "give it again")

    def _change(
        self,
        deltas: Sequence[TimelineDelta],
        timeline: Timeline | None = None,
        *,
        happens: bool = False,
        goes_on: bool = False,
    ) -> Exception | None:
        """Write changes into the journal, then apply them. They end the stream of targets, unless it `goes_on`.
        `timeline`: the resulting timeline, if the caller knows it. Return the error of the journal if the changes take
        effect in spite of the error (`happens`).
        """
        if self.marks_events and deltas and deltas[0].events is None:
            deltas = [structs.replace(deltas[0], events=EventEdit(self.timeline.event_count)), *deltas[1:]]
        if timeline is None:
            timeline = reduce(Timeline.apply, deltas, self.timeline)
        wrong = None
        try:
            if self.journal is not None and deltas:
                self.journal.record(deltas, happens=happens)
        except Exception as error:
            if not happens:
                raise
            wrong = error
        if not goes_on:
            self.end_stream()
        self.timeline, self.marks_events = timeline, self.marks_events and not deltas
        for packed in self.deltas.extend(deltas, timeline):
            self.history.share(*packed)
        return wrong


def displacement(book: Book, before: Timeline) -> Displacement | None:
    """Return how a change has moved the motions and events of the timeline `before`, and also the motions with a time
    stamp that were issued since `before`.

    Return None if nothing has been moved. Motions that UNDO took back do not count as dropped.
    """
    changes = book.deltas[len(book.deltas) - (book.timeline.version - before.version) :]
    if not any(delta.drop or delta.shift or (delta.events and not delta.events.adds) for delta in changes):
        return None
    since = min(delta.cut for delta in changes)
    taken_back = {delta.motion.number for delta in changes if delta.cause is Cause.UNDO}
    commands = {step.number: step for step in book.history.known_commands}
    old = [*islice(_begins(before, since), MAX_MOTIONS_COMPARED + 1), *_event_times(before, since, commands)]
    stamped = [
        (one.motion, one.executed)
        for one in changes[-MAX_MOTIONS_COMPARED:-1]
        if one.motion.start is Start.AT and one.segments and abs(one.executed - one.issued) > SAME_TIME
    ]
    new = {motion.number: begin for motion, begin in islice(_begins(book.timeline, since), 2 * MAX_MOTIONS_COMPARED)}
    # the list is complete, so a motion that is missing in it has been dropped
    gone = len(new) < 2 * MAX_MOTIONS_COMPARED
    new.update((motion.number, time) for motion, time in _event_times(book.timeline, since, commands))
    rows = [
        (motion, begin, new.get(motion.number))
        for motion, begin in (*old[:MAX_MOTIONS_COMPARED], *stamped)
        if motion.number not in taken_back and (gone or motion.number in new)
    ]
    if all(then is not None and abs(then - begin) <= SAME_TIME for _, begin, then in rows):
        return None
    asked = {
        number: delta.executed
        for number in {motion.number for motion, _, _ in rows} & commands.keys()
        if (delta := commands[number].delta).motion.start is Start.AT
    }
    moved = [Moved(motion.text, asked.get(motion.number), begin, then) for motion, begin, then in rows]
    return _sort_moved(moved, more=len(old) > MAX_MOTIONS_COMPARED)


def _sort_moved(moved: Sequence[Moved], *, more: bool = False) -> Displacement:
    """Sort moved motions into later, earlier and dropped motions. `more`: further motions were not compared."""
    return Displacement(
        tuple(one for one in moved if one.later > SAME_TIME),
        tuple(one for one in moved if one.later < -SAME_TIME),
        tuple(one for one in moved if one.after is None),
        more,
    )


def displacement_of(commands: Iterable[CommandRecord]) -> Displacement | None:
    """Return how motions have been moved from their requested times; None if no motion has been moved."""
    timed = ((one, one.asked) for one in commands if one.asked is not None)
    moved = [
        Moved(one.text, asked, asked, None if one.end is None else one.executed)
        for one, asked in timed
        if one.end is None or one.is_displaced
    ]
    return _sort_moved(sorted(moved, key=lambda one: one.before)) if moved else None


def _event_times(
    timeline: Timeline, since: float, commands: Mapping[int, HistoryStep]
) -> Iterator[tuple[Motion, float]]:
    """Yield each command that sets channels later than `since` [s], with the time of its event; at most the first
    MAX_MOTIONS_COMPARED events.
    """
    first = timeline.events_by(since)
    for event in timeline.event_slice(first, min(first + MAX_MOTIONS_COMPARED, timeline.event_count)):
        step = commands.get(event.number)
        if step is not None and (motion := step.delta.motion).kind is MotionKind.EVENT:
            yield motion, event.time


def _begins(timeline: Timeline, since: float) -> Iterator[tuple[Motion, float]]:
    """Yield the motions that begin at `since` [s] or later, each with its start time [s]."""
    index = timeline.index_at(since)
    while index and timeline[index].start >= since:
        index -= 1
    following = (timeline[place] for place in range(index, len(timeline)))
    for before, segment in pairwise(following):
        if segment.motion.number != before.motion.number:
            yield segment.motion, segment.start
