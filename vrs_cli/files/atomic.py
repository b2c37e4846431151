"""Write files so that each has one writer at a time, and no reader sees a half-written file.

A writer of `day.vrst` holds `.day.vrst.lock` beside it, also while it replaces or removes the file. The lock is a
separate file, because on Windows nobody could read a locked file. The system frees a lock when its owner ends in any
way, so a lock file that is left behind can be taken.

A file is written under a temporary name beside the target, synced, and renamed. Temporary files left by a killed writer
are removed by the next writer.
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

WINDOWS = os.name == "nt"  # on Windows an open file cannot be removed or replaced, and a lock shuts readers out
LOCK_WAIT_S, LOCK_PAUSE_S = 0.2, 0.01  # [s] maximum wait for a lock, and pause between two attempts
OWNER = 1  # byte at which a lock file names its owner; the first byte is locked
NO_LOCKS = frozenset({errno.ENOLCK, errno.ENOSYS, errno.ENOTSUP, errno.EOPNOTSUPP})
SHUT_FOLDER = frozenset({errno.EACCES, errno.EPERM, errno.EROFS})


class HeldLock(AbstractContextManager["HeldLock"]):
    """A lock that is held until `release`. `firm`: the lock excludes all other writers. On a disk that has no locks, or
    in a folder that cannot be written, there is no handle and the lock is not firm."""

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
            with suppress(OSError):  # removed before the lock is free, so that nobody can take a removed file
                self._path.unlink()
                there = False
        os.close(handle)
        if WINDOWS and there:
            with suppress(OSError):  # another writer may already have the lock
                self._path.unlink()

    def __exit__(self, *_error: object) -> None:
        self.release()


def hold(path: Path) -> HeldLock:
    """Lock the file with that name, whether it exists or not. Links are followed, because two names may lead to one
    file. A device or a pipe needs no lock. Raises FileOpened if another writer holds the lock, OSError if the folder
    does not exist."""
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
    """Lock an open file itself, against writers that use another name for it: a hard link, or a folder that cannot be
    written. Return whether that was possible. On Windows this would shut out readers, so only the lock file is used
    there."""
    if WINDOWS:
        return True
    try:
        return _lock_handle(handle)
    except OSError as error:
        if error.errno in NO_LOCKS:
            return True
        raise


def is_at(handle: int, path: Path) -> bool:
    """Return whether a path leads to this open file."""
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
    """Open the lock file, or create it; None if the folder cannot be written."""
    flags = getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_NONBLOCK", 0)
    try:
        return os.open(beside, os.O_RDWR | os.O_CREAT | flags, 0o666)
    except OSError as error:
        if error.errno not in SHUT_FOLDER:
            raise
    try:
        return os.open(beside, os.O_RDONLY | flags)  # the lock file belongs to another user, so it cannot be written
    except FileNotFoundError:
        return None


def _take_lock(beside: Path, handle: int) -> HeldLock | None:
    """Take the lock. Return None if another writer has it, or has removed its file since it was opened. Raises
    OSError."""
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
            with suppress(OSError):  # the lock is valid even if the disk is full and the owner cannot be written
                os.ftruncate(handle, 0)
                os.write(handle, b"\n%d\n" % os.getpid())
            in_vain.pop_all()
            return HeldLock(beside, handle)
    return None


def _lock_handle(handle: int) -> bool:
    from filelock import lock_descriptor  # imported here because most runs write nothing

    return lock_descriptor(handle, blocking=False)


def _owner(beside: Path) -> str:
    """Read the name of a lock's owner from the lock file."""
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
PAUSES = (0.01, 0.03, 0.1, 0.3, None)  # [s] waits until a reader or virus scanner closes a file (Windows)
NO_SYNC = frozenset({errno.EINVAL, errno.ENOTSUP})  # devices and pipes cannot be synced


def write_atomically(path: str | Path, text: str, within: Folder = FREE) -> None:
    """Write `text` (UTF-8) to the file completely or not at all. Raises FileError."""
    with atomically(path, within) as stream:
        stream.write(text.encode("utf-8"))


@contextmanager
def atomically(path: str | Path, within: Folder = FREE) -> Iterator[BinaryIO]:
    """Yield a stream whose bytes replace the file if the block ends without an error; otherwise the file stays
    unchanged. A device or a pipe is written directly. For a link, its target is replaced. None of these is allowed if
    `within` is a closed folder. Raises FileError."""
    target = Path(path)
    with writing(target), closing(create_beside(target, within=within)) as beside:
        yield beside.stream
        beside.commit()


class NewFile:
    """A new file `name` beside `target`, which it replaces on `commit`; the target is locked until `close`. Without a
    name the stream writes to the target directly, and `commit` replaces nothing."""

    def __init__(
        self, target: Path, name: str | None, stream: BinaryIO, held: HeldLock | None, within: Folder = FREE
    ) -> None:
        self.target, self.name, self.stream = target, name, stream
        self._held, self._within = held, within

    def commit(self) -> None:
        """Sync the stream and move the file to the target's name; the stream then continues at its end."""
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
    """Create an empty, hidden file in the folder of the target (for a link: the folder of the link's target), and lock
    the target. `held`: a lock that the caller keeps longer. Raises OSError, FileOpened if another writer has the
    target."""
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
        with within.parent(target) as parent:  # at first, only the owner may read the new file
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
    """Wait until the written bytes are on the disk. Raises OSError."""
    stream.flush()
    sync_handle(stream.fileno())


def sync_handle(handle: int) -> None:
    """Wait until the written bytes are on the disk. Raises OSError."""
    if (
        sys.platform == "darwin"
    ):  # on macOS fsync leaves data in the cache of the drive; F_FULLFSYNC writes it (fsync(2))
        import fcntl  # Windows has no fcntl

        with suppress(OSError):  # the disk does not support this operation
            fcntl.fcntl(handle, fcntl.F_FULLFSYNC)
            return
    try:
        os.fsync(handle)
    except OSError as error:
        if error.errno not in NO_SYNC:
            raise


def check_writable(path: str | Path) -> None:
    """Raise FileError now if the file could not be written later. No file is left behind."""
    target = Path(path)
    with writing(target):
        if not is_special(target):
            create_beside(target).close()
        elif not os.access(target, os.W_OK):
            raise PermissionError(errno.EACCES, os.strerror(errno.EACCES))


@contextmanager
def writing(path: Path, hint: str = "") -> Iterator[None]:
    """Convert an OSError to a FileError that names the file. If no hint is given, the error gets its default hint."""
    try:
        yield
    except BrokenPipeError:
        raise  # the reader of this output has ended, which is not an error of the file
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
    """Return the permissions of the replaced file, or those of a new file."""
    try:
        return stat.S_IMODE(target.stat().st_mode)
    except OSError:
        umask = os.umask(0)
        os.umask(umask)
        return NEW_FILE_MODE & ~umask


def sync_folder(folder: Path) -> None:
    """Sync a folder, so that a new file name survives a power failure. Systems that cannot open a folder do this
    themselves. Raises OSError."""
    try:
        handle = os.open(folder, os.O_RDONLY)
    except OSError:
        return
    try:
        sync_handle(handle)
    finally:
        os.close(handle)
