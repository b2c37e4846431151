"""A client of a served robot over sockets. It connects again after a cut, until the robot is let go.

    client = Client("ws://127.0.0.1:8765", hello_of("token"))
    await client.open()                     # the robot is there: client.far.mirror
    done = await client.ask(lambda id: Line(id, "READY"))
    await client.close()

Between two attempts it waits for a random time that grows: clients that were cut together do not come back together.
"""

from __future__ import annotations

import asyncio
import os
import re
import ssl
import time
from asyncio import Event, Future, Task
from collections.abc import AsyncIterator, Callable
from contextlib import suppress
from functools import partial
from math import inf
from pathlib import Path
from random import Random
from urllib.parse import urlsplit

from msgspec import structs
from websockets.asyncio.client import ClientConnection as Socket
from websockets.asyncio.client import connect
from websockets.exceptions import ConnectionClosed, InvalidMessage, InvalidStatus, WebSocketException

from vrs_cli.errors import FileError, RequestRefused, UsageError, VrsError
from vrs_cli.files.opening import reason
from vrs_cli.interfaces.port.port import checked
from vrs_cli.net import messages
from vrs_cli.net.far_end import FarEnd
from vrs_cli.net.messages import PORT, Done, Request, ServerMessage
from vrs_cli.net.mirror import WINDOW, Mirror
from vrs_cli.net.protocol import SERVER_BYTES
from vrs_cli.net.timesync import USUAL_PERCENTILE, Playout
from vrs_cli.wire.codec import Encoding

OPENING = 10.0  # [s] that each of two handshakes takes at most: of the socket, and hello
KEEPALIVE, SILENT = 2.0, 10.0  # [s] between two pings of the socket, and until one without an answer cuts it
CLOSING = 2.0  # [s] that closing takes at most
LOOPBACK = ("localhost", "127.0.0.1", "::1")
RUNNING, A_ROBOT = "is the server running? vrs serve", "is it a robot? vrs serve"
TRUST = "name its file with --ca, in Python with ca="
MISTRUST = {  # hints by OpenSSL's number of a certificate error (openssl/x509_vfy.h)
    9: "is the clock right? It is not valid yet",
    10: "the server wants a new one",
    62: "say the name that the certificate is for",
    64: "say the name that the certificate is for",
}
UNREACHED = (OSError, WebSocketException, EOFError, UnicodeError, ImportError)  # errors of a connection that fails
SAID = 100  # characters of a server's reason not to open a connection, at most
SOONEST, LATEST = 0.1, 10.0  # [s] to wait before the second attempt, and at most


def waits(attempt: int, random: Random) -> float:
    """Return how long to wait before an attempt [s], counted from 1: up to twice as long each time."""
    return random.uniform(0.0, min(LATEST, SOONEST * 2.0 ** min(attempt, 30)))


def address_of(url: str) -> str:
    """Return the address `ws://HOST:PORT[/robots/NAME]` for HOST, HOST:PORT or an address. Raises UsageError."""
    spelled = url if "://" in url else f"ws://{url}"
    try:
        parts = urlsplit(spelled)
        host, port = parts.hostname, parts.port
    except ValueError as error:
        raise UsageError(f"{url} is no address: {error}", "ws://HOST:PORT or ws://HOST:PORT/robots/NAME") from None
    if parts.scheme not in ("ws", "wss") or not host or parts.username is not None or parts.query or parts.fragment:
        raise UsageError(f"{url} is no address of a robot", "ws://HOST:PORT or ws://HOST:PORT/robots/NAME")
    return parts.geturl() if port is not None else parts._replace(netloc=f"{parts.netloc}:{PORT}").geturl()


def hello_of(token: str = "", name: str = "", behind: float = 0.0, *, attended: bool = False) -> messages.Hello:
    """The first message of a client whose commands use a clock that is so far `behind` the robot's [s]. `attended`: a
    person is there, who can be asked.
    """
    return messages.Hello(
        (messages.VERSION,),
        token,
        format=Encoding.MSGPACK,
        name=name,
        attended=attended,
        answers=True,
        offset=-behind,
    )


def tls_for(url: str, ca: Path | None) -> ssl.SSLContext | None:
    """The trusted certificates, for the address of a server with TLS; else None. Raises FileError."""
    if urlsplit(url).scheme != "wss":
        return None
    try:
        return ssl.create_default_context(cafile=ca)
    except ssl.SSLError:
        raise FileError(f"{ca} holds no certificate", "a file in PEM: -----BEGIN CERTIFICATE-----") from None
    except OSError as error:
        raise FileError(f"{ca} cannot be read: {reason(error)}") from None


