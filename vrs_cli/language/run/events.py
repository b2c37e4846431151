"""What a task says to its driver, and how a program ends."""

from __future__ import annotations

from collections.abc import Mapping
from enum import Enum

from msgspec import Struct

from vrs_cli.engine.commands import Request
from vrs_cli.errors import Place, VrsError
from vrs_cli.language.run.effects import (
    AttachRobot,
    ControlTask,
    CycleBegins,
    DetachRobot,
    Prompt,
    RunSignal,
    SetEvent,
    StartTask,
    Type,
    Wait,
    WaitEvent,
)
from vrs_cli.language.run.units import UnitEffect


class ProgramFault(Struct, frozen=True):
    """Where a program stopped with an error. `step` counts from 1; `line` is that of its file; `source` its text.

    `text` is VAL-II's message, `message` the whole of it with what happened and what would be right. `numbers`: those
    of the error.
    """

    code: int
    text: str
    message: str
    program: str
    step: int
    line: int
    source: str
    numbers: Mapping[str, float | Place]


class Completed(Struct, frozen=True):
    """The last cycle has ended."""

    cycles: int


class Paused(Struct, frozen=True):
    """PAUSE: `resume` goes on with the next step."""

    program: str
    step: int


class Halted(Struct, frozen=True):
    """HALT: the end."""

    program: str
    step: int


class Failed(Struct, frozen=True):
    """A step could not be done. `resume` goes on with the next step, `retry` first repeats it."""

    fault: ProgramFault
    error: VrsError


class Budget(Struct, frozen=True):
    """So many steps were done, and nothing is asked for."""


TaskRequest = WaitEvent | SetEvent | RunSignal | StartTask | ControlTask | AttachRobot | DetachRobot


Event = (
    Request
    | Type
    | Prompt
    | Wait
    | TaskRequest
    | UnitEffect
    | CycleBegins
    | Completed
    | Paused
    | Halted
    | Failed
    | Budget
)


class TaskState(Enum):
    RUNNING = "running"
    PAUSED = "paused"
    FAILED = "failed"
    HALTED = "halted"
    ABORTED = "aborted"
    COMPLETED = "completed"
