"""The server: sockets that lead to robots. All that is decided is decided elsewhere; here bytes come and go."""

from __future__ import annotations

import asyncio
import logging
import ssl
import time
from collections.abc import Callable, Coroutine
from contextlib import suppress
from http import HTTPStatus
from math import inf
from socket import SO_SNDBUF, SOL_SOCKET
from typing import Any
from urllib.parse import unquote, urlsplit

from msgspec import Struct
from websockets.asyncio.server import Server as Listening
from websockets.asyncio.server import ServerConnection as Socket
from websockets.asyncio.server import broadcast, serve
from websockets.exceptions import ConnectionClosed
from websockets.http11 import Request, Response
from websockets.typing import Origin

from vrs_cli.errors import LimitReached, RequestRefused, VrsError
from vrs_cli.interfaces.conversation.internal_error import internal_error
from vrs_cli.net import messages
from vrs_cli.net.audit import Audit
from vrs_cli.net.client_session import TYPING, ClientSession
from vrs_cli.net.limits import Allowance, Bucket, Crowd
from vrs_cli.net.protocol import ServerConnection
from vrs_cli.net.room import Hub, Room
from vrs_cli.net.sockets import SharedDeflate, SocketSink
from vrs_cli.net.tokens import OPEN, Grant, TokenFile
from vrs_cli.wire.refusal import Refusal

LONGEST_WAIT = 0.1  # [s] after which a client's share is looked at again: others may be gone
TICK = 0.1  # [s] between two looks at what time has changed
LOOK = 0.25  # [s] between two looks at the file of tokens; two find that it has changed
HIGH_WATER = 64 * 1024  # bytes that a socket holds before it is given no more
HELD = (
    64 * 1024
)  # bytes that the system holds: left to itself it takes megabytes, and asks for more when a third is gone
BACKLOG = 512 * 1024  # bytes beside these that wait for a socket
PINGS, PATIENCE = 20.0, 20.0  # [s] between two questions whether a client is there, and until it has to answer
MISHAPS = 20  # errors of vrs itself that are told, each with a file
PAUSE = 1.0  # [s] after one, where it might come again at once
FLOOD = 10.0  # [s] of messages that come too fast, after which a connection is closed
MOST_PARKED = 4_000_000  # bytes of requests of one client that wait for its share: after these nothing is read of it
SHORT = 2.0  # [s] in which a client takes leave
ROBOTS = "/robots/"


class ListenAddress(Struct, frozen=True):
    """Where a server listens. `origins`: the pages of which sites may open a connection; programs send none."""

    host: str
    port: int
    tls: ssl.SSLContext | None = None
    origins: tuple[str, ...] = ()

    def address(self, port: int) -> str:
        host = f"[{self.host}]" if ":" in self.host else self.host or "0.0.0.0"
        return f"{'wss' if self.tls else 'ws'}://{host}:{port}"


