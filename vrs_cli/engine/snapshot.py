"""What is known of a robot at one version of its timeline, as a value: with the deltas after it, all that comes."""

from __future__ import annotations

from math import inf
from typing import NamedTuple

from msgspec import Struct
from msgspec.structs import replace

from vrs_cli.engine.settings import Settings
from vrs_cli.trajectory.instant import TICK
from vrs_cli.trajectory.segment import Segment
from vrs_cli.trajectory.timeline import Timeline, TimelineDelta
from vrs_cli.values.commands import Event
from vrs_cli.values.world import WorldState


class Snapshot(Struct, frozen=True):
    """The segments of timeline `version`, all of them or those of a window: from the one that has the number `first`
    (counted from 0) on. Before them the robot stands still. `settings`: those in force then.

    `events`: those of the window, from the one that has the number `first_event` on; `values`: of those before it the
    last of each channel, so that what all channels are is known from the begin of the window on. `world`: the state of
    the world at `known_from`, if there is a cell.
    """

    version: int
    segments: tuple[Segment, ...]
    settings: Settings
    first: int = 0
    events: tuple[Event, ...] = ()
    values: tuple[Event, ...] = ()
    first_event: int = 0
    world: WorldState | None = None

    @classmethod
    def of(cls, timeline: Timeline, settings: Settings) -> Snapshot:
        return cls(timeline.version, tuple(timeline), settings, events=tuple(timeline.events))

    @classmethod
    def part(cls, timeline: Timeline, settings: Settings, first: int, after: int) -> Snapshot:
        """Make the snapshot of the segments from number `first` to before `after`, and of the events of that time."""
        segments = tuple([timeline[index] for index in range(first, after)])
        known = timeline.events_by(segments[0].start, before=True) if first else 0
        last = timeline.event_count if after == len(timeline) else timeline.events_by(timeline[after].start)
        values = last_values(timeline, known)
        return cls(timeline.version, segments, settings, first, tuple(timeline.event_slice(known, last)), values, known)

    def timeline(self) -> Timeline:
        return Timeline(self.segments, self.version, (*self.values, *self.events), self.world)

    @property
    def known_from(self) -> float:
        """Return the time from which on both segments and events are known [s]."""
        last = self.values[-1].time + TICK if self.values else -inf
        return max(self.segments[0].start, last)

    def with_later_events(self, count: int) -> Snapshot:
        """Return the snapshot without the first `count` events, but for the values of the channels after them."""
        values = last_values(self.timeline(), len(self.values) + count)
        return replace(self, events=self.events[count:], values=values, first_event=self.first_event + count)

    @property
    def known_events(self) -> KnownEvents:
        """Return which events its timeline has."""
        return KnownEvents(self.first_event, len(self.values))


def last_values(timeline: Timeline, count: int) -> tuple[Event, ...]:
    """Return the last event of each channel among the first `count` events, in order of time."""
    if not count:
        return ()
    last = {event.channel: event for event in timeline.event_slice(0, count) if not event.observed}
    return tuple(sorted(last.values(), key=lambda event: event.time))


class KnownEvents(NamedTuple):
    """Which events a part of a timeline has: in place of those before number `first` the last of each channel, so many
    as `values`.
    """

    first: int = 0
    values: int = 0


ALL_EVENTS = KnownEvents()


def fitted(
    delta: TimelineDelta, timeline: Timeline, first: int, known: KnownEvents = ALL_EVENTS
) -> TimelineDelta | None:
    """Fit a delta of the whole timeline to its known part, `timeline`, which begins with segment number `first` and
    has the `known` events.

    What is behind the known part is left out. None for a change that reaches before it: a new snapshot is needed then.
    """
    keep, count, edit = delta.keep - first, len(timeline), delta.events
    if keep < 1 or (edit is not None and edit.keep < known.first):
        return None
    if timeline.world is not None:  # an event may be new just before those that are known
        first_change = min([delta.cut, *(() if edit is None else [event.time for event in edit.events[:1]])])
        if first_change < timeline.world.time:
            return None
    segments, drop = delta.segments, min(delta.drop, count - keep)
    if keep > count:
        keep, drop, segments = count, 0, ()
    if edit is not None:
        kept, events = edit.keep - known.first + known.values, timeline.event_count
        edit = edit._replace(keep=kept, drop=min(edit.drop, events - kept)) if kept <= events else None
    # not _replace: it leaves a tuple of eleven behind each time (CPython 3.11 keeps 2000 of them)
    return TimelineDelta(*delta[:6], keep, drop, delta.shift, segments, edit)


def unfitted(delta: TimelineDelta, first: int, known: KnownEvents = ALL_EVENTS) -> TimelineDelta:
    """Return the delta of the whole timeline for one of its known part: the reverse of `fitted`."""
    edit = delta.events
    if edit is not None:
        edit = edit._replace(keep=edit.keep + known.first - known.values)
    return delta._replace(keep=delta.keep + first, events=edit)


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
