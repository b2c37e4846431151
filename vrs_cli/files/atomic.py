"""Write files so that each has one writer at a time, and no reader sees a half-written file.

A writer of `day.vrst` holds a lock on `.day.vrst.lock` in the same folder, also while it replaces or removes the file.
The lock is on a separate file, because on Windows nobody can read a locked file. The system releases the lock when its
owner ends for any reason, so another process can take a lock file that was left behind.

A file is written under a temporary name in the target's folder, synced, and renamed to the target. The next writer
removes temporary files that a killed writer left.
"""

from __future__ import annotations

import errno
import os
import re
import stat
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, ExitStack, closing, contextmanager, suppress
from pathlib import Path
from typing import BinaryIO

from vrs_cli.errors import FileError, FileOpened
from vrs_cli.files.opening import FREE, NOFOLLOW, Folder, open_to_write, reason, wrong_name

WINDOWS = os.name == "nt"  # on Windows an open file cannot be removed or replaced, and a locked file cannot be read
LOCK_WAIT_S, LOCK_PAUSE_S = 0.2, 0.01  # [s] maximum wait for a lock, and pause between two attempts
OWNER = 1  # position in a lock file of its owner's process number; byte 0 is the byte that is locked
NO_LOCKS = frozenset({errno.ENOLCK, errno.ENOSYS, errno.ENOTSUP, errno.EOPNOTSUPP})
SHUT_FOLDER = frozenset({errno.EACCES, errno.EPERM, errno.EROFS})


class HeldLock(AbstractContextManager["HeldLock"]):
    """A lock on a file, held until `release`. `firm`: whether the lock excludes all other writers. On a disk without
    locks, or in a folder that cannot be written, the lock does not exclude them, and there is no file handle.
    """

    def __init__(self, path: Path, handle: int | None) -> None:
        self.firm = handle is not None
        self._path, self._handle = path, handle

    def release(self) -> None:
        """Release the lock. A second call has no effect."""
        handle, self._handle = self._handle, None
        if handle is None:
            return
        there = is_at(handle, self._path)
        if there:
            # remove the file before its lock is released, so that nobody can lock a removed file
            with suppress(OSError):
                self._path.unlink()
                there = False
        os.close(handle)
        if WINDOWS and there:
            with suppress(OSError):  # on Windows remove it afterwards, unless another writer already has it open
                self._path.unlink()

    def __exit__(self, *_error: object) -> None:
        self.release()


def hold(path: Path) -> HeldLock:
    """Lock the file at `path`, which need not exist. Links are followed, because two names may lead to the same file. A
    device or a pipe is not locked. Raises FileOpened if another writer holds the lock, OSError if the folder does not
    exist.
    """
    real = Path(os.path.realpath(path))
    if is_special(real):
        return HeldLock(real, None)
    beside, deadline = real.with_name(f".{real.name}.lock"), time.monotonic() + LOCK_WAIT_S
    while True:
        handle = _open_lock(beside)
        held = HeldLock(beside, None) if handle is None else _take_lock(beside, handle)
        if held is not None:
            return held
        if time.monotonic() > deadline:
            raise FileOpened(f"{path} is being written by {_owner(beside)}", "end that one, or name another file")
        time.sleep(LOCK_PAUSE_S)


def claim(handle: int) -> bool:
    """Lock an open file itself, to exclude writers that do not use the same lock file: writers that open the file by a
    hard link, or from a folder in which no lock file can be created. Return False if another writer has locked the
    file. On Windows nothing is locked, because this would exclude readers.
    """
    if WINDOWS:
        return True
    try:
        return _lock_handle(handle)
    except OSError as error:
        if error.errno in NO_LOCKS:
            return True
        raise


def is_at(handle: int, path: Path) -> bool:
    """Return whether a path leads to the file that is open as `handle`."""
    try:
        return os.path.samestat(os.fstat(handle), path.stat())
    except OSError:
        return False


def is_special(path: Path) -> bool:
    """Return whether the path is a device, a pipe or a socket, none of which can be replaced."""
    try:
        mode = path.stat().st_mode
    except OSError:
        return False
    return not (stat.S_ISREG(mode) or stat.S_ISDIR(mode))


