"""What somebody has who was given a snapshot, and then every change."""

from __future__ import annotations

from collections.abc import Iterable

from vrs_cli.engine.engine import Event
from vrs_cli.engine.feed import Missed
from vrs_cli.engine.snapshot import Replaced
from vrs_cli.trajectory.timeline import Timeline


def mirrored(events: Iterable[Event | Missed], timeline: Timeline | None = None) -> Timeline:
    """The timeline after these events, by what they say alone. The first one brings it, where there is none yet."""
    for event in events:
        if isinstance(event, Replaced):
            timeline = event.snapshot().timeline()
        elif not isinstance(event, Missed):
            assert timeline is not None
            timeline = timeline.apply(event)
    assert timeline is not None
    return timeline
