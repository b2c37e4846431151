"""What one client, by mistake or on purpose, costs the others: `python -m benchmarks hostile [seconds] [load ...]`.

Each load runs for some seconds at a `vrs serve` of its own, in real time. Beside it an onlooker asks WHERE ten times a
second, a viewer hears 50 samples a second, and where the load leaves the robot to others, a driver moves it. Before the
load ends the onlooker says ABORT. The table has the worst line of each, and the memory that the server holds more than
before, when the client has left and its programs are deleted. The server, the load, and those who measure are processes
of their own. On Linux.
"""

from __future__ import annotations

import asyncio
import json
import os
import sys
import time
from base64 import b64encode
from collections.abc import AsyncIterator, Awaitable, Callable, Iterable, Iterator, Mapping
from contextlib import asynccontextmanager, suppress
from itertools import count, cycle, pairwise, repeat
from statistics import median
from typing import NamedTuple

from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import WebSocketException

from benchmarks.viewers import Process, served

SECONDS, APART, RATE = 4.0, 0.1, 50.0
MOST_SECONDS = 120.0  # that a load may take to end what it has begun
ABORT_BEFORE = 0.5  # [s] before the load ends
CROWD, STRANGERS = 5, 300  # who floods, and who is slow to say hello
AT_ONCE = 10  # messages of a load that wait for an answer
SETTLING = 2.0  # [s] after a load, before memory is read
LONG_LINE = 4000  # characters

Message = Mapping[str, object]


class Load(NamedTuple):
    """What a load is called; what its client sends once, before anything is measured, and then again and again, waiting
    for `at_once` answers. `drives`: the client drives the robot. `clients`: so many do the same. `plays`: how it acts,
    where it does something else.
    """

    what: str
    sent: tuple[Callable[[], Message], ...] = ()
    before: tuple[Callable[[], Message], ...] = ()
    drives: bool = False
    clients: int = 1
    at_once: int = AT_ONCE
    plays: Callable[[int, float], Awaitable[None]] | None = None


def main() -> None:
    seconds = float(sys.argv[2]) if len(sys.argv) > 2 else SECONDS
    chosen = sys.argv[3:] or list(LOADS)
    print(f"{'worst of others [ms]':<68} {'WHERE':>7} {'median':>7} {'DRIVE':>7} {'sample':>7} {'ABORT':>7}  MB more")
    for name in chosen:
        print(f"{LOADS[name].what:<68} {asyncio.run(beside(name, seconds))}", flush=True)


# --- who measures -----------------------------------------------------------------------------------------------------


class Client:
    """A bare connection."""

    def __init__(self, connection: ClientConnection) -> None:
        self.connection, self._ids = connection, count(1)

    async def send(self, message: Message) -> int:
        """The id that it was given."""
        number = next(self._ids)
        await self.connection.send(json.dumps({**message, "id": number}))
        return number

    async def answered(self, number: int) -> None:
        """Wait until a request is answered."""
        while ended(await self.connection.recv()) != number:
            pass

    async def ask(self, message: Message) -> float:
        """How long it takes until it is answered [s]."""
        begun = time.monotonic()
        await self.answered(await self.send(message))
        return time.monotonic() - begun


def ended(frame: str | bytes) -> int | None:
    """The id of the request that a frame answers. Long frames are not read whole: that would hold up who measures."""
    text = frame if isinstance(frame, str) else frame.decode()
    if text.startswith(NEITHER):
        return None
    message = json.loads(text) if len(text) < 10_000 else {"id": int(text.split('"id":', 1)[1].split(",", 1)[0])}
    return message.get("id")


NEITHER = tuple(f'{{"type":"{kind}"' for kind in ("told", "typed", "asked", "withdrawn", "lease", "welcome", "sample"))
HELLO: Message = {"type": "hello", "versions": [1]}


@asynccontextmanager
async def client(port: int) -> AsyncIterator[Client]:
    async with connect(f"ws://127.0.0.1:{port}", max_size=None) as connection:
        await connection.send(json.dumps(HELLO))
        await connection.recv()
        yield Client(connection)
        with suppress(WebSocketException):
            await connection.send(json.dumps({"type": "bye"}))


