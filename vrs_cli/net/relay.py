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
from typing import Any
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
from vrs_cli.net.told_course import CourseThread, Cut, Heard
from vrs_cli.trajectory.timeline import Timeline
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
    instead of the token. `window`: so many seconds of the past are asked for; None: as many as the page wants. `cell`:
    what is around the robot, where its server tells nothing; its parts are followed from the begin of the timeline.
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
        cell: dict[str, Any] | None = None,
    ) -> None:
        self.url, self.robot = address_of(url), robot
        self._tls = tls_for(self.url, ca)
        self._secret, self._token, self._name, self._ahead, self._window = secret, token, name, ahead, window
        self._cell = cell
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
                    link.close()
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
        return known or OverheardEnd(time.monotonic, self._ahead, self._cell)

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
        self._wanted = False  # the course of the world
        self._woken = asyncio.Event()
        self._course: CourseThread | None = None  # of the parts in a cell that the server does not know
        self._shown: Timeline | None = None  # whose course it is
        self._heard = Heard()
        self._failed: list[Exception] = []  # in the thread of the course

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
        self._wanted = wanted.world
        window = wanted.window if self._window is None else self._window
        if self._end.connection.surrounded:
            window = None  # where parts are follows from all that was done
        return replace(wanted, window=window, after=wanted.after if self._end.mirror is not None else None)

    async def backward(self) -> None:
        """Pass on what the robot sends."""
        async for frame in self._robot:
            passed = self._end.hear_robot(frame)
            if passed is not None:
                await self._page.send(passed)
            await self._send()
            await self._tell()
            self._woken.set()

    async def keep(self) -> None:
        """Send pings when they are due, and the course of parts."""
        while True:
            self._end.look()
            await self._send()
            await self._tell()
            await self._tell_course()
            left = self._end.due - time.monotonic()
            with suppress(TimeoutError):  # not by wait_for, which may lose a cancellation in Python 3.11
                async with asyncio.timeout(min(max(left, SHORTEST_PAUSE), LONGEST_PAUSE)):
                    await self._woken.wait()
            self._woken.clear()

    async def _send(self) -> None:
        for frame in self._end.connection.frames():
            await self._robot.send(frame)

    async def _tell(self) -> None:
        """Tell the page what is expected, if that has changed."""
        news = self._end.news_of_preview()
        if news is not None:
            await self._page.send(encode(news, self._encoding))

    async def _tell_course(self) -> None:
        """Tell the page what it has not heard of the parts in the cell that the server does not know."""
        end = self._end
        if not (self._wanted and end.connection.surrounded) or end.mirror is None or end.mirror.world is None:
            return
        timeline = end.mirror.timeline
        if self._course is None:
            loop = asyncio.get_running_loop()

            def wake() -> None:
                loop.call_soon_threadsafe(self._woken.set)

            self._course = CourseThread(
                end.mirror.world,
                now=lambda: end.now,
                works=lambda: False,
                woken=wake,
                failed=self._failed.append,
            )
            self._course.begin(timeline)
        elif self._shown is not None and timeline is not self._shown:
            cut = Cut.between(self._shown, timeline)
            self._course.change(timeline, cut)
            self._heard = self._heard.cut(cut)
        self._shown = timeline
        if self._failed:
            raise self._failed[0]
        self._course.tick()
        told, self._heard = self._course.after(self._heard)
        while told:
            for one in told:
                await self._page.send(encode(one, self._encoding))
            told, self._heard = self._course.after(self._heard)

    def close(self) -> None:
        """End the thread of the course."""
        if self._course is not None:
            self._course.close()
