"""Events as columns of plain numbers: the rows of the second rope of a timeline.

The rope is of the same kind as that of the segments, so that an edit shifts any number of events by changing a few
nodes. A row knows where each channel changes.
"""

from __future__ import annotations

from array import array
from collections.abc import Iterable, Iterator, Sequence
from typing import overload

from vrs_cli.trajectory.row import later
from vrs_cli.values.events import Event

TIED, OBSERVED = 1, 2  # bits of a flag


class EventRow(Sequence[Event]):
    """Events with the times that they were made with, in order. It grows at its end and nowhere else.

    `flags`: TIED, OBSERVED. `places`: where each channel changes (observations change nothing). `closed`: it does not
    grow any more. `kept`: where it is written down.
    """

    __slots__ = ("channels", "closed", "durations", "flags", "kept", "numbers", "places", "starts", "values")

    def __init__(self, events: Iterable[Event] = ()) -> None:
        self.starts, self.values, self.durations = array("d"), array("d"), array("d")
        self.channels, self.numbers = array("i"), array("q")
        self.flags = bytearray()
        self.places: dict[int, array[int]] = {}
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
        rows = list(events)
        self._put(
            array("d", [event.time for event in rows]),
            array("i", [event.channel for event in rows]),
            array("d", [event.value for event in rows]),
            array("q", [event.number for event in rows]),
            array("d", [event.duration for event in rows]),
            bytes([TIED * event.tied | OBSERVED * event.observed for event in rows]),
        )

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
        for place, channel in enumerate(channels, count):
            if not flags[place - count] & OBSERVED:
                places = self.places.get(channel)
                if places is None:
                    places = self.places[channel] = array("q")
                while places and places[-1] >= place:
                    places.pop()
                places.append(place)
        self.flags.extend(flags)
