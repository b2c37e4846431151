"""Relay connections of pages to a remote robot, through a server of this machine.

A page that sends the secret of its address may open a connection here. For each page the relay opens a connection to
the robot with the robot's token, which the page does not get; so each page is a separate user. Frames pass unchanged,
and the relay adds one message: `preview`, the expected effects of the commands on their way. A page has the timeline
but cannot plan, so the relay reads the frames of both directions and predicts (`RelayedEnd`).
"""

from __future__ import annotations

import asyncio
import hmac
import time
from collections.abc import Callable
from contextlib import suppress
from http.client import HTTPException
from pathlib import Path
from typing import Any
from urllib.parse import quote, urlsplit
from urllib.request import BaseHandler, HTTPRedirectHandler, HTTPSHandler, ProxyHandler, build_opener

from msgspec import Struct, structs
from websockets.asyncio.client import ClientConnection as RobotSocket
from websockets.asyncio.server import ServerConnection as PageSocket
from websockets.exceptions import ConnectionClosed

from vrs_cli.errors import NonexistentFile, RequestRefused
from vrs_cli.net import messages
from vrs_cli.net.client import LOOPBACK, OPENING, UNREACHED, address_of, no_answer, open_socket, tls_for
from vrs_cli.net.course_teller import CourseThread, Cut, Heard
from vrs_cli.net.delivery_log import Outbox
from vrs_cli.net.far_end import Ahead, FarEnd
from vrs_cli.net.page_data import MESH
from vrs_cli.net.protocol import BACKLOG, HELLO_BYTES, HELLO_SECONDS, ClientConnection, ConnectionState
from vrs_cli.trajectory.timeline import Timeline
from vrs_cli.wire.codec import Encoding, Frame, Reader, encode
from vrs_cli.wire.messages import ClientMessage, Refusal, ServerMessage
from vrs_cli.wire.records import DeltaRecord, Motions, Number, RecordError, delta_record

_from_server: Reader[messages.FromServer] = Reader(messages.FromServer)
LOST = (messages.Outcome.UNSEEN, messages.Outcome.FORGOTTEN)  # the server sends no `done` for such commands
PRESENT = Ahead.PRESENT.value
ROUND_TRIP_DIGITS = 3  # decimals of the round trip [s]: smaller differences cause no new `preview`


class ExpectedRecord(Struct, frozen=True, omit_defaults=True):
    """The expected effect of the command `id`. `issued`: its time of issue by the robot's clock [s]. `begin`: the time
    from which it changes the timeline [s]; absent: no change. `refused`: the reason why the robot will refuse it, if
    any. `planned`: if false, the effect is unknown here, and the whole timeline after `begin` may change.
    """

    id: int
    text: str
    issued: float
    begin: float | None = None
    refused: str = ""
    planned: bool = True


class PreviewMessage(ServerMessage, frozen=True, tag="preview"):
    """The expected state of a robot with a delayed connection.

    The predicted timeline is the timeline after change `number`, changed by all `deltas`. `since_heard`: only the past
    is confirmed, because the tool is being dragged. `flagged`: time intervals for which a wrong motion was shown, in
    order [s]. `round_trip`: the delay to the robot and back, in seconds of the robot's clock. `ahead`: how far ahead of
    the last known state the robot is shown: `present`, `auto`, or a time [s]. `near`: the delays are too short to
    matter.
    """

    number: int
    deltas: tuple[DeltaRecord, ...] = ()
    expected: tuple[ExpectedRecord, ...] = ()
    since_heard: bool = False
    flagged: tuple[tuple[float, float], ...] = ()
    round_trip: float = 0.0
    ahead: str | float = PRESENT
    near: bool = False


class LookAhead(ClientMessage, frozen=True, tag="ahead"):
    """The user's choice of how far ahead the robot is shown, as in `preview`."""

    ahead: str | Number = PRESENT

    def value(self) -> float | Ahead | None:
        """Return the choice; None if it is not a valid one."""
        if isinstance(self.ahead, str):
            return next((one for one in Ahead if one.value == self.ahead), None)
        return self.ahead if self.ahead >= 0.0 else None


