"""The disk of running programs: the files they have open, by task and logical unit, all in one folder.

Every operation leaves a status: 1, or the code of what went wrong, so that nothing here is raised but mistakes of the
program. A file is read whole when it is opened. One that is written grows beside its name and takes its place when it
is closed, or when its task stops: a reader meets all of it or none.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from io import StringIO
from pathlib import Path

from msgspec import Struct, field

from vrs_cli.errors import (
    EndOfInput,
    FileError,
    FileExists,
    FileNotOpened,
    FileOpened,
    NonexistentFile,
    UnitNotAttached,
    VrsError,
)
from vrs_cli.files.atomic import NewFile, create_beside
from vrs_cli.files.folder import delete
from vrs_cli.files.opening import Folder, text_of
from vrs_cli.language.run.effects import DISKS, SUCCESS, Access

BLOCK = 4096  # bytes that an empty file costs too, in a folder whose size is bounded


class Unit(Struct, eq=False):
    """A logical unit of one task. `file`: the text that is read, or the file beside the one that is written. `status`
    is that of the last operation, `length` [characters] of the last record."""

    attached: bool = False
    path: Path | None = None
    file: StringIO | NewFile | None = None
    status: int = SUCCESS
    length: int = 0

    @contextmanager
    def attempt(self) -> Iterator[None]:
        """Set the status by how the block ends."""
        try:
            yield
        except VrsError as error:
            self.status = error.code
        except FileNotFoundError:
            self.status = NonexistentFile.code
        except OSError:
            self.status = FileError.code
        else:
            self.status = SUCCESS

    def read(self, record: Callable[[StringIO], str]) -> str:
        """Raises FileNotOpened, FileError, EndOfInput."""
        self.check_open()
        if not isinstance(self.file, StringIO):
            raise FileError("the file is open to be written", "FCLOSE, then FOPENR reads it")
        if not (text := record(self.file)):
            raise EndOfInput("the file", "all of it has been read")
        return text

    def write(self, text: str) -> None:
        """Raises FileNotOpened, FileError, OSError."""
        self.check_open()
        if not isinstance(self.file, NewFile):
            raise FileError("the file is open to be read", "FOPENW and FOPENA open one to be written")
        self.file.stream.write(text.encode("utf-8", "replace"))

    def close(self) -> None:
        """Close the file; what was written takes its place. Raises OSError."""
        file, self.path, self.file = self.file, None, None
        if isinstance(file, NewFile):
            try:
                file.commit()
            finally:
                file.close()

    def check_open(self) -> None:
        if self.file is None:
            raise FileNotOpened("", "FOPENR, FOPENW and FOPENA open one")


class Disk(Struct, eq=False):
    """The open files of all tasks. Names are relative to `folder`, or to the folder of the task, and cannot leave it.

    `spend` hears how many bytes are about to be written, `hold` how many characters all files that are open to be read
    are to hold; each raises what is to stop that.
    """

    folder: Folder
    spend: Callable[[int], None] = lambda _size: None
    hold: Callable[[int], None] = lambda _characters: None
    folders: dict[int, Folder] = field(default_factory=dict)  # of tasks that have one of their own
    _units: dict[tuple[int, int], Unit] = field(default_factory=dict)

    # --- folders ---

    def place(self, task: int, folder: Folder | None) -> None:
        """A task that begins has its files in this folder; None: where all others have theirs."""
        self.folders.pop(task, None)
        if folder is not None:
            self.folders[task] = folder

    # --- units ---

    def unit(self, task: int, unit: int) -> Unit:
        """A unit of a task, attached or not."""
        return self._units.get((task, unit)) or Unit()

    def attached(self, task: int, unit: int) -> Unit:
        """A unit that a task has attached. Raises UnitNotAttached."""
        one = self.unit(task, unit)
        if not one.attached:
            raise UnitNotAttached(f"logical unit {unit}", f"ATTACH ({unit}) comes first")
        return one

    def attach(self, task: int, unit: int) -> None:
        """Give a task a unit; what it has open on it stays open."""
        one = self._units.setdefault((task, unit), Unit())
        one.attached, one.status = True, SUCCESS

    def free(self, task: int) -> int:
        """The first unit that a task has not attached. Raises UnitNotAttached."""
        for unit in DISKS:
            if not self.unit(task, unit).attached:
                return unit
        raise UnitNotAttached("every unit of the disk is in use", "DETACH one")

    def detach(self, task: int, unit: int) -> None:
        """Take a unit back, and close what is open on it. Raises UnitNotAttached."""
        one = self.attached(task, unit)
        with one.attempt():
            one.close()
        one.attached = False

    # --- files ---

    def open(self, task: int, unit: int, name: str, access: Access) -> None:
        """Raises UnitNotAttached, FileOutside; what else goes wrong is the status."""
        folder = self.folders.get(task, self.folder)
        one, path = self.attached(task, unit), folder.inside(name)
        if access is Access.READ and path.is_file():
            read = sum(len(other.file.getvalue()) for other in self._units.values() if isinstance(other.file, StringIO))
            self.hold(read + path.stat().st_size)
        if access is Access.APPEND and path.is_file():
            self.spend(path.stat().st_size)  # what is there is copied first
        elif access is not Access.READ and folder.closed and not path.exists():
            self.spend(BLOCK)
        with one.attempt():
            if one.path is not None:
                raise FileOpened(one.path.name, "FCLOSE closes it")
            others = [other for other in self._units.values() if other.path == path]
            written = any(isinstance(other.file, NewFile) for other in others)
            if written or (others and access is not Access.READ):  # many may read a file, or one may write it
                raise FileOpened(path.name, "it is open on another unit")
            one.file = _opened(path, access, folder)
            one.path = path

    def close(self, task: int, unit: int) -> None:
        """Raises UnitNotAttached; a unit with no file open has the status of that."""
        one = self.attached(task, unit)
        with one.attempt():
            one.check_open()
            one.close()

    def delete(self, task: int, unit: int, name: str) -> None:
        """Raises UnitNotAttached, FileOutside."""
        folder = self.folders.get(task, self.folder)
        one, path = self.attached(task, unit), folder.inside(name)
        with one.attempt():
            if any(other.path == path for other in self._units.values()):
                raise FileOpened(path.name, "FCLOSE closes it")
            if not path.is_file():
                raise NonexistentFile(path.name)
            delete(path, folder)

    # --- records ---

    def read(self, task: int, unit: int) -> str | None:
        """The next record; None where there is none, and the status says why. Raises UnitNotAttached."""
        one, line = self.attached(task, unit), None
        with one.attempt():
            line = one.read(StringIO.readline).removesuffix("\n").removesuffix("\r")
        one.length = len(line or "")
        return line

    def character(self, task: int, unit: int) -> int:
        """The code of the next character, or of what went wrong."""
        try:
            return ord(self.attached(task, unit).read(lambda text: text.read(1)))
        except VrsError as error:
            return error.code

    def write(self, task: int, unit: int, text: str) -> None:
        """Raises UnitNotAttached, and what `spend` does."""
        one = self.attached(task, unit)
        if isinstance(one.file, NewFile):
            self.spend(len(text.encode("utf-8", "replace")))
        with one.attempt():
            one.write(text)
        one.length = len(text)

    # --- endings ---

    def rest(self, task: int) -> None:
        """Write what a task has written so far into its files: it has stopped, and may go on."""
        for (owner, _), one in self._units.items():
            if owner == task and isinstance(one.file, NewFile):
                with one.attempt():
                    one.file.commit()

    def release(self, task: int) -> None:
        """Close the files of a task that has ended, and free its units."""
        for (owner, _), one in self._units.items():
            if owner == task:
                with one.attempt():
                    one.close()
                one.attached = False

    def close_all(self) -> None:
        """Close the files of all tasks: nothing runs any more."""
        for task in {task for task, _ in self._units}:
            self.release(task)


def _opened(path: Path, access: Access, within: Folder) -> StringIO | NewFile:
    """Raises FileError, FileExists, OSError."""
    import shutil

    if path.exists() and not path.is_file():
        raise FileError(f"{path.name} is no file", "name a file")
    if access is Access.READ:
        with within.open_to_read(path) as stream:
            return StringIO(text_of(stream.read()))
    if access is Access.WRITE and path.exists():
        raise FileExists(path.name, "FDELETE deletes it, FOPENA adds to it")
    beside = create_beside(path, within=within)
    try:
        if path.exists():
            with within.open_to_read(path) as old:
                shutil.copyfileobj(old, beside.stream)
    except BaseException:
        beside.close()
        raise
    return beside
