"""Estimate a remote clock and the round trip of messages, from exchanges with four time stamps, or from messages in one
direction only; show samples from a line with jitter as evenly as they were sent (`Playout`). Pure.

The estimate is that of NTP (RFC 5905, sections 8 and 10): the exchange with the shortest round trip is the most exact.
The error of its offset is half the difference of the delays D_f and D_b, so at most half of its round trip.
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

WINDOW = 300.0  # [s] time for which an exchange is used
PARTS = 16  # number of parts into which the window is divided; the drift is fitted to the best exchange of each part
MIN_FIT_EXCHANGES = 4  # minimum number of exchanges for a fit; with fewer the drift is set to 0
SIGNIFICANT = 2.0  # a drift below this multiple of its standard deviation is set to 0
RESOLUTION = 1e-6  # [s] resolution of clocks
MAX_DRIFT = 500e-6  # [s/s] maximum drift of a working clock: the largest that NTP corrects (RFC 5905, section 7.1)


class Exchange(NamedTuple):
    """A message and its answer. `at`: the local time midway between sending the message and receiving the answer [s];
    `offset`: how far the remote clock was ahead then [s], if both directions took the same time.

    `round_trip`: the time of both directions, D_f + D_b [s]; negative only if a clock was set meanwhile.
    """

    at: float
    offset: float
    round_trip: float


class Estimate(Struct, frozen=True):
    """An estimate of a remote clock: at local time `at` [s] it is `offset` ahead of the local clock [s], and the offset
    grows by `drift` [s/s]. `round_trip`: the shortest D_f + D_b [s]; the error of the offset is at most half of it."""

    at: float
    offset: float
    drift: float
    round_trip: float

    def here(self, t: float) -> float:
        """Return the local time at which the remote clock shows t [s]."""
        return self.at + (t - self.offset - self.at) / (1.0 + self.drift)

    def there(self, t: float) -> float:
        """Return the remote clock's time at the local time t [s]."""
        return t + self.offset + self.drift * (t - self.at)


class TimeSync:
    """An estimator of a remote clock from the exchanges of the last `window` [s]."""

    def __init__(self, window: float = WINDOW) -> None:
        self.window = window
        self._exchanges: deque[Exchange] = deque()

    def hear(self, t0: float, t1: float, t2: float, t3: float) -> None:
        """Add an exchange: a message sent at t0 arrived at t1, was answered at t2, and the answer arrived at t3 [s]; t0
        and t3 are by the local clock. If it contradicts earlier exchanges, a clock was set: drop the earlier ones.
        """
        new = Exchange((t0 + t3) / 2.0, ((t1 - t0) + (t2 - t3)) / 2.0, (t3 - t0) - (t2 - t1))
        if new.round_trip < -RESOLUTION:
            return
        best = min(self._exchanges, key=_round_trip, default=new)
        may_be = (best.round_trip + new.round_trip) / 2.0 + MAX_DRIFT * abs(new.at - best.at) + RESOLUTION
        if abs(new.offset - best.offset) > may_be:
            self._exchanges.clear()
        self._exchanges.append(new)
        while self._exchanges[0].at < new.at - self.window:
            self._exchanges.popleft()

    def __len__(self) -> int:
        return len(self._exchanges)

    @property
    def estimate(self) -> Estimate | None:
        """Return the estimate from all exchanges; None before the first one."""
        if not self._exchanges:
            return None
        first, length = self._exchanges[0].at, self.window / PARTS
        parts: dict[int, Exchange] = {}  # the best exchange of each part of the window
        for one in self._exchanges:
            part = int((one.at - first) / length)
            if part not in parts or one.round_trip < parts[part].round_trip:
                parts[part] = one
        best = min(self._exchanges, key=_round_trip)
        drift = max(-MAX_DRIFT, min(_slope(list(parts.values())), MAX_DRIFT))
        return Estimate(best.at, best.offset, drift, max(best.round_trip, 0.0))

    def round_trip(self, share: float) -> float:
        """Return a quantile of the measured D_f + D_b [s]: `share` 0 is the shortest, 0.5 the median, 1 the longest.
        Raises IndexError before the first exchange.
        """
        trips = sorted(one.round_trip for one in self._exchanges)
        return trips[min(int(share * len(trips)), len(trips) - 1)]


