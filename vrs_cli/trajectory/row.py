"""A row of segments as columns of plain numbers, side by side in memory: what the leaves of a rope are parts of.

A segment is made when somebody asks for one; g reads the columns as they are. A row grows at its end and nowhere else.
The paths are shared with whoever else knows them (other rows, deltas, UNDO); those that are far from the end of a row
are packed, for they are seldom read: an hour of steering has 180,000. A row that is written down elsewhere may leave
memory: it is read back when somebody asks for it, in every timeline that has a part of it.
"""

from __future__ import annotations

from array import array
from collections.abc import Iterable, Iterator, Sequence
from typing import Any, Protocol, overload

from vrs_cli.trajectory.segment import JointPath, Path, Phase, Segment
from vrs_cli.values.motion import Motion

YOUNG = 256  # segments at the end of a row whose paths are as they were made
PHASES = tuple(Phase)
CODES = {phase: code for code, phase in enumerate(PHASES)}


COLUMNS = ("finishes", "motions", "paths", "phases", "starts", "tables")


class RowStore(Protocol):
    """Where a row is written down."""

    def read(self) -> Row:
        """The same row, to the bit. Raises FileError."""


class Row(Sequence[Segment]):
    """Segments with the times they were made with, in order. `phases`: their places in PHASES. `tables`: what others
    have made of blocks of them, to keep as long as the row. `closed`: it does not grow any more. `kept`: where it is
    written down; `away`: there alone.
    """

    __slots__ = (*COLUMNS, "_count", "_packed", "away", "closed", "kept")

    def __init__(self, segments: Iterable[Segment] = ()) -> None:
        self.starts, self.finishes = array("d"), array("d")
        self.paths: list[Path] = []
        self.phases = bytearray()
        self.motions: list[Motion] = []
        self.tables: dict[int, Any] = {}
        self._packed = self._count = 0
        self.closed = self.away = False
        self.kept: RowStore | None = None
        self.grow(segments)

    # --- leaving memory ---

    @classmethod
    def kept_at(cls, kept: RowStore, count: int) -> Row:
        """A row of so many segments that is written down, and not in memory."""
        row = cls()
        row.closed, row.kept, row._count = True, kept, count
        row.put_away()
        return row

    def close(self) -> None:
        """Let it grow no more; its paths are packed."""
        self.closed = True
        self.pack(len(self))

    def put_away(self) -> None:
        """Let a row that is written down leave memory. Readers in other threads may be in the middle of it."""
        self._count = len(self) or self._count
        self.away = True
        for column in COLUMNS:
            delattr(self, column)

    def __getattr__(self, name: str) -> Any:
        """A column that is not in memory."""
        if name not in COLUMNS or self.kept is None:
            raise AttributeError(name)
        return getattr(self.kept.read(), name)

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
        return Segment(
            self.starts[index],
            self.finishes[index],
            self.paths[index],
            PHASES[self.phases[index]],
            self.motions[index],
        )

    def __iter__(self) -> Iterator[Segment]:
        return self.between(0, len(self))

    def between(self, first: int, last: int) -> Iterator[Segment]:
        """The segments from `first` to before `last`."""
        phases = map(PHASES.__getitem__, self.phases[first:last])
        columns = self.starts[first:last], self.finishes[first:last], self.paths[first:last], phases
        return map(Segment, *columns, self.motions[first:last])

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
        """Put segments of another row behind, from `first` to before `last`, later by `shift` [s]."""
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
        motions: list[Motion],
    ) -> None:
        """In the place of what Ctrl-C may have left of columns that were growing: the last tells how long they are."""
        count = len(self.motions)
        self.starts[count:] = starts
        self.finishes[count:] = finishes
        self.paths[count:] = paths
        self.phases[count:] = phases
        self.motions.extend(motions)
        if len(self.motions) - self._packed >= 2 * YOUNG:
            self.pack(len(self.motions) - YOUNG)

    def pack(self, last: int) -> None:
        """Pack the paths of the segments before `last`."""
        for path in self.paths[self._packed : last]:
            if isinstance(path, JointPath):
                path.pack()
        self._packed = last


def later(times: array[float], shift: float) -> array[float]:
    return array("d", [t + shift for t in times]) if shift else times
