"""What belongs to one who types: a robot has many desks, and one set of programs."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field
from pathlib import Path
from typing import Protocol, TypeVar

from vrs_cli.interfaces.dialogue import Dialogue
from vrs_cli.interfaces.tasks.holder_times import THE_ROBOTS, HolderTimes
from vrs_cli.language.text.ast import Statement
from vrs_cli.language.words.word import Role
from vrs_cli.values.diagnostics import Diagnostic
from vrs_cli.values.questions import OnScreen
from vrs_cli.values.replies import Reply

R = TypeVar("R")


class LineEditor(Protocol):
    """An editor that is open: lines go to it, and it puts a program in memory."""

    @property
    def name(self) -> str: ...
    @property
    def prompt(self) -> str: ...
    @property
    def done(self) -> bool: ...
    @property
    def changed(self) -> bool:
        """Whether something would be lost if it were left now."""

    @property
    def text(self) -> str:
        """The program as a file would hold it."""

    def take(self, line: str) -> Dialogue[tuple[Reply, ...]]:
        """Do what a line says. Raises LineRefused, VrsError."""

    def mistake(self, line: str) -> Diagnostic | None:
        """What is wrong with a line that is not sent yet."""


MOST_TYPED = 1000  # lines that HISTORY knows


@dataclass(eq=False)
class UserState:
    """`name` and `role` are those of who is at it. `attended`: a person is there, who can be asked. `lives`: whoever
    types goes on while a program runs, and nobody waits for its end.

    `times`: how its times are those of the robot; `issued`: when the present line was given, as who is at it says, by
    the robot's clock [s].

    `editor`: EDIT is open, and lines go to it; `last_edited` is its program, or that of the one before. `on_screen`:
    the program of SEE, the arm of JOG, the recording of REPLAY, while it fills the screen. `drafted`: that program
    while it is changed and not stored, as a file would hold it. `last_statement` is what a bare DO repeats,
    `typed` are the lines so far,
    `command_files` are those that are carried out, the innermost last. `interrupted`, by Ctrl-C or ABORT: what was to
    come after the present line does not. `left`: whoever was at it has gone, and a program that was waited for goes on.
    """

    name: str = ""
    role: Role = Role.SUPERVISOR
    attended: bool = False
    lives: bool = False
    times: HolderTimes = THE_ROBOTS
    issued: float | None = None
    editor: LineEditor | None = None
    last_edited: str | None = None
    on_screen: object = None
    drafted: str = ""
    last_statement: Statement | None = None
    command_files: list[Path] = field(default_factory=list)
    typed: deque[str] = field(default_factory=lambda: deque(maxlen=MOST_TYPED))
    interrupted: bool = False
    left: bool = False

    def show(self, it: object, question: OnScreen) -> Dialogue[bool]:
        """Let something fill the screen until the user leaves it. Whether there is a screen for it."""
        self.on_screen = it
        try:
            return (yield question) is not None
        finally:
            self.on_screen = None

    def given(self, issued: float | None, dialogue: Dialogue[R]) -> Dialogue[R]:
        """A talk about what was given at that time, by the robot's clock [s]."""
        self.issued = issued
        try:
            return (yield from dialogue)
        finally:
            self.issued = None