def _open_lock(beside: Path) -> int | None:
    """Open or create the lock file, and return its handle; None if the folder cannot be written."""
    flags = getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_NONBLOCK", 0)
    try:
        return os.open(beside, os.O_RDWR | os.O_CREAT | flags, 0o666)
    except OSError as error:
        if error.errno not in SHUT_FOLDER:
            raise
    try:
        # the lock file may belong to another user; it can be locked without writing it
        return os.open(beside, os.O_RDONLY | flags)
    except FileNotFoundError:
        return None


def _take_lock(beside: Path, handle: int) -> HeldLock | None:
    """Lock the open lock file. Return None if another writer has locked it, or has removed it since it was opened.
    Raises OSError.
    """
    with ExitStack() as in_vain:
        in_vain.callback(os.close, handle)
        try:
            locked = _lock_handle(handle)
        except OSError as error:
            if error.errno not in NO_LOCKS:
                raise
            beside.unlink(missing_ok=True)
            return HeldLock(beside, None)
        if locked and is_at(handle, beside):
            with suppress(OSError):  # if the disk is full the owner's number is missing, but the lock is valid
                os.ftruncate(handle, 0)
                os.write(handle, b"\n%d\n" % os.getpid())
            in_vain.pop_all()
            return HeldLock(beside, handle)
    return None


def _lock_handle(handle: int) -> bool:
    from filelock import lock_descriptor  # imported here because most runs write nothing

    return lock_descriptor(handle, blocking=False)


def _owner(beside: Path) -> str:
    """Read the owner's process number from a lock file, and return words for a message, such as "another vrs (process
    42)".
    """
    try:
        with beside.open("rb", buffering=0) as stream:
            stream.seek(OWNER)
            number = int(stream.read(32))
    except (OSError, ValueError):
        return "another vrs"
    return "this vrs" if number == os.getpid() else f"another vrs (process {number})"


# --- files written beside and renamed --------------------------------------------------------------------------------


CREATE = os.O_RDWR | os.O_CREAT | os.O_EXCL | NOFOLLOW
NEW_FILE_MODE = 0o666  # permissions of a new file, before the user's umask is applied
# [s] on Windows, waits before a rename is tried again, because a reader or virus scanner has the file open; None: give
# up
PAUSES = (0.01, 0.03, 0.1, 0.3, None)
# errors of sync that are ignored, because devices and pipes cannot be synced
NO_SYNC = frozenset({errno.EINVAL, errno.ENOTSUP})


def write_atomically(path: str | Path, text: str, within: Folder = FREE) -> None:
    """Write `text` in UTF-8 to a file, completely or not at all. `within`: the folder in which the file must be. Raises
    FileError.
    """
    with atomically(path, within) as stream:
        stream.write(text.encode("utf-8"))


@contextmanager
def atomically(path: str | Path, within: Folder = FREE) -> Iterator[BinaryIO]:
    """Yield a stream; its bytes replace the file if the block ends without an error, otherwise the file stays
    unchanged. A device or a pipe is written directly; if the path is a link, the link's target is replaced. Devices,
    pipes and links are refused if `within` is a closed folder. Raises FileError.
    """
    target = Path(path)
    with as_file_error(target), closing(create_beside(target, within=within)) as beside:
        yield beside.stream
        beside.commit()


class NewFile:
    """A new file called `name`, in the folder of `target`. `commit` replaces the target by the new file; the target is
    locked until `close`. If `name` is None, the stream writes to the target directly (a device or pipe), and `commit`
    only syncs.
    """

    def __init__(
        self, target: Path, name: str | None, stream: BinaryIO, held: HeldLock | None, within: Folder = FREE
    ) -> None:
        self.target, self.name, self.stream = target, name, stream
        self._held, self._within = held, within

    def commit(self) -> None:
        """Sync the stream and rename the file to the target; further writing continues at the end of the file."""
        sync(self.stream)
        if self.name is None:
            return
        self.stream.close()  # Windows cannot rename an open file
        os.chmod(self.name, _mode_for(self.target))
        _replace(self.name, self.target)
        self.name = None
        sync_folder(self.target.parent)
        self.stream = self.target.open("ab")
        self._within.check_open(self.target, self.stream.fileno())

    def close(self) -> None:
        """Close the stream, remove the file if it was not committed, and release the lock."""
        with suppress(OSError):
            self.stream.close()
        if self.name is not None:
            with suppress(OSError):
                os.unlink(self.name)
        if self._held is not None:
            self._held.release()


