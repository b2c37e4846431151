"""Define the results of the engine and of programs: positions, commands, comparisons, reach, how a run ended, and
explanations.

Metres, radians, seconds.
"""

from __future__ import annotations

from collections.abc import Mapping
from enum import Enum

from msgspec import Struct

from vrs_cli.errors import Place
from vrs_cli.kinematics.joints import TURNING, Configuration, Joints, JointUnits
from vrs_cli.kinematics.transform import Transform, Vector
from vrs_cli.values.tagged import TaggedValue
from vrs_cli.values.world import Contact


class Position(Struct, frozen=True):
    """The robot at one time: joints [rad], their velocity [rad/s] and acceleration [rad/s2], T_world_tool [m].

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
    """A motion command, and when its motion begins and ends on the present timeline [s].

    If a later command has dropped the motion, `executed` is the commanded time and `end` is None. `asked`: the time
    stamp of the command; None for a motion that follows another.
    """

    number: int
    text: str
    issued: float
    executed: float
    end: float | None
    asked: float | None = None

    @property
    def is_displaced(self) -> bool:
        """Return whether the motion begins at another time than its time stamp."""
        return self.asked is not None and self.asked != self.executed


class Extent(Struct, frozen=True):
    """The size of a timeline. `duration`: from its start to its end [s]. `segments`: their number, without the initial
    segment s_0. `tool_path`: the length of the tool's path [m]; `joint_travel`: the sum of all joint rotations [rad];
    `joint_slide`: the sum of all joint slides [m].
    """

    duration: float
    commands: int
    segments: int
    tool_path: float
    joint_travel: float
    joint_slide: float = 0.0


class Pair(Struct, frozen=True):
    """A command of two timelines; None on the side that does not have it."""

    a: CommandRecord | None
    b: CommandRecord | None

    @property
    def text(self) -> str:
        return next(record.text for record in (self.a, self.b) if record is not None)


class Apart(Struct, frozen=True):
    """The maximum distance of two timelines, and its time [s]. `joint` counts from 1; 0: the distance of the tool."""

    distance: float
    time: float
    joint: int = 0


class Comparison(Struct, frozen=True):
    """The difference between two timelines. `since` [s]: the first time at which the two positions may differ; None if
    the timelines are equal. `tool` [m] and `joints` [rad]: the greatest distances at one time.
    """

    a: Extent
    b: Extent
    commands: tuple[Pair, ...]
    since: float | None
    tool: Apart
    joints: Apart


class Moved(Struct, frozen=True):
    """A scheduled motion that a command has displaced: when it began `before`, and begins `after` [s]. `asked`: its
    time stamp, None for a motion that follows another; `after` is None for a motion that was dropped.
    """

    text: str
    asked: float | None
    before: float
    after: float | None

    @property
    def later(self) -> float:
        """Return how much later the motion begins [s]; 0 for a motion that was dropped."""
        return 0.0 if self.after is None else self.after - self.before


class Displacement(Struct, frozen=True):
    """The motions that begin later, begin earlier, or were dropped, each list in order of time. `more`: later motions
    were not examined.
    """

    later: tuple[Moved, ...]
    earlier: tuple[Moved, ...]
    dropped: tuple[Moved, ...]
    more: bool = False


class Untrue(Struct, frozen=True):
    """A value of a signal that a program has read and that no longer holds, because an earlier part of the timeline
    changed.

    `number`: the number of the reading, as `Motion.number`. `on`: the value that was read; `changed`: the signal
    changed to `on` at the instant of the reading. `time` [s]: the time of the reading on the present timeline. `place`:
    program and step; `command`: the next motion command, empty if there is none; `name`: the name of the signal, or
    empty.
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
    """A motion that is possible instead of a straight line: the same line in another configuration (`words`), two lines
    through `via` (T_world_tool), or a MOVE (neither).
    """

    words: tuple[str, ...] = ()
    via: Transform | None = None


class LineCheck(Struct, frozen=True):
    """The straight line from the present position to a location. `length` [m]; `duration` [s] if the line is possible.
    Otherwise `trouble`: the error's text, `at` [m]: the distance at which the motion fails (None: not on the line), and
    the possible alternatives. `stops` [m]: the distances at which a possible line stops before its end.
    """

    length: float
    duration: float | None = None
    trouble: str = ""
    at: float | None = None
    ways_out: tuple[WayOut, ...] = ()
    stops: tuple[float, ...] = ()


