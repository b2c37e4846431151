"""How soon lines are answered to a class of 30 in browsers: `python -m benchmarks classroom [students] [seconds]`.

`vrs serve --class` in a process of its own; each student is a page as the server sees it: changes of the timeline,
styled replies, pings, the state of the robot after each line. A teacher's wall follows all. Two cores are for the
server and for those who ask.
"""

from __future__ import annotations

import asyncio
import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any, Self

from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import ConnectionClosed

from vrs_cli.net.tokens import ClassFolder

STUDENTS, SECONDS = 30, 10.0
RATES = (1.0, 10.0)  # lines of each student in a second
LINES = ("DRIVE 1, 5", "WHERE", "DRIVE 1, -5", "x = x+1", "MOVE #PPOINT(10, -80, 80, 5, 5, 5)", "TYPE x", "READY")
SURVEY = {"kind": "Survey"}
PING = 2.0  # [s]


class Asker:
    """A page: it gives lines, and waits for the end of each."""

    def __init__(self, socket: ClientConnection) -> None:
        self._socket, self._id = socket, 0
        self._waiting: dict[int, asyncio.Future[float]] = {}
        self.taken: list[float] = []  # [s] that each line took
        self.late = 0  # lines that were not given in time, because the one before was not answered
        self._tasks = [asyncio.create_task(self._hear()), asyncio.create_task(self._ping())]

    @classmethod
    async def enter(cls, address: str, token: str) -> Self:
        """Say hello, and follow the timeline."""
        socket = await connect(address, max_size=None)
        hello = {"type": "hello", "versions": [1], "token": token, "full": True, "attended": True, "rendered": 100}
        await socket.send(json.dumps(hello))
        found = json.loads(await socket.recv())
        if found["type"] != "welcome":
            raise SystemExit(str(found))
        it = cls(socket)
        await it.ask("subscribe", deltas=True, window=60)
        return it

    async def _hear(self) -> None:
        with suppress(ConnectionClosed):
            async for frame in self._socket:
                message = json.loads(frame)
                waiting = (
                    self._waiting.pop(message.get("id", 0), None) if message["type"] in ("done", "refused") else None
                )
                if waiting is not None:
                    waiting.set_result(time.perf_counter())

    async def _ping(self) -> None:
        with suppress(ConnectionClosed):
            while True:
                await self._socket.send(json.dumps({"type": "ping", "sent": time.perf_counter()}))
                await asyncio.sleep(PING)

    async def ask(self, kind: str, **fields: Any) -> float:
        """Return how long the answer took [s]."""
        self._id += 1
        self._waiting[self._id] = asyncio.get_running_loop().create_future()
        begun, waiting = time.perf_counter(), self._waiting[self._id]
        await self._socket.send(json.dumps({"type": kind, "id": self._id, **fields}))
        return await waiting - begun

    async def work(self, rate: float, until: float, first: float) -> None:
        """Give lines at a rate, the first one after a while, and look at the robot after each, at most 5 times a
        second.
        """
        due, looked, number = time.perf_counter() + first, 0.0, 0
        while due < until:
            await asyncio.sleep(max(0.0, due - time.perf_counter()))
            self.taken.append(await self.ask("line", text=LINES[number % len(LINES)]))
            number += 1
            if time.perf_counter() - looked > 1.0 / 5.0:
                looked = time.perf_counter()
                await self.ask("at", act=SURVEY)
            due += 1.0 / rate
            if due < time.perf_counter():
                self.late += 1
                due = time.perf_counter()

    async def leave(self) -> None:
        for task in self._tasks:
            task.cancel()
        await self._socket.close()


def main() -> None:
    given = [float(text) for text in sys.argv[2:4] if text.replace(".", "").isdigit()]
    students, seconds = [*given, *(STUDENTS, SECONDS)[len(given) :]]
    with tempfile.TemporaryDirectory() as folder:
        it = ClassFolder(Path(folder))
        it.make([f"student{number}" for number in range(int(students))])
        command = [sys.executable, "-m", "vrs_cli", "serve", "--class", folder, "--port", "0"]
        with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as server:
            try:
                assert server.stdout is not None
                address = server.stdout.readline().split()[2].rstrip(",")
                asyncio.run(_measured(address, it, seconds, server.pid))
            finally:
                server.terminate()


async def _measured(address: str, folder: ClassFolder, seconds: float, pid: int) -> None:
    (teacher, secret) = next(iter(folder.teachers().items()))
    pages = [await Asker.enter(f"{address}/robots/{name}", token) for name, token in folder.students().items()]
    wall = [await Asker.enter(f"{address}/robots/{name}", secret) for name in (teacher, *folder.students())]
    await wall[0].ask("watchclass")
    for page in pages:
        await page.ask("line", text="x = 0")
    print(f"{len(pages)} students, and a wall that follows all; {os.cpu_count()} cores, load {os.getloadavg()[0]:.1f}")
    for rate in RATES:
        begun, cpu = time.perf_counter(), _cpu(pid)
        own = time.process_time()
        every = 1.0 / rate / len(pages)
        until = begun + seconds
        await asyncio.gather(*(page.work(rate, until, every * number) for number, page in enumerate(pages)))
        spent = time.perf_counter() - begun
        taken = sorted(1000.0 * one for page in pages for one in page.taken)
        late = sum(page.late for page in pages)
        print(
            f"{rate:4g} lines a second each: {len(taken):5} lines, {_part(taken, 0.5):6.1f} ms median, "
            f"{_part(taken, 0.95):6.1f} ms p95, {taken[-1]:6.1f} ms at most, {late} late; "
            f"server {(_cpu(pid) - cpu) / spent:.0%} of a core, pages {(time.process_time() - own) / spent:.0%}",
            flush=True,
        )
        for page in pages:
            page.taken.clear()
            page.late = 0
    for one in (*pages, *wall):
        await one.leave()


def _part(taken: Sequence[float], part: float) -> float:
    return taken[min(int(part * len(taken)), len(taken) - 1)]


def _cpu(pid: int) -> float:
    """Return the CPU time of a process [s]."""
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")
