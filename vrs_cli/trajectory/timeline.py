"""The trajectory timeline tau: an immutable, ordered sequence of segments.

An edit makes a new version that shares all but a few nodes of its rope with the old version. The remaining tail is
neither copied nor computed again, however long it is. Old versions stay valid for their readers.

A change of the timeline exists in one form, the timeline delta. The planner f returns it, a timeline applies it, a line
of the trajectory file and a message of a stream hold it, and UNDO takes it back. A delta log has all deltas of a
timeline, one for each version; old deltas are columns of plain numbers, or stored elsewhere. If a row of the timeline
still has the segments of old deltas, the log refers to this row and keeps no copy of them.
"""

from __future__ import annotations

from array import array
from collections.abc import Iterable, Iterator, Sequence
from enum import Enum
from itertools import accumulate, chain, groupby, islice, zip_longest
from math import inf
from typing import TYPE_CHECKING, Any, Protocol, overload

from msgspec import Struct, structs

from vrs_cli.trajectory import rope
from vrs_cli.trajectory.rope import Leaf, OffsetNode, RowPart
from vrs_cli.trajectory.row import EventRow, Row
from vrs_cli.trajectory.segment import PackedMotion, Path, Segment
from vrs_cli.values.commands import Event, EventEdit, Motion

if TYPE_CHECKING:
    from vrs_cli.values.world import WorldState

PART = 128  # number of deltas in one part of a delta log
MAX_KEPT_READS = 4  # number of segments that a timeline keeps after they were read
UNPACKED_PARTS = 2  # number of parts that are not packed: the last part, which grows, and the part before it


class Cause(Enum):
    COMMAND = "command"
    UNDO = "undo"
    REDO = "redo"


class TimelineDelta(Struct, frozen=True):
    """A change that turns timeline `version` into `version + 1`.

    The first `keep` segments stay; if the last of them ends after `cut` [s], it is truncated there. The next `drop`
    segments are replaced by `segments`. All later segments are shifted by `shift` [s], with the same paths to the bit.
    `motion` is the motion that caused the change, `issued` and `executed` its issue and execution time. `events` is the
    change of the events; None if there is none.
    """

    version: int
    cause: Cause
    motion: Motion
    issued: float
    executed: float
    cut: float
    keep: int
    drop: int
    shift: float
    segments: Sequence[Segment]
    events: EventEdit | None = None


