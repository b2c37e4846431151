"""Rows of segments and rows of events, as columns of plain numbers side by side in memory. The leaves of a rope are
parts of rows.

A segment object is made only on demand; the position function g reads the columns directly. A row grows only at its
end. Paths are shared with other rows, deltas and UNDO. Paths far from the end of a row are packed, since they are
seldom read: an hour of steering has 180,000 segments. Motions are packed after old deltas have been stored as parts of
the row. A row that is stored elsewhere may be removed from memory. It is read back on demand, for every timeline that
has a part of it.

To evaluate the timeline at many times at once, a block of a row is converted to a table of arrays. The table is made
when the block is first needed in this form, and kept with the row. Rows are shared by all versions of a timeline that
have a part of them, so after an edit only the new part must be converted.

Events are in a second rope of the timeline, of the same kind, so an edit shifts any number of events by changing a few
nodes. A row of events also has an index of the changes of each channel.
"""

from __future__ import annotations

from array import array
from collections.abc import Iterable, Iterator, Sequence
from itertools import compress
from typing import TYPE_CHECKING, Any, Protocol, overload

from msgspec import Struct

from vrs_cli.trajectory.segment import DOUBLE_BYTES, JointPath, PackedMotion, Path, Phase, Segment
from vrs_cli.values.commands import Frames, Motion

if TYPE_CHECKING:
    from vrs_cli.kinematics.arrays import Flags, Floats, Rows
from threading import Lock

from vrs_cli.values.commands import Event

UNPACKED_SEGMENTS = 256  # number of segments at the end of a row whose paths are not packed
PHASES = tuple(Phase)
CODES = {phase: code for code, phase in enumerate(PHASES)}
COLUMNS = ("finishes", "motions", "paths", "phases", "starts", "tables")


class RowStore(Protocol):
    """A place outside memory, such as a file, that holds a row."""

    def read(self) -> Row:
        """Return the row, bit for bit as it was stored. Raises FileError."""


