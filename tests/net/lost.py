"""Cut the connections of those who type lines, again and again, and see whether each was done as its author was told.

    python -m tests.net.lost 100 [SEED]

Three authors, at a robot each, type lines before, during and after cuts: a Python program, a shell whose user types
ahead, and a client that sends messages as a page does. A cut comes after a random while: the line is pulled, is down
for a while, is dead for a while and then alive again or pulled, the server is stopped for a while, or it is killed and
started again.

The law: every line is done exactly once and its author told so, or it is never done and its author told so. Only of a
line that was on its way when the server was killed may nobody know. No line is done later than it may be on its way.
"""

from __future__ import annotations

import json
import random
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import time
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from datetime import datetime
from enum import Enum
from io import StringIO
from pathlib import Path
from typing import NamedTuple

import vrs_cli as vrs
from tests.by_hand import command
from tests.live import until
from tests.net.cable import Cable
from vrs_cli.errors import RequestRefused
from vrs_cli.net import messages
from vrs_cli.net.client import Client, hello_of
from vrs_cli.net.far_end import HELD_UP, QUIET
from vrs_cli.net.messages import Done, Refused, ServerMessage
from vrs_cli.net.socket_port import SocketPort
from vrs_cli.repl.connection import Remote
from vrs_cli.repl.loop import PlainTerminal

ROBOTS = ("python", "shell", "sender")
LONGEST_LIFE = 1.5  # [s] between two cuts
SLACK = 3.0  # [s] that a busy machine may need
NOT_DONE = ("this was not sent", "it was not done", "it was not sent", "not given")
NOBODY_KNOWS = "nobody knows whether it was done"
MOST_LINES = 4000  # of one author


class Told(Enum):
    """What an author was told of a line."""

    DONE = "done"
    NOT_DONE = "not done"
    UNKNOWN = "nobody knows"


class Line(NamedTuple):
    """A line that changes something that no other line does; `typed`: when, by the clock on the wall [s]."""

    number: int
    text: str
    typed: float


def told_by(text: str) -> Told:
    if NOBODY_KNOWS in text:
        return Told.UNKNOWN
    assert any(one in text for one in NOT_DONE), text
    return Told.NOT_DONE


class Author:
    """Types lines until `ends` is set; `told` has what became of each."""

    def __init__(self, seed: str) -> None:
        self.random, self.ends = random.Random(seed), threading.Event()
        self.lines: list[Line] = []
        self.told: dict[int, Told] = {}
        self.given: dict[int, float] = {}  # when a line was given that was typed ahead [s]
        self.wrong: BaseException | None = None
        self._thread = threading.Thread(target=self._run, daemon=True)

    def start(self) -> None:
        self._thread.start()

    def join(self) -> None:
        self.ends.set()
        self._thread.join(120.0)
        assert not self._thread.is_alive(), "an author waits for ever"
        if self.wrong is not None:
            raise self.wrong

    def _run(self) -> None:
        try:
            while not self.ends.is_set() and len(self.lines) < MOST_LINES:
                self.work()
                self.ends.wait(self.random.choice((0.0, 0.1, 0.3)))
        except BaseException as error:
            self.wrong = error

    def work(self) -> None:
        """Type a line, or some, and wait until it is known what became of it."""
        raise NotImplementedError

    def close(self) -> None:
        raise NotImplementedError

    @property
    def open(self) -> bool:
        """Whether there is a connection."""
        raise NotImplementedError

    def line(self) -> Line:
        number = len(self.lines) + 1
        moves = self.random.random() < 0.3
        angle = number / 1000.0 * (-1.0) ** number  # joint 6 stays in its range
        text = f"DRIVE 6, {angle:.3f}" if moves else f"n[{number}] = n[{number}] + 1"
        self.lines.append(Line(number, text, time.time()))
        return self.lines[-1]


class Programmer(Author):
    """A Python program: an error says what was not done."""

    def __init__(self, url: str, seed: str) -> None:
        super().__init__(seed)
        self._robot = vrs.connect(url)

    def work(self) -> None:
        line = self.line()
        try:
            self._robot.do(line.text)
        except RequestRefused as refused:
            self.told[line.number] = told_by(str(refused))
        else:
            self.told[line.number] = Told.DONE

    @property
    def open(self) -> bool:
        held = self._robot.held
        return held.port.open

    def close(self) -> None:
        self._robot.leave()


class _Person(PlainTerminal):
    """Somebody whose line is not sent any more when the connection was quiet for long."""

    attended = True


