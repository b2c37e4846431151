"""What is known of a robot at one version of its timeline, as a value: with the deltas after it, all that comes."""

from __future__ import annotations

from msgspec import Struct

from vrs_cli.engine.settings import Settings
from vrs_cli.trajectory.segment import Segment
from vrs_cli.trajectory.timeline import Timeline, TimelineDelta


class Snapshot(Struct, frozen=True):
    """The segments of timeline `version`, all of them or those of a window: from the one that has the number `first`
    (counted from 0) on. Before them the robot stands still. `settings`: those in force then.
    """

    version: int
    segments: tuple[Segment, ...]
    settings: Settings
    first: int = 0

    @classmethod
    def of(cls, timeline: Timeline, settings: Settings) -> Snapshot:
        return cls(timeline.version, tuple(timeline), settings)

    def timeline(self) -> Timeline:
        return Timeline(self.segments, self.version)


def fitted(delta: TimelineDelta, timeline: Timeline, first: int) -> TimelineDelta | None:
    """A delta of the whole timeline as one of what is known of it: `timeline`, from segment number `first` on. What is
    behind a window stays left out; None for a change that reaches before it: a snapshot is due then.
    """
    keep, count = delta.keep - first, len(timeline)
    if keep < 1:
        return None
    if keep > count:
        return delta._replace(keep=count, drop=0, segments=())
    return delta._replace(keep=keep, drop=min(delta.drop, count - keep))


class TimelineReplaced(Struct, frozen=True):
    """Another timeline has taken the place of the one before, with these settings: what a subscriber begins with, and
    hears of BRANCH, MERGE, LOAD of a trajectory. It holds the timeline itself; a snapshot is made by who sends it on.
    """

    timeline: Timeline
    settings: Settings

    @property
    def version(self) -> int:
        return self.timeline.version
