"""The devices outside that units attach to: they open and send on request, and deliver what arrives.

What arrives does so at an instant of the robot's clock, before all that programs do at that instant. So programs that
are given the same arrivals at the same times do the same: a recording holds no more, and a script stands for peers.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping
from enum import Enum
from math import inf

from msgspec import Struct

from vrs_cli.engine.clock import RobotClock
from vrs_cli.errors import DeviceNotReady, IllegalValue

TCP, SERIAL = "TCP", "SERIAL:"
LONGEST = 1024  # bytes of a line where BUFFER_SIZE says nothing
MOST_CLIENTS = 64
RANGES: Mapping[str, tuple[int, int]] = {
    "LOCAL_PORT": (0, 65535),
    "REMOTE_PORT": (1, 65535),
    "CLIENTS": (1, MOST_CLIENTS),
    "BUFFER_SIZE": (1, 32768),
}
FORM = '"/LOCAL_PORT 11000 /CLIENTS 1" waits for clients, "127.0.0.1 /REMOTE_PORT 3000" connects'
PIECE = r"/(?P<key>[A-Z_]+)[\s=]*(?P<number>\d*)|(?P<host>[^\s/]+)"


class Address(Struct, frozen=True):
    """`host`: that of the other program, "" where clients are waited for. `longest` [bytes]: of a line."""

    host: str
    port: int
    clients: int = 1
    longest: int = LONGEST

    @property
    def name(self) -> str:
        """The name of its unit in a recording."""
        return f"TCP:{self.host}:{self.port}" if self.host else f"TCP:{self.port}"


def read_address(how: str) -> Address:
    """The address at which a unit of TCP is opened, from the text of FOPEN in public V+ programs. Raises IllegalValue.

    /LOCAL_PORT 11000 /CLIENTS 5 /BUFFER_SIZE 1024      wait for clients
    192.168.0.7 /REMOTE_PORT 3000                       connect to another program
    """
    numbers: dict[str, int] = {}
    host = ""
    for piece in re.finditer(PIECE, how, re.IGNORECASE):
        if piece["host"]:
            if host:
                raise IllegalValue(f"FOPEN {how!r}", FORM)
            host = piece["host"]
        else:
            key, digits = piece["key"].upper(), piece["number"]
            if key not in RANGES:
                raise IllegalValue(f"FOPEN /{key}", f"there are /{', /'.join(RANGES)}")
            low, high = RANGES[key]
            if not digits or not low <= int(digits[:9]) <= high:
                raise IllegalValue(f"FOPEN /{key} {digits}".rstrip(), f"a number from {low} to {high}")
            numbers[key] = int(digits)
    port = numbers.get("REMOTE_PORT" if host else "LOCAL_PORT")
    if port is None or (not host and "REMOTE_PORT" in numbers):
        raise IllegalValue(f"FOPEN {how!r}", FORM)
    return Address(host, port, numbers.get("CLIENTS", 1), numbers.get("BUFFER_SIZE", LONGEST))


class DeviceEvent(Enum):
    """Events that happen on a device without a request."""

    OPENED = "opened"  # a connection
    REFUSED = "refused"  # one that was asked for: the code says why
    CAME = "data"
    PAUSED = "pause"  # what came last has no end of line, and nothing has followed
    ENDED = "closed"  # no more comes; what is sent may arrive
    GONE = "gone"  # nothing that is sent arrives any more
    WRITTEN = "written"  # all that was sent has left


class Arrival(Struct, frozen=True):
    """`device`: the name by which it was opened; `handle`: of the connection, 0 where there is only one."""

    device: str
    event: DeviceEvent
    handle: int = 0
    data: bytes = b""
    code: int = 0


class Outside:
    """The devices that units may be attached to: sockets, serial lines, or what stands for them. This base class has
    none; `hint` says how to get some.

    `live`: what arrives comes from others, in real time. `patience` [s] of the robot's clock: how long a unit waits.
    `wake` is called, in any thread, when something has come; `tell` is called with messages for whoever runs programs.
    """

    live = False

    def __init__(self, hint: str = "", patience: float = inf) -> None:
        self.hint, self.patience = hint, patience
        self.wake: Callable[[], None] = lambda: None
        self.tell: Callable[[str], None] = lambda _text: None

    def check(self, device: str) -> None:
        """Check whether a unit may be attached to it. Raises DeviceNotReady."""
        check_known(device)
        raise DeviceNotReady(f"the device {device}", self.hint)

    def open(self, device: str, address: Address | None) -> None:  # noqa: ARG002
        """Open it, or begin to: a connection that is asked for is OPENED or REFUSED later. Without an address it is a
        serial line. Raises DeviceNotReady, PortTaken.
        """
        self.check(device)

    def send(self, device: str, handle: int, data: bytes, *, ask: bool = False) -> None:
        """Send bytes to a connection. `ask`: WRITTEN arrives when all that was sent there has left."""

    def consumed(self, device: str, handle: int, count: int) -> None:
        """Tell that `count` bytes were read: as many more may come."""

    def release(self, device: str, handle: int) -> None:
        """Close a connection; a later one may get the same handle."""

    def close(self, device: str) -> None:
        """Close it with all its connections; its port is free then."""

    def close_all(self) -> None: ...
    def due(self, clock: RobotClock) -> float:  # noqa: ARG002
        """The time at which the next arrivals are to be taken [s]; infinity where none are known."""
        return inf

    def take(self, now: float) -> Iterable[Arrival]:  # noqa: ARG002
        """Return what has arrived up to `now`, in its order."""
        return ()


def check_known(device: str) -> None:
    """Raises DeviceNotReady for a name that no device has."""
    if device != TCP and not (device.startswith(SERIAL) and device[len(SERIAL) :].isdigit()):
        raise DeviceNotReady(f"the device {device}", f"there are DISK, {TCP} and {SERIAL}1")
