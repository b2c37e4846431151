"""A client of a served robot over a WebSocket. It reconnects whenever the connection is cut, until `close` is called.

    client = Client("ws://127.0.0.1:8765", hello_of("token"))
    await client.open()                     # connected: client.far.welcome
    done = await client.ask(lambda id: Line(id, "READY"))
    await client.close()

Before each attempt it waits for a random time, longer each time, so that clients that were cut together do not
reconnect at the same moment.
"""

from __future__ import annotations

import asyncio
import os
import re
import ssl
import time
from collections.abc import AsyncIterator, Callable
from contextlib import suppress
from functools import partial
from math import inf
from pathlib import Path
from random import Random
from urllib.parse import urlsplit

from msgspec import structs
from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import ConnectionClosed, InvalidMessage, InvalidStatus, WebSocketException

from vrs_cli.errors import FileError, RequestRefused, UsageError, VrsError
from vrs_cli.files.opening import reason
from vrs_cli.interfaces.port.port import check_end
from vrs_cli.net import messages
from vrs_cli.net.far_end import FarEnd
from vrs_cli.net.mirror import WINDOW, Mirror
from vrs_cli.net.protocol import SERVER_BYTES
from vrs_cli.net.timesync import USUAL_PERCENTILE, Playout
from vrs_cli.wire.codec import Encoding

OPENING = 10.0  # [s] maximum time for the handshake of the socket, and for the answer to `hello`
KEEPALIVE, SILENT = 2.0, 10.0  # [s] time between two pings, and maximum wait for the answer
CLOSING = 2.0  # [s] maximum time to close a socket
LOOPBACK = ("localhost", "127.0.0.1", "::1")  # hosts that are reached without a proxy
RUNNING, A_ROBOT = "is the server running? vrs serve", "is it a robot? vrs serve"
MISTRUST = {  # hints for certificate errors, by OpenSSL's error number (openssl/x509_vfy.h)
    9: "is the clock right? It is not valid yet",
    10: "the server wants a new one",
    62: "say the name that the certificate is for",
    64: "say the name that the certificate is for",
}
UNREACHED = (OSError, WebSocketException, EOFError, UnicodeError, ImportError)  # errors of a failed connection
MAX_REASON_CHARS = 100  # maximum number of characters shown of a server's reason for refusing a connection
FIRST_WAIT_S, MAX_WAIT_S = 0.1, 10.0  # [s] the maximum wait is FIRST_WAIT_S * 2**attempt, at most MAX_WAIT_S


def waits(attempt: int, random: Random) -> float:
    """Return a random time to wait after failed attempt number `attempt`, counted from 1 [s]. Its maximum doubles with
    each attempt, up to MAX_WAIT_S."""
    return random.uniform(0.0, min(MAX_WAIT_S, FIRST_WAIT_S * 2.0 ** min(attempt, 30)))


def address_of(url: str) -> str:
    """Return the full address `ws://HOST:PORT[/robots/NAME]` for HOST, HOST:PORT or a full address. Raises
    UsageError."""
    try:
        parts = urlsplit(url if "://" in url else f"ws://{url}")
        host, port = parts.hostname, parts.port
    except ValueError as error:
        raise UsageError(f"{url} is no address: {error}", "ws://HOST:PORT or ws://HOST:PORT/robots/NAME") from None
    if parts.scheme not in ("ws", "wss") or not host or parts.username is not None or parts.query or parts.fragment:
        raise UsageError(f"{url} is no address of a robot", "ws://HOST:PORT or ws://HOST:PORT/robots/NAME")
    return parts.geturl() if port is not None else parts._replace(netloc=f"{parts.netloc}:{messages.PORT}").geturl()