class Timeline:
    """The trajectory tau[k] of a robot; `version` is k. The first segment, s_0, is the initial pose at the start time,
    without duration. A timeline also has events in order of time, which set the values of channels (`value_at`).
    `world`: the state of the world at the start, for a robot in a cell (a described world), if the timeline is the last
    part of a longer one.
    """

    __slots__ = ("_events", "_read", "_rope", "version", "world")

    def __init__(
        self,
        segments: Iterable[Segment],
        version: int = 0,
        events: Iterable[Event] = (),
        world: WorldState | None = None,
    ) -> None:
        made = rope.rope_of(Row(segments))
        if made is None:
            raise ValueError("a timeline has at least one segment: s_0, the initial pose")
        self._rope: OffsetNode[Row] = made
        dated = tuple(events)
        self._events: OffsetNode[EventRow] | None = rope.rope_of(EventRow(dated)) if dated else None
        self._read: dict[int, Segment] = {}
        self.version, self.world = version, world

    # --- reading ---

    def __len__(self) -> int:
        return self._rope.node.count

    def __getitem__(self, index: int) -> Segment:
        found = self._read.get(index)  # cached, because an edit reads the segments around its cut several times
        if found is not None:
            return found
        count = self._rope.node.count
        if index < 0:
            index += count
        if not 0 <= index < count:
            raise IndexError(index)
        made: Segment = rope.item(self._rope, index)
        if len(self._read) >= MAX_KEPT_READS:
            self._read.clear()
        self._read[index] = made
        return made

    def __iter__(self) -> Iterator[Segment]:
        return rope.segments(self._rope)

    def __eq__(self, other: object) -> bool:
        return (
            isinstance(other, Timeline)
            and len(self) == len(other)
            and all(a == b for a, b in zip(self, other, strict=True))
            and tuple(self.events) == tuple(other.events)
        )

    def __hash__(self) -> int:
        return hash((self.version, len(self), self.end))

    def __repr__(self) -> str:
        return f"<Timeline version {self.version}: {len(self)} segments, {self.start:.3f} to {self.end:.3f} s>"

    @property
    def start(self) -> float:
        """The time of the first segment [s]."""
        return self._rope.offset + self._rope.node.begin

    @property
    def end(self) -> float:
        """The time at which the last segment finishes [s]."""
        return self._rope.offset + self._rope.node.end

    @property
    def last(self) -> float:
        """The time at which the last segment finishes or, if that is later, the last event happens [s]."""
        return self.end if self._events is None else max(self.end, self._events.offset + self._events.node.end)

    def index_at(self, t: float) -> int:
        """Return the index of the last segment with start <= t (0 before the first)."""
        return rope.index_at(self._rope, t)

    def locate(self, t: float) -> tuple[Segment, float]:
        """Return the active segment at t [s], with its times as stored, and t - t_s limited to its duration (between
        two segments the robot is at rest).
        """
        row, place, since = rope.locate(self._rope, t)
        return row[place], since

    def path_at(self, t: float) -> tuple[Path, float]:
        """Return the path of the active segment at t [s], and t - t_s as `locate` limits it."""
        row, place, since = rope.locate(self._rope, t)
        return row.paths[place], since

    def blocks(self, first: float, last: float) -> Iterator[RowPart]:
        """Yield the parts of rows that are active from time `first` to `last` [s], in order. Other versions of the
        timeline may share these rows.
        """
        return rope.blocks(self._rope, first, last)

    # --- events ---

    @property
    def events(self) -> Iterator[Event]:
        """All events in order of time; events of one instant in the order in which they were given."""
        return iter(()) if self._events is None else rope.events(self._events, 0, self.event_count)

    @property
    def event_count(self) -> int:
        return 0 if self._events is None else self._events.node.count

    @property
    def channels(self) -> tuple[int, ...]:
        """The channels that events change, in order."""
        return () if self._events is None else tuple(sorted(rope.last_values(self._events.node)))

    def same_events(self, other: Timeline) -> bool:
        """Return whether both timelines share one rope of events, because no edit between them has changed an event.
        Only references are compared.
        """
        return self._events is other._events

    def event(self, index: int) -> Event:
        """Return the event with an index, counted from 0. Raises IndexError."""
        if self._events is None or not 0 <= index < self.event_count:
            raise IndexError(index)
        found: Event = rope.item(self._events, index)
        return found

    def events_by(self, t: float, *, before: bool = False) -> int:
        """Return how many events there are up to time t [s], or (`before`) earlier than t."""
        return 0 if self._events is None else rope.count_by(self._events, t, before=before)

    def event_slice(self, first: int, last: int) -> Iterator[Event]:
        """Yield the events from index `first` up to, but not including, `last`."""
        return iter(()) if self._events is None else rope.events(self._events, first, last)

    def events_between(self, first: float, last: float) -> Iterator[Event]:
        """Yield the events from time `first` to time `last` [s], both included."""
        return self.event_slice(self.events_by(first, before=True), self.events_by(last))

    def event_after(self, t: float) -> Event | None:
        """Return the first event that is later than t [s]."""
        if self._events is None or t >= self._events.offset + self._events.node.end:
            return None
        return self.event(self.events_by(t))

    def value_at(self, channel: int, t: float) -> float:
        """Return the value of a channel at time t [s]: 0 until the first event that changes it. If several events
        happen at one instant, the last one counts.
        """
        if self._events is None:
            return 0.0
        found = rope.value_at(self._events, channel, t)
        return 0.0 if found is None else found

    def changes(self, channel: int) -> Iterator[tuple[float, float]]:
        """Yield the time [s] of each change of a channel, and its new value."""
        before = 0.0
        set_to = () if self._events is None else rope.changes(self._events, channel)
        for time, several in groupby(set_to, lambda change: change[0]):
            value = list(several)[-1][1]
            if value != before:
                yield time, value
            before = value

    def same_until(self, other: Timeline) -> float:
        """Return the time [s] until which two timelines are the same; infinity if they are completely the same."""
        index = rope.common(self._rope, other._rope)
        rows = (rope.columns(one._rope, index) for one in (self, other))
        since = inf
        for a, b in zip_longest(*rows):
            if a is None or b is None:
                since = (b or a)[0]
                break
            if a[2] is not b[2] or a[:2] != b[:2]:
                alike = a[2] is b[2] and a[0] == b[0]
                since = min(a[1], b[1]) if alike else min(a[0], b[0])
                break
        place, count = rope.common(self._events, other._events), min(self.event_count, other.event_count)
        while place < count and self.event(place) == other.event(place):
            place += 1
        return min([since, *[one.event(place).time for one in (self, other) if place < one.event_count]])

    # --- rows of the timeline ---

    @classmethod
    def of_parts(
        cls, parts: Iterable[OffsetNode[Row]], version: int, events: Iterable[OffsetNode[EventRow]] = ()
    ) -> Timeline:
        """Make a timeline from the leaves of its ropes, each with the offset of its times.

        Raises ValueError if there are no leaves of segments.
        """
        made = rope.root(list(parts))
        if made is None:
            raise ValueError("a timeline has at least one segment")
        return cls._of_ropes(made, rope.root(list(events)), version)

    @classmethod
    def _of_ropes(
        cls, held: OffsetNode[Row], events: OffsetNode[EventRow] | None, version: int, world: WorldState | None = None
    ) -> Timeline:
        timeline = cls.__new__(cls)
        timeline._rope, timeline._events, timeline.version, timeline.world = held, events, version, world
        timeline._read = {}
        return timeline

    def parts(self, index: int = 0) -> Iterator[tuple[int, float, Leaf[Row]]]:
        """Yield the leaves of the segment tree, starting with the one that contains segment number `index`. Each is
        yielded with the number of its first segment and the offset of its times [s].
        """
        return rope.parts(self._rope, index)

    def event_parts(self, index: int = 0) -> Iterator[tuple[int, float, Leaf[EventRow]]]:
        """Yield the leaves of the event tree, starting with the one that contains event number `index`. Each is yielded
        with the number of its first event and the offset of its times [s].
        """
        return iter(()) if self._events is None else rope.parts(self._events, index)

    def row_with(self, segments: Row, index: int) -> tuple[Row, int]:
        """Return a row in memory that already contains these segments, as the segments of the timeline that begin with
        number `index`, and the index of the first of them in that row. If there is no such row, return `segments` and
        0.
        """
        for number, _, leaf in islice(self.parts(index), 1 if segments else 0):
            place = leaf.first + index - number
            if not leaf.row.away and leaf.row.same_columns(place, segments):
                return leaf.row, place
        return segments, 0

    def pack_motions(self, index: int, count: int, made: dict[int, PackedMotion]) -> None:
        """Pack the motions of `count` segments that are in memory, from number `index` on; `made` as for a row."""
        for number, _, leaf in self.parts(index):
            first, last = (leaf.first + max(place - number, 0) for place in (index, index + count))
            if last <= leaf.first:
                return
            if not leaf.row.away:
                leaf.row.pack_motions(first, min(last, leaf.last), made)

    def in_rows(self, most: int) -> Timeline:
        """Return the same timeline with at most `most` segments in each row that is in memory."""
        return self._of_ropes(rope.in_rows(self._rope, most), self._events, self.version, self.world)

    # --- changing: a new version ---

    def apply(self, delta: TimelineDelta) -> Timeline:
        """Return tau[k+1]. Raises ValueError if the delta was made for another version, or leaves no segment."""
        if delta.version != self.version:
            raise ValueError(f"a delta of version {delta.version} does not fit timeline version {self.version}")
        if self._is_of_events(delta):
            return self._of_ropes(self._rope, self._with_events(delta.events), self.version + 1, self.world)
        keep, new = delta.keep, delta.segments
        last = self[keep - 1] if keep else None
        if last is not None and last.finish > delta.cut:
            keep, new = keep - 1, (last.truncate(delta.cut), *new)
        made = rope.splice(self._rope, keep, delta.keep + delta.drop, new, delta.shift)
        if made is None:
            raise ValueError("the delta leaves a timeline without segments")
        return self._of_ropes(made, self._with_events(delta.events), self.version + 1, self.world)

    def append(self, segments: Sequence[Segment], version: int) -> Timeline:
        """Return a timeline with the given version number, more segments at its end, and the same events."""
        made = rope.splice(self._rope, len(self), len(self), segments, 0.0)
        assert made is not None, "no segment was dropped"
        return self._of_ropes(made, self._events, version, self.world)

    def _is_of_events(self, delta: TimelineDelta) -> bool:
        """Return whether a delta leaves all segments as they are."""
        return delta.keep == len(self) and not delta.segments and not delta.shift and delta.cut >= self.end

    def _with_events(self, edit: EventEdit | None) -> OffsetNode[EventRow] | None:
        if edit is None:
            return self._events
        if self._events is None:
            return rope.rope_of(EventRow(edit.events))
        return rope.splice(self._events, edit.keep, edit.keep + edit.drop, edit.events, edit.shift)

    def inverse(self, delta: TimelineDelta) -> TimelineDelta:
        """Return the delta that reverses `delta`. `self` is the timeline before `delta`; the result applies to the
        timeline after `delta`.
        """
        edit, events = delta.events, None
        if edit is not None:
            gone = tuple(self.event(index) for index in range(edit.keep, edit.keep + edit.drop))
            events = EventEdit(edit.keep, len(edit.events), 0.0 - edit.shift, gone)
        if self._is_of_events(delta):
            return structs.replace(
                delta, version=self.version + 1, cause=Cause.UNDO, shift=0.0, segments=(), events=events
            )
        kept_whole = delta.keep
        if kept_whole and self[kept_whole - 1].finish > delta.cut:
            kept_whole -= 1  # the inverse restores the truncated segment
        return TimelineDelta(
            version=self.version + 1,
            cause=Cause.UNDO,
            motion=delta.motion,
            issued=delta.issued,
            executed=delta.executed,
            cut=self[kept_whole - 1].finish if kept_whole else self.start,
            keep=kept_whole,
            drop=delta.keep - kept_whole + len(delta.segments),
            shift=0.0 - delta.shift,  # avoids -0.0
            segments=tuple(self[index] for index in range(kept_whole, delta.keep + delta.drop)),
            events=events,
        )


