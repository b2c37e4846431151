"""Serve robots over sockets: move bytes between connections and rooms. The rooms decide about robots."""

from __future__ import annotations

import asyncio
import logging
import ssl
import time
from collections.abc import Callable, Coroutine, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import partial
from http import HTTPStatus
from math import inf
from socket import SO_SNDBUF, SOL_SOCKET
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, cast
from urllib.parse import unquote

from msgspec import Struct
from websockets.asyncio.server import ServerConnection as Socket
from websockets.asyncio.server import broadcast, serve
from websockets.exceptions import ConnectionClosed, NegotiationError
from websockets.extensions import Extension
from websockets.extensions.permessage_deflate import PerMessageDeflate, ServerPerMessageDeflateFactory
from websockets.frames import OP_BINARY, OP_TEXT, Frame
from websockets.http11 import Request, Response
from websockets.protocol import OPEN as SOCKET_OPEN
from websockets.typing import ExtensionParameter

from vrs_cli.errors import LimitReached, NonexistentFile, RequestRefused, VrsError
from vrs_cli.interfaces.dialogue import internal_error
from vrs_cli.net import http, messages
from vrs_cli.net.class_board import ClassBoard
from vrs_cli.net.client_session import TYPING, ClientSession
from vrs_cli.net.durable_log import Audit
from vrs_cli.net.limits import Allowance, Bucket, Crowd
from vrs_cli.net.protocol import ServerConnection
from vrs_cli.net.room import Hub, Room
from vrs_cli.net.stream import WINDOW_BITS, Packet
from vrs_cli.net.tokens import OPEN, Grant, TokenFile
from vrs_cli.wire.messages import Refusal

if TYPE_CHECKING:
    from vrs_cli.net.relay import Relay

MAX_SHARE_WAIT_S = 0.1  # [s] maximum wait before a client's CPU share is checked again: it grows when others leave
TICK = 0.1  # [s] time between two calls of the periodic work
TOKEN_CHECK_S = 0.25  # [s] time between two checks of the token file; a change takes effect after two checks
HIGH_WATER = 64 * 1024  # number of unsent bytes in a socket above which it gets no more bytes
# size of the operating system's send buffer; its default is megabytes, and it is refilled when a third is sent
SYSTEM_BUFFER_BYTES = 64 * 1024
BACKLOG = 512 * 1024  # maximum number of bytes that wait for a socket, in addition to the bytes in the socket
PING_INTERVAL_S, PING_TIMEOUT_S = 20.0, 20.0  # [s] time between two pings, and maximum wait for the answer
MAX_REPORTED = 20  # maximum number of reported internal errors, each of which writes a file
PAUSE = 1.0  # [s] pause after an internal error, because the error may occur again immediately
FLOOD = 10.0  # [s] how long messages may arrive too fast before the connection is closed
MAX_PARKED_BYTES = 4_000_000  # bytes of delayed requests above which the server stops reading from a client
NO_RELAYS: Mapping[str, Relay] = MappingProxyType({})
CLOSE_TIMEOUT_S = 2.0  # [s] maximum time for a client to close its connection


class ListenAddress(Struct, frozen=True):
    """The address at which a server listens. `origins`: the other sites whose pages may open a connection (programs
    send no origin)."""

    host: str
    port: int
    tls: ssl.SSLContext | None = None
    origins: tuple[str, ...] = ()

    def address(self, port: int) -> str:
        host = f"[{self.host}]" if ":" in self.host else self.host or "0.0.0.0"
        return f"{'wss' if self.tls else 'ws'}://{host}:{port}"


# --- sockets of a broadcast -------------------------------------------------------------------------------------------
#
# A broadcast sends the same bytes, deflated or not, to many connections. A message to a single connection goes through
# `connection.send`, and is not deflated, so it does not disturb deflated messages that refer to each other (RFC 7692,
# 7.2.3.2).


class SocketSink:
    """A socket of the server as the `Sink` of a broadcast."""

    def __init__(self, connection: Socket) -> None:
        self._protocol, self._transport = connection.protocol, connection.transport
        self.deflates = any(isinstance(extension, Inflating) for extension in connection.protocol.extensions)

    @property
    def waiting(self) -> int:
        return self._transport.get_write_buffer_size()

    def send(self, *packets: Packet) -> None:
        """Send packets. Each frame is built once for all connections; `websockets.broadcast` would build it again for
        each connection."""
        if self._protocol.state is SOCKET_OPEN and not self._transport.is_closing():
            for packet in packets:
                if not packet.frame:  # RFC 6455, 5.2
                    frame = Frame(OP_TEXT if packet.text else OP_BINARY, packet.data)
                    packet.frame = frame.serialize(mask=False, extensions=[] if packet.place is None else [_Deflated()])
            self._transport.write(b"".join([packet.frame for packet in packets]))


