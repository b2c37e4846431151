"""Files opened without hanging: to open a pipe waits for its other end, perhaps for ever; a device may never end."""

from __future__ import annotations

import errno
import os
import stat
import time
from collections.abc import Callable
from io import BufferedReader, RawIOBase
from pathlib import Path
from typing import Any, BinaryIO, TypeVar

from vrs_cli.errors import FileError, NonexistentFile

FIRST = 4096  # bytes
PATIENCE, PAUSE = 2.0, 0.02  # [s] for the other end of a pipe, which may just be starting
V = TypeVar("V")


def unreadable(path: Path, error: OSError) -> FileError:
    """The refusal of a file that cannot be opened or read."""
    hint = "check its permissions" if isinstance(error, PermissionError) else "name a regular file"
    return FileError(f"{path} cannot be read: {reason(error)}", hint)


def reason(error: OSError) -> str:
    """The system's reason in lower case, as the middle of a sentence."""
    text = error.strerror or str(error)
    return text[:1].lower() + text[1:]


def stamp(path: Path) -> tuple[int, ...]:
    """Another one whenever a file has changed; empty where there is none."""
    try:
        there = os.stat(path)
    except OSError:
        return ()
    return there.st_ino, there.st_size, there.st_mtime_ns, there.st_ctime_ns


def text_of(content: bytes) -> str:
    """UTF-8, or a character a byte where it is not that."""
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError:
        return content.decode("latin-1")


def text_at(path: str, most: int = -1) -> str:
    """The text of a file, which is UTF-8; `most`: bytes that may be in it, -1: any number. Raises NonexistentFile."""
    try:
        with open_to_read(Path(path)) as stream:
            content = stream.read(most + 1 if most >= 0 else -1)
        if 0 <= most < len(content):
            raise NonexistentFile(f"{path} cannot be read: more than {most} bytes")
        return content.decode("utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        why = error.strerror if isinstance(error, OSError) and error.strerror else "it is no text"
        raise NonexistentFile(f"{path} cannot be read: {why}") from None


def open_to_read(path: Path) -> BinaryIO:
    """The bytes of a file, or of a pipe that somebody writes. Raises OSError."""
    it = path.stat()
    if stat.S_ISFIFO(it.st_mode):
        return BufferedReader(_Pipe(path))
    device = stat.S_ISCHR(it.st_mode) or stat.S_ISBLK(it.st_mode)
    if device and it.st_rdev != os.stat(os.devnull).st_rdev:  # which is empty
        with path.open("rb", buffering=0) as stream:
            if not stream.isatty():
                raise OSError(errno.EINVAL, "it is a device")
    return path.open("rb")


def open_to_write(path: Path) -> BinaryIO:
    """A device, or a pipe that somebody reads. Raises OSError."""
    if not stat.S_ISFIFO(path.stat().st_mode):
        return path.open("wb")
    handle = _waited(lambda: _written_into(path), "nobody reads from this pipe")
    os.set_blocking(handle, True)
    return os.fdopen(handle, "wb")


def _waited(act: Callable[[], V | None], why_not: str) -> V:
    """Call `act` until it returns a value, for a while. Raises OSError."""
    ends = time.monotonic() + PATIENCE
    while (made := act()) is None:
        if time.monotonic() > ends:
            raise OSError(errno.ENXIO, why_not)
        time.sleep(PAUSE)
    return made


class _Pipe(RawIOBase):
    """A pipe that is read. To know whether somebody writes it, one has to read: its first bytes are kept."""

    def __init__(self, path: Path) -> None:
        self._handle = os.open(path, os.O_RDONLY | os.O_NONBLOCK)
        try:
            self._first = _waited(self._begun, "nobody writes into this pipe")
        except BaseException:
            self.close()
            raise
        os.set_blocking(self._handle, True)

    def _begun(self) -> bytes | None:
        """The first bytes, none yet where the writer takes its time; None where there is no writer."""
        try:
            return os.read(self._handle, FIRST) or None
        except BlockingIOError:
            return b""

    def readable(self) -> bool:
        return True

    def fileno(self) -> int:
        return self._handle

    def readinto(self, buffer: Any, /) -> int:
        view = memoryview(buffer)
        piece = self._first or os.read(self._handle, len(view))
        piece, self._first = piece[: len(view)], piece[len(view) :]
        view[: len(piece)] = piece
        return len(piece)

    def close(self) -> None:
        if not self.closed:
            os.close(self._handle)
        super().close()


def _written_into(path: Path) -> int | None:
    try:
        return os.open(path, os.O_WRONLY | os.O_NONBLOCK)
    except OSError as error:
        if error.errno == errno.ENXIO:
            return None
        raise


def neighbours(path: Path) -> list[str]:
    """The names in its folder; none where that cannot be read."""
    try:
        return os.listdir(path.parent)
    except OSError:
        return []
