"""What a running program asks of its driver, and how it ends.

A request of `engine.commands` goes to the robot, the effects below to all else. No driver sees what "the task does by
itself".
"""

from __future__ import annotations

from collections.abc import Callable, Generator
from enum import Enum

from msgspec import Struct

from vrs_cli.errors import VrsError
from vrs_cli.language.run.cells import Reference
from vrs_cli.values.commands import Mode, Request, SetAlter, SetDuration, SetMode, SetSpeed, SpeedUnit
from vrs_cli.values.results import ProgramFault


class Effect(Struct, frozen=True):
    """What a task tells its driver, beside the requests to the robot."""


Event = Request | Effect
LAST_TASK = 27  # V+ Language User's Guide: tasks 0 to 27
PROCESS_CONTROL = 1  # the task that the PC commands of VAL-II mean
Answers = Generator[Event, str | None, None]  # a driver sends the answer to an effect that asks


class Type(Effect, frozen=True):
    """Text for the terminal; `newline`: a line ends after it."""

    text: str
    newline: bool = True


class Prompt(Effect, frozen=True):
    """Show the text and read one line, the answer to `resume`. `count`: how many values are wanted; `wrong`: why the
    line before could not be read, where there was one.
    """

    text: str
    count: int
    wrong: VrsError | None = None


class Wait(Effect, frozen=True):
    """Hold the program until `condition()` is true: asked at once, or after `ticks`, then every tick.

    The condition raises VrsError where it cannot be evaluated: the driver hands that to `Task.throw`.
    """

    condition: Callable[[], bool]
    ticks: int = 0


class WaitEvent(Effect, frozen=True):
    """WAIT.EVENT: hold the program until another sets its event, or for so many `seconds` where that is not None.

    `event`: whether an event ends it at all.
    """

    event: bool
    seconds: float | None = None


class SetEvent(Effect, frozen=True):
    """SET.EVENT; CLEAR.EVENT where it is not `on`. `task`: None for the one that says so."""

    task: int | None
    on: bool = True


class EventSignal(Effect, frozen=True):
    """INT.EVENT: the input signal that sets the event of the task when it goes on; None for no signal any more."""

    signal: int | None


class CycleBegins(Effect, frozen=True):
    """A cycle of the main program begins: the driver performs `settings` (val2 section 9.1). Cycles count from 1."""

    cycle: int
    settings: tuple[Request, ...]


class CallProgram(Effect, frozen=True):
    """CALL; the task does it by itself."""

    name: str
    arguments: tuple[Reference | None, ...]


class Return(Effect, frozen=True):
    """RETURN, or the end of a program; the task does it by itself. `steps`: how many after the call are left out;
    `mended` (RETURNE): the step that failed before a REACTE routine is left out, too.
    """

    steps: int = 0
    mended: bool = False


class Stop(Effect, frozen=True):
    """STOP: the end of this cycle; the task does it by itself."""


class Pause(Effect, frozen=True):
    """PAUSE: `resume` goes on with the next step."""


class Halt(Effect, frozen=True):
    """HALT: the end."""


class LookAround(Effect, frozen=True):
    """A reaction may be due now, as after a SIGNAL of the program itself; the task does it by itself."""


class Ignore(Effect, frozen=True):
    """IGNORE: end the reaction to a signal; the task does it by itself."""

    signal: int


class Lock(Effect, frozen=True):
    """LOCK: the priority of the program; the task does it by itself."""

    priority: int


class ReactToErrors(Effect, frozen=True):
    """REACTE: call a program when a step fails, or (None) no longer; the task does it by itself."""

    program: str | None


class RunSignal(Effect, frozen=True):
    """RUNSIG: keep the signal in this state while the program runs, and in the other one while it does not."""

    signal: int


class StartTask(Effect, frozen=True):
    """EXECUTE in a program, PCEXECUTE: `number` is None for the first task that is free."""

    number: int | None
    call: CallProgram
    cycles: int = 1
    step: int = 1


class TaskControl(Enum):
    """What a program may do with a task."""

    ABORT = "ABORT"
    KILL = "KILL"
    CYCLE_END = "CYCLE.END"
    PROCEED = "PROCEED"
    RETRY = "RETRY"


class ControlTask(Effect, frozen=True):
    control: TaskControl
    number: int


class AttachRobot(Effect, frozen=True):
    """ATTACH: take the robot, as soon as no other task has it."""


class DetachRobot(Effect, frozen=True):
    """DETACH: let the robot go, once it is at rest."""


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
    """A step could not be done. `resume` goes on with the next step, `retry` first repeats it."""

    fault: ProgramFault
    error: VrsError


class Budget(Effect, frozen=True):
    """So many steps were done, and nothing is asked for."""


class TaskState(Enum):
    RUNNING = "running"
    PAUSED = "paused"
    FAILED = "failed"
    HALTED = "halted"
    ABORTED = "aborted"
    COMPLETED = "completed"
