"""Messages between threads: an inbox with one reader, and feeds of events for many subscribers.

A subscriber can do no harm to whoever publishes: an event is put into its queue, and no more. A subscriber that does
not take its events loses them: it is told how many, and given an event that stands for all of them.
"""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from threading import Lock
from typing import Generic, TypeVar
from weakref import WeakSet

from msgspec import Struct

MOST = 1000  # events that wait for one subscriber
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

    def taken(self) -> list[M]:
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

    def __init__(self, most: int = MOST, woken: Callable[[], None] | None = None) -> None:
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
            for left_out in self._queue.taken():
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

    def taken(self) -> list[E | MissedEvents]:
        """All that is there now."""
        return [event for event in self._queue.taken() if event is not None]

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

    def subscribe(self, most: int = MOST, woken: Callable[[], None] | None = None) -> Subscription[E]:
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
