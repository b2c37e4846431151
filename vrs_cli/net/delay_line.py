"""Compute arrival times of messages on a line with delays (pure; random numbers are seeded), and delay real sockets.

Messages stay in order, as with TCP. A lost message is sent again, as with TCP, so a loss is a delay too.

The notation of delays for users:

    200ms, constant 200ms        always the same
    normal 200ms 40ms            mean and standard deviation; never below 0
    gamma 200ms 80ms             mean and standard deviation
    bursty 50ms 400ms 5s 500ms   the delay in calm and in a burst, and the mean duration of calm and of a burst
    trace FILE                   measured delays: each line has a delay, or a time [s] and a delay; repeated at the end

A number without a unit is in seconds.

`DelayProxy` delays the bytes between real sockets: each piece sent to one end arrives at the other end after its delay.
Bytes travel in both directions unchanged and in order. If one end stops sending, the other end learns this after the
delay, too. The number of bytes in transit is bounded, so a slow reader slows down the sender.
"""

from __future__ import annotations

import asyncio
import socket
import struct
from bisect import bisect_right
from collections.abc import Callable, Sequence
from itertools import cycle
from math import exp, inf, isfinite, nan
from pathlib import Path
from random import Random
from typing import NamedTuple, Protocol

from msgspec import Struct

from vrs_cli.errors import NonexistentFile, UsageError, did_you_mean

RETRANSMIT = 0.2  # [s] time until a lost message is sent again: the minimum in Linux (TCP_RTO_MIN)
MAX_RETRANSMIT_S = 120.0  # [s] maximum time between tries; it doubles after each (RFC 6298, 5.5; Linux TCP_RTO_MAX)


class Delays(Protocol):
    """A model of the delays of a line."""

    def source(self, random: Random) -> Callable[[float], float]:
        """Return a function that returns the delay [s] of a message sent at t [s]; its calls must have rising t."""


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
        changes = 1.0 / self.calm_lasts + 1.0 / self.burst_lasts  # [1/s] decay rate of the correlation of the states
        chance, last = often_calm, 0.0  # the probability that the line is calm at the time `last` [s]

        def delay(t: float) -> float:
            nonlocal chance, last
            calm = random.random() < often_calm + (chance - often_calm) * exp(-changes * (t - last))
            chance, last = float(calm), t
            return self.calm if calm else self.burst

        return delay


