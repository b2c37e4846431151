"""A robot afar over sockets: they are opened, and opened again after a cut, until the robot is let go.

    client = Client("ws://127.0.0.1:8765", hello_of("token"))
    await client.open()                     # the robot is there: client.far.mirror
    done = await client.ask(lambda id: Line(id, "READY"))
    await client.close()

Between two attempts it waits for a time that grows, and is left to chance: those who were cut together do not come back
together.
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
from math import inf
from pathlib import Path
from random import Random
from urllib.parse import urlsplit

from websockets.asyncio.client import ClientConnection as Socket
from websockets.asyncio.client import connect
from websockets.exceptions import ConnectionClosed, InvalidMessage, InvalidStatus, WebSocketException
from websockets.http11 import Response

from vrs_cli.errors import FileError, RequestRefused, UsageError, VrsError
from vrs_cli.files.opening import reason
from vrs_cli.interfaces.port.port import checked
from vrs_cli.net import messages
from vrs_cli.net.far_end import FarEnd
from vrs_cli.net.messages import PORT, Done, Request, ServerMessage
from vrs_cli.net.mirror import WINDOW, Mirror
from vrs_cli.net.playout import USUAL_PERCENTILE, Playout
from vrs_cli.net.protocol import SERVER_BYTES
from vrs_cli.wire.codec import Encoding

OPENING = 10.0  # [s] that a handshake takes at most
KEEPALIVE, SILENT = 2.0, 10.0  # [s] between two pings of the socket, and until one without an answer cuts it
CLOSING = 2.0  # [s] that both sides take to say so
LOOPBACK = ("localhost", "127.0.0.1", "::1")
RUNNING, A_ROBOT = "is the server running? vrs serve", "is it a robot? vrs serve"
TRUST = "name its file with --ca, in Python with ca="
MISTRUST = {  # what helps, by OpenSSL's number of what is wrong with a certificate (openssl/x509_vfy.h)
    9: "is the clock right? It is not valid yet",
    10: "the server wants a new one",
    62: "say the name that the certificate is for",
    64: "say the name that the certificate is for",
}
SAID = 100  # characters at most of what a server says in place of opening a connection
SOONEST, LATEST = 0.1, 10.0  # [s] to wait before the second attempt, and at most


def waits(attempt: int, random: Random) -> float:
    """How long to wait before that attempt [s], from 1: up to twice as long each time."""
    return random.uniform(0.0, min(LATEST, SOONEST * 2.0 ** min(attempt, 30)))


def address_of(url: str) -> str:
    """`ws://HOST:PORT[/robots/NAME]` of what a user has typed: HOST, HOST:PORT or an address. Raises UsageError."""
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
    """Of a client that takes all there is, and commands by a clock that is so far `behind` the robot's [s]. `attended`:
    a person is there, who can be asked.
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


def _tls(url: str, ca: Path | None) -> ssl.SSLContext | None:
    """What is trusted, where the address is that of a server with a certificate. Raises FileError."""
    if urlsplit(url).scheme != "wss":
        return None
    try:
        return ssl.create_default_context(cafile=ca)
    except ssl.SSLError:
        raise FileError(f"{ca} holds no certificate", "a file in PEM: -----BEGIN CERTIFICATE-----") from None
    except OSError as error:
        raise FileError(f"{ca} cannot be read: {reason(error)}") from None


class Even:
    """Samples of a robot in real time, to be taken as evenly as they were sent; in virtual time as they come."""

    def __init__(self, far: FarEnd, percentile: float, wall: Callable[[], float]) -> None:
        self._far, self._percentile, self._wall = far, percentile, wall
        self.playout: Playout[messages.Sample] = Playout(percentile)

    def hear(self, message: ServerMessage) -> None:
        match message:
            case messages.Clock():  # it goes otherwise from now on: what was measured says nothing any more
                self.playout = Playout(self._percentile)
            case messages.Sample(clock=clock):
                arrived, rate = self._wall(), self._far.rate
                self.playout.put(arrived if rate is None else clock / rate, message, arrived)


