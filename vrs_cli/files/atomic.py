"""Writing files so that a reader never meets half of one: written beside, synced, renamed into place.

A file has one writer at a time (`files.lock`). So what is beside it when a writer begins was left by one that was
killed, and is cleared away.
"""

from __future__ import annotations

import errno
import os
import re
import stat
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from typing import BinaryIO

from vrs_cli.errors import FileError
from vrs_cli.files.bounds import FREE, NOFOLLOW, Folder, wrong_name
from vrs_cli.files.lock import WINDOWS, HeldLock, hold, is_special
from vrs_cli.files.opening import open_to_write, reason

CREATE = os.O_RDWR | os.O_CREAT | os.O_EXCL | NOFOLLOW
NEW_FILE_MODE = 0o666  # before the user's umask
PAUSES = (0.01, 0.03, 0.1, 0.3, None)  # [s] on Windows a reader, or a scanner of viruses, has a file for a moment
NO_SYNC = frozenset({errno.EINVAL, errno.ENOTSUP})  # a device or a pipe holds nothing back


def write_atomically(path: str | Path, text: str, within: Folder = FREE) -> None:
    """Put `text` (UTF-8) in the file, whole or not at all. Raises FileError."""
    with atomically(path, within) as stream:
        stream.write(text.encode("utf-8"))


@contextmanager
def atomically(path: str | Path, within: Folder = FREE) -> Iterator[BinaryIO]:
    """A stream whose bytes become the file when the block ends well, and nothing when it does not.

    A device or a pipe is written directly; a link keeps pointing where it does; `within` a closed folder there are
    none. Raises FileError.
    """
    target = Path(path)
    with writing(target):
        beside = create_beside(target, within=within)
        try:
            yield beside.stream
            beside.commit()
        finally:
            beside.close()


class NewFile:
    """A new file `name` beside `target`, to take its place with `commit`; the target is locked until `close`.

    Without a name the stream is that of the target itself: there is nothing, or nothing more, to replace.
    """

    def __init__(
        self, target: Path, name: str | None, stream: BinaryIO, held: HeldLock | None, within: Folder = FREE
    ) -> None:
        self.target, self.name, self.stream = target, name, stream
        self._held, self._within = held, within

    def commit(self) -> None:
        """Sync the stream and put the file in the target's place; the stream is at its end then, for more."""
        sync(self.stream)
        if self.name is None:
            return
        self.stream.close()  # an open file cannot be renamed on Windows
        os.chmod(self.name, _mode_for(self.target))
        _replace(self.name, self.target)
        self.name = None
        sync_folder(self.target.parent)
        self.stream = self.target.open("ab")
        self._within.check_open(self.target, self.stream.fileno())

    def close(self) -> None:
        """Close the stream, and remove the file if it has not taken its place; others may write the target."""
        with suppress(OSError):
            self.stream.close()
        if self.name is not None:
            with suppress(OSError):
                os.unlink(self.name)
        if self._held is not None:
            self._held.release()


def create_beside(target: Path, held: HeldLock | None = None, within: Folder = FREE) -> NewFile:
    """An open, empty, hidden file in the folder of the target (of what a link points at), which is locked; `held`: by
    the caller, for longer.

    Raises OSError, FileOpened where somebody else writes the target.
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
            _clear_left(target)
        new = target.with_name(f".{target.name}.{os.urandom(4).hex()}.part")
        with within.parent(target) as parent:  # at first it is readable by its owner alone
            handle = os.open(new if parent is None else new.name, CREATE, 0o600, dir_fd=parent)
        beside = NewFile(target, str(new), os.fdopen(handle, "wb"), lock if held is None else None, within)
        failed.pop_all()
    try:
        within.check_open(new, handle)
    except BaseException:
        beside.close()
        raise
    return beside


def _clear_left(target: Path) -> None:
    """Remove the files beside a target whose writers are gone: we have its lock."""
    ours = re.compile(rf"\.{re.escape(target.name)}\.[a-z0-9_]{{8}}\.part")
    with suppress(OSError), os.scandir(target.parent) as entries:
        for entry in entries:
            if ours.fullmatch(entry.name) and entry.is_file(follow_symlinks=False):
                with suppress(OSError):
                    os.unlink(entry.path)


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
    """Wait until what was written is on the disk. Raises OSError."""
    stream.flush()
    sync_handle(stream.fileno())


def sync_handle(handle: int) -> None:
    """Wait until what was written is on the disk. Raises OSError."""
    if (
        sys.platform == "darwin"
    ):  # there fsync leaves data in the cache of the drive, and F_FULLFSYNC does not (fsync(2))
        import fcntl  # Windows has none

        with suppress(OSError):  # a disk that cannot
            fcntl.fcntl(handle, fcntl.F_FULLFSYNC)
            return
    try:
        os.fsync(handle)
    except OSError as error:
        if error.errno not in NO_SYNC:
            raise


def check_writable(path: str | Path) -> None:
    """Raise FileError now if the file could not be written later; nothing is left behind."""
    target = Path(path)
    with writing(target):
        if not is_special(target):
            create_beside(target).close()
        elif not os.access(target, os.W_OK):
            raise PermissionError(errno.EACCES, os.strerror(errno.EACCES))


@contextmanager
def writing(path: Path, hint: str = "") -> Iterator[None]:
    """Turns an OSError into a FileError that names the file, with a hint of its own where none is given."""
    try:
        yield
    except BrokenPipeError:
        raise  # whoever read us has gone: no error of the file
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
    """The permissions of the file that is replaced, or those that a new file gets."""
    try:
        return stat.S_IMODE(target.stat().st_mode)
    except OSError:
        umask = os.umask(0)
        os.umask(umask)
        return NEW_FILE_MODE & ~umask


def sync_folder(folder: Path) -> None:
    """A new name survives a power cut. Systems that cannot open a folder see to it by themselves. Raises OSError."""
    try:
        handle = os.open(folder, os.O_RDONLY)
    except OSError:
        return
    try:
        sync_handle(handle)
    finally:
        os.close(handle)
