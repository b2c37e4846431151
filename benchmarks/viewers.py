"""What a thousand viewers cost a server: `python -m benchmarks viewers [viewers]`. On Linux; it takes four minutes.

The server is `vrs serve`, in a process of its own; the viewers are bare sockets in other processes, which count what
comes. How many of the samples due have come says whether they keep up. CPU time is all that the server's process takes.
Beside it stands the bare `broadcast` of `websockets`, of messages of the same size to as many viewers, in a process of
its own too. They are measured in turn, and the least of each counts.
"""

from __future__ import annotations

import asyncio
import json
import os
import re
import socket
import subprocess
import sys
import time
from base64 import b64encode
from collections.abc import AsyncIterator, Awaitable, Callable, Coroutine, Iterator, Mapping
from contextlib import AbstractContextManager, asynccontextmanager, contextmanager, suppress
from math import cos, pi, radians
from operator import add
from pathlib import Path
from statistics import median
from typing import NamedTuple

from websockets.asyncio.client import ClientConnection, connect
from websockets.asyncio.server import ServerConnection, broadcast, serve
from websockets.frames import OP_BINARY, OP_TEXT, Frame

from vrs_cli.engine.engine import Engine
from vrs_cli.engine.feed import MissedEvents, TimelineReplaced
from vrs_cli.interfaces.streams import Steering
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.net.broadcast import Broadcast
from vrs_cli.net.messages import Subscribe
from vrs_cli.net.stream import MessageForm, Packet

VIEWERS, RATE = 1000, 50.0
ROUNDS, SAMPLED = 4, 2.0  # of samples, each so long [s]
CYCLE = 6.5  # [s], in which pick-and-place is done once
PROGRAM = Path(__file__).parents[1] / "programs/pick_and_place.v2"
NAME = "pick.and.place"
ANSWERS, APART = 30, 0.15  # lines, and the time [s] between them
STALLED, MOVES = 20, 8000  # viewers that read nothing, and motions that they do not hear of
STEERED = 30.0  # [s]
SWING, LASTING = radians(40.0), 4.0  # of every joint [rad, s]
SETTLING = 0.3  # [s] after which all has come
LOOK = 0.05  # [s] between two looks of the viewers
BARE, ANSWERED, READ = "bare", "answered", "read"
READERS = 4  # processes, which share the viewers
COUNT, STOP = "count", "stop"  # what readers are asked


def main() -> None:
    viewers = int(sys.argv[2]) if len(sys.argv) > 2 else VIEWERS
    print(f"{viewers} viewers in {READERS} processes on loopback, {os.cpu_count()} cores")
    steered()
    asyncio.run(_measured(viewers))


async def _measured(viewers: int) -> None:
    with served("--realtime", "1") as server:
        async with connected(server.port) as commander:
            await commander.put(PROGRAM.name, PROGRAM.read_bytes())
            await commander.say(f"LOAD {PROGRAM.name}")
            await watched(server, viewers, commander)
        await answered(server, viewers)
    await stalled()


# --- servers ----------------------------------------------------------------------------------------------------------


class Process:
    """A server in a process of its own, which says where it listens in its first line."""

    def __init__(self, *arguments: str) -> None:
        self._child = subprocess.Popen([sys.executable, "-m", *arguments], stdout=subprocess.PIPE, text=True)
        assert self._child.stdout is not None
        first = self._child.stdout.readline()
        found = re.search(r":(\d+)\b", first)
        if found is None:
            raise SystemExit(f"no server: {first}")
        self.port = int(found[1])

        self.clock = (~self._child.pid << 3) | 2  # of its CPU time: clock_getcpuclockid in POSIX, its number in Linux

    @property
    def cpu(self) -> float:
        """CPU time so far [s]."""
        return time.clock_gettime(self.clock)

    @property
    def memory(self) -> int:
        """Bytes that it holds."""
        pages = Path(f"/proc/{self._child.pid}/statm").read_text(encoding="ascii").split()[1]
        return int(pages) * os.sysconf("SC_PAGE_SIZE")

    def end(self) -> None:
        self._child.terminate()
        self._child.wait()


@contextmanager
def running(*arguments: str) -> Iterator[Process]:
    process = Process(*arguments)
    try:
        yield process
    finally:
        process.end()


