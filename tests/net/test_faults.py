"""Faults at real sockets: who does not read, who is cut, who comes and goes. The server lives, others notice nothing,
and nothing that was answered is lost or done twice.
"""

from __future__ import annotations

import json
import random
import re
import socket as sockets
import time
from datetime import datetime
from pathlib import Path
from typing import Any

import pytest

import vrs_cli as vrs
from tests.engine.wall import ManualWall
from tests.live import until
from tests.net.cable import cable
from tests.net.serving import Caller, Serving, serving
from vrs_cli.interfaces.users import RobotLease
from vrs_cli.net.limits import HIGH_WATER_BYTES, Allowance
from vrs_cli.net.limits import SEND_TIMEOUT_S as PACE
from vrs_cli.net.messages import (
    Abort,
    Done,
    Fate,
    Hello,
    Line,
    Located,
    Outcome,
    Positions,
    ServerMessage,
    Typed,
    Welcome,
    Who,
)
from vrs_cli.net.server import BACKLOG, HIGH_WATER, SYSTEM_BUFFER_BYTES

MOST = 1_000_000  # bytes that somebody may cost who does not read


def held(server: Serving) -> int:
    """The bytes that wait for the slowest client."""
    return max(link.sink.waiting + link.connection._outbox.size for link in server.server._links)


def held_by_system(link: Any) -> int:
    """The bytes that the system may hold for a client."""
    return int(link.socket.transport.get_extra_info("socket").getsockopt(sockets.SOL_SOCKET, sockets.SO_SNDBUF))


def test_who_does_not_read_delays_nobody_and_costs_little(tmp_path: Path) -> None:
    with serving(tmp_path, journal=False) as server, server.call() as ada:
        raw = sockets.create_connection(("127.0.0.1", int(server.address.rpartition(":")[2])))
        raw.setsockopt(sockets.SOL_SOCKET, sockets.SO_RCVBUF, 4096)
        raw.sendall(
            b"GET / HTTP/1.1\r\nHost: x\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
            b"Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\nSec-WebSocket-Version: 13\r\n\r\n"
        )
        for text in (b'{"type":"hello","versions":[1]}', b'{"type":"subscribe","id":1,"deltas":true,"console":true}'):
            raw.sendall(bytes((0x81, 0x80 | len(text))) + bytes(4) + text)  # masked with zeros
        for line in (".PROGRAM much", "FOR i = 1 TO 7000", 'TYPE "' + "x" * 100 + '"', "END", ".END"):
            assert ada.line(line).ok
        for number in range(80):
            assert ada.line(f"DRIVE 1, {5 if number % 2 else -5}, 50").ok
        assert held(server) <= MOST
        assert all(held_by_system(link) <= 2 * SYSTEM_BUFFER_BYTES for link in server.server._links), (
            "Linux counts twice"
        )
        assert ada.line("EXECUTE much").ok
        assert held(server) <= BACKLOG + 2 * HIGH_WATER
        assert ada.line("WHERE").ok
        raw.close()


LONG = 100 * "x"
CHAT = (".PROGRAM chat", f'$s = "{LONG}"', "FOR i = 1 TO 3000", f"TYPE i{30 * ', $s'}", "END", ".END")


