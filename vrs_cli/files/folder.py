"""The files of a folder: FDIRECTORY, FDELETE, FCOPY, FRENAME. What is overwritten is decided before."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from fnmatch import fnmatchcase
from pathlib import Path

from vrs_cli.errors import FileError, NonexistentFile
from vrs_cli.files.atomic import atomically, hold
from vrs_cli.files.bounds import FREE, Folder
from vrs_cli.files.opening import neighbours, reason, unreadable
from vrs_cli.values.diagnostics import did_you_mean
from vrs_cli.values.replies import FileRow


def entries(asked: Path, within: Folder = FREE) -> tuple[FileRow, ...]:
    """List a folder, folders first; for another path, what its last part matches (`*.v2`).

    Hidden files are left out. Raises NonexistentFile, FileError.
    """
    folder, pattern = (asked, "*") if asked.is_dir() else (asked.parent, asked.name)
    if not folder.is_dir():
        raise NonexistentFile(str(folder), "name a folder, or files as *.v2")
    try:
        with within.parent(folder / pattern) as there, os.scandir(folder if there is None else there) as all_of_them:
            rows = [
                FileRow(one.name, None if one.is_dir() else one.stat(follow_symlinks=False).st_size)
                for one in all_of_them
                if not one.name.startswith(".")
            ]
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
    """The path of a copy: it has the extension of the old file where none is given. Raises FileError."""
    named = new if new.suffix or new.is_dir() else new.with_name(new.name + old.suffix)
    place = named / old.name if named.is_dir() else named
    if place.exists() and place.samefile(old):
        raise FileError(f"{old} and {place} are one file", "give the new one another name")
    return place


def delete(path: Path, within: Folder = FREE) -> None:
    """Raises FileError."""
    with _telling(f"{path} cannot be deleted"), hold(path), within.parent(path) as there:
        os.unlink(_in(there, path), dir_fd=there)


def rename(old: Path, new: Path, within: Folder = FREE) -> None:
    """Rename a file; it replaces one of that name. Raises FileError."""
    within.check(new)
    folders = within.parent(old), within.parent(new)
    with _telling(f"{old} cannot be renamed to {new}"), hold(old), hold(new), folders[0] as here, folders[1] as there:
        os.replace(_in(here, old), _in(there, new), src_dir_fd=here, dst_dir_fd=there)


def _in(folder: int | None, path: Path) -> str | Path:
    """The name of a file relative to an open folder; its path where none is open."""
    return path if folder is None else path.name


def copy(old: Path, new: Path, within: Folder = FREE) -> None:
    """Copy a file, whole or not at all. Raises FileError."""
    import shutil

    try:
        source = within.open_to_read(old)
    except OSError as error:
        raise unreadable(old, error) from error
    with source, atomically(new, within) as stream:
        shutil.copyfileobj(source, stream)


@contextmanager
def _telling(what: str) -> Iterator[None]:
    try:
        yield
    except OSError as error:
        raise FileError(f"{what}: {reason(error)}", "check the folder and its permissions") from error


def _near(path: Path) -> str:
    return did_you_mean(path.name, neighbours(path))
