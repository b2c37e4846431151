"""Define base classes of values that leave a process (a tag names the class of a value), and the results of the engine
and of programs: positions, commands, comparisons, reach, outcomes of runs, and messages. Units are metres, radians,
seconds."""

from __future__ import annotations

from collections.abc import Mapping
from enum import Enum
from typing import Generic, TypeVar

from msgspec import Struct

from vrs_cli.errors import Place
from vrs_cli.kinematics.joints import Joints
from vrs_cli.kinematics.transform import Transform

T = TypeVar("T", covariant=True)


class TaggedValue(Struct, frozen=True, tag_field="kind", tag=True):
    """A value that is sent between a robot and its clients. The tag `kind` is the name of its class."""


class Act(TaggedValue, Generic[T], frozen=True):
    """A request to a robot; T is the type of its result."""


class RobotAct(Act[T], Generic[T], frozen=True):
    """A request to the robot; `interfaces/session/acts.py` executes it. A user may send it if his role allows the
    VAL-II command with the same effect."""


class UserAct(Act[T], Generic[T], frozen=True):
    """A request about the user's own question, editor or screen; `interfaces/conversation` executes it."""


class Position(Struct, frozen=True):
    """The state of the robot at one time: joints [rad], their velocity [rad/s] and acceleration [rad/s2], T_world_tool
    [m].

    `hand` is 1 open, 0 closed. `text`: the instruction of the current motion, or of the last one if the robot is at
    rest.
    """

    time: float
    joints: Joints
    velocity: Joints
    acceleration: Joints
    T_world_tool: Transform
    hand: float
    moving: bool
    text: str


class CommandRecord(Struct, frozen=True):
    """A motion command, and the times at which its motion begins and ends on the current timeline [s]. If a later
    command has dropped the motion, `executed` is the commanded time and `end` is None. `asked`: the time stamp of the
    command; None if it has none, so that the motion begins after the previous one."""

    number: int
    text: str
    issued: float
    executed: float
    end: float | None
    asked: float | None = None

    @property
    def is_displaced(self) -> bool:
        """Return whether the motion begins at a time that differs from its time stamp."""
        return self.asked is not None and self.asked != self.executed


class Moved(Struct, frozen=True):
    """A scheduled motion that a command has moved in time or dropped: the start of the motion `before` and `after` this
    command [s]. `asked`: its time stamp; None if it has none. `after` is None if the motion was dropped."""

    text: str
    asked: float | None
    before: float
    after: float | None

    @property
    def later(self) -> float:
        """Return the delay of the motion's start [s]; 0 if the motion was dropped."""
        return 0.0 if self.after is None else self.after - self.before


class Displacement(Struct, frozen=True):
    """The motions that begin later, begin earlier, or were dropped, each list in order of time. `more`: later motions
    exist, but were not examined."""

    later: tuple[Moved, ...]
    earlier: tuple[Moved, ...]
    dropped: tuple[Moved, ...]
    more: bool = False


class Untrue(Struct, frozen=True):
    """A signal value that a program has read and that no longer holds, because an earlier part of the timeline changed.
    `number`: the number of the reading, as in `Motion.number`. `on`: the value that was read; `changed`: the signal
    changed to `on` at the instant of the reading. `time` [s]: the time of the reading on the current timeline. `place`:
    the program and step; `command`: the next motion command, empty if there is none; `name`: the name of the signal, or
    empty."""

    number: int
    signal: int
    on: bool
    changed: bool
    time: float
    place: str = ""
    command: str = ""
    name: str = ""


class ProgramFault(Struct, frozen=True):
    """The error that stopped a program, and where it occurred. `step` counts from 1; `line` is the line of the file;
    `source` its text.

    `text` is VAL-II's message; `message` adds the detail and the hint. `numbers`: the error's data. `in_python`: the
    message for callers of the Python API; empty if it equals `message`.
    """

    code: int
    text: str
    message: str
    program: str
    step: int
    line: int
    source: str
    numbers: Mapping[str, float | Place]
    in_python: str = ""


class RunOutcome(Enum):
    """The way in which a program run ended; the value is VAL-II's message."""

    COMPLETED = "Program completed"
    HALTED = "(HALTED)"
    PAUSED = "(PAUSED)"
    ABORTED = "(ABORTED)"
    FAILED = "error"
    STEPPED = "(STEP)"
    BREAKPOINT = "(BREAKPOINT)"
    WATCHED = "(WATCH)"


class StoppedTask(Struct, frozen=True):
    """A task other than the main program that stopped with an error; `at`: the time at which it stopped [s]."""

    number: int
    fault: ProgramFault
    at: float

    @property
    def where(self) -> str:
        return f"task {self.number} at {self.at:.3f} s"


class FollowReport(TaggedValue, frozen=True):
    """The result of following a chunk of targets from `begin` until the robot is at rest at `end` [s]: the number of
    samples that arrived too `late`, the number of samples `held` at a joint limit, and the mean and the maximum error
    of each joint [rad, m]."""

    begin: float
    end: float
    late: int
    held: int
    mean: Joints
    worst: Joints


class ResyncReport(TaggedValue, frozen=True):
    """The result of RESYNC: at `t` [s] the timeline begins to move to the measured joints, and at `until` [s] the arm
    follows it again. `distances`: the differences between the timeline and the measured joints [rad, m]. `goal`: the
    text of the next target; empty if the robot stays where it is."""

    t: float
    until: float
    distances: Joints
    goal: str = ""


class RunResult(TaggedValue, frozen=True):
    """The result of a program run: completed cycles, robot clock at its start and end [s], lines printed with TYPE, and
    the error if there was one. `beside`: other tasks that stopped with an error; `detail`: the new value of a watched
    expression."""

    program: str
    cycles: int
    started: float
    ended: float
    typed: tuple[str, ...]
    fault: ProgramFault | None
    outcome: RunOutcome
    beside: tuple[StoppedTask, ...] = ()
    detail: str = ""


# --- messages and files -----------------------------------------------------------------------------------------------


class Tone(Enum):
    """The tone of a message: NOTE reports what was done; WARNING and ERROR report a mistake."""

    NOTE = "note"
    WARNING = "warning"
    ERROR = "error"


class Message(TaggedValue, frozen=True):
    """A message of one or more lines."""

    text: str
    tone: Tone = Tone.NOTE


class ProgramStopped(TaggedValue, frozen=True):
    """The message that a program stopped early. `what`: VAL-II's word or message for the stop; `step` counts from 1.
    `source`: the text of the step, empty if there is none."""

    what: str
    program: str
    step: int
    source: str = ""
    tone: Tone = Tone.NOTE


class FileRow(Struct, frozen=True):
    """A row of FDIRECTORY: `size` in bytes, None for a folder."""

    name: str
    size: int | None
