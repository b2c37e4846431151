"""A journal in memory, for tests of code that writes into it."""

from __future__ import annotations

from collections.abc import Sequence

from vrs_cli.engine.book import Book
from vrs_cli.errors import FileError
from vrs_cli.trajectory.timeline import Timeline, TimelineDelta


class Paper:
    """A journal in memory of the changes after the first `since`. `torn`: nothing can be written. `owed`: changes that
    took place although they could not be written.
    """

    def __init__(self, book: Book, since: int = 0) -> None:
        self.book, self.since, self.torn = book, since, False
        self.lines: list[TimelineDelta] = []
        self.owed = 0

    unsettled = False

    def settle(self) -> None:
        """Do nothing: all changes are written already."""

    def record(self, deltas: Sequence[TimelineDelta], *, happens: bool = False) -> None:
        assert self.book.timeline.version == deltas[0].version, "it has happened already"
        assert deltas[0].version == self.since + len(self.lines)
        if self.torn and not happens:
            raise FileError("no paper")
        self.owed += self.torn
        self.lines += deltas

    def timeline(self) -> Timeline:
        timeline = self.book.initial
        for delta in self.lines:
            timeline = timeline.apply(delta)
        return timeline