def served(*options: str) -> AbstractContextManager[Process]:
    """A robot behind `vrs serve`."""
    return running("vrs_cli", "serve", "--port", "0", *options)


async def _bare(size: int) -> None:
    """A server that sends so many bytes to all who are there, RATE times a second."""
    there: set[ServerConnection] = set()

    async def hold(connection: ServerConnection) -> None:
        there.add(connection)
        try:
            await connection.wait_closed()
        finally:
            there.discard(connection)

    async with serve(hold, "127.0.0.1", 0, compression=None, backlog=1024, ping_interval=None) as server:
        print(f":{server.sockets[0].getsockname()[1]}", flush=True)
        payload, due = os.urandom(size), time.monotonic()
        while True:
            due = max(due + 1.0 / RATE, time.monotonic())
            broadcast(there, payload)
            await asyncio.sleep(due - time.monotonic())


# --- clients ----------------------------------------------------------------------------------------------------------

HELLO = {"type": "hello", "versions": [1], "format": "msgpack"}
FULL = {"type": "hello", "versions": [1], "full": True}  # the most bytes


class Viewer:
    """A bare socket: it says `lines` when it is let in, and counts the messages that come. `deflate`: it offers to
    inflate them. It looks when it is told to: to wake a viewer for each message would cost the server's core more than
    the message.
    """

    def __init__(self, port: int, *lines: Mapping[str, object], deflate: bool = False) -> None:
        self.messages = self.bytes = 0
        self._lines, self._rest, self.open = lines, b"", False
        self.socket = socket.create_connection(("127.0.0.1", port))
        self.socket.setblocking(False)
        offer = "Sec-WebSocket-Extensions: permessage-deflate\r\n" if deflate else ""
        key = "Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n"
        upgrade = "Host: localhost\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
        self.socket.send(f"GET / HTTP/1.1\r\n{upgrade}{key}{offer}\r\n".encode())

    def leave(self) -> None:
        self._say({"type": "bye"})
        self.socket.close()

    def _say(self, message: Mapping[str, object]) -> None:
        self.socket.send(Frame(OP_TEXT, json.dumps(message).encode()).serialize(mask=True))

    def look(self) -> None:
        """Count what has come."""
        with suppress(BlockingIOError):
            while data := self.socket.recv(1 << 16):
                self._take(self._rest + data)

    def _take(self, data: bytes) -> None:
        if not self.open:
            end = data.find(b"\r\n\r\n") + 4
            if end < 4:
                self._rest = data
                return
            self.open, data = True, data[end:]
            for line in self._lines:
                self._say(line)
        self._rest = data[self._count(data) :]

    def _count(self, data: bytes) -> int:
        """The messages in it; how many bytes they are (RFC 6455, 5.2: frames of a server are not masked)."""
        at = 0
        while len(data) - at >= 2:
            length, head = data[at + 1], 2
            if length >= 126:
                head = 4 if length == 126 else 10
                if len(data) - at < head:
                    break
                length = int.from_bytes(data[at + 2 : at + head], "big")
            if len(data) - at < head + length:
                break
            if data[at] & 0x0F in (OP_TEXT, OP_BINARY):
                self.messages += 1
                self.bytes += head + length
            at += head + length
        return at


async def _read(port: int, count: int, deflate: bool, *lines: Mapping[str, object]) -> None:
    """Look at so many viewers again and again. Say [messages, bytes] once each has heard what it hears first, and after
    each line of the standard input; `stop` ends looking, the end of the input ends all.
    """
    there = list[Viewer]()

    async def look() -> None:
        while True:
            for viewer in there:
                viewer.look()
            await asyncio.sleep(LOOK)

    def say() -> None:
        print(json.dumps([sum(viewer.messages for viewer in there), sum(viewer.bytes for viewer in there)]), flush=True)

    looking, asked = asyncio.create_task(look()), asyncio.StreamReader()
    await asyncio.get_running_loop().connect_read_pipe(lambda: asyncio.StreamReaderProtocol(asked), sys.stdin)
    for _ in range(count):
        there.append(Viewer(port, *lines, deflate=deflate))
        await asyncio.sleep(0)
    while not all(viewer.open and viewer.messages >= len(lines) for viewer in there):
        await asyncio.sleep(LOOK)
    say()
    while line := await asked.readline():
        if line.decode().strip() == STOP:
            looking.cancel()
        say()
    looking.cancel()
    for viewer in there:
        viewer.leave()


