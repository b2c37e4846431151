"""Pass messages between threads: an inbox with one reader, feeds of events for many subscribers, and the snapshot (the
state of the timeline) with which a subscription begins.

A subscriber cannot harm the publisher: publishing only puts an event into the subscriber's queue. A subscriber that
does not take its events loses them; it gets the number of lost events and an event that replaces all of them.
"""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from math import inf
from threading import Lock
from typing import TYPE_CHECKING, Generic, TypeVar
from weakref import WeakSet

from msgspec import Struct, structs

from vrs_cli.engine.settings import Settings
from vrs_cli.trajectory.instant import TICK
from vrs_cli.trajectory.segment import Segment
from vrs_cli.trajectory.timeline import Timeline, TimelineDelta
from vrs_cli.values.commands import Event

if TYPE_CHECKING:
    from vrs_cli.values.world import WorldState

MAX_WAITING_EVENTS = 1000  # maximum number of events that wait for one subscriber
E = TypeVar("E")
M = TypeVar("M")


class Inbox(Generic[M]):
    """A queue of messages for one reader. `put` waits for no lock, so a signal handler may call it.

    A lock wakes the reader. A `SimpleQueue` also has such a lock, but its `get` may wait forever: if the time runs out
    while a signal is handled, CPython treats the remaining time, which is negative, as no limit.
    """

    def __init__(self) -> None:
        self._messages: deque[M] = deque()
        self._bell = Lock()

    def __len__(self) -> int:
        return len(self._messages)

    def put(self, message: M) -> None:
        self._messages.append(message)
        try:  # noqa: SIM105 (`suppress` would cost three calls for each message)
            self._bell.release()
        except RuntimeError:  # the reader is awake already
            pass

    def take_all(self) -> list[M]:
        """Take all waiting messages, in order of arrival."""
        there: list[M] = []
        while self._messages:  # safe without a lock, because there is only one reader
            there.append(self._messages.popleft())
        return there

    def wait(self, seconds: float | None) -> None:
        """Wait for a message, at most `seconds` [s]; None: wait without a limit."""
        end = None if seconds is None else time.monotonic() + seconds
        while not self._messages:
            left = -1.0 if end is None else end - time.monotonic()
            if end is not None and left <= 0.0:
                return
            self._bell.acquire(timeout=left)

    def take(self, seconds: float | None) -> M | None:
        """Take the next message; return None if no message arrives within `seconds` [s] (None: wait without a
        limit).
        """
        self.wait(seconds)
        try:
            return self._messages.popleft()
        except IndexError:
            return None


class MissedEvents(Struct, frozen=True):
    """The number of events that a slow subscriber has missed. The next event replaces them."""

    count: int


class Subscription(Generic[E]):
    """A queue of events, in the order in which they happened, for one reader, which may run in another thread. The
    subscription ends when its reader drops it.
    """

    def __init__(self, most: int = MAX_WAITING_EVENTS, woken: Callable[[], None] | None = None) -> None:
        self.most = most
        self.ended = False
        self._woken = woken  # called in the thread of the publisher when an event has arrived
        self._queue: Inbox[E | MissedEvents | None] = Inbox()  # None marks the end of the events

    # --- for the publisher ---

    def put(self, events: Sequence[E], instead: Callable[[], E]) -> None:
        """Queue events without waiting. If there is no room, drop the waiting events and these events, and queue
        instead their number and the event that `instead` makes.
        """
        queued: Sequence[E | MissedEvents] = events
        if len(self._queue) + len(events) > self.most:
            missed = len(events)
            for left_out in self._queue.take_all():
                # a MissedEvents stands for `count` events; the event of `instead` that follows it in the queue was
                # never published, but this loop counts it: subtract 1
                missed += left_out.count - 1 if isinstance(left_out, MissedEvents) else 1
            queued = MissedEvents(missed), instead()
        for event in queued:
            self._queue.put(event)
        if self._woken is not None:
            self._woken()

    # --- for the reader ---

    def take(self, timeout: float | None = None) -> E | MissedEvents | None:
        """Take the next event; return None if no event arrives within `timeout` [s], or if the subscription has
        ended.
        """
        return self._queue.take(timeout)

    def take_all(self) -> list[E | MissedEvents]:
        """Take all waiting events."""
        return [event for event in self._queue.take_all() if event is not None]

    def __iter__(self) -> Iterator[E | MissedEvents]:
        """Wait for and yield each event, until the subscription has ended and all earlier events are taken."""
        while (not self.ended or self._queue) and (event := self.take()) is not None:
            yield event

    def end(self) -> None:
        """End the subscription. A reader that is waiting for an event stops waiting."""
        self.ended = True
        self._queue.put(None)


