"""Delay the bytes between real sockets. Each piece sent to one end arrives at the other end after its delay. Each
client is connected to the target. Bytes travel in both directions unchanged and in order; the end of a direction is
delayed too. The number of bytes in transit is bounded, so a slow reader slows down the sender."""

from __future__ import annotations

import asyncio
import socket
import struct
from collections.abc import Callable
from typing import NamedTuple

from vrs_cli.net.delay_line import DelayLine, DelayWays

PIECE = 1 << 16  # maximum bytes read and delayed as one piece: usually one message
MAX_BYTES_ON_WAY = 1 << 22  # maximum bytes in transit in one direction: 10 MB/s over 0.4 s


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
        """Wait until the time t [s]."""
        await asyncio.sleep(max(t - self.now(), 0.0))


class _Way:
    """One direction of one connection. `held`: bytes on their way; `passed`: bytes that have arrived."""

    def __init__(self, line: DelayLine, time: Time) -> None:
        self.held = self.passed = 0
        self._line, self._time = line, time
        # arrival times [s] and pieces; an empty piece marks the end
        self._pieces: asyncio.Queue[tuple[float, bytes]] = asyncio.Queue()
        self._went = asyncio.Event()

    async def receive(self, reader: asyncio.StreamReader) -> None:
        """Read all bytes of the sender; wait while too many are on their way."""
        while True:
            while self.held >= MAX_BYTES_ON_WAY:
                self._went.clear()
                await self._went.wait()
            piece = await reader.read(PIECE)
            self._pieces.put_nowait((self._line.arrival(self._time.now()), piece))
            self.held += len(piece)
            if not piece:
                return

    async def deliver(self, writer: asyncio.StreamWriter) -> None:
        """Write each piece when it is due."""
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
            self._went.set()


class ProxyConnection:
    """A connection from `peer`, in both directions."""

    def __init__(self, number: int, peer: str, ways: DelayWays, time: Time) -> None:
        self.number, self.peer = number, peer
        self.forward, self.backward = (_Way(line, time) for line in ways.lines(number))

    async def carry(
        self,
        near: tuple[asyncio.StreamReader, asyncio.StreamWriter],
        far: tuple[asyncio.StreamReader, asyncio.StreamWriter],
    ) -> None:
        """Carry bytes until both ways have ended and all bytes have arrived. Raises OSError if one end is gone."""
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
        self.count = 0  # connections so far
        self._target, self._ways, self._tell, self._time = target, ways, tell, time or Time()
        self._server: asyncio.Server | None = None
        self._tasks: set[asyncio.Task[None]] = set()

    async def listen(self, at: Endpoint) -> Endpoint:
        """Listen at an address; return it, with the chosen port for port 0. Raises OSError."""
        self._server = await asyncio.start_server(self._accept, at.host, at.port)
        host, port = self._server.sockets[0].getsockname()[:2]
        return Endpoint(host, port)

    async def close(self) -> None:
        """Listen no more, and end all connections."""
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
    """Reset a connection, so that the other end sees a failure; a closed one stays closed."""
    if not writer.transport.is_closing():
        writer.get_extra_info("socket").setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
    writer.transport.abort()
