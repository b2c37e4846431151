"""A run of a program: when it is stopped, and how it ended."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

from vrs_cli.language.events import ProgramFault

GO_ON = "SIGNAL sets an input that is waited for; RETRY lets a program go on"  # what helps at a prompt
LONGEST = 86_400.0  # [s] of virtual time that a program may take unless told otherwise: a day


class Outcome(Enum):
    """How a run ended; `value` is VAL-II's word for it."""

    COMPLETED = "Program completed"
    HALTED = "(HALTED)"
    PAUSED = "(PAUSED)"
    ABORTED = "(ABORTED)"
    FAILED = "error"
    STEPPED = "(STEP)"
    BREAKPOINT = "(BREAKPOINT)"
    WATCHED = "(WATCH)"


@dataclass(frozen=True, slots=True)
class Beside:
    """Another task that stopped with an error, and when it did [s]."""

    number: int
    fault: ProgramFault
    at: float

    @property
    def where(self) -> str:
        return f"task {self.number} at {self.at:.3f} s"


@dataclass(frozen=True, slots=True)
class RunResult:
    """A run of a program: cycles completed, robot clock at begin and end [s], what it typed, what went wrong.

    `beside`: the other tasks that stopped with an error; `detail`: what a watched expression has become.
    """

    program: str
    cycles: int
    started: float
    ended: float
    typed: tuple[str, ...]
    fault: ProgramFault | None
    outcome: Outcome
    beside: tuple[Beside, ...] = ()
    detail: str = ""


@dataclass(frozen=True, slots=True)
class Bounds:
    """When a program is stopped that does not stop by itself, and what is said to help then."""

    max_time: float = LONGEST
    max_steps: int | None = None
    more_time: str = GO_ON
    more_steps: str = GO_ON


A_DAY = Bounds()
