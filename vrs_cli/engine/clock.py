"""Clocks of a robot: virtual time jumps to the next instant; in real time the robot waits for it. The robot gets one of
these clocks. `now` advances only when the robot asks for it. So a program sees the same exact times with every clock,
and planning takes no robot time: an instant lasts until its work is done.
"""

from __future__ import annotations

from collections.abc import Callable
from math import inf

from msgspec import Struct

from vrs_cli.errors import ClockPaused
from vrs_cli.trajectory.instant import TICK, down_to_grid

SLICE_S = 0.05  # [s] of real time: the longest single wait, after which the caller may do other work
SLOWEST_RATE, FASTEST_RATE = 1e-3, 1e6


class VirtualClock:
    """A clock whose time passes only when the robot waits, and then immediately. `now`: the current instant of the
    robot [s]. Commands may change the past.
    """

    realtime = False  # in real time the past cannot be changed
    paused = False

    def __init__(self, now: float = 0.0) -> None:
        self.now = now

    @property
    def reached(self) -> float:
        """Return the time that the clock itself has reached [s], which may be later than `now` only for a wall
        clock.
        """
        return self.now

    def advance(self, to: float) -> None:
        """Advance `now` to the time `to` [s]; an earlier time changes nothing."""
        self.now = max(self.now, to)

    wait = advance

    def set(self, to: float) -> None:
        """Set `now` to the time `to` [s], which may be earlier (offline editing, undo, a new timeline)."""
        self.now = to


class ClockFace(Struct, frozen=True):
    """The reading `now` [s] of a clock at the wall time `wall` [s], with its rate and whether it is paused."""

    now: float
    rate: float
    paused: bool
    wall: float

    def at(self, wall: float) -> float:
        """Return the clock's reading [s] at a later wall time [s], if neither the rate nor the pause changes until
        then.
        """
        return self.now if self.paused else self.now + self.rate * max(wall - self.wall, 0.0)


class WallClock:
    """Robot time that follows a wall clock: `rate` seconds of the robot pass in one second.

    Time is continuous and never goes back, even when the rate changes. `wall` returns real time [s] and `sleep` waits:
    `time.monotonic` and `time.sleep`, or replacements in a test. A caller that also waits for other events passes its
    own `sleep`, which may return early.
    """

    realtime = True

    def __init__(self, wall: Callable[[], float], sleep: Callable[[float], None], rate: float = 1.0) -> None:
        self.now = 0.0
        self._wall, self.sleep = wall, sleep
        # the reading when the clock was last set, or its rate or pause changed
        self._since = ClockFace(0.0, rate, False, wall())

    @property
    def rate(self) -> float:
        return self._since.rate

    @property
    def paused(self) -> bool:
        return self._since.paused

    @property
    def reached(self) -> float:
        """Return the time that the wall clock has reached [s], rounded down to the time grid."""
        return self.read().now

    def read(self) -> ClockFace:
        """Return reading, rate and pause, all at the same instant. Any thread may call it."""
        wall, since = self._wall(), self._since
        return ClockFace(max(self.now, down_to_grid(since.at(wall))), since.rate, since.paused, wall)

    def until(self, to: float) -> float:
        """Return the real time [s] until the wall clock reaches the time `to` [s]; infinite while the clock is
        paused.
        """
        return inf if self.paused else (to - self._since.at(self._wall())) / self.rate

    def change(self, *, rate: float | None = None, paused: bool | None = None) -> None:
        """Change the rate, or begin or end a pause, starting at this instant."""
        wall, rate = self._wall(), self.rate if rate is None else rate
        self._since = ClockFace(self._since.at(wall), rate, self.paused if paused is None else paused, wall)

    def wait(self, to: float) -> None:
        """Wait until the time `to` [s], but at most SLICE_S of real time. Raises ClockPaused if the clock is paused."""
        ahead = to - self._since.at(self._wall())
        if ahead >= TICK:
            if self.paused:
                raise ClockPaused(f"it stands at {self.reached:.3f} s, before {to:.3f} s", "{CLOCK GO} lets it go on")
            self.sleep(min(ahead / self.rate, SLICE_S))
            ahead = to - self._since.at(self._wall())
        self.now = max(self.now, to if ahead < TICK else min(self.reached, to))

    def advance(self, to: float) -> None:
        while self.now < to:
            self.wait(to)

    def set(self, to: float) -> None:
        self.now, self._since = to, ClockFace(to, self.rate, self.paused, self._wall())


RobotClock = VirtualClock | WallClock
