"""Playing a trajectory: which time of it is shown at which time of the day. Pure: the wall clock is an argument."""

from __future__ import annotations

from msgspec import Struct
from msgspec.structs import replace

RATES = (0.1, 0.25, 0.5, 1.0, 2.0, 4.0, 10.0)  # the steps of faster and slower


class Playback(Struct, frozen=True):
    """From `start` to `end` [s] of a trajectory, `rate` seconds of it in one second.

    At the wall time `since` [s] it showed `shown` [s]. All methods give a new value or a reading of this one.
    """

    start: float
    end: float
    rate: float = 1.0
    playing: bool = True
    shown: float = 0.0
    since: float = 0.0

    @staticmethod
    def of(start: float, end: float, rate: float, wall: float) -> Playback:
        """Playing from the start, now."""
        return Playback(start, end, rate, shown=start, since=wall)

    def at(self, wall: float) -> float:
        """The time of the trajectory that is shown [s]."""
        passed = self.rate * (wall - self.since) if self.playing else 0.0
        return self._within(self.shown + passed)

    def ended(self, wall: float) -> bool:
        """Whether there is nothing left to play."""
        return self.at(wall) >= self.end

    def toggled(self, wall: float) -> Playback:
        """Play or pause; at the end, play again from the start."""
        if self.ended(wall):
            return replace(self._anchored(self.start, wall), playing=True)
        return replace(self._anchored(self.at(wall), wall), playing=not self.playing)

    def sought(self, t: float, wall: float) -> Playback:
        """Go to t, as far as there is a trajectory."""
        return self._anchored(self._within(t), wall)

    def skipped(self, seconds: float, wall: float) -> Playback:
        """Forward, or back for a negative number."""
        return self.sought(self.at(wall) + seconds, wall)

    def faster(self, wall: float) -> Playback:
        """The next higher of RATES."""
        return self._at_rate(min((r for r in RATES if r > self.rate), default=self.rate), wall)

    def slower(self, wall: float) -> Playback:
        """The next lower of RATES."""
        return self._at_rate(max((r for r in RATES if r < self.rate), default=self.rate), wall)

    def _at_rate(self, rate: float, wall: float) -> Playback:
        return replace(self._anchored(self.at(wall), wall), rate=rate)

    def _anchored(self, t: float, wall: float) -> Playback:
        return replace(self, shown=t, since=wall)

    def _within(self, t: float) -> float:
        return min(max(t, self.start), self.end)
