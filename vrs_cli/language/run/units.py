"""Logical units: the numbers by which programs name devices, and what they ask to be done with them.

The requests are data; the driver has them done. What goes wrong outside a program (no such file, its end, a full disk)
does not stop it: the code is the status of the unit, which IOSTAT tells (V+ Language User's Guide, Error Status). What
is wrong in the program itself, a unit that does not exist or is not attached, stops it.
"""

from __future__ import annotations

from enum import Enum

from vrs_cli.errors import IllegalValue
from vrs_cli.language.run.effects import Effect
from vrs_cli.language.words.values import plain, whole

ROBOT = 0
TERMINAL = 4
DISKS = (5, 6, 7, 8, 17, 18, 19)
DEVICES = {"DISK": DISKS, "SYSTEM": DISKS, "TERMINAL": (TERMINAL,), "MONITOR": (TERMINAL,)}
UNITS = "0 is the robot, 4 the terminal, 5 to 8 and 17 to 19 are the disk"

SUCCESS = 1  # the status of a unit when all went well
MODE_BITS = 7  # of ATTACH: 1 do not queue, 2 do not wait, 4 choose a unit
CHOOSE = 4
NO_WAIT = 1  # of GETC


class Access(Enum):
    """What a file is opened for."""

    READ = "FOPENR"
    WRITE = "FOPENW"
    APPEND = "FOPENA"


class UnitEffect(Effect, frozen=True):
    """What a program wants of a logical unit."""


class AttachUnit(UnitEffect, frozen=True):
    """ATTACH of a unit, of any free one of the disk where it is None; answered by its number."""

    unit: int | None


class DetachUnit(UnitEffect, frozen=True):
    unit: int


class OpenFile(UnitEffect, frozen=True):
    unit: int
    name: str
    access: Access


class CloseFile(UnitEffect, frozen=True):
    unit: int


class DeleteFile(UnitEffect, frozen=True):
    unit: int
    name: str


class ReadRecord(UnitEffect, frozen=True):
    """READ: answered by the next line, or by None where there is none."""

    unit: int


class AwaitLine(UnitEffect, frozen=True):
    """GETC of the terminal, which has no line: the step is done again when one has come."""


class WriteRecord(UnitEffect, frozen=True):
    """WRITE; `newline`: the record ends after the text."""

    unit: int
    text: str
    newline: bool


class RecordRefused(UnitEffect, frozen=True):
    """The record that was read is not what the variables of READ want: the status of the unit."""

    unit: int
    code: int


def checked_unit(number: float) -> int:
    """A unit that can be read and written. Raises IllegalValue."""
    unit = whole(number)
    if unit != TERMINAL and unit not in DISKS:
        raise IllegalValue(f"logical unit {plain(number)}", UNITS)
    return unit


def checked_disk(number: float, word: str) -> int:
    """A unit of the disk. Raises IllegalValue."""
    unit = checked_unit(number)
    if unit not in DISKS:
        raise IllegalValue(f"logical unit {unit}", f"{word} wants one of the disk: 5 to 8, 17 to 19")
    return unit


def checked_device(name: str, unit: int | None) -> None:
    """Whether the unit is one of that device. Raises IllegalValue."""
    units = DEVICES.get(name.strip().upper())
    if units is None:
        raise IllegalValue(f"the device {name}", "there are DISK and TERMINAL")
    if unit not in units and not (unit is None and units is DISKS):
        raise IllegalValue(f"the device {name} with logical unit {unit}", UNITS)
