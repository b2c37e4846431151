"""A file that grows at its end, and belongs to one writer: what is added is there as a whole or not at all, and what
others do to the file is seen."""

from __future__ import annotations

import os
from contextlib import suppress
from pathlib import Path
from threading import Lock

from vrs_cli.errors import FileOpened
from vrs_cli.files.atomic import sync_handle
from vrs_cli.files.lock import claim, is_special
from vrs_cli.files.opening import reason

ADDING = os.O_RDWR | os.O_APPEND | getattr(os, "O_BINARY", 0)


class GrowingFile:
    """A file that is there; `size`: the bytes that it is to have. A device or a pipe takes what it gets, and keeps
    nothing.

    Every method raises OSError, the constructor FileOpened where somebody else adds to the file under another name.
    """

    def __init__(self, path: Path) -> None:
        self.path, self._handle = path, os.open(path, ADDING)
        self.size = os.fstat(self._handle).st_size
        self._special = is_special(path)
        self._torn = False  # a line that failed could not be taken away
        self._reading = Lock()
        if not self._special and not claim(self._handle):
            self.close()
            raise FileOpened(f"{path} is being written by another vrs", "end that one, or name another file")

    def changed(self) -> str:
        """Say what others have done to the file; "" for nothing."""
        if self._special:
            return ""
        try:
            there, here = os.stat(self.path), os.fstat(self._handle)
        except FileNotFoundError:
            return "is gone"
        except OSError as error:
            return f"cannot be found: {reason(error)}"
        if not os.path.samestat(there, here):
            return "is another file now"
        if self._torn:
            return "has a torn line that could not be taken away"
        if here.st_size != self.size:
            return "has been cut short" if here.st_size < self.size else "has been written by others"
        if not os.access(self.path, os.R_OK | os.W_OK):
            return "can no longer be read and written"
        return ""

    def add(self, data: bytes, *, durable: bool) -> None:
        """All of the data or, where that fails or Ctrl-C comes between, none of it. `durable`: it is on the disk."""
        try:
            rest = memoryview(data)
            while rest:
                rest = rest[os.write(self._handle, rest) :]  # a system may take less than it is given
            if durable:
                self.sync()
            if not self._special:
                self.size += len(data)
        except BaseException:
            with suppress(OSError):
                self.cut(self.size)
            raise

    def read(self, place: int, size: int) -> bytes:
        """Read `size` bytes from a place on, fewer at the end. Any thread may call it."""
        with self._reading:
            os.lseek(self._handle, place, os.SEEK_SET)  # what is added goes to the end all the same
            return os.read(self._handle, size)

    def sync(self) -> None:
        """All that was added is on the disk."""
        sync_handle(self._handle)

    def cut(self, size: int) -> None:
        """Leave the first `size` bytes, on the disk too."""
        if self._special:
            return
        self._torn = True
        os.ftruncate(self._handle, size)
        sync_handle(self._handle)
        self.size, self._torn = size, False

    def close(self) -> None:
        """Closing twice is closing once."""
        handle, self._handle = self._handle, -1
        if handle >= 0:
            os.close(handle)
