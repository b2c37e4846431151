"""What clients that are slow, or mean harm, cost others: `python -m benchmarks hostile [seconds]`. On Linux.

The server is `vrs serve`, in a process of its own, with a robot in real time; who harms it is in one process, who
drives and who watches in another. A line is how long a motion takes to be answered, a gap is the time between two
samples of a viewer at 50 Hz.
"""

from __future__ import annotations

import asyncio
import json
import subprocess
import sys
import time
from collections.abc import Awaitable, Callable, Mapping
from contextlib import suppress
from itertools import pairwise
from statistics import median, quantiles
from typing import NamedTuple

from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import WebSocketException

from benchmarks.viewers import Commander, Process, connected, served

SECONDS, APART, RATE = 6.0, 0.1, 50.0
CROWD, STRANGERS = 5, 300  # who floods, and who is slow to say hello
SETTLING = 1.0  # [s] until those who harm are there
HARM = "harm"
TIMES = [0.001 * k for k in range(2000)]

FLOODS: Mapping[str, Mapping[str, object]] = {
    "positions": {"type": "positions", "times": TIMES},
    "windows": {"type": "window", "begin": 0.0},
    "completions": {"type": "complete", "text": "", "everything": True},
    "lines": {"type": "line", "text": "WHERE"},
}


def main() -> None:
    seconds = float(sys.argv[2]) if len(sys.argv) > 2 else SECONDS
    print(f"{'':<60} a line [ms]: median, 95 %, worst   a gap [ms]: median, 95 %, worst")
    asyncio.run(_measured(seconds))


async def _measured(seconds: float) -> None:
    for name, (what, _) in HARMS.items():
        with served("--realtime", "1") as server:
            async with connected(server.port) as driver:
                for _ in range(50):  # a timeline to look at
                    await driver.say("DRIVE 1, 1, 100")
                    await driver.say("DRIVE 1, -1, 100")
                show(what, await beside(server, driver, name, seconds))


async def beside(server: Process, driver: Commander, name: str, seconds: float) -> tuple[list[float], list[float]]:
    """How long lines take to be answered, and the gaps of a viewer, while somebody does harm [s]."""
    arguments = (sys.executable, "-m", __spec__.name, HARM, name, str(server.port), str(seconds + 2.0 * SETTLING))
    harming = subprocess.Popen(arguments)
    await asyncio.sleep(SETTLING)
    gaps = asyncio.create_task(_gaps(server.port, seconds))
    lines, ends = list[float](), time.monotonic() + seconds
    while time.monotonic() < ends:
        lines.append(await driver.say(f"DRIVE 1, {1 if len(lines) % 2 else -1}, 100"))
        await asyncio.sleep(APART)
    found = await gaps
    harming.wait()
    return lines, found


async def _gaps(port: int, seconds: float) -> list[float]:
    at = list[float]()
    async with connect(f"ws://127.0.0.1:{port}") as socket:
        for message in ({"type": "hello", "versions": [1]}, {"type": "subscribe", "id": 1, "rate": RATE}):
            await socket.send(json.dumps(message))
        ends = time.monotonic() + seconds
        while time.monotonic() < ends:
            if json.loads(await socket.recv())["type"] == "sample":
                at.append(time.monotonic())
    return [b - a for a, b in pairwise(at)]


def show(what: str, found: tuple[list[float], list[float]]) -> None:
    figures = ""
    for times in found:
        figures += f"{1e3 * median(times):11.1f} {1e3 * quantiles(times, n=20)[-1]:6.1f} {1e3 * max(times):6.1f}      "
    print(f"{what:<60} {figures}".rstrip(), flush=True)


# --- who does harm ----------------------------------------------------------------------------------------------------


class Harm(NamedTuple):
    """What it is called, and does for so many seconds at a port."""

    name: str
    does: Callable[[int, float], Awaitable[None]]


async def _nothing(_port: int, _seconds: float) -> None:
    """Nobody is there."""


def _flood(kind: str) -> Callable[[int, float], Awaitable[None]]:
    """Ask as fast as answers come, ten at once."""

    async def one(port: int, seconds: float) -> None:
        async with connect(f"ws://127.0.0.1:{port}", max_size=None) as socket:
            await socket.send(json.dumps({"type": "hello", "versions": [1]}))
            hearing, ends = asyncio.create_task(_drop(socket)), time.monotonic() + seconds
            number = 0
            while time.monotonic() < ends:
                for _ in range(10):
                    number += 1
                    await socket.send(json.dumps({**FLOODS[kind], "id": number}))
                await asyncio.sleep(0.02)
            hearing.cancel()

    async def flood(port: int, seconds: float) -> None:
        await asyncio.gather(*(one(port, seconds) for _ in range(CROWD)), return_exceptions=True)

    return flood


async def _drop(socket: ClientConnection) -> None:
    with suppress(WebSocketException):
        async for _ in socket:
            pass


async def _stall(port: int, seconds: float) -> None:
    """Ask for all there is, and read nothing."""
    there = []
    for _ in range(CROWD):
        reader, writer = await asyncio.open_connection("127.0.0.1", port, limit=1)
        key = "Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n"
        upgrade = f"Host: localhost\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n{key}"
        writer.write(f"GET / HTTP/1.1\r\n{upgrade}\r\n".encode())
        for message in (
            {"type": "hello", "versions": [1]},
            {"type": "subscribe", "id": 1, "deltas": True, "console": True, "rate": 200.0},
        ):
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


HARMS: Mapping[str, Harm] = {
    "nothing": Harm("nobody does harm", _nothing),
    **{kind: Harm(f"{CROWD} observers ask for {kind}, 500 times a second each", _flood(kind)) for kind in FLOODS},
    "stall": Harm(f"{CROWD} ask for all there is, and read nothing", _stall),
    "slowly": Harm(f"{STRANGERS} strangers say a letter four times a second", _slowly),
    "garbage": Harm(f"{CROWD} come, say what is garbage, and come again", _in_and_out),
}

if __name__ == "__main__":
    asyncio.run(HARMS[sys.argv[2]].does(int(sys.argv[3]), float(sys.argv[4])))