class OneWay:
    """An estimator of a remote clock from messages in one direction that contain their time of sending.

    For each part of the `window` [s] it keeps the message with the shortest delay (a minimum filter). It assumes that
    this delay is half of the shortest round trip, which the sender measures; the error of the offset is at most this
    half.
    """

    def __init__(self, window: float = 60.0) -> None:
        self.window = window
        self._best: dict[int, Exchange] = {}  # the best message of each part of the window

    def hear(self, sent: float, came: float, round_trip: float = 0.0) -> None:
        """Add a message that was sent at `sent` by the remote clock and arrived at `came` by the local clock [s].
        `round_trip`: the shortest round trip that the sender has measured [s]."""
        part, new = int(came // (self.window / PARTS)), Exchange(came, sent - came + round_trip / 2.0, round_trip)
        if (before := self._best.get(part)) is None:
            self._best = {old: one for old, one in self._best.items() if part - PARTS < old <= part}
        if before is None or new.offset > before.offset:
            self._best[part] = new

    @property
    def estimate(self) -> Estimate | None:
        """Return the estimate from all messages; None before the first one."""
        if not self._best:
            return None
        best = list(self._best.values())
        at, drift = best[-1].at, _slope(best)
        offset = max(one.offset + drift * (at - one.at) for one in best)
        return Estimate(at, offset, drift, best[-1].round_trip)


_round_trip = attrgetter("round_trip")


def _slope(exchanges: Sequence[Exchange]) -> float:
    """Return the least-squares slope of the offsets over time [s/s]; 0 if it is not significant."""
    count = len(exchanges)
    if count < MIN_FIT_EXCHANGES:
        return 0.0
    middle = sum(one.at for one in exchanges) / count
    mean = sum(one.offset for one in exchanges) / count
    spread = sum((one.at - middle) ** 2 for one in exchanges)
    slope = sum((one.at - middle) * (one.offset - mean) for one in exchanges) / spread
    left = sum((one.offset - mean - slope * (one.at - middle)) ** 2 for one in exchanges)
    deviation = sqrt(left / (count - 2) / spread)
    return 0.0 if abs(slope) < SIGNIFICANT * deviation else slope


# --- samples ---------------------------------------------------------------------------------------------------------

JITTER_WINDOW = 200  # number of samples from which the jitter is measured
USUAL_PERCENTILE = 95.0  # default percentage of samples that must arrive in time

T = TypeVar("T")


class Playout(Generic[T]):
    """A playout buffer: it delays samples a little, so that they are shown as evenly as they were sent.

    `percentile`: the percentage of samples that must arrive before they are shown. `window`: the number of samples from
    which the delay is measured. `most`: the maximum number of waiting samples. Times of sending and of arrival may be
    from different clocks that run at the same rate.
    """

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
        """Return the difference between the time of showing a sample, by the local clock, and its time of sending, by
        the sender's clock [s]; 0 before the first arrival."""
        count = len(self._ordered)
        return self._ordered[min(int(count * self.percentile / 100.0), count - 1)] if count else 0.0

    def put(self, sent: float, value: T, arrived: float) -> None:
        """Add a sample with its times of sending and arrival [s]. Add samples in the order of sending."""
        transit = arrived - sent
        self._transits.append(transit)
        insort(self._ordered, transit)
        if len(self._transits) > self.window:
            del self._ordered[bisect_left(self._ordered, self._transits.popleft())]
        self._waiting.append((sent, value))

    def take(self, now: float) -> T | None:
        """Return the sample to show at local time `now` [s]; None before the first. The shown time never goes back,
        even if the delay grows.
        """
        if not self._transits:
            return None
        self._shown_at = max(self._shown_at, now - self.delay)
        while self._waiting and self._waiting[0][0] <= self._shown_at:
            self._shown = self._waiting.popleft()[1]
        return self._shown