def hello_of(token: str = "", name: str = "", behind: float = 0.0, *, attended: bool = False) -> messages.Hello:
    """Return the first message of a client. `behind`: how far the clock of its commands is behind the robot's [s];
    `attended`: a person can answer questions.
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
    """Return a TLS context that trusts the certificates in the file `ca`; None for an address without TLS. Raises
    FileError."""
    if urlsplit(url).scheme != "wss":
        return None
    try:
        return ssl.create_default_context(cafile=ca)
    except ssl.SSLError:
        raise FileError(f"{ca} holds no certificate", "a file in PEM: -----BEGIN CERTIFICATE-----") from None
    except OSError as error:
        raise FileError(f"{ca} cannot be read: {reason(error)}") from None


def open_socket(url: str, tls: ssl.SSLContext | None) -> connect:
    """Return a context manager that opens a socket to a robot. Entering it raises one of UNREACHED if there is no
    answer."""
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


class SampleBuffer:
    """A playout buffer of samples. In real time, samples leave the buffer at the intervals at which they were sent; in
    virtual time, as soon as they arrive."""

    def __init__(self, far: FarEnd, percentile: float, wall: Callable[[], float]) -> None:
        self._far, self._percentile, self._wall = far, percentile, wall
        self.playout: Playout[messages.Sample] = Playout(percentile)

    def hear(self, message: messages.ServerMessage) -> None:
        match message:
            case messages.Clock():  # the rate may have changed, so measure the delays again
                self.playout = Playout(self._percentile)
            case messages.Sample(clock=clock):
                arrived, rate = self._wall(), self._far.rate
                self.playout.put(arrived if rate is None else clock / rate, message, arrived)


class Client:
    """A connection to a robot. Call all methods in the thread of the event loop. `notify`: callback for messages about
    the connection. `measures`: whether the client also follows the reports of the robot's body. `ca`: a file with the
    certificate of the server or of the authority that signed it."""

    def __init__(
        self,
        url: str,
        hello: messages.Hello,
        *,
        ca: Path | None = None,
        notify: Callable[[str], None] = lambda _text: None,
    ) -> None:
        self.url, self.notify = address_of(url), notify
        self.far = FarEnd(hello, time.monotonic)
        self._tls, self._random = tls_for(self.url, ca), Random()
        self._woken, self._shown = asyncio.Event(), asyncio.Event()
        self._opened: asyncio.Future[None]
        self._task: asyncio.Task[None] | None = None
        self._leaves = self.measures = False
        self._recalling: asyncio.Task[None] | None = None
        self._remeasuring: asyncio.Task[None] | None = None

    # --- requests ---

    async def open(self) -> messages.Welcome:
        """Connect; call this method once. Raises RequestRefused if no robot answers, or the error that the server
        sent."""
        self._opened = asyncio.get_running_loop().create_future()
        self._task = asyncio.create_task(self._run())
        done, _ = await asyncio.wait([self._opened], timeout=2.0 * OPENING)
        if not done:
            await self.close()
            raise RequestRefused(f"{self.url} does not say hello within {2.0 * OPENING:g} s", A_ROBOT)
        self._opened.result()
        assert self.far.welcome is not None, "it is open"
        return self.far.welcome

    def begin(self, make: Callable[[int], messages.Request], outlet: Callable[[messages.ServerMessage], None]) -> int:
        """Send a request; return its id. The outlet receives all answers; the last one ends the request. Raises
        RequestRefused if there is no connection."""
        id = self.far.ask(make, outlet)
        self._woken.set()
        return id

    def send(self, message: messages.ClientMessage) -> None:
        """Send a message that has no answer. Raises RequestRefused if there is no connection."""
        self.far.send(message)
        self._woken.set()

    async def ask(self, make: Callable[[int], messages.Request]) -> messages.ServerMessage:
        """Send a request; return its final answer, `Done` or a result. Raises the robot's error if the request is
        refused."""
        end: asyncio.Future[messages.ServerMessage] = asyncio.get_running_loop().create_future()

        def hear(message: messages.ServerMessage) -> None:
            if isinstance(message, messages.Done | messages.Result | messages.Refused) and not end.done():
                end.set_result(message)

        self.begin(make, hear)
        return check_end(await end)

    async def follow(self, window: float = WINDOW) -> Mirror:
        """Follow the timeline; return its mirror (a local copy) as soon as the mirror contains the last `window`
        seconds. The mirror keeps `window` seconds of the past (infinity: all of the past). Raises RequestRefused if the
        timeline does not arrive."""
        self.far.window = window
        self.far.news.append(self._see)
        await self.ask(lambda id: messages.Subscribe(id, deltas=True, window=None if window == inf else window))
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
        """Yield the robot's joints `rate` times a second, for a client that does not keep the timeline. In real time,
        samples are yielded at the intervals at which they were sent, delayed so that `percentile` percent arrive in
        time. `ahead`: the samples are for this much later than the robot's clock [s]. Raises RequestRefused,
        IllegalValue."""
        buffer = SampleBuffer(self.far, percentile, time.monotonic)
        self.far.news.append(buffer.hear)
        try:
            await self.ask(lambda id: messages.Subscribe(id, rate=rate, ahead=ahead))
            due, last = time.monotonic(), None
            while True:
                due = max(due + 1.0 / rate, time.monotonic())
                await asyncio.sleep(due - time.monotonic())
                sample = buffer.playout.take(time.monotonic())
                if sample is not None and sample is not last:
                    last = sample
                    yield sample
        finally:
            self.far.news.remove(buffer.hear)
            with suppress(RequestRefused):
                self.begin(messages.Subscribe, lambda _end: None)

    async def measure(self) -> None:
        """Receive the reports of the robot's body (its arm), beginning with those at the start of the timeline's
        window. Do nothing if the client does not follow the timeline. Raises RequestRefused."""
        followed, mirror = self.far.connection.subscription, self.far.mirror
        if self.measures or followed is None or mirror is None:
            return
        self.measures, begin = True, max(mirror.now - mirror.window, -1.0)
        try:
            await self.ask(lambda id: structs.replace(followed, id=id, after=mirror.seq, measured=True))
            self.far.unmeasured = min(self.far.unmeasured, begin)  # set only now, so that `_see` does not fetch too
            await self._fetch_reports()
        except RequestRefused:
            self.measures = False
            raise

    async def _fetch_reports(self) -> None:
        """Fetch the missing reports of the body."""
        begin, self.far.unmeasured = self.far.unmeasured, inf
        while begin < inf:
            part = await self.ask(partial(messages.MeasuredWindow, begin=begin))
            assert isinstance(part, messages.ShownMeasured), "it answers MeasuredWindow"
            self.far.recall_reports(part)
            begin = part.parts[-1].times[-1] if part.goes_on else inf

    async def _fetch_all_reports(self) -> None:
        """Fetch missing reports until none are missing or the connection is cut; the next welcome restarts this."""
        with suppress(RequestRefused):
            while self.far.unmeasured < inf:
                await self._fetch_reports()

    def _see(self, message: messages.ServerMessage) -> None:
        """Fetch missing reports, and missing older parts of the timeline: a snapshot may contain only the last part,
        and after UNDO the window may begin earlier."""
        mirror, recalling = self.far.mirror, self._recalling
        if mirror is None:
            return
        if self.measures:
            if isinstance(message, messages.Welcome):
                end = mirror.record.view.end
                self.far.unmeasured = -1.0 if end is None else end
            if self.far.unmeasured < inf and (self._remeasuring is None or self._remeasuring.done()):
                self._remeasuring = asyncio.create_task(self._fetch_all_reports())
        anew = isinstance(message, messages.Replaced | messages.Welcome)
        if anew or (mirror.now < mirror.begins and (recalling is None or recalling.done())):
            if recalling is not None:
                recalling.cancel()
            self._recalling = asyncio.create_task(self._recall(mirror))

    async def _recall(self, mirror: Mirror) -> None:
        """Fetch the missing parts of the window, the newest first, until all are there or the connection is cut; after
        the next welcome, this method is called again."""
        with suppress(RequestRefused):
            while (begins := mirror.begins) > (wanted := max(mirror.now - mirror.window, -1.0)) and not mirror.lost:
                part = await self.ask(lambda id: messages.Window(id, wanted, begins))
                assert isinstance(part, messages.Shown), "it answers Window"
                if not self.far.extend(part):
                    # A change arrived before the part, so the part does not fit. The next one will fit.
                    await asyncio.sleep(FIRST_WAIT_S)
        self._shown.set()

    async def close(self) -> None:
        """Leave the robot and close the connection."""
        self._leaves = True
        with suppress(VrsError):  # the connection is already closed
            self.send(messages.Bye())
        self._woken.set()
        if self._task is not None:
            await asyncio.wait([self._task], timeout=CLOSING)
            self._task.cancel()
        for recalling in (self._recalling, self._remeasuring):
            if recalling is not None:
                recalling.cancel()
        self.far.give_up()

    # --- sockets ---

    async def _run(self) -> None:
        """Connect, and reconnect after each cut, until the user leaves or the robot refuses."""
        attempt, again = 0, True
        while again:
            try:
                async with open_socket(self.url, self._tls) as socket:
                    await self._dialogue(socket)
                why = self.far.connection.why or "the connection was cut"
                hint = A_ROBOT
            except UNREACHED as error:
                why, hint = no_answer(self.url, error)
            attempt = 1 if self.far.open else attempt + 1
            self.far.cut()
            again = self._goes_on(why, hint)
            if again:
                end = time.monotonic() + waits(attempt, self._random)
                while not self._leaves and time.monotonic() < end:
                    self._woken.clear()
                    self.far.look()
                    await self._wait_until_woken(min(end, self.far.due))

    async def _dialogue(self, socket: ClientConnection) -> None:
        """Receive and send until the socket or the connection is closed."""
        self.far.connection.begin()
        writing = asyncio.create_task(self._write(socket))
        try:
            with suppress(ConnectionClosed):
                async for frame in socket:
                    self.far.receive(frame)
                    self._woken.set()
                    if self.far.open and not self._opened.done():
                        self._opened.set_result(None)
        finally:
            writing.cancel()
            await asyncio.wait([writing])

    async def _write(self, socket: ClientConnection) -> None:
        """Write waiting frames, and call `look` when it is due, until the connection closes."""
        with suppress(ConnectionClosed):
            while not self._leaves and not self.far.connection.closing:
                self._woken.clear()
                self.far.look()
                for frame in self.far.connection.frames():
                    await socket.send(frame)
                await self._wait_until_woken(self.far.due)
            for frame in self.far.connection.frames():
                await socket.send(frame)
            await socket.close()

    async def _wait_until_woken(self, until: float) -> None:
        """Wait until there is something to send, at most until the monotonic clock shows `until` [s]."""
        with suppress(TimeoutError):
            async with asyncio.timeout(until - time.monotonic()):
                await self._woken.wait()

    def _goes_on(self, why: str, hint: str) -> bool:
        """Return whether to connect again. Before the first welcome, return False and let `open` raise the reason."""
        refusal = self.far.refusal
        if not self._opened.done():
            self._opened.set_exception(refusal or RequestRefused(why, hint))
            self._opened.exception()  # without this asyncio complains if the caller of `open` was cancelled
            return False
        if self._leaves:
            return False
        self.notify(f"{why}; {'it is tried again' if refusal is None else 'the robot is lost'}")
        if refusal is not None:
            self.far.give_up(refusal)
        return refusal is None


def no_answer(url: str, error: Exception) -> tuple[str, str]:
    """Return the reason why a connection does not open, and a hint."""
    tls, rest = url.split(":", 1)[0] == "wss", url.split(":", 1)[1]
    match error:
        case InvalidStatus(response=response):
            said = response.body.decode(errors="replace").strip()  # servers of vrs send one line, others send a page
            ours = 0 < len(said) <= MAX_REASON_CHARS and said.isprintable() and "<" not in said
            return f"{url} answers {response.status_code} {response.reason_phrase}", said if ours else A_ROBOT
        case ssl.SSLCertVerificationError():
            hint = MISTRUST.get(error.verify_code, "name its file with --ca, in Python with ca=")
            return f"the certificate of {url} is not trusted: {error.verify_message.rstrip('.')}", hint
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
    """Describe the reason of an error in words."""
    match error:
        case TimeoutError():
            return f"nothing came within {OPENING:g} s"
        case ssl.SSLError(reason=str(why)):
            return f"no TLS ({why.replace('_', ' ').lower()})"
        case InvalidMessage():
            return "no HTTP comes from there"
        case OSError(errno=None):  # asyncio joins the errors of several addresses into one message
            numbers = re.findall(r"\[Errno (\d+)\]", str(error))
            return os.strerror(int(numbers[-1])).lower() if numbers else str(error) or "the connection was cut"
        case OSError(errno=int(number)):
            return os.strerror(number).lower() if number > 0 else reason(error)
    return str(error) or type(error).__name__