class Row(Sequence[Segment]):
    """Segments in order, with the times at which they were first stored; the rope that uses the row shifts them.
    `phases`: the phase of each segment as an index in PHASES. `tables`: tables of blocks, kept as long as the row.
    `closed`: the row no longer grows. `stored_at`: the store that holds the row; None if only memory holds it. `away`:
    the row is not in memory.
    """

    __slots__ = (*COLUMNS, "_count", "_packed", "away", "closed", "stored_at")

    def __init__(self, segments: Iterable[Segment] = ()) -> None:
        self.starts, self.finishes = array("d"), array("d")
        self.paths: list[Path] = []
        self.phases = bytearray()
        self.motions: list[Motion | PackedMotion] = []
        self.tables: dict[int, Any] = {}
        self._packed = self._count = 0
        self.closed = self.away = False
        self.stored_at: RowStore | None = None
        self.grow(segments)

    # --- moving the row out of memory ---

    @classmethod
    def in_store(cls, store: RowStore, count: int) -> Row:
        """Make a row of `count` segments that is in a store and not in memory."""
        row = cls()
        row.closed, row.stored_at, row._count = True, store, count
        row.put_away()
        return row

    def close(self) -> None:
        """Close the row, so that it does not grow any more, and pack its paths."""
        self.closed = True
        self.pack(len(self))

    def put_away(self) -> None:
        """Remove a stored row from memory. Other threads may be reading the row; they then read its columns from the
        store.
        """
        self._count = len(self) or self._count
        self.away = True
        for column in COLUMNS:
            delattr(self, column)

    def __getattr__(self, name: str) -> Any:
        """Read a column that is not in memory."""
        if name not in COLUMNS or self.stored_at is None:
            raise AttributeError(name)
        return getattr(self.stored_at.read(), name)

    # --- reading ---

    def __len__(self) -> int:
        return self._count if self.away else len(self.motions)

    @overload
    def __getitem__(self, index: int) -> Segment: ...
    @overload
    def __getitem__(self, index: slice) -> list[Segment]: ...
    def __getitem__(self, index: int | slice) -> Segment | list[Segment]:
        if isinstance(index, slice):
            return list(self.between(*index.indices(len(self))[:2]))
        motion = self.motions[index]
        return Segment(
            self.starts[index],
            self.finishes[index],
            self.paths[index],
            PHASES[self.phases[index]],
            motion.unpack() if isinstance(motion, PackedMotion) else motion,
        )

    def __iter__(self) -> Iterator[Segment]:
        return self.between(0, len(self))

    def between(self, first: int, last: int) -> Iterator[Segment]:
        """Yield the segments from `first` up to, but not including, `last`."""
        phases = map(PHASES.__getitem__, self.phases[first:last])
        columns = self.starts[first:last], self.finishes[first:last], self.paths[first:last], phases
        return map(Segment, *columns, _unpack(self.motions[first:last]))

    # --- growing ---

    def grow(self, segments: Iterable[Segment]) -> None:
        rows = list(segments)
        self._put(
            array("d", [segment.start for segment in rows]),
            array("d", [segment.finish for segment in rows]),
            [segment.path for segment in rows],
            bytes([CODES[segment.phase] for segment in rows]),
            [segment.motion for segment in rows],
        )

    def take(self, other: Row, first: int, last: int, shift: float) -> None:
        """Append segments of another row, from `first` up to, but not including, `last`, shifted by `shift` [s]."""
        self._put(
            later(other.starts[first:last], shift),
            later(other.finishes[first:last], shift),
            other.paths[first:last],
            other.phases[first:last],
            other.motions[first:last],
        )

    def _put(
        self,
        starts: array[float],
        finishes: array[float],
        paths: list[Path],
        phases: bytes | bytearray,
        motions: Sequence[Motion | PackedMotion],
    ) -> None:
        """Append columns. `motions` grows last, so its length is the number of complete segments: entries of other
        columns beyond it are left over from an append that Ctrl-C has interrupted, and are overwritten.
        """
        count = len(self.motions)
        self.starts[count:] = starts
        self.finishes[count:] = finishes
        self.paths[count:] = paths
        self.phases[count:] = phases
        self.motions.extend(motions)
        if len(self.motions) - self._packed >= 2 * UNPACKED_SEGMENTS:
            self.pack(len(self.motions) - UNPACKED_SEGMENTS)

    def pack(self, last: int) -> None:
        """Pack the paths of the segments before `last`."""
        for path in self.paths[self._packed : last]:
            if isinstance(path, JointPath) and not path.packed_length:
                path.pack()
        self._packed = last

    def pack_motions(self, first: int, last: int, made: dict[int, PackedMotion]) -> None:
        """Pack the motions that have a goal, from index `first` up to, but not including, `last`. `made`: the packed
        motions by the `id` of the original motions, to which new ones are added.
        """
        for place, motion in enumerate(self.motions[first:last], first):
            if isinstance(motion, Motion) and motion.goal is not None:
                if id(motion) not in made:
                    made[id(motion)] = PackedMotion.of(motion, next(reversed(made.values()), None))
                self.motions[place] = made[id(motion)]

    def same_columns(self, place: int, other: Row) -> bool:
        """Return whether the segments of this row that begin at index `place` equal those of another row, with the same
        path and motion objects.
        """
        part = slice(place, place + len(other))
        return (
            (self.starts[part], self.finishes[part]) == (other.starts, other.finishes)
            and self.phases[part] == other.phases
            and _identities(self.paths[part]) == _identities(other.paths)
            and _identities(self.motions[part]) == _identities(other.motions)
        )


def _unpack(motions: Iterable[Motion | PackedMotion]) -> Iterator[Motion]:
    """Unpack motions; successive references to one packed motion give one motion object."""
    packed = None
    for motion in motions:
        if not isinstance(motion, PackedMotion):
            yield motion
            continue
        if motion is not packed:
            packed, found = motion, motion.unpack()
        yield found


def _identities(values: Iterable[object]) -> list[int]:
    return list(map(id, values))


def later(times: array[float], shift: float) -> array[float]:
    """Return the times, shifted by `shift` [s]."""
    return array("d", [t + shift for t in times]) if shift else times


