"""A line with delays between real sockets: on loopback, with a clock that goes on when a test says so."""

from __future__ import annotations

import asyncio
import heapq
import socket
from asyncio import StreamReader, StreamWriter
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager
from dataclasses import dataclass, field
from typing import Any

import pytest

from vrs_cli.net.delay_line import (
    MAX_BYTES_ON_WAY,
    Constant,
    DelayProxy,
    Delays,
    DelayWays,
    Endpoint,
    Gamma,
    Time,
    _reset,
)

LOOPBACK = "127.0.0.1"
SOON = 20.0  # [s] in which anything at all happens that does not hang
FORWARD, BACKWARD = Constant(2.0), Constant(3.0)

Streams = tuple[StreamReader, StreamWriter]


class ManualTime(Time):
    """It is as late as a test says; `due`: what is waited for."""

    def __init__(self) -> None:
        self.t, self.looks = 0.0, 0
        self.due: list[tuple[float, int, asyncio.Event]] = []
        self._waits = asyncio.Event()

    def now(self) -> float:
        self.looks += 1
        return self.t

    async def until(self, t: float) -> None:
        if t > self.t:
            event = asyncio.Event()
            heapq.heappush(self.due, (t, id(event), event))
            self._waits.set()
            await event.wait()

    async def next_due(self) -> float:
        """When the next piece arrives, once something is on its way."""
        while not self.due:
            self._waits.clear()
            await self._waits.wait()
        return self.due[0][0]

    def go_on(self, t: float) -> None:
        self.t = t
        while self.due and self.due[0][0] <= t:
            heapq.heappop(self.due)[2].set()


@dataclass
class Scene:
    """A proxy, and a server behind it that a test holds in its hands."""

    proxy: DelayProxy
    at: Endpoint
    time: ManualTime
    arrived: asyncio.Queue[Streams]
    told: list[str] = field(default_factory=list)

    async def connect(self) -> tuple[Streams, Streams]:
        """Both ends of a new connection."""
        near = await asyncio.open_connection(*self.at)
        return near, await self.arrived.get()


@asynccontextmanager
async def scene(forward: Delays = FORWARD, backward: Delays = BACKWARD) -> AsyncIterator[Scene]:
    arrived: asyncio.Queue[Streams] = asyncio.Queue()

    async def accept(reader: StreamReader, writer: StreamWriter) -> None:
        await arrived.put((reader, writer))

    server = await asyncio.start_server(accept, LOOPBACK, 0)
    host, port = server.sockets[0].getsockname()
    time, told = ManualTime(), list[str]()
    proxy = DelayProxy(Endpoint(host, port), DelayWays(forward, backward), told.append, time)
    at = await proxy.listen(Endpoint(LOOPBACK, 0))
    try:
        yield Scene(proxy, at, time, arrived, told)
    finally:
        await proxy.close()
        server.close()


def run(test: Callable[[], Awaitable[Any]]) -> None:
    async def bounded() -> None:
        async with asyncio.timeout(SOON):
            await test()

    asyncio.run(bounded())


async def nothing_comes(reader: StreamReader) -> bool:
    """All that could come without time going on has been given its turn."""
    reading = asyncio.ensure_future(reader.read(1))
    for _ in range(50):
        await asyncio.sleep(0)
    nothing = not reading.done()
    reading.cancel()
    await asyncio.wait([reading])
    return nothing


def test_each_piece_arrives_after_its_delay_and_not_before() -> None:
    async def test() -> None:
        async with scene() as it:
            (near_reader, near), (far_reader, far) = await it.connect()
            near.write(b"MOVE a")
            assert await it.time.next_due() == 2.0
            it.time.go_on(1.9)
            assert await nothing_comes(far_reader)
            it.time.go_on(2.0)
            assert await far_reader.readexactly(6) == b"MOVE a"
            far.write(b"done")
            assert await it.time.next_due() == 5.0
            assert await nothing_comes(near_reader)
            it.time.go_on(5.0)
            assert await near_reader.readexactly(4) == b"done"

    run(test)


def test_many_pieces_are_on_their_way_at_once_and_keep_their_order() -> None:
    async def test() -> None:
        async with scene(Gamma(2.0, 1.0)) as it:
            (_, near), (far_reader, _) = await it.connect()
            way = it.proxy.connections[1].forward
            for k in range(20):
                near.write(b"%02d" % k)
                while way.held < 2 * (k + 1):
                    await asyncio.sleep(0)
                it.time.t += 0.1  # without what is due
            it.time.go_on(100.0)
            assert await far_reader.readexactly(40) == b"".join(b"%02d" % k for k in range(20))

    run(test)


