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
OTHERS = tuple(range(9, 17))  # of devices that ATTACH names, as TCP and SERIAL:1; it may name one for a disk unit, too
USUAL_DEVICES = {"DISK": DISKS, "SYSTEM": DISKS, "TERMINAL": (TERMINAL,), "MONITOR": (TERMINAL,)}
UNITS = "0 is the robot, 4 the terminal, 5 to 8 and 17 to 19 are the disk, 9 to 16 other devices"

SUCCESS = 1  # the status of a unit when all went well
OPENED, CLOSED = 100, 101  # of a connection, as READ tells (public V+ programs test these)
MODE_BITS = 7  # of ATTACH: 1 do not queue, 2 do not wait, 4 choose a unit
CHOOSE = 4
ANY = -1  # stands for a unit that is to be chosen
NO_WAIT = 1  # of READ and GETC


class Access(Enum):
    """What a file is opened for."""

    READ = "FOPENR"
    WRITE = "FOPENW"
    APPEND = "FOPENA"


class UnitEffect(Effect, frozen=True):
    """What a program wants of a logical unit."""

    unit: int


class AttachUnit(UnitEffect, frozen=True):
    """ATTACH; answered by the number of the unit, that of a free one for ANY. `device`: its name, None for those that
    the numbers stand for.
    """

    device: str | None = None


class DetachUnit(UnitEffect, frozen=True):
    """DETACH."""


class OpenFile(UnitEffect, frozen=True):
    """FOPENR and the like."""

    name: str
    access: Access


class OpenDevice(UnitEffect, frozen=True):
    """FOPEN; `how` is its text, as "/LOCAL_PORT 11000 /CLIENTS 1"."""

    how: str


class CommandDevice(UnitEffect, frozen=True):
    """FCMND: a number that says what is to be done, and what it is to be done with."""

    command: int
    data: str


class CloseFile(UnitEffect, frozen=True):
    """FCLOSE, of a file or of another device."""


class DeleteFile(UnitEffect, frozen=True):
    """FDELETE."""

    name: str


class ReadRecord(UnitEffect, frozen=True):
    """READ: answered by the next line, or by None where there is none. `notices`: that a connection is opened or closed
    is told by the status, too; `wait`: for a line that has not come yet.
    """

    notices: bool = False
    wait: bool = True


class AwaitLine(UnitEffect, frozen=True):
    """GETC of a unit on which nothing has come: the step is done again when something has, from the terminal a line."""


class WriteRecord(UnitEffect, frozen=True):
    """WRITE; `newline`: the record ends after the text. `handle`: of the connection, None for the one of the last READ;
    `wait`: for a connection where there is none.
    """

    text: str
    newline: bool
    handle: int | None = None
    wait: bool = True


class RecordRefused(UnitEffect, frozen=True):
    """The record that was read is not what the variables of READ want: the status of the unit."""

    code: int


def checked_unit(number: float) -> int:
    """A unit that can be read and written. Raises IllegalValue."""
    unit = whole(number)
    if unit != TERMINAL and unit not in DISKS and unit not in OTHERS:
        raise IllegalValue(f"logical unit {plain(number)}", UNITS)
    return unit


def checked_disk(number: float, word: str) -> int:
    """A unit of the disk. Raises IllegalValue."""
    unit = checked_unit(number)
    if unit not in DISKS:
        raise IllegalValue(f"logical unit {unit}", f"{word} wants one of the disk: 5 to 8, 17 to 19")
    return unit


def checked_open(number: float, word: str) -> int:
    """A unit that can be opened and closed. Raises IllegalValue."""
    unit = checked_unit(number)
    if unit == TERMINAL:
        raise IllegalValue(f"logical unit {unit}", f"{word} wants one of the disk or another device: 5 to 19")
    return unit


def checked_device(device: str | None, unit: int | None) -> str | None:
    """The name of the device of a unit; None for those that the numbers stand for. Raises IllegalValue."""
    name = "" if device is None else device.strip().upper()
    usual = USUAL_DEVICES.get(name)
    if not name and unit in OTHERS:
        raise IllegalValue(f"logical unit {unit}", f'name its device: ATTACH ({unit}) "TCP"')
    if not name or (usual is not None and (unit in usual or (unit is None and usual is DISKS))):
        return None
    if usual is not None or unit in (ROBOT, TERMINAL):
        raise IllegalValue(f"the device {device} with logical unit {unit}", UNITS)
    return name
