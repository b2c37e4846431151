"""A task on its way through time: when it goes on, and what it waits for."""

from __future__ import annotations

from msgspec import Struct, field

from vrs_cli.errors import VrsError
from vrs_cli.interfaces.tasks.debugging import Onward, Stepping, Stopped
from vrs_cli.interfaces.tasks.holder_times import THE_ROBOTS, HolderTimes
from vrs_cli.language.run.effects import Event, Prompt, Wait, WaitEvent
from vrs_cli.language.run.runtime import Task
from vrs_cli.language.run.units import AwaitLine, ReadRecord, UnitEffect
from vrs_cli.values.commands import Request
from vrs_cli.values.questions import LineWanted
from vrs_cli.values.results import ProgramFault, RunOutcome

ROBOT_PROGRAM = 0
PROMPT_LINE = -1  # the number of the task that a line of the prompt is


class Aborted(Struct, frozen=True):
    """What a task waits with that is stopped from outside: until the robot is at rest."""


class PendingInput(Struct, frozen=True):
    """What a task waits with for a line of the terminal: `number` is that of the question, `event` what it asked."""

    number: int
    event: Prompt | ReadRecord | AwaitLine

    @property
    def question(self) -> LineWanted:
        """As whoever drives is asked."""
        if not isinstance(self.event, Prompt):
            return LineWanted("")
        wrong = self.event.wrong
        return LineWanted(self.event.text, "" if wrong is None else str(wrong))


Pending = Event | Aborted | Stopped | Onward | PendingInput


class Track(Struct, eq=False):
    """A task on its way: it goes on at `wake` [s], after `pending` is done where that is not None.

    `outcome` is None while it runs. `asked`: when `pending` was asked for. `mine`: it takes the robot when it goes on;
    `awaited`: somebody waits for its end. `instant`: when it last went on, `before`: how many steps it had done then.
    `held`: what reactions have interrupted, and when that was asked for. `driven_by`: whoever let it go on last, who
    gets its questions; None where that one has gone. `times`: of who typed the line that it is; `issued`: when that
    was, until its first request. `event`: whether it is set, `event_signal`: the input that sets it.
    """

    number: int
    task: Task
    wake: float = 0.0
    pending: Pending | None = None
    asked: float = 0.0
    answer: str | None = None
    outcome: RunOutcome | None = None
    fault: ProgramFault | None = None
    error: VrsError | None = None
    detail: str = ""
    mine: bool = False
    awaited: bool = False
    event: bool = False
    event_signal: int | None = None
    run_signal: int | None = None
    stepping: Stepping | None = None
    instant: float = -1.0
    before: int = 0
    held: list[tuple[Pending, float]] = field(default_factory=list)
    driven_by: object = None
    times: HolderTimes = THE_ROBOTS
    issued: float | None = None

    @property
    def running(self) -> bool:
        return self.outcome is None

    @property
    def at_prompt(self) -> bool:
        return self.number == PROMPT_LINE

    @property
    def in_program(self) -> bool:
        """Not in a line of the prompt: its motion is over when it returns, and one with a time stamp leaves the clock
        alone; a program that it CALLs runs as any other."""
        return not self.at_prompt or len(self.task.stack) > 1

    @property
    def reacts(self) -> bool:
        """Whether a reaction is due that interrupts what it waits for: a WAIT or a peer; for REACTI also the robot."""
        due = self.task.reactions.due
        if due is None:
            return False
        return isinstance(self.pending, Wait | WaitEvent | UnitEffect) or (
            due.immediate and isinstance(self.pending, Request)
        )

    def until(self, instant: float, pending: Pending | None = None) -> None:
        """Go on at an instant [s], and no earlier."""
        self.wake, self.pending = instant, pending
