"""Worlds for tests: a cell, motions of a PUMA, and what its hand does."""

from __future__ import annotations

from collections.abc import Sequence

from tests.interfaces.terminals import RecordingTerminal
from vrs_cli.files.cell_file import parse_cell
from vrs_cli.interfaces.session.session import Session
from vrs_cli.trajectory.timeline import Timeline
from vrs_cli.values.commands import HAND, Event
from vrs_cli.world.course import World, WorldCourse

TABLE = """
floor = -600
[[fixture]]
name = "table"
shape = "box"
size = [1200, 600, 20]
at = [0, 550, -290]
"""
BOX = """
[[part]]
name = "box"
shape = "box"
size = [40, 40, 60]
at = [0, 550, -250]
"""
PLACES = """
.LOCATIONS
part         0 550 -250 90 90 0
place      300 450 -200 90 90 90
.END
"""


class Arm:
    """A PUMA that moves by lines of VAL-II; `events` are those of its hand and signals."""

    def __init__(self, *lines: str) -> None:
        self.session = Session(RecordingTerminal())
        self.session.load_text(PLACES)
        self.engine = self.session.engine
        self.events: list[Event] = []
        self.do(*lines)

    def do(self, *lines: str) -> Arm:
        for line in lines:
            self.session.perform(line)
        return self

    def hand(self, value: float, at: float | None = None, duration: float = 0.05) -> Arm:
        t = self.engine.timeline.end if at is None else at
        self.events.append(Event(t, HAND, value, duration=duration))
        return self

    def switch(self, signal: int, on: bool, at: float) -> Arm:
        self.events.append(Event(at, signal, float(on)))
        return self

    @property
    def timeline(self) -> Timeline:
        return with_events(self.engine.timeline, self.events)


def with_events(timeline: Timeline, events: Sequence[Event]) -> Timeline:
    return Timeline(list(timeline), timeline.version, sorted(events, key=lambda event: event.time))


def world_of(arm: Arm, *texts: str) -> World:
    return World(arm.engine.arm, parse_cell("\n".join(texts)))


def course_of(arm: Arm, *texts: str) -> WorldCourse:
    return world_of(arm, *texts).course(arm.timeline)
