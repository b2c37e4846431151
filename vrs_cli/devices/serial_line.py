"""A serial line: a device of the system with its speed, or a pseudo-terminal that another program opens by its name."""

from __future__ import annotations

import os
import sys
from typing import Any

from vrs_cli.errors import DeviceNotReady

PSEUDO = "pty"
USUAL_SPEED = 9600


class FileEnd:
    """The end of a line that is open as a file."""

    def __init__(self, handle: int) -> None:
        self._handle = handle
        os.set_blocking(handle, False)

    def fileno(self) -> int:
        return self._handle

    def receive(self, size: int) -> bytes:
        return os.read(self._handle, size)

    def send(self, data: bytes) -> int:
        return os.write(self._handle, data)

    def close(self) -> None:
        os.close(self._handle)


class PseudoEnd(FileEnd):
    """Of a pseudo-terminal called `name`. It lasts until `leave`: who has opened it stays, whatever programs do. The
    other end is held open, so that others may come and go there.
    """

    def __init__(self) -> None:
        """Raises OSError, termios.error."""
        import tty

        ours, self._theirs = os.openpty()
        tty.setraw(self._theirs)
        self.name = os.ttyname(self._theirs)
        super().__init__(ours)

    def close(self) -> None:
        """It stays open."""

    def unread(self) -> int:
        """Bytes that nobody at the other end has read yet."""
        import fcntl
        import termios

        return int.from_bytes(fcntl.ioctl(self._theirs, termios.FIONREAD, bytes(4)), sys.byteorder)

    def leave(self) -> None:
        """What is unread is lost then."""
        super().close()
        os.close(self._theirs)


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
        if what != PSEUDO:
            return _device(what, termios, tty)
        end = PseudoEnd()
        return end, end.name
    except (OSError, termios.error) as error:
        raise DeviceNotReady(f"{what}: {error.args[-1]}", "name a serial device, or pty") from None


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
