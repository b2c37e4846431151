"""Events as columns of plain numbers: the rows of the second rope of a timeline.

The rope is of the same kind as that of the segments, so that an edit shifts any number of events by changing a few
nodes. A row knows where each channel changes.
"""

from __future__ import annotations

from array import array
from collections.abc import Iterable, Iterator, Sequence
from threading import Lock
from typing import overload

from vrs_cli.trajectory.row import later
from vrs_cli.values.commands import Event

TIED, OBSERVED = 1, 2  # bits of a flag
NOWHERE = array("q")
COLUMNS = ("starts", "values", "durations", "channels", "numbers", "flags")
_INDEXING = Lock()


class EventRow(Sequence[Event]):
    """Events with the times that they were made with, in order. It grows at its end and nowhere else.

    `flags`: TIED, OBSERVED. `closed`: it does not grow any more. `kept`: where it is written down. Where each channel
    changes is found when somebody asks (observations change nothing).
    """

    __slots__ = (
        *("channels", "closed", "durations", "flags", "kept", "numbers", "starts", "values"),
        *("_indexed", "_places"),
    )

    def __init__(self, events: Iterable[Event] = ()) -> None:
        self.starts, self.values, self.durations = array("d"), array("d"), array("d")
        self.channels, self.numbers = array("i"), array("q")
        self.flags = bytearray()
        self._places: dict[int, array[int]] = {}
        self._indexed = 0  # events
        self.closed = False
        self.kept: int | None = None
        self.grow(events)

    @property
    def finishes(self) -> array[float]:
        """The ends of the rows of a rope [s]: an event ends when it begins."""
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
        """The events from `first` to before `last`."""
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

    def edited(self, begin: int, first: int, new: Sequence[Event], last: int, end: int) -> EventRow:
        """Return a row of the events from `begin` to before `first`, of `new` ones, and of those from `last` to before
        `end`: at a random place of a long timeline that costs less than to split and merge leaves.
        """
        row = EventRow(new)
        for name in COLUMNS:
            column = getattr(self, name)
            made = column[begin:first]
            made.extend(getattr(row, name))
            made.extend(column[last:end])
            setattr(row, name, made)
        return row

    def take(self, other: EventRow, first: int, last: int, shift: float) -> None:
        """Append events of another row, from `first` to before `last`, shifted by `shift` [s]."""
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
        """Append columns. Ctrl-C may have interrupted an earlier append: `flags`, which grow last, tell the length."""
        count = len(self.flags)
        self.starts[count:] = starts
        self.channels[count:] = channels
        self.values[count:] = values
        self.numbers[count:] = numbers
        self.durations[count:] = durations
        self.flags.extend(flags)

    # --- where channels change ---

    def places(self, channel: int) -> array[int]:
        """The places of the events that change a channel. Any thread may ask."""
        if self._indexed < len(self.flags):
            self._index()
        return self._places.get(channel, NOWHERE)

    def changed(self) -> tuple[int, ...]:
        """The channels that events of the row change."""
        self.places(0)
        return tuple(self._places)

    def _index(self) -> None:
        """Note the places of the events that have come since the last time."""
        with _INDEXING:
            count = len(self.flags)
            for place in range(self._indexed, count):
                if self.flags[place] & OBSERVED:
                    continue
                places = self._places.setdefault(self.channels[place], array("q"))
                while places and places[-1] >= place:  # Ctrl-C has interrupted an earlier time
                    places.pop()
                places.append(place)
            self._indexed = count
