"""The disk of running programs: the files they have open, by task and logical unit, all in one folder.

Every operation leaves a status: 1, or the code of what went wrong, so that nothing here is raised but mistakes of the
program. A file is read whole when it is opened. One that is written grows beside its name and takes its place when it
is closed, or when its task stops: a reader meets all of it or none.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import TypeVar

from msgspec import Struct, field

from vrs_cli.errors import (
    EndOfInput,
    FileError,
    FileExists,
    FileNotOpened,
    FileOpened,
    FileOutside,
    NonexistentFile,
    UnitNotAttached,
    VrsError,
)
from vrs_cli.files.atomic import AUXILIARY, Beside, create_beside, sync
from vrs_cli.files.lock import hold
from vrs_cli.files.naming import wrong_name
from vrs_cli.files.opening import open_to_read
from vrs_cli.language.run.units import DISKS, SUCCESS, Access

_T = TypeVar("_T")


class _Reader(Struct, eq=False):
    """A text, and how far it has been read."""

    text: str
    at: int = 0

    def record(self) -> str:
        """The next line, without its end. Raises EndOfInput."""
        if self.at >= len(self.text):
            raise EndOfInput("the file", "all of it has been read")
        end = self.text.find("\n", self.at)
        line = self.text[self.at :] if end < 0 else self.text[self.at : end]
        self.at += len(line) + 1
        return line.removesuffix("\r")

    def character(self) -> str:
        """Raises EndOfInput."""
        if self.at >= len(self.text):
            raise EndOfInput("the file", "all of it has been read")
        self.at += 1
        return self.text[self.at - 1]


class _Writer(Struct, eq=False):
    """A file beside the one that it becomes; `placed`: it has become that already."""

    beside: Beside
    placed: bool = False

    def write(self, text: str) -> None:
        """Raises OSError."""
        self.beside.stream.write(text.encode("utf-8", "replace"))

    def place(self) -> None:
        """What was written is in the file; more may follow. Raises OSError."""
        if self.placed:
            self.beside.stream.flush()
        else:
            self.beside.commit()
            self.placed = True

    def close(self) -> None:
        """Raises OSError."""
        try:
            self.place()
            sync(self.beside.stream)
        finally:
            self.beside.close()


class _Unit(Struct, eq=False):
    """A logical unit of one task. `status` is that of the last operation, `length` [characters] of the last record."""

    attached: bool = False
    path: Path | None = None
    reader: _Reader | None = None
    writer: _Writer | None = None
    status: int = SUCCESS
    length: int = 0


class Disk(Struct, eq=False):
    """The open files of all tasks. Names are relative to `folder`, and cannot leave it.

    `spend` hears how many bytes are about to be written, and raises what is to stop them.
    """

    folder: Path
    spend: Callable[[int], None] = lambda _size: None
    _units: dict[tuple[int, int], _Unit] = field(default_factory=dict)

    # --- units ---

    def attach(self, task: int, unit: int) -> None:
        """Give a task a unit; what it has open on it stays open."""
        one = self._units.setdefault((task, unit), _Unit())
        one.attached, one.status = True, SUCCESS

    def free(self, task: int) -> int:
        """The first unit that a task has not attached. Raises UnitNotAttached."""
        for unit in DISKS:
            if not self._any(task, unit).attached:
                return unit
        raise UnitNotAttached("every unit of the disk is in use", "DETACH one")

    def detach(self, task: int, unit: int) -> None:
        """Take a unit back, and close what is open on it. Raises UnitNotAttached."""
        one = self._unit(task, unit)
        self._done(one, lambda: self._close(one))
        one.attached = False

    def status(self, task: int, unit: int) -> int:
        """1, or the code of what went wrong last."""
        return self._any(task, unit).status

    def length(self, task: int, unit: int) -> int:
        """Characters of the record that was read or written last."""
        return self._any(task, unit).length

    def refuse(self, task: int, unit: int, code: int) -> None:
        """The record that was read is not what was wanted."""
        self._unit(task, unit).status = code

    # --- files ---

    def open(self, task: int, unit: int, name: str, access: Access) -> None:
        """Raises UnitNotAttached, FileOutside; what else goes wrong is the status."""
        one, path = self._unit(task, unit), self._inside(name)
        if access is Access.APPEND and path.is_file():
            self.spend(path.stat().st_size)  # what is there is copied first
        self._done(one, lambda: self._opened(one, path, access))

    def close(self, task: int, unit: int) -> None:
        """Raises UnitNotAttached; a unit with no file open has the status of that."""
        one = self._unit(task, unit)
        self._done(one, lambda: self._close(self._with_file(one)))

    def delete(self, task: int, unit: int, name: str) -> None:
        """Raises UnitNotAttached, FileOutside."""
        one, path = self._unit(task, unit), self._inside(name)
        self._done(one, lambda: self._delete(path))

    # --- records ---

    def read(self, task: int, unit: int) -> str | None:
        """The next record; None where there is none, and the status says why. Raises UnitNotAttached."""
        one = self._unit(task, unit)
        line = self._done(one, lambda: self._reader(one).record())
        one.length = 0 if line is None else len(line)
        return line

    def character(self, task: int, unit: int) -> int:
        """The code of the next character, or of what went wrong."""
        one = self._any(task, unit)
        try:
            if not one.attached:
                raise _not_attached(unit)
            return ord(self._reader(one).character())
        except VrsError as error:
            return error.code

    def write(self, task: int, unit: int, text: str) -> None:
        """Raises UnitNotAttached, and what `spend` does."""
        one = self._unit(task, unit)
        if one.writer is not None:
            self.spend(len(text.encode("utf-8", "replace")))
        self._done(one, lambda: self._write(one, text))
        one.length = len(text)

    # --- endings ---

    def rest(self, task: int) -> None:
        """A task has stopped, and may go on: what it has written so far is in its files."""
        for one in self._of(task):
            if one.writer is not None:
                self._done(one, one.writer.place)

    def release(self, task: int) -> None:
        """A task has ended: its files are closed, its units free."""
        for one in self._of(task):
            self._done(one, partial(self._close, one))
            one.attached = False

    def close_all(self) -> None:
        """Nothing runs any more."""
        for task in {task for task, _ in self._units}:
            self.release(task)

    # --- inside ---

    def _unit(self, task: int, unit: int) -> _Unit:
        """Raises UnitNotAttached."""
        one = self._any(task, unit)
        if not one.attached:
            raise _not_attached(unit)
        return one

    def _any(self, task: int, unit: int) -> _Unit:
        return self._units.get((task, unit)) or _Unit()

    def _of(self, task: int) -> Iterator[_Unit]:
        return (one for (owner, _), one in list(self._units.items()) if owner == task)

    @staticmethod
    def _done(one: _Unit, act: Callable[[], _T]) -> _T | None:
        """Do it; the status of the unit says how that went."""
        try:
            done = act()
        except VrsError as error:
            one.status = error.code
        except FileNotFoundError:
            one.status = NonexistentFile.code
        except OSError:
            one.status = FileError.code
        else:
            one.status = SUCCESS
            return done
        return None

    def _inside(self, name: str) -> Path:
        """The path of a name. Raises FileOutside for one that is not in the folder."""
        folder = Path(os.path.realpath(self.folder))
        if not name.strip():
            raise FileOutside(repr(name), "give a name: data/log.txt")
        for part in name.strip().split("/"):
            if part not in ("", ".", "..") and (wrong := wrong_name(part)):
                raise FileOutside(repr(name), f"{wrong}: data/log.txt is good everywhere")
        path = Path(os.path.realpath(folder / name.strip()))
        if Path(name).is_absolute() or folder not in path.parents:
            raise FileOutside(name, "programs have the files of the folder they run in, and those below it")
        if path.name.startswith(".") and path.suffix in AUXILIARY:
            raise FileOutside(name, "it belongs to a file that is being written")
        return path

    def _opened(self, one: _Unit, path: Path, access: Access) -> None:
        if one.path is not None:
            raise FileOpened(one.path.name, "FCLOSE closes it")
        self._check_shared(path, access)
        if path.exists() and not path.is_file():
            raise FileError(f"{path.name} is no file", "name a file")
        _OPENERS[access](one, path)
        one.path = path

    def _check_shared(self, path: Path, access: Access) -> None:
        """Many may read a file, or one may write it. Raises FileOpened."""
        others = [one for one in self._units.values() if one.path == path]
        if any(one.writer is not None for one in others) or (others and access is not Access.READ):
            raise FileOpened(path.name, "it is open on another unit")

    def _delete(self, path: Path) -> None:
        if any(one.path == path for one in self._units.values()):
            raise FileOpened(path.name, "FCLOSE closes it")
        if not path.is_file():
            raise NonexistentFile(path.name)
        with hold(path):
            path.unlink()

    def _with_file(self, one: _Unit) -> _Unit:
        if one.path is None:
            raise FileNotOpened("", "FOPENR, FOPENW and FOPENA open one")
        return one

    def _reader(self, one: _Unit) -> _Reader:
        if self._with_file(one).reader is None:
            raise FileError("the file is open to be written", "FCLOSE, then FOPENR reads it")
        assert one.reader is not None
        return one.reader

    def _write(self, one: _Unit, text: str) -> None:
        if self._with_file(one).writer is None:
            raise FileError("the file is open to be read", "FOPENW and FOPENA open one to be written")
        assert one.writer is not None
        one.writer.write(text)

    def _close(self, one: _Unit) -> None:
        writer, one.path, one.reader, one.writer = one.writer, None, None, None
        if writer is not None:
            writer.close()


def _not_attached(unit: int) -> UnitNotAttached:
    return UnitNotAttached(f"logical unit {unit}", f"ATTACH ({unit}) comes first")


def _open_to_read(one: _Unit, path: Path) -> None:
    if not path.exists():
        raise NonexistentFile(path.name)
    with open_to_read(path) as stream:
        one.reader = _Reader(_decoded(stream.read()))


def _open_to_write(one: _Unit, path: Path) -> None:
    if path.exists():
        raise FileExists(path.name, "FDELETE deletes it, FOPENA adds to it")
    one.writer = _Writer(create_beside(path))


def _open_to_append(one: _Unit, path: Path) -> None:
    import shutil

    beside = create_beside(path)
    try:
        if path.exists():
            with open_to_read(path) as old:
                shutil.copyfileobj(old, beside.stream)
    except BaseException:
        beside.close()
        raise
    one.writer = _Writer(beside)


def _decoded(content: bytes) -> str:
    """UTF-8, or a character a byte where it is not that."""
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError:
        return content.decode("latin-1")


_OPENERS: dict[Access, Callable[[_Unit, Path], None]] = {
    Access.READ: _open_to_read,
    Access.WRITE: _open_to_write,
    Access.APPEND: _open_to_append,
}
