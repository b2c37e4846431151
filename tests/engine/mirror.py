"""What somebody has who was given a snapshot, and then every change."""

from __future__ import annotations

from collections.abc import Iterable

from vrs_cli.engine.engine import Event
from vrs_cli.engine.feed import MissedEvents
from vrs_cli.engine.snapshot import TimelineReplaced
from vrs_cli.trajectory.timeline import Timeline


def mirrored(events: Iterable[Event | MissedEvents], timeline: Timeline | None = None) -> Timeline:
    """The timeline after these events, by what they say alone. The first one brings it, where there is none yet."""
    for event in events:
        if isinstance(event, TimelineReplaced):
            timeline = event.snapshot().timeline()
        elif not isinstance(event, MissedEvents):
            assert timeline is not None
            timeline = timeline.apply(event)
    assert timeline is not None
    return timeline
