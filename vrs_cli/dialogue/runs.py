"""How a run of a program ended."""

from __future__ import annotations

from enum import Enum

from msgspec import Struct

from vrs_cli.dialogue.spoken import Spoken
from vrs_cli.language.run.effects import ProgramFault


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


class Beside(Struct, frozen=True):
    """Another task that stopped with an error, and when it did [s]."""

    number: int
    fault: ProgramFault
    at: float

    @property
    def where(self) -> str:
        return f"task {self.number} at {self.at:.3f} s"


class RunResult(Spoken, frozen=True):
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
