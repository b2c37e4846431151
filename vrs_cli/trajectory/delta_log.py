"""All deltas of a timeline, one for each version: old ones as columns of plain numbers, or written down elsewhere."""

from __future__ import annotations

from array import array
from collections.abc import Iterable, Iterator, Sequence
from itertools import accumulate, chain
from typing import Protocol, overload

from vrs_cli.trajectory.row import Row
from vrs_cli.trajectory.timeline import TimelineDelta

PART = 128  # deltas
YOUNG = 2  # parts that are as they came: the last one, which grows, and the one before it


class KeptDeltas(Protocol):
    """Where deltas are written down."""

    def read_deltas(self, first: int, last: int) -> Sequence[TimelineDelta]:
        """The deltas from number `first` to before `last`. Raises FileError."""


class DeltaLog(Sequence[TimelineDelta]):
    """Deltas in order, in parts of PART, the last one of fewer.

    A part takes the place of another in one step, so that Ctrl-C leaves the same deltas.
    """

    def __init__(self, deltas: Iterable[TimelineDelta] = ()) -> None:
        self._parts: list[list[TimelineDelta] | DeltaColumns | AwayDeltas] = [[]]
        self._away = 0  # parts that have left memory
        self.extend(deltas)

    @classmethod
    def after(cls, kept: KeptDeltas, parts: int, deltas: Iterable[TimelineDelta]) -> DeltaLog:
        """So many parts that are written down, and the deltas after them."""
        log = cls()
        log._parts, log._away = [*(AwayDeltas(kept, number) for number in range(parts)), []], parts
        log.extend(deltas)
        return log

    def copy(self) -> DeltaLog:
        """The same deltas; what is compact is shared."""
        again = DeltaLog()
        again._parts = [part.copy() if isinstance(part, list) else part for part in self._parts]
        again._away = self._away
        return again

    def put_away(self, number: int, kept: KeptDeltas) -> None:
        """Let the parts wholly before delta `number` leave memory, but for the last two, which are as they came."""
        last = min(number // PART, len(self._parts) - YOUNG)
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
            return [self[at] for at in range(*index.indices(len(self)))]
        at = self._place(index)
        return self._parts[at // PART][at % PART]

    def _place(self, index: int) -> int:
        at = index + len(self) if index < 0 else index
        if at < 0:
            raise IndexError(index)
        return at

    def __iter__(self) -> Iterator[TimelineDelta]:
        return chain.from_iterable(self._parts)

    # --- changing ---

    def extend(self, deltas: Iterable[TimelineDelta]) -> None:
        for delta in deltas:
            last = self._parts[-1]
            assert isinstance(last, list)
            if len(last) < PART:
                last.append(delta)
            else:
                self._begin(delta)

    def _begin(self, delta: TimelineDelta) -> None:
        """Begin another part, and make columns of the one that is old now."""
        self._parts.append([delta])
        old = len(self._parts) - 1 - YOUNG
        if old >= 0 and isinstance(part := self._parts[old], list):
            self._parts[old] = DeltaColumns(part)

    def __setitem__(self, index: int, delta: TimelineDelta) -> None:
        """Put another delta in the place of one of the last: `index` is -1 or -2."""
        at = self._place(index)
        part = self._parts[at // PART]
        assert isinstance(part, list)
        part[at % PART] = delta


class DeltaColumns:
    """Deltas of versions that follow each other; the segments of one go from its `_firsts` to that of the next."""

    __slots__ = (  # `_rest`: `drop` and `shift`; None where they are 0, as in steering
        *("_version", "_causes", "_which", "_issued", "_executed", "_cut", "_keep", "_rest"),
        *("_firsts", "_segments"),
    )

    def __init__(self, deltas: list[TimelineDelta]) -> None:
        self._version = deltas[0].version
        self._causes = [(delta.cause, delta.motion) for delta in deltas[:1]]
        self._which = bytes(map(self._cause, deltas))
        self._segments = Row(chain.from_iterable(delta.segments for delta in deltas))
        self._segments.pack(len(self._segments))
        self._firsts = array("I", accumulate([len(delta.segments) for delta in deltas], initial=0))
        self._issued = _as(self._segments.starts, array("d", [delta.issued for delta in deltas]))
        self._executed = _as(self._issued, array("d", [delta.executed for delta in deltas]))
        self._cut = _as(self._executed, array("d", [delta.cut for delta in deltas]))
        self._keep = array("q", [delta.keep for delta in deltas])
        drops, shifts = [delta.drop for delta in deltas], [delta.shift for delta in deltas]
        self._rest = (array("I", drops), array("d", shifts)) if any(drops) or any(shifts) else None

    def _cause(self, delta: TimelineDelta) -> int:
        """The number of its cause and motion: those of the one before, in steering, or others."""
        cause, motion = self._causes[-1]
        if delta.motion is not motion or delta.cause is not cause:
            self._causes.append((delta.cause, delta.motion))
        return len(self._causes) - 1

    def __len__(self) -> int:
        return len(self._which)

    def __iter__(self) -> Iterator[TimelineDelta]:
        return map(self.__getitem__, range(len(self)))

    def __getitem__(self, index: int) -> TimelineDelta:
        first, last = self._firsts[index : index + 2]
        drop, shift = (self._rest[0][index], self._rest[1][index]) if self._rest else (0, 0.0)
        return TimelineDelta(
            self._version + index,
            *self._causes[self._which[index]],
            self._issued[index],
            self._executed[index],
            self._cut[index],
            self._keep[index],
            drop,
            shift,
            tuple(self._segments.between(first, last)),
        )


class AwayDeltas:
    """A part that is written down, and not in memory."""

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


def _as(known: array[float], column: array[float]) -> array[float]:
    """A column of numbers, as in steering, that often is one that is known."""
    return known if column == known else column
