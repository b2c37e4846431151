"""The driver of a running program: performs what the program asks, in the time of the robot's clock.

Program and motion run side by side: a motion is begun and the program goes on; the next motion waits until it may
begin. Nothing here is faster or slower than the clock that was passed in, so a program gives the same timeline in
virtual and in real time.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
from typing import Protocol

from vrs_cli.engine.engine import Engine
from vrs_cli.errors import TimeExhausted, VrsError
from vrs_cli.language.effects import CycleBegins, Prompt, Type, Wait
from vrs_cli.language.runtime import Budget, Completed, Event, Failed, Halted, Paused, ProgramFault, Task
from vrs_cli.trajectory.instant import on_grid

WAIT_TICK = on_grid(0.028)  # [s] a WAIT is tested, and a busy loop seen to be one, every trajectory tick of VAL-II
LONGEST = 86_400.0  # [s] of virtual time that a program may take unless told otherwise: a day


class Console(Protocol):
    """What a running program needs of a terminal."""

    def type(self, text: str, newline: bool) -> None:
        """TYPE output."""

    def ask(self, prompt: str) -> str:
        """PROMPT: one line. Raises VrsError when there is no more input."""


class Outcome(Enum):
    """How a run ended; `value` is VAL-II's word for it."""

    COMPLETED = "Program completed"
    HALTED = "(HALTED)"
    PAUSED = "(PAUSED)"
    ABORTED = "(ABORTED)"
    FAILED = "error"


@dataclass(frozen=True, slots=True)
class RunResult:
    """A run of a program: cycles completed, robot clock at begin and end [s], what it typed, what went wrong."""

    program: str
    cycles: int
    started: float
    ended: float
    typed: tuple[str, ...]
    fault: ProgramFault | None
    outcome: Outcome


@dataclass(frozen=True, slots=True)
class Bounds:
    """When a program is stopped that does not stop by itself."""

    max_time: float = LONGEST
    max_steps: int | None = None


A_DAY = Bounds()


class Driver:
    """Runs one task on one robot. `progress` is told the clock now and then; `interrupt` stops the run.

    `at_prompt`: the task is one instruction of the prompt. Its motion is over when it returns, and one with a time
    stamp leaves the clock alone; a program that it CALLs runs as any other.
    """

    def __init__(
        self,
        engine: Engine,
        console: Console,
        task: Task,
        bounds: Bounds = A_DAY,
        progress: Callable[[float], None] | None = None,
        at_prompt: bool = False,
    ) -> None:
        self.engine, self.console, self.task, self.bounds = engine, console, task, bounds
        self.progress, self.at_prompt = progress, at_prompt
        self.error: VrsError | None = None
        self.started = engine.now
        self.typed: list[str] = []
        self._line = ""
        self._interrupted = False
        self._ending: tuple[Outcome, ProgramFault | None] | None = None

    def interrupt(self) -> None:
        """Stop the program before its next step and the robot as soon as it can. Safe in a signal handler."""
        self._interrupted = True

    def run(self) -> RunResult:
        """Until the program completes, halts, pauses, fails or is interrupted."""
        answer: str | None = None
        self._ending = None
        while self._ending is None:
            if self._interrupted:
                self._abort()
                break
            answer = self._perform(self.task.resume(answer))
            if self.progress is not None:
                self.progress(self.engine.now)
        if self._line:
            self._type(Type("", newline=True))
        outcome, fault = self._ending or (Outcome.ABORTED, None)
        return RunResult(
            self.task.program, self.task.cycles_done, self.started, self.engine.now, tuple(self.typed), fault, outcome
        )

    def _perform(self, event: Event) -> str | None:
        """Do what the program asks; the answer of a PROMPT."""
        try:
            return self._effect(event)
        except VrsError as error:
            self._fail(self.task.throw(error))
            return None

    def _effect(self, event: Event) -> str | None:
        if isinstance(event, Type):
            self._type(event)
        elif isinstance(event, Prompt):
            return self.console.ask(event.text)
        elif isinstance(event, Wait):
            self._wait(event)
        elif isinstance(event, Budget):
            self._let_time_pass(WAIT_TICK)
        elif isinstance(event, CycleBegins):
            for setting in event.settings:
                self.engine.perform(setting)
        elif isinstance(event, Completed | Halted | Paused | Failed):
            self._end(event)
        else:
            self.engine.perform(event, program=self._in_program)
            self._check_bounds()
        return None

    @property
    def _in_program(self) -> bool:
        return not self.at_prompt or len(self.task.stack) > 1

    # --- effects ---

    def _type(self, event: Type) -> None:
        if self.engine.parameters.switch("MESSAGES"):
            self.console.type(event.text, event.newline)
        *lines, self._line = (self._line + event.text + ("\n" if event.newline else "")).split("\n")
        self.typed += lines

    def _wait(self, wait: Wait) -> None:
        for _ in range(wait.ticks):
            self._let_time_pass(WAIT_TICK)
        while not wait.condition() and not self._interrupted:
            self._let_time_pass(WAIT_TICK)
            if self.progress is not None:
                self.progress(self.engine.now)

    def _let_time_pass(self, seconds: float) -> None:
        self.engine.clock.advance(on_grid(self.engine.now) + seconds)
        self._check_bounds()

    def _check_bounds(self) -> None:
        if self.engine.now - self.started > self.bounds.max_time:
            raise TimeExhausted(
                f"the program was still running after {self.bounds.max_time:g} s of the robot's time",
                "it waits for something that does not come, or give it more time with --max-time",
            )
        if self.bounds.max_steps is not None and self.task.steps_done > self.bounds.max_steps:
            raise TimeExhausted(f"the program was still running after {self.bounds.max_steps} steps")

    # --- endings ---

    def _end(self, event: Completed | Halted | Paused | Failed) -> None:
        if isinstance(event, Failed):
            self._fail(event)
            return
        if not self.at_prompt:
            self.engine.wait_for_rest()
        self._ending = (_ENDINGS[type(event)], None)

    def _fail(self, event: Event) -> None:
        assert isinstance(event, Failed)
        if not self.at_prompt:
            self.engine.wait_for_rest()
        self.error = event.error
        self._ending = (Outcome.FAILED, event.fault)

    def _abort(self) -> None:
        self.task.abort()
        self.engine.stop()
        self.engine.wait_for_rest()
        self._ending = (Outcome.ABORTED, None)


_ENDINGS = {Completed: Outcome.COMPLETED, Halted: Outcome.HALTED, Paused: Outcome.PAUSED}
