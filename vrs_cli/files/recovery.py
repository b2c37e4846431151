"""Keep recovery files, which contain programs that exist only in a shell's memory. A shell with unsaved programs writes
a recovery file and holds a lock; the system releases the lock when the shell ends for any reason. So a recovery file
whose lock is free was left by a shell that was killed.
"""

from __future__ import annotations

import os
import time
from contextlib import suppress
from datetime import datetime
from pathlib import Path

from msgspec import Struct

from vrs_cli.errors import FileError
from vrs_cli.files.atomic import HeldLock, hold, write_atomically
from vrs_cli.files.program_file import EXTENSION

KEPT, DECLINED = "unstored-", "declined-"
# [s] time for which a recovery file that the user declined is kept before it is deleted
KEEP_DECLINED_S = 30 * 86_400.0
PRIVATE = 0o700  # permissions of the folder of recovery files (XDG Base Directory Specification)


class Recovery:
    """The recovery file of one shell, created when there is something to write. Its methods raise no errors: if the
    file cannot be created, nothing can be recovered later. A thread writes the file, because syncing may be slow; if
    `write` is called several times meanwhile, the thread then writes only the last version.
    """

    def __init__(self, folder: Path) -> None:
        from concurrent.futures import ThreadPoolExecutor  # imported here because most commands have no recovery file

        self._folder = folder
        self._writer = ThreadPoolExecutor(max_workers=1, thread_name_prefix="recovery")
        self._text: str | None = None
        self._path: Path | None = None
        self._held: HeldLock | None = None

    def write(self, text: str) -> None:
        """Write the programs (`text`) in the thread, in place of the previous version."""
        self._text = text
        self._writer.submit(self._write)

    def remove(self) -> None:
        """Remove the recovery file, and wait until it is removed."""
        self._text = None
        self._writer.submit(self._remove).result()

    def wait(self) -> None:
        """Wait until the thread has written everything."""
        self._writer.submit(lambda: None).result()

    # --- called in the thread ---

    def _write(self) -> None:
        text, self._text = self._text, None
        if text is not None:
            with suppress(OSError, FileError):
                write_atomically(self._path or self._begin(), text)

    def _begin(self) -> Path:
        self._folder.mkdir(mode=PRIVATE, parents=True, exist_ok=True)
        path = self._folder / f"{KEPT}{os.getpid()}-{os.urandom(4).hex()}{EXTENSION}"
        self._held, self._path = hold(_mark(path)), path
        return path

    def _remove(self) -> None:
        if self._path is not None:
            with suppress(OSError):
                self._path.unlink(missing_ok=True)
        if self._held is not None:
            self._held.release()
        self._path = self._held = None


class LeftFile(Struct, frozen=True):
    """A recovery file that a killed shell has left; it is locked until `remove` or `decline` is called."""

    path: Path
    written: datetime
    text: str
    held: HeldLock

    def remove(self) -> None:
        """Delete the file. Call this after its programs have been restored."""
        with suppress(OSError):
            self.path.unlink()
        self.held.release()

    def decline(self) -> Path:
        """Rename the file, so that no shell offers it to the user again. Return its new path."""
        place = self.path.with_name(self.path.name.replace(KEPT, DECLINED, 1))
        with suppress(OSError):
            self.path.rename(place)
        self.held.release()
        return place


def recovery_files(folder: Path) -> list[Path]:
    """Return the paths of all recovery files in a folder, of running and of killed shells."""
    return list(folder.glob(f"{KEPT}*{EXTENSION}"))


def left_files(folder: Path) -> list[LeftFile]:
    """Return the readable recovery files of killed shells, the oldest first, and lock them. Also delete declined files
    older than KEEP_DECLINED_S.
    """
    for path in folder.glob(f"{DECLINED}*{EXTENSION}"):
        with suppress(OSError):
            if time.time() - path.stat().st_mtime > KEEP_DECLINED_S:
                path.unlink()
    found = [one for path in recovery_files(folder) if (one := _lock_left(path)) is not None]
    return sorted(found, key=lambda one: one.written)


def _lock_left(path: Path) -> LeftFile | None:
    """Lock a recovery file and return it; return None if its shell is still running."""
    with suppress(OSError, FileError):
        held = hold(_mark(path))
        try:
            if held.firm:
                return LeftFile(
                    path, datetime.fromtimestamp(path.stat().st_mtime), path.read_text(encoding="utf-8"), held
                )
        except (OSError, UnicodeDecodeError):
            pass
        held.release()
    return None


def _mark(path: Path) -> Path:
    """Return a path, separate from that of the recovery file, whose lock a shell holds while it runs. (The recovery
    file itself is locked only while it is written.)
    """
    return path.with_suffix(".shell")