class Overrun(Struct, frozen=True):
    """A joint, counted from 1, that would be outside its range; `by` [rad]: the signed distance beyond `limit`."""

    joint: int
    limit: float
    by: float


class Option(Struct, frozen=True):
    """One configuration for a location: its joints and the joints that are out of range, or the reason why no joints
    reach the location.

    `too_far` [m]: how far the location is out of reach; negative: too close; None if the joints are known or the
    distance is not.
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

    `chosen`: the configuration that MOVE would use, None if MOVE would fail; `reason`: the reason for this. `begin`,
    `end`: the tool tip now and at the location, in the world [m].
    """

    options: tuple[Option, ...]
    goal: Option | None
    chosen: Configuration | None
    reason: str
    line: LineCheck
    begin: Vector
    end: Vector


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
    """How a run ended; `value` is VAL-II's word for it."""

    COMPLETED = "Program completed"
    HALTED = "(HALTED)"
    PAUSED = "(PAUSED)"
    ABORTED = "(ABORTED)"
    FAILED = "error"
    STEPPED = "(STEP)"
    BREAKPOINT = "(BREAKPOINT)"
    WATCHED = "(WATCH)"


class StoppedTask(Struct, frozen=True):
    """Another task that stopped with an error, and when [s]."""

    number: int
    fault: ProgramFault
    at: float

    @property
    def where(self) -> str:
        return f"task {self.number} at {self.at:.3f} s"


class FollowReport(TaggedValue, frozen=True):
    """The result of following a chunk of targets from `begin` until the robot is at rest at `end` [s]: the number of
    samples that came too `late`, the number `held` at the end of a range, and the mean and the worst error of each
    joint [rad, m].
    """

    begin: float
    end: float
    late: int
    held: int
    mean: Joints
    worst: Joints


