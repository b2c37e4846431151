"""Rebuild a timeline from a snapshot and all later changes, as a subscriber does."""

from __future__ import annotations

from collections.abc import Iterable
from math import inf

from msgspec import structs

from vrs_cli.engine.engine import TimelineChange
from vrs_cli.engine.feed import MissedEvents, Snapshot, TimelineReplaced
from vrs_cli.trajectory.timeline import Timeline


def mirrored(events: Iterable[TimelineChange | MissedEvents], timeline: Timeline | None = None) -> Timeline:
    """Return the timeline after these events, from the events alone. The first event brings the timeline, if there is
    none yet.
    """
    for event in events:
        if isinstance(event, TimelineReplaced):
            timeline = Snapshot.of(event.timeline, event.settings).timeline()
        elif not isinstance(event, MissedEvents):
            assert timeline is not None
            timeline = timeline.apply(event)
    assert timeline is not None
    return timeline


def windowed(snapshot: Snapshot, begin: float, end: float = inf) -> Snapshot:
    """Rebuild only the times from `begin` to `end` [s]; there the robot is at the same place, to the bit."""
    timeline = snapshot.timeline()
    first, last = timeline.index_at(begin), timeline.index_at(end)
    part = Snapshot.part(timeline, snapshot.settings, first, last + 1)
    return structs.replace(part, first=snapshot.first + first)
