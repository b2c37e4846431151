"""Open files without blocking, and only files inside the folder of a session if this folder is closed. (Opening a pipe
normally blocks until its other end is open, and reading a device may never end.) A name is checked when the user gives
it. On all systems but Windows (which lacks `dir_fd` and O_NOFOLLOW), the file is checked again when it is opened, in
case a link or a pipe has replaced it meanwhile.
"""

from __future__ import annotations

import errno
import os
import stat
import time
from codecs import BOM_UTF8
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from io import BufferedReader, RawIOBase
from typing import TYPE_CHECKING, Any, BinaryIO, TypeVar

from msgspec import Struct

from vrs_cli.errors import FileError, FileOutside, NonexistentFile

if TYPE_CHECKING:
    from pathlib import Path

FIRST = 4096  # [bytes] maximum size of the first read from a pipe
READ_AT_ONCE = 1 << 16  # [bytes] size of the buffer of an open file
PIPE_WAIT_S, PIPE_PAUSE_S = 2.0, 0.02  # [s] maximum wait for the other end of a pipe, and pause between attempts
V = TypeVar("V")


def unreadable(path: str | Path, error: OSError) -> FileError:
    """Return the error for a file that cannot be opened or read because of `error`."""
    hint = "check its permissions" if isinstance(error, PermissionError) else "name a regular file"
    return FileError(f"{path} cannot be read: {reason(error)}", hint)


def reason(error: OSError) -> str:
    """Return the system's message of an error, beginning in lower case, for use inside a sentence."""
    text = error.strerror or str(error)
    return text[:1].lower() + text[1:]


def stamp(path: str | Path) -> tuple[int, ...]:
    """Return a tuple that differs after every change of the file; an empty tuple if there is no file."""
    try:
        there = os.stat(path)
    except OSError:
        return ()
    return there.st_ino, there.st_size, there.st_mtime_ns, there.st_ctime_ns


def text_of(content: bytes) -> str:
    """Decode bytes as UTF-8, or as Latin-1 if they are not valid UTF-8."""
    try:
        return content.removeprefix(BOM_UTF8).decode("utf-8")  # loads no further codec, as "utf-8-sig" would
    except UnicodeDecodeError:
        return content.decode("latin-1")


def text_at(path: str, most: int = -1) -> str:
    """Read a UTF-8 text file of at most `most` bytes (-1: any size). Raises NonexistentFile if it is missing, too large
    or unreadable.
    """
    try:
        with open_to_read(path) as stream:
            content = stream.read(most + 1 if most >= 0 else -1)
        if 0 <= most < len(content):
            raise NonexistentFile(f"{path} cannot be read: more than {most} bytes")
        return content.removeprefix(BOM_UTF8).decode("utf-8")
    except (OSError, UnicodeDecodeError) as error:
        why = error.strerror if isinstance(error, OSError) and error.strerror else "it is no text"
        raise NonexistentFile(f"{path} cannot be read: {why}") from None


def open_to_read(path: str | Path) -> BinaryIO:
    """Open a file, or a pipe that has a writer, for reading. Raises OSError; refuses devices."""
    it = os.stat(path)
    if stat.S_ISFIFO(it.st_mode):
        return BufferedReader(_Pipe(path))
    device = stat.S_ISCHR(it.st_mode) or stat.S_ISBLK(it.st_mode)
    if device and it.st_rdev != os.stat(os.devnull).st_rdev:  # the null device is allowed: it reads as an empty file
        with open(path, "rb", buffering=0) as stream:
            if not stream.isatty():
                raise OSError(errno.EINVAL, "it is a device")
    return open(path, "rb", buffering=READ_AT_ONCE)


def open_to_write(path: Path) -> BinaryIO:
    """Open a device, or a pipe that has a reader, for writing. Raises OSError."""
    if not stat.S_ISFIFO(path.stat().st_mode):
        return path.open("wb")
    handle = _wait_for(lambda: _written_into(path), "nobody reads from this pipe")
    os.set_blocking(handle, True)
    return os.fdopen(handle, "wb")


def _wait_for(act: Callable[[], V | None], why_not: str) -> V:
    """Call `act` repeatedly until it returns a value other than None, and return this value. After PIPE_WAIT_S raise an
    OSError with the message `why_not`.
    """
    ends = time.monotonic() + PIPE_WAIT_S
    while (made := act()) is None:
        if time.monotonic() > ends:
            raise OSError(errno.ENXIO, why_not)
        time.sleep(PIPE_PAUSE_S)
    return made


