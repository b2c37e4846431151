"""The address of the page. It is listened at before viser is loaded, which takes half a second: a browser that comes
waits at the door meanwhile.
"""

from __future__ import annotations

import os
import secrets
import socket
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

from vrs_cli.errors import UsageError

HOST = "127.0.0.1"
LOOPBACK = ("localhost", "127.0.0.1", "::1")
BYTES = 18  # of chance in a secret


class Door(NamedTuple):
    """`secret`: the first part of the path of the address; `kept`: a page of before knows it."""

    listening: socket.socket
    secret: str
    kept: bool
    address: str


def opened(host: str = HOST, port: int = 0, secret: str = "") -> Door:
    """Listen at an address of this machine, with a new secret where it is empty. Raises UsageError where the address is
    taken, or is one that others reach.
    """
    if host not in LOOPBACK:
        raise UsageError(
            f"--host {host}: the page is for this machine alone, as whoever opens it may drive the robot",
            "others watch with vrs serve and vrs view ws://HOST, or over ssh -L",
        )
    try:
        listening = socket.create_server((host, port), family=socket.AF_INET6 if ":" in host else socket.AF_INET)
    except OSError as error:
        raise UsageError(f"{host}:{port}: {(error.strerror or str(error)).lower()}", "name another --port") from None
    known = secret or secrets.token_urlsafe(BYTES)
    shown = f"[{host}]" if ":" in host else host
    return Door(listening, known, bool(secret), f"http://{shown}:{listening.getsockname()[1]}/{known}/")


def kept_secret(file: Path) -> str:
    """The secret of a file that its owner alone may read, made where there is none; another one each time where that
    cannot be.
    """
    with suppress(OSError):
        file.parent.mkdir(parents=True, exist_ok=True, mode=0o700)
        with suppress(FileExistsError), open(os.open(file, os.O_CREAT | os.O_EXCL | os.O_WRONLY, 0o600), "w") as made:
            made.write(secrets.token_urlsafe(BYTES))
        return file.read_text().strip()
    return ""