class Feed(Generic[E]):
    """A source of events for all subscribers. `instead` makes the event that replaces all earlier events."""

    def __init__(self, instead: Callable[[], E]) -> None:
        self._instead = instead
        self._subscriptions: WeakSet[Subscription[E]] = WeakSet()
        self._held: list[E] | None = None

    def subscribe(self, most: int = MAX_WAITING_EVENTS, woken: Callable[[], None] | None = None) -> Subscription[E]:
        """Return a subscription to an event that replaces all earlier events, followed by every later event. `woken` is
        called when an event has arrived.
        """
        self._publish(self._held or ())
        self._held = None if self._held is None else []
        subscription: Subscription[E] = Subscription(most, woken)
        subscription.put([self._instead()], self._instead)
        self._subscriptions.add(subscription)
        return subscription

    def hold(self) -> None:
        """Hold published events back until `release`, so that the user who commanded a change gets the answer first."""
        self._held = self._held or []

    def release(self) -> None:
        held, self._held = self._held, None
        self._publish(held or ())

    def publish(self, events: Sequence[E]) -> None:
        """Publish the events since the last call, or hold them back."""
        if self._held is None:
            self._publish(events)
        else:
            self._held += events

    def _publish(self, events: Sequence[E]) -> None:
        if not events:
            return
        for subscription in tuple(self._subscriptions):
            if subscription.ended:
                self._subscriptions.discard(subscription)
            else:
                subscription.put(events, self._instead)


class Snapshot(Struct, frozen=True):
    """All segments of timeline `version`, or only the window of those from segment number `first` (counted from 0) on.
    Before the window the robot is at rest.

    `settings`: the settings at that version. `events`: the events of the window, from event number `first_event` on.
    `values`: the last event of each channel before the window, so that the value of every channel is known from the
    start of the window on. `world`: the state of the world (hand, parts and sensors) at `known_from`, if the robot
    works in a cell (a described world).
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
        """Make the snapshot of the segments from number `first` up to, but not including, `after`, and of the events
        during these segments.
        """
        segments = tuple([timeline[index] for index in range(first, after)])
        known = timeline.events_by(segments[0].start, before=True) if first else 0
        last = timeline.event_count if after == len(timeline) else timeline.events_by(timeline[after].start)
        values = last_values(timeline, known)
        return cls(timeline.version, segments, settings, first, tuple(timeline.event_slice(known, last)), values, known)

    def timeline(self) -> Timeline:
        return Timeline(self.segments, self.version, (*self.values, *self.events), self.world)

    @property
    def known_from(self) -> float:
        """The first time [s] at which both segments and events are known."""
        return max(self.segments[0].start, self.values[-1].time + TICK if self.values else -inf)

    def with_later_events(self, count: int) -> Snapshot:
        """Return the snapshot without the first `count` events, but with the values of the channels after them."""
        values = last_values(self.timeline(), len(self.values) + count)
        return structs.replace(self, events=self.events[count:], values=values, first_event=self.first_event + count)

    @property
    def known_events(self) -> KnownEvents:
        """Return which events of the whole timeline this snapshot contains."""
        return KnownEvents(self.first_event, len(self.values))


def last_values(timeline: Timeline, count: int) -> tuple[Event, ...]:
    """Return the last event of each channel among the first `count` events, in order of time."""
    if not count:
        return ()
    last = {event.channel: event for event in timeline.event_slice(0, count) if not event.observed}
    return tuple(sorted(last.values(), key=lambda event: event.time))


class KnownEvents(Struct, frozen=True):
    """The events in the known part of a timeline. In place of all events before number `first` the part has
    `values` events: the last event of each channel.
    """

    first: int = 0
    values: int = 0


ALL_EVENTS = KnownEvents()


def fit_delta(
    delta: TimelineDelta, timeline: Timeline, first: int, known: KnownEvents = ALL_EVENTS
) -> TimelineDelta | None:
    """Convert a delta of the whole timeline into a delta of its known part, `timeline`, which begins with segment
    number `first` and has the `known` events.

    Changes after the known part are left out. Return None for a change that reaches before the known part: the
    subscriber then needs a new snapshot.
    """
    keep, count, edit = delta.keep - first, len(timeline), delta.events
    if keep < 1 or (edit is not None and edit.keep < known.first):
        return None
    if timeline.world is not None:  # a change before the time from which the world is known needs a new snapshot
        first_change = min([delta.cut, *(() if edit is None else [event.time for event in edit.events[:1]])])
        if first_change < timeline.world.time:
            return None
    segments, drop = delta.segments, min(delta.drop, count - keep)
    if keep > count:
        keep, drop, segments = count, 0, ()
    if edit is not None:
        kept, events = edit.keep - known.first + known.values, timeline.event_count
        edit = structs.replace(edit, keep=kept, drop=min(edit.drop, events - kept)) if kept <= events else None
    return structs.replace(delta, keep=keep, drop=drop, segments=segments, events=edit)


def unfit_delta(delta: TimelineDelta, first: int, known: KnownEvents = ALL_EVENTS) -> TimelineDelta:
    """Convert a delta of the known part into a delta of the whole timeline: the inverse of `fit_delta`."""
    edit = delta.events
    if edit is not None:
        edit = structs.replace(edit, keep=edit.keep + known.first - known.values)
    return structs.replace(delta, keep=delta.keep + first, events=edit)


class TimelineReplaced(Struct, frozen=True):
    """The event that another timeline, with these settings, has replaced the timeline. It is the first event of every
    subscription, and is published for BRANCH, MERGE and LOAD of a trajectory. The sender of the event makes the
    snapshot.
    """

    timeline: Timeline
    settings: Settings

    @property
    def version(self) -> int:
        return self.timeline.version