class _Pipe(RawIOBase):
    """A pipe opened for reading. Only reading shows whether the pipe has a writer, so the constructor reads the first
    bytes and keeps them.
    """

    def __init__(self, path: str | Path) -> None:
        self._handle = os.open(path, os.O_RDONLY | os.O_NONBLOCK)
        try:
            self._first = _wait_for(self._first_bytes, "nobody writes into this pipe")
        except BaseException:
            self.close()
            raise
        os.set_blocking(self._handle, True)

    def _first_bytes(self) -> bytes | None:
        """Read and return the first bytes; return b"" if the writer has not written yet, and None if there is no
        writer.
        """
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


def neighbours(path: str | Path) -> list[str]:
    """Return the names in the folder that contains `path`; an empty list if the folder cannot be read."""
    try:
        return os.listdir(parent_of(path))
    except OSError:
        return []


def parent_of(path: str | Path) -> str:
    """Return the folder that contains `path`; "." for a name without a folder."""
    return os.path.dirname(path) or "."


def without_dots(path: str | Path) -> str:
    """Return a path without `.` and empty parts, as pathlib writes it."""
    drive, rest = os.path.splitdrive(os.fspath(path).replace(os.altsep or os.sep, os.sep))
    parts = [part for part in rest.split(os.sep) if part not in ("", ".")]
    return drive + os.sep * rest.startswith(os.sep) + os.sep.join(parts) or "."


def _path(*parts: str | Path) -> Path:
    from pathlib import Path  # imported here because most short runs name no files

    return Path(*parts)


# --- folders ---------------------------------------------------------------------------------------------------------


AUXILIARY = (".lock", ".part")  # suffixes of the hidden files that exist while a file is being written
# maximum lengths of a name and of a path; systems allow 255 and 4096, but vrs makes longer temporary names
MAX_NAME_BYTES, MAX_PATH_BYTES = 240, 4000
ONLY_INSIDE = "programs have the files of the folder they run in, and those below it"
GOOD = "data/log.txt is good everywhere"
NOFOLLOW = getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0)
FOLDER = os.O_RDONLY | getattr(os, "O_DIRECTORY", 0)
PINNED = os.open in os.supports_dir_fd and hasattr(os, "O_NOFOLLOW")
# names that mean devices on Windows (with any extension), and characters that its names cannot have: Windows
# documentation, "Naming Files, Paths, and Namespaces"
DEVICES = frozenset({"con", "prn", "aux", "nul", "conin$", "conout$"}) | {
    f"{port}{number}" for port in ("com", "lpt") for number in "123456789¹²³"
}
SPECIAL = frozenset('<>:"|?*\\/')