class Typist(Author):
    """A shell; lines are typed ahead while one is waited for, and dropped as the shell drops them."""

    def __init__(self, url: str, seed: str) -> None:
        super().__init__(seed)
        self._said: list[str] = []
        self._far = SocketPort(Client(url, hello_of(attended=True)))
        self._sink = StringIO()
        self._terminal = _Person(self._sink, ())
        self._front_end = Remote(self._far, self._said.append).front_end(self._terminal)
        self._keys: deque[Line] = deque()

    def work(self) -> None:
        typing = threading.Thread(target=self._type_ahead)
        self._keys.append(self.line())
        typing.start()
        self._take(self._keys.popleft())
        typing.join()
        if self._front_end.was_cut():
            self._drop()
        while self._keys:
            self._take(self._keys.popleft())
            if self._front_end.was_cut():
                self._drop()

    def _type_ahead(self) -> None:
        for _ in range(self.random.choice((0, 0, 1, 3))):
            self._keys.append(self.line())

    def _drop(self) -> None:
        while self._keys:
            line = self._keys.popleft()
            self._front_end.drop(line.text)
            self.told[line.number] = told_by(self._said[-1])

    def _take(self, line: Line) -> None:
        self.given[line.number] = time.time()
        self._said.clear()
        self._front_end.failed = self._terminal.failed = False
        before = len(self._sink.getvalue())
        self._front_end.take(line.text)
        said = [one for one in self._said if NOBODY_KNOWS in one or any(it in one for it in NOT_DONE)]
        if self._terminal.failed:
            said.append(self._sink.getvalue()[before:])
        lost = self._front_end.failed or self._terminal.failed
        self.told[line.number] = told_by(said[-1]) if lost else Told.DONE

    @property
    def open(self) -> bool:
        return self._far.open

    def close(self) -> None:
        self._far.close()


class Sender(Author):
    """A client that sends each line as a message and hears what ends it, as a page does."""

    def __init__(self, url: str, seed: str) -> None:
        super().__init__(seed)
        self._robot = SocketPort.connect(url, hello_of(attended=True))

    def work(self) -> None:
        line, ends = self.line(), list[Done | Refused]()

        def hear(message: ServerMessage) -> None:
            if isinstance(message, Done | Refused):
                ends.append(message)

        try:
            self._robot.begin(lambda number: messages.Line(number, line.text), hear)
        except RequestRefused as refused:
            self.told[line.number] = told_by(str(refused))
            return
        until(lambda: ends, line.text)
        refusal = ends[0].refusal
        self.told[line.number] = Told.DONE if refusal is None else told_by(str(refusal.error()))

    @property
    def open(self) -> bool:
        return self._robot.open

    def close(self) -> None:
        self._robot.close()


AUTHORS: dict[str, Callable[[str, str], Author]] = {"python": Programmer, "shell": Typist, "sender": Sender}


