"""The state of one user of a robot: a robot has many users, and one set of programs."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Protocol, TypeVar

from vrs_cli.interfaces.dialogue import Dialogue
from vrs_cli.interfaces.rights import THE_ROBOTS, HolderTimes
from vrs_cli.kinematics.transform import Transform
from vrs_cli.language.text.ast import Statement
from vrs_cli.language.words.word import Role
from vrs_cli.values.diagnostics import Diagnostic
from vrs_cli.values.hand import DragState
from vrs_cli.values.questions import OnScreen
from vrs_cli.values.replies import Reply

if TYPE_CHECKING:
    from vrs_cli.interfaces.streams import Dragging

R = TypeVar("R")


class LineEditor(Protocol):
    """An open EDIT, which takes lines and puts a program in memory."""

    @property
    def name(self) -> str: ...
    @property
    def prompt(self) -> str: ...
    @property
    def done(self) -> bool: ...
    @property
    def changed(self) -> bool:
        """Return whether leaving it now would lose something."""

    @property
    def source(self) -> str:
        """The program as a file would hold it."""

    def take(self, line: str) -> Dialogue[tuple[Reply, ...]]:
        """Carry out a line. Raises LineRefused, VrsError."""

    def mistake(self, line: str) -> Diagnostic | None:
        """Return the mistake in a line that is not sent yet."""


MAX_TYPED_LINES = 1000  # lines that HISTORY knows


@dataclass(eq=False)
class UserState:
    """The state of a user. `attended`: a person is there, who can be asked. `lives`: the user types on while a program
    runs, and does not wait for its end.

    `times`: how the user's clock differs from the robot's; `issued`: when the present line was given, by the robot's
    clock, as the user claims [s].

    `editor`: EDIT is open, and takes the lines; `last_edited`: its program, or that of the editor before. `on_screen`:
    the program of SEE, the arm of JOG, the recording of REPLAY, while it fills the screen. `drafted`: the unsaved text
    of SEE, as a file would hold it. `last_statement`: a bare DO repeats it. `typed`: the lines so far. `command_files`:
    those that are carried out, the innermost last. `interrupted`, by Ctrl-C or ABORT: the lines after the present one
    are dropped. `left`: the user has gone, and the program that this user waited for goes on.
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
    typed: deque[str] = field(default_factory=lambda: deque(maxlen=MAX_TYPED_LINES))
    interrupted: bool = False
    left: bool = False

    def show(self, it: object, question: OnScreen) -> Dialogue[bool]:
        """Let something fill the screen until the user leaves it. Return False if the user has no such screen."""
        self.on_screen = it
        try:
            return (yield question) is not None
        finally:
            self.on_screen, self.drafted = None, ""

    def with_issue_time(self, issued: float | None, dialogue: Dialogue[R]) -> Dialogue[R]:
        """Carry out a dialogue for a line that was issued at a time of the robot's clock [s]."""
        self.issued = issued
        try:
            return (yield from dialogue)
        finally:
            self.issued = None


@dataclass(eq=False)
class TargetStream:
    """The stream of targets that moves the robot now. `steered`: the user whose targets are joints.

    For a dragged tool: `dragging` follows the wishes of `user_state`; the last `wish` was `issued` then by the user's
    clock [s], and `heard` by the robot's. `spent`: the user whose drag was broken off. `pulled`: the state that all
    users are told. `version` of the timeline and `stops` (how often the robot was stopped) are as after the last
    target.
    """

    pulled: DragState = field(default_factory=DragState)
    dragging: Dragging | None = None
    user_state: UserState | None = None
    wish: Transform | None = None
    issued: float | None = None
    heard: float = 0.0
    spent: UserState | None = None
    steered: UserState | None = None
    version: int = 0
    stops: int = 0