def test_all_that_is_typed_comes_to_who_reads_more_slowly(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    wall = ManualWall(time.monotonic())
    with serving(tmp_path, journal=False) as server, server.call() as ada:
        room = server.hub.rooms["cell1"]
        monkeypatch.setattr(room, "wall", wall)  # she is as slow as the test says
        ada.lines(*CHAT)
        before = len(ada.said)
        id = ada.send(lambda id: Line(id, "EXECUTE chat"))
        until(lambda: room.clients["guest"].pace.waiting > HIGH_WATER_BYTES)
        wall.seconds += 3.0  # a packet that is lost twice is sent again after 1 s and 2 s (RFC 6298)
        ada.until(lambda one: sleep_a_little(one) or (isinstance(one, Done) and one.id == id))
        typed = [text.strip() for text in ada.said[before:]]
        assert typed[:-1] == [f"{number}{30 * LONG}" for number in range(1, 3001)]
        assert ada.line("WHERE").ok


def test_who_stops_reading_holds_nobody(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    wall = ManualWall(time.monotonic())
    with serving(tmp_path, journal=False) as server, server.call() as bob:
        ada = server.call()
        room = server.hub.rooms["cell1"]
        monkeypatch.setattr(room, "wall", wall)  # it waits for her until the test says that time passes
        ada.lines(".PROGRAM much", f'$s = "{LONG}"', "DO", f"TYPE {30 * '$s, '}$s", "UNTIL FALSE", ".END")
        client = room.clients["guest-2"]
        ada.send(lambda id: Line(id, "EXECUTE much"))
        until(lambda: client.pace.waiting > HIGH_WATER_BYTES)
        for _ in range(5):
            assert bob.line("WHERE").ok, "though the program waits for her"
        assert client.link is not None

        def is_let_go() -> bool:  # her system may have taken a part after the wall has gone on
            wall.seconds += PACE
            return client.link is None

        until(is_let_go)
        assert room.session.running
        assert bob.ask(Abort)
        assert not room.session.running
        ada.cut()


def test_a_program_that_waits_for_who_hears_it_is_stopped_at_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with serving(tmp_path, journal=False) as server, server.call() as bob:
        ada = server.call()
        room = server.hub.rooms["cell1"]
        monkeypatch.setattr(room, "wall", ManualWall(time.monotonic()))  # it waits for ever
        ada.lines(".PROGRAM much", f'$s = "{LONG}"', "DO", f"TYPE {30 * '$s, '}$s", "UNTIL FALSE", ".END")
        ada.send(lambda id: Line(id, "EXECUTE much"))
        until(lambda: room.clients["guest-2"].pace.waiting > HIGH_WATER_BYTES)
        assert bob.ask(Abort)
        assert not room.session.running
        ada.cut()


def test_who_looks_too_much_waits_and_who_drives_does_not(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("vrs_cli.net.server.MAX_SHARE_WAIT_S", 0.1)
    few = Allowance(looking=0.001, looking_window=1.0)
    with serving(tmp_path, journal=False, allowance=few) as server, server.call() as ada, server.call() as eve:

        def asked(count: int) -> float:
            begun = time.monotonic()
            for _ in range(count):
                assert isinstance(eve.ask(lambda id: Positions(id, tuple(map(float, range(500))))), Located)
            return time.monotonic() - begun

        driver, looker = server.hub.rooms["cell1"].clients.values()
        asked(4)
        assert looker.wait(Who(1)) == 0.0, "nobody drives: nobody waits for her"
        ada.lines("DRIVE 1, 5", "DRIVE 1, -5")
        assert asked(4) > 0.3
        eve.send(lambda id: Line(id, "WHERE"))
        ada.lines(*(f"x = {number}" for number in range(10)))
        assert driver.wait(Who(1)) == 0.0
        assert eve.ask(Abort).ok  # type: ignore[attr-defined]


def test_a_peer_that_vanishes_is_cut_and_another_drives(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("vrs_cli.net.server.PING_INTERVAL_S", 0.1)
    monkeypatch.setattr("vrs_cli.net.room.DRIVER_SILENCE_S", 0.1)
    monkeypatch.setattr("vrs_cli.net.server.CLOSE_TIMEOUT_S", 0.1)
    with serving(tmp_path, journal=False) as server, cable(server.address) as wire, server.call() as bob:
        room = server.hub.rooms["cell1"]
        wall = ManualWall()
        monkeypatch.setattr(room.driving, "_wall", wall)  # a lease ends when the test says so
        room.driving.lease = RobotLease(length=1.0)
        ada = Caller(wire.url, Hello((1,), name="ada"))
        assert ada.line("x = 1").ok
        for _ in range(3):
            wall.seconds += 0.9
            until(lambda: room.driving.lease.until == wall.seconds + 1.0)
            assert not bob.line("x = 2").ok, "she is there, and says nothing: a ping tells it"
        wire.freeze()
        while not bob.line("x = 2").ok:
            wall.seconds += 0.9
        assert server.loop is not None
        server.loop.call_soon_threadsafe(hurry, room.clients["ada"].link)
        until(lambda: room.clients["ada"].link is None)
        wire.pull()
        ada.protocol.cut()
        ada._address = server.address
        ada.connect()
        welcome = ada.until(lambda one: isinstance(one, Welcome))
        assert isinstance(welcome, Welcome)
        assert welcome.resumed
        assert not ada.line("x = 3").ok
        ada.leave()


def hurry(link: Any) -> None:
    """Whether the client is there is asked now, and waited for no longer than a moment."""
    link.socket.ping_timeout = 0.1
    link.socket.keepalive_task.cancel()
    link.socket.start_keepalive()


OFF = 600.0  # [s] by which a busy machine is not off, and less than a jump


@pytest.mark.parametrize("jump", [3600.0, -3600.0])
def test_a_jump_of_the_wall_clock_moves_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, jump: float) -> None:
    real, ahead = time.time, [0.0]
    monkeypatch.setattr(time, "time", lambda: real() + ahead[0])
    with serving(tmp_path, realtime=1.0) as server, server.call() as bob:
        room, clock = server.hub.rooms["cell1"], server.hub.rooms["cell1"].session.engine.clock
        ada = server.call(hello=Hello((1,), name="ada"))
        ada.lines("x = 1", "DRIVE 1, 5")
        with vrs.connect(server.address) as robot:
            assert abs(robot.now - clock.reached) < OFF
            before, ahead[0] = clock.reached, jump
            ada.cut()
            ada.connect()
            welcome = ada.until(lambda one: isinstance(one, Welcome))
            assert isinstance(welcome, Welcome)
            assert welcome.resumed
            assert not bob.line("x = 2").ok, "the lease is hers"
            ada.lines("x = 3", "DRIVE 1, -5")
            for _ in range(8):
                robot.do("WHERE")  # pings go on meanwhile
            assert abs(robot.now - clock.reached) < OFF
            assert 0.0 < clock.reached - before < OFF
            until(lambda: room.clients["ada"].link is not None)
        rows = (tmp_path / "audit.jsonl").read_text().splitlines()
        assert datetime.fromisoformat(json.loads(rows[-1])["when"]).timestamp() == pytest.approx(real() + jump, abs=OFF)
        ada.leave()


ON_THE_WALL = {
    "cli/serve.py": "the audit says when",
    "files/recovery.py": "how old a file is",
    "net/server.py": "tokens end at a time of the calendar",
    "net/local_server.py": "the audit of its own server",
}


def test_the_wall_clock_is_asked_for_the_calendar_alone() -> None:
    """All else goes by a clock that nobody sets."""
    package = Path(vrs.__file__).parent
    found = {
        path.relative_to(package).as_posix()
        for path in package.rglob("*.py")
        if re.search(r"\btime\.time(_ns)?\b", path.read_text(encoding="utf-8"))
    }
    assert found == ON_THE_WALL.keys()


def sleep_a_little(one: ServerMessage) -> bool:
    """A client with much to do."""
    if isinstance(one, Typed):
        time.sleep(0.0001)
    return False


def test_what_is_answered_over_cuts_is_done_once(tmp_path: Path) -> None:
    chance = random.Random(5)
    with serving(tmp_path) as server:
        ada = server.call()
        assert ada.line("x = 0").ok
        done, sent = 0, 0
        for _ in range(20):
            for _ in range(chance.randint(0, 3)):
                done += ada.line("x = x + 1").ok
                sent += 1
            id = ada.send(lambda id: Line(id, "x = x + 1"))
            sent += 1
            ada.cut()
            ada.connect()
            welcome = ada.until(lambda one: isinstance(one, Welcome))
            assert isinstance(welcome, Welcome)
            assert welcome.resumed
            end = ada.until(lambda one, id=id: isinstance(one, Done) and one.id == id)  # type: ignore[misc]
            assert isinstance(end, Done)
            unseen = Fate(id, Outcome.UNSEEN) in welcome.fates
            assert end.ok is not unseen, "a command that did not come to the robot is refused"
            done += ada.line("x = x + 1").ok if unseen else end.ok
        assert ada.line("TYPE x").ok
        assert int(ada.said[-1]) == done == sent
        ada.leave()


def test_who_comes_and_goes_leaves_nothing_behind(tmp_path: Path) -> None:
    with serving(tmp_path, journal=False) as server:
        for number in range(60):
            caller = server.call(hello=Hello((1,), name=f"n{number}"))
            if number % 3 == 0:
                caller.cut()
            elif number % 3 == 1:
                caller.leave()
            else:
                caller.close()
        with server.call() as ada:
            assert ada.line("WHERE").ok
            until(lambda: len(server.server._links) == 1)
            room = server.hub.rooms["cell1"]
            assert len(room.clients) == 41, "those who may come again within a minute"
            assert not any(client.pending for client in room.clients.values())
            assert ada.ask(Abort)