class Crowd(NamedTuple):
    """Some viewers, in processes that read what comes."""

    count: int
    readers: tuple[asyncio.subprocess.Process, ...]

    async def ask(self, line: str) -> tuple[float, float]:
        """Return the messages and bytes that have come to a viewer, on the average."""
        for reader in self.readers:
            assert reader.stdin is not None
            reader.stdin.write(f"{line}\n".encode())
        return await self.answers()

    async def answers(self) -> tuple[float, float]:
        messages, size = 0, 0
        for reader in self.readers:
            assert reader.stdout is not None
            some, more = json.loads(await reader.stdout.readline())
            messages, size = messages + some, size + more
        return messages / max(self.count, 1), size / max(self.count, 1)


@asynccontextmanager
async def crowd(
    server: Process, count: int, *lines: Mapping[str, object], deflate: bool = False
) -> AsyncIterator[Crowd]:
    """So many viewers, each of which has heard what it hears first."""
    readers = list[asyncio.subprocess.Process]()
    for k in range(min(READERS, count)):
        work = map(json.dumps, (server.port, (count + k) // min(READERS, count), deflate, *lines))
        command = (sys.executable, "-m", __spec__.name, READ, *work)
        pipe = asyncio.subprocess.PIPE
        readers.append(await asyncio.create_subprocess_exec(*command, stdin=pipe, stdout=pipe))
    there = Crowd(count, tuple(readers))
    await there.answers()
    await asyncio.sleep(0.5)
    try:
        yield there
    finally:
        for reader in readers:
            await reader.communicate(b"")  # ends its input
        await asyncio.sleep(1.0)


class Commander:
    """Somebody at the prompt."""

    def __init__(self, connection: ClientConnection) -> None:
        self._connection, self._id = connection, 0

    async def say(self, line: str) -> float:
        """How long it takes until it is done [s]."""
        begun = time.perf_counter()
        await self._done({"type": "line", "text": line})
        return time.perf_counter() - begun

    async def put(self, name: str, data: bytes) -> None:
        """A file into the robot's folder."""
        await self._done({"type": "put", "name": name, "data": b64encode(data).decode()})

    async def _done(self, command: Mapping[str, object]) -> None:
        self._id += 1
        await self._connection.send(json.dumps({**command, "id": self._id}))
        while True:
            message = json.loads(await self._connection.recv())
            if message["type"] in ("done", "refused") and message.get("id") == self._id:
                if not message.get("ok", message["type"] == "done"):
                    raise SystemExit(f"{command}: {message}")
                return


@asynccontextmanager
async def connected(port: int) -> AsyncIterator[Commander]:
    async with connect(f"ws://127.0.0.1:{port}", max_size=None) as connection:
        await connection.send(json.dumps({"type": "hello", "versions": [1]}))
        yield Commander(connection)
        await connection.send(json.dumps({"type": "bye"}))  # another may drive


# --- what is measured -------------------------------------------------------------------------------------------------

SAMPLES = {"type": "subscribe", "id": 1, "rate": RATE}
CHANGES = {"type": "subscribe", "id": 1, "deltas": True, "window": 1.0}


class Cost(NamedTuple):
    """What some viewers cost: CPU time [s], how many messages and bytes each of them got, and in which time [s]."""

    cpu: float
    messages: float
    bytes: float
    seconds: float


async def cost(server: Process, viewers: Crowd, work: Callable[[], Awaitable[object]]) -> Cost:
    """What they cost while something is done."""

    async def counted() -> Cost:
        messages, size = await viewers.ask(COUNT)
        return Cost(server.cpu, messages, size, time.monotonic())

    before = await counted()
    await work()
    await asyncio.sleep(SETTLING)
    return Cost(*(b - a for a, b in zip(before, await counted(), strict=True)))


async def watched(server: Process, viewers: int, commander: Commander) -> None:
    """Samples beside bare messages, and pick-and-place by changes beside samples."""

    async def pick_and_place() -> None:
        ends = time.monotonic() + CYCLE
        await commander.say(f"EXECUTE {NAME}")
        await asyncio.sleep(ends - time.monotonic())

    await pick_and_place()
    async with crowd(server, 1, HELLO, SAMPLES) as one:
        got = await cost(server, one, lambda: asyncio.sleep(SAMPLED))
    size = round(got.bytes / got.messages)
    shared = await beside_bare(server, viewers, size)
    show(f"a message of {size} bytes by websockets.broadcast [us of CPU]", 1e6 * shared.bare)
    show("a sample of that size [us of CPU]", 1e6 * shared.sample)
    show("  ratio", shared.sample / shared.bare, "at most 1.3")
    ways = {
        "none": ((), False),
        "samples": ((SAMPLES,), False),
        "changes": ((CHANGES,), True),
        "plain": ((CHANGES,), False),
    }
    costs: dict[str, list[Cost]] = {name: [] for name in ("alone", *ways)}
    for _ in range(ROUNDS):
        costs["alone"].append(await cost(server, Crowd(0, ()), pick_and_place))
        for name, (lines, deflate) in ways.items():
            async with crowd(server, viewers, HELLO, *lines, deflate=deflate) as there:
                costs[name].append(await cost(server, there, pick_and_place))
    none = median(one.cpu for one in costs["none"])  # with viewers who are there, and are sent nothing but pings
    there = none - median(one.cpu for one in costs["alone"])
    due = RATE * (CYCLE - 0.5)  # samples of the motion itself: a server that others keep busy leaves some out
    sampled = median((one.cpu - none) / one.messages for one in costs["samples"])
    first = costs["changes"][0]
    cpu = median(one.cpu for one in costs["changes"]) - none
    came = min(one.messages / (RATE * one.seconds) for one in costs["samples"])
    show("samples that came, for those due", came, "at least 0.95")
    show("pick-and-place: messages of samples for one of changes", due / first.messages, "at least 20")
    show("  CPU of samples for that of changes", due * sampled / cpu, "at least 20")
    show("  CPU a sample, a change [us]", 1e6 * sampled / viewers)
    show("", 1e6 * cpu / first.messages / viewers)
    show("  CPU of one who is there, a second [us]", 1e6 * there / CYCLE / viewers)
    show("  bytes of samples for one of changes, deflated", due * size / first.bytes, "at least 3")
    show("    done again", due * size / costs["changes"][1].bytes)
    show("    as they are", due * size / costs["plain"][0].bytes)


class Shared(NamedTuple):
    """CPU time of the server for a sample to one viewer, and for a bare message of that size [s]; which part of the
    samples due came, in the worst round.
    """

    sample: float
    bare: float
    came: float


def samples(viewers: int) -> Shared:
    """Return what samples cost a server with so many viewers, who read in processes of their own."""

    async def measured() -> Shared:
        with served("--realtime", "1") as server:
            async with crowd(server, 1, HELLO, SAMPLES) as one:
                got = await cost(server, one, lambda: asyncio.sleep(SAMPLED))
            return await beside_bare(server, viewers, round(got.bytes / got.messages))

    return asyncio.run(measured())


async def beside_bare(server: Process, viewers: int, size: int) -> Shared:
    """Measure samples, and bare messages of that size, in turn."""
    ours, theirs, came = list[float](), list[float](), list[float]()
    with running("benchmarks.viewers", BARE, str(size - 2)) as bare:
        for _ in range(ROUNDS):
            for process, found, lines in ((bare, theirs, ()), (server, ours, (HELLO, SAMPLES))):
                async with crowd(process, viewers, *lines) as there:
                    got = await cost(process, there, lambda: asyncio.sleep(SAMPLED))
                    found.append(got.cpu / (got.messages * viewers))
                    if found is ours:
                        came.append(got.messages / (RATE * got.seconds))
    return Shared(min(ours), min(theirs), min(came))


async def answered(server: Process, viewers: int) -> None:
    """How long a line that changes the timeline takes to be answered, with nobody who watches and with all: in CPU time
    of the server, and by the clock, which counts what else the machine does too. Whoever gives the lines is in a
    process of its own.
    """

    async def times() -> list[tuple[float, float]]:
        arguments = (sys.executable, "-m", __spec__.name, ANSWERED, str(server.port), str(server.clock))
        asking = await asyncio.create_subprocess_exec(*arguments, stdout=asyncio.subprocess.PIPE)
        out, _ = await asking.communicate()
        found: list[tuple[float, float]] = json.loads(out)
        return found

    alone, beside = await times(), {}
    for name, subscribed in (("changes", CHANGES), ("samples", SAMPLES)):
        async with crowd(server, viewers, HELLO, subscribed, deflate=True):
            beside[name] = await times()
        alone += await times()
    for what, column in (("CPU", 0), ("clock", 1)):
        for of in (min, median):
            nobody = of(row[column] for row in alone)
            show(f"a line is answered, nobody watches: {what}, {of.__name__} [ms]", nobody)
            for name, rows in beside.items():
                figure = of(row[column] for row in rows)
                show(f"  with {viewers} viewers of {name}, for that", figure / nobody, "at most 2")


async def _answered(port: int, clock: int) -> None:
    """Say how long some lines take [ms]: CPU time by that clock, and time."""
    async with connected(port) as commander:
        found = []
        for number in range(ANSWERS):
            began = time.clock_gettime(clock)
            passed = await commander.say(f"DRIVE 1, {1 if number % 2 else -1}, 100")
            found.append((1e3 * (time.clock_gettime(clock) - began), 1e3 * passed))
            await asyncio.sleep(APART)
    print(json.dumps(found))


async def stalled() -> None:
    """What viewers cost that read nothing: memory, and time of who reads."""
    spin = f".PROGRAM spin\nFOR i = 1 TO {MOVES // 2}\nDRIVE 1, 1, 100\nDRIVE 1, -1, 100\nEND\n.END\n"
    with served() as server:
        async with connected(server.port) as commander, crowd(server, 1, HELLO, CHANGES):
            await commander.put("spin.v2", spin.encode())
            await commander.say("LOAD spin.v2")

            async def spun() -> tuple[float, float]:
                """CPU time and memory of so many changes [s, bytes]."""
                before, memory = server.cpu, server.memory
                await commander.say("EXECUTE spin")
                return server.cpu - before, server.memory - memory

            await spun()
            alone = await spun()
            async with crowd(server, STALLED, FULL, CHANGES) as there:
                await there.ask(STOP)
                beside = await spun()
            grown = (beside[1] - alone[1]) / STALLED / 1e6
            show(f"memory of a viewer that reads nothing of {MOVES} changes [MB]", grown, "at most 1")
            show(f"  CPU of these changes with {STALLED} such viewers, for that without", beside[0] / alone[0])


def steered() -> None:
    """Bytes of a steered robot: of changes, deflated, for those of samples at the same rate. In virtual time."""
    engine, wall = Engine(load_robot("puma560")), 0.0
    events = engine.events.subscribe()
    begin = events.take()
    assert isinstance(begin, TimelineReplaced)
    cast, steering = Broadcast(engine, begin, lambda: wall), Steering(engine)
    sizes = []
    for wanted, deflates in ((Subscribe(1, deltas=True), True), (Subscribe(1, rate=RATE), False)):
        sizes.append(Counted())
        cast.subscribe(cast.join(sizes[-1], MessageForm(text=False), deflates=deflates), wanted)
    for k in range(int(STEERED * RATE)):
        wall = k / RATE
        turns = (SWING * (1.0 - cos(2.0 * pi * wall / (LASTING + 0.3 * joint))) for joint in range(6))
        steering.to(tuple(map(add, engine.model.poses["ready"], turns)), wall)
        for event in events.take_all():
            assert not isinstance(event, MissedEvents)
            cast.tell(event, engine.now)
        while cast.peek() <= wall:
            cast.step()
    changes, samples = (counted.bytes for counted in sizes)
    show("steering: bytes of changes, deflated, for one of samples", changes / samples, "at most 3")
    show("  bytes a target", changes / STEERED / RATE)


class Counted:
    """A connection that takes everything at once."""

    def __init__(self) -> None:
        self.bytes, self.waiting = 0, 0

    def send(self, *packets: Packet) -> None:
        self.bytes += sum(len(packet.data) for packet in packets)


def show(what: str, figure: float, bar: str = "") -> None:
    print(f"{what:<72} {figure:9.3g}  {bar}".rstrip(), flush=True)


PARTS: Mapping[str, Callable[..., Coroutine[None, None, None]]] = {
    BARE: _bare,
    ANSWERED: _answered,
    READ: _read,
}  # that this file plays in processes of their own

if __name__ == "__main__":
    asyncio.run(PARTS[sys.argv[1]](*map(json.loads, sys.argv[2:])))
