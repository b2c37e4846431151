"""Events as columns of plain numbers: the rows of the second rope of a timeline.

The rope is of the same kind as that of the segments, so that an edit shifts any number of events by changing a few
nodes. A row knows where each channel changes.
"""

from __future__ import annotations

from array import array
from bisect import bisect_left
from collections.abc import Iterable, Iterator, Sequence
from typing import overload

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
        """Append events. Ctrl-C may have interrupted an earlier append: `flags`, which grow last, tell the length."""
        rows = list(events)
        count = len(self.flags)
        self.starts[count:] = array("d", [event.time for event in rows])
        self.channels[count:] = array("i", [event.channel for event in rows])
        self.values[count:] = array("d", [event.value for event in rows])
        self.numbers[count:] = array("q", [event.number for event in rows])
        self.durations[count:] = array("d", [event.duration for event in rows])
        for place, event in enumerate(rows, count):
            if not event.observed:
                places = self.places.setdefault(event.channel, array("q"))
                del places[bisect_left(places, place) :]
                places.append(place)
        self.flags.extend([TIED * event.tied | OBSERVED * event.observed for event in rows])

    def take(self, other: EventRow, first: int, last: int, shift: float) -> None:
        """Append events of another row, from `first` to before `last`, shifted by `shift` [s]."""
        self.grow(event.shifted(shift) for event in other.between(first, last))
