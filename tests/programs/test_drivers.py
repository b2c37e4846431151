"""Drivers in the style of those that were published for ROS-Industrial: real processes, and stand-ins for their peers.

The messages are those of `simple_message`: length, type, kind, reply code, sequence number, joints in radians.
"""

from __future__ import annotations

import socket
import struct
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from math import degrees, radians
from pathlib import Path
from typing import NamedTuple

import pytest

from tests.live import PATIENCE, until

ROOT = Path(__file__).parents[2]
DRIVERS = Path(__file__).parent / "drivers"
GOALS = [(5.0 * k, -90.0 + 3.0 * k, 90.0 - 2.0 * k, 0.0, 4.0 * k, -float(k), 0.0, 0.0, 0.0, 0.0) for k in range(8)]
JOINTS, POINT, STATUS = 10, 11, 13  # types of messages


class Driver(NamedTuple):
    """A driver that runs, and the ports of requests and of what it tells."""

    process: subprocess.Popen[str]
    motion: int
    state: int


@contextmanager
def driver(name: str, folder: Path, before: str = "", beside: str = "") -> Iterator[Driver]:
    """Run a driver with a pipe for its input; it is stopped in the end. `before`: steps of its main program; `beside`:
    other programs.
    """
    motion, state = _free_ports(2)
    text = (DRIVERS / name).read_text(encoding="utf-8").replace("11000", str(motion)).replace("11002", str(state))
    path = folder / name
    path.write_text(text.replace("    run = TRUE\n", f"    run = TRUE\n{before}", 1) + beside, encoding="utf-8")
    command = [sys.executable, "-m", "vrs_cli", "run", str(path), "--allow-net"]
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "stderr": subprocess.STDOUT}
    process = subprocess.Popen(command, **pipes, text=True, cwd=ROOT)  # type: ignore[call-overload]
    try:
        yield Driver(process, motion, state)
    finally:
        process.kill()
        process.communicate()


def _free_ports(count: int) -> list[int]:
    lines = [socket.create_server(("127.0.0.1", 0)) for _ in range(count)]
    ports = [line.getsockname()[1] for line in lines]
    for line in lines:
        line.close()
    return ports


def connected(port: int) -> socket.socket:
    """A connection to a port, once it is open."""
    found: list[socket.socket] = []

    def tried() -> bool:
        try:
            found.append(socket.create_connection(("127.0.0.1", port), PATIENCE))
        except ConnectionRefusedError:
            return False
        return True

    until(tried, f"port {port} is open")
    return found[0]


def message(line: socket.socket, order: str) -> bytes:
    """The next message, without its length."""
    (length,) = struct.unpack(f"{order}i", _bytes(line, 4))
    return _bytes(line, length)


def _bytes(line: socket.socket, count: int) -> bytes:
    found = b""
    while len(found) < count:
        more = line.recv(count - len(found))
        assert more, "the driver has closed the connection"
        found += more
    return found


def joints_told(line: socket.socket, order: str) -> tuple[float, ...]:
    """The joints of the next message that tells them [deg]."""
    while True:
        found = message(line, order)
        if struct.unpack(f"{order}i", found[:4]) == (JOINTS,):
            return tuple(round(degrees(joint), 2) + 0.0 for joint in struct.unpack(f"{order}10f", found[16:]))


def test_joint_positions_are_answered_and_told(tmp_path: Path) -> None:
    with driver("joints.v2", tmp_path) as it, connected(it.motion) as motion, connected(it.state) as state:
        for number, goal in enumerate(GOALS):
            request = struct.pack(">5i10f", 56, JOINTS, 2, 0, number, *map(radians, goal))
            motion.sendall(request[:7])  # in pieces, as networks deliver
            motion.sendall(request[7:])
            answer = message(motion, ">")
            assert struct.unpack(">4i", answer[:16]) == (JOINTS, 3, 1, number)
        out_of_reach = (200.0, *GOALS[0][1:])
        motion.sendall(struct.pack(">5i10f", 56, JOINTS, 2, 0, 9, *map(radians, out_of_reach)))
        assert struct.unpack(">4i", message(motion, ">")[:16]) == (JOINTS, 3, 2, 9), "refused"
        told = [joints_told(state, ">")]
        while told[-1] != GOALS[-1]:
            told.append(joints_told(state, ">"))
        assert len(set(told)) > 2, "told on the way, too"
        motion.sendall(struct.pack(">5i10f", 56, JOINTS, 2, 0, -2, *GOALS[0]))
        assert message(motion, ">")
        assert it.process.wait(PATIENCE) == 0


def test_points_of_a_trajectory_are_answered_and_told(tmp_path: Path) -> None:
    """Its client leaves, and comes again."""
    with driver("points.v2", tmp_path) as it, connected(it.state) as state:
        assert it.process.stdout is not None
        for numbers in (range(4), range(4, 8)):
            assert any(f"port {it.motion} is open" in line for line in it.process.stdout)
            with connected(it.motion) as motion:
                for number in numbers:
                    point = struct.pack("<5i10f2f", 64, POINT, 2, 0, number, *map(radians, GOALS[number]), 0.5, 1.0)
                    motion.sendall(point)
                    assert struct.unpack("<4i", message(motion, "<")) == (POINT, 3, 1, number)
        types, statuses, told = set[int](), set[tuple[int, ...]](), list[tuple[float, ...]]()
        while not told or told[-1] != GOALS[-1]:
            found = message(state, "<")
            types.add(struct.unpack("<i", found[:4])[0])
            if len(found) == 56:
                told.append(tuple(round(degrees(one), 2) + 0.0 for one in struct.unpack("<10f", found[16:])))
            else:
                statuses.add(struct.unpack("<10i", found)[3:])
        assert types == {JOINTS, STATUS}
        assert (1, 0, 0, 0, 1, 2, 1) in statuses, "drives have power, nothing is wrong, it moves, automatic"
        assert len(set(told)) > 2


@pytest.mark.parametrize(("name", "order"), [("joints.v2", ">"), ("points.v2", "<")])
def test_a_driver_goes_on_while_it_waits_for_a_pipe(name: str, order: str, tmp_path: Path) -> None:
    asks = '.PROGRAM asks()\n    PROMPT "name?", $line\n    TYPE "got ", $line\n.END\n'
    with driver(name, tmp_path, "    EXECUTE 9 asks()\n", asks) as it, connected(it.state) as state:
        for _ in range(5):
            assert joints_told(state, order)
        assert it.process.stdin is not None
        assert it.process.stdout is not None
        it.process.stdin.write("hello\n")
        it.process.stdin.flush()
        assert any("got hello" in line for line in it.process.stdout)
        assert joints_told(state, order)
