"""What a robot that is served writes down before anybody is answered: its timeline in the journal, and its memory.

It stands where the book has its journal, so that both go to the disk when `settle` is due, one time for many commands.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

from vrs_cli.engine.book import JournalWriter
from vrs_cli.errors import LimitReached
from vrs_cli.interfaces.dialogue import Dialogue
from vrs_cli.net.memory import MemoryFile
from vrs_cli.trajectory.timeline import TimelineDelta


class DurableLog:
    """`journal` and `memory` of one robot, None where it has no folder for them. `length`: of its timeline in segments,
    `most`: what that may be.
    """

    def __init__(
        self,
        length: Callable[[], int],
        most: int,
        journal: JournalWriter | None = None,
        memory: MemoryFile | None = None,
    ) -> None:
        self._length, self._most, self._journal, self._memory = length, most, journal, memory

    def record(self, deltas: Sequence[TimelineDelta], *, happens: bool = False) -> None:
        """Raises FileError, and LimitReached for a timeline that is as long as it may be."""
        longer = sum(len(delta.segments) - delta.drop for delta in deltas)
        if longer > 0 and self._length() + longer > self._most and not happens:
            what = f"the timeline has {self._most} segments, and the server allows no more"
            raise LimitReached(what, "UNDO takes some back")
        if self._journal is not None:
            self._journal.record(deltas, happens=happens)

    @property
    def unsettled(self) -> bool:
        journal, memory = self._journal, self._memory
        return (journal is not None and journal.unsettled) or (memory is not None and memory.changed)

    def settle(self) -> None:
        """All of it is on the disk. Raises FileError."""
        try:
            if self._journal is not None:
                self._journal.settle()
        finally:
            if self._memory is not None:
                self._memory.write()

    def note(self) -> None:
        """A command has been carried out, which may have changed what is in memory."""
        if self._memory is not None:
            self._memory.note()

    def prepare(self) -> Dialogue[None]:
        """What takes long of that is done by another thread."""
        if self._memory is not None:
            yield from self._memory.prepare()

    def check(self) -> None:
        """What could not be written is written now. Raises FileError where the disk takes nothing yet."""
        memory = self._memory
        if memory is not None and memory.failing:
            memory.changed = True
            memory.write()