def dialled(url: str, tls: ssl.SSLContext | None) -> connect:
    """Return the connection to a robot as a context, which is opened when it is entered. Raises one of UNREACHED then
    if nobody answers.
    """
    return connect(
        url,
        ssl=tls,
        proxy=None if urlsplit(url).hostname in LOOPBACK else True,
        open_timeout=OPENING,
        ping_interval=KEEPALIVE,
        ping_timeout=SILENT,
        close_timeout=CLOSING,
        max_size=SERVER_BYTES,
    )


class Even:
    """A buffer of samples: in real time they are taken as evenly as they were sent, in virtual time as they come."""

    def __init__(self, far: FarEnd, percentile: float, wall: Callable[[], float]) -> None:
        self._far, self._percentile, self._wall = far, percentile, wall
        self.playout: Playout[messages.Sample] = Playout(percentile)

    def hear(self, message: ServerMessage) -> None:
        match message:
            case messages.Clock():  # its rate may have changed: the measured delays are worth nothing any more
                self.playout = Playout(self._percentile)
            case messages.Sample(clock=clock):
                arrived, rate = self._wall(), self._far.rate
                self.playout.put(arrived if rate is None else clock / rate, message, arrived)


class Client:
    """A connection to a robot; all methods are for the thread of the loop. `told` takes messages about the connection.
    `measures`: it follows what the robot's body measures. `ca`: a file with the certificate of the server, or of its
    authority.
    """

    def __init__(
        self,
        url: str,
        hello: messages.Hello,
        *,
        ca: Path | None = None,
        told: Callable[[str], None] = lambda _text: None,
    ) -> None:
        self.url = address_of(url)
        self.far = FarEnd(hello, time.monotonic)
        self.told = told
        self._tls, self._random = tls_for(self.url, ca), Random()
        self._stirred = Event()
        self._opened: Future[None]
        self._task: Task[None] | None = None
        self._leaves = False
        self._shown = Event()
        self._recalling: Task[None] | None = None
        self.measures = False
        self._remeasuring: Task[None] | None = None

    # --- asking ---

    async def open(self) -> messages.Welcome:
        """Connect. To be called once. Raises RequestRefused if no robot answers, and what the server refuses."""
        self._opened = asyncio.get_running_loop().create_future()
        self._task = asyncio.create_task(self._run())
        done, _ = await asyncio.wait([self._opened], timeout=2.0 * OPENING)
        if not done:
            await self.close()
            raise RequestRefused(f"{self.url} does not say hello within {2.0 * OPENING:g} s", A_ROBOT)
        self._opened.result()
        assert self.far.welcome is not None, "it is open"
        return self.far.welcome

    def begin(self, make: Callable[[int], Request], outlet: Callable[[ServerMessage], None]) -> int:
        """Send a request; its messages go to the outlet, its end last. Raises RequestRefused without a connection."""
        id = self.far.ask(make, outlet)
        self._stirred.set()
        return id

    def send(self, message: messages.ClientMessage) -> None:
        """Send a message that has no answer. Raises RequestRefused if there is no connection."""
        self.far.send(message)
        self._stirred.set()

    async def ask(self, make: Callable[[int], Request]) -> ServerMessage:
        """Send a request, and wait for its end: `Done`, or the result. Raises what is refused."""
        end: Future[ServerMessage] = asyncio.get_running_loop().create_future()

        def hear(message: ServerMessage) -> None:
            if isinstance(message, Done | messages.Result | messages.Refused) and not end.done():
                end.set_result(message)

        self.begin(make, hear)
        return checked(await end)

    async def follow(self, window: float = WINDOW) -> Mirror:
        """Follow the timeline; return the mirror once it shows the last `window` seconds, which it keeps (infinity: all
        of the past). Raises RequestRefused if these do not come.
        """
        self.far.window = window
        self.far.news.append(self._see)
        wanted = None if window == inf else window
        await self.ask(lambda id: messages.Subscribe(id, deltas=True, window=wanted))
        try:
            async with asyncio.timeout(OPENING):
                await self._shown.wait()
        except TimeoutError:
            raise RequestRefused(f"{self.url} does not show the robot within {OPENING:g} s") from None
        assert self.far.mirror is not None, "it is there with the first snapshot"
        return self.far.mirror

    async def samples(
        self, rate: float, *, ahead: float = 0.0, percentile: float = USUAL_PERCENTILE
    ) -> AsyncIterator[messages.Sample]:
        """Yield where the robot is, `rate` times a second: for a client that cannot hold the timeline. In real time
        samples come as evenly as they were sent, so much later that `percentile` of a hundred are there in time.
        `ahead`: positions so much later [s]. Raises RequestRefused, IllegalValue.
        """
        even = Even(self.far, percentile, time.monotonic)
        self.far.news.append(even.hear)
        try:
            await self.ask(lambda id: messages.Subscribe(id, rate=rate, ahead=ahead))
            due, last = time.monotonic(), None
            while True:
                due = max(due + 1.0 / rate, time.monotonic())
                await asyncio.sleep(due - time.monotonic())
                sample = even.playout.take(time.monotonic())
                if sample is not None and sample is not last:
                    last = sample
                    yield sample
        finally:
            self.far.news.remove(even.hear)
            with suppress(RequestRefused):
                self.begin(messages.Subscribe, lambda _end: None)

    async def measure(self) -> None:
        """Follow also what the robot's body measures, once the timeline is followed: from the window of the past on.
        Raises RequestRefused.
        """
        followed, mirror = self.far.connection.followed, self.far.mirror
        if self.measures or followed is None or mirror is None:
            return
        self.measures, begin = True, max(mirror.now - mirror.window, -1.0)
        try:
            await self.ask(lambda id: structs.replace(followed, id=id, after=mirror.seq, measured=True))
            self.far.unmeasured = min(self.far.unmeasured, begin)  # only now: this call waits for these reports itself
            await self._recall_measured()
        except RequestRefused:
            self.measures = False
            raise

    async def _recall_measured(self) -> None:
        """Ask for the reports that are missing."""
        begin, self.far.unmeasured = self.far.unmeasured, inf
        while begin < inf:
            part = await self.ask(partial(messages.MeasuredWindow, begin=begin))
            assert isinstance(part, messages.ShownMeasured), "it answers MeasuredWindow"
            self.far.recall_reports(part)
            begin = part.parts[-1].times[-1] if part.goes_on else inf

    def _see_reports(self, message: ServerMessage) -> None:
        """Ask for the reports that were left out, or that came during a cut."""
        mirror = self.far.mirror
        if not self.measures or mirror is None:
            return
        if isinstance(message, messages.Welcome):
            end = mirror.record.view.end
            self.far.unmeasured = -1.0 if end is None else end
        asks = self._remeasuring is not None and not self._remeasuring.done()
        if self.far.unmeasured < inf and not asks:
            self._remeasuring = asyncio.create_task(self._recall_again())

    async def _recall_again(self) -> None:
        with suppress(RequestRefused):  # it was cut: the next welcome asks again
            while self.far.unmeasured < inf:
                await self._recall_measured()

    def _see(self, message: ServerMessage) -> None:
        """Ask for older parts when they are missing: a snapshot has only the last part of a long timeline, and UNDO may
        set the clock back to before it.
        """
        self._see_reports(message)
        mirror, recalling = self.far.mirror, self._recalling
        if mirror is None:
            return
        anew = isinstance(message, messages.Replaced | messages.Welcome)
        if anew or (mirror.now < mirror.begins and (recalling is None or recalling.done())):
            if recalling is not None:
                recalling.cancel()
            self._recalling = asyncio.create_task(self._recall(mirror))

    async def _recall(self, mirror: Mirror) -> None:
        """Ask for the wanted parts of the past that are not known, one after the other."""
        with suppress(RequestRefused):  # it was cut: the next welcome asks again
            while (begins := mirror.begins) > (wanted := max(mirror.now - mirror.window, -1.0)) and not mirror.lost:
                part = await self.ask(lambda id: messages.Window(id, wanted, begins))
                assert isinstance(part, messages.Shown), "it answers Window"
                if not self.far.extend(part):
                    await asyncio.sleep(SOONEST)  # a change has come between: the next part fits
        self._shown.set()

    async def close(self) -> None:
        """Let the robot go."""
        self._leaves = True
        with suppress(VrsError):  # it is gone already
            self.send(messages.Bye())
        self._stirred.set()
        if self._task is not None:
            await asyncio.wait([self._task], timeout=CLOSING)
            self._task.cancel()
        for recalling in (self._recalling, self._remeasuring):
            if recalling is not None:
                recalling.cancel()
        self.far.give_up()

    # --- sockets ---

    async def _run(self) -> None:
        """Connect again and again, until the robot is let go or cannot be held."""
        attempt, again = 0, True
        while again:
            try:
                async with dialled(self.url, self._tls) as socket:
                    await self._dialogue(socket)
                why = self.far.connection.why or "the connection was cut"
                hint = A_ROBOT
            except UNREACHED as error:
                why, hint = no_answer(self.url, error)
            attempt = 1 if self.far.open else attempt + 1
            self.far.cut()
            again = self._goes_on(why, hint)
            if again:
                await self._pause(waits(attempt, self._random))

    async def _dialogue(self, socket: Socket) -> None:
        """Receive and send until the socket or the connection is closed."""
        self.far.connection.begin()
        writing = asyncio.create_task(self._write(socket))
        try:
            with suppress(ConnectionClosed):
                async for frame in socket:
                    self.far.receive(frame)
                    self._stirred.set()
                    if self.far.open and not self._opened.done():
                        self._opened.set_result(None)
        finally:
            writing.cancel()
            await asyncio.wait([writing])

    async def _write(self, socket: Socket) -> None:
        """Send what waits, and do what is due."""
        with suppress(ConnectionClosed):
            while not self._leaves and not self.far.connection.closing:
                self._stirred.clear()
                self.far.look()
                for frame in self.far.connection.frames():
                    await socket.send(frame)
                await self._stir(self.far.due)
            for frame in self.far.connection.frames():
                await socket.send(frame)
            await socket.close()

    async def _pause(self, seconds: float) -> None:
        """Wait before another attempt."""
        end = time.monotonic() + seconds
        while not self._leaves and time.monotonic() < end:
            self._stirred.clear()
            self.far.look()
            await self._stir(min(end, self.far.due))

    async def _stir(self, until: float) -> None:
        """Wait until there is something to send, at most until that time of the monotonic clock [s]."""
        with suppress(TimeoutError):
            async with asyncio.timeout(until - time.monotonic()):
                await self._stirred.wait()

    def _goes_on(self, why: str, hint: str) -> bool:
        """Return whether to connect again. The caller of `open` is told why it fails."""
        refusal = self.far.refusal
        if not self._opened.done():
            self._opened.set_exception(refusal or RequestRefused(why, hint))
            self._opened.exception()  # the caller may have given up: asyncio is not to complain about that
            return False
        if self._leaves:
            return False
        self.told(f"{why}; {'it is tried again' if refusal is None else 'the robot is lost'}")
        if refusal is not None:
            self.far.give_up(refusal)
        return refusal is None