class _Link:
    """One socket, and who is behind it."""

    def __init__(self, socket: Socket, connection: ServerConnection, allowance: Allowance) -> None:
        self.connection, self.socket = connection, socket
        peer = socket.remote_address or ("", 0)
        self.host, self.address = str(peer[0]), f"{peer[0]}:{peer[1]}"
        self.client: ClientSession | None = None
        self.room: Room | None = None
        self.rate = Bucket(allowance.rate, allowance.burst, time.monotonic())
        self.fast = 0  # messages that came too fast, one after the other
        self.sink = SocketSink(socket)
        socket.transport.get_extra_info("socket").setsockopt(SOL_SOCKET, SO_SNDBUF, HELD)
        self.deflates = self.sink.deflates
        self._drains = False  # it waits for its socket
        self._tasks: set[asyncio.Task[None]] = set()

    def flush(self) -> None:
        if self.socket.transport.is_closing():
            return
        while self.sink.waiting <= HIGH_WATER and (frames := self.connection.frames(HIGH_WATER)):
            for frame in frames:
                broadcast([self.socket], frame)
        self._count()
        if self.connection.closing:
            self._spawn(self._close())
        elif not self._drains and (self.sink.waiting > HIGH_WATER or self._has_more):
            self._drains = True
            self._spawn(self._drain())

    @property
    def _has_more(self) -> bool:
        """Whether a long reply to this client is not sent to its end yet."""
        return self.client is not None and self.client.link is self and self.client.has_more

    def _count(self) -> None:
        """Say how far it is behind."""
        if self.client is not None and self.client.link is self:
            self.client.pace.waiting = self.connection.waiting + self.sink.waiting

    async def _drain(self) -> None:
        """Go on, a part of a long reply after the other, whenever the socket has taken what it holds."""
        with suppress(OSError):
            while (self.sink.waiting > HIGH_WATER or self._has_more) and not self.socket.transport.is_closing():
                if self.sink.waiting > HIGH_WATER:
                    with suppress(TimeoutError):
                        async with asyncio.timeout(TICK):
                            await self.socket.drain()
                    self._count()
                else:
                    assert self.client is not None
                    self.client.tell_more()
                    self.flush()
                    await asyncio.sleep(0)  # others have their turns
        self._drains = False
        self.flush()

    async def _close(self) -> None:
        if self.sink.waiting > HIGH_WATER:
            self.socket.transport.abort()  # nobody reads: there is nobody to take leave of
        else:
            await self.socket.close()

    def ping(self) -> None:
        self._spawn(self._ping())

    async def _ping(self) -> None:
        try:
            await (await self.socket.ping())
        except ConnectionClosed:
            return
        if self.client is not None:
            self.client.beat()

    def _spawn(self, work: Coroutine[Any, Any, None]) -> None:
        task = asyncio.get_running_loop().create_task(work)
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)