class BlockTable(Struct, frozen=True):
    """A block of a row as arrays: m segments of n joints, from index `first` of the row on. `starts`, `finishes`,
    `durations` (m,) [s]; `coefficients` (k, m, n) by ascending power.

    `straight` and `resting` (m,): whether each segment is straight or at rest; a straight segment has coefficients of
    zero. `frame_number` (m,): the index in `frames` of each segment's frames. Times are as stored in the row, without
    shifts.
    """

    row: Row
    first: int
    starts: Floats
    finishes: Floats
    durations: Floats
    coefficients: Floats
    straight: Flags
    resting: Flags
    frames: tuple[Frames, ...]
    frame_number: Rows

    def segment(self, place: int) -> Segment:
        return self.row[self.first + place]

    def locate(self, times: Floats, offset: float, part: slice) -> tuple[Rows, Floats]:
        """For each time (N,), return the index of the active segment in the slice `part` of the block, and the time
        since the segment began [s], at most its duration. The segments begin `offset` [s] later than their stored
        times.

        The start is subtracted from the time, so the result does not depend on the offset.
        """
        import numpy as np

        starts = self.starts[part] + offset  # exact: both are on the time grid
        places = starts.searchsorted(times, side="right") - 1
        np.maximum(places, 0, out=places)
        s = times - starts.take(places)
        places += part.start
        np.minimum(s, self.durations.take(places), out=s)
        return places, np.maximum(s, 0.0, out=s)

    def joints(self, places: Rows, s: Floats, out: Floats) -> None:
        """Store in `out` the joints (N, n), s seconds (N,) into the segments at `places` (N,)."""
        t = s[:, None]
        out[:] = self.coefficients[-1].take(places, axis=0)
        for power in self.coefficients[-2::-1]:  # Horner's rule
            out *= t
            out += power.take(places, axis=0)

    def rates(self, places: Rows, s: Floats) -> tuple[Floats, Floats]:
        """Return velocity and acceleration (N, n), s seconds (N,) into the segments at `places` (N,)."""
        import numpy as np

        t = s[:, None]
        qd = np.zeros((len(s), self.coefficients.shape[2]))
        qdd = np.zeros_like(qd)
        for power in range(len(self.coefficients) - 1, 0, -1):  # Horner's rule for both derivatives at once
            qdd *= t
            qdd += qd
            qd *= t
            qd += power * self.coefficients[power].take(places, axis=0)
        return qd, qdd


def table_of(row: Row, first: int, last: int) -> BlockTable:
    """Make the table of the segments of a row from `first` up to, but not including, `last`, or up to the end of the
    row.
    """
    import numpy as np

    last = min(last, len(row))
    starts, motions, paths = np.array(row.starts[first:last]), row.motions[first:last], row.paths[first:last]
    finishes = np.array(row.finishes[first:last])
    frames = tuple(dict.fromkeys(motion.frames for motion in motions))
    number = {frame: count for count, frame in enumerate(frames)}
    return BlockTable(
        row,
        first,
        starts,
        finishes,
        finishes - starts,
        *coefficients(paths),
        np.frombuffer(bytes(row.phases[first:last]), np.uint8) == CODES[Phase.REST],
        frames,
        np.array([number[motion.frames] for motion in motions]),
    )


def coefficients(paths: Sequence[Path]) -> tuple[Floats, Flags]:
    """Return the coefficients of paths, (k, m, n) by ascending power, and whether each path is straight (m,). The
    coefficients of a straight path are zero.
    """
    import numpy as np

    joint_count = paths[0].joint_count
    found = [path.doubles() if isinstance(path, JointPath) else b"" for path in paths]
    lengths = np.fromiter(map(len, found), int, len(found)) // (DOUBLE_BYTES * joint_count)
    table = np.zeros((max(lengths.max(), 1), len(paths), joint_count))
    for length in filter(None, set(lengths.tolist())):
        there = lengths == length
        doubles = np.frombuffer(b"".join(compress(found, there.tolist())))
        table[:length, there] = doubles.reshape(-1, joint_count, length).transpose(2, 0, 1)
    return table, lengths == 0


TIED, OBSERVED = 1, 2  # bits of an event's flags: it moves with its motion; it records a value that was read
NOWHERE = array("q")
EVENT_COLUMNS = ("starts", "values", "durations", "channels", "numbers", "flags")
_INDEXING = Lock()


