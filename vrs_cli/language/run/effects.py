"""What a running program asks of its driver.

A request of `engine.commands` goes to the robot. The effects below are for the terminal and the clock.
"""

from __future__ import annotations

from collections.abc import Callable, Generator
from enum import Enum

from msgspec import Struct

from vrs_cli.engine.commands import Mode, Request, SetDuration, SetMode, SetSpeed, SpeedUnit
from vrs_cli.errors import VrsError
from vrs_cli.language.run.cells import Reference
from vrs_cli.language.run.reactions import Reaction
from vrs_cli.language.run.units import UnitEffect


class Type(Struct, frozen=True):
    """Text for the terminal; `newline`: a line ends after it."""

    text: str
    newline: bool = True


class Prompt(Struct, frozen=True):
    """Show the text and read one line, the answer to `resume`. `count`: how many values are wanted; `wrong`: why the
    line before could not be read, where there was one.
    """

    text: str
    count: int
    wrong: VrsError | None = None


class Wait(Struct, frozen=True):
    """Hold the program until `condition()` is true: asked at once, or after `ticks`, then every tick.

    The condition raises VrsError where it cannot be evaluated: the driver hands that to `Task.throw`.
    """

    condition: Callable[[], bool]
    ticks: int = 0


class WaitEvent(Struct, frozen=True):
    """WAIT.EVENT: hold the program until another sets its event, or for so many `seconds` where that is not None.

    `event`: whether an event ends it at all.
    """

    event: bool
    seconds: float | None = None


class SetEvent(Struct, frozen=True):
    """SET.EVENT: the event of a task."""

    task: int


class CycleBegins(Struct, frozen=True):
    """A cycle of the main program begins: the driver performs `settings` (val2 section 9.1). Cycles count from 1."""

    cycle: int
    settings: tuple[Request, ...]


class CallProgram(Struct, frozen=True):
    """CALL; the task does it by itself."""

    name: str
    arguments: tuple[Reference | None, ...]


class Return(Struct, frozen=True):
    """RETURN, or the end of a program; the task does it by itself. `steps`: how many after the call are left out."""

    steps: int = 0


class Stop(Struct, frozen=True):
    """STOP: the end of this cycle; the task does it by itself."""


class Pause(Struct, frozen=True):
    """PAUSE: the task says `Paused`."""


class Halt(Struct, frozen=True):
    """HALT: the task says `Halted`."""


class ReturnFromError(Struct, frozen=True):
    """RETURNE: RETURN, but from a REACTE routine to the step after the one that failed."""


class SignalsSet(Struct, frozen=True):
    """SIGNAL and its like: a reaction of the program itself may be due; the task looks by itself."""


class Ignore(Struct, frozen=True):
    """IGNORE: end the reaction to a signal; the task does it by itself."""

    signal: int


class Lock(Struct, frozen=True):
    """LOCK: the priority of the program; the task does it by itself."""

    priority: int


class ReactToErrors(Struct, frozen=True):
    """REACTE: call a program when a step fails, or (None) no longer; the task does it by itself."""

    program: str | None


class RunSignal(Struct, frozen=True):
    """RUNSIG: keep the signal in this state while the program runs, and in the other one while it does not."""

    signal: int


class StartTask(Struct, frozen=True):
    """EXECUTE in a program, PCEXECUTE: `number` is None for the first task that is free."""

    number: int | None
    call: CallProgram
    cycles: int = 1
    step: int = 1


class Control(Enum):
    """What a program may do with a task."""

    ABORT = "ABORT"
    KILL = "KILL"
    CYCLE_END = "CYCLE.END"
    PROCEED = "PROCEED"
    RETRY = "RETRY"


class ControlTask(Struct, frozen=True):
    control: Control
    number: int


class AttachRobot(Struct, frozen=True):
    """ATTACH: take the robot, as soon as no other task has it."""


class DetachRobot(Struct, frozen=True):
    """DETACH: let the robot go, once it is at rest."""


Effect = (
    Type
    | Prompt
    | Wait
    | WaitEvent
    | SetEvent
    | CycleBegins
    | CallProgram
    | Return
    | ReturnFromError
    | Stop
    | Pause
    | Halt
    | Reaction
    | SignalsSet
    | Ignore
    | Lock
    | ReactToErrors
    | RunSignal
    | StartTask
    | ControlTask
    | AttachRobot
    | DetachRobot
    | UnitEffect
)


Yielded = Request | Effect
Answers = Generator[Yielded, str | None, None]


CYCLE_SETTINGS: tuple[Request, ...] = (
    SetSpeed(100.0, 100.0, SpeedUnit.PERCENT, always=True),
    SetDuration(0.0, always=True),
    SetMode(Mode.COARSE, on=False, always=True, tolerance=100.0),
    SetMode(Mode.NULLING, on=True, always=True),
    SetMode(Mode.CONTINUOUS_PATH, on=True, always=True),
    SetMode(Mode.SINGLE, on=False, always=True),
    SetMode(Mode.OVERLAP, on=True, always=True),
    SetMode(Mode.INTEGRAL, on=False, always=True),
)