class Client:
    """Holds a robot; all methods are for the thread of the loop. `told` hears, in plain words, what becomes of the
    connection. `ca`: a file with the certificate of the server, or of who has signed it.
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
        self._tls, self._random = _tls(self.url, ca), Random()
        self._stirred = Event()
        self._opened: Future[None]
        self._task: Task[None] | None = None
        self._leaves = False
        self._shown = Event()
        self._recalling: Task[None] | None = None

    # --- asking ---

    async def open(self) -> messages.Welcome:
        """Connect, once. Raises RequestRefused where no robot answers, and what the server refuses."""
        self._opened = asyncio.get_running_loop().create_future()
        self._task = asyncio.create_task(self._run())
        done, _ = await asyncio.wait([self._opened], timeout=OPENING)
        if not done:
            await self.close()
            raise RequestRefused(f"{self.url} does not say hello within {OPENING:g} s", A_ROBOT)
        self._opened.result()
        assert self.far.welcome is not None, "it is open"
        return self.far.welcome

    def begin(self, make: Callable[[int], Request], outlet: Callable[[ServerMessage], None]) -> int:
        """Send a request; all that comes of it goes to the outlet, its end last. Raises RequestRefused where there is
        no connection.
        """
        id = self.far.ask(make, outlet)
        self._stirred.set()
        return id

    def send(self, message: messages.ClientMessage) -> None:
        """What has no answer. Raises RequestRefused where there is no connection."""
        self.far.send(message)
        self._stirred.set()

    async def ask(self, make: Callable[[int], Request]) -> ServerMessage:
        """Send a request, and wait for its end: `Done`, or what was asked for. Raises what is refused."""
        end: Future[ServerMessage] = asyncio.get_running_loop().create_future()

        def hear(message: ServerMessage) -> None:
            if isinstance(message, Done | messages.Result | messages.Refused) and not end.done():
                end.set_result(message)

        self.begin(make, hear)
        return checked(await end)

    async def follow(self, window: float = WINDOW) -> Mirror:
        """Have every change told; the mirror, once it shows the last `window` seconds, which it keeps (infinity: all of
        the past). Raises RequestRefused where that does not come.
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
        """Where the robot is, `rate` times a second, in place of the timeline: for who cannot hold that. In real time
        they come as evenly as they were sent, so much later that `percentile` of a hundred are there in time. `ahead`:
        of positions so much later [s]. Raises RequestRefused, IllegalValue.
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

    def _see(self, message: ServerMessage) -> None:
        """A snapshot of a long timeline is of its last part. UNDO may set the clock back to before what is kept."""
        mirror, recalling = self.far.mirror, self._recalling
        if mirror is None:
            return
        anew = isinstance(message, messages.Replaced | messages.Welcome)
        if anew or (mirror.now < mirror.begins and (recalling is None or recalling.done())):
            if recalling is not None:
                recalling.cancel()
            self._recalling = asyncio.create_task(self._recall(mirror))

    async def _recall(self, mirror: Mirror) -> None:
        """Ask for the parts of the past that are wanted, and not known, one after the other."""
        with suppress(RequestRefused):  # it was cut: it goes on when it is welcome again
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
        if self._recalling is not None:
            self._recalling.cancel()
        self.far.give_up()

    # --- sockets ---

    async def _run(self) -> None:
        """Connect again and again, until the robot is let go or cannot be held."""
        attempt, again = 0, True
        while again:
            try:
                async with self._connect() as socket:
                    await self._dialogue(socket)
                why = self.far.connection.why or "the connection was cut"
                hint = A_ROBOT
            except (OSError, WebSocketException, EOFError, UnicodeError, ImportError) as error:
                why, hint = _no_answer(self.url, error)
            attempt = 1 if self.far.open else attempt + 1
            self.far.cut()
            again = self._goes_on(why, hint)
            if again:
                await self._pause(waits(attempt, self._random))

    def _connect(self) -> connect:
        return connect(
            self.url,
            ssl=self._tls,
            proxy=None if urlsplit(self.url).hostname in LOOPBACK else True,
            open_timeout=OPENING,
            ping_interval=KEEPALIVE,
            ping_timeout=SILENT,
            close_timeout=CLOSING,
            max_size=SERVER_BYTES,
        )

    async def _dialogue(self, socket: Socket) -> None:
        """Until the socket is closed, or the connection."""
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
        """Send what there is to send, and do what is due."""
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
        """Before another attempt."""
        end = time.monotonic() + seconds
        while not self._leaves and time.monotonic() < end:
            self._stirred.clear()
            self.far.look()
            await self._stir(min(end, self.far.due))

    async def _stir(self, until: float) -> None:
        """Wait until there is something to send, or until then by the time of the day [s]."""
        with suppress(TimeoutError):
            async with asyncio.timeout(until - time.monotonic()):
                await self._stirred.wait()

    def _goes_on(self, why: str, hint: str) -> bool:
        """Whether it is tried again. Whoever opens it is told why it does not open."""
        refusal = self.far.refusal
        if not self._opened.done():
            self._opened.set_exception(refusal or RequestRefused(why, hint))
            self._opened.exception()  # who opens it may have given up: nobody complains that he does not ask
            return False
        if self._leaves:
            return False
        self.told(f"{why}; {'it is tried again' if refusal is None else 'the robot is lost'}")
        if refusal is not None:
            self.far.give_up(refusal)
        return refusal is None


def _no_answer(url: str, error: Exception) -> tuple[str, str]:
    """Why a connection does not open, and what would be right."""
    tls, rest = url.split(":", 1)[0] == "wss", url.split(":", 1)[1]
    match error:
        case InvalidStatus(response=response):
            return f"{url} answers {response.status_code} {response.reason_phrase}", _said(response) or A_ROBOT
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


def _said(response: Response) -> str:
    """The line with which a server of ours tells why; empty for a page of another."""
    text = response.body.decode(errors="replace").strip()
    return text if len(text) <= SAID and text.isprintable() and "<" not in text else ""


def reason_of(error: Exception) -> str:
    """In words: asyncio tells of a system call, the system why that failed."""
    match error:
        case TimeoutError():
            return f"nothing came within {OPENING:g} s"
        case ssl.SSLError(reason=str(why)):
            return f"no TLS ({why.replace('_', ' ').lower()})"
        case InvalidMessage():
            return "no HTTP comes from there"
        case OSError(errno=None):  # asyncio puts those of many addresses into one text, or tells only of a cut
            numbers = re.findall(r"\[Errno (\d+)\]", str(error))
            return os.strerror(int(numbers[-1])).lower() if numbers else str(error) or "the connection was cut"
        case OSError(errno=int(number)):
            return os.strerror(number).lower() if number > 0 else reason(error)
    return str(error) or type(error).__name__