class _Deflated(Extension):
    """An extension that marks a frame as already deflated (RFC 7692, 6)."""

    def encode(self, frame: Frame) -> Frame:
        return replace(frame, rsv1=True)


class Inflating(PerMessageDeflate):
    """An extension that inflates received frames, and sends frames unchanged."""

    def encode(self, frame: Frame) -> Frame:
        return frame


class SharedDeflate(ServerPerMessageDeflateFactory):
    """The permessage-deflate settings shared by all connections, so that a message is compressed once for all:
    full-size windows and context takeover. A client that does not support these settings gets uncompressed messages.
    """

    def __init__(self) -> None:
        super().__init__(client_no_context_takeover=True)  # clients send little, so no compression context is kept

    def process_request_params(
        self, params: Sequence[ExtensionParameter], accepted_extensions: Sequence[Extension]
    ) -> tuple[list[ExtensionParameter], PerMessageDeflate]:
        answer, agreed = super().process_request_params(params, accepted_extensions)
        if agreed.local_no_context_takeover or agreed.local_max_window_bits < WINDOW_BITS:
            raise NegotiationError("what is sent to all is deflated with whole windows")
        return answer, Inflating(
            agreed.remote_no_context_takeover,
            True,  # keep no compression context for this connection
            agreed.remote_max_window_bits,
            WINDOW_BITS,
        )


# --- connections ----------------------------------------------------------------------------------------------------


class _Link:
    """A socket and its client."""

    def __init__(self, socket: Socket, connection: ServerConnection, allowance: Allowance) -> None:
        self.connection, self.socket = connection, socket
        peer = socket.remote_address or ("", 0)
        self.host, self.address = str(peer[0]), f"{peer[0]}:{peer[1]}"
        self.client: ClientSession | None = None
        self.room: Room | None = None
        self.rate = Bucket(allowance.rate, allowance.burst, time.monotonic())
        self.fast = 0  # number of successive messages that came too fast
        self.sink = SocketSink(socket)
        socket.transport.get_extra_info("socket").setsockopt(SOL_SOCKET, SO_SNDBUF, SYSTEM_BUFFER_BYTES)
        self.deflates = self.sink.deflates
        self._drains = False  # whether `_drain` is running
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
        """Return whether parts of a long reply to this client are still unsent."""
        return self.client is not None and self.client.link is self and self.client.has_more

    def _count(self) -> None:
        """Tell the client session the number of unsent bytes."""
        if self.client is not None and self.client.link is self:
            self.client.pace.waiting = self.connection.waiting + self.sink.waiting

    async def _drain(self) -> None:
        """Send the waiting frames, and the parts of a long reply, each time the socket has sent its bytes."""
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
                    await asyncio.sleep(0)  # lets other tasks run
        self._drains = False
        self.flush()

    async def _close(self) -> None:
        if self.sink.waiting > HIGH_WATER:
            self.socket.transport.abort()  # the client reads nothing, so no closing handshake is possible
        else:
            await self.socket.close()

    def ping(self) -> None:
        async def ask() -> None:
            with suppress(ConnectionClosed):
                await (await self.socket.ping())
                if self.client is not None:
                    self.client.beat()

        self._spawn(ask())

    def _spawn(self, work: Coroutine[Any, Any, None]) -> None:
        task = asyncio.create_task(work)
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)


def _robot_in_path(socket: Socket) -> str:
    """Return the robot's name in the address of a connection; "" if it names none."""
    path = "" if socket.request is None else http.path_of(socket.request)
    return unquote(path.removeprefix(http.ROBOTS)).strip("/") if path.startswith(http.ROBOTS) else ""