async def beside(name: str, seconds: float) -> str:
    """The row of a load."""
    load = LOADS[name]
    with served("--realtime", "1") as server:
        at = server.port
        async with client(at) as driver, client(at) as onlooker, client(at) as viewer, client(at) as stopper:
            if not load.drives:
                for message in load.before:
                    await driver.ask(message())
                for _ in range(20):  # a timeline to look at
                    await driver.ask(line("DRIVE 1, 1, 100"))
                    await driver.ask(line("DRIVE 1, -1, 100"))
            await viewer.send({"type": "subscribe", "rate": RATE})
            memory = server.memory
            harming = await _harm(name, server, seconds)
            ends = asyncio.get_running_loop().create_task(_line_of(harming))
            stops = asyncio.create_task(_stop(stopper, seconds - ABORT_BEFORE))
            gaps = asyncio.create_task(_gaps(viewer, ends))
            drives = asyncio.create_task(_times(driver, _swings(), ends if not load.drives else None))
            looks = await _times(onlooker, repeat(line("WHERE")), ends)
            worst = (
                max(looks),
                median(looks),
                max(await drives, default=0.0),
                max(await gaps, default=0.0),
                await stops,
            )
            await harming.wait()
            for text in CLEARED:
                await driver.ask(line(text))
        await asyncio.sleep(SETTLING)
        return " ".join(f"{1e3 * time:7.0f}" for time in worst) + f" {(server.memory - memory) / 1e6:8.0f}"


CLEARED = ("ABORT", *(f"KILL {task}" for task in range(1, 27)), "KILL", "DISABLE INTERACTIVE", "ZERO")


async def _harm(name: str, server: Process, seconds: float) -> asyncio.subprocess.Process:
    """The load in a process of its own, which is about to begin."""
    arguments = (sys.executable, "-m", __spec__.name, name, str(server.port), str(seconds))
    harming = await asyncio.create_subprocess_exec(
        *arguments, stdout=asyncio.subprocess.PIPE, stdin=asyncio.subprocess.PIPE
    )
    await _line_of(harming)
    assert harming.stdin is not None
    harming.stdin.write(b"go\n")
    return harming


async def _line_of(harming: asyncio.subprocess.Process) -> None:
    assert harming.stdout is not None
    await harming.stdout.readline()


async def _stop(stopper: Client, after: float) -> float:
    await asyncio.sleep(after)
    return await stopper.ask({"type": "abort"})


async def _times(of: Client, asked: Iterable[Message], ends: asyncio.Task[None] | None) -> list[float]:
    """How long each is answered [s], one after the other, until the load ends; none where it does not."""
    times = list[float]()
    for message in asked:
        if ends is None or ends.done():
            break
        times.append(await of.ask(message))
        await asyncio.sleep(max(0.0, APART - times[-1]))
    return times


def _swings() -> Iterator[Message]:
    return (line(f"DRIVE 1, {1 if number % 2 else -1}, 100") for number in count())


async def _gaps(viewer: Client, ends: asyncio.Task[None]) -> list[float]:
    """Between two samples [s]."""
    at = list[float]()
    while not ends.done():
        if '"sample"' in str(await viewer.connection.recv())[:30]:
            at.append(time.monotonic())
    return [b - a for a, b in pairwise(at)]


# --- messages ---------------------------------------------------------------------------------------------------------


def line(text: str) -> Message:
    return {"type": "line", "text": text}


def act(kind: str, **fields: object) -> Message:
    return {"type": "at", "act": {"kind": kind, **fields}}


def define(text: str) -> Message:
    return act("Define", text=text)


def program(name: str, *steps: str) -> str:
    return f".PROGRAM {name}()\n" + "\n".join(steps) + "\n.END\n"


def lines(*texts: str) -> tuple[Callable[[], Message], ...]:
    return tuple(_always(line(text)) for text in texts)


def _always(message: Message) -> Callable[[], Message]:
    return lambda: message


def put(name: str, text: str) -> Message:
    return {"type": "put", "name": name, "data": b64encode(text.encode()).decode(), "replace": True}


