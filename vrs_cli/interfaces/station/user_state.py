"""The state of one user of a robot: a robot has many users, and one set of programs."""

from __future__ import annotations

from collections import deque
from enum import Enum, auto
from pathlib import Path
from typing import TYPE_CHECKING, Protocol, TypeVar

from msgspec import Struct, field

from vrs_cli.interfaces.dialogue import Dialogue
from vrs_cli.interfaces.rights import THE_ROBOTS, HolderTimes
from vrs_cli.kinematics.transform import Transform
from vrs_cli.language.text.ast import Statement
from vrs_cli.language.words.word import Role
from vrs_cli.values.diagnostics import Diagnostic
from vrs_cli.values.questions import OnScreen
from vrs_cli.values.replies import Reply

if TYPE_CHECKING:
    from vrs_cli.interfaces.dragging import Dragging

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
        """Return whether leaving the editor now would lose changes."""

    @property
    def source(self) -> str:
        """The program as the text of a file."""

    def take(self, line: str) -> Dialogue[tuple[Reply, ...]]:
        """Carry out a line. Raises LineRefused, VrsError."""

    def mistake(self, line: str) -> Diagnostic | None:
        """Return the mistake in a line that was not sent yet."""


class StreamKind(Enum):
    """How a user sends a stream of targets: as joints, by dragging the tool, by a button that is held down, or by the
    keys of JOG.
    """

    STEER = auto()
    DRAG = auto()
    BUTTON = auto()
    KEYS = auto()


class TargetStream(Struct, eq=False):
    """A stream of targets that a user has opened and not closed. `ended`: why the robot follows no more targets of it;
    empty as long as the robot does. `version`: that of the timeline after the last target.

    Of a dragged tool: `dragging` follows the last requested pose, `wish`, which the user sent at the time `issued` of
    the user's clock, and which arrived at the time `heard` of the robot's clock [s].
    """

    kind: StreamKind
    user_state: UserState
    ended: str = ""
    version: int = -1
    dragging: Dragging | None = None
    wish: Transform | None = None
    issued: float | None = None
    heard: float = 0.0


STOPPED = "something else has moved or stopped the robot"  # why a stream has ended
MAX_TYPED_LINES = 1000  # maximum number of lines that HISTORY keeps


class UserState(Struct, eq=False, weakref=True):
    """The state of a user. `attended`: a person is there who can be asked. `lives`: the user goes on typing while a
    program runs, and does not wait for its end.

    `times`: how the user's clock differs from the robot's; `issued`: when the present line was given, by the robot's
    clock, as the user claims [s].

    `editor`: the open EDIT, which takes the lines; `last_edited`: its program, or that of the last editor. `on_screen`:
    the program of SEE, the arm of JOG, the recording of REPLAY, while it fills the screen. `drafted`: the unsaved text
    of SEE, as a file would hold it. `last_statement`: a bare DO repeats it. `typed`: the lines so far. `command_files`:
    the command files that are being carried out, the innermost last. `interrupted`: Ctrl-C or ABORT was given, and the
    lines after the present one are dropped. `left`: the user has gone, and the program that this user waited for goes
    on. `streams`: the streams of targets that the user has opened and not closed.
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
    streams: dict[StreamKind, TargetStream] = field(default_factory=dict)

    def show(self, it: object, question: OnScreen) -> Dialogue[bool]:
        """Show an object on the full screen until the user leaves it. Return False if the user has no such screen."""
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
