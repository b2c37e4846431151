"""Define the effects that a running program requests from its driver, the events that end it, and the reactions of its
task.

A request of `values.commands` goes to the robot; the effects below are for everything else. The docstring of an effect
says so if the task itself carries the effect out.

A reaction (REACT, REACTI, REACTE; val2 9.12-13) waits after its signal has changed to the given state. The task calls
it between two steps, as soon as its priority is above that of the program. During the reaction the program has the
reaction's priority; RETURN restores the old one.

Logical units are the numbers by which programs refer to devices. A failure outside the program (a missing file, the end
of a file, a full disk) does not stop it: the error code becomes the status of the unit, which IOSTAT returns (V+
Language User's Guide, Error Status). A mistake of the program, such as using a unit that is not attached, stops it.
"""

from __future__ import annotations

from collections.abc import Callable, Generator
from enum import Enum
from typing import Any

from msgspec import Struct

from vrs_cli.errors import IllegalValue, VrsError
from vrs_cli.language.run.variables import Given
from vrs_cli.language.words.values import integer_between, plain, whole
from vrs_cli.values.commands import Mode, Request, SetAlter, SetDuration, SetMode, SetSpeed, SpeedUnit
from vrs_cli.values.results import ProgramFault


class Effect(Struct, frozen=True):
    """An effect that a task requests from its driver, in addition to requests to the robot."""


Event = Request | Effect
LAST_TASK = 27  # tasks have the numbers 0 to 27 (V+ Language User's Guide)
PROCESS_CONTROL = 1  # the task that the PC commands of VAL-II control
Answers = Generator[Event, str | None, None]  # a generator that receives the driver's answer to an effect


class Type(Effect, frozen=True):
    """Show a text at the terminal. `newline`: end the line after it."""

    text: str
    newline: bool = True


class Prompt(Effect, frozen=True):
    """Show the text and read one line, which `resume` passes as the answer. `count`: the number of required values;
    `wrong`: why the previous line could not be read."""

    text: str
    count: int
    wrong: VrsError | None = None


class Wait(Effect, frozen=True):
    """Hold the program until `condition()` is true.

    The condition is tested at once, or after `ticks`, then every tick. If it cannot be evaluated it raises VrsError;
    the driver passes the error to `Task.throw`.
    """

    condition: Callable[[], bool]
    ticks: int = 0


class WaitEvent(Effect, frozen=True):
    """WAIT.EVENT: hold the program until another task sets the event of this task, or for `seconds` if not None.
    `event`: whether the event ends the wait."""

    event: bool
    seconds: float | None = None


class SetEvent(Effect, frozen=True):
    """SET.EVENT, or CLEAR.EVENT if not `on`: change the event of a task. `task`: the task's number, None for the task
    itself."""

    task: int | None
    on: bool = True


class EventSignal(Effect, frozen=True):
    """INT.EVENT: choose the input signal that sets the task's event when it goes on. `signal`: its number, None for no
    signal."""

    signal: int | None


class CycleBegins(Effect, frozen=True):
    """A cycle of the main program begins, and the driver carries out `settings` (val2 section 9.1). Cycles count from
    1."""

    cycle: int
    settings: tuple[Request, ...]


class CallProgram(Effect, frozen=True):
    """CALL, which the task carries out. `site`: the number of this call in the calling program."""

    name: str
    arguments: tuple[Given | None, ...]
    site: int | None = None


class BrokenOff(Effect, frozen=True):
    """A direct call was interrupted because the turn ended, and the task continues it. `frames`: one for each called
    program, the innermost first, with the executable, the arguments and own variables, the operation, the limits of FOR
    and subjects of CASE, and whether the operation has made a call."""

    frames: tuple[Any, ...]


class Return(Effect, frozen=True):
    """RETURN, or the end of a program; the task carries it out. `steps`: the number of steps to skip after the call.
    `mended` (RETURNE): also skip the step that failed before the REACTE routine."""

    steps: int = 0
    mended: bool = False


class Stop(Effect, frozen=True):
    """STOP: end the present cycle; the task carries it out."""


class Pause(Effect, frozen=True):
    """PAUSE: stop the program; `resume` continues with the next step."""


class Halt(Effect, frozen=True):
    """HALT: end the program."""


class LookAround(Effect, frozen=True):
    """A request that the task check whether a reaction is due, for instance after a SIGNAL of the program."""


class RunSignal(Effect, frozen=True):
    """RUNSIG: keep the signal in the given state while the program runs, and in the opposite state at other times."""

    signal: int


class StartTask(Effect, frozen=True):
    """EXECUTE in a program, or PCEXECUTE: start a task. `number`: the number of the task, None for the first free
    one."""

    number: int | None
    call: CallProgram
    cycles: int = 1
    step: int = 1