def create_beside(target: Path, held: HeldLock | None = None, within: Folder = FREE) -> NewFile:
    """Create an empty, hidden file in the folder of the target (links are followed), and lock the target. `held`: a
    lock of the target that the caller has and keeps. Raises OSError, and FileOpened if another writer has locked the
    target.
    """
    within.check(target)
    if is_special(target):
        return NewFile(target, None, open_to_write(target), None)
    if target.is_dir():
        raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR))
    if WINDOWS and (wrong := wrong_name(target.name)):
        raise OSError(errno.EINVAL, wrong)
    with ExitStack() as failed:
        lock = failed.enter_context(hold(target)) if held is None else held
        target = target if within.closed else Path(os.path.realpath(target))
        if lock.firm:
            # Remove files left beside a target by earlier writers; the caller holds the target's lock
            ours = re.compile(rf"\.{re.escape(target.name)}\.[a-z0-9_]{{8}}\.part")
            with suppress(OSError), os.scandir(target.parent) as entries:
                for entry in entries:
                    if ours.fullmatch(entry.name) and entry.is_file(follow_symlinks=False):
                        with suppress(OSError):
                            os.unlink(entry.path)
        new = target.with_name(f".{target.name}.{os.urandom(4).hex()}.part")
        with within.parent(target) as parent:  # only the owner may read the new file until `commit`
            handle = os.open(new if parent is None else new.name, CREATE, 0o600, dir_fd=parent)
        beside = NewFile(target, str(new), os.fdopen(handle, "wb"), lock if held is None else None, within)
        failed.pop_all()
    try:
        within.check_open(new, handle)
    except BaseException:
        beside.close()
        raise
    return beside


def _replace(name: str, target: Path) -> None:
    for pause in PAUSES:
        try:
            os.replace(name, target)
            return
        except PermissionError:
            if not WINDOWS or pause is None:
                raise
            time.sleep(pause)


def sync(stream: BinaryIO) -> None:
    """Wait until all written bytes are on the disk. Raises OSError."""
    stream.flush()
    sync_handle(stream.fileno())


def sync_handle(handle: int) -> None:
    """Wait until all written bytes are on the disk. Raises OSError."""
    if (
        sys.platform == "darwin"
    ):  # on macOS fsync may leave data in the cache of the drive; F_FULLFSYNC writes it to the disk (man fsync)
        import fcntl  # imported here because Windows has no fcntl

        with suppress(OSError):  # if the disk does not support this operation, use fsync below
            fcntl.fcntl(handle, fcntl.F_FULLFSYNC)
            return
    try:
        os.fsync(handle)
    except OSError as error:
        if error.errno not in NO_SYNC:
            raise


def check_writable(path: str | Path) -> None:
    """Check that a file can be written later, without changing it. Raises FileError."""
    target = Path(path)
    with as_file_error(target):
        if not is_special(target):
            create_beside(target).close()
        elif not os.access(target, os.W_OK):
            raise PermissionError(errno.EACCES, os.strerror(errno.EACCES))


@contextmanager
def as_file_error(path: Path, hint: str = "") -> Iterator[None]:
    """Convert an OSError in the block to a FileError that names the file. `hint`: replaces the usual hint."""
    try:
        yield
    except BrokenPipeError:
        raise  # the program that reads the output has ended, which is not an error of the file
    except OSError as error:
        raise FileError(f"{path} cannot be written: {reason(error)}", hint or _hint(path)) from error


def _hint(path: Path) -> str:
    checks: tuple[tuple[Callable[[Path], bool], str], ...] = (
        (Path.is_dir, "it is a folder: name a file in it"),
        (lambda place: not place.parent.exists(), f"there is no folder {path.parent}"),
        (lambda place: not place.parent.is_dir(), f"{path.parent} is a file, not a folder"),
    )
    for check, hint in checks:
        with suppress(OSError):
            if check(path):
                return hint
    return "name another place"


def _mode_for(target: Path) -> int:
    """Return the permissions for a file that replaces `target`: the permissions of the target if it exists,
    otherwise the usual permissions of a new file.
    """
    try:
        return stat.S_IMODE(target.stat().st_mode)
    except OSError:
        umask = os.umask(0)
        os.umask(umask)
        return NEW_FILE_MODE & ~umask


def sync_folder(folder: Path) -> None:
    """Sync a folder, so that a new name in it survives a power failure. Systems that cannot open a folder (Windows)
    need no sync. Raises OSError.
    """
    try:
        handle = os.open(folder, os.O_RDONLY)
    except OSError:
        return
    try:
        sync_handle(handle)
    finally:
        os.close(handle)
