"""What was scheduled at one time, to tell later what has moved since."""

from __future__ import annotations

from typing import NamedTuple

from vrs_cli.dialogue.replies import Displaced
from vrs_cli.engine.book import Book
from vrs_cli.engine.displacement import displacement
from vrs_cli.trajectory.timeline import Timeline


class Schedule(NamedTuple):
    """A book, and its timeline at one time."""

    book: Book
    timeline: Timeline

    def displaced(self, now: Book) -> Displaced | None:
        """What has moved since; None where nothing has, and where it is another book."""
        found = displacement(now, self.timeline) if now is self.book else None
        return None if found is None else Displaced(found)