class TaskControl(Enum):
    """An action of a program on a task, such as ABORT."""

    ABORT = "ABORT"
    KILL = "KILL"
    CYCLE_END = "CYCLE.END"
    PROCEED = "PROCEED"
    RETRY = "RETRY"


class ControlTask(Effect, frozen=True):
    control: TaskControl
    number: int


class AttachRobot(Effect, frozen=True):
    """ATTACH: reserve the robot for this task as soon as no other task has it."""


class DetachRobot(Effect, frozen=True):
    """DETACH: release the robot when it is at rest."""


CYCLE_SETTINGS: tuple[Request, ...] = (
    SetSpeed(100.0, 100.0, SpeedUnit.PERCENT, always=True),
    SetDuration(0.0, always=True),
    SetMode(Mode.COARSE, on=False, always=True, tolerance=100.0),
    SetMode(Mode.NULLING, on=True, always=True),
    SetMode(Mode.CONTINUOUS_PATH, on=True, always=True),
    SetMode(Mode.SINGLE, on=False, always=True),
    SetMode(Mode.OVERLAP, on=True, always=True),
    SetMode(Mode.INTEGRAL, on=False, always=True),
    SetAlter(None),
)


# --- how a program ends --------------------------------------------------------------------------------------------


class ProgramCompleted(Effect, frozen=True):
    """The last cycle has ended."""

    cycles: int


class Failed(Effect, frozen=True):
    """A step has failed. `resume` continues with the next step; after `retry` it repeats the failed step."""

    fault: ProgramFault
    error: VrsError


class Budget(Effect, frozen=True):
    """The given number of steps has been carried out. The event requests nothing."""


class TaskState(Enum):
    RUNNING = "running"
    PAUSED = "paused"
    FAILED = "failed"
    HALTED = "halted"
    ABORTED = "aborted"
    COMPLETED = "completed"


HIGHEST = 127  # maximum priority of a reaction to a signal, and of LOCK (V+ User's Guide p.46)
OF_ERRORS = 254  # the priority of a REACTE routine (V+ User's Guide p.47)
DEFAULT_PRIORITY = 1


class Reaction(Struct, frozen=True):
    """A reaction of REACT or, if `immediate`, of REACTI: call `program` when `signal` goes on; if `signal` is negative,
    when it goes off."""

    signal: int
    program: str
    priority: int = DEFAULT_PRIORITY
    immediate: bool = False


class Reactions:
    """The reactions of one task during a cycle. `on_error`: the program that REACTE names."""

    def __init__(self) -> None:
        self.clear()

    def clear(self) -> None:
        """Remove all reactions, as at the start of a cycle."""
        self.priority = 0
        self.on_error: str | None = None
        self._set: dict[int, Reaction] = {}
        self.waiting: list[Reaction] = []

    def set(self, reaction: Reaction) -> None:
        """Set a reaction. It replaces any earlier reaction to the same signal."""
        self.ignore(reaction.signal)
        self._set[abs(reaction.signal)] = reaction

    def ignore(self, signal: int) -> None:
        """Remove the reaction to a signal, even if it is waiting."""
        gone = self._set.pop(abs(signal), None)
        if gone in self.waiting:
            self.waiting.remove(gone)

    def note_change(self, signal: int, on: bool) -> bool:
        """Record that a signal has changed. Return whether this makes a reaction wait; a reaction that is already
        waiting is not called twice."""
        if (reaction := self._set.get(signal)) is None or (reaction.signal > 0) is not on or reaction in self.waiting:
            return False
        self.waiting.append(reaction)
        return True

    @property
    def due(self) -> Reaction | None:
        """Return the waiting reaction that the task must call next, or None: the one with the highest priority; of
        several, the one whose signal changed first."""
        if not self.waiting:
            return None
        first = max(self.waiting, key=lambda reaction: reaction.priority)
        return first if first.priority > self.priority else None


def checked_priority(priority: float, lowest: int) -> int:
    """Return a priority for REACT (at least 1) or LOCK (at least 0). Raises IllegalValue."""
    return integer_between(priority, lowest, HIGHEST, "a priority of")


def checked_signal(number: float) -> int:
    """Return the signal number of a reaction, negative if it waits for the signal to go off. Raises IllegalValue
    for 0."""
    if not round(number):
        raise IllegalValue("signal 0", "a signal number; negative: when it goes off")
    return round(number)


