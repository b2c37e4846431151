"""Manage files for users and programs: the commands FDIRECTORY, FDELETE, FCOPY and FRENAME, the working folder of a
run, and the files that running programs have open, by task and logical unit. Callers decide whether existing files may
be overwritten. A run writes all its files into its working folder; files that it reads are first copied there. Disk
operations of programs set a status: 1, or an error code; only mistakes in the program raise errors. A file is read
completely when it is opened. A file that is written has a temporary name until it is closed or its task stops, so that
readers see the complete file or none.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from fnmatch import fnmatchcase
from io import StringIO
from pathlib import Path

from msgspec import Struct, field

from vrs_cli import errors
from vrs_cli.files.atomic import NewFile, atomically, create_beside, hold
from vrs_cli.files.opening import FREE, Folder, neighbours, reason, text_of, unreadable
from vrs_cli.language.run.effects import DISKS, SUCCESS, Access
from vrs_cli.values.results import FileRow


def entries(asked: Path, within: Folder = FREE) -> tuple[FileRow, ...]:
    """List the content of a folder, subfolders first. If `asked` is not a folder, its last part is a pattern such as
    `*.v2`: list the matching files. Hidden files are left out. Raises NonexistentFile, FileError.
    """
    folder, pattern = (asked, "*") if asked.is_dir() else (asked.parent, asked.name)
    if not folder.is_dir():
        raise errors.NonexistentFile(str(folder), "name a folder, or files as *.v2")
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
        raise errors.NonexistentFile(str(asked), _near(asked))
    return tuple(sorted(found, key=lambda row: (row.size is not None, row.name)))


def check_file(path: Path) -> Path:
    """Check that a path leads to a file, and return the path. Raises NonexistentFile, or FileError for a folder."""
    if path.is_dir():
        raise errors.FileError(f"{path} is a folder", "name a file")
    if not os.path.lexists(path):
        raise errors.NonexistentFile(str(path), _near(path))
    return path


def target(old: Path, new: Path) -> Path:
    """Return the path to which the file `old` is copied or renamed if the user names `new`. If `new` has no extension,
    the path gets the extension of the old file. If `new` is a folder, the path is in this folder and has the old name.
    Raises FileError if the path leads to the file `old` itself.
    """
    named = new if new.suffix or new.is_dir() else new.with_name(new.name + old.suffix)
    place = named / old.name if named.is_dir() else named
    if place.exists() and place.samefile(old):
        raise errors.FileError(f"{old} and {place} are one file", "give the new one another name")
    return place


def delete(path: Path, within: Folder = FREE) -> None:
    """Delete a file. Raises FileError."""
    with _as_file_error(f"{path} cannot be deleted"), hold(path), within.parent(path) as there:
        os.unlink(_in(there, path), dir_fd=there)


def rename(old: Path, new: Path, within: Folder = FREE) -> None:
    """Rename a file, replacing any file with the new name. Raises FileError."""
    within.check(new)
    folders = within.parent(old), within.parent(new)
    with (
        _as_file_error(f"{old} cannot be renamed to {new}"),
        hold(old),
        hold(new),
        folders[0] as here,
        folders[1] as there,
    ):
        os.replace(_in(here, old), _in(there, new), src_dir_fd=here, dst_dir_fd=there)


def _in(folder: int | None, path: Path) -> str | Path:
    """Return the name of a file relative to the handle of its open folder; its whole path if the folder is not open."""
    return path if folder is None else path.name


def copy(old: Path, new: Path, within: Folder = FREE) -> None:
    """Copy a file completely or not at all. Raises FileError."""
    import shutil

    try:
        source = within.open_to_read(old)
    except OSError as error:
        raise unreadable(old, error) from error
    with source, atomically(new, within) as stream:
        shutil.copyfileobj(source, stream)


@contextmanager
def _as_file_error(what: str) -> Iterator[None]:
    try:
        yield
    except OSError as error:
        raise errors.FileError(f"{what}: {reason(error)}", "check the folder and its permissions") from error


def _near(path: Path) -> str:
    return errors.did_you_mean(path.name, neighbours(path))


# --- the working folder of a run -------------------------------------------------------------------------------------


MAX_COPY_BYTES = 100_000_000


class WorkingFolder(Folder, frozen=True, kw_only=True):
    """A closed folder in which the files of the folder `source` appear to exist: each file is copied when a program
    first names it; links, devices and pipes are not copied. `below`: whether files in subfolders of `source` are copied
    too.
    """

    source: str | Path
    closed: bool = True
    below: bool = True
    # the status (stat) of each copy when it was made; None if no file was copied
    _named: dict[Path, os.stat_result | None] = field(default_factory=dict)

    def inside(self, name: str, *, pattern: bool = False) -> Path:
        path = Folder.inside(self, name, pattern=pattern)
        if path not in self._named:
            self._named[path] = None
            self._named[path] = self._copy_of(path)
        return path

    def _copy_of(self, path: Path) -> os.stat_result | None:
        """Copy the file with this path in the working folder from `source`, and return the status (stat) of the copy;
        None if there is no such file to read. Raises FileError if the file cannot be copied.
        """
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
                    raise errors.FileError(
                        f"{path.name} has {size} bytes", f"a folder run reads {MAX_COPY_BYTES} at most"
                    )
                try:
                    with path.open("xb") as copy:
                        shutil.copyfileobj(stream, copy)
                except OSError as error:
                    raise errors.FileError(
                        f"{path.name}: {error.strerror}", "the folder of the run has no room for a copy"
                    ) from None
                return path.stat()
        except (OSError, errors.FileOutside):  # the file does not exist in `source`, or cannot be read
            return None

    def drop_copies(self) -> None:
        """Remove the copied files that the run has not changed, and folders that are then empty."""
        for path, copied in self._named.items():
            if copied is None or not path.is_file():
                continue
            now = path.stat()
            if (now.st_ino, now.st_mtime_ns, now.st_size) == (copied.st_ino, copied.st_mtime_ns, copied.st_size):
                path.unlink()
                for folder in path.relative_to(self.root).parents[:-1]:
                    if not any((self.at / folder).iterdir()):
                        (self.at / folder).rmdir()


@contextmanager
def working_folder(source: str | Path, kept: str | None = None, *, below: bool = True) -> Iterator[WorkingFolder]:
    """Create a temporary working folder for one run, yield it, and remove it at the end. `kept`: a folder to use
    instead of a temporary one; at the end only unchanged copies are removed from it. Raises FileError if the folder
    cannot be created.
    """
    from tempfile import TemporaryDirectory

    if kept is None:
        with TemporaryDirectory(prefix="vrs-run-", ignore_cleanup_errors=True) as made:
            yield WorkingFolder(root=made, source=source, below=below)
        return
    try:
        os.makedirs(kept, exist_ok=True)
    except OSError as error:
        raise errors.FileError(f"{kept}: {error.strerror}", "name another folder") from None
    folder = WorkingFolder(root=kept, source=source, below=below)
    try:
        yield folder
    finally:
        folder.drop_copies()


BLOCK = 4096  # [B] an empty file counts as this size in a folder of limited size


class Unit(Struct, eq=False):
    """A logical unit of the disk, as one task uses it. `attached`: whether the task has attached the unit. `file`: the
    content of the file being read, or the new file being written; None if no file is open. `status`: the status of the
    last operation; `length`: the length of the last record read [characters].
    """

    attached: bool = False
    path: Path | None = None
    file: StringIO | NewFile | None = None
    status: int = SUCCESS
    length: int = 0

    @contextmanager
    def attempt(self) -> Iterator[None]:
        """Catch an error in the block, and set the status to its code. Without an error, set the status to success."""
        try:
            yield
        except errors.VrsError as error:
            self.status = error.code
        except FileNotFoundError:
            self.status = errors.NonexistentFile.code
        except OSError:
            self.status = errors.FileError.code
        else:
            self.status = SUCCESS

    def read(self, record: Callable[[StringIO], str]) -> str:
        """Read a record of the open file with the function `record`. Raises FileNotOpened, FileError if the file is
        open for writing, EndOfInput.
        """
        self.check_open()
        if not isinstance(self.file, StringIO):
            raise errors.FileError("the file is open to be written", "FCLOSE, then FOPENR reads it")
        if not (text := record(self.file)):
            raise errors.EndOfInput("the file", "all of it has been read")
        return text

    def write(self, text: str) -> None:
        """Write a string to the open file. Raises FileNotOpened, FileError if the file is open for reading, OSError."""
        self.check_open()
        if not isinstance(self.file, NewFile):
            raise errors.FileError("the file is open to be read", "FOPENW and FOPENA open one to be written")
        self.file.stream.write(text.encode("utf-8", "replace"))

    def close(self) -> None:
        """Close the file; a file that was written gets its final name. Raises OSError."""
        file, self.path, self.file = self.file, None, None
        if isinstance(file, NewFile):
            try:
                file.commit()
            finally:
                file.close()

    def check_open(self) -> None:
        if self.file is None:
            raise errors.FileNotOpened("", "FOPENR, FOPENW and FOPENA open one")


class Disk(Struct, eq=False):
    """The logical units and open files of all tasks. `folder_of`: returns the folder of a task by its number; the names
    of its files are relative to this folder, and cannot lead out of it. `spend`: called with the number of bytes before
    they are written. `hold`: called before a file is opened, with the total size of all files open for reading. Both
    functions may raise an error to refuse the operation.
    """

    folder_of: Callable[[int], Folder]
    spend: Callable[[int], None] = lambda _size: None
    hold: Callable[[int], None] = lambda _characters: None
    terminal: Unit = field(default_factory=Unit)  # the terminal, as all tasks use it
    _units: dict[tuple[int, int], Unit] = field(default_factory=dict)

    # --- units ---

    def unit(self, task: int, unit: int) -> Unit:
        """Return a logical unit of a task, even if it is not attached."""
        return self._units.get((task, unit)) or Unit()

    def attached_unit(self, task: int, unit: int) -> Unit:
        """Return a logical unit of a task. Raises UnitNotAttached if the task has not attached it."""
        one = self.unit(task, unit)
        if not one.attached:
            raise errors.UnitNotAttached(f"logical unit {unit}", f"ATTACH ({unit}) comes first")
        return one

    def attach(self, task: int, unit: int) -> None:
        """Attach a unit to a task. A file that is open on the unit stays open."""
        one = self._units.setdefault((task, unit), Unit())
        one.attached, one.status = True, SUCCESS

    def free(self, task: int) -> int:
        """Return the number of the first disk unit that a task has not attached. Raises UnitNotAttached if all are
        attached.
        """
        for unit in DISKS:
            if not self.unit(task, unit).attached:
                return unit
        raise errors.UnitNotAttached("every unit of the disk is in use", "DETACH one")

    def detach(self, task: int, unit: int) -> None:
        """Detach a unit, and close its file. Raises UnitNotAttached."""
        one = self.attached_unit(task, unit)
        with one.attempt():
            one.close()
        one.attached = False

    # --- files ---

    def open(self, task: int, unit: int, name: str, access: Access) -> None:
        """Open a file on a unit. Raises UnitNotAttached, FileOutside, and the errors of `hold` and `spend`; other
        errors set the status.
        """
        folder = self.folder_of(task)
        one, path = self.attached_unit(task, unit), folder.inside(name)
        if access is Access.READ and path.is_file():
            read = sum(len(other.file.getvalue()) for other in self._units.values() if isinstance(other.file, StringIO))
            self.hold(read + path.stat().st_size)
        if access is Access.APPEND and path.is_file():
            self.spend(path.stat().st_size)  # the file's current content is copied first, and counts as written
        elif access is not Access.READ and folder.closed and not path.exists():
            self.spend(BLOCK)
        with one.attempt():
            if one.path is not None:
                raise errors.FileOpened(one.path.name, "FCLOSE closes it")
            others = [other for other in self._units.values() if other.path == path]
            written = any(isinstance(other.file, NewFile) for other in others)
            if written or (others and access is not Access.READ):  # a file may have several readers or one writer
                raise errors.FileOpened(path.name, "it is open on another unit")
            one.file = _open(path, access, folder)
            one.path = path

    def close(self, task: int, unit: int) -> None:
        """Close the file of a unit, and set the status (an error code if no file is open). Raises UnitNotAttached."""
        one = self.attached_unit(task, unit)
        with one.attempt():
            one.check_open()
            one.close()

    def delete(self, task: int, unit: int, name: str) -> None:
        """Delete a file, and set the status of the unit. Raises UnitNotAttached, FileOutside."""
        folder = self.folder_of(task)
        one, path = self.attached_unit(task, unit), folder.inside(name)
        with one.attempt():
            if any(other.path == path for other in self._units.values()):
                raise errors.FileOpened(path.name, "FCLOSE closes it")
            if not path.is_file():
                raise errors.NonexistentFile(path.name)
            delete(path, folder)

    # --- records ---

    def read(self, task: int, unit: int) -> str | None:
        """Read the next record (line) of a unit's file, and return it; if that is impossible, set the status to the
        error code and return None. Raises UnitNotAttached.
        """
        one, line = self.attached_unit(task, unit), None
        with one.attempt():
            line = one.read(StringIO.readline).removesuffix("\n").removesuffix("\r")
        one.length = len(line or "")
        return line

    def character(self, task: int, unit: int) -> int:
        """Read the next character of a unit's file, and return its code; if that is impossible, return an
        error code.
        """
        try:
            return ord(self.attached_unit(task, unit).read(lambda text: text.read(1)))
        except errors.VrsError as error:
            return error.code

    def write(self, task: int, unit: int, text: str) -> None:
        """Write a string to a unit's file, and set the status. Raises UnitNotAttached, and the errors of `spend`."""
        one = self.attached_unit(task, unit)
        if isinstance(one.file, NewFile):
            self.spend(len(text.encode("utf-8", "replace")))
        with one.attempt():
            one.write(text)
        one.length = len(text)

    # --- tasks that stop ---

    def rest(self, task: int) -> None:
        """Save the files that a stopped task has written so far; they stay open, because the task may continue."""
        for (owner, _), one in self._units.items():
            if owner == task and isinstance(one.file, NewFile):
                with one.attempt():
                    one.file.commit()

    def release(self, task: int) -> None:
        """Close the files of a task that has ended, and detach its units."""
        for (owner, _), one in self._units.items():
            if owner == task:
                with one.attempt():
                    one.close()
                one.attached = False

    def close_all(self) -> None:
        """Close the files of all tasks."""
        for task in {task for task, _ in self._units}:
            self.release(task)


def _open(path: Path, access: Access, within: Folder) -> StringIO | NewFile:
    """Open a file to read, write or append. Return its content if it is read, otherwise a new file. Raises FileError,
    FileExists, OSError.
    """
    import shutil

    if path.exists() and not path.is_file():
        raise errors.FileError(f"{path.name} is no file", "name a file")
    if access is Access.READ:
        with within.open_to_read(path) as stream:
            return StringIO(text_of(stream.read()))
    if access is Access.WRITE and path.exists():
        raise errors.FileExists(path.name, "FDELETE deletes it, FOPENA adds to it")
    beside = create_beside(path, within=within)
    try:
        if path.exists():
            with within.open_to_read(path) as old:
                shutil.copyfileobj(old, beside.stream)
    except BaseException:
        beside.close()
        raise
    return beside
