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
    """Fit a delta of the whole timeline to its known part, `timeline`, which begins with segment number `first`.

    What is behind the known part is left out. None for a change that reaches before it: a new snapshot is needed then.
    """
    keep, count = delta.keep - first, len(timeline)
    if keep < 1:
        return None
    if keep > count:
        return delta._replace(keep=count, drop=0, segments=())
    return delta._replace(keep=keep, drop=min(delta.drop, count - keep))


class TimelineReplaced(Struct, frozen=True):
    """The event that another timeline has taken the place of the one before, with these settings: the first event of
    every subscription, and that of BRANCH, MERGE and LOAD of a trajectory. It holds the timeline; who sends it on makes
    the snapshot.
    """

    timeline: Timeline
    settings: Settings

    @property
    def version(self) -> int:
        return self.timeline.version
