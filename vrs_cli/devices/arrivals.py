"""Define what connects a device with programs outside: the address of a TCP unit, and the events that arrive from a
device."""

from __future__ import annotations

import re
from collections.abc import Mapping
from enum import Enum

from msgspec import Struct

from vrs_cli.errors import IllegalValue

MAX_LINE_BYTES = 1024  # maximum length of a line [bytes], unless BUFFER_SIZE is given
RANGES: Mapping[str, tuple[int, int]] = {  # minimum and maximum of each number in the string given to FOPEN
    "LOCAL_PORT": (0, 65535),
    "REMOTE_PORT": (1, 65535),
    "CLIENTS": (1, 64),
    "BUFFER_SIZE": (1, 32768),
}
FORM = '"/LOCAL_PORT 11000 /CLIENTS 1" waits for clients, "127.0.0.1 /REMOTE_PORT 3000" connects'
PIECE = r"/(?P<key>[A-Z_]+)[\s=]*(?P<number>\d*)|(?P<host>[^\s/]+)"


class Address(Struct, frozen=True):
    """The address of a TCP unit. `host`: the machine of the other program; "" to wait for clients. `clients`: the
    maximum number of clients. `longest`: the maximum length of a line [bytes]."""

    host: str
    port: int
    clients: int = 1
    longest: int = MAX_LINE_BYTES

    @property
    def name(self) -> str:
        """Return the name of the device in a recording."""
        return f"TCP:{self.host}:{self.port}" if self.host else f"TCP:{self.port}"


def read_address(how: str) -> Address:
    """Return the address in the string given to FOPEN, in the form that public V+ programs use. Raises IllegalValue.

    /LOCAL_PORT 11000 /CLIENTS 5 /BUFFER_SIZE 1024 waits for clients; 192.168.0.7 /REMOTE_PORT 3000 connects to another
    program.
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
    return Address(host, port, numbers.get("CLIENTS", 1), numbers.get("BUFFER_SIZE", MAX_LINE_BYTES))


class DeviceEvent(Enum):
    """The events that a device reports."""

    OPENED = "opened"  # a connection was opened
    REFUSED = "refused"  # a requested connection was refused; `code` of the arrival gives the reason
    CAME = "data"  # bytes have arrived
    PAUSED = "pause"  # the last bytes have no line end, and no more bytes have arrived for a while
    ENDED = "closed"  # the peer sends no more bytes; it may still receive
    GONE = "gone"  # sent bytes no longer reach the peer
    WRITTEN = "written"  # all bytes were handed to the operating system


class Arrival(Struct, frozen=True):
    """An event on a device. `device`: the name with which it was opened. `handle`: the number of the connection; 0 if
    the device has only one connection. `data`: the bytes that arrived. `code`: the error code of a refusal.
    """

    device: str
    event: DeviceEvent
    handle: int = 0
    data: bytes = b""
    code: int = 0
