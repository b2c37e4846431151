"""The files of a folder: FDIRECTORY, FDELETE, FCOPY, FRENAME. What is overwritten is decided before."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from fnmatch import fnmatchcase
from pathlib import Path

from vrs_cli.dialogue.replies import FileRow
from vrs_cli.errors import FileError, NonexistentFile
from vrs_cli.files.atomic import atomically
from vrs_cli.files.lock import hold
from vrs_cli.files.opening import open_to_read, reason, unreadable
from vrs_cli.language.text.diagnostics import did_you_mean


def entries(asked: Path) -> tuple[FileRow, ...]:
    """What is in a folder, folders first; of a path that is none, what its last part matches (`*.v2`).

    Hidden files are left out. Raises NonexistentFile, FileError.
    """
    folder, pattern = (asked, "*") if asked.is_dir() else (asked.parent, asked.name)
    if not folder.is_dir():
        raise NonexistentFile(str(folder), "name a folder, or files as *.v2")
    try:
        shown = [entry for entry in folder.iterdir() if not entry.name.startswith(".")]
        rows = [FileRow(entry.name, None if entry.is_dir() else entry.lstat().st_size) for entry in shown]
    except OSError as error:
        raise unreadable(folder, error) from error
    found = [row for row in rows if fnmatchcase(row.name.lower(), pattern.lower())]
    if not found and not set(pattern) & set("*?["):
        raise NonexistentFile(str(asked), _near(asked))
    return tuple(sorted(found, key=lambda row: (row.size is not None, row.name)))


def existing(path: Path) -> Path:
    """The path of a file that is there. Raises NonexistentFile, FileError for a folder."""
    if path.is_dir():
        raise FileError(f"{path} is a folder", "name a file")
    if not os.path.lexists(path):
        raise NonexistentFile(str(path), _near(path))
    return path


def target(old: Path, new: Path) -> Path:
    """Where a copy of a file goes: with the extension of the old one where none is given. Raises FileError."""
    named = new if new.suffix or new.is_dir() else new.with_name(new.name + old.suffix)
    place = named / old.name if named.is_dir() else named
    if place.exists() and place.samefile(old):
        raise FileError(f"{old} and {place} are one file", "give the new one another name")
    return place


def delete(path: Path) -> None:
    """Raises FileError."""
    with _telling(f"{path} cannot be deleted"), hold(path):
        path.unlink()


def rename(old: Path, new: Path) -> None:
    """In the place of a file of that name, if there is one. Raises FileError."""
    with _telling(f"{old} cannot be renamed to {new}"), hold(old), hold(new):
        os.replace(old, new)


def copy(old: Path, new: Path) -> None:
    """Whole or not at all. Raises FileError."""
    import shutil

    try:
        source = open_to_read(old)
    except OSError as error:
        raise unreadable(old, error) from error
    with source, atomically(new) as stream:
        shutil.copyfileobj(source, stream)


@contextmanager
def _telling(what: str) -> Iterator[None]:
    try:
        yield
    except OSError as error:
        raise FileError(f"{what}: {reason(error)}", "check the folder and its permissions") from error


def _near(path: Path) -> str:
    folder = path.parent
    return did_you_mean(path.name, (entry.name for entry in folder.iterdir())) if folder.is_dir() else ""
