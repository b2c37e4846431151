"""Keep what shells have in memory and in no file in a folder while they run: a shell that is killed leaves its file.

A shell that has something to keep holds a lock beside its file, which the system frees when it ends, however that is.
So files whose lock is free were left by shells that did not end by themselves. The others are left alone.
"""

from __future__ import annotations

import os
import time
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from datetime import datetime
from pathlib import Path
from secrets import token_hex
from typing import NamedTuple

from vrs_cli.errors import FileError
from vrs_cli.files.atomic import HeldLock, hold, write_atomically

EXTENSION = ".v2"
KEPT, DECLINED = "unstored-", "declined-"
MONTH = 30 * 86_400.0  # [s] so long a file stays that nobody wanted
PRIVATE = 0o700  # folders of the user's own state (XDG Base Directory Specification)


class Recovery:
    """The file of one shell, made when there is something to write. Nothing raises: without a place there is no file.

    One thread writes, since a disk may take its time to say that it has all; of what comes meanwhile it takes the last.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._writer = ThreadPoolExecutor(max_workers=1, thread_name_prefix="recovery")
        self._text: str | None = None
        self._path: Path | None = None
        self._held: HeldLock | None = None

    def write(self, text: str) -> None:
        """Keep this in place of what was kept."""
        self._text = text
        self._writer.submit(self._write)

    def remove(self) -> None:
        """Remove the file: there is nothing to keep any more."""
        self._text = None
        self._writer.submit(self._remove).result()

    def wait(self) -> None:
        """Wait until all is written."""
        self._writer.submit(lambda: None).result()

    # --- in the thread ---

    def _write(self) -> None:
        text, self._text = self._text, None
        if text is not None:
            with suppress(OSError, FileError):
                write_atomically(self._path or self._begin(), text)

    def _begin(self) -> Path:
        self._folder.mkdir(mode=PRIVATE, parents=True, exist_ok=True)
        path = self._folder / f"{KEPT}{os.getpid()}-{token_hex(4)}{EXTENSION}"
        self._held, self._path = hold(_mark(path)), path
        return path

    def _remove(self) -> None:
        if self._path is not None:
            with suppress(OSError):
                self._path.unlink(missing_ok=True)
        if self._held is not None:
            self._held.release()
        self._path = self._held = None


class Left(NamedTuple):
    """A file that a shell has left, locked for us until `remove` or `decline`."""

    path: Path
    written: datetime
    text: str
    held: HeldLock

    def remove(self) -> None:
        """Remove the file: it has been taken over."""
        with suppress(OSError):
            self.path.unlink()
        self.held.release()

    def decline(self) -> Path:
        """Nobody is asked about it again; where it lies."""
        place = self.path.with_name(self.path.name.replace(KEPT, DECLINED, 1))
        with suppress(OSError):
            self.path.rename(place)
        self.held.release()
        return place


def files_in(folder: Path) -> list[Path]:
    """The files of shells that run, and of those that have left theirs."""
    return list(folder.glob(f"{KEPT}*{EXTENSION}"))


def left(folder: Path) -> list[Left]:
    """The files that shells have left, the oldest first; those that nobody wanted go in time. What cannot be read is
    passed over."""
    for path in folder.glob(f"{DECLINED}*{EXTENSION}"):
        with suppress(OSError):
            if time.time() - path.stat().st_mtime > MONTH:
                path.unlink()
    found = [one for path in files_in(folder) if (one := _taken(path)) is not None]
    return sorted(found, key=lambda one: one.written)


def _taken(path: Path) -> Left | None:
    """A file with its lock; None where its shell runs."""
    with suppress(OSError, FileError):
        held = hold(_mark(path))
        try:
            if held.firm:
                return Left(path, datetime.fromtimestamp(path.stat().st_mtime), path.read_text(encoding="utf-8"), held)
        except (OSError, UnicodeDecodeError):
            pass
        held.release()
    return None


def _mark(path: Path) -> Path:
    """The path that is locked while the shell runs; the file itself is locked only while it is written."""
    return path.with_suffix(".shell")
