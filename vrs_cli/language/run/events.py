"""What a task says to its driver, and how a program ends."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

from vrs_cli.engine.commands import Request
from vrs_cli.errors import VrsError
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


@dataclass(frozen=True, slots=True)
class ProgramFault:
    """Where a program stopped with an error. `step` counts from 1; `line` is that of its file; `source` its text.

    `text` is VAL-II's message, `message` the whole of it with what happened and what would be right.
    """

    code: int
    text: str
    message: str
    program: str
    step: int
    line: int
    source: str


@dataclass(frozen=True, slots=True)
class Completed:
    """The last cycle has ended."""

    cycles: int


@dataclass(frozen=True, slots=True)
class Paused:
    """PAUSE: `resume` goes on with the next step."""

    program: str
    step: int


@dataclass(frozen=True, slots=True)
class Halted:
    """HALT: the end."""

    program: str
    step: int


@dataclass(frozen=True, slots=True)
class Failed:
    """A step could not be done. `resume` goes on with the next step, `retry` first repeats it."""

    fault: ProgramFault
    error: VrsError


@dataclass(frozen=True, slots=True)
class Budget:
    """So many steps were done, and nothing is asked for."""


Beside = WaitEvent | SetEvent | RunSignal | StartTask | ControlTask | AttachRobot | DetachRobot


Event = (
    Request | Type | Prompt | Wait | Beside | UnitEffect | CycleBegins | Completed | Paused | Halted | Failed | Budget
)


class TaskState(Enum):
    RUNNING = "running"
    PAUSED = "paused"
    FAILED = "failed"
    HALTED = "halted"
    ABORTED = "aborted"
    COMPLETED = "completed"