class Trace(Struct, frozen=True):
    """Measured delays [s], repeated after the last one. With times [s], a delay is valid from its time to the next
    time, and the last one for the mean duration. Without times, each delay applies to one message."""

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
    """Delays of a line that loses messages with the probability `loss` and sends them again: after RETRANSMIT, then
    after twice that time, and so on.
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
        """Return the forward and the backward line of a connection."""
        seed = f"{self.seed} {connection}"
        return DelayLine(self.forward, f"{seed} forward"), DelayLine(self.backward, f"{seed} backward")


# --- the notation for users ------------------------------------------------------------------------------------------


MAX_DELAY_S = 3600.0  # [s] maximum delay
MAX_LOSS = 0.5
UNITS = (("ms", 1e-3), ("us", 1e-6), ("s", 1.0))


class DelayError(UsageError):
    """The error for a string, or a line of a file, that does not describe delays. vrs chose its code; VAL-II has
    none."""

    text = "No delay"


class DelayForm(Struct, frozen=True):
    """The notation of one kind of delays: the names of its durations. The last `lasting` durations must be above 0."""

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
    if not (words := text.split()):
        raise DelayError("which delays?", f"200ms, or one of {', '.join(KINDS)}")
    kind, given = words[0].lower(), words[1:]
    if kind == TRACE:
        return read_trace(text.strip()[len(TRACE) :].strip())
    if kind[0] in "0123456789.+-":
        kind, given = "constant", words
    if (form := FORMS.get(kind)) is None:
        raise DelayError(f"{text!r} is no kind of delays", did_you_mean(kind, KINDS, f"one of {', '.join(KINDS)}"))
    if len(given) != len(form.arguments.split()):
        raise DelayError(f"{text!r} is not {kind} {form.arguments}", "a duration for each, as 200ms or 0.2s")
    values = [parse_duration(one) for one in given]
    if form.lasting and min(values[-form.lasting :]) <= 0.0:
        raise DelayError(f"{text!r} has a state that lasts 0 s", "how long a state lasts is above 0")
    return form.make(*values)


def parse_duration(text: str) -> float:
    """Return the duration [s] in a string such as 200ms, 0.2s or 0.2, rounded to a nanosecond. Raises DelayError."""
    unit, factor = next((row for row in UNITS if text.lower().endswith(row[0])), ("", 1.0))
    try:
        seconds = float(text[: len(text) - len(unit)]) * factor
    except ValueError:
        raise DelayError(f"{text!r} is no duration", "as 200ms, 0.2s or 0.2") from None
    if not 0.0 <= seconds <= MAX_DELAY_S:
        raise DelayError(f"{text!r} is no delay", f"from 0 to {MAX_DELAY_S:g} s")
    return round(seconds, 9)


def parse_loss(text: str) -> float:
    """Return the fraction in a string such as 1% or 0.01. Raises DelayError for any other string, and for a fraction
    above MAX_LOSS."""
    try:
        share = float(text.removesuffix("%")) * (0.01 if text.endswith("%") else 1.0)
    except ValueError:
        raise DelayError(f"{text!r} is no share", "as 1% or 0.01") from None
    if not 0.0 <= share <= MAX_LOSS:
        raise DelayError(f"{text!r} is no share that may be lost", f"from 0 to {MAX_LOSS:.0%}")
    return share


def with_loss(delays: Delays, loss: float) -> Delays:
    """Return the delays of a line that loses the fraction `loss` of the messages and sends them again."""
    return Lossy(delays, loss) if loss else delays


# --- measured delays ---------------------------------------------------------------------------------------------


def read_trace(path: str) -> Trace:
    """Read measured delays from a file; # starts a comment. Raises NonexistentFile, and DelayError for a line other
    than a delay, or a time and a delay.
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


PIECE = 1 << 16  # maximum bytes that are read at once and delayed together: usually one message
MAX_BYTES_ON_WAY = 1 << 22  # maximum bytes in transit in one direction: enough for 10 MB/s with a delay of 0.4 s


class Endpoint(NamedTuple):
    host: str
    port: int

    def __str__(self) -> str:
        return f"[{self.host}]:{self.port}" if ":" in self.host else f"{self.host}:{self.port}"


class Time:
    """The time of the event loop [s]."""

    def now(self) -> float:
        return asyncio.get_running_loop().time()

    async def until(self, t: float) -> None:
        """Wait until the event loop's time is t [s]."""
        await asyncio.sleep(max(t - self.now(), 0.0))


class _Direction:
    """One direction of one connection. `held`: number of bytes in transit; `passed`: number of bytes delivered."""

    def __init__(self, line: DelayLine, time: Time) -> None:
        self.held = self.passed = 0
        self._line, self._time = line, time
        # arrival times [s] and pieces; an empty piece marks the end
        self._pieces: asyncio.Queue[tuple[float, bytes]] = asyncio.Queue()
        self._delivered = asyncio.Event()

    async def receive(self, reader: asyncio.StreamReader) -> None:
        """Read the sender's bytes until they end; pause while too many bytes are in transit."""
        while True:
            while self.held >= MAX_BYTES_ON_WAY:
                self._delivered.clear()
                await self._delivered.wait()
            piece = await reader.read(PIECE)
            self._pieces.put_nowait((self._line.arrival(self._time.now()), piece))
            self.held += len(piece)
            if not piece:
                return

    async def deliver(self, writer: asyncio.StreamWriter) -> None:
        """Write each piece at its arrival time."""
        while True:
            arrival, piece = await self._pieces.get()
            await self._time.until(arrival)
            if not piece:
                writer.write_eof()
                return
            writer.write(piece)
            self.passed += len(piece)
            await writer.drain()
            self.held -= len(piece)
            self._delivered.set()