class EventRow(Sequence[Event]):
    """Events in order, with the times at which they were first stored. The row grows only at its end.

    `flags`: the bits TIED and OBSERVED of each event. `closed`: the row no longer grows. `stored_at`: the position of
    the row in the journal; None if it is not stored. The changes of each channel are indexed on demand; observations
    change no channel.
    """

    __slots__ = (
        *("channels", "closed", "durations", "flags", "stored_at", "numbers", "starts", "values"),
        *("_indexed", "_places"),
    )

    def __init__(self, events: Iterable[Event] = ()) -> None:
        self.starts, self.values, self.durations = array("d"), array("d"), array("d")
        self.channels, self.numbers = array("i"), array("q")
        self.flags = bytearray()
        self._places: dict[int, array[int]] = {}
        self._indexed = 0  # number of indexed events
        self.closed = False
        self.stored_at: int | None = None
        self.grow(events)

    @property
    def finishes(self) -> array[float]:
        """The end times of the events [s], which are their start times: on the rope an event is an instant."""
        return self.starts

    def __len__(self) -> int:
        return len(self.flags)

    @overload
    def __getitem__(self, index: int) -> Event: ...
    @overload
    def __getitem__(self, index: slice) -> list[Event]: ...
    def __getitem__(self, index: int | slice) -> Event | list[Event]:
        if isinstance(index, slice):
            return list(self.between(*index.indices(len(self))[:2]))
        flag = self.flags[index]
        return Event(
            self.starts[index],
            self.channels[index],
            self.values[index],
            self.numbers[index],
            bool(flag & TIED),
            self.durations[index],
            bool(flag & OBSERVED),
        )

    def between(self, first: int, last: int) -> Iterator[Event]:
        """Yield the events from `first` up to, but not including, `last`."""
        return map(self.__getitem__, range(first, last))

    def grow(self, events: Iterable[Event]) -> None:
        columns = tuple(zip(*events, strict=True))
        if columns:
            times, channels, values, numbers, tied, durations, observed = columns
            flags = bytes([TIED * follows | OBSERVED * read for follows, read in zip(tied, observed, strict=True)])
            self._put(
                array("d", times),
                array("i", channels),
                array("d", values),
                array("q", numbers),
                array("d", durations),
                flags,
            )

    def with_edit(self, begin: int, first: int, new: Sequence[Event], last: int, end: int) -> EventRow:
        """Return a new row with the events from index `begin` to `end`, in which `new` events replace those from
        `first` to `last` (each end index is excluded). For one edit in a long timeline, this copy costs less than
        splitting and merging leaves.
        """
        row = EventRow(new)
        for name in EVENT_COLUMNS:
            column = getattr(self, name)
            made = column[begin:first]
            made.extend(getattr(row, name))
            made.extend(column[last:end])
            setattr(row, name, made)
        return row

    def take(self, other: EventRow, first: int, last: int, shift: float) -> None:
        """Append events of another row, from `first` up to, but not including, `last`, shifted by `shift` [s]."""
        self._put(
            later(other.starts[first:last], shift),
            other.channels[first:last],
            other.values[first:last],
            other.numbers[first:last],
            other.durations[first:last],
            other.flags[first:last],
        )

    def _put(
        self,
        starts: array[float],
        channels: array[int],
        values: array[float],
        numbers: array[int],
        durations: array[float],
        flags: bytes | bytearray,
    ) -> None:
        """Append columns. `flags` grows last, so its length is the number of complete events: entries of other columns
        beyond it are left over from an append that Ctrl-C has interrupted, and are overwritten.
        """
        count = len(self.flags)
        self.starts[count:] = starts
        self.channels[count:] = channels
        self.values[count:] = values
        self.numbers[count:] = numbers
        self.durations[count:] = durations
        self.flags.extend(flags)

    # --- changes of channels ---

    def places(self, channel: int) -> array[int]:
        """Return the indices of the events that change a channel. Any thread may call it."""
        if self._indexed < len(self.flags):
            self._index()
        return self._places.get(channel, NOWHERE)

    def changed_channels(self) -> tuple[int, ...]:
        """Return the channels that events of the row change."""
        self.places(0)
        return tuple(self._places)

    def _index(self) -> None:
        """Index the events that were added since the last call."""
        with _INDEXING:
            count = len(self.flags)
            for place in range(self._indexed, count):
                if self.flags[place] & OBSERVED:
                    continue
                places = self._places.setdefault(self.channels[place], array("q"))
                while places and places[-1] >= place:  # indexed by an earlier call that Ctrl-C interrupted
                    places.pop()
                places.append(place)
            self._indexed = count