STEPS = 180_000
_numbers = count()
MANY_PROGRAMS = "".join(program(f"p{number}", f"x = {number}", "TYPE x") for number in range(40_000))
BIG = program("big", *("x = x+1" for _ in range(STEPS)))
VARIED = program("big", *(f"y{k % 50}[{k}] = SIN(x)*{k}+(x-{k})/2" for k in range(50_000)))
LOCATIONS = ".LOCATIONS\n" + "".join(f"l{k} 400 {k} 0 0 90 0\n" for k in range(49_000)) + ".END\n"
POSITIONS: Message = {"type": "positions", "times": [0.001 * k for k in range(2000)]}
ENDLESS = program("spin", "DO", "x = x+1", "UNTIL FALSE")
FILE = "x" * 1_400_000
ROWS = "WHERE FROM 0 TO 1000 STEP 0.01"


def _big() -> Message:
    return define(BIG)


def _big_file() -> Message:
    return put("big.v2", BIG[:1_400_000])


def _numbered(form: str) -> Callable[[], Message]:
    """A line with another number each time."""
    return lambda: line(form.format(next(_numbers)))


# --- what else a load does --------------------------------------------------------------------------------------------


async def _nothing(_port: int, seconds: float) -> None:
    """Nobody is there."""
    await asyncio.sleep(seconds)


async def _stall(port: int, seconds: float) -> None:
    """Ask for all there is, and read nothing."""
    there = []
    for _ in range(CROWD):
        reader, writer = await asyncio.open_connection("127.0.0.1", port, limit=1)
        key = "Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n"
        upgrade = f"Host: localhost\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n{key}"
        writer.write(f"GET / HTTP/1.1\r\n{upgrade}\r\n".encode())
        for message in (HELLO, {"type": "subscribe", "id": 1, "deltas": True, "console": True, "rate": 200.0}):
            text = json.dumps(message).encode()
            writer.write(bytes((0x81, 0x80 | len(text))) + bytes(4) + text)
        there.append((reader, writer))
    await asyncio.sleep(seconds)


async def _slowly(port: int, seconds: float) -> None:
    """Many who open a connection, and say a letter now and then."""
    there = [await asyncio.open_connection("127.0.0.1", port) for _ in range(STRANGERS)]
    ends = time.monotonic() + seconds
    for letter in "GET / HTTP/1.1\r\nHost: localhost\r\nX: " + "x" * 10_000:
        if time.monotonic() > ends:
            break
        for _, writer in there:
            with suppress(OSError):
                writer.write(letter.encode())
        await asyncio.sleep(0.25)


async def _in_and_out(port: int, seconds: float) -> None:
    """Come, say what cannot be read, and come again."""

    async def one(ends: float) -> None:
        while time.monotonic() < ends:
            with suppress(OSError, WebSocketException):
                async with connect(f"ws://127.0.0.1:{port}") as socket:
                    await socket.send("{" * 1000)
                    await socket.recv()

    await asyncio.gather(*(one(time.monotonic() + seconds) for _ in range(CROWD)))


async def _ask_on(load: Load, one: Client, seconds: float) -> None:
    """Send what a load sends, as fast as answers come."""
    waiting, messages, ends = set[int](), cycle(load.sent), time.monotonic() + seconds
    while time.monotonic() < ends or (waiting and load.at_once == 1):  # what is long is seen to its end
        while len(waiting) < load.at_once and time.monotonic() < ends:
            waiting.add(await one.send(next(messages)()))
        if waiting:
            waiting.discard(ended(await one.connection.recv()) or 0)


async def _play(name: str, port: int, seconds: float) -> None:
    load = LOADS[name]
    if load.plays is not None:
        print("ready", flush=True)
        sys.stdin.readline()
        await load.plays(port, seconds)
        return
    async with client(port) as one:
        for message in load.before if load.drives else ():
            await one.ask(message())
        others = [client(port) for _ in range(load.clients - 1)]
        there = [one, *[await other.__aenter__() for other in others]]
        print("ready", flush=True)
        sys.stdin.readline()
        with suppress(WebSocketException, TimeoutError):
            async with asyncio.timeout(seconds + MOST_SECONDS):
                await asyncio.gather(*(_ask_on(load, each, seconds) for each in there))