class ProxyConnection:
    """A delayed connection from `peer`, in both directions."""

    def __init__(self, number: int, peer: str, ways: DelayWays, time: Time) -> None:
        self.number, self.peer = number, peer
        self.forward, self.backward = (_Direction(line, time) for line in ways.lines(number))

    async def carry(
        self,
        near: tuple[asyncio.StreamReader, asyncio.StreamWriter],
        far: tuple[asyncio.StreamReader, asyncio.StreamWriter],
    ) -> None:
        """Carry bytes until both directions have ended and all bytes have arrived. Raises OSError if one end is
        closed."""
        try:
            async with asyncio.TaskGroup() as group:
                group.create_task(self.forward.receive(near[0]))
                group.create_task(self.forward.deliver(far[1]))
                group.create_task(self.backward.receive(far[0]))
                group.create_task(self.backward.deliver(near[1]))
        except ExceptionGroup as several:
            raise several.exceptions[0] from None
        for _, writer in (near, far):
            writer.close()
            await writer.wait_closed()


class DelayProxy:
    """A listening socket that connects its clients to the target. `tell` takes messages about connections."""

    def __init__(
        self, target: Endpoint, ways: DelayWays, tell: Callable[[str], None], time: Time | None = None
    ) -> None:
        self.connections: dict[int, ProxyConnection] = {}
        self.count = 0  # number of connections so far
        self._target, self._ways, self._tell, self._time = target, ways, tell, time or Time()
        self._server: asyncio.Server | None = None
        self._tasks: set[asyncio.Task[None]] = set()

    async def listen(self, at: Endpoint) -> Endpoint:
        """Listen at an address; return it, with the port that the system chose if port 0 was given. Raises OSError."""
        self._server = await asyncio.start_server(self._accept, at.host, at.port)
        host, port = self._server.sockets[0].getsockname()[:2]
        return Endpoint(host, port)

    async def close(self) -> None:
        """Stop listening, and end all connections."""
        if self._server is not None:
            self._server.close()
        for task in tuple(self._tasks):
            task.cancel()
        await asyncio.gather(*self._tasks, return_exceptions=True)

    def _accept(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        self.count += 1
        peer = writer.get_extra_info("peername") or ("somebody who has gone", 0)
        connection = ProxyConnection(self.count, str(Endpoint(*peer[:2])), self._ways, self._time)
        task = asyncio.create_task(self._connect(connection, reader, writer))
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)

    async def _connect(
        self, connection: ProxyConnection, reader: asyncio.StreamReader, writer: asyncio.StreamWriter
    ) -> None:
        number = connection.number
        try:
            far = await asyncio.open_connection(*self._target)
        except OSError as error:
            self._tell(f"{number}: {self._target} cannot be reached: {error.strerror}")
            _reset(writer)
            return
        self.connections[number] = connection
        self._tell(f"{number}: {connection.peer} is connected")
        try:
            await connection.carry((reader, writer), far)
        except OSError as error:
            self._tell(f"{number}: {error.strerror or 'one end has closed it'}")
        finally:
            _reset(writer)
            _reset(far[1])
            del self.connections[number]
            there, back = connection.forward.passed, connection.backward.passed
            self._tell(f"{number}: over, {there} bytes there, {back} back")


def _reset(writer: asyncio.StreamWriter) -> None:
    """Reset a connection, so that the other end sees a failure. A connection that is already closed stays closed."""
    if not writer.transport.is_closing():
        writer.get_extra_info("socket").setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
    writer.transport.abort()