class RelayedConnection(ClientConnection):
    """The relay's end of the connection to a robot. The page sends the requests; this end reads the robot's messages,
    and sends only its own pings and requests for snapshots. `cell`: the cell to show if the robot's server supplies
    none. `passed`: the last frame, as forwarded to the page; None if it was a reply to the relay's own ping.
    `surrounded`: whether `cell` is used.
    """

    def __init__(self, cell: dict[str, Any] | None = None) -> None:
        super().__init__(messages.Hello((messages.VERSION,)))
        self.passed: Frame | None = None
        self.cell, self.surrounded = cell, False
        self._pings = set[float]()  # sending times of the relay's unanswered pings [s]

    def begin_with(self, hello: messages.Hello) -> None:
        """Begin on a new socket with the page's hello."""
        self.hello, self.state, self.why = hello, ConnectionState.WELCOME, ""
        self._outbox = Outbox(BACKLOG)
        self._outbox.encoding = hello.format
        self._pings.clear()

    def send(self, message: ClientMessage) -> None:
        """Send a message. Raises RequestRefused if there is no connection."""
        if isinstance(message, messages.Ping):
            self._pings.add(message.sent)
        super().send(message)

    def receive(self, frame: Frame) -> list[ServerMessage]:
        """Return the message of a frame; no message if the frame cannot be read, or answers a ping of the page."""
        self.passed = frame
        if self.state not in (ConnectionState.WELCOME, ConnectionState.OPEN):
            return []
        try:
            message = _from_server.read(frame)
        except RecordError:
            return []
        match message:
            case messages.Welcome() if self.state is ConnectionState.WELCOME:
                self.state = ConnectionState.OPEN
                self.surrounded = self.cell is not None and message.cell is None
                if self.surrounded:
                    message = structs.replace(message, cell=self.cell)
                    self.passed = encode(message, self.hello.format)
            case messages.Closing(why):
                self.state, self.why = ConnectionState.CLOSING, why
            case messages.Pong(sent):
                if sent not in self._pings:
                    return []
                self._pings.discard(sent)
                self.passed = None
            case _ if self.state is ConnectionState.WELCOME or isinstance(message, messages.Welcome):
                return []
        return [message]


class RelayedEnd(FarEnd):
    """The relay's view of a robot to which a page is connected: it follows and predicts the robot. `ahead`: how far
    ahead the robot is shown at first. `cell`: as in RelayedConnection."""

    connection: RelayedConnection

    def __init__(
        self, wall: Callable[[], float], ahead: float | Ahead = Ahead.PRESENT, cell: dict[str, Any] | None = None
    ) -> None:
        connection = RelayedConnection(cell)
        super().__init__(connection.hello, wall, connection)
        self.ahead = ahead
        self._told: PreviewMessage | None = None

    def begin(self, hello: messages.Hello) -> None:
        """Begin on a new socket with the page's hello."""
        self.connection.begin_with(hello)
        self._told = None

    def hear_page(self, message: ClientMessage) -> ClientMessage:
        """Take a message of the page; return the message for the robot, with an issue time added to motions and to
        targets of a dragged tool.
        """
        match message:
            case messages.Request():
                message = self.with_issue_time(message)
                self.expect(message)
            case messages.Drag(issued=issued) if self.mirror is not None:
                message = structs.replace(message, issued=self.now if issued is None else issued)
                self.expect_drag(message)
        return message

    def hear_robot(self, frame: Frame) -> Frame | None:
        """Take a frame of the robot; return the frame for the page, None if it is not for the page."""
        self.receive(frame)
        return self.connection.passed

    def learn(self, message: ServerMessage) -> None:
        """Update the robot's state from a message; remove lost commands from the preview."""
        if isinstance(message, messages.Welcome) and self.preview is not None:
            for fate in message.fates:
                if fate.outcome in LOST:
                    self.preview.refuse(fate.id)
        super().learn(message)

    def news_of_preview(self) -> PreviewMessage | None:
        """Return the current preview; None if the page has it already, or the robot's state is unknown."""
        mirror = self.mirror
        if mirror is None or self.preview is None or mirror.lost or self.refusal is not None:
            return None
        plan, motions, dragged = self.preview.plan, Motions(), self._drag_effect
        follows = dragged is not None and dragged.begin is not None and dragged.begin <= self.heard_time
        expected = plan.expected if dragged is None or follows else (*plan.expected, dragged)
        now = PreviewMessage(
            mirror.seq,
            tuple(delta_record(mirror.whole(delta), motions) for delta in plan.deltas),
            tuple(
                ExpectedRecord(
                    one.id,
                    one.text,
                    one.issued,
                    one.begin,
                    "" if one.refused is None else str(one.refused),
                    one.planned,
                )
                for one in expected
            ),
            follows,
            self.flags.windows,
            round(self.round_trip, ROUND_TRIP_DIGITS),
            self.ahead if isinstance(self.ahead, float) else self.ahead.value,
            self.near,
        )
        if now == self._told:
            return None
        self._told = now
        return now


MAX_REMEMBERED = 20  # maximum number of dropped connections from web pages that are remembered so they can resume
MAX_MESH_BYTES = 100_000_000
SHORTEST_PAUSE, LONGEST_PAUSE = 0.02, 0.5  # [s] minimum and maximum time between two checks for pending work

_from_page: Reader[messages.FromClient | LookAhead] = Reader(messages.FromClient | LookAhead)


class _NoRedirects(HTTPRedirectHandler):
    """A handler that follows no redirections, so that a server cannot make this machine ask other machines."""

    def redirect_request(self, *_: object) -> None:
        """Return None: the redirection is raised as an HTTPError."""


