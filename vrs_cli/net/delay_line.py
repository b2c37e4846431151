"""One direction of a line: when does what is sent now arrive? Pure: seconds in, seconds out; every random is seeded.

Order is kept, as TCP keeps it. What is lost is sent again after a while, as TCP does: loss is a delay too.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Callable
from itertools import cycle
from math import exp, inf
from random import Random
from typing import Protocol

from msgspec import Struct

RETRANSMIT = 0.2  # [s] until what was lost is sent again: the least that Linux waits (TCP_RTO_MIN)
LONGEST_WAIT = 120.0  # [s] between two tries, which double until then (RFC 6298, 5.5 and TCP_RTO_MAX)


class Delays(Protocol):
    """The delays of a line, as a value."""

    def source(self, random: Random) -> Callable[[float], float]:
        """What tells the delay [s] of something sent at t [s]; asked in the order of time."""


class Constant(Struct, frozen=True):
    """Always the same [s]."""

    seconds: float

    def source(self, random: Random) -> Callable[[float], float]:  # noqa: ARG002
        return lambda _t: self.seconds


class Normal(Struct, frozen=True):
    """Normally distributed [s], never below 0."""

    mean: float
    deviation: float

    def source(self, random: Random) -> Callable[[float], float]:
        return lambda _t: max(random.gauss(self.mean, self.deviation), 0.0)


class Gamma(Struct, frozen=True):
    """Gamma distributed [s]: many a little late, a few very late."""

    mean: float
    deviation: float

    def source(self, random: Random) -> Callable[[float], float]:
        if not (self.mean and self.deviation):
            return lambda _t: self.mean
        shape, scale = (self.mean / self.deviation) ** 2, self.deviation**2 / self.mean
        return lambda _t: random.gammavariate(shape, scale)


class Bursty(Struct, frozen=True):
    """Two states by turns (Gilbert's channel of 1960, in continuous time): the delay is `calm` or `burst` [s]. Each
    state lasts `calm_lasts` or `burst_lasts` [s] on average, exponentially distributed.
    """

    calm: float
    burst: float
    calm_lasts: float
    burst_lasts: float

    def source(self, random: Random) -> Callable[[float], float]:
        often_calm = self.calm_lasts / (self.calm_lasts + self.burst_lasts)
        changes = 1.0 / self.calm_lasts + 1.0 / self.burst_lasts  # [1/s]: a state is forgotten at this rate
        chance, last = often_calm, 0.0  # that it is calm, as far as was known at `last` [s]

        def delay(t: float) -> float:
            nonlocal chance, last
            calm = random.random() < often_calm + (chance - often_calm) * exp(-changes * (t - last))
            chance, last = float(calm), t
            return self.calm if calm else self.burst

        return delay


class Trace(Struct, frozen=True):
    """Delays [s] as they were measured, and over again at the end: each from its time [s] on, the last one as long as
    they last on average. Without times each is that of one message.
    """

    delays: tuple[float, ...]
    times: tuple[float, ...] = ()

    def source(self, random: Random) -> Callable[[float], float]:  # noqa: ARG002
        if not self.times:
            in_turn = cycle(self.delays)
            return lambda _t: next(in_turn)
        first, count = self.times[0], len(self.times)
        period = (self.times[-1] - first) * count / (count - 1) if count > 1 else 1.0
        begun: float | None = None

        def delay(t: float) -> float:
            nonlocal begun
            begun = t if begun is None else begun
            return self.delays[bisect_right(self.times, first + (t - begun) % period) - 1]

        return delay


class Lossy(Struct, frozen=True):
    """What gets lost, with this probability, is sent again after RETRANSMIT, then after twice that, and so on."""

    delays: Delays
    loss: float

    def source(self, random: Random) -> Callable[[float], float]:
        delay_of = self.delays.source(random)

        def delay(t: float) -> float:
            late, wait = 0.0, RETRANSMIT
            while random.random() < self.loss:
                late, wait = late + wait, min(2.0 * wait, LONGEST_WAIT)
            return late + delay_of(t)

        return delay


class DelayLine:
    """One direction of a connection. Order is kept: nothing overtakes what was sent before it."""

    def __init__(self, delays: Delays, seed: str = "") -> None:
        self._delay = delays.source(Random(seed))
        self._last = -inf

    def arrival(self, t: float) -> float:
        """When what is sent at t [s] arrives [s]; asked in the order of sending."""
        self._last = max(self._last, t + self._delay(t))
        return self._last


class DelayWays(Struct, frozen=True):
    """The way there and the way back, as a value. Each connection has lines of its own, the same for the same seed."""

    forward: Delays
    backward: Delays
    seed: int = 1

    def lines(self, connection: int | str) -> tuple[DelayLine, DelayLine]:
        """Forward and backward."""
        seed = f"{self.seed} {connection}"
        return DelayLine(self.forward, f"{seed} forward"), DelayLine(self.backward, f"{seed} backward")