class Server:
    """A server of the robots of a hub.

    `tokens`: the users who may connect; None: everybody. `tell`: takes messages for the person who runs the server.
    `pages`: the page for browsers; None: no page. `relays`: relays to robots on other servers, by name. `opened`:
    functions that are called with every robot that is served.
    """

    hub: Hub

    def __init__(
        self,
        place: ListenAddress,
        allowance: Allowance,
        audit: Audit,
        tokens: TokenFile | None,
        tell: Callable[[str], None],
        pages: http.ServedPage | None = None,
        relays: Mapping[str, Relay] = NO_RELAYS,
    ) -> None:
        self._place, self._allowance, self._audit, self._tokens, self._tell = place, allowance, audit, tokens, tell
        self._crowd, self._relays = Crowd(allowance), relays
        self._links: set[_Link] = set()
        self._looked = 0.0  # [s] time of the last check of the tokens
        self._due: dict[str, asyncio.Event] = {}
        self._token_error, self._internal_errors = "", 0
        self._loop: asyncio.AbstractEventLoop | None = None
        self._broadcasts: dict[str, asyncio.Task[None]] = {}  # broadcasts by robot
        self._dropping: asyncio.Task[None] | None = None
        self._waiting: dict[ClientSession, asyncio.Task[None]] = {}  # for clients whose requests wait for CPU time
        self.opened: list[Callable[[Room], None]] = []
        self.board: ClassBoard | None = None  # the board of the served class, if any
        self._too_fast = LimitReached(f"more than {allowance.rate:g} messages a second", "send fewer, or wait")
        tls = place.tls is not None
        self._http = http.HttpAnswers(
            pages,
            http.OwnNames(place.host, tls=tls, origins=place.origins),
            place.origins,
            self._find,
            lambda grant: (*self.hub.names(grant),),  # `run` sets the hub
            lambda grant, name: (self.hub.choose(grant, name), *self.hub.own_names(grant)),
            self._mesh,
            tell,
            tls=tls,
            tokens=tokens is not None,
        )

    def wake(self, name: str) -> None:
        """Schedule the sending of a robot's new messages. Any thread may call this method."""
        if self._loop is not None and not self._loop.is_closed():
            self._loop.call_soon_threadsafe(self._pump, name)

    def grants(self) -> tuple[Grant, ...]:
        """Return the grants of all tokens."""
        return () if self._tokens is None else self._tokens.tokens.grants

    async def run(self, hub: Hub, ready: Callable[[str], None], stop: asyncio.Event) -> None:
        """Serve until `stop` is set. `ready` is called with the address when the server listens. Raises OSError if the
        address is in use.
        """
        self._loop, self.hub = asyncio.get_running_loop(), hub
        for name in hub.rooms:
            self._follow(name)
        async with serve(
            self._serve,
            self._place.host or None,
            self._place.port,
            ssl=self._place.tls,
            process_request=self._answer_request,
            create_connection=cast(type[Socket], partial(http.HttpSocket, doorway=http.Doorway())),
            open_timeout=http.BODY_SECONDS,
            ssl_handshake_timeout=http.REQUEST_SECONDS if self._place.tls else None,
            extensions=[SharedDeflate()],
            compression=None,
            max_size=self._allowance.message,
            ping_interval=PING_INTERVAL_S,
            ping_timeout=PING_TIMEOUT_S,
            close_timeout=CLOSE_TIMEOUT_S,
            server_header=None,
            logger=logging.Logger("vrs serve", logging.CRITICAL),  # reports nothing
        ) as listening:
            self._http.port = listening.sockets[0].getsockname()[1]
            ready(self._place.address(self._http.port))
            ticking = asyncio.create_task(self._tick())
            await stop.wait()
            ticking.cancel()
            for task in self._broadcasts.values():
                task.cancel()
            for link in tuple(self._links):
                link.connection.close("the server ends")
                link.flush()
            listening.close()
            await listening.wait_closed()

    # --- sockets ---

    async def _answer_request(self, socket: Socket, request: Request) -> Response | None:
        """Return the answer to an HTTP request; None to open a connection. Refuse connections to unknown addresses, and
        all if there are too many."""
        if len(self._links) >= self._allowance.connections:
            return http.refusal_of(HTTPStatus.SERVICE_UNAVAILABLE, "this server has no room for one more connection")
        assert isinstance(socket, http.HttpSocket)
        return await self._http.answer(socket, request)

    def _mesh(self, name: str, file: str) -> bytes:
        """Return a mesh of a robot. Raises NonexistentFile, or the error of reading the mesh."""
        if (relay := self._relays.get(name)) is not None:
            return relay.mesh(file)
        if (room := self.hub.rooms.get(name)) is not None:
            return room.shapes.glb(file)
        raise NonexistentFile(file)

    async def _serve(self, socket: Socket) -> None:
        """Serve one connection until it ends."""
        assert isinstance(socket, http.HttpSocket)
        socket.let_in()
        if (relay := self._relays.get(_robot_in_path(socket))) is not None:
            try:
                await relay.serve(socket)
            except Exception as error:
                self._report(error)
            return
        link = _Link(socket, ServerConnection(time.monotonic(), self._allowance.message, BACKLOG), self._allowance)
        self._links.add(link)
        try:
            async for frame in socket:
                now, begun = time.monotonic(), time.thread_time()
                link.fast = 0 if link.rate.take(now) else link.fast + 1
                typing = False
                for message in link.connection.receive(frame, now):
                    typing = isinstance(message, TYPING)
                    await self._take(link, message, len(frame))
                if link.fast > FLOOD * self._allowance.rate:
                    link.connection.close(self._too_fast.detail, Refusal.of(self._too_fast))
                link.flush()
                if link.connection.closing:
                    break
                if link.client is not None:
                    link.client.spend(time.thread_time() - begun, typing=typing)
                    while link.client.parked_bytes > MAX_PARKED_BYTES:
                        await asyncio.sleep(TICK)
        except ConnectionClosed:
            pass
        finally:
            self._links.discard(link)
            if link.client is not None and link.room is not None:
                self._crowd.leave(link.client.grant.name)
                link.room.cut(link.client, link)
                why = link.connection.why or "cut"
                self._audit.note(link.room.name, link.client.name, link.address, "(leave)", why)

    async def _take(self, link: _Link, message: messages.ClientMessage, size: int) -> None:
        client, room = link.client, link.room
        if isinstance(message, messages.Hello):
            await self._enter(link, message)
        elif client is not None and room is not None:
            if self.board is not None and await self.board.receive(client, message):
                return
            if link.fast and not isinstance(message, messages.Abort | messages.Interrupt):
                client.refuse(message, self._too_fast, client.send)
                return
            if client.park(message, size):
                if client not in self._waiting:
                    self._waiting[client] = asyncio.create_task(self._wait_for_share(client))
            else:
                client.receive(message)
            if isinstance(message, messages.Bye):
                link.connection.why = "left"
                room.leave(client)

    async def _wait_for_share(self, client: ClientSession) -> None:
        """Execute the delayed requests of a client when CPU time is available, even if its connection is cut."""
        try:
            while (left := client.unpark()) is not None:
                client.flush()
                await asyncio.sleep(min(left, MAX_SHARE_WAIT_S))
        finally:
            del self._waiting[client]

    async def _enter(self, link: _Link, hello: messages.Hello) -> None:
        """Add a client to its robot, or send the client the reason for a refusal."""
        try:
            grant, named = self._grant(link, hello), _robot_in_path(link.socket)
            if named and hello.robot and named != hello.robot:
                raise RequestRefused(f"the address says {named}, the client {hello.robot}", "name one robot")
            name = self.hub.choose(grant, named or hello.robot)
            try:
                room = await asyncio.to_thread(self.hub.open, name)
            except VrsError as error:
                self._tell(f"{name}: {error}")
                raise RequestRefused(f"{name} cannot be served now", "ask whoever runs the server") from None
            self._crowd.enter(grant.name)
        except VrsError as error:
            self._audit.note(hello.robot, hello.name, link.address, "(enter)", f"refused: {error}")
            link.connection.close(error.detail, Refusal.of(error))
            return
        self._follow(name)
        link.room, link.client = room, room.enter(grant, hello, link)
        room.pump()
        self._audit.note(name, link.client.name, link.address, "(enter)", "done")
        if self.board is not None:
            self.board.enter(link.client)
            self.board.tell()

    def _grant(self, link: _Link, hello: messages.Hello) -> Grant:
        """Return the grant that belongs to a client's token or, for a page of this server, to its cookie. Raises
        RequestRefused.
        """
        token, socket = hello.token, link.socket
        if not token and isinstance(socket, http.HttpSocket) and socket.same_origin and socket.request is not None:
            token = http.token_of(socket.request.headers, self._http.port)
        return self._find(token, link.host)

    def _find(self, token: str, host: str) -> Grant:
        """Return the grant of a token from a host. Raises RequestRefused for a wrong token, or after too many of
        them."""
        if self._tokens is None:
            return OPEN
        if (grant := self._tokens.tokens.find(token, time.time())) is not None:
            return grant
        now = time.monotonic()
        if self._crowd.guesses(host, now):
            raise RequestRefused("too many wrong tokens came from your address", "try again in a minute")
        self._crowd.guess(host, now)
        raise RequestRefused(
            "this token is not known here, or has ended" if token else "this server wants a token",
            "ask whoever runs the server",
        )

    # --- robots ---

    def _pump(self, name: str) -> None:
        if (room := self.hub.rooms.get(name)) is not None:
            self._guard(room.pump)
            if name in self._due:
                self._due[name].set()

    def _follow(self, name: str) -> None:
        """Start to broadcast from a robot, if the broadcast is not running yet."""
        if name not in self._due:
            self._due[name] = asyncio.Event()
            room = self.hub.rooms[name]
            room.pump()  # sends messages from before `_pump` could find the room
            for hear in self.opened:
                hear(room)
            self._broadcasts[name] = asyncio.create_task(self._broadcast(name))

    async def _broadcast(self, name: str) -> None:
        due, cast = self._due[name], self.hub.rooms[name].broadcast
        while True:
            due.clear()
            if not self._guard(cast.step):
                await asyncio.sleep(PAUSE)
            left = cast.peek() - time.monotonic()
            if left <= 0.0:
                await asyncio.sleep(0)
                continue
            with suppress(TimeoutError):
                async with asyncio.timeout(None if left == inf else left):
                    await due.wait()

    # --- periodic work ---

    async def _tick(self) -> None:
        while True:
            await asyncio.sleep(TICK)
            now = time.monotonic()
            for link in [link for link in self._links if link.client is None]:
                link.connection.look(now)
                link.flush()
            for room in self.hub.rooms.values():
                self._guard(room.tick)
            if now - self._looked > TOKEN_CHECK_S:
                self._looked = now
                self._guard(self._look_at_tokens)
                if self.board is not None:
                    self._guard(self.board.tell)

    def _guard(self, act: Callable[[], None]) -> bool:
        """Call `act`, and report an error that it raises. Return True if there was none."""
        try:
            act()
        except Exception as error:
            self._report(error)
            return False
        return True

    def _report(self, error: Exception) -> None:
        self._internal_errors += 1
        if self._internal_errors <= MAX_REPORTED:
            self._tell(internal_error(error).text)

    def _look_at_tokens(self) -> None:
        """Read the token file again if it has changed; disconnect users whose token has expired or was revoked."""
        if (tokens := self._tokens) is None:
            return
        if tokens.look():

            async def drop_forgotten() -> None:
                for room in await asyncio.to_thread(self.hub.drop_forgotten):
                    await self._end(room)

            self._dropping = asyncio.create_task(drop_forgotten())
        if tokens.wrong and tokens.wrong != self._token_error:
            self._tell(tokens.wrong)
        self._token_error = tokens.wrong
        for room in self.hub.rooms.values():
            for client in tuple(room.clients.values()):
                if tokens.tokens.holds(client.grant, time.time()):
                    continue
                if client.link is not None:
                    refused = RequestRefused("your token was revoked, or has ended", "ask whoever runs the server")
                    client.link.connection.close(refused.detail, Refusal.of(refused))
                    client.flush()
                room.leave(client)

    def begin_anew(self, name: str, why: str) -> None:
        """Close a robot, so that it is opened again when the next client comes. Its users get the reason `why`, and
        reconnect. Any thread may call this method."""

        async def begin() -> None:
            if (room := await asyncio.to_thread(self.hub.take_away, name)) is not None:
                for client in tuple(room.clients.values()):
                    if client.link is not None:
                        client.link.connection.close(why)
                        client.flush()
                    room.leave(client)
                await self._end(room)

        if self._loop is not None and not self._loop.is_closed():
            asyncio.run_coroutine_threadsafe(begin(), self._loop)

    async def _end(self, room: Room) -> None:
        """Close a robot that was removed from the hub."""
        if (task := self._broadcasts.pop(room.name, None)) is not None:
            task.cancel()
        self._due.pop(room.name, None)
        try:
            await asyncio.to_thread(room.close)
        except VrsError as error:
            self._tell(f"{room.name}: {error}")
