"""What somebody has who was given a snapshot, and then every change."""

from __future__ import annotations

from collections.abc import Iterable
from math import inf

from msgspec import structs

from vrs_cli.engine.engine import TimelineChange
from vrs_cli.engine.feed import MissedEvents, Snapshot, TimelineReplaced
from vrs_cli.trajectory.timeline import Timeline


def mirrored(events: Iterable[TimelineChange | MissedEvents], timeline: Timeline | None = None) -> Timeline:
    """The timeline after these events, by what they say alone. The first one brings it, where there is none yet."""
    for event in events:
        if isinstance(event, TimelineReplaced):
            timeline = Snapshot.of(event.timeline, event.settings).timeline()
        elif not isinstance(event, MissedEvents):
            assert timeline is not None
            timeline = timeline.apply(event)
    assert timeline is not None
    return timeline


def windowed(snapshot: Snapshot, begin: float, end: float = inf) -> Snapshot:
    """The same for the times from `begin` to `end` [s] alone: the robot is there as it was, to the bit."""
    timeline = snapshot.timeline()
    first, last = timeline.index_at(begin), timeline.index_at(end)
    part = Snapshot.part(timeline, snapshot.settings, first, last + 1)
    return structs.replace(part, first=snapshot.first + first)
