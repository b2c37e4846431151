"""The connections of pages to a robot that is served elsewhere, through a server of this machine.

Whoever knows the secret of the page's address may open a connection here. Each connection of a page has one to the
robot, with the token of the robot, which stays here; so each page is a holder of its own. Frames pass unchanged, and
one message is added: `preview`, what is expected of the commands on their way (`overheard.py`).
"""

from __future__ import annotations

import asyncio
import hmac
import time
from contextlib import suppress
from http.client import HTTPException
from pathlib import Path
from urllib.parse import quote, urlsplit
from urllib.request import BaseHandler, HTTPRedirectHandler, HTTPSHandler, ProxyHandler, build_opener

from msgspec.structs import replace
from websockets.asyncio.client import ClientConnection as RobotSocket
from websockets.asyncio.server import ServerConnection as PageSocket
from websockets.exceptions import ConnectionClosed

from vrs_cli.errors import NonexistentFile, RequestRefused
from vrs_cli.net import messages
from vrs_cli.net.client import LOOPBACK, OPENING, UNREACHED, address_of, dialled, no_answer, tls_for
from vrs_cli.net.far_end import Ahead
from vrs_cli.net.overheard import LookAhead, OverheardEnd
from vrs_cli.net.protocol import HELLO_BYTES, HELLO_SECONDS
from vrs_cli.net.served_shapes import MESH
from vrs_cli.wire.codec import Encoding, Reader, encode
from vrs_cli.wire.records import RecordError
from vrs_cli.wire.refusal import Refusal

MAX_REMEMBERED = 20  # connections of pages that may come back after a cut
MAX_MESH_BYTES = 100_000_000
SHORTEST_PAUSE, LONGEST_PAUSE = 0.02, 0.5  # [s] between two looks at what is due

_from_page: Reader[messages.FromClient | LookAhead] = Reader(messages.FromClient | LookAhead)


class _Direct(HTTPRedirectHandler):
    """Follows no redirection: a server may not lead this machine elsewhere."""

    def redirect_request(self, *_: object) -> None:
        """Have the redirection raised as an HTTPError."""


