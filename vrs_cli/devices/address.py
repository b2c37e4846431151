"""Where a unit of TCP is opened: the text of FOPEN, as public V+ programs have it.

/LOCAL_PORT 11000 /CLIENTS 5 /BUFFER_SIZE 1024      wait for clients
192.168.0.7 /REMOTE_PORT 3000                       connect to another program
"""

from __future__ import annotations

import re
from collections.abc import Mapping

from msgspec import Struct

from vrs_cli.errors import IllegalValue

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
        """What its unit is called in a recording."""
        return f"TCP:{self.host}:{self.port}" if self.host else f"TCP:{self.port}"


def read_address(how: str) -> Address:
    """Raises IllegalValue."""
    numbers: dict[str, int] = {}
    host = ""
    for piece in re.finditer(PIECE, how, re.IGNORECASE):
        if piece["host"]:
            if host:
                raise IllegalValue(f"FOPEN {how!r}", FORM)
            host = piece["host"]
        else:
            key = piece["key"].upper()
            numbers[key] = _number(key, piece["number"])
    port = numbers.get("REMOTE_PORT" if host else "LOCAL_PORT")
    if port is None or (not host and "REMOTE_PORT" in numbers):
        raise IllegalValue(f"FOPEN {how!r}", FORM)
    return Address(host, port, numbers.get("CLIENTS", 1), numbers.get("BUFFER_SIZE", LONGEST))


def _number(key: str, digits: str) -> int:
    if key not in RANGES:
        raise IllegalValue(f"FOPEN /{key}", f"there are /{', /'.join(RANGES)}")
    low, high = RANGES[key]
    if not digits or not low <= int(digits[:9]) <= high:
        raise IllegalValue(f"FOPEN /{key} {digits}".rstrip(), f"a number from {low} to {high}")
    return int(digits)
