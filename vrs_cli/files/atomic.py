"""Writing files so that a reader never meets half of one: written beside, synced, renamed into place.

A file beside is locked while it is written. One that nobody has locked was left by a writer that was killed: the next
writer of the same file clears it away.
"""

from __future__ import annotations

import errno
import os
import re
import stat
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import BinaryIO, NoReturn

from vrs_cli.errors import FileError

NEW_FILE_MODE = 0o666  # before the user's umask


def write_atomically(path: str | Path, text: str) -> None:
    """Put `text` (UTF-8) in the file, whole or not at all. Raises FileError."""
    with atomically(path) as stream:
        stream.write(text.encode("utf-8"))


@contextmanager
def atomically(path: str | Path) -> Iterator[BinaryIO]:
    """A stream whose bytes become the file when the block ends well, and nothing when it does not.

    A device or a pipe is written directly; a link keeps pointing where it does. Raises FileError.
    """
    target = Path(path)
    with writing(target):
        beside = create_beside(target)
    try:
        with writing(target):
            yield beside.stream
            beside.commit()
            beside.stream.close()
    except BaseException:
        beside.discard()
        raise


class Beside:
    """A new file `name` beside `target`, to take its place with `commit`; the stream stays open after that.

    Without a name the stream is that of the target itself, a device or a pipe: there is nothing to replace.
    """

    def __init__(self, target: Path, name: str | None, stream: BinaryIO) -> None:
        self.target = target
        self.name = name
        self.stream = stream

    def commit(self) -> None:
        """Sync the stream and put the file in the target's place; the stream is still good for appending."""
        sync(self.stream)
        if self.name is None:
            return
        os.chmod(self.name, _mode_for(self.target))
        os.replace(self.name, self.target)
        _sync_folder(self.target.parent)

    def discard(self) -> None:
        """Close the stream and remove the file, if it has not taken its place."""
        with suppress(OSError):
            self.stream.close()
        if self.name is not None:
            with suppress(OSError):
                os.unlink(self.name)


def create_beside(target: Path) -> Beside:
    """An open, empty, hidden file in the folder of the target (of what a link points at), locked where there are locks.

    Raises OSError.
    """
    if _is_special(target):
        return Beside(target, None, target.open("wb"))
    target = Path(os.path.realpath(target))
    if target.is_dir():
        raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR))
    _clear_left(target)
    while True:
        handle, name = tempfile.mkstemp(prefix=f".{target.name}.", suffix=".part", dir=target.parent)
        beside = Beside(target, name, os.fdopen(handle, "wb"))
        if _kept(beside.stream):
            return beside
        beside.discard()


def _kept(stream: BinaryIO) -> bool:
    """Lock a new file; False where somebody had taken it for one that was left."""
    try:
        return _lock(stream) and os.fstat(stream.fileno()).st_nlink > 0
    except OSError:  # no locks here: nobody clears anything
        return True


def _clear_left(target: Path) -> None:
    """Remove the files beside a target whose writers are gone; where that cannot be known they stay."""
    ours = re.compile(rf"\.{re.escape(target.name)}\.[a-z0-9_]{{8}}\.part")  # as mkstemp makes them
    with suppress(OSError), os.scandir(target.parent) as entries:
        for entry in entries:
            if ours.fullmatch(entry.name) and entry.is_file(follow_symlinks=False):
                with suppress(OSError), open(entry.path, "r+b") as stream:
                    if _lock(stream):
                        os.unlink(entry.path)


def sync(stream: BinaryIO) -> None:
    """What was written is on the disk when this returns. Raises OSError."""
    stream.flush()
    try:
        os.fsync(stream.fileno())
    except OSError as error:
        if error.errno != errno.EINVAL:  # a device or a pipe holds nothing back
            raise


def claim(stream: BinaryIO, path: Path) -> None:
    """Nobody else may claim the file until the stream is closed. Raises FileError where somebody has.

    Systems without such locks, and places that have none (devices, some network disks), let everybody write.
    """
    with suppress(OSError):
        if not _lock(stream):
            raise FileError(f"{path} is being written by another vrs", "end that one, or name another file")


def _lock(stream: BinaryIO) -> bool:
    """Lock a file until it is closed; False where somebody else has. Raises OSError where there are no locks."""
    try:
        import fcntl
    except ImportError:
        raise OSError(errno.ENOTSUP, os.strerror(errno.ENOTSUP)) from None
    try:
        fcntl.flock(stream.fileno(), fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    return True


def check_writable(path: str | Path) -> None:
    """Raise FileError now if the file could not be written later; nothing is left behind."""
    target = Path(path)
    with writing(target):
        if not _is_special(target):
            create_beside(target).discard()
        elif not os.access(target, os.W_OK):
            raise PermissionError(errno.EACCES, os.strerror(errno.EACCES))


@contextmanager
def writing(path: Path) -> Iterator[None]:
    """Turns an OSError into a FileError that names the file."""
    try:
        yield
    except BrokenPipeError:
        raise  # whoever read us has gone: no error of the file
    except OSError as error:
        _raise(path, error)


def _raise(path: Path, error: OSError) -> NoReturn:
    raise FileError(f"{path} cannot be written: {reason(error)}", _hint(path)) from error


def reason(error: OSError) -> str:
    """The system's reason in lower case, as the middle of a sentence."""
    text = error.strerror or str(error)
    return text[:1].lower() + text[1:]


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


def _is_special(path: Path) -> bool:
    """Whether the path is a device, a pipe or a socket: there is nothing to rename over."""
    try:
        mode = path.stat().st_mode
    except OSError:
        return False
    return not (stat.S_ISREG(mode) or stat.S_ISDIR(mode))


def _mode_for(target: Path) -> int:
    """The permissions of the file that is replaced, or those that a new file gets."""
    try:
        return stat.S_IMODE(target.stat().st_mode)
    except OSError:
        umask = os.umask(0)
        os.umask(umask)
        return NEW_FILE_MODE & ~umask


def _sync_folder(folder: Path) -> None:
    """So that the new name survives a power cut; systems that cannot sync a folder do it by themselves."""
    with suppress(OSError):
        handle = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(handle)
        finally:
            os.close(handle)
