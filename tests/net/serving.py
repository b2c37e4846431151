"""A server in a thread of its own, and callers who talk to it over real sockets."""

from __future__ import annotations

import asyncio
import threading
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from socket import SHUT_RDWR
from typing import Any, Self

from websockets.exceptions import ConnectionClosed
from websockets.sync.client import ClientConnection as Socket
from websockets.sync.client import connect

from tests.live import PATIENCE
from vrs_cli.errors import RequestRefused
from vrs_cli.kinematics.model import RobotModel
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.net.durable_log import Audit
from vrs_cli.net.http import ServedPage
from vrs_cli.net.limits import USUAL, Allowance
from vrs_cli.net.messages import Bye, Closing, Done, Hello, Line, Request, ServerMessage, Told, Typed, Welcome
from vrs_cli.net.protocol import ClientConnection
from vrs_cli.net.room import Hub, RobotFolders
from vrs_cli.net.served_robot import Plan
from vrs_cli.net.server import ListenAddress, Server
from vrs_cli.net.tokens import TokenFile


class Serving:
    """What a test knows of its server. `told`: what whoever runs it was told."""

    def __init__(self, server: Server, hub: Hub, told: list[str]) -> None:
        self.server, self.hub, self.told = server, hub, told
        self.address = ""
        self.loop: asyncio.AbstractEventLoop | None = None
        self.stop = lambda: None

    def call(self, path: str = "", hello: Hello | None = None, **options: Any) -> Caller:
        return Caller(self.address + path, hello or Hello((1,)), **options)


@contextmanager
def serving(
    folder: Path,
    robots: tuple[str, ...] = ("cell1",),
    *,
    tokens: Path | None = None,
    own: int = 0,
    journal: bool = True,
    allowance: Allowance = USUAL,
    model: RobotModel | None = None,
    origins: tuple[str, ...] = (),
    port: int = 0,
    pages: ServedPage | None = None,
    **plan: Any,
) -> Iterator[Serving]:
    told: list[str] = []
    audit = Audit(folder / "audit.jsonl", time.time, told.append)
    file = tokens and TokenFile(tokens, robots, own)
    server = Server(ListenAddress("127.0.0.1", port, origins=origins), allowance, audit, file, told.append, pages)
    model = model or load_robot("puma560")
    places = RobotFolders(folder / "journal" if journal else None, folder / "files")
    (folder / "journal").mkdir(exist_ok=True)
    usual = Plan(model, folder, allowance=allowance, **plan)
    hub = Hub(
        dict.fromkeys(robots, model), places, usual, audit, server.wake, told.append, own=own, grants=server.grants
    )
    hub.open_all()
    it = Serving(server, hub, told)
    listening = threading.Event()

    async def run() -> None:
        stop, it.loop = asyncio.Event(), asyncio.get_running_loop()
        it.stop = lambda: it.loop and it.loop.call_soon_threadsafe(stop.set)

        def ready(address: str) -> None:
            it.address = address
            listening.set()

        await server.run(hub, ready, stop)

    thread = threading.Thread(target=lambda: asyncio.run(run()), daemon=True)
    thread.start()
    assert listening.wait(PATIENCE)
    try:
        yield it
    finally:
        it.stop()
        thread.join(PATIENCE)
        hub.close()
        audit.close()
        assert not thread.is_alive()


class Caller:
    """Somebody who holds a robot from afar. `heard`: all that the server has said; `frames`: as it came."""

    def __init__(self, address: str, hello: Hello, *, enter: bool = True, **options: Any) -> None:
        self.protocol = ClientConnection(hello)
        self.heard: list[ServerMessage] = []
        self.frames: list[str | bytes] = []
        self._address, self._options = address, options
        self.socket: Socket
        self.connect()
        if enter:
            self.until(lambda message: isinstance(message, Welcome | Closing))

    def connect(self) -> None:
        self.socket = connect(self._address, open_timeout=PATIENCE, compression=None, **self._options)
        self.protocol.begin()
        self.flush()

    def cut(self) -> None:
        """As a cable that is pulled: nothing is said."""
        with suppress(OSError):  # the server may have been sooner
            self.socket.socket.shutdown(SHUT_RDWR)
        self.protocol.cut()

    def flush(self) -> None:
        for frame in self.protocol.frames():
            self.socket.send(frame)

    def until(self, end: Callable[[ServerMessage], object]) -> ServerMessage:
        """The first message of which that is true; those before it are in `heard`."""
        deadline = time.monotonic() + PATIENCE
        while True:
            assert time.monotonic() < deadline, self.heard[-5:]
            self.frames.append(self.socket.recv(timeout=PATIENCE))
            for message in self.protocol.receive(self.frames[-1]):
                self.heard.append(message)
                if end(message):
                    return message
            with suppress(ConnectionClosed):  # what was said before is heard first
                self.flush()

    def send(self, make: Callable[[int], Request]) -> int:
        id = self.protocol.next_id()
        self.protocol.send(make(id))
        self.flush()
        return id

    def ask(self, make: Callable[[int], Request]) -> ServerMessage:
        """A request, and what answers it."""
        id = self.send(make)
        return self.until(lambda message: getattr(message, "id", None) == id and not isinstance(message, Told))

    def line(self, text: str) -> Done:
        done = self.ask(lambda id: Line(id, text))
        assert isinstance(done, Done)
        return done

    def lines(self, *texts: str) -> None:
        for text in texts:
            assert self.line(text).ok, self.said[-1:]

    @property
    def said(self) -> list[str]:
        """What was told and typed, as text."""
        return said_in(self.heard)

    def leave(self) -> None:
        """For good."""
        with suppress(RequestRefused, ConnectionClosed):
            self.protocol.send(Bye())
            self.flush()
        self.close()

    def close(self) -> None:
        self.socket.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_error: object) -> None:
        self.leave()


def said_in(heard: Iterable[ServerMessage]) -> list[str]:
    """What was told and typed, as text."""
    return [
        one.text if isinstance(one, Typed) else str(getattr(one.reply, "text", one.reply))
        for one in heard
        if isinstance(one, Typed | Told)
    ]
