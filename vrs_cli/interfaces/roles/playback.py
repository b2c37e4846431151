"""Playing a trajectory: which time of it is shown at which time of the day. Pure: the wall clock is an argument."""

from __future__ import annotations

from math import inf

from msgspec import Struct
from msgspec.structs import replace

RATES = (0.1, 0.25, 0.5, 1.0, 2.0, 4.0, 10.0)  # the steps of faster and slower


class Playback(Struct, frozen=True):
    """From `start` to `end` [s] of a trajectory, `rate` seconds of it in one second.

    At the wall time `since` [s] it showed `shown` [s]. `follows`: it goes no further than `now`, where the robot is,
    and on when that does, at its own rate, however far `now` jumps. All methods give a new value or a reading of this
    one.
    """

    start: float
    end: float
    rate: float = 1.0
    playing: bool = True
    shown: float = 0.0
    since: float = 0.0
    follows: bool = False
    now: float = inf

    @staticmethod
    def of(start: float, end: float, rate: float, wall: float) -> Playback:
        """Playing from the start, now."""
        return Playback(start, end, rate, shown=start, since=wall)

    @staticmethod
    def following(start: float, end: float, now: float, wall: float) -> Playback:
        """Where the robot is, and on with it."""
        return Playback.of(start, end, 1.0, wall).look(wall, start, end, now).follow(wall)

    # --- reading ---

    def at(self, wall: float) -> float:
        """The time of the trajectory that is shown [s]."""
        passed = self.rate * max(wall - self.since, 0.0) if self.playing else 0.0
        return self._within(self.shown + passed)

    def ended(self, wall: float) -> bool:
        """Whether there is nothing left to play."""
        return self.at(wall) >= self._last

    def behind(self, wall: float) -> float:
        """How far what is shown lies behind where the robot is [s]."""
        return max(min(self.now, self.end) - self.at(wall), 0.0)

    @property
    def _last(self) -> float:
        return min(self.now, self.end) if self.follows else self.end

    def _within(self, t: float) -> float:
        return max(min(t, self._last), self.start)

    # --- changing: a new value ---

    def look(self, wall: float, start: float, end: float, now: float) -> Playback:
        """The trajectory goes from `start` to `end` now, and the robot is at `now` [s]."""
        grown = replace(self, start=start, end=max(end, now), now=now)
        return grown._anchored(grown.at(wall), wall)

    def play(self, wall: float) -> Playback:
        return replace(self._anchored(self.at(wall), wall), playing=True)

    def pause(self, wall: float) -> Playback:
        return replace(self._anchored(self.at(wall), wall), playing=False)

    def toggle(self, wall: float) -> Playback:
        """Play or pause; at the end of what goes no further, play again from the start."""
        if self.ended(wall) and not self.follows:
            return self.rewind(wall).play(wall)
        return self.pause(wall) if self.playing else self.play(wall)

    def seek(self, t: float, wall: float) -> Playback:
        """Go to t, as far as there is a trajectory; what is played from there no longer follows the robot."""
        free = replace(self, follows=False)
        return free._anchored(free._within(t), wall)

    def rewind(self, wall: float) -> Playback:
        """Go to the start."""
        return self.seek(self.start, wall)

    def skip(self, seconds: float, wall: float) -> Playback:
        """Forward, or back for a negative number."""
        return self.seek(self.at(wall) + seconds, wall)

    def follow(self, wall: float) -> Playback:
        """Go to where the robot is, and on with it."""
        return replace(self.seek(min(self.now, self.end), wall), follows=True, playing=True)

    def faster(self, wall: float) -> Playback:
        """The next higher of RATES."""
        return self.at_rate(min((r for r in RATES if r > self.rate), default=self.rate), wall)

    def slower(self, wall: float) -> Playback:
        """The next lower of RATES."""
        return self.at_rate(max((r for r in RATES if r < self.rate), default=self.rate), wall)

    def at_rate(self, rate: float, wall: float) -> Playback:
        """So many seconds of the trajectory in one second, from here on."""
        return replace(self._anchored(self.at(wall), wall), rate=rate)

    def _anchored(self, t: float, wall: float) -> Playback:
        return replace(self, shown=t, since=max(wall, self.since))
