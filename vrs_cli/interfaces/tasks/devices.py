"""The logical units of running programs: the disk, and the terminal as one more unit to read and to write."""

from __future__ import annotations

from collections.abc import Callable

from msgspec import Struct, field

from vrs_cli.errors import EndOfInput, LineMissing, NoDataReceived
from vrs_cli.files.disk import Disk
from vrs_cli.language.run.units import (
    SUCCESS,
    TERMINAL,
    AttachUnit,
    CloseFile,
    DeleteFile,
    DetachUnit,
    OpenFile,
    ReadRecord,
    RecordRefused,
    UnitEffect,
    WriteRecord,
)

END_OF_LINE = "\r"  # what GETC gives at the end of a line of the terminal, as its Return key does


class Devices(Struct, eq=False):
    """`show` writes to the terminal (text, whether the line ends); its lines come by `line`."""

    disk: Disk
    show: Callable[[str, bool], None]
    _status: int = SUCCESS
    _length: int = 0
    _typed: list[int] = field(default_factory=list)  # what GETC has before it: characters, and the end of the input
    _taken: list[int] = field(default_factory=list)  # of that by the present step

    def perform(self, task: int, effect: UnitEffect) -> str | None:
        """Do what a task asks for; the answer to it. Raises UnitNotAttached, FileOutside."""
        disk = self.disk
        match effect:
            case AttachUnit(unit=unit) if unit == TERMINAL:
                self._status = SUCCESS
            case AttachUnit(unit=asked):
                unit = disk.free(task) if asked is None else asked
                disk.attach(task, unit)
                return str(unit)
            case DetachUnit(unit=unit) if unit != TERMINAL:
                disk.detach(task, unit)
            case OpenFile():
                disk.open(task, effect.unit, effect.name, effect.access)
            case CloseFile():
                disk.close(task, effect.unit)
            case DeleteFile():
                disk.delete(task, effect.unit, effect.name)
            case ReadRecord():
                return disk.read(task, effect.unit)
            case WriteRecord(unit=unit) if unit == TERMINAL:
                self.show(effect.text, effect.newline)
                self._status, self._length = SUCCESS, len(effect.text)
            case WriteRecord():
                disk.write(task, effect.unit, effect.text + ("\n" if effect.newline else ""))
            case RecordRefused(unit=unit) if unit == TERMINAL:
                self._status = effect.code
            case RecordRefused():
                disk.refuse(task, effect.unit, effect.code)
        return None

    def status(self, task: int, unit: int) -> int:
        return self._status if unit == TERMINAL else self.disk.status(task, unit)

    def length(self, task: int, unit: int) -> int:
        return self._length if unit == TERMINAL else self.disk.length(task, unit)

    def begin_reading(self) -> None:
        self._taken = []

    def put_back(self) -> None:
        self._typed, self._taken = [*self._taken, *self._typed], []

    def character(self, task: int, unit: int, wait: bool) -> int:
        """The code of the next character, or of what went wrong. The terminal has whole lines. Raises LineMissing."""
        if unit != TERMINAL:
            return self.disk.character(task, unit)
        if self._typed:
            self._taken.append(self._typed.pop(0))
            return self._taken[-1]
        if not wait:
            return NoDataReceived.code
        raise LineMissing("GETC waits for the terminal", "a program or an assignment can wait")

    def line(self, line: str | None, *, of_getc: bool = False) -> str | None:
        """A line of the terminal; what GETC has left of one is passed over. None where there is no more."""
        come = [EndOfInput.code] if line is None else [ord(one) for one in line + END_OF_LINE]
        self._typed = [*self._typed, *come] if of_getc else []
        self._status, self._length = (EndOfInput.code, 0) if line is None else (SUCCESS, len(line))
        return line
