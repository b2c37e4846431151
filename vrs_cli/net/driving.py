"""The lease of a served robot, shared by threads: the robot asks whether a user may command, connections change it and
are told. The time of the day is passed in.
"""

from __future__ import annotations

from collections.abc import Callable
from enum import Enum
from threading import Lock

from vrs_cli.interfaces.station.lease import Notice, RobotLease

LeaseStep = tuple[RobotLease, tuple[Notice, ...]]  # the next lease, and what users are told


class WhenGone(Enum):
    """What to do with a running program when the driver is gone."""

    GO_ON = "go-on"
    PAUSE = "pause"
    ABORT = "abort"


class Driving:
    """The lease of one robot. Any thread may call any method; `told` is called with each change, in that thread.
    `by_asking`: only a user who asks for the lease takes it, not one who commands something.
    """

    def __init__(
        self, wall: Callable[[], float], told: Callable[[RobotLease, Notice | None], None], *, by_asking: bool = False
    ) -> None:
        self._wall, self._told, self._by_asking = wall, told, by_asking
        self._lock = Lock()
        self.lease = RobotLease()

    def may(self, who: str) -> None:
        """Check that a user may command something. The first who does so, while nobody drives, takes the lease, unless
        it has to be asked for. Raises LeaseHeld.
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

    def change(self, step: Callable[[RobotLease, float], LeaseStep]) -> None:
        """Take a step of the lease, such as `acquire`, at the present time. Raises LeaseHeld."""
        with self._lock:
            self._take(step(self.lease, self._wall()))

    def beat(self, who: str) -> None:
        """Note that a user is there; one who does not drive changes nothing."""
        with self._lock:
            if self.lease.drives(who):
                self.lease = self.lease.beat(who, self._wall())

    def lapsed(self) -> str:
        """Take the lease from a driver who was not heard for too long; return the name, empty if there is none."""
        with self._lock:
            lease, now = self.lease, self._wall()
            if not lease.holder or not lease.expired(now):
                return ""
            self._take(lease.leave(lease.holder, now))
            return lease.holder

    def _take(self, step: LeaseStep) -> None:
        before, (self.lease, notices) = self.lease, step
        for notice in notices:
            self._told(self.lease, notice)
        if not notices and self.lease.holder != before.holder:
            self._told(self.lease, None)