class Folder(Struct, frozen=True):
    """The folder `root`, to which file names are relative. `closed`: files outside the folder cannot be used, nor
    links, devices and pipes inside it. `disclosed`: users may know the path of a closed folder, so that names of files
    in it may be absolute.
    """

    root: str | Path = "."
    closed: bool = False
    disclosed: bool = False

    @property
    def at(self) -> Path:
        """Return the path of the folder."""
        return _path(self.root)

    def path(self, name: str, *, pattern: bool = False) -> Path:
        """Return the path for a file name that a user has typed. `pattern`: whether the name may end in a pattern such
        as *.v2. Raises FileError, FileOutside.
        """
        if self.closed:
            return self.inside(name, pattern=pattern)
        path = _path(self.root, os.path.expanduser(name))
        check_length(path)
        return path

    def inside(self, name: str, *, pattern: bool = False) -> Path:
        """Return the path for a file name in a program, which cannot lead out of the folder. Raises FileOutside."""
        if self.disclosed and _path(name.strip()).is_relative_to(here := os.path.abspath(self.root)):
            name = _path(name.strip()).relative_to(here).as_posix()
        parts = [part for part in name.strip().split("/") if part not in ("", ".")]
        if not parts:
            raise FileOutside(repr(name), "give a name: data/log.txt")
        *above, last = parts
        for part in (*above, last.translate(WILD) if pattern else last):
            if part != ".." and (wrong := wrong_name(part)):
                raise FileOutside(repr(name), f"{wrong}: {GOOD}")
        if os.path.isabs(name.strip()):
            raise self.outside(name)
        path = self._without_links(name, parts) if self.closed else self._inside_root(name)
        if last.startswith(".") and last.endswith(AUXILIARY):
            raise FileOutside(name, "it belongs to a file that is being written")
        return path

    def _inside_root(self, name: str) -> Path:
        folder = _path(os.path.realpath(self.root))
        path = folder / name.strip()
        check_length(path)
        path = _path(os.path.realpath(path))
        if folder not in path.parents:
            raise self.outside(name)
        return path

    def _without_links(self, name: str, parts: list[str]) -> Path:
        if ".." in parts:
            raise self.outside(name)
        path = self.at
        for part in parts:
            path /= part
            check_length(path)
            if what := _strange(path):
                raise FileOutside(name, f"{path} is {what}")
        return path

    def outside(self, name: str) -> FileOutside:
        """Return the error for a name that leads out of the folder."""
        return FileOutside(name, f"{ONLY_INSIDE}; folder= names another" if self.disclosed else ONLY_INSIDE)

    # --- open files ---

    def open_to_read(self, path: str | Path) -> BinaryIO:
        """Open a file for reading. Raises OSError, FileOutside."""
        if not (self.closed and PINNED):
            return open_to_read(path)
        path = _path(path)
        with self.parent(path) as parent:
            try:
                handle = os.open(path.name, os.O_RDONLY | NOFOLLOW, dir_fd=parent)
            except OSError as error:
                raise self._refusal(path) or error from None
        if not stat.S_ISREG(os.fstat(handle).st_mode):
            os.close(handle)
            raise self._refusal(path) or FileOutside(str(path), "it is no file")
        return os.fdopen(handle, "rb")

    @contextmanager
    def parent(self, path: Path) -> Iterator[int | None]:
        """Open the folder that contains a file, and yield its handle: names relative to the handle stay valid if
        folders are renamed or replaced meanwhile. Yield None if this folder is not closed, or if the system does not
        support this. Raises OSError, FileOutside.
        """
        if not (self.closed and PINNED):
            yield None
            return
        handle = os.open(self.root, FOLDER)
        try:
            for part in path.relative_to(self.root).parts[:-1]:
                try:
                    inner = os.open(part, FOLDER | NOFOLLOW, dir_fd=handle)
                except OSError as error:
                    raise self._refusal(path) or error from None
                os.close(handle)
                handle = inner
            yield handle
        finally:
            os.close(handle)

    def check(self, path: Path) -> None:
        """Check that a path in a closed folder contains no link, device or pipe. Raises FileOutside."""
        if self.closed and (refused := self._refusal(path)):
            raise refused

    def check_open(self, path: Path, handle: int) -> None:
        """Check that an open file is the file at `path`, and not a file to which a link led. Raises FileOutside."""
        with self.parent(path) as parent:
            if parent is None:
                return
            try:
                there = os.stat(path.name, dir_fd=parent, follow_symlinks=False)
            except OSError:
                there = None
        if there is None or not os.path.samestat(there, os.fstat(handle)):
            raise FileOutside(str(path), "its folder is another one now")

    def _refusal(self, path: Path) -> FileOutside | None:
        """Return the error if a part of a path is now a link, a device or a pipe; else None."""
        for place in (path, *path.parents):
            if place != self.at and self.at in place.parents and (what := _strange(place)):
                return FileOutside(str(path), f"{place} is {what}")
        return None


FREE = Folder()
WILD = {ord(character): "_" for character in "*?[]"}


def _strange(path: Path) -> str:
    """Return a word for what is at a path if it is neither a file nor a folder (a link, a device or a
    pipe); else "".
    """
    try:
        mode = path.lstat().st_mode
    except OSError:
        return ""
    if stat.S_ISLNK(mode) or getattr(path, "is_junction", bool)():
        return "a link"
    return "" if stat.S_ISREG(mode) or stat.S_ISDIR(mode) else "a device or a pipe"


def check_length(path: str | Path) -> None:
    """Check that a path is short enough for every system. Raises FileError."""
    text = str(path)
    if "\0" in text:
        raise FileError(repr(text), "a name cannot hold the character 0")
    if max(map(_size, text.split(os.sep))) > MAX_NAME_BYTES or _size(text) > MAX_PATH_BYTES:
        raise FileError(
            f"{text[:20]}... is too long", f"a name has at most {MAX_NAME_BYTES} bytes, a path {MAX_PATH_BYTES}"
        )


def _size(text: str) -> int:
    return len(text.encode("utf-8", "surrogateescape"))


def wrong_name(name: str) -> str:
    """Return the reason why some system does not allow a file name; "" if every system allows it."""
    stem = name.partition(".")[0].rstrip(" ").lower()
    if stem in DEVICES:
        return f"{stem.upper()} is a device on Windows"
    strange = sorted(SPECIAL & set(name))
    if strange:
        return f"no {strange[0]} can be in the name of a file on Windows"
    if not name.isprintable():
        return "a control character can be in no name"
    if name != name.rstrip(". "):
        return "no name of a file ends in a dot or a blank on Windows"
    return ""
