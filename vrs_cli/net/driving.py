"""Who drives a robot that is served: the lease between the robot's side, which asks whether somebody may command, and
the connections, which ask for it and are told. The time of the day is passed in.
"""

from __future__ import annotations

from collections.abc import Callable
from enum import Enum
from threading import Lock

from vrs_cli.interfaces.station.lease import Notice, RobotLease


class WhenGone(Enum):
    """What becomes of a program when who drives has gone."""

    GO_ON = "go-on"
    PAUSE = "pause"
    ABORT = "abort"


class Driving:
    """The lease of one robot. Every method may be called by any thread; `told` hears of each change, in that thread.
    `by_asking`: who commands something does not take it, only who asks for it.
    """

    def __init__(
        self, wall: Callable[[], float], told: Callable[[RobotLease, Notice | None], None], *, by_asking: bool = False
    ) -> None:
        self._wall, self._told, self._by_asking = wall, told, by_asking
        self._lock = Lock()
        self.lease = RobotLease()

    def may(self, who: str) -> None:
        """Somebody commands something: who comes first, where nobody drives, drives from then on, unless that has
        to be asked for. Raises LeaseHeld.
        """
        with self._lock:
            now = self._wall()
            if self.lease.drives(who):
                self.lease = self.lease.beat(who, now)
                return
            if not self.lease.expired(now):
                self.lease.check(who)
            if self._by_asking and not self.lease.holder:
                return
            self._take(self.lease.acquire(who, now))

    def ask(self, who: str) -> None:
        with self._lock:
            self._take(self.lease.ask(who, self._wall()))

    def acquire(self, who: str) -> None:
        """Raises LeaseHeld."""
        with self._lock:
            self._take(self.lease.acquire(who, self._wall()))

    def give(self, who: str, to: str) -> None:
        """Raises LeaseHeld for somebody who does not drive."""
        with self._lock:
            self._take(self.lease.give(who, to, self._wall()))

    def beat(self, who: str) -> None:
        """Somebody is there: whether that one drives does not matter."""
        with self._lock:
            if self.lease.drives(who):
                self.lease = self.lease.beat(who, self._wall())

    def leave(self, who: str) -> None:
        """Somebody has gone: who asked first drives."""
        with self._lock:
            self._take(self.lease.leave(who, self._wall()))

    def lapsed(self) -> str:
        """Who drove, and has not been heard of for too long; that one does no longer. Empty where there is none."""
        with self._lock:
            lease, now = self.lease, self._wall()
            if not lease.holder or not lease.expired(now):
                return ""
            self._take(lease.leave(lease.holder, now))
            return lease.holder

    def _take(self, step: tuple[RobotLease, tuple[Notice, ...]]) -> None:
        before, (self.lease, notices) = self.lease, step
        for notice in notices:
            self._told(self.lease, notice)
        if not notices and self.lease.holder != before.holder:
            self._told(self.lease, None)
