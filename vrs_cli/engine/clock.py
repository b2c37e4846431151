"""The clock of a robot. It is passed in: virtual time jumps, a clock on the wall is waited for.

`now` moves only when it is told to. So a program sees exact times, the same with every clock; and nothing comes too
late by the time its own planning takes: the instant at which it is done lasts until it is done.
"""

from __future__ import annotations

from collections.abc import Callable
from math import inf
from typing import NamedTuple

from vrs_cli.errors import ClockPaused
from vrs_cli.trajectory.instant import TICK, down_to_grid

SLICE = 0.05  # [s] of real time: a wait lasts no longer before whoever waits may look at what else has happened
SLOWEST_RATE, FASTEST_RATE = 1e-3, 1e6


class VirtualClock:
    """The present instant of the robot, `now` [s]. Time goes on only when somebody waits, and then at once.

    The past can be edited.
    """

    realtime = False  # else what is before `now` has happened, and does not change any more
    paused = False

    def __init__(self, now: float = 0.0) -> None:
        self.now = now

    @property
    def reached(self) -> float:
        """How far time has come by itself: not before `now`."""
        return self.now

    def advance(self, to: float) -> None:
        """Let time go on until `to`; an earlier time changes nothing."""
        self.now = max(self.now, to)

    wait = advance

    def set(self, to: float) -> None:
        """Make `to` the present instant, also an earlier one (offline editing, undo, a new timeline)."""
        self.now = to


class ClockFace(NamedTuple):
    """The reading of a clock at the time `wall` [s], with its rate and whether it is paused."""

    now: float
    rate: float
    paused: bool
    wall: float

    def at(self, wall: float) -> float:
        """The clock's reading at a later wall time, if it is neither paused nor re-rated."""
        return self.now if self.paused else self.now + self.rate * max(wall - self.wall, 0.0)


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
        self._since = ClockFace(0.0, rate, False, wall())  # as it was set or changed last

    @property
    def rate(self) -> float:
        return self._since.rate

    @property
    def paused(self) -> bool:
        return self._since.paused

    @property
    def reached(self) -> float:
        """How far the wall has come, rounded down to the time grid."""
        return self.read().now

    def read(self) -> ClockFace:
        """Return the reading, rate and pause of one instant. Any thread may call it."""
        wall, since = self._wall(), self._since
        return ClockFace(max(self.now, down_to_grid(since.at(wall))), since.rate, since.paused, wall)

    def until(self, to: float) -> float:
        """Return how long it takes on the wall until `to` [s]; infinite while the clock is paused."""
        return inf if self.paused else (to - self._since.at(self._wall())) / self.rate

    def change(self, *, rate: float | None = None, paused: bool | None = None) -> None:
        """Change the rate, or begin or end a pause, from this instant on."""
        wall, rate = self._wall(), self.rate if rate is None else rate
        self._since = ClockFace(self._since.at(wall), rate, self.paused if paused is None else paused, wall)

    def wait(self, to: float) -> None:
        """Wait for `to`, and for a SLICE of real time at most. Raises ClockPaused where the clock stands."""
        ahead = to - self._since.at(self._wall())
        if ahead >= TICK:
            if self.paused:
                raise ClockPaused(f"it stands at {self.reached:.3f} s, before {to:.3f} s", "{CLOCK GO} lets it go on")
            self.sleep(min(ahead / self.rate, SLICE))
            ahead = to - self._since.at(self._wall())
        self.now = max(self.now, to if ahead < TICK else min(self.reached, to))

    def advance(self, to: float) -> None:
        while self.now < to:
            self.wait(to)

    def set(self, to: float) -> None:
        self.now, self._since = to, ClockFace(to, self.rate, self.paused, self._wall())


RobotClock = VirtualClock | WallClock
