"""A playout buffer: it shows samples from a line with jitter as evenly as they were sent, a little later. Pure.

The delay is measured, so that a share of the samples is there in time. Times of sending and of arrival may be of
different clocks, as long as these run alike.
"""

from __future__ import annotations

from bisect import bisect_left, insort
from collections import deque
from typing import Generic, TypeVar

from vrs_cli.errors import IllegalValue

WINDOW = 200  # samples by which the jitter is measured
USUAL_PERCENTILE = 95.0

T = TypeVar("T")


class Playout(Generic[T]):
    """`percentile`: so many of a hundred samples are to be there when they are due. What waits is bounded by `most`."""

    def __init__(self, percentile: float = USUAL_PERCENTILE, window: int = WINDOW, most: int = 10 * WINDOW) -> None:
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
