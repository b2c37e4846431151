"""The end of a long course of events, which stays in memory: what is older is written down, and read when asked for.

After each change a little of the past leaves memory: commands that UNDO would take back, deltas, and rows of segments.
From time to time a checkpoint is written, which says where all rows of the timeline are: whoever goes on with the file
reads it from there on.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

from msgspec import Struct

from vrs_cli.trajectory.delta_log import KeptDeltas
from vrs_cli.trajectory.rope import SMALL
from vrs_cli.trajectory.row import Row, RowStore
from vrs_cli.trajectory.timeline import Timeline, TimelineDelta

ROW = 128  # segments: a row of so many grows no more; after one change no row is written beyond them (3 ms of CPU)


class WindowSize(Struct, frozen=True):
    """How much stays in memory: commands and deltas of the last `changes`, and the last `segments`. `checkpoint`: after
    so many changes the next one is due.
    """

    changes: int = 512
    segments: int = 512
    checkpoint: int = 1024


class Store(KeptDeltas, Protocol):
    """Storage for the past. What cannot be written stays in memory."""

    def keep_row(self, row: Row) -> RowStore | None:
        """Write a row; None where that is not possible now."""

    def keep_checkpoint(self, timeline: Timeline, commands: int, number: int) -> bool:
        """Write where all rows of a timeline are; whether that was possible. `commands`: how many hold; `number`: of
        the last motion.
        """


class MemoryWindow:
    """The end of one course of events, which is all of it that is in memory. `checkpoint`: the version of the last."""

    def __init__(self, store: Store, reach: WindowSize, checkpoint: int = 0) -> None:
        self.store, self.reach, self._checkpoint = store, reach, checkpoint
        self._first = 0  # the segments before the one with this number are away

    def let_go(self, timeline: Timeline, deltas: Sequence[TimelineDelta], commands: int, number: int) -> None:
        """After these changes, which made the timeline what it is: let a part of what is old leave memory, and write a
        checkpoint where one is due. `commands`, `number`: as for `Store.keep_checkpoint`.
        """
        self._first = min([self._first, *[max(delta.keep - SMALL - 1, 0) for delta in deltas]])  # neighbours may merge
        self._close_rows(timeline)
        due = timeline.version - self._checkpoint >= max(self.reach.checkpoint, len(timeline) // ROW)
        if self._write_rows(timeline, due=due) and due and self.store.keep_checkpoint(timeline, commands, number):
            self._checkpoint = timeline.version

    @staticmethod
    def _close_rows(timeline: Timeline) -> None:
        """Let no row at the end grow far beyond ROW: not by what comes next, nor by a smaller one that joins it."""
        count = len(timeline)
        for index, part in timeline.parts(max(count - 2 * ROW, 0)):
            row, is_last = part.row, index + part.last - part.first == count
            if not row.closed and len(row) >= (ROW if is_last else ROW // 2):
                row.close()

    def _write_rows(self, timeline: Timeline, *, due: bool) -> bool:
        """Write rows that are old, and let these leave memory; where a checkpoint is `due`, write all. Whether all that
        were to be written are.
        """
        written, old, away = 0, len(timeline) - self.reach.segments, True
        for index, part in timeline.parts(self._first):
            row, leaves = part.row, index + part.last - part.first <= old
            if not (leaves or due):
                break
            if row.kept is None:
                if written >= ROW:
                    return False
                written += len(row)
                row.close()
                row.kept = self.store.keep_row(row)
                if row.kept is None:
                    return False
            if leaves and not row.away:
                row.put_away()
            away = away and leaves
            if away:
                self._first = index + part.last - part.first
        return True
