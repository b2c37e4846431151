"""Results of the engine and of programs, as values: positions, commands, comparisons, reach, how a run ended.

Metres, radians, seconds.
"""

from __future__ import annotations

from collections.abc import Mapping
from enum import Enum

from msgspec import Struct

from vrs_cli.errors import Place
from vrs_cli.kinematics.joints import Configuration, Joints
from vrs_cli.kinematics.transform import Transform, Vector
from vrs_cli.values.tagged import Spoken


class Position(Struct, frozen=True):
    """The robot at one time: joints [rad], their velocity [rad/s] and acceleration [rad/s2], T_world_tool [m].

    `hand` is 1 open, 0 closed. `text`: the instruction of the motion in force (the last one, while the robot stands).
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
    """A motion command and what became of it: when its motion begins and ends on the present timeline [s].

    `executed` is as commanded and `end` None for a motion that a later command has dropped. `asked`: the time that was
    given with it; None for a motion that follows another.
    """

    number: int
    text: str
    issued: float
    executed: float
    end: float | None
    asked: float | None = None

    @property
    def displaced(self) -> bool:
        """Return whether the motion begins at another time than was asked."""
        return self.asked is not None and self.asked != self.executed


class Extent(Struct, frozen=True):
    """`duration`: from the start of the timeline to its end [s]. `segments`: without s_0. `tool_path`: how far the tool
    goes [m], `joint_travel`: how far all joints together turn [rad], `joint_slide`: those that slide [m]."""

    duration: float
    commands: int
    segments: int
    tool_path: float
    joint_travel: float
    joint_slide: float = 0.0


class Pair(Struct, frozen=True):
    """A command on both sides, or on one of them only."""

    a: CommandRecord | None
    b: CommandRecord | None

    @property
    def text(self) -> str:
        return next(record.text for record in (self.a, self.b) if record is not None)


class Apart(Struct, frozen=True):
    """A greatest distance, and the time of it [s]. `joint` counts from 1; 0: the distance is that of the tool."""

    distance: float
    time: float
    joint: int = 0


class Comparison(Struct, frozen=True):
    """`since`: the first time at which the robot may be elsewhere [s], None where the two are the same throughout.

    `tool` [m] and `joints` [rad] are the greatest distances at one time.
    """

    a: Extent
    b: Extent
    commands: tuple[Pair, ...]
    since: float | None
    tool: Apart
    joints: Apart


class Moved(Struct, frozen=True):
    """A scheduled motion: when it was to begin, and when it begins now [s]. `asked`: its time stamp, None for a motion
    that follows another; `after`: None for a motion that was dropped.
    """

    text: str
    asked: float | None
    before: float
    after: float | None

    @property
    def later(self) -> float:
        """By how much it begins later [s]; 0 for a motion that was dropped."""
        return 0.0 if self.after is None else self.after - self.before


class Displacement(Struct, frozen=True):
    """Motions that begin later than they did, that begin earlier, and that were dropped, each in order of time.

    `more`: there are others behind them, which were not looked at.
    """

    later: tuple[Moved, ...]
    earlier: tuple[Moved, ...]
    dropped: tuple[Moved, ...]
    more: bool = False


class Untrue(Struct, frozen=True):
    """What a program read of a signal that no longer holds, since an earlier part of the timeline has changed.

    `number`: of the reading, as `Motion.number`. `on`: what it read; `changed`: the signal became so at that instant.
    `time` [s]: where the reading stands now. `place`: program and step, `command`: the motion that was given next,
    empty where there was none; `name`: of the signal, if it has one.
    """

    number: int
    signal: int
    on: bool
    changed: bool
    time: float
    place: str = ""
    command: str = ""
    name: str = ""


class WayOut(Struct, frozen=True):
    """A motion that would do instead of a straight line: the same in another configuration (`words`), two lines by way
    of `via` (T_world_tool), or a MOVE (neither).
    """

    words: tuple[str, ...] = ()
    via: Transform | None = None


class LineCheck(Struct, frozen=True):
    """The straight line from here. `length` [m]; `duration` [s] where it is possible, else what stops it: the error's
    text, where (`at` [m] from here, None where not on the line), and the ways out. `stops` [m]: after how much of the
    way a line that is possible comes to rest, and goes on.
    """

    length: float
    duration: float | None = None
    trouble: str = ""
    at: float | None = None
    ways_out: tuple[WayOut, ...] = ()
    stops: tuple[float, ...] = ()


class Overrun(Struct, frozen=True):
    """A joint, counted from 1, that would be outside its range; `by` [rad]: beyond `limit`, with its sign."""

    joint: int
    limit: float
    by: float


class Option(Struct, frozen=True):
    """One configuration: its joints, and those that are out of range; or why there are none.

    `too_far` [m]: by how much the location is; negative: too close; None where `joints` are known, or it is not known.
    """

    configuration: Configuration
    joints: Joints | None
    overruns: tuple[Overrun, ...] = ()
    too_far: float | None = None

    @property
    def usable(self) -> bool:
        return self.joints is not None and not self.overruns


class Reach(Struct, frozen=True):
    """The answer to WHY. `options` is empty for a precision point, which has one set of joints: `goal`.

    `chosen`: what MOVE would take, and `reason` why; where it is refused `chosen` is None and `reason` says why not.
    `begin`, `end`: the tool tip now and at the location, in the world [m].
    """

    options: tuple[Option, ...]
    goal: Option | None
    chosen: Configuration | None
    reason: str
    line: LineCheck
    begin: Vector
    end: Vector


class ProgramFault(Struct, frozen=True):
    """The place where a program stopped with an error. `step` counts from 1; `line` is that of its file; `source` its
    text.

    `text` is VAL-II's message, `message` the whole of it with what happened and what would be right. `numbers`: those
    of the error.
    """

    code: int
    text: str
    message: str
    program: str
    step: int
    line: int
    source: str
    numbers: Mapping[str, float | Place]


class RunOutcome(Enum):
    """The way in which a run ended; `value` is VAL-II's word for it."""

    COMPLETED = "Program completed"
    HALTED = "(HALTED)"
    PAUSED = "(PAUSED)"
    ABORTED = "(ABORTED)"
    FAILED = "error"
    STEPPED = "(STEP)"
    BREAKPOINT = "(BREAKPOINT)"
    WATCHED = "(WATCH)"


class StoppedTask(Struct, frozen=True):
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
    outcome: RunOutcome
    beside: tuple[StoppedTask, ...] = ()
    detail: str = ""
