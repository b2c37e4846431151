"""One writer a file: who writes, replaces or removes `day.vrst` holds `.day.vrst.lock` beside it meanwhile.

The lock is beside the file and not on it, because on Windows nobody else could read a file that is locked. The system
frees a lock when its owner ends, however that is: a lock file that is left behind is free for the next one.
"""

from __future__ import annotations

import errno
import os
import stat
import time
from contextlib import AbstractContextManager, ExitStack, suppress
from pathlib import Path

from vrs_cli.errors import FileOpened

WINDOWS = os.name == "nt"  # an open file cannot be removed or replaced there, and a lock shuts readers out
PATIENCE, PAUSE = 0.2, 0.01  # [s] others hold a lock for a moment only, or for long
OWNER = 1  # where a lock file names its owner: the first byte is the one that is locked
NO_LOCKS = frozenset({errno.ENOLCK, errno.ENOSYS, errno.ENOTSUP, errno.EOPNOTSUPP})
SHUT_FOLDER = frozenset({errno.EACCES, errno.EPERM, errno.EROFS})


class HeldLock(AbstractContextManager["HeldLock"]):
    """A lock that is held until `release`. `firm`: nobody else has it; that cannot be said of a disk without locks,
    or of a folder that cannot be written, where there is no handle."""

    def __init__(self, path: Path, handle: int | None) -> None:
        self.firm = handle is not None
        self._path, self._handle = path, handle

    def release(self) -> None:
        """Others may write. Releasing twice is releasing once."""
        handle, self._handle = self._handle, None
        if handle is None:
            return
        there = is_at(handle, self._path)
        if there:
            with suppress(OSError):  # first: what is gone can be taken by nobody
                self._path.unlink()
                there = False
        os.close(handle)
        if WINDOWS and there:
            with suppress(OSError):  # another one may have it already
                self._path.unlink()

    def __exit__(self, *_error: object) -> None:
        self.release()


def hold(path: Path) -> HeldLock:
    """Lock the file of that name, whether it is there or not; a link is followed, since two names are one file. A
    device or a pipe is everybody's.

    Raises FileOpened where somebody else holds it, OSError where the folder is not there.
    """
    real = Path(os.path.realpath(path))
    if is_special(real):
        return HeldLock(real, None)
    beside, deadline = real.with_name(f".{real.name}.lock"), time.monotonic() + PATIENCE
    while True:
        handle = _opened(beside)
        held = HeldLock(beside, None) if handle is None else _taken(beside, handle)
        if held is not None:
            return held
        if time.monotonic() > deadline:
            raise FileOpened(f"{path} is being written by {_owner(beside)}", "end that one, or name another file")
        time.sleep(PAUSE)


def claim(handle: int) -> bool:
    """Lock an open file itself, against those who reach it by another name: a hard link, a folder that cannot be
    written. False where somebody else has. Where it would shut readers out, the lock beside has to do."""
    if WINDOWS:
        return True
    try:
        return _locked(handle)
    except OSError as error:
        if error.errno in NO_LOCKS:
            return True
        raise


def is_at(handle: int, path: Path) -> bool:
    """Whether a path leads to an open file."""
    try:
        return os.path.samestat(os.fstat(handle), path.stat())
    except OSError:
        return False


def is_special(path: Path) -> bool:
    """Whether the path is a device, a pipe or a socket: there is nothing to rename over."""
    try:
        mode = path.stat().st_mode
    except OSError:
        return False
    return not (stat.S_ISREG(mode) or stat.S_ISDIR(mode))


def _opened(beside: Path) -> int | None:
    """The lock file, made if need be; None where the folder cannot be written."""
    flags = getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_NONBLOCK", 0)
    try:
        return os.open(beside, os.O_RDWR | os.O_CREAT | flags, 0o666)
    except OSError as error:
        if error.errno not in SHUT_FOLDER:
            raise
    try:
        return os.open(beside, os.O_RDONLY | flags)  # it is another user's
    except FileNotFoundError:
        return None


def _taken(beside: Path, handle: int) -> HeldLock | None:
    """The lock; None where somebody else has it, or has removed its file since it was opened. Raises OSError."""
    with ExitStack() as in_vain:
        in_vain.callback(os.close, handle)
        try:
            locked = _locked(handle)
        except OSError as error:
            if error.errno not in NO_LOCKS:
                raise
            beside.unlink(missing_ok=True)
            return HeldLock(beside, None)
        if locked and is_at(handle, beside):
            with suppress(OSError):  # a full disk: the lock holds all the same
                os.ftruncate(handle, 0)
                os.write(handle, b"\n%d\n" % os.getpid())
            in_vain.pop_all()
            return HeldLock(beside, handle)
    return None


def _locked(handle: int) -> bool:
    from filelock import lock_descriptor  # late: most runs write nothing

    return lock_descriptor(handle, blocking=False)


def _owner(beside: Path) -> str:
    """Read from a lock file who holds the lock."""
    try:
        with beside.open("rb", buffering=0) as stream:
            stream.seek(OWNER)
            number = int(stream.read(32))
    except (OSError, ValueError):
        return "another vrs"
    return "this vrs" if number == os.getpid() else f"another vrs (process {number})"
