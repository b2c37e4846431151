"""What a clock elsewhere shows, and how long a message takes there and back, from exchanges of four times. Pure.

As NTP does it (RFC 5905, sections 8 and 10): of the exchanges the one with the least round trip is the nearest to the
truth. Its offset is wrong by half of what the ways there and back differ in, so by half of its round trip at most.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from math import sqrt
from operator import attrgetter

from msgspec import Struct

WINDOW = 300.0  # [s] that exchanges count for
PARTS = 16  # of the window: the best exchange of each tells how the clocks drift apart
FEWEST = 4  # such exchanges
SURE = 2.0  # a drift of fewer standard deviations is none
FINEST = 1e-6  # [s] no clock tells smaller differences
MOST_DRIFT = 500e-6  # of a sound clock (RFC 5905, section 7.1: PHI is 15e-6, what can be corrected 500e-6)


class Exchange(Struct, frozen=True):
    """A message was sent at t0, came there at t1, was answered at t2, and its answer was here at t3 [s]: t0 and t3 by
    the clock here, t1 and t2 by the one there.
    """

    t0: float
    t1: float
    t2: float
    t3: float

    @property
    def offset(self) -> float:
        """How far the clock there is ahead, if both ways take as long [s]."""
        return ((self.t1 - self.t0) + (self.t2 - self.t3)) / 2.0

    @property
    def round_trip(self) -> float:
        """How long both ways took, D_f + D_b [s]; below 0 only where a clock was set meanwhile."""
        return (self.t3 - self.t0) - (self.t2 - self.t1)

    @property
    def at(self) -> float:
        """The middle of it, by the clock here [s]."""
        return (self.t0 + self.t3) / 2.0


class Estimate(Struct, frozen=True):
    """The clock there is `offset` ahead of the one here at `at` [s], and `drift` more with every second. `round_trip`:
    the least D_f + D_b; the offset is wrong by half of that at most.
    """

    at: float
    offset: float
    drift: float
    round_trip: float

    def here(self, t: float) -> float:
        """What the clock here shows when the one there shows t."""
        return self.at + (t - self.offset - self.at) / (1.0 + self.drift)

    def there(self, t: float) -> float:
        """Return the remote clock's time at the local time t."""
        return t + self.offset + self.drift * (t - self.at)


class TimeSync:
    """Keeps the exchanges of a `window` [s]."""

    def __init__(self, window: float = WINDOW) -> None:
        self.window = window
        self._exchanges: deque[Exchange] = deque()

    def heard(self, t0: float, t1: float, t2: float, t3: float) -> None:
        """One more exchange, the latest. Where it cannot be of clocks that went on as before, one of them was set: what
        was known is forgotten.
        """
        new = Exchange(t0, t1, t2, t3)
        if new.round_trip < -FINEST:
            return
        best = min(self._exchanges, key=_round_trip, default=new)
        may_be = (best.round_trip + new.round_trip) / 2.0 + MOST_DRIFT * abs(new.at - best.at) + FINEST
        if abs(new.offset - best.offset) > may_be:
            self._exchanges.clear()
        self._exchanges.append(new)
        while self._exchanges[0].at < new.at - self.window:
            self._exchanges.popleft()

    @property
    def estimate(self) -> Estimate | None:
        """What all of them say; None before the first."""
        if not self._exchanges:
            return None
        best = min(self._exchanges, key=_round_trip)
        return Estimate(best.at, best.offset, _drift(self._best_of_parts()), max(best.round_trip, 0.0))

    def round_trip(self, share: float) -> float:
        """The D_f + D_b that this share of the exchanges did not exceed [s]: 0 the least, 0.5 the median, 1 the most.
        Raises IndexError before the first.
        """
        trips = sorted(one.round_trip for one in self._exchanges)
        return trips[min(int(share * len(trips)), len(trips) - 1)]

    def _best_of_parts(self) -> list[Exchange]:
        first, length = self._exchanges[0].at, self.window / PARTS
        best: dict[int, Exchange] = {}
        for one in self._exchanges:
            part = int((one.at - first) / length)
            if part not in best or one.round_trip < best[part].round_trip:
                best[part] = one
        return list(best.values())


_round_trip = attrgetter("round_trip")


def _drift(exchanges: Sequence[Exchange]) -> float:
    """The slope of offsets over time, by least squares; 0 where it may as well be chance."""
    count = len(exchanges)
    if count < FEWEST:
        return 0.0
    middle = sum(one.at for one in exchanges) / count
    mean = sum(one.offset for one in exchanges) / count
    spread = sum((one.at - middle) ** 2 for one in exchanges)
    slope = sum((one.at - middle) * (one.offset - mean) for one in exchanges) / spread
    left = sum((one.offset - mean - slope * (one.at - middle)) ** 2 for one in exchanges)
    deviation = sqrt(left / (count - 2) / spread)
    if abs(slope) < SURE * deviation:
        return 0.0
    return max(-MOST_DRIFT, min(slope, MOST_DRIFT))