def test_the_end_of_one_way_arrives_and_the_other_goes_on() -> None:
    async def test() -> None:
        async with scene() as it:
            (near_reader, near), (far_reader, far) = await it.connect()
            near.write(b"last words")
            near.write_eof()
            await it.time.next_due()
            it.time.go_on(2.0)
            assert await far_reader.read() == b"last words"
            far.write(b"an answer all the same")
            far.close()
            await it.time.next_due()
            it.time.go_on(5.0)
            assert await near_reader.read() == b"an answer all the same"
            near.close()
            while it.proxy.connections:
                await asyncio.sleep(0)
            assert it.told[-1] == "1: over, 10 bytes there, 22 back"

    run(test)


def test_who_does_not_read_slows_down_who_sends() -> None:
    async def test() -> None:
        async with scene(Constant(0.0), Constant(0.0)) as it:
            (_, near), (far_reader, _) = await it.connect()
            way, sent, much = it.proxy.connections[1].forward, 0, 16 * MAX_BYTES_ON_WAY
            near.transport.set_write_buffer_limits(1 << 16)

            async def send() -> None:
                nonlocal sent
                while sent < much:
                    near.write(b"x" * (1 << 16))
                    sent += 1 << 16
                    await near.drain()

            sending, before = asyncio.ensure_future(send()), -1
            while before != (before := sent) or way.held < MAX_BYTES_ON_WAY:  # until nothing goes on
                for _ in range(200):
                    await asyncio.sleep(0)
            assert sent < much, "the sender waits"
            assert 4 << 20 <= way.held < (4 << 20) + (1 << 17), "4 MB"
            looks = it.time.looks
            for _ in range(200):
                await asyncio.sleep(0)
            assert it.time.looks == looks, "and nobody is busy meanwhile"
            received = 0
            while received < much:
                received += len(await far_reader.read(1 << 20))
            await sending

    run(test)


def test_each_connection_has_delays_of_its_own() -> None:
    async def test() -> None:
        async with scene(Gamma(2.0, 1.0)) as it:
            dues = []
            for _ in range(3):
                (_, near), (far_reader, _) = await it.connect()
                near.write(b"x")
                dues.append(await it.time.next_due() - it.time.t)
                it.time.go_on(it.time.t + 100.0)
                await far_reader.readexactly(1)
            alike = [DelayWays(Gamma(2.0, 1.0), BACKWARD).lines(n)[0].arrival(0.0) for n in (1, 2, 3)]
            assert dues == pytest.approx(alike)
            assert len(set(dues)) == 3

    run(test)


def test_a_target_that_is_not_there_ends_the_connection() -> None:
    async def test() -> None:
        with socket.socket() as taken:
            taken.bind((LOOPBACK, 0))  # and nobody listens
            told = list[str]()
            proxy = DelayProxy(Endpoint(*taken.getsockname()), DelayWays(FORWARD, BACKWARD), told.append)
            reader, _ = await asyncio.open_connection(*await proxy.listen(Endpoint(LOOPBACK, 0)))
            with pytest.raises(ConnectionError):
                await reader.readexactly(1)
            assert "cannot be reached" in told[0]
            await proxy.close()

    run(test)


@pytest.mark.parametrize("who", ["near", "far"])
def test_an_end_that_goes_takes_the_other_with_it(who: str) -> None:
    async def test() -> None:
        async with scene() as it:
            near, far = await it.connect()
            gone, left = (near, far) if who == "near" else (far, near)
            _reset(gone[1])
            with pytest.raises(ConnectionError):
                await left[0].readexactly(1)
            while it.proxy.connections:
                await asyncio.sleep(0)
            assert it.told == [it.told[0], "1: Connection reset by peer", "1: over, 0 bytes there, 0 back"]

    run(test)


def test_a_proxy_listens_at_an_address_of_ipv6_too() -> None:
    async def test() -> None:
        try:
            server = await asyncio.start_server(lambda _reader, _writer: None, "::1", 0)
        except OSError:
            pytest.skip("this machine has no IPv6")
        server.close()
        proxy = DelayProxy(Endpoint("::1", 1), DelayWays(FORWARD, BACKWARD), lambda _text: None)
        at = await proxy.listen(Endpoint("::1", 0))
        await proxy.close()
        assert at.host == "::1"
        assert str(at) == f"[::1]:{at.port}"
        assert at.port > 0

    run(test)


def test_closing_ends_all_and_leaves_nothing() -> None:
    async def test() -> None:
        async with scene() as it:
            (near_reader, near), _ = await it.connect()
            near.write(b"on its way")
            await it.time.next_due()
            await it.proxy.close()
            with pytest.raises(ConnectionError):
                await near_reader.readexactly(1)
            with pytest.raises(OSError, match=r".*"):
                await asyncio.open_connection(*it.at)
            assert not it.proxy.connections
        assert len(asyncio.all_tasks()) <= 2, "this one, and the one that bounds it"

    run(test)
