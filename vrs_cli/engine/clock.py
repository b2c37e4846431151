"""The clock of a robot. It is passed in: virtual time jumps, a clock on the wall is waited for.

`now` moves only when it is told to. So a program sees exact times, the same with every clock; and nothing comes too
late by the time its own planning takes: the instant at which it is done lasts until it is done.
"""

from __future__ import annotations

from collections.abc import Callable
from math import inf
from typing import Protocol

from vrs_cli.errors import ClockPaused
from vrs_cli.trajectory.instant import TICK, down_to_grid

SLICE = 0.05  # [s] of real time: a wait lasts no longer before whoever waits may look at what else has happened
SLOWEST_RATE, FASTEST_RATE = 1e-3, 1e6


class Clock(Protocol):
    """The present instant of the robot [s].

    `realtime`: what is before `now` has happened, and does not change any more. `paused`: a clock on the wall stands.
    """

    now: float
    realtime: bool

    @property
    def paused(self) -> bool: ...

    @property
    def reached(self) -> float:
        """How far time has come by itself: not before `now`."""

    def wait(self, to: float) -> None:
        """Let time go on towards `to`, perhaps not all the way; an earlier time changes nothing."""

    def advance(self, to: float) -> None:
        """Let time go on until `to`; an earlier time changes nothing."""

    def set(self, to: float) -> None:
        """Make `to` the present instant, also an earlier one (offline editing, undo, a new timeline)."""


class VirtualClock:
    """Time goes on only when somebody waits, and then at once. The past can be edited."""

    realtime = False
    paused = False

    def __init__(self, now: float = 0.0) -> None:
        self.now = now

    @property
    def reached(self) -> float:
        return self.now

    def advance(self, to: float) -> None:
        self.now = max(self.now, to)

    wait = advance

    def set(self, to: float) -> None:
        self.now = to


class WallClock:
    """Robot time that follows a clock on the wall: `rate` seconds of the robot pass in one second.

    Time is continuous and never goes back, whatever becomes of the rate. `wall` tells real time [s], `sleep` waits:
    `time.monotonic` and `time.sleep`, or stand-ins of a test. Who waits for something else too, which may end a wait
    early, waits with a `sleep` of its own.
    """

    realtime = True

    def __init__(self, wall: Callable[[], float], sleep: Callable[[float], None], rate: float = 1.0) -> None:
        self.now = 0.0
        self._wall, self.sleep = wall, sleep
        self._rate, self._paused = rate, False
        self._at, self._since = 0.0, wall()  # it was `_at` on this clock when it was `_since` on the wall

    @property
    def rate(self) -> float:
        return self._rate

    @property
    def paused(self) -> bool:
        return self._paused

    @property
    def reached(self) -> float:
        """How far the wall has come, on the time grid as all that happens."""
        return max(self.now, down_to_grid(self._time(self._wall())))

    def _time(self, wall: float) -> float:
        return self._at if self._paused else self._at + self._rate * max(wall - self._since, 0.0)

    def until(self, to: float) -> float:
        """How long it takes on the wall until `to` [s]; without end while the clock stands."""
        return inf if self._paused else (to - self._time(self._wall())) / self._rate

    def change(self, *, rate: float | None = None, paused: bool | None = None) -> None:
        """Change the rate, begin a pause or end it, from this instant on."""
        wall = self._wall()
        self._at, self._since = self._time(wall), wall
        self._rate = self._rate if rate is None else rate
        self._paused = self._paused if paused is None else paused

    def wait(self, to: float) -> None:
        """Wait for a SLICE of real time at most. Raises ClockPaused where the clock stands."""
        ahead = to - self._time(self._wall())
        if ahead >= TICK:
            if self._paused:
                raise ClockPaused(f"it stands at {self.reached:.3f} s, before {to:.3f} s", "CLOCK GO lets it go on")
            self.sleep(min(ahead / self._rate, SLICE))
            ahead = to - self._time(self._wall())
        self.now = max(self.now, to if ahead < TICK else min(self.reached, to))

    def advance(self, to: float) -> None:
        while self.now < to:
            self.wait(to)

    def set(self, to: float) -> None:
        self.now = self._at = to
        self._since = self._wall()
