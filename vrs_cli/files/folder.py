"""The files of a folder: FDIRECTORY, FDELETE, FCOPY, FRENAME (what is overwritten is decided before); and the working
folder of one run: all that the run writes is in it; what the run reads is copied into it first.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from fnmatch import fnmatchcase
from pathlib import Path

from msgspec import field

from vrs_cli.errors import FileError, FileOutside, NonexistentFile
from vrs_cli.files.atomic import atomically, hold
from vrs_cli.files.opening import FREE, Folder, neighbours, reason, unreadable
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


# --- the working folder of a run -------------------------------------------------------------------------------------


MAX_COPY_BYTES = 100_000_000


class WorkingFolder(Folder, frozen=True, kw_only=True):
    """A closed folder in which the files of `source` seem to be: a file is copied when it is first named. Links,
    devices and pipes are not; `below`: nor are files in folders below `source`, unless it is true.
    """

    source: Path
    closed: bool = True
    below: bool = True
    _named: dict[Path, os.stat_result | None] = field(default_factory=dict)  # and what was copied

    def inside(self, name: str, *, pattern: bool = False) -> Path:
        path = Folder.inside(self, name, pattern=pattern)
        if path not in self._named:
            self._named[path] = None
            self._named[path] = self._copied(path)
        return path

    def _copied(self, path: Path) -> os.stat_result | None:
        """The copy of a file, where there is one that can be read. Raises FileError where it cannot be copied."""
        inner = path.relative_to(self.root)
        if path.exists() or (len(inner.parts) > 1 and not self.below):
            return None
        import shutil

        given = Folder(self.source, closed=True)
        try:
            original = given.inside(inner.as_posix())
            if original.parent.is_dir():
                path.parent.mkdir(parents=True, exist_ok=True)
            with given.open_to_read(original) as stream:
                if (size := os.fstat(stream.fileno()).st_size) > MAX_COPY_BYTES:
                    raise FileError(f"{path.name} has {size} bytes", f"a folder run reads {MAX_COPY_BYTES} at most")
                try:
                    with path.open("xb") as copy:
                        shutil.copyfileobj(stream, copy)
                except OSError as error:
                    raise FileError(
                        f"{path.name}: {error.strerror}", "the folder of the run has no room for a copy"
                    ) from None
                return path.stat()
        except (OSError, FileOutside):  # it is not there, or cannot be read
            return None

    def drop_copies(self) -> None:
        """Remove the copies that the run has not written to."""
        for path, copied in self._named.items():
            if copied is None or not path.is_file():
                continue
            now = path.stat()
            if (now.st_ino, now.st_mtime_ns, now.st_size) == (copied.st_ino, copied.st_mtime_ns, copied.st_size):
                path.unlink()
                for folder in path.relative_to(self.root).parents[:-1]:
                    if not any((self.root / folder).iterdir()):
                        (self.root / folder).rmdir()


@contextmanager
def working_folder(source: Path, kept: Path | None = None, *, below: bool = True) -> Iterator[WorkingFolder]:
    """A working folder for one run, which is removed after it; `kept`: it is this one, and what was written stays.

    Raises FileError where it cannot be made.
    """
    from tempfile import TemporaryDirectory

    if kept is None:
        with TemporaryDirectory(prefix="vrs-run-", ignore_cleanup_errors=True) as made:
            yield WorkingFolder(root=Path(made), source=source, below=below)
        return
    try:
        kept.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise FileError(f"{kept}: {error.strerror}", "name another folder") from None
    folder = WorkingFolder(root=kept, source=source, below=below)
    try:
        yield folder
    finally:
        folder.drop_copies()