class Server:
    """A process that serves a robot for each author, and comes back where it was."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.stops: list[tuple[float, float]] = []  # when the process was stopped, from and to [s]
        with socket.create_server(("127.0.0.1", 0)) as free:
            self.port = free.getsockname()[1]
        self._start()

    def _start(self) -> None:
        robots = [word for name in ROBOTS for word in ("--robot", f"{name}=puma560")]
        where = ["--port", str(self.port), "--journal", str(self.folder), "--realtime"]
        serve = [sys.executable, "-m", "vrs_cli", "serve", *where, *robots]
        self.process = subprocess.Popen(serve, stdout=subprocess.PIPE, text=True)
        assert self.process.stdout is not None
        assert "ws://" in self.process.stdout.readline(), "the server did not come"

    def url(self, robot: str) -> str:
        return f"ws://127.0.0.1:{self.port}/robots/{robot}"

    def kill(self) -> None:
        self.process.kill()
        self.process.wait()
        self._start()

    def stop_for(self, seconds: float) -> None:
        begun = time.time()
        self.process.send_signal(signal.SIGSTOP)
        time.sleep(seconds)
        self.process.send_signal(signal.SIGCONT)
        self.stops.append((begun, time.time()))

    def close(self) -> None:
        self.process.terminate()
        self.process.wait()


@contextmanager
def authors(url: Callable[[str], str], seed: int) -> Iterator[tuple[dict[str, Author], list[Cable]]]:
    """One at each robot, over a cable."""
    cables = {robot: Cable(url(robot)) for robot in ROBOTS}
    for robot in ROBOTS:
        with vrs.connect(url(robot)) as there:
            count = f".PROGRAM none()\n  FOR k = 1 TO {MOST_LINES}\n    n[k] = 0\n  END\n.END\n"
            there.define(count)
            there.execute("none")
    writing = {robot: AUTHORS[robot](cables[robot].url, f"{seed} {robot}") for robot in ROBOTS}
    try:
        yield writing, list(cables.values())
    finally:
        for author in writing.values():
            author.close()
        for cable in cables.values():
            cable.close()


def cut(cable: Cable, chance: random.Random) -> str:
    """Some cut of a line, until it is whole again."""
    kind = chance.choice(("pulled", "down", "dead", "dead, then pulled"))
    match kind:
        case "pulled":
            cable.pull()
        case "down":
            cable.shut()
            time.sleep(chance.uniform(0.0, 3.0))
            cable.open()
        case _:
            cable.freeze()
            time.sleep(chance.uniform(0.0, 4.0 * HELD_UP))
            cable.flow() if kind == "dead" else cable.pull()
    return kind


def check(author: Author, robot: str, url: str, killed: bool) -> dict[Told, int]:
    """What was told is so; how often what was."""
    with vrs.connect(url) as there:
        moved = [one.text for one in there.commands]
        counts = {line.number: moved.count(line.text) for line in author.lines if line.text.startswith("DRIVE")}
        for line in author.lines:
            if line.number not in counts:
                counts[line.number] = int(there[f"n[{line.number}]"])  # type: ignore[call-overload]
    for line in author.lines:
        told, count = author.told[line.number], counts[line.number]
        right = {Told.DONE: count == 1, Told.NOT_DONE: count == 0, Told.UNKNOWN: killed and count <= 1}
        if not right[told]:
            raise SystemExit(f"{robot}: {line.text} was done {count} times, and its author told: {told.value}")
    return {told: list(author.told.values()).count(told) for told in Told}


def check_times(audit: Path, authors: dict[str, Author], stops: list[tuple[float, float]]) -> float:
    """The longest time after which a line was done that was given [s]; a server that was stopped while it had a line
    does it afterwards.
    """
    typed, longest = {}, 0.0
    for robot, author in authors.items():
        for line in author.lines:
            given = typed[robot, line.text] = author.given.get(line.number, line.typed)
            if given - line.typed > QUIET + SLACK:
                raise SystemExit(f"{robot}: {line.text} was given {given - line.typed:.1f} s after it was typed")
    for row in map(json.loads, audit.read_text().splitlines()):
        when = typed.get((row["robot"], row["what"]))
        if when is None or row["result"] != "done":
            continue
        done = datetime.fromisoformat(row["when"]).timestamp()
        after = done - when - sum(end - begun for begun, end in stops if when <= begun < done)
        longest = max(longest, after)
        if after > HELD_UP + SLACK:
            raise SystemExit(f"{row['robot']}: {row['what']} was done {after:.1f} s after it was given")
    return longest


def lose(times: int, seed: int, folder: Path) -> None:
    chance, server = random.Random(seed), Server(folder)
    done: dict[str, int] = {}
    try:
        with authors(server.url, seed) as (writing, cables):
            for author in writing.values():
                author.start()
            for number in range(times):
                if chance.random() < 0.8:  # else one cut comes before the one before is over
                    until(lambda: all(author.open for author in writing.values()), "all are connected")
                time.sleep(chance.uniform(0.0, LONGEST_LIFE))
                what = chance.random()
                if what < 0.1:
                    server.kill()
                    kind = "server killed"
                elif what < 0.2:
                    server.stop_for(chance.uniform(0.0, 4.0 * HELD_UP))
                    kind = "server stopped"
                else:
                    kind = cut(chance.choice(cables), chance)
                done[kind] = done.get(kind, 0) + 1
                if not (number + 1) % 10:
                    print(f"{number + 1} cuts, {sum(len(it.lines) for it in writing.values())} lines", flush=True)
            for author in writing.values():
                author.join()
            time.sleep(2.0 * HELD_UP)  # what is on its way still would come
            killed = "server killed" in done
            for robot, author in writing.items():
                found = check(author, robot, server.url(robot), killed)
                print(f"{robot}: " + ", ".join(f"{count} {told.value}" for told, count in found.items()))
            latest = check_times(folder / "audit.jsonl", writing, server.stops)
            print(f"done {latest:.1f} s after it was given at the latest")
    finally:
        server.close()
    print(", ".join(f"{count} times {kind}" for kind, count in sorted(done.items())))


def main(times: int = 20, seed: int = 1) -> None:
    with tempfile.TemporaryDirectory() as folder:
        lose(times, seed, Path(folder))


if __name__ == "__main__":
    command(main)