class Server:
    """Serves the robots of a hub. `tokens`: who may enter, None for everybody. `ready` is told the address once it
    listens; `tell` what whoever runs it has to know.
    """

    def __init__(
        self,
        place: ListenAddress,
        allowance: Allowance,
        audit: Audit,
        tokens: TokenFile | None,
        tell: Callable[[str], None],
    ) -> None:
        self._place, self._allowance, self._audit, self._tokens, self._tell = place, allowance, audit, tokens, tell
        self._crowd = Crowd(allowance)
        self._links: set[_Link] = set()
        self._strangers: set[_Link] = set()  # who have not said who they are
        self._looked = 0.0  # [s] when the tokens were looked at
        self._due: dict[str, asyncio.Event] = {}
        self._told, self._internal_errors = "", 0
        self._loop: asyncio.AbstractEventLoop | None = None
        self._hub: Hub | None = None
        self._broadcasts: set[asyncio.Task[None]] = set()
        self._waiting: dict[ClientSession, asyncio.Task[None]] = {}  # whose requests wait for their share
        self.opened: list[Callable[[Room], None]] = []  # they are told of every robot that is served
        self._too_fast = LimitReached(f"more than {allowance.rate:g} messages a second", "send fewer, or wait")

    def wake(self, name: str) -> None:
        """A robot has said something. In any thread."""
        if self._loop is not None and not self._loop.is_closed():
            self._loop.call_soon_threadsafe(self._pump, name)

    def grants(self) -> tuple[Grant, ...]:
        """Those of all tokens."""
        return () if self._tokens is None else self._tokens.tokens.grants

    @property
    def hub(self) -> Hub:
        assert self._hub is not None, "a server has robots"
        return self._hub

    async def run(self, hub: Hub, ready: Callable[[str], None], stop: asyncio.Event) -> None:
        """Until `stop`. Raises OSError where the address is taken."""
        self._loop, self._hub = asyncio.get_running_loop(), hub
        quiet = logging.Logger("vrs serve", logging.CRITICAL)
        for name in hub.rooms:
            self._follow(name)
        async with serve(
            self._served,
            self._place.host or None,
            self._place.port,
            ssl=self._place.tls,
            origins=[None, *map(Origin, self._place.origins)],
            process_request=self._asked,
            extensions=[SharedDeflate()],
            compression=None,
            max_size=self._allowance.message,
            ping_interval=PINGS,
            ping_timeout=PATIENCE,
            close_timeout=SHORT,
            server_header=None,
            logger=quiet,
        ) as listening:
            ready(self._place.address(listening.sockets[0].getsockname()[1]))
            ticking = asyncio.create_task(self._tick())
            await stop.wait()
            ticking.cancel()
            await self._take_leave(listening)

    async def _take_leave(self, listening: Listening) -> None:
        """Every holder is told that the server ends."""
        for task in self._broadcasts:
            task.cancel()
        for link in tuple(self._links):
            link.connection.close("the server ends")
            link.flush()
        listening.close()
        await listening.wait_closed()

    # --- sockets ---

    def _asked(self, socket: Socket, request: Request) -> Response | None:
        """Before there is a connection: whether there is such a place, and room."""
        if len(self._links) >= self._allowance.connections:
            return socket.respond(HTTPStatus.SERVICE_UNAVAILABLE, "this server has no room for one more connection\n")
        path = urlsplit(request.path).path
        if path not in ("", "/") and not path.startswith(ROBOTS):
            return socket.respond(HTTPStatus.NOT_FOUND, f"{ROBOTS}NAME is the address of a robot\n")
        return None

    async def _served(self, socket: Socket) -> None:
        """One connection, from its begin to its end."""
        connection = ServerConnection(time.monotonic(), self._allowance.message, BACKLOG)
        link = _Link(socket, connection, self._allowance)
        self._links.add(link)
        self._strangers.add(link)
        try:
            async for frame in socket:
                now, begun = time.monotonic(), time.thread_time()
                link.fast = 0 if link.rate.take(now) else link.fast + 1
                typing = False
                for message in link.connection.receive(frame, now):
                    typing = isinstance(message, TYPING)
                    await self._taken(link, message, len(frame))
                if link.fast > FLOOD * self._allowance.rate:
                    link.connection.close(self._too_fast.detail, Refusal.of(self._too_fast))
                link.flush()
                if link.connection.closing:
                    break
                if link.client is not None:
                    link.client.spend(time.thread_time() - begun, typing=typing)
                    while link.client.parked_bytes > MOST_PARKED:
                        await asyncio.sleep(TICK)
        except ConnectionClosed:
            pass
        finally:
            self._links.discard(link)
            self._strangers.discard(link)
            self._gone(link)

    async def _taken(self, link: _Link, message: messages.ClientMessage, size: int) -> None:
        client, room = link.client, link.room
        if isinstance(message, messages.Hello):
            await self._enter(link, message)
        elif client is not None and room is not None:
            if link.fast and not isinstance(message, messages.Abort | messages.Interrupt):
                client.refuse(message, self._too_fast, client.send)
                return
            if client.park(message, size):
                self._unpark(client)
            else:
                client.receive(message)
            if isinstance(message, messages.Bye):
                link.connection.why = "left"
                room.leave(client)

    def _unpark(self, client: ClientSession) -> None:
        """Have what waits for a client's share done in its time, whether it is still connected or not."""
        if client not in self._waiting:
            self._waiting[client] = asyncio.get_running_loop().create_task(self._wait_for_share(client))

    async def _wait_for_share(self, client: ClientSession) -> None:
        try:
            while (left := client.unpark()) is not None:
                if client.link is not None:
                    client.link.flush()
                await asyncio.sleep(min(left, LONGEST_WAIT))
        finally:
            del self._waiting[client]

    async def _enter(self, link: _Link, hello: messages.Hello) -> None:
        """Let somebody in, or say why not."""
        try:
            grant = self._grant(link, hello)
            name = self.hub.chosen(grant, self._wanted(link, hello))
            room = await self._opened(name)
            self._crowd.enter(grant.name)
        except VrsError as error:
            self._audit.note(hello.robot, hello.name, link.address, "(enter)", f"refused: {error}")
            link.connection.close(error.detail, Refusal.of(error))
            return
        self._strangers.discard(link)
        self._follow(name)
        link.room, link.client = room, room.enter(grant, hello, link)
        room.pump()
        self._audit.note(name, link.client.name, link.address, "(enter)", "done")

    async def _opened(self, name: str) -> Room:
        """Raises RequestRefused where a robot cannot be served; why is for whoever runs the server."""
        try:
            return await asyncio.to_thread(self.hub.open, name)
        except VrsError as error:
            self._tell(f"{name}: {error}")
            raise RequestRefused(f"{name} cannot be served now", "ask whoever runs the server") from None

    def _grant(self, link: _Link, hello: messages.Hello) -> Grant:
        """Raises RequestRefused."""
        if self._tokens is None:
            return OPEN
        grant = self._tokens.tokens.find(hello.token, time.time())
        if grant is not None:
            return grant
        now = time.monotonic()
        if self._crowd.guesses(link.host, now):
            raise RequestRefused("too many wrong tokens came from your address", "try again in a minute")
        self._crowd.guess(link.host, now)
        what = "this token is not known here, or has ended" if hello.token else "this server wants a token"
        raise RequestRefused(what, "ask whoever runs the server")

    @staticmethod
    def _wanted(link: _Link, hello: messages.Hello) -> str:
        """The robot of the address, or of the hello. Raises RequestRefused where they are not one."""
        request = link.socket.request
        path = "" if request is None else urlsplit(request.path).path
        named = unquote(path.removeprefix(ROBOTS)).strip("/") if path.startswith(ROBOTS) else ""
        if named and hello.robot and named != hello.robot:
            raise RequestRefused(f"the address says {named}, the client {hello.robot}", "name one robot")
        return named or hello.robot

    def _gone(self, link: _Link) -> None:
        """A socket is closed, or cut."""
        client, room = link.client, link.room
        if client is None or room is None:
            return
        self._crowd.leave(client.grant.name)
        room.cut(client, link)
        self._audit.note(room.name, client.name, link.address, "(leave)", link.connection.why or "cut")

    # --- robots ---

    def _pump(self, name: str) -> None:
        room = self.hub.rooms.get(name)
        if room is not None:
            self._guarded(room.pump)
            if name in self._due:
                self._due[name].set()

    def _follow(self, name: str) -> None:
        """Broadcast from a robot, from now on."""
        if name not in self._due:
            self._due[name] = asyncio.Event()
            room = self.hub.rooms[name]
            room.pump()  # what it has said before anybody was there to be woken
            for hear in self.opened:
                hear(room)
            task = asyncio.get_running_loop().create_task(self._broadcast(name))
            self._broadcasts.add(task)

    async def _broadcast(self, name: str) -> None:
        due, cast = self._due[name], self.hub.rooms[name].broadcast
        while True:
            due.clear()
            if not self._guarded(cast.step):
                await asyncio.sleep(PAUSE)
            left = cast.peek() - time.monotonic()
            if left <= 0.0:
                await asyncio.sleep(0)
                continue
            try:
                async with asyncio.timeout(None if left == inf else left):
                    await due.wait()
            except TimeoutError:
                continue

    # --- time ---

    async def _tick(self) -> None:
        while True:
            await asyncio.sleep(TICK)
            now = time.monotonic()
            for link in tuple(self._strangers):
                link.connection.look(now)
                link.flush()
            for room in self.hub.rooms.values():
                self._guarded(room.tick)
            if now - self._looked > LOOK:
                self._looked = now
                self._guarded(self._look_at_tokens)

    def _guarded(self, act: Callable[[], None]) -> bool:
        """An error of vrs itself is told, and all else goes on; whether there was none."""
        try:
            act()
        except Exception as error:
            self._internal_errors += 1
            if self._internal_errors <= MISHAPS:
                self._tell(internal_error(error).text)
            return False
        return True

    def _look_at_tokens(self) -> None:
        """Who has no token any more is out at once."""
        tokens = self._tokens
        if tokens is None:
            return
        tokens.look()
        if tokens.wrong and tokens.wrong != self._told:
            self._tell(tokens.wrong)
        self._told = tokens.wrong
        for room in self.hub.rooms.values():
            for client in tuple(room.clients.values()):
                if not tokens.tokens.holds(client.grant, time.time()):
                    self._revoke(room, client)

    def _revoke(self, room: Room, client: ClientSession) -> None:
        link = client.link
        if link is not None:
            refused = RequestRefused("your token was revoked, or has ended", "ask whoever runs the server")
            link.connection.close(refused.detail, Refusal.of(refused))
            link.flush()
        room.leave(client)