def _drive(what: str, *sent: Callable[[], Message], before: Iterable[Callable[[], Message]] = (), **more: int) -> Load:
    return Load(what, sent, tuple(before), drives=True, **more)


FLOOD = {"clients": CROWD}
LOADS: Mapping[str, Load] = {
    "nothing": Load("nobody does harm", plays=_nothing),
    "stall": Load(f"{CROWD} ask for all there is, and read nothing", plays=_stall),
    "slowly": Load(f"{STRANGERS} strangers say a letter four times a second", plays=_slowly),
    "garbage": Load(f"{CROWD} come, say what is garbage, and come again", plays=_in_and_out),
    # onlookers
    "positions": Load(f"{CROWD} ask for 2000 positions, again and again", (_always(POSITIONS),), **FLOOD),
    "windows": Load(f"{CROWD} ask for the timeline", (_always({"type": "window", "begin": 0.0}),), **FLOOD),
    "completions": Load(
        f"{CROWD} ask for completions", (_always({"type": "complete", "text": "", "everything": True}),), **FLOOD
    ),
    "checks": Load(
        f"{CROWD} have lines of {LONG_LINE} characters checked",
        tuple(
            _always({"type": "check", "text": (f"{begin}" + piece * LONG_LINE)[:LONG_LINE]})
            for begin in ("", "TYPE ", "x = ", ";", '$a = "')
            for piece in ("(", "a.", " ", "1+", ";", "-", '"', ", ", "vrs: ignore V1 ")
        ),
        **FLOOD,
    ),
    "wheres": Load(f"{CROWD} say WHERE", lines("WHERE"), **FLOOD),
    "rows": Load("ten WHERE of 100,000 rows", lines(ROWS)),
    "plots": Load("PLOT", lines("PLOT", "PLOT SPEED"), **FLOOD),
    "tables": Load("TIMELINE, STATUS, DIRECTORY, HELP", lines("TIMELINE", "STATUS", "DIRECTORY", "HELP"), **FLOOD),
    "reach": Load("WHY of places that cannot be reached", lines("WHY TRANS(1,2,3,4,5,6)"), **FLOOD),
    "records": Load("the trajectory as a file", (_always(act("Record")),), **FLOOD),
    "listp": Load("LISTP of a program of 180,000 lines", lines("LISTP big"), (_big,)),
    "listl": Load("LISTL of 49,000 locations", lines("LISTL"), (lambda: define(LOCATIONS),)),
    "directory": Load(
        "DIRECTORY of 40,000 programs, by a costly pattern",
        lines("DIRECTORY *p*p*p*p*1*2*3*4*x", "DIRECTORY"),
        (lambda: define(MANY_PROGRAMS),),
    ),
    "names": Load(
        "completions among 49,000 locations",
        (_always({"type": "complete", "text": "MOVE l"}), _always({"type": "complete", "text": "MOVE "})),
        (lambda: define(LOCATIONS),),
        **FLOOD,
    ),
    "gets": Load(
        "a file of 1.4 MB fetched",
        (_always({"type": "get", "name": "a.txt"}),),
        (lambda: put("a.txt", FILE),),
    ),
    "flist": Load("FLIST of a file of 1.8 MB", lines("FLIST big.v2"), (_big_file,)),
    "evaluate": Load("costly expressions", (_always(act("Evaluate", expression="+".join(["SIN(1)"] * 500))),), **FLOOD),
    # drivers
    "define": _drive("Define of 180,000 lines", lambda: define(BIG), at_once=1),
    "varied": _drive("Define of 50,000 lines that all differ", lambda: define(VARIED), at_once=1),
    "wrong": _drive(
        "Define of 180,000 lines that are wrong",
        lambda: define(program("big", *("x = = 1" for _ in range(STEPS)))),
        at_once=1,
    ),
    "places": _drive("Define of 49,000 locations", lambda: define(LOCATIONS), at_once=1),
    "programs": _drive("Define of 40,000 programs", lambda: define(MANY_PROGRAMS), at_once=1),
    "wide": _drive(
        "Define of lines of 900,000 characters",
        *(
            (lambda text=text: define(program("wide", text, text)))
            for text in (";" * 900_000, "TYPE " + "1+" * 450_000, "x = " + "(" * 900_000, "; vrs:" + " V123" * 180_000)
        ),
        at_once=1,
    ),
    "paste": _drive("a pasted text of 20,000 lines", lambda: line("x = 1\n" * 16_000), at_once=1),
    "typed": _drive("a pasted program of 20,000 lines", lambda: line(BIG[:99_000] + "\n.END"), at_once=1),
    "puts": _drive("60 puts of 1.4 MB", lambda: put(f"f{next(_numbers) % 60}.txt", FILE), at_once=60),
    "load": _drive("LOAD of a file of 140,000 lines", *lines("LOAD big.v2"), before=(_big_file,)),
    "store": _drive(
        "STORE, DELETEP and LOAD of 180,000 lines",
        *lines("STORE all", "DELETEP big", "LOAD all"),
        before=(_big, *lines("DISABLE INTERACTIVE")),
        at_once=1,
    ),
    "copies": _drive("COPY, RENAME of 180,000 lines", _numbered("COPY c{} = big"), before=(_big,)),
    "execute": _drive(
        "EXECUTE of 180,000 lines that all differ",
        lambda: define(VARIED),
        lambda: line("EXECUTE big"),
        lambda: line("ABORT"),
        at_once=1,
    ),
    "steps": _drive("180,000 steps executed, again and again", *lines("EXECUTE big"), before=(_big,), at_once=1),
    "edit": _drive(
        "EDIT of 180,000 lines",
        *lines("EDIT big", "I", "x = 2", "", "P 50000", "E"),
        before=(_big, *lines("DISABLE INTERACTIVE")),
        at_once=1,
    ),
    "spin": _drive("a program without end", *lines("EXECUTE spin"), before=(lambda: define(ENDLESS),)),
    "tasks": _drive(
        "26 programs without end",
        *lines(*(f"EXECUTE {task} spin" for task in range(1, 27))),
        before=(lambda: define(ENDLESS),),
    ),
    "types": _drive(
        "TYPE without end",
        *lines("EXECUTE say"),
        before=(lambda: define(program("say", "DO", 'TYPE "x", x', "UNTIL FALSE")),),
    ),
    "drives": _drive(
        "DRIVE without end",
        *lines("EXECUTE go"),
        before=(lambda: define(program("go", "DO", "DRIVE 1, 0.001, 100", "DRIVE 1, -0.001, 100", "UNTIL FALSE")),),
    ),
    "straight": _drive("MOVES again and again", _numbered("MOVES TRANS(400,{0}-100*INT({0}/100),0,90,0,0)")),
    "undo": _drive(
        "UNDO and REDO of 1000 motions", *lines("UNDO 1000", "REDO 1000"), before=lines(*["DRIVE 1, 0.1"] * 1000)
    ),
    "arrays": _drive(
        "an array of 990,000 elements",
        *lines("EXECUTE fill", "ZERO"),
        lambda: define(program("fill", "FOR i = 1 TO 990000", "a[i] = i", "END")),
        before=(lambda: define(program("fill", "x = 1")), *lines("DISABLE INTERACTIVE")),
        at_once=1,
    ),
    "strings": _drive(
        "strings joined without end",
        *lines("EXECUTE join"),
        before=(lambda: define(program("join", "DO", '$a = $a+"x"', "$a = $MID($a,1,100)", "UNTIL FALSE")),),
    ),
    "branches": _drive(
        "BRANCH, COMPARE and MERGE", _numbered("BRANCH b{}"), *lines("DRIVE 1, 1", "COMPARE", "BRANCH main")
    ),
}

if __name__ == "__main__":
    asyncio.run(_play(sys.argv[1], int(sys.argv[2]), float(sys.argv[3])))
    os._exit(0)  # connections that are full take no leave