class RunResult(TaggedValue, frozen=True):
    """The result of a run: cycles completed, robot clock at begin and end [s], text typed, and the error if there was
    one.

    `beside`: other tasks that stopped with an error; `detail`: the new value of a watched expression.
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


# --- results of EXPLAIN (`render/explained.py` lays them out) ---------------------------------------------------------


class Explainable(Struct, frozen=True):
    """A form that EXPLAIN takes, and what it explains."""

    form: str
    summary: str


class ExplainOverview(TaggedValue, frozen=True):
    """EXPLAIN without an argument: its forms."""

    rows: tuple[Explainable, ...]


# --- a motion --------------------------------------------------------------------------------------------------------


class CutIn(Struct, frozen=True):
    """The motion that a new one interrupts: its number and text, its phase, the time at which that phase began [s], and
    the tool-tip speed at the interruption [m/s].
    """

    number: int
    text: str
    phase: str
    since: float
    speed: float


class Stretch(Struct, frozen=True):
    """A part of a motion, from `start` to `finish` [s]: the peak speeds of the tool tip [m/s] and of its rotation
    [rad/s], and the joint that comes nearest to its velocity limit, with its share of the limit.
    """

    start: float
    finish: float
    phase: str
    space: str
    speed: float
    turn: float
    joint: int
    share: float


class Peak(Struct, frozen=True):
    """The greatest value of a quantity in a motion, its limit, its first time [s], and the tool tip in the world at
    that time [m].
    """

    value: float
    limit: float
    time: float
    place: Vector

    @property
    def share(self) -> float:
        return self.value / self.limit if self.limit else 0.0


class JointLoad(Struct, frozen=True):
    """The load of one joint (from 1) in a motion: peak velocity, acceleration and jerk (None: not limited). `nearest`:
    the joint value that is nearest to an end of the range, and that end.
    """

    joint: int
    velocity: Peak
    acceleration: Peak
    jerk: Peak | None
    nearest: Peak

    @property
    def room(self) -> float:
        """Return the distance of the joint from that end of its range [rad, m]."""
        return abs(self.nearest.limit - self.nearest.value)


class MotionPlan(Struct, frozen=True):
    """The plan of a motion that has not been commanded.

    `begin`, `end` [s]. `cut`: the motion that it interrupts; None if it begins at rest. `speed`, `acceleration`:
    fractions of nominal. `length`: of the tool tip's path [m]. `tip`: the peak speed of the tool tip; its limit is the
    commanded speed of a straight line, otherwise 0. `joints`, `T_world_tool`, `configuration`: the position at its end.
    `displaced`: the effect on later motions; `contact`: the first contact of the arm; `notes`: messages that the robot
    would print.
    """

    begin: float
    end: float
    space: str
    profile: str
    speed: float
    acceleration: float
    cut: CutIn | None
    stretches: tuple[Stretch, ...]
    tip: Peak
    loads: tuple[JointLoad, ...]
    length: float
    joints: Joints
    T_world_tool: Transform
    configuration: Configuration
    path: tuple[Vector, ...] = ()
    displaced: Displacement | None = None
    contact: Contact | None = None
    notes: tuple[str, ...] = ()


class MotionReport(TaggedValue, frozen=True):
    """EXPLAIN of a motion, at the time `now` [s]: its plan, or the refusal, with the location where the motion fails if
    it is known.
    """

    text: str
    now: float
    plan: MotionPlan | None
    refusal: str = ""
    units: JointUnits = TURNING


# --- locations -------------------------------------------------------------------------------------------------------


class Factor(Struct, frozen=True):
    """A named factor of a chain, the frames on both sides of it, and the product of all factors up to it."""

    name: str
    outer: str
    inner: str
    T: Transform
    product: Transform


class ChainReport(TaggedValue, frozen=True):
    """EXPLAIN of a location: `factors` from the world to the location. `arm`: the factors from the world to the flange
    (BASE, the location, TOOL), whose product inverse kinematics solves. `joints` [rad]: of a precision point, whose
    factors are the links.
    """

    text: str
    factors: tuple[Factor, ...]
    arm: tuple[Factor, ...] = ()
    joints: Joints = ()
    units: JointUnits = TURNING


class AnglesReport(TaggedValue, frozen=True):
    """EXPLAIN OAT: O, A, T [rad] and the rotations whose product is the orientation: Rz(O), M, Ry(A), Rz(T).
    `vertical`: O and T turn about one axis, so only their sum or difference is determined.
    """

    text: str
    T: Transform
    angles: Vector
    turns: tuple[Transform, Transform, Transform, Transform]
    vertical: bool


class SolutionSteps(Struct, frozen=True):
    """One configuration of EXPLAIN IK: the intermediate values by their symbols, and the time that the slowest joint
    takes from here at full velocity [s]; None if the configuration cannot be used.
    """

    option: Option
    steps: Mapping[str, float] = {}
    time: float | None = None


class InverseReport(TaggedValue, frozen=True):
    """EXPLAIN IK. `method`: how the arm finds its joints; `constants`: its lengths and angles by symbol. `senses`: how
    joints of the formulas become joints of the robot, joint = sign (theta - offset); empty if they are the same.
    `chosen`: the configuration that MOVE uses, None if MOVE fails; `reason`: the reason for this.
    """

    text: str
    method: str
    T_robot_flange: Transform
    constants: Mapping[str, float]
    solutions: tuple[SolutionSteps, ...]
    chosen: Configuration | None
    reason: str
    here: Joints
    have: Configuration
    senses: tuple[tuple[float, float], ...] = ()
    units: JointUnits = TURNING


# --- the last change -------------------------------------------------------------------------------------------------


class SegmentFate(Enum):
    """The effect of a timeline change on a segment."""

    KEPT = "kept"
    CUT = "cut"
    DROPPED = "dropped"
    PLANNED = "planned"
    AGAIN = "planned again"
    SHIFTED = "shifted"
    BACK = "given back"


class SplicedSegment(Struct, frozen=True):
    """A segment of the motion with this number and text, with its start and finish [s] before and after a change; None
    where it does not exist.
    """

    number: int
    text: str
    phase: str
    space: str
    before: tuple[float, float] | None
    after: tuple[float, float] | None
    fate: SegmentFate


class SpliceReport(TaggedValue, frozen=True):
    """EXPLAIN SPLICE: the last change by a command, UNDO or REDO (`cause`), with the times of the command [s].

    `earlier`, `later`: the number of unchanged segments before the rows, and of segments after the rows that are
    shifted by `shift` [s].
    """

    text: str
    cause: str
    issued: float
    executed: float
    cut: float
    shift: float
    rows: tuple[SplicedSegment, ...]
    earlier: int = 0
    later: int = 0
