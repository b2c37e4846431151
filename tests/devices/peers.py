"""Programs with real peers: who talks to a port begins when it is open, and has ended when the program has."""

from __future__ import annotations

import re
import socket
import time
from collections.abc import Callable
from threading import Thread

from tests.interfaces.programs import load
from tests.interfaces.terminals import RecordingTerminal
from vrs_cli.devices.outside import Outside
from vrs_cli.devices.sockets import Sockets
from vrs_cli.engine.clock import WallClock
from vrs_cli.interfaces.session.session import Session
from vrs_cli.values.replies import Reply
from vrs_cli.values.results import Message, RunResult

PEER_TIMEOUT_S = 10.0  # [s] that a peer waits: no test comes near
Peer = Callable[[socket.socket], None]


class Door(RecordingTerminal):
    """Hears which ports are open, and lets peers in there, one after the other in one thread."""

    def __init__(self, *peers: Callable[[int], None]) -> None:
        super().__init__()
        self.peers, self.ports = list(peers), list[int]()
        self.faults: list[BaseException] = []
        self.threads: list[Thread] = []

    def show(self, reply: Reply) -> None:
        super().show(reply)
        if isinstance(reply, Message) and (told := re.match(r"TCP port (\d+) is open", reply.text)):
            self.ports.append(int(told[1]))
            peers, self.peers = self.peers, []
            if peers:
                self.threads.append(Thread(target=self._go, args=(peers, int(told[1]))))
                self.threads[-1].start()

    def _go(self, peers: list[Callable[[int], None]], port: int) -> None:
        try:
            for peer in peers:
                peer(port)
        except BaseException as fault:
            self.faults.append(fault)

    def leave(self) -> None:
        """All have ended, and nothing has gone wrong with them."""
        for thread in self.threads:
            thread.join(PEER_TIMEOUT_S)
            assert not thread.is_alive()
        assert not self.faults, self.faults


def client(dialogue: Peer) -> Callable[[int], None]:
    """One that connects, talks and closes."""

    def come(port: int) -> None:
        with connected(port) as line:
            dialogue(line)

    return come


def connected(port: int) -> socket.socket:
    return socket.create_connection(("127.0.0.1", port), PEER_TIMEOUT_S)


def exchange(line: socket.socket, said: bytes, size: int) -> bytes:
    """Say something, and hear as many bytes."""
    line.sendall(said)
    return heard(line, size)


def heard(line: socket.socket, size: int) -> bytes:
    come = b""
    while len(come) < size and (more := line.recv(size - len(come))):
        come += more
    return come


def live_session(door: Door, outside: Outside | None = None, rate: float = 1.0) -> Session:
    clock = WallClock(time.monotonic, time.sleep, rate)
    return Session(door, clock=clock, outside=outside or Sockets(patience=PEER_TIMEOUT_S * rate))


def run(door: Door, *lines: str, outside: Outside | None = None, rate: float = 1.0) -> tuple[Session, RunResult]:
    """A program and its peers, to the end of both."""
    session = live_session(door, outside, rate)
    load(session, *lines)
    try:
        result = session.execute("main")
    finally:
        session.close()
    door.leave()
    return session, result
