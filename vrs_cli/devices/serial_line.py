"""A serial line: a device of the system with its speed, or a pseudo-terminal that another program opens by its name."""

from __future__ import annotations

import os
from typing import Any

from vrs_cli.errors import DeviceNotReady

PSEUDO = "pty"
USUAL_SPEED = 9600


class FileEnd:
    """`keeps`: what is held open with it."""

    def __init__(self, handle: int, keeps: tuple[int, ...] = ()) -> None:
        self._handle, self._keeps = handle, keeps
        os.set_blocking(handle, False)

    def fileno(self) -> int:
        return self._handle

    def receive(self, size: int) -> bytes:
        return os.read(self._handle, size)

    def send(self, data: bytes) -> int:
        return os.write(self._handle, data)

    def close(self) -> None:
        for handle in (self._handle, *self._keeps):
            os.close(handle)


def open_serial(what: str) -> tuple[FileEnd, str]:
    """A line, and what it is told to be: `pty`, or the path of a device, perhaps with its speed: /dev/ttyUSB0,115200.

    Raises DeviceNotReady.
    """
    try:
        import termios
        import tty
    except ImportError:
        raise DeviceNotReady("a serial line", "this system has none that vrs can open") from None
    try:
        return _pseudo(tty) if what == PSEUDO else _device(what, termios, tty)
    except (OSError, termios.error) as error:
        raise DeviceNotReady(f"{what}: {error.args[-1]}", "name a serial device, or pty") from None


def _pseudo(tty: Any) -> tuple[FileEnd, str]:
    """The other end is held open, so that programs may come and go there."""
    ours, theirs = os.openpty()
    tty.setraw(theirs)
    return FileEnd(ours, (theirs,)), os.ttyname(theirs)


def _device(what: str, termios: Any, tty: Any) -> tuple[FileEnd, str]:
    path, _, speed = what.partition(",")
    code = getattr(termios, f"B{speed or USUAL_SPEED}", None)
    if code is None:
        raise DeviceNotReady(f"{what}: no speed {speed}", "as 9600, 19200, 115200")
    handle = os.open(path, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
    try:
        tty.setraw(handle)
        settings = termios.tcgetattr(handle)
        settings[4] = settings[5] = code
        settings[2] |= termios.CLOCAL | termios.CREAD
        termios.tcsetattr(handle, termios.TCSANOW, settings)
    except BaseException:
        os.close(handle)
        raise
    return FileEnd(handle), f"{path} at {speed or USUAL_SPEED} baud"
