"""The clock of a robot. It is passed in: tests and batch runs have one that jumps, a paced one keeps real time."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol


class Clock(Protocol):
    """The present instant of the robot [s]."""

    @property
    def now(self) -> float:
        """The present instant."""

    def advance(self, to: float) -> None:
        """Let time go on until `to`; an earlier time changes nothing."""

    def set(self, to: float) -> None:
        """Make `to` the present instant, also an earlier one (offline editing, undo)."""


class VirtualClock:
    """Time goes on only when somebody waits, and then at once."""

    def __init__(self, now: float = 0.0) -> None:
        self.now = now

    def advance(self, to: float) -> None:
        self.now = max(self.now, to)

    def set(self, to: float) -> None:
        self.now = to


class PacedClock(VirtualClock):
    """Virtual time that waits for real time: `rate` seconds of the robot pass in one second.

    `wall` tells real time [s], `sleep` waits: `time.monotonic` and `time.sleep`, or stand-ins of a test. A program
    still sees exact virtual times, so that it gives the same timeline as without pacing.
    """

    def __init__(
        self, rate: float, wall: Callable[[], float], sleep: Callable[[float], None], now: float = 0.0
    ) -> None:
        super().__init__(now)
        self.rate, self.wall, self.sleep = rate, wall, sleep
        self._start = wall() - now / rate

    def advance(self, to: float) -> None:
        super().advance(to)
        ahead = self._start + self.now / self.rate - self.wall()
        if ahead > 0.0:
            self.sleep(ahead)

    def set(self, to: float) -> None:
        super().set(to)
        self._start = self.wall() - to / self.rate
