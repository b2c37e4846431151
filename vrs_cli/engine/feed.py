"""Messages between threads: an inbox with one reader, and feeds of events for many subscribers.

A subscriber can do no harm to whoever publishes: an event is put into its queue, and no more. A subscriber that does
not take its events loses them: it is told how many, and given an event that stands for all of them.
"""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from math import inf
from threading import Lock
from typing import Generic, NamedTuple, TypeVar
from weakref import WeakSet

from msgspec import Struct
from msgspec.structs import replace

from vrs_cli.engine.settings import Settings
from vrs_cli.trajectory.instant import TICK
from vrs_cli.trajectory.segment import Segment
from vrs_cli.trajectory.timeline import Timeline, TimelineDelta
from vrs_cli.values.commands import Event
from vrs_cli.values.world import WorldState

MAX_WAITING_EVENTS = 1000  # events that wait for one subscriber
E = TypeVar("E")
M = TypeVar("M")


class Inbox(Generic[M]):
    """To put a message in waits for no lock: a signal handler may do so too.

    A lock is the bell. A `SimpleQueue` has one inside, but its `get` may wait for ever: where the time runs out while
    a signal is handled, CPython takes the time that is left, which is below zero, for none at all.
    """

    def __init__(self) -> None:
        self._messages: deque[M] = deque()
        self._bell = Lock()

    def __len__(self) -> int:
        return len(self._messages)

    def put(self, message: M) -> None:
        self._messages.append(message)
        try:  # noqa: SIM105 (`suppress` takes three calls, for each message of a line)
            self._bell.release()
        except RuntimeError:  # it rings already
            pass

    def take_all(self) -> list[M]:
        """All that is there, in order of arrival."""
        there: list[M] = []
        while self._messages:  # there is one reader
            there.append(self._messages.popleft())
        return there

    def wait(self, seconds: float | None) -> None:
        """Until a message is there, so many seconds [s] at most; None: however long that takes."""
        end = None if seconds is None else time.monotonic() + seconds
        while not self._messages:
            left = -1.0 if end is None else end - time.monotonic()
            if end is not None and left <= 0.0:
                return
            self._bell.acquire(timeout=left)

    def take(self, seconds: float | None) -> M | None:
        """The next message; None where none comes within so many seconds [s]."""
        self.wait(seconds)
        try:
            return self._messages.popleft()
        except IndexError:
            return None


class MissedEvents(Struct, frozen=True):
    """A subscriber was too slow: so many events were left out. What makes up for them comes next."""

    count: int


class Subscription(Generic[E]):
    """Events in the order in which they happened, for one reader, which may be another thread. Who lets go of a
    subscription has ended it.
    """

    def __init__(self, most: int = MAX_WAITING_EVENTS, woken: Callable[[], None] | None = None) -> None:
        self.most = most
        self.ended = False
        self._woken = woken  # called when there is something to take, in the thread of who tells
        self._queue: Inbox[E | MissedEvents | None] = Inbox()  # None: no more events

    # --- who tells ---

    def put(self, events: Sequence[E], instead: Callable[[], E]) -> None:
        """Events that have all happened. Never waits: where there is no room, all that waits is left out with them, and
        `instead` makes up for it.
        """
        told: Sequence[E | MissedEvents] = events
        if len(self._queue) + len(events) > self.most:
            missed = len(events)
            for left_out in self._queue.take_all():
                missed += left_out.count - 1 if isinstance(left_out, MissedEvents) else 1  # not what made up for them
            told = MissedEvents(missed), instead()
        for event in told:
            self._queue.put(event)
        if self._woken is not None:
            self._woken()

    # --- who hears ---

    def take(self, timeout: float | None = None) -> E | MissedEvents | None:
        """The next event; None where none comes within so many seconds [s], and where there are no more."""
        return self._queue.take(timeout)

    def take_all(self) -> list[E | MissedEvents]:
        """All that is there now."""
        return [event for event in self._queue.take_all() if event is not None]

    def __iter__(self) -> Iterator[E | MissedEvents]:
        """Wait for event after event, until the subscription is ended and all that was told before has been taken."""
        while (not self.ended or self._queue) and (event := self.take()) is not None:
            yield event

    def end(self) -> None:
        """No more events, also for a reader that waits for one."""
        self.ended = True
        self._queue.put(None)


class Feed(Generic[E]):
    """Tells all that subscribe. `instead` makes the event that stands for all before it."""

    def __init__(self, instead: Callable[[], E]) -> None:
        self._instead = instead
        self._subscriptions: WeakSet[Subscription[E]] = WeakSet()
        self._held: list[E] | None = None

    def subscribe(self, most: int = MAX_WAITING_EVENTS, woken: Callable[[], None] | None = None) -> Subscription[E]:
        """What stands for all so far, and every event from now on; `woken` is called when there is one."""
        self._publish(self._held or ())
        self._held = None if self._held is None else []
        subscription: Subscription[E] = Subscription(most, woken)
        subscription.put([self._instead()], self._instead)
        self._subscriptions.add(subscription)
        return subscription

    def hold(self) -> None:
        """Nobody hears of what is published until `release`: whoever commanded it is answered before."""
        self._held = self._held or []

    def release(self) -> None:
        held, self._held = self._held, None
        self._publish(held or ())

    def publish(self, events: Sequence[E]) -> None:
        """All that has happened since the last time."""
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


def fit_delta(
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


def unfit_delta(delta: TimelineDelta, first: int, known: KnownEvents = ALL_EVENTS) -> TimelineDelta:
    """Return the delta of the whole timeline for one of its known part: the reverse of `fit_delta`."""
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
