"""Define the effects that a running program requests from its driver (the code that runs its task), the events that end
the program, and the reactions of its task.

A request of `values.commands` is for the robot; the effects below are for everything else. Some effects are carried out
by the task itself, not by the driver; their docstrings say so.

A reaction is a program that is called when a signal changes (REACT, REACTI) or a step fails (REACTE; val2 9.12-13).
After the change of its signal, a reaction waits until its priority is above the program's; then the task calls it
between two steps. During the reaction the task has the reaction's priority; RETURN restores the old one.

Logical units are the numbers by which programs refer to devices. A failure outside the program (a missing file, the end
of a file, a full disk) does not stop it: the error code becomes the status of the unit, which IOSTAT returns (V+
Language User's Guide, Error Status). A mistake in the program, such as using a unit that is not attached, stops it.
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
    """An action that a running program requests from its driver or its task, other than a request to the robot."""


Event = Request | Effect
LAST_TASK = 27  # highest task number; the first is 0 (V+ Language User's Guide)
PROCESS_CONTROL = 1  # number of the task for the process control program of VAL-II (PCEXECUTE, PCABORT)
Answers = Generator[Event, str | None, None]  # a generator that receives the driver's answer to an effect


class Type(Effect, frozen=True):
    """Show a string at the terminal. `newline`: end the line after the string."""

    text: str
    newline: bool = True


class Prompt(Effect, frozen=True):
    """Show a string at the terminal and read a line; the driver passes the line to `Task.resume`. `count`: the number
    of values that the line must contain; `wrong`: the mistake in the previous line, if this prompt repeats the
    question."""

    text: str
    count: int
    wrong: VrsError | None = None


class Wait(Effect, frozen=True):
    """Hold the program until `condition()` is true.

    The driver first tests the condition after `ticks` (0: immediately), then every tick (28 ms). If the condition
    raises VrsError, the driver passes the error to `Task.throw`.
    """

    condition: Callable[[], bool]
    ticks: int = 0


class WaitEvent(Effect, frozen=True):
    """WAIT.EVENT: hold the program until its task's event (a flag) is set, or `seconds` have passed (None: no time
    limit). If `event` is False, only the time counts."""

    event: bool
    seconds: float | None = None


class SetEvent(Effect, frozen=True):
    """SET.EVENT, or CLEAR.EVENT if not `on`: set or clear the event (a flag) of a task. `task`: the task's number, None
    for the task of the program."""

    task: int | None
    on: bool = True


class EventSignal(Effect, frozen=True):
    """INT.EVENT: choose the input signal that sets the task's event when it turns on. `signal`: the number of the
    signal, or None for no signal."""

    signal: int | None


class CycleBegins(Effect, frozen=True):
    """A cycle of the main program begins. `cycle`: its number, from 1; `settings`: requests that set speed and modes
    back to their defaults, which the driver carries out (val2 section 9.1)."""

    cycle: int
    settings: tuple[Request, ...]


class CallProgram(Effect, frozen=True):
    """CALL: call a program; the task carries it out. `name`: the program's name; `site`: the number of this call in the
    calling program, None for a call by CALLS or for a reaction."""

    name: str
    arguments: tuple[Given | None, ...]
    site: int | None = None


class BrokenOff(Effect, frozen=True):
    """A direct call (see `compile.direct`) has stopped because the task's time slice ended; the task continues it.
    `frames`: one tuple for each called program, the innermost first: the executable, the arguments and private
    variables, the operation, the limits of FOR and subjects of CASE, and whether the operation has already made a
    call."""

    frames: tuple[Any, ...]


class Return(Effect, frozen=True):
    """RETURN, or the end of a program; the task carries it out. `steps`: the number of steps to skip after the call.
    `mended` (for RETURNE): skip the step whose failure started the REACTE routine, rather than repeat it."""

    steps: int = 0
    mended: bool = False


class Stop(Effect, frozen=True):
    """STOP: end the current cycle of the main program; the task carries it out."""


class Pause(Effect, frozen=True):
    """PAUSE: stop the program. `Task.resume` then continues with the next step."""


class Halt(Effect, frozen=True):
    """HALT: end the program. It cannot be resumed."""


class LookAround(Effect, frozen=True):
    """A break between two steps in which the task checks whether it must call a reaction, for instance after a
    SIGNAL."""


class RunSignal(Effect, frozen=True):
    """RUNSIG: set a signal while the program runs, and reset it at other times. `signal`: its number; negative: the
    signal is off while the program runs."""

    signal: int


class StartTask(Effect, frozen=True):
    """EXECUTE or PCEXECUTE in a program: start another task. `number`: the number of this task, None for the first free
    one; `step`: the step (from 1) where its first cycle begins."""

    number: int | None
    call: CallProgram
    cycles: int = 1
    step: int = 1


class TaskControl(Enum):
    """An instruction by which a program controls another task. The values are the instructions."""

    ABORT = "ABORT"
    KILL = "KILL"
    CYCLE_END = "CYCLE.END"
    PROCEED = "PROCEED"
    RETRY = "RETRY"


class ControlTask(Effect, frozen=True):
    control: TaskControl
    number: int


class AttachRobot(Effect, frozen=True):
    """ATTACH: reserve the robot for this task. The program waits until no other task has the robot."""


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
    """The last cycle of the main program has ended. `cycles`: the number of completed cycles."""

    cycles: int


class Failed(Effect, frozen=True):
    """A step has failed. `Task.resume` then continues with the next step, or after `Task.retry` with the failed
    one."""

    fault: ProgramFault
    error: VrsError


class Budget(Effect, frozen=True):
    """The number of steps given to `Task.resume` has been carried out. The driver does other work, then resumes."""


class TaskState(Enum):
    RUNNING = "running"
    PAUSED = "paused"
    FAILED = "failed"
    HALTED = "halted"
    ABORTED = "aborted"
    COMPLETED = "completed"


HIGHEST = 127  # maximum priority of a reaction to a signal, and of LOCK (V+ User's Guide p.46)
OF_ERRORS = 254  # priority of a REACTE routine (V+ User's Guide p.47)
DEFAULT_PRIORITY = 1  # priority of a reaction to a signal, if REACT gives none


class Reaction(Struct, frozen=True):
    """A reaction to a signal, set by REACT or REACTI. `signal`: the number of the signal; the reaction is called when
    it turns on, or if the number is negative, when it turns off. `program`: the name of the program to call;
    `immediate`: True for REACTI, which also stops the motion."""

    signal: int
    program: str
    priority: int = DEFAULT_PRIORITY
    immediate: bool = False


class Reactions:
    """The reactions of one task during a cycle. `priority`: the task's current priority; `on_error`: the name of the
    program set by REACTE, or None; `waiting`: the reactions whose signals have changed and that must still be
    called."""

    def __init__(self) -> None:
        self.clear()

    def clear(self) -> None:
        """Remove all reactions, and set the priority to 0 (each cycle begins like this)."""
        self.priority = 0
        self.on_error: str | None = None
        self._set: dict[int, Reaction] = {}
        self.waiting: list[Reaction] = []

    def set(self, reaction: Reaction) -> None:
        """Set a reaction, which replaces any earlier reaction to the same signal."""
        self.ignore(reaction.signal)
        self._set[abs(reaction.signal)] = reaction

    def ignore(self, signal: int) -> None:
        """Remove the reaction to a signal, even if it is waiting."""
        gone = self._set.pop(abs(signal), None)
        if gone in self.waiting:
            self.waiting.remove(gone)

    def note_change(self, signal: int, on: bool) -> bool:
        """Record that a signal has changed, and return whether a reaction to this is added to the waiting ones. A
        reaction that is already waiting is not added twice."""
        if (reaction := self._set.get(signal)) is None or (reaction.signal > 0) is not on or reaction in self.waiting:
            return False
        self.waiting.append(reaction)
        return True

    @property
    def due(self) -> Reaction | None:
        """Return the reaction that the task must call next: of the waiting reactions, the one with the highest
        priority, or the earliest of several. Return None if no reaction has a higher priority than the task."""
        if not self.waiting:
            return None
        first = max(self.waiting, key=lambda reaction: reaction.priority)
        return first if first.priority > self.priority else None


def checked_priority(priority: float, lowest: int) -> int:
    """Return a priority for REACT or LOCK as an integer. Raises IllegalValue unless it is from `lowest` to 127."""
    return integer_between(priority, lowest, HIGHEST, "a priority of")


def checked_signal(number: float) -> int:
    """Return a signal number for a reaction, rounded to an integer; negative means that the signal must turn off.
    Raises IllegalValue for 0."""
    if not round(number):
        raise IllegalValue("signal 0", "a signal number; negative: when it goes off")
    return round(number)


ROBOT = 0
TERMINAL = 4
DISKS = (5, 6, 7, 8, 17, 18, 19)
# units for other devices, which ATTACH must name (TCP, SERIAL:1); a disk unit can also be attached to such a device
OTHERS = tuple(range(9, 17))
USUAL_DEVICES = {"DISK": DISKS, "SYSTEM": DISKS, "TERMINAL": (TERMINAL,), "MONITOR": (TERMINAL,)}
UNITS = "0 is the robot, 4 the terminal, 5 to 8 and 17 to 19 are the disk, 9 to 16 other devices"

SUCCESS = 1  # status of a unit after an operation without an error
# status of a unit after READ has found that a connection was opened or closed (public V+ programs test these numbers)
OPENED, CLOSED = 100, 101
MODE_BITS = 7  # mask of the mode bits of ATTACH: 1 do not queue, 2 do not wait, 4 let the system choose a unit
CHOOSE = 4  # mode bit of ATTACH: let the system choose a unit
ANY = -1  # unit number in AttachUnit that lets the system choose a free unit
NO_WAIT = 1  # mode bit of READ and GETC: return immediately if there is no input


class Access(Enum):
    """The purpose for which a file is opened. The values are the instructions."""

    READ = "FOPENR"
    WRITE = "FOPENW"
    APPEND = "FOPENA"


class UnitEffect(Effect, frozen=True):
    """An operation on a logical unit. `unit`: the number of the unit."""

    unit: int


class AttachUnit(UnitEffect, frozen=True):
    """ATTACH: attach a logical unit to a device. The driver answers with the number of the unit; if `unit` is ANY, it
    chooses a free unit. `device`: the name of the device, None for the usual device of this unit."""

    device: str | None = None


class DetachUnit(UnitEffect, frozen=True):
    """DETACH: release a unit."""


class OpenFile(UnitEffect, frozen=True):
    """FOPENR, FOPENW, FOPENA: open a file."""

    name: str
    access: Access


class OpenDevice(UnitEffect, frozen=True):
    """FOPEN: open a device. `how`: the options in the instruction, such as "/LOCAL_PORT 11000 /CLIENTS 1"."""

    how: str


class CommandDevice(UnitEffect, frozen=True):
    """FCMND: send a command number and its data to a device."""

    command: int
    data: str


class CloseFile(UnitEffect, frozen=True):
    """FCLOSE: close the file or device that is open on a unit."""


class DeleteFile(UnitEffect, frozen=True):
    """FDELETE: delete a file."""

    name: str


class ReadRecord(UnitEffect, frozen=True):
    """READ: read a line. The driver's answer is the next line, or None if there is none. `notices`: let the status of
    the unit report opened and closed connections; `wait`: wait for a line if none has arrived yet."""

    notices: bool = False
    wait: bool = True


class AwaitLine(UnitEffect, frozen=True):
    """Wait for input on a unit, because GETC has found no character. When a character (at the terminal, a line) has
    arrived, the driver resumes the task, which repeats the step."""


class WriteRecord(UnitEffect, frozen=True):
    """WRITE: write a string. `newline`: end the record after the string. `handle`: the handle of the connection to
    write to, None for the connection of the last READ; `wait`: wait until there is a connection."""

    text: str
    newline: bool
    handle: int | None = None
    wait: bool = True


class RecordRefused(UnitEffect, frozen=True):
    """A report that the record from ReadRecord does not fit the variables of READ. `code`: the error code, which
    becomes the status of the unit."""

    code: int


def checked_unit(number: float) -> int:
    """Return the number of the terminal, a disk unit or a unit for other devices. Raises IllegalValue for any other
    number."""
    if (unit := whole(number)) != TERMINAL and unit not in DISKS and unit not in OTHERS:
        raise IllegalValue(f"logical unit {plain(number)}", UNITS)
    return unit


def checked_disk(number: float, word: str) -> int:
    """Return the number of a disk unit. `word`: the instruction, for the message. Raises IllegalValue for any other
    number."""
    if (unit := checked_unit(number)) not in DISKS:
        raise IllegalValue(f"logical unit {unit}", f"{word} wants one of the disk: 5 to 8, 17 to 19")
    return unit


def checked_open(number: float, word: str) -> int:
    """Return the number of a unit that can be opened and closed. `word`: the instruction, for the message. Raises
    IllegalValue for the terminal and unknown units."""
    if (unit := checked_unit(number)) == TERMINAL:
        raise IllegalValue(f"logical unit {unit}", f"{word} wants one of the disk or another device: 5 to 19")
    return unit


def checked_device(device: str | None, unit: int | None) -> str | None:
    """Return the name of the device for a unit in upper case, or None if it is the usual device of this unit. Raises
    IllegalValue if the device is missing or does not fit the unit."""
    name = "" if device is None else device.strip().upper()
    usual = USUAL_DEVICES.get(name)
    if not name and unit in OTHERS:
        raise IllegalValue(f"logical unit {unit}", f'name its device: ATTACH ({unit}) "TCP"')
    if not name or (usual is not None and (unit in usual or (unit is None and usual is DISKS))):
        return None
    if usual is not None or unit in (ROBOT, TERMINAL):
        raise IllegalValue(f"the device {device} with logical unit {unit}", UNITS)
    return name