def no_answer(url: str, error: Exception) -> tuple[str, str]:
    """Return why a connection does not open, and a hint."""
    tls, rest = url.split(":", 1)[0] == "wss", url.split(":", 1)[1]
    match error:
        case InvalidStatus(response=response):
            said = response.body.decode(errors="replace").strip()  # one line of our server, or a page of another
            ours = 0 < len(said) <= SAID and said.isprintable() and "<" not in said
            return f"{url} answers {response.status_code} {response.reason_phrase}", said if ours else A_ROBOT
        case ssl.SSLCertVerificationError():
            wrong = error.verify_message.rstrip(".")
            return f"the certificate of {url} is not trusted: {wrong}", MISTRUST.get(error.verify_code, TRUST)
        case ssl.SSLError() | ConnectionResetError() if tls:
            hint = f"is it a server without TLS? ws:{rest}"
        case InvalidMessage() if not tls:
            hint = f"is it a server with TLS? wss:{rest}"
        case ImportError():
            hint = "a proxy of the environment wants it"
        case UnicodeError():
            hint = "ws://HOST:PORT"
        case WebSocketException():
            hint = A_ROBOT
        case _:
            hint = RUNNING
    return f"{url} does not answer: {reason_of(error)}", hint


def reason_of(error: Exception) -> str:
    """Return the reason of an error in words."""
    match error:
        case TimeoutError():
            return f"nothing came within {OPENING:g} s"
        case ssl.SSLError(reason=str(why)):
            return f"no TLS ({why.replace('_', ' ').lower()})"
        case InvalidMessage():
            return "no HTTP comes from there"
        case OSError(errno=None):  # asyncio puts the errors of several addresses into one text
            numbers = re.findall(r"\[Errno (\d+)\]", str(error))
            return os.strerror(int(numbers[-1])).lower() if numbers else str(error) or "the connection was cut"
        case OSError(errno=int(number)):
            return os.strerror(number).lower() if number > 0 else reason(error)
    return str(error) or type(error).__name__