class Relay:
    """Relays connections to `robot` at `url`. `token`, `name`: as the server there is told. `secret`: what pages say
    instead of the token. `window`: so many seconds of the past are asked for; None: as many as the page wants.
    """

    def __init__(
        self,
        url: str,
        robot: str,
        secret: str,
        *,
        token: str = "",
        name: str = "",
        ca: Path | None = None,
        ahead: float | Ahead = Ahead.PRESENT,
        window: float | None = None,
    ) -> None:
        self.url, self.robot = address_of(url), robot
        self._tls = tls_for(self.url, ca)
        self._secret, self._token, self._name, self._ahead, self._window = secret, token, name, ahead, window
        self._ends: dict[str, OverheardEnd] = {}  # by the key of the connection, the oldest first

    def mesh(self, file: str) -> bytes:
        """Return a mesh of the robot by the last part of its address. In any thread. Raises NonexistentFile."""
        there, robot = (
            urlsplit(self.url),
            urlsplit(self.url).path.rstrip("/") or f"/robots/{quote(self.robot, safe='')}",
        )
        handlers: list[BaseHandler] = [_Direct()]
        handlers += [HTTPSHandler(context=self._tls)] if self._tls else []
        handlers += [ProxyHandler({})] if there.hostname in LOOPBACK else []
        address = f"{'https' if self._tls else 'http'}://{there.netloc}{robot}/{MESH}/{quote(file, safe='')}"
        try:
            with build_opener(*handlers).open(address, timeout=OPENING) as answer:
                found = bytes(answer.read(MAX_MESH_BYTES + 1))
        except (OSError, ValueError, HTTPException):
            raise NonexistentFile(file) from None
        if len(found) > MAX_MESH_BYTES:
            raise NonexistentFile(file)
        return found

    # --- connections ---

    async def serve(self, page: PageSocket) -> None:
        """Relay one connection of a page from its begin to its end."""
        with suppress(ConnectionClosed):
            hello = await self._greeted(page)
            if hello is not None:
                why = await self._relayed(page, hello)
                await page.send(encode(messages.Closing(why), hello.format))

    async def _greeted(self, page: PageSocket) -> messages.Hello | None:
        """Return the page's hello; None if it may not enter, which it is told."""
        try:
            async with asyncio.timeout(HELLO_SECONDS):
                frame = await page.recv()
        except TimeoutError:
            return None
        try:
            hello = _from_page.read(frame if len(frame) <= HELLO_BYTES else "")
        except RecordError:
            hello = messages.Bye()
        if isinstance(hello, messages.Hello) and hmac.compare_digest(hello.token.encode(), self._secret.encode()):
            return hello
        refused = RequestRefused(
            "this page does not know the secret of its address", "open the one that vrs view tells"
        )
        await page.send(encode(messages.Closing(refused.detail, Refusal.of(refused)), Encoding.JSON))
        return None

    async def _relayed(self, page: PageSocket, hello: messages.Hello) -> str:
        """Relay until one end closes; return why."""
        end = self._end(hello)
        try:
            async with dialled(self.url, self._tls) as robot:
                end.begin(hello)
                said = replace(hello, token=self._token, name=self._name or hello.name, robot=self.robot)
                await robot.send(encode(said, Encoding.JSON))
                link = _Link(page, robot, end, hello.format, self._window)
                works = [asyncio.create_task(work) for work in (link.forward(), link.backward(), link.keep())]
                try:
                    await asyncio.wait(works, return_when=asyncio.FIRST_COMPLETED)
                finally:
                    for work in works:
                        work.cancel()
                    await asyncio.wait(works)
            for work in works:
                if not work.cancelled() and (error := work.exception()) and not isinstance(error, ConnectionClosed):
                    raise error
            return "the connection to the robot was cut"
        except UNREACHED as error:
            return no_answer(self.url, error)[0]
        finally:
            end.cut()
            self._remember(end)

    def _end(self, hello: messages.Hello) -> OverheardEnd:
        """Return what heard the connection before the cut, or a new one."""
        known = None if hello.resume is None else self._ends.pop(hello.resume.connection, None)
        return known or OverheardEnd(time.monotonic, self._ahead)

    def _remember(self, end: OverheardEnd) -> None:
        if end.welcome is not None:
            self._ends[end.welcome.connection] = end
            if len(self._ends) > MAX_REMEMBERED:
                del self._ends[next(iter(self._ends))]


class _Link:
    """One connection of a page, and that to the robot."""

    def __init__(
        self, page: PageSocket, robot: RobotSocket, end: OverheardEnd, encoding: Encoding, window: float | None
    ) -> None:
        self._page, self._robot, self._end, self._encoding, self._window = page, robot, end, encoding, window

    async def forward(self) -> None:
        """Pass on what the page sends."""
        async for frame in self._page:
            try:
                message = _from_page.read(frame)
            except RecordError:
                await self._robot.send(frame)  # the robot says what is wrong with it
                continue
            match message:
                case LookAhead():
                    chosen = message.value()
                    self._end.ahead = self._end.ahead if chosen is None else chosen
                case messages.Subscribe():
                    await self._robot.send(encode(self._subscribed(message), self._encoding))
                case _:
                    said = self._end.hear_page(message)
                    await self._robot.send(frame if said is message else encode(said, self._encoding))
            await self._tell()

    def _subscribed(self, wanted: messages.Subscribe) -> messages.Subscribe:
        """The timeline has to begin with a snapshot where it is not known here."""
        window = wanted.window if self._window is None else self._window
        return replace(wanted, window=window, after=wanted.after if self._end.mirror is not None else None)

    async def backward(self) -> None:
        """Pass on what the robot sends."""
        async for frame in self._robot:
            if self._end.hear_robot(frame):
                await self._page.send(frame)
            await self._send()
            await self._tell()

    async def keep(self) -> None:
        """Send pings when they are due."""
        while True:
            self._end.look()
            await self._send()
            await self._tell()
            left = self._end.due - time.monotonic()
            await asyncio.sleep(min(max(left, SHORTEST_PAUSE), LONGEST_PAUSE))

    async def _send(self) -> None:
        for frame in self._end.connection.frames():
            await self._robot.send(frame)

    async def _tell(self) -> None:
        """Tell the page what is expected, if that has changed."""
        news = self._end.news_of_preview()
        if news is not None:
            await self._page.send(encode(news, self._encoding))
