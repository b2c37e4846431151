"""Programs one step at a time: single steps, breakpoints, watched expressions, the trace of steps."""

from __future__ import annotations

from collections.abc import Callable

from msgspec import Struct, field

from vrs_cli.errors import VrsError
from vrs_cli.language.run.effects import Budget, Event
from vrs_cli.language.run.runtime import Task
from vrs_cli.language.words.values import key_of
from vrs_cli.values.numbers import Value


class Stopped(Struct, frozen=True):
    """The program stands before a step. `outcome`: STEPPED, BREAKPOINT or WATCHED; `detail`: what has changed."""

    outcome: str
    detail: str = ""


class Onward(Struct, frozen=True):
    """The program stands before a step, and goes on."""


ONWARD = Onward()


class Stepping(Struct):
    """One step: into a program that it calls (`depth` None), or over it, with so many programs on the stack.

    `begun`: the step is the one that is being done; before that the task comes to the step first.
    """

    over: bool
    begun: bool = False
    depth: int = 0

    def begin(self, task: Task) -> None:
        self.begun, self.depth = True, len(task.stack)

    def done(self, task: Task) -> bool:
        return not self.over or len(task.stack) <= self.depth


class Watch(Struct):
    """An expression, its text and what it was when it was last looked at; None: it had no value."""

    text: str
    evaluate: Callable[[], Value]
    shown: Callable[[Value], str]
    last: Value | None = None

    def value(self) -> Value | None:
        try:
            return self.evaluate()
        except VrsError:
            return None

    def changed(self) -> str:
        """What it has become, empty where it is what it was."""
        value, self.last, before = self.value(), None, self.last
        self.last = value
        if value == before:
            return ""
        return f"{self.text} is {self._text(value)}, was {self._text(before)}"

    def _text(self, value: Value | None) -> str:
        return "undefined" if value is None else self.shown(value)


class Debugging(Struct):
    """Where programs stop: `breakpoints` are program keys and steps (from 1)."""

    breakpoints: set[tuple[str, int]] = field(default_factory=set)
    watches: list[Watch] = field(default_factory=list)

    @property
    def active(self) -> bool:
        return bool(self.breakpoints or self.watches)

    def step(
        self, task: Task, answer: str | None, stepping: Stepping | None, trace: Callable[[Task], None]
    ) -> Event | Stopped | Onward:
        """What a task wants in its present step, or that it stands before the next one. `trace` is told each step."""
        if task.between:
            trace(task)
            if stepping is not None and not stepping.begun:
                stepping.begin(task)
        event = task.resume(answer, 1)
        return event if not isinstance(event, Budget) else self._before(task, stepping)

    def _before(self, task: Task, stepping: Stepping | None) -> Stopped | Onward:
        """Whether the program stops before the step that it has come to."""
        changes = [change for watch in self.watches if (change := watch.changed())]
        if changes:
            return Stopped("WATCHED", "; ".join(changes))
        if stepping is not None:
            return Stopped("STEPPED") if stepping.begun and stepping.done(task) else ONWARD
        if (key_of(task.program), task.step) in self.breakpoints:
            return Stopped("BREAKPOINT")
        return ONWARD
