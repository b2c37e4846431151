"""Results of the engine and of programs, as values: positions, commands, comparisons, reach, how a run ended, and
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
from vrs_cli.values.tagged import Spoken
from vrs_cli.values.world import Contact


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
    def is_displaced(self) -> bool:
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
    of the error. `in_python`: the message for who calls methods; empty: it is the same.
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


class FollowReport(Spoken, frozen=True):
    """How a chunk is followed from `begin` until the robot rests at `end` [s]: how many samples were too `late` for it,
    or `held` at the end of a range, and the mean and the worst error of each joint at the others [rad, m].
    """

    begin: float
    end: float
    late: int
    held: int
    mean: Joints
    worst: Joints


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


# --- what EXPLAIN shows: replies, which `render/explained.py` lays out ----------------------------------------------


class Explainable(Struct, frozen=True):
    """A form that EXPLAIN takes, and what it then explains."""

    form: str
    summary: str


class ExplainOverview(Spoken, frozen=True):
    """EXPLAIN alone."""

    rows: tuple[Explainable, ...]


# --- a motion --------------------------------------------------------------------------------------------------------


class CutIn(Struct, frozen=True):
    """Where a motion interrupts another: the number and text of that, the phase it is in, since when that phase lasts
    [s], and the speed of the tool tip then [m/s].
    """

    number: int
    text: str
    phase: str
    since: float
    speed: float


class Stretch(Struct, frozen=True):
    """A part of a motion, from `start` to `finish` [s], with the peak speeds of the tool tip [m/s] and of its turn
    [rad/s], and the joint that comes nearest to its limit of velocity, with that share of it.
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
    """The greatest size of a quantity in a motion, its limit, the first time [s] and the place of the tool tip in the
    world [m] then.
    """

    value: float
    limit: float
    time: float
    place: Vector

    @property
    def share(self) -> float:
        return self.value / self.limit if self.limit else 0.0


class JointLoad(Struct, frozen=True):
    """What a motion asks of one joint (from 1): peak velocity, acceleration and jerk (None: not limited), and where it
    is nearest to an end of its range: `nearest` has that joint value and that end.
    """

    joint: int
    velocity: Peak
    acceleration: Peak
    jerk: Peak | None
    nearest: Peak

    @property
    def room(self) -> float:
        """How far the joint stays from that end of its range [rad, m]."""
        return abs(self.nearest.limit - self.nearest.value)


class MotionPlan(Struct, frozen=True):
    """A motion as it would be done.

    `begin`, `end` [s]. `cut`: what it interrupts; None where it begins at rest. `speed`, `acceleration`: parts of the
    nominal ones. `length`: the way of the tool tip [m]. `tip`: its peak speed, with the speed that is asked of a
    straight line as its limit, else 0. `joints`, `T_world_tool`, `configuration`: where it ends. `displaced`: what
    becomes of later motions; `contact`: the first thing that the arm touches; `notes`: what the robot would say.
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


class MotionReport(Spoken, frozen=True):
    """EXPLAIN of a motion, asked at `now` [s]: its plan, or the refusal with its place, where that is known."""

    text: str
    now: float
    plan: MotionPlan | None
    refusal: str = ""
    units: JointUnits = TURNING


# --- locations -------------------------------------------------------------------------------------------------------


class Factor(Struct, frozen=True):
    """A factor of a chain by name, the frames on both sides of it, and the product of all factors up to it."""

    name: str
    outer: str
    inner: str
    T: Transform
    product: Transform


class ChainReport(Spoken, frozen=True):
    """EXPLAIN of a location: `factors` from the world to the location. `arm`: those from the world to the flange (BASE,
    the location, TOOL) with the product that inverse kinematics solves; `joints` [rad] of a precision point, whose
    factors are the links.
    """

    text: str
    factors: tuple[Factor, ...]
    arm: tuple[Factor, ...] = ()
    joints: Joints = ()
    units: JointUnits = TURNING


class AnglesReport(Spoken, frozen=True):
    """EXPLAIN OAT: O, A, T [rad] and the rotations whose product is that of T: Rz(O), M, Ry(A), Rz(T). `vertical`: O
    and T turn about one axis, so that only their sum or difference counts.
    """

    text: str
    T: Transform
    angles: Vector
    turns: tuple[Transform, Transform, Transform, Transform]
    vertical: bool


class SolutionSteps(Struct, frozen=True):
    """One configuration: the values found on the way by their symbols, and how long the slowest joint takes from here
    at full velocity [s]; None where the configuration is of no use.
    """

    option: Option
    steps: Mapping[str, float] = {}
    time: float | None = None


class InverseReport(Spoken, frozen=True):
    """EXPLAIN IK. `method`: how the arm finds its joints; `constants`: its lengths and angles by symbol. `senses`: how
    joints of the formulas become those of the robot, joint = sign (theta - offset); empty where they are the same.
    `chosen`: what MOVE takes, and `reason` why; where it is refused `chosen` is None and `reason` says why not.
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
    """What a change of the timeline does to a segment."""

    KEPT = "kept"
    CUT = "cut"
    DROPPED = "dropped"
    PLANNED = "planned"
    AGAIN = "planned again"
    SHIFTED = "shifted"
    BACK = "given back"


class SplicedSegment(Struct, frozen=True):
    """A segment of the motion with this number and text, with its start and finish [s] before and after a change; None
    where it is not there.
    """

    number: int
    text: str
    phase: str
    space: str
    before: tuple[float, float] | None
    after: tuple[float, float] | None
    fate: SegmentFate


class SpliceReport(Spoken, frozen=True):
    """EXPLAIN SPLICE: the last change, of a command, UNDO or REDO (`cause`), with the times of the command [s].

    `earlier`, `later`: segments that stay before the rows, and that are shifted behind them, by `shift` [s].
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
