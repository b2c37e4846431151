"""Estimate a remote clock, and how long a message takes there and back, from exchanges of four times; or, from messages
in one direction alone, as well as that can be known. Pure.

As NTP does it (RFC 5905, sections 8 and 10): the exchange with the shortest round trip is the nearest to the truth. Its
offset is wrong by half of the difference between both ways, so by half of its round trip at most.
"""

from __future__ import annotations

from bisect import bisect_left, insort
from collections import deque
from collections.abc import Sequence
from math import sqrt
from operator import attrgetter
from typing import Generic, NamedTuple, TypeVar

from msgspec import Struct

from vrs_cli.errors import IllegalValue

WINDOW = 300.0  # [s] that exchanges count for
PARTS = 16  # of the window: the best exchange of each tells how the clocks drift apart
FEWEST = 4  # such exchanges
SURE = 2.0  # a drift of fewer standard deviations is none
FINEST = 1e-6  # [s] no clock tells smaller differences
MOST_DRIFT = 500e-6  # of a sound clock (RFC 5905, section 7.1: PHI is 15e-6, what can be corrected 500e-6)


class Exchange(NamedTuple):
    """A message and its answer. In the middle of it, `at` by the clock here [s], the clock there was `offset` ahead, if
    both ways took as long. `round_trip`: how long both took, D_f + D_b [s]; below 0 only if a clock was set meanwhile.
    """

    at: float
    offset: float
    round_trip: float


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
        """Take the latest exchange: a message sent at t0 arrived at t1, was answered at t2, and the answer came at t3
        [s]; t0 and t3 are by the clock here. If it does not fit the others, a clock was set, and they are forgotten.
        """
        new = Exchange((t0 + t3) / 2.0, ((t1 - t0) + (t2 - t3)) / 2.0, (t3 - t0) - (t2 - t1))
        if new.round_trip < -FINEST:
            return
        best = min(self._exchanges, key=_round_trip, default=new)
        may_be = (best.round_trip + new.round_trip) / 2.0 + MOST_DRIFT * abs(new.at - best.at) + FINEST
        if abs(new.offset - best.offset) > may_be:
            self._exchanges.clear()
        self._exchanges.append(new)
        while self._exchanges[0].at < new.at - self.window:
            self._exchanges.popleft()

    def __len__(self) -> int:
        return len(self._exchanges)

    @property
    def estimate(self) -> Estimate | None:
        """Return what all exchanges say together; None before the first."""
        if not self._exchanges:
            return None
        first, length = self._exchanges[0].at, self.window / PARTS
        parts: dict[int, Exchange] = {}  # the best exchange of each part of the window
        for one in self._exchanges:
            part = int((one.at - first) / length)
            if part not in parts or one.round_trip < parts[part].round_trip:
                parts[part] = one
        best = min(self._exchanges, key=_round_trip)
        return Estimate(best.at, best.offset, _drift(list(parts.values())), max(best.round_trip, 0.0))

    def round_trip(self, share: float) -> float:
        """The D_f + D_b that this share of the exchanges did not exceed [s]: 0 the least, 0.5 the median, 1 the most.
        Raises IndexError before the first.
        """
        trips = sorted(one.round_trip for one in self._exchanges)
        return trips[min(int(share * len(trips)), len(trips) - 1)]


class OneWay:
    """A remote clock, from messages in one direction that tell when they were sent. Of each part of the `window` [s]
    the message with the shortest way is kept (a minimum filter). How long that way was is known only as half of the
    shortest round trip, which the sender measures; the offset is wrong by the other half at most.
    """

    def __init__(self, window: float = 60.0) -> None:
        self.window = window
        self._best: dict[int, Exchange] = {}  # by part of the window

    def heard(self, sent: float, came: float, round_trip: float = 0.0) -> None:
        """Take a message that was sent at `sent` by the clock there, and came at `came` by the clock here [s]."""
        part, new = int(came // (self.window / PARTS)), Exchange(came, sent - came + round_trip / 2.0, round_trip)
        before = self._best.get(part)
        if before is None:
            self._best = {old: one for old, one in self._best.items() if part - PARTS < old <= part}
        if before is None or new.offset > before.offset:
            self._best[part] = new

    @property
    def estimate(self) -> Estimate | None:
        """Return what all messages say together; None before the first."""
        if not self._best:
            return None
        best = list(self._best.values())
        at, drift = best[-1].at, _slope(best)
        offset = max(one.offset + drift * (at - one.at) for one in best)
        return Estimate(at, offset, drift, best[-1].round_trip)


_round_trip = attrgetter("round_trip")


def _drift(exchanges: Sequence[Exchange]) -> float:
    """The slope of offsets over time, no greater than that of a sound clock."""
    return max(-MOST_DRIFT, min(_slope(exchanges), MOST_DRIFT))


def _slope(exchanges: Sequence[Exchange]) -> float:
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
    return 0.0 if abs(slope) < SURE * deviation else slope


JITTER_WINDOW = 200  # samples by which the jitter is measured
USUAL_PERCENTILE = 95.0

T = TypeVar("T")


class Playout(Generic[T]):
    """`percentile`: so many of a hundred samples are to be there when they are due. What waits is bounded by `most`."""

    def __init__(
        self, percentile: float = USUAL_PERCENTILE, window: int = JITTER_WINDOW, most: int = 10 * JITTER_WINDOW
    ) -> None:
        if not 0.0 < percentile <= 100.0:
            raise IllegalValue(
                f"percentile {percentile:g}", "above 0, up to 100", value=percentile, lower=0.0, upper=100.0
            )
        self.percentile, self.window = percentile, window
        self._waiting: deque[tuple[float, T]] = deque(maxlen=most)
        self._transits: deque[float] = deque()
        self._ordered: list[float] = []
        self._shown_at = float("-inf")
        self._shown: T | None = None

    @property
    def delay(self) -> float:
        """The time between the sending of a sample and its showing [s], by both clocks; 0 before the first arrival."""
        count = len(self._ordered)
        return self._ordered[min(int(count * self.percentile / 100.0), count - 1)] if count else 0.0

    def put(self, sent: float, value: T, arrived: float) -> None:
        """Take a sample that was sent and has arrived at these times [s], in the order of sending."""
        transit = arrived - sent
        self._transits.append(transit)
        insort(self._ordered, transit)
        if len(self._transits) > self.window:
            del self._ordered[bisect_left(self._ordered, self._transits.popleft())]
        self._waiting.append((sent, value))

    def take(self, now: float) -> T | None:
        """Return the last sample that is due, again if no other is; None before the first. The time that is shown never
        goes back, also when the delay grows.
        """
        if not self._transits:
            return None
        self._shown_at = max(self._shown_at, now - self.delay)
        while self._waiting and self._waiting[0][0] <= self._shown_at:
            self._shown = self._waiting.popleft()[1]
        return self._shown