class KeptDeltas(Protocol):
    """A place outside memory, such as a file, that holds deltas."""

    def read_deltas(self, first: int, last: int) -> Sequence[TimelineDelta]:
        """Read the deltas from number `first` up to, but not including, `last`. Raises FileError."""


class DeltaLog(Sequence[TimelineDelta]):
    """Deltas in order, in parts of PART deltas; the last part may have fewer.

    Each part is replaced in a single step, so that no delta is lost if Ctrl-C interrupts.
    """

    def __init__(self, deltas: Iterable[TimelineDelta] = ()) -> None:
        self._parts: list[list[TimelineDelta] | DeltaColumns | AwayDeltas] = [[]]
        self._away = 0  # number of parts that are not in memory
        self.extend(deltas)

    @classmethod
    def after(cls, kept: KeptDeltas, parts: int, deltas: Iterable[TimelineDelta]) -> DeltaLog:
        """Make a log that begins with `parts` stored parts and continues with the given deltas."""
        log = cls()
        log._parts, log._away = [*(AwayDeltas(kept, number) for number in range(parts)), []], parts
        log.extend(deltas)
        return log

    def copy(self) -> DeltaLog:
        """Return a new log with the same deltas; packed and stored parts are shared."""
        again = DeltaLog()
        again._parts = [part.copy() if isinstance(part, list) else part for part in self._parts]
        again._away = self._away
        return again

    def put_away(self, number: int, kept: KeptDeltas) -> None:
        """Drop from memory the parts of the log that end before the change (delta) with this number, but keep the last
        two parts. The dropped parts remain available in the store `kept`.
        """
        last = min(number // PART, len(self._parts) - UNPACKED_PARTS)
        for place in range(self._away, last):
            self._parts[place] = AwayDeltas(kept, place)
        self._away = max(self._away, last)

    # --- reading ---

    def __len__(self) -> int:
        return (len(self._parts) - 1) * PART + len(self._parts[-1])

    @overload
    def __getitem__(self, index: int) -> TimelineDelta: ...
    @overload
    def __getitem__(self, index: slice) -> list[TimelineDelta]: ...
    def __getitem__(self, index: int | slice) -> TimelineDelta | list[TimelineDelta]:
        if isinstance(index, slice):
            first, last, step = index.indices(len(self))
            return list(self._between(first, last))[::step] if step > 0 else [*self][index]
        at = self._place(index)
        return self._parts[at // PART][at % PART]

    def _between(self, first: int, last: int) -> Iterator[TimelineDelta]:
        """Yield the deltas from `first` up to, but not including, `last`; a stored part is read once."""
        for number in range(first // PART, -(-last // PART)):
            part, begin = self._parts[number], number * PART
            yield from islice(part, max(first - begin, 0), last - begin)

    def _place(self, index: int) -> int:
        at = index + len(self) if index < 0 else index
        if at < 0:
            raise IndexError(index)
        return at

    def __iter__(self) -> Iterator[TimelineDelta]:
        return chain.from_iterable(self._parts)

    # --- changing ---

    def extend(
        self, deltas: Iterable[TimelineDelta], timeline: Timeline | None = None
    ) -> list[tuple[DeltaColumns, list[TimelineDelta], dict[int, PackedMotion]]]:
        """Append deltas. `timeline`: the timeline after them, with which packed deltas can share rows. Return the parts
        that are now packed, each with its deltas and its packed motions.
        """
        packed = []
        for delta in deltas:
            last = self._parts[-1]
            assert isinstance(last, list)
            if len(last) < PART:
                last.append(delta)
                continue
            self._parts.append([delta])
            old = len(self._parts) - 1 - UNPACKED_PARTS
            if old >= 0 and isinstance(part := self._parts[old], list):
                motions: dict[int, PackedMotion] = {}
                self._parts[old] = columns = DeltaColumns(part, timeline, motions)
                packed.append((columns, part, motions))
        return packed

    def __setitem__(self, index: int, delta: TimelineDelta) -> None:
        """Replace one of the last two deltas: `index` is -1 or -2."""
        at = self._place(index)
        part = self._parts[at // PART]
        assert isinstance(part, list)
        part[at % PART] = delta


class DeltaColumns:
    """Deltas as columns of plain numbers. `version` is that of the first; the versions of the others follow it.
    `_firsts` has the index of the first segment of each delta.
    """

    __slots__ = (  # `_rest` has the columns of `drop` and `shift`; None if all are 0, as in steering
        *("version", "_causes", "_motions", "_which", "_issued", "_executed", "_cut", "_keep", "_rest"),
        *("_firsts", "_segments", "_events"),
    )

    def __init__(self, deltas: list[TimelineDelta], timeline: Timeline | None, packed: dict[int, PackedMotion]) -> None:
        """`timeline`: the timeline after the deltas, with which they share rows and packed motions. `packed`: as for
        `Row.pack_motions`.
        """
        self.version = deltas[0].version
        self._causes, which = [deltas[0].cause], []
        motions = [deltas[0].motion]
        for delta in deltas:  # store equal neighbouring causes and motions once: steering has many
            if delta.motion is not motions[-1] or delta.cause is not self._causes[-1]:
                self._causes.append(delta.cause)
                motions.append(delta.motion)
            which.append(len(self._causes) - 1)
        self._which = bytes(which)
        segments = Row(chain.from_iterable(delta.segments for delta in deltas))
        segments.pack(len(segments))
        self._segments, first = segments, 0
        if timeline is not None:
            self._segments, first = timeline.row_with(segments, deltas[0].keep)
            timeline.pack_motions(deltas[0].keep, len(segments), packed)
        self._segments.pack_motions(first, first + len(segments), packed)
        self._motions = [packed.get(id(motion), motion) for motion in motions]
        self._firsts = array("I", accumulate([len(delta.segments) for delta in deltas], initial=first))
        self._issued = _reuse_equal(segments.starts, array("d", [delta.issued for delta in deltas]))
        self._executed = _reuse_equal(self._issued, array("d", [delta.executed for delta in deltas]))
        self._cut = _reuse_equal(self._executed, array("d", [delta.cut for delta in deltas]))
        self._keep = array("q", [delta.keep for delta in deltas])
        drops, shifts = [delta.drop for delta in deltas], [delta.shift for delta in deltas]
        self._rest = (array("I", drops), array("d", shifts)) if any(drops) or any(shifts) else None
        self._events = {place: delta.events for place, delta in enumerate(deltas) if delta.events is not None} or None

    def __len__(self) -> int:
        return len(self._which)

    def __iter__(self) -> Iterator[TimelineDelta]:
        return map(self.__getitem__, range(len(self)))

    def __getitem__(self, index: int) -> TimelineDelta:
        which, motion = self._which[index], self.motion(index)
        drop, shift = (self._rest[0][index], self._rest[1][index]) if self._rest else (0, 0.0)
        return TimelineDelta(
            self.version + index,
            self._causes[which],
            motion.unpack() if isinstance(motion, PackedMotion) else motion,
            self._issued[index],
            self._executed[index],
            self._cut[index],
            self._keep[index],
            drop,
            shift,
            self.segments(index),
            None if self._events is None else self._events.get(index),
        )

    def motion(self, index: int) -> Motion | PackedMotion:
        return self._motions[self._which[index]]

    def segments(self, index: int) -> Sequence[Segment]:
        """Return the segments of a delta as a sequence that creates the segment objects when they are read."""
        return PackedSegments(self, index) if self._firsts[index] < self._firsts[index + 1] else ()

    def unpack(self, index: int) -> tuple[Segment, ...]:
        """Make the segments of a delta."""
        return tuple(self._segments.between(*self._firsts[index : index + 2]))


class PackedSegments(Sequence[Segment]):
    """The segments of a packed delta, as a sequence that creates a segment object at each access."""

    __slots__ = ("_columns", "_index")

    def __init__(self, columns: DeltaColumns, index: int) -> None:
        self._columns, self._index = columns, index

    def __len__(self) -> int:
        return len(self._columns.unpack(self._index))

    def __getitem__(self, index: Any) -> Any:
        return self._columns.unpack(self._index)[index]

    def __iter__(self) -> Iterator[Segment]:
        return iter(self[:])

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Sequence) and self[:] == tuple(other)

    def __repr__(self) -> str:
        return repr(self[:])

    __hash__ = None  # type: ignore[assignment]  # not hashable: a delta is never a dictionary key


class AwayDeltas:
    """A part of a log that is in the store and not in memory."""

    __slots__ = ("_kept", "_number")

    def __init__(self, kept: KeptDeltas, number: int) -> None:
        self._kept, self._number = kept, number

    def _read(self) -> Sequence[TimelineDelta]:
        return self._kept.read_deltas(self._number * PART, (self._number + 1) * PART)

    def __len__(self) -> int:
        return PART

    def __iter__(self) -> Iterator[TimelineDelta]:
        return iter(self._read())

    def __getitem__(self, index: int) -> TimelineDelta:
        return self._read()[index]


def _reuse_equal(known: array[float], column: array[float]) -> array[float]:
    """Return the column `known` if it is equal, to save memory: in steering the columns often are."""
    return known if column == known else column
