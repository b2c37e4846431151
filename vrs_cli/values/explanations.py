"""What EXPLAIN shows, as values: a motion before it is done, chains of transformations, angles, inverse kinematics, and
the last change of the timeline. They are replies (`replies.py`); `render/explained.py` lays them out.

Metres, radians, seconds.
"""

from __future__ import annotations

from collections.abc import Mapping
from enum import Enum

from msgspec import Struct

from vrs_cli.kinematics.joints import TURNING, Configuration, Joints, JointUnits
from vrs_cli.kinematics.transform import Transform, Vector
from vrs_cli.values.contacts import Contact
from vrs_cli.values.results import Displacement, Option
from vrs_cli.values.tagged import Spoken


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


class Fate(Enum):
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
    fate: Fate


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