ROBOT = 0
TERMINAL = 4
DISKS = (5, 6, 7, 8, 17, 18, 19)
# units for devices that ATTACH names (TCP, SERIAL:1); disk units can have such devices too
OTHERS = tuple(range(9, 17))
USUAL_DEVICES = {"DISK": DISKS, "SYSTEM": DISKS, "TERMINAL": (TERMINAL,), "MONITOR": (TERMINAL,)}
UNITS = "0 is the robot, 4 the terminal, 5 to 8 and 17 to 19 are the disk, 9 to 16 other devices"

SUCCESS = 1  # the status of a unit after an operation without an error
# status after READ: a connection was opened or closed (public V+ programs test for these numbers)
OPENED, CLOSED = 100, 101
MODE_BITS = 7  # mask of all mode bits of ATTACH: 1 do not queue, 2 do not wait, 4 choose a unit
CHOOSE = 4
ANY = -1  # this unit number lets the system choose the unit
NO_WAIT = 1  # bit in the mode of READ and GETC: do not wait


class Access(Enum):
    """The purpose for which a file is opened."""

    READ = "FOPENR"
    WRITE = "FOPENW"
    APPEND = "FOPENA"


class UnitEffect(Effect, frozen=True):
    """An operation on a logical unit."""

    unit: int


class AttachUnit(UnitEffect, frozen=True):
    """ATTACH: attach a logical unit. The answer is the number of the unit; for ANY, that of a free unit. `device`: the
    name of the device, None for the device that the unit number implies."""

    device: str | None = None


class DetachUnit(UnitEffect, frozen=True):
    """DETACH: release a unit."""


class OpenFile(UnitEffect, frozen=True):
    """FOPENR, FOPENW, FOPENA: open a file."""

    name: str
    access: Access


class OpenDevice(UnitEffect, frozen=True):
    """FOPEN: open a device. `how`: the text of the instruction, such as "/LOCAL_PORT 11000 /CLIENTS 1"."""

    how: str


class CommandDevice(UnitEffect, frozen=True):
    """FCMND: send a command number and its data to a device."""

    command: int
    data: str


class CloseFile(UnitEffect, frozen=True):
    """FCLOSE: close a file or another device."""


class DeleteFile(UnitEffect, frozen=True):
    """FDELETE: delete a file."""

    name: str


class ReadRecord(UnitEffect, frozen=True):
    """READ: read a line. The answer is the next line, or None if there is none. `notices`: report opened and closed
    connections in the status; `wait`: wait for a line that has not arrived yet."""

    notices: bool = False
    wait: bool = True


class AwaitLine(UnitEffect, frozen=True):
    """Wait, because GETC found no character on a unit. The step is repeated when a character, or at the terminal a
    line, has arrived."""


class WriteRecord(UnitEffect, frozen=True):
    """WRITE: write a text. `newline`: the record ends after the text. `handle`: the handle of the connection, None for
    the connection of the last READ; `wait`: wait for a connection."""

    text: str
    newline: bool
    handle: int | None = None
    wait: bool = True


class RecordRefused(UnitEffect, frozen=True):
    """The record that was read does not fit the variables of READ. `code`: the error code, which becomes the status of
    the unit."""

    code: int


def checked_unit(number: float) -> int:
    """Return the number of a unit that can be read and written. Raises IllegalValue for other units."""
    if (unit := whole(number)) != TERMINAL and unit not in DISKS and unit not in OTHERS:
        raise IllegalValue(f"logical unit {plain(number)}", UNITS)
    return unit


def checked_disk(number: float, word: str) -> int:
    """Return the number of a disk unit. Raises IllegalValue for other units."""
    if (unit := checked_unit(number)) not in DISKS:
        raise IllegalValue(f"logical unit {unit}", f"{word} wants one of the disk: 5 to 8, 17 to 19")
    return unit


def checked_open(number: float, word: str) -> int:
    """Return the number of a unit that can be opened and closed. Raises IllegalValue for other units."""
    if (unit := checked_unit(number)) == TERMINAL:
        raise IllegalValue(f"logical unit {unit}", f"{word} wants one of the disk or another device: 5 to 19")
    return unit


def checked_device(device: str | None, unit: int | None) -> str | None:
    """Return the name of the device for a unit, or None for the device that the unit number implies. Raises
    IllegalValue."""
    name = "" if device is None else device.strip().upper()
    usual = USUAL_DEVICES.get(name)
    if not name and unit in OTHERS:
        raise IllegalValue(f"logical unit {unit}", f'name its device: ATTACH ({unit}) "TCP"')
    if not name or (usual is not None and (unit in usual or (unit is None and usual is DISKS))):
        return None
    if usual is not None or unit in (ROBOT, TERMINAL):
        raise IllegalValue(f"the device {device} with logical unit {unit}", UNITS)
    return name