class Relay:
    """A relay of connections to `robot` at `url`.

    `token`, `name`: sent to the robot's server. `secret`: sent by pages instead of the token. `window`: length of the
    past to request [s]; None: as the page requests. `cell`: the cell to show if the robot's server supplies none; the
    states of its parts are computed from the start of the timeline.
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
        self._ends: dict[str, RelayedEnd] = {}  # resumable connections by key, the oldest first

    def mesh(self, file: str) -> bytes:
        """Return a mesh of the robot; `file`: the last part of its address. Any thread may call this method. Raises
        NonexistentFile."""
        there, robot = (
            urlsplit(self.url),
            urlsplit(self.url).path.rstrip("/") or f"/robots/{quote(self.robot, safe='')}",
        )
        handlers: list[BaseHandler] = [_NoRedirects()]
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
        """Relay one connection of a page until it ends."""
        with suppress(ConnectionClosed):
            if (hello := await self._take_hello(page)) is not None:
                why = await self._relay(page, hello)
                await page.send(encode(messages.Closing(why), hello.format))

    async def _take_hello(self, page: PageSocket) -> messages.Hello | None:
        """Return the page's hello; None if it does not come in time. If the secret is wrong, send the page an error and
        return None."""
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

    async def _relay(self, page: PageSocket, hello: messages.Hello) -> str:
        """Relay until one end closes; return the reason."""
        end = self._end(hello)
        try:
            async with open_socket(self.url, self._tls) as robot:
                end.begin(hello)
                said = structs.replace(hello, token=self._token, name=self._name or hello.name, robot=self.robot)
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
            if end.welcome is not None:
                self._ends[end.welcome.connection] = end
                if len(self._ends) > MAX_REMEMBERED:
                    del self._ends[next(iter(self._ends))]

    def _end(self, hello: messages.Hello) -> RelayedEnd:
        """Return the connection end that the hello resumes, or a new one."""
        known = None if hello.resume is None else self._ends.pop(hello.resume.connection, None)
        return known or RelayedEnd(time.monotonic, self._ahead, self._cell)


class _Link:
    """A connection of a page, with its connection to the robot."""

    def __init__(
        self, page: PageSocket, robot: RobotSocket, end: RelayedEnd, encoding: Encoding, window: float | None
    ) -> None:
        self._page, self._robot, self._end, self._encoding, self._window = page, robot, end, encoding, window
        self._wanted = False  # whether the page wants the states of parts
        self._woken = asyncio.Event()
        self._course: CourseThread | None = None  # computes the states of parts, for a cell unknown to the server
        self._shown: Timeline | None = None  # the timeline for which `_course` computes
        self._heard = Heard()
        self._failed: list[Exception] = []  # errors raised in the thread of `_course`

    async def forward(self) -> None:
        """Pass the page's messages on to the robot."""
        async for frame in self._page:
            try:
                message = _from_page.read(frame)
            except RecordError:
                await self._robot.send(frame)  # the server will report the error
                continue
            match message:
                case LookAhead():
                    chosen = message.value()
                    self._end.ahead = self._end.ahead if chosen is None else chosen
                case messages.Subscribe():
                    self._wanted = message.world
                    window = message.window if self._window is None else self._window
                    if self._end.connection.surrounded:
                        window = None  # the positions of parts depend on the whole timeline
                    after = message.after if self._end.mirror is not None else None  # None: begin with a snapshot
                    await self._robot.send(encode(structs.replace(message, window=window, after=after), self._encoding))
                case _:
                    said = self._end.hear_page(message)
                    await self._robot.send(frame if said is message else encode(said, self._encoding))
            await self._tell()

    async def backward(self) -> None:
        """Pass the robot's messages on to the page."""
        async for frame in self._robot:
            if (passed := self._end.hear_robot(frame)) is not None:
                await self._page.send(passed)
            await self._send()
            await self._tell()
            self._woken.set()

    async def keep(self) -> None:
        """Regularly send pings to the robot, and the states of parts to the page."""
        while True:
            self._end.look()
            await self._send()
            await self._tell()
            await self._tell_course()
            left = self._end.due - time.monotonic()
            with suppress(TimeoutError):  # `wait_for` may lose a cancellation in Python 3.11
                async with asyncio.timeout(min(max(left, SHORTEST_PAUSE), LONGEST_PAUSE)):
                    await self._woken.wait()
            self._woken.clear()

    async def _send(self) -> None:
        for frame in self._end.connection.frames():
            await self._robot.send(frame)

    async def _tell(self) -> None:
        """Send the page the preview, if it has changed."""
        if (news := self._end.news_of_preview()) is not None:
            await self._page.send(encode(news, self._encoding))

    async def _tell_course(self) -> None:
        """Send the page the states of parts that it lacks, for a cell unknown to the robot's server."""
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
        news, self._heard = self._course.after(self._heard)
        while news:
            for one in news:
                await self._page.send(encode(one, self._encoding))
            news, self._heard = self._course.after(self._heard)

    def close(self) -> None:
        """Stop the thread that computes the states of parts."""
        if self._course is not None:
            self._course.close()
