"""Compute arrival times of messages on a line with delays. Pure; random numbers are seeded.

Messages stay in order, as with TCP. A lost message is sent again later, as TCP does: so loss is a delay, too.

Delays as people write them:

    200ms, constant 200ms        always the same
    normal 200ms 40ms            mean and standard deviation; never below 0
    gamma 200ms 80ms             mean and standard deviation
    bursty 50ms 400ms 5s 500ms   the delay in calm and in a burst, and how long each lasts on average
    trace FILE                   as measured: a line is a delay, or a time [s] and a delay; begun again at its end

A number without a unit is in seconds.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Callable, Sequence
from itertools import cycle
from math import exp, inf, isfinite, nan
from pathlib import Path
from random import Random
from typing import Protocol

from msgspec import Struct

from vrs_cli.errors import NonexistentFile, UsageError, did_you_mean

RETRANSMIT = 0.2  # [s] until a lost message is sent again: the minimum of Linux (TCP_RTO_MIN)
MAX_RETRANSMIT_S = 120.0  # maximum time between two tries; it doubles up to this (RFC 6298, 5.5; TCP_RTO_MAX)


class Delays(Protocol):
    """A model of the delays of a line."""

    def source(self, random: Random) -> Callable[[float], float]:
        """Return a function that returns the delay [s] of a message sent at t [s]; call it in the order of time."""


class Constant(Struct, frozen=True):
    """A constant delay [s]."""

    seconds: float

    def source(self, random: Random) -> Callable[[float], float]:  # noqa: ARG002
        return lambda _t: self.seconds


class Normal(Struct, frozen=True):
    """Normally distributed delays [s], never below 0."""

    mean: float
    deviation: float

    def source(self, random: Random) -> Callable[[float], float]:
        return lambda _t: max(random.gauss(self.mean, self.deviation), 0.0)


class Gamma(Struct, frozen=True):
    """Gamma distributed delays [s]: many are short, a few very long."""

    mean: float
    deviation: float

    def source(self, random: Random) -> Callable[[float], float]:
        if not (self.mean and self.deviation):
            return lambda _t: self.mean
        shape, scale = (self.mean / self.deviation) ** 2, self.deviation**2 / self.mean
        return lambda _t: random.gammavariate(shape, scale)


class Bursty(Struct, frozen=True):
    """Delays with two states (Gilbert's channel of 1960, in continuous time): `calm` or `burst` [s]. The states last
    `calm_lasts` and `burst_lasts` [s] on average, exponentially distributed.
    """

    calm: float
    burst: float
    calm_lasts: float
    burst_lasts: float

    def source(self, random: Random) -> Callable[[float], float]:
        often_calm = self.calm_lasts / (self.calm_lasts + self.burst_lasts)
        changes = 1.0 / self.calm_lasts + 1.0 / self.burst_lasts  # [1/s] decay of the memory of a state
        chance, last = often_calm, 0.0  # the probability of the state calm, computed at `last` [s]

        def delay(t: float) -> float:
            nonlocal chance, last
            calm = random.random() < often_calm + (chance - often_calm) * exp(-changes * (t - last))
            chance, last = float(calm), t
            return self.calm if calm else self.burst

        return delay


class Trace(Struct, frozen=True):
    """Measured delays [s], which repeat at the end: each is valid from its time [s] on, the last one for the average
    duration. Without times each is the delay of one message.
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
    """Delays of a line that loses messages with this probability and sends them again: after RETRANSMIT, after twice
    that, and so on.
    """

    delays: Delays
    loss: float

    def source(self, random: Random) -> Callable[[float], float]:
        delay_of = self.delays.source(random)

        def delay(t: float) -> float:
            late, wait = 0.0, RETRANSMIT
            while random.random() < self.loss:
                late, wait = late + wait, min(2.0 * wait, MAX_RETRANSMIT_S)
            return late + delay_of(t)

        return delay


class DelayLine:
    """One direction of a delayed connection. Messages arrive in the order of sending."""

    def __init__(self, delays: Delays, seed: str = "") -> None:
        self._delay = delays.source(Random(seed))
        self._last = -inf

    def arrival(self, t: float) -> float:
        """Return the arrival time [s] of a message sent at t [s]; call it in the order of sending."""
        self._last = max(self._last, t + self._delay(t))
        return self._last


class DelayWays(Struct, frozen=True):
    """The delays of both directions of a connection. The same seed gives a connection the same delays."""

    forward: Delays
    backward: Delays
    seed: int = 1

    def lines(self, connection: int | str) -> tuple[DelayLine, DelayLine]:
        """Return the lines forward and backward of a connection."""
        seed = f"{self.seed} {connection}"
        return DelayLine(self.forward, f"{seed} forward"), DelayLine(self.backward, f"{seed} backward")


# --- delays as people write them -------------------------------------------------------------------------------------


MAX_DELAY_S = 3600.0  # a delay [s]
MAX_LOSS = 0.5
UNITS = (("ms", 1e-3), ("us", 1e-6), ("s", 1.0))


class DelayError(UsageError):
    """The error for a text, or a line of a file, that is not a valid description of delays. (The code is ours.)"""

    text = "No delay"


class DelayForm(Struct, frozen=True):
    """The written form of a kind of delays and its durations; the last `lasting` durations must be above 0."""

    make: Callable[..., Delays]
    arguments: str
    lasting: int = 0


FORMS = {
    "constant": DelayForm(Constant, "DELAY"),
    "normal": DelayForm(Normal, "MEAN DEVIATION"),
    "gamma": DelayForm(Gamma, "MEAN DEVIATION"),
    "bursty": DelayForm(Bursty, "CALM BURST CALM_LASTS BURST_LASTS", lasting=2),
}
TRACE = "trace"
KINDS = (*FORMS, TRACE)


def parse_delays(text: str) -> Delays:
    """Read delays in the notation for users. Raises DelayError, and NonexistentFile for a missing trace."""
    words = text.split()
    if not words:
        raise DelayError("which delays?", f"200ms, or one of {', '.join(KINDS)}")
    kind, given = words[0].lower(), words[1:]
    if kind == TRACE:
        return read_trace(text.strip()[len(TRACE) :].strip())
    if kind[0] in "0123456789.+-":
        kind, given = "constant", words
    form = FORMS.get(kind)
    if form is None:
        raise DelayError(f"{text!r} is no kind of delays", did_you_mean(kind, KINDS, f"one of {', '.join(KINDS)}"))
    if len(given) != len(form.arguments.split()):
        raise DelayError(f"{text!r} is not {kind} {form.arguments}", "a duration for each, as 200ms or 0.2s")
    values = [parse_duration(one) for one in given]
    if form.lasting and min(values[-form.lasting :]) <= 0.0:
        raise DelayError(f"{text!r} has a state that lasts 0 s", "how long a state lasts is above 0")
    return form.make(*values)


def parse_duration(text: str) -> float:
    """Read a duration such as 200ms, 0.2s or 0.2 [s], to a nanosecond. Raises DelayError."""
    unit, factor = next((row for row in UNITS if text.lower().endswith(row[0])), ("", 1.0))
    try:
        seconds = float(text[: len(text) - len(unit)]) * factor
    except ValueError:
        raise DelayError(f"{text!r} is no duration", "as 200ms, 0.2s or 0.2") from None
    if not 0.0 <= seconds <= MAX_DELAY_S:
        raise DelayError(f"{text!r} is no delay", f"from 0 to {MAX_DELAY_S:g} s")
    return round(seconds, 9)


def parse_loss(text: str) -> float:
    """Read a share such as 1% or 0.01. Raises DelayError, also for one above MAX_LOSS."""
    try:
        share = float(text.removesuffix("%")) * (0.01 if text.endswith("%") else 1.0)
    except ValueError:
        raise DelayError(f"{text!r} is no share", "as 1% or 0.01") from None
    if not 0.0 <= share <= MAX_LOSS:
        raise DelayError(f"{text!r} is no share that may be lost", f"from 0 to {MAX_LOSS:.0%}")
    return share


def with_loss(delays: Delays, loss: float) -> Delays:
    """Return the delays of a line that loses this share of messages and sends them again."""
    return Lossy(delays, loss) if loss else delays


# --- measured delays ---------------------------------------------------------------------------------------------


def read_trace(path: str) -> Trace:
    """Read the delays of a file; a # begins a comment. Raises NonexistentFile, and DelayError for a line that is
    neither a delay nor a time and a delay.
    """
    if not path:
        raise DelayError("a trace is in a file", "trace FILE")
    try:
        lines = Path(path).read_text(encoding="utf-8", errors="replace").splitlines()
    except OSError as error:
        raise NonexistentFile(f"{path} cannot be read: {error.strerror}") from None
    written = ((f"{path}:{number}", line.partition("#")[0].split()) for number, line in enumerate(lines, 1))
    rows = {where: _row(where, words) for where, words in written if words}
    if not rows:
        raise DelayError(f"{path} holds no delay", "a line is a delay, or a time and a delay")
    delays, times = tuple(delay for delay, _ in rows.values()), tuple(t for _, t in rows.values() if t is not None)
    for where, (_, time) in rows.items() if times else ():
        if time is None:
            raise DelayError(f"{where} has no time, and others have", "a time on each line, or on none")
    for where, before, time in zip(list(rows)[1:], times, times[1:], strict=False):
        if time <= before:
            raise DelayError(f"{where} is not later than the line before", "times grow from line to line")
    return Trace(delays, times)


def _row(where: str, words: Sequence[str]) -> tuple[float, float | None]:
    """Read a line of a trace: the delay [s], and the time [s] if the line has one. Raises DelayError."""
    if len(words) > 2:
        raise DelayError(f"{where} has {len(words)} values", "a line is a delay, or a time and a delay")
    try:
        delay = parse_duration(words[-1])
    except DelayError as error:
        raise DelayError(f"{where}: {error.detail}", error.hint) from None
    if len(words) < 2:
        return delay, None
    try:
        time = float(words[0])
    except ValueError:
        time = nan
    if not isfinite(time):
        raise DelayError(f"{where}: {words[0]!r} is no time", "a number of seconds")
    return delay, time
