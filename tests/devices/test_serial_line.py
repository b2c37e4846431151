"""Serial lines: pseudo-terminals, and devices that are given by their path."""

from __future__ import annotations

import os
import re
import sys

import pytest

from tests.devices.peers import Door, live_session
from tests.interfaces.programs import load
from vrs_cli.devices.sockets import Sockets, open_serial
from vrs_cli.errors import DeviceNotReady
from vrs_cli.values.results import Message

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="Windows has no terminals of this kind")

SERVER = (
    'ATTACH (lun, 4) "SERIAL:1"',
    'WRITE (lun) "Ready"',
    "READ (lun) op, x",
    "DRIVE 1, x, 100",
    'WRITE (lun) "K"',
    "READ (lun) op, x",
    "TYPE /I0, IOSTAT(lun)",
)


def path_of(door: Door) -> str:
    told = [reply.text for reply in door.replies if isinstance(reply, Message)]
    return re.sub(r"SERIAL:\d is (\S+).*", r"\1", told[-1])


class At(Door):
    """Whoever is at the other end says all at once: a line holds what nobody has read yet."""

    def __init__(self, said: bytes) -> None:
        super().__init__()
        self.said, self.end = said, -1

    def show(self, reply: object) -> None:
        super().show(reply)  # type: ignore[arg-type]
        if self.end < 0:
            self.end = os.open(path_of(self), os.O_RDWR | os.O_NOCTTY)
            os.write(self.end, self.said)


def test_a_program_dialogues_over_a_pseudo_terminal() -> None:
    door = At(b"1 20\r\n1 x\x03\r")
    session = live_session(door, Sockets(serial={"1": "pty"}, patience=1000.0), rate=100.0)
    load(session, *SERVER)
    result = session.execute("main")
    assert result.fault is None
    assert result.typed == ("-456",)
    assert os.read(door.end, 100) == b"Ready\r\nK\r\n"
    session.close()
    os.close(door.end)


def test_a_line_of_the_system_is_opened_by_its_path() -> None:
    ours, theirs = os.openpty()
    path = os.ttyname(theirs)
    ends, told = open_serial(f"{path},115200")
    assert told == f"{path} at 115200 baud"
    os.write(ours, b"\x00\x11\xff\n")
    assert ends.receive(10) == b"\x00\x11\xff\n"
    assert ends.send(b"\r\n") == 2
    assert os.read(ours, 10) == b"\r\n"
    ends.close()
    os.close(ours)
    os.close(theirs)


@pytest.mark.parametrize("what", ["/nowhere/tty", "/dev/null", "/dev/null,7", "/dev/tty,12"])
def test_no_serial_line(what: str) -> None:
    with pytest.raises(DeviceNotReady):
        open_serial(what)


@pytest.mark.parametrize("serial", [{}, {"2": "pty"}, {"1": "/nowhere/tty"}])
def test_a_line_that_is_not_given_is_a_status(serial: dict[str, str]) -> None:
    session = live_session(Door(), Sockets(None, serial))
    attach = ('ATTACH (lun, 4) "SERIAL:1"', "TYPE /I0, IOSTAT(lun)", 'ATTACH (lun, 4) "TCP"', "TYPE /I0, IOSTAT(lun)")
    load(session, *attach)
    result = session.execute("main")
    session.close()
    assert result.typed == (str(DeviceNotReady.code),) * 2
